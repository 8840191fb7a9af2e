"""The pages as HTML, by Jinja2; all text from data is escaped."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterable, Sequence
from functools import cache
from importlib import resources
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, pass_context
from jinja2.runtime import Context
from markupsafe import Markup, escape

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.views import glossary
from pitchlore.pipeline.views.commentary.words import in_digits, percent, with_minus
from pitchlore.pipeline.views.replay import asset, strict
from pitchlore.pipeline.views.scout.moments import moment
from pitchlore.pipeline.views.scout.shooting import outcome_words
from pitchlore.pipeline.views.scout.words import sure_words

#: Files that stand beside the pages.
STYLE, SCRIPT, COMPARE, MAP = "scout.css", "scout.js", "compare.js", "map.js"
#: Further style sheets and scripts, which are added to those two.
_MORE_STYLE = ("marks.css", "map.css", "states.css", "looks.css", "print.css")
_MORE_SCRIPT = ("pick.js", "looks.js")


@cache
def _environment() -> Environment:
    made = Environment(
        loader=PackageLoader("pitchlore.pipeline.views.scout"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True)
    made.filters |= {"percent": percent, "clock": _clock, "number": in_digits, "minus": with_minus,
                     "code": "{:03d}".format, "short": _short, "number_of": number_of}
    made.filters |= {"outcome": outcome_words, "shell": shlex.quote, "typed": _typed, "sure": sure_words}
    made.globals |= {"moment": _moment, "few_goals": _few_goals, "terms": glossary.TERMS}
    return made


def rendered(name: str, *, up: str = "", of: str | None = None, **facts: Any) -> bytes:
    """A page from its template.

    Args:
        name: name of the template.
        up: leads from the page to the scout's folder.
        of: id of the match that the page is of: its addresses begin at the match's replay.
        facts: values for the template.
    """
    page = _environment().get_template(f"{name}.html").render(up=up, of=of, **facts)
    return re.sub(r"(?<=\d) %", "\u00a0%", page).encode()  # a number and its sign stay on one line


def page_files(first: Sequence[str] = ()) -> dict[str, bytes]:
    """The style sheet and the scripts; the replay's code is in that of all pages.

    Args:
        first: names of the files of the teams that menus begin with.
    """
    own = resources.files(__name__.rpartition(".")[0]).joinpath("templates")
    styles, scripts = ([own.joinpath(name).read_text(encoding="utf-8") for name in names]
                       for names in ((STYLE, *_MORE_STYLE), (SCRIPT, *_MORE_SCRIPT)))
    script = strict(glossary.words_script(), asset("match.js"), asset("draw.js"), *scripts,
                    f"menuFirst({json.dumps(first)});\n")
    return {SCRIPT: script.encode(), STYLE: "\n".join([*styles, glossary.words_style()]).encode(),
            **{name: own.joinpath(name).read_bytes() for name in (COMPARE, MAP)}}


def _typed(text: str) -> Markup:
    """A text whose parts between backticks are typed."""
    return Markup(re.sub("`(.*?)`", r"<code>\1</code>", str(escape(text))))  # noqa: S704 (it is escaped)


@pass_context
def _moment(
    context: Context, match: str, at: float, team: str = "", robot: int | None = None,
    behaviour: str = "", ours: str | None = None,
) -> str:
    """:func:`moment`, from the page; ``ours`` is, where nothing is given, the side of the page's team."""
    ours = ours or context.get("side_of", {}).get(match, "")
    return moment(match, at, team, robot, behaviour, up=context["up"], of=context["of"], ours=ours)


@pass_context
def _few_goals(context: Context, kinds: Iterable[str]) -> Markup:
    """Notes on leagues whose V rests on few goals."""
    few = context.get("few_goals_in", {})
    return Markup("\n").join(Markup('<p class="note">{}</p>').format(few[kind])
                             for kind in sorted({*kinds}) if kind in few)


def _short(match: str) -> str:
    """A match's id without the digest at its end."""
    return re.sub(r"(?<=.)-[0-9a-f]{12}$", "", match)


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
