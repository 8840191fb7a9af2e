"""The replay page: a match with its situations and goals, for a browser.

One self-contained HTML file: markup from ``page.html``, style from ``page.css``, the scripts of
:data:`SCRIPTS`, and the match as one deflated, base64-encoded payload. The page fetches nothing. All text
from data is inside the payload, or escaped in the title, so data can never become markup.

A page in the scout's folder (:func:`linked`) has neither style, scripts nor payload. It loads those of all
replays, the script with the match's payload that the clips load too, and the list of the teams' behaviours.

The payload's format is documented in :mod:`pipeline.views.replay.packing`.
"""

from __future__ import annotations

import base64
import html
import json
import struct
import zlib
from collections.abc import Sequence
from importlib import resources
from typing import Any

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.game.pitch import MARKINGS, SCALES, Kind, Pitch
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.pipeline.views import glossary
from pitchlore.pipeline.views.replay.packing import (
    TURN,
    milliseconds,
    quantum_of,
    samples_of,
    situated,
    tick_of,
)
from pitchlore.schemas import SIDES, note_on

#: Samples further apart are never joined, seconds.
GAP_S = 0.5

#: The situations' families and their codes, first to last (paper Table 1).
FAMILIES: tuple[tuple[str, tuple[tuple[int, int], ...]], ...] = (
    ("has the ball", ((1, 11),)),
    ("kicks, loses or leaves it", ((21, 33),)),
    ("to and from the ball", ((34, 47), (67, 68))),
    ("orients", ((57, 57), (78, 78), (108, 108))),
    ("to and from the goals", ((88, 98), (118, 128))),
    ("to and from robots", ((138, 174),)),
    ("does not move", ((184, 184),)),
    ("moves randomly", ((194, 194),)),
)

#: The page's scripts, in their order: the payload read, painting, what can be found, the list of it, mouse
#: and fingers, where the payload comes from, and keys, clicks and time.
SCRIPTS = ("match.js", "draw.js", "find.js", "panel.js", "pointers.js", "load.js", "controls.js")

#: Names of teams that say which colour their robots wear in the leagues of two colours.
WORN = ("blue", "yellow")

#: What a page says whose code is missing; the code removes it.
_LONE = ('<p id="lone">The code of this page is missing: replay.js belongs into the folder above. '
         "Copy the scout's folder as a whole.</p>")

def page(
    match: MatchTables, *, hz: float = 20.0, near: float = 0.0, reported: Sequence[tuple[int, str]] = ()
) -> str:
    """The page as HTML; the same tables give the same page.

    The page shows the first sample of each 1 / ``hz`` seconds. Between two samples of one stretch of play it
    moves bodies evenly. With ``near`` it leaves out samples to which this brings all bodies so near, and all
    headings within 0.2 rad. Errors of rounding come on top: half a quantum in position (0.5 mm; 2D:
    2.5 mm; with ``near`` at most an eighth of it), 1 ms in time, and 0.35 degrees in heading. Missing bodies
    and gaps stay missing.

    Args:
        match: its samples, situations, goals, passes and shots are shown.
        hz: most samples shown a second, in (0, 1000].
        near: how far from its place a body may be shown because of a sample that is left out, metres, at
            least 0.
        reported: the commentary's sentences with their times, ns since the first sample, by time.

    Raises:
        NotFound: if there is nothing to show.
        BadSettings: if ``hz`` or ``near`` is out of its bounds.
        SchemaMismatch: if situations of one robot overlap.
    """
    facts, packed = payload(match, hz=hz, near=near, reported=reported)
    return _filled(facts["home"], facts["away"], packed, source="", allowed="'unsafe-inline'",
                   style=f"<style>\n{style()}</style>", code=f"<script>\n{script()}\n</script>")


def linked(match_id: str, home: str, away: str, *, up: str = "../") -> str:
    """The page of a match whose payload is in the script ``data/ID.js`` of the folder to which ``up`` leads.

    That script calls ``scoutMatch(ID, payload)``. ``known.js`` beside ``data`` calls
    ``scoutKnown(list of [league, team, ids of behaviours])``. The code is ``replay.js`` (:func:`script`), the
    style ``replay.css`` (:func:`style`).

    The page leads back to ``matches/ID.html`` and ``index.html`` of that folder.

    Args:
        match_id: id of the match.
        home: name of the home team, for the title.
        away: name of the away team.
        up: leads from the page to that folder.
    """
    source = f' data-match="{html.escape(match_id)}" data-up="{html.escape(up)}"'
    match, league = (html.escape(f"{up}{page}.html") for page in (f"matches/{match_id}", "index"))
    back = f'  <nav aria-label="pages"><a href="{match}">the match</a> <a href="{league}">league</a></nav>\n'
    return _filled(home, away, "", source=source, allowed="'self' file:", back=back,
                   style=f'<link rel="stylesheet" href="{html.escape(up)}replay.css">',
                   code=f'{_LONE}\n<script src="{html.escape(up)}replay.js"></script>')


def script() -> str:
    """The page's code; in the scout's folder it is the file ``replay.js``."""
    return strict(glossary.words_script(), *(asset(name) for name in SCRIPTS))


def strict(*code: str) -> str:
    """Pieces of code as one strict script, in which ``MARKINGS`` has the lines of each league's pitch."""
    markings = json.dumps({kind: lines._asdict() for kind, lines in MARKINGS.items()})
    return "\n".join(['"use strict";', f"const MARKINGS = {markings};", *code])


def style() -> str:
    """The page's style; in the scout's folder it is the file ``replay.css``."""
    return f"{asset('page.css')}{glossary.words_style()}"


def _filled(
    home: str, away: str, packed: str, *, source: str, allowed: str, style: str, code: str, back: str = ""
) -> str:
    """The page with its blanks filled.

    Style and scripts may come from what is ``allowed``, ``source`` says whence the match comes, ``back``
    leads to pages about it.
    """
    blank = asset("page.html").replace("{{code}}", code).replace("{{style}}", style)
    blank = blank.replace("{{allowed}}", allowed)
    blank = blank.replace("{{back}}", back).replace("{{source}}", source).replace("{{payload}}", packed)
    # the title goes in last, so that nothing in it is taken for a blank to fill
    return blank.replace("{{title}}", html.escape(f"{home} – {away} · Pitchlore replay"))


def payload(
    match: MatchTables, *, hz: float = 20.0, near: float = 0.0, reported: Sequence[tuple[int, str]] = ()
) -> tuple[dict[str, Any], str]:
    """The facts of a match, and the payload (see the module); arguments and errors as for :func:`page`."""
    if not 0 < hz <= 1000:
        raise BadSettings(f"hz cannot be {hz}", where="replay", next_step="Choose one in (0, 1000]")
    if not 0 <= near < np.inf:
        raise BadSettings(f"near cannot be {near}", where="replay", next_step="Choose one of at least 0 m")
    trajectories, situations = match.trajectories, match.situations
    if trajectories.is_empty():
        raise NotFound("has no trajectories", where=match.name, next_step="Run `pitchlore run` on it first")
    bodies, shown, quantum = _bodies(trajectories), _shown(trajectories, hz), quantum_of(match.pitch, near)
    tick = tick_of(shown["t_ns"], situations)
    samples = samples_of(trajectories, bodies, shown, tick)
    if near:
        kept = samples.near(near)
        shown, samples = shown.filter(kept), samples.taken(kept)
    done = situated(situations, bodies, match.gap_s, tick)
    facts = _facts(match, bodies, shown, situations) | {
        "quantum": quantum, "tick": tick, "situations": done.facts,
        "told": [(round(t_ns / 1e6), text) for t_ns, text in reported],
        "passes": _passes(match.passes), "shots": _shots(match.shots)}
    text = json.dumps(facts, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    raw = struct.pack("<I", len(text)) + text + samples.packed(quantum) + done.packed
    return facts, base64.b64encode(zlib.compress(raw, 8)).decode("ascii")


def asset(name: str) -> str:
    """The text of a file of the page."""
    return resources.files(__name__).joinpath(name).read_text(encoding="utf-8")


def _bodies(trajectories: pl.DataFrame) -> pl.DataFrame:
    """Every body of the match: team, robot and its index ``body``; the ball, home, then away."""
    return trajectories.select("team", "robot").unique().sort("team", "robot").with_row_index("body")


def _shown(trajectories: pl.DataFrame, hz: float) -> pl.DataFrame:
    """The frames to show: frame, t_ns, segment, ``ms``, ``joined``, and the index ``sample``."""
    slot_ns = 1e9 / hz
    gap_ns = int(GAP_S * 1e9)
    return (
        trajectories.group_by("frame")
        .agg(pl.col("t_ns").first(), pl.col("segment").max())
        .sort("t_ns", "frame")
        # half a microsecond of grace for times that were rounded down from the slot's edge
        .unique(((pl.col("t_ns") + 500) / slot_ns).floor(), keep="first", maintain_order=True)
        .with_columns(
            ms=milliseconds("t_ns"),
            joined=(
                pl.col("segment").eq_missing(pl.col("segment").shift())
                & (pl.col("t_ns").diff() <= gap_ns).fill_null(value=False)
            ),
        )
        .with_row_index("sample")
    )


def _facts(
    match: MatchTables, bodies: pl.DataFrame, shown: pl.DataFrame, situations: pl.DataFrame
) -> dict[str, Any]:
    """The JSON half of the payload; all times are milliseconds since the first sample."""
    row, pitch, referee = match.matches.row(0, named=True), match.pitch, match.referee
    kept = ("match_id", "home", "away", "complete", "incomplete_reason")
    scales = SCALES[pitch.kind]
    scores = referee.drop_nulls(["score_home", "score_away"]).sort("t_ns", maintain_order=True)
    play = shown.drop_nulls("segment").group_by("segment", maintain_order=True)
    stretches = play.agg(pl.col("ms").min().alias("start"), pl.col("ms").max().alias("end"))
    events = referee.sort("t_ns", maintain_order=True)
    return {name: row[name] for name in kept} | {
        "note": note_on(row["home"], row["away"]),
        "worn": _worn(row["home"], row["away"], pitch),
        "pitch": pitch.model_dump(mode="json"),
        "robot_radius": scales.robot_radius,
        "ball_radius": scales.ball_radius,
        "gap": int(GAP_S * 1e3),
        "turn": TURN,
        "samples": len(shown),
        "bodies": bodies.select("team", "robot").rows(),
        "play": stretches.select("start", "end").rows(),
        "scores": scores.select(milliseconds("t_ns"), "score_home", "score_away").rows(),
        "goals": match.goals.sort("t_ns").select(milliseconds("t_ns"), "team", "robot", "kind").rows(),
        "events": events.select(milliseconds("t_ns"), "event", "team", "note").rows(),
        "families": FAMILIES,
        "names": {str(code): TABLE_1[code][0] for code in situations["code"].unique().sort()},
    }


def _worn(home: str, away: str, pitch: Pitch) -> dict[str, str] | None:
    """The colour that each side wears, if the league has two and the teams are named by them; else None."""
    names = [name.strip().lower() for name in (home, away)]
    known = pitch.kind in (Kind.VSSS, Kind.SSL) and sorted(names) == sorted(WORN)
    return dict(zip(SIDES, names, strict=True)) if known else None


def _passes(passes: pl.DataFrame) -> list[tuple[Any, ...]]:
    """Times of each pass and its receipt, team, robot, receiver, direction, whether it is through."""
    return passes.sort("t_ns").select(
        milliseconds("t_ns"), milliseconds("received_ns"), pl.col("team").cast(pl.String), "robot",
        "receiver", pl.col("direction").cast(pl.String), "through").rows()


def _shots(shots: pl.DataFrame) -> list[tuple[Any, ...]]:
    """Time of each shot, team, robot, outcome, and distance in metres, to the centimetre."""
    return shots.sort("t_ns").select(
        milliseconds("t_ns"), pl.col("team").cast(pl.String), "robot", pl.col("outcome").cast(pl.String),
        pl.col("distance").cast(pl.Float64).round(2)).rows()
