"""Parts of a report in Markdown, and the web page made from it.

The Markdown is the one source. It names pictures as files beside it; the web page holds them inside and
fetches nothing.
"""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterable, Mapping, Sequence

from markdown_it import MarkdownIt
from markdown_it.token import Token

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; margin: 0; }
main { max-width: 1100px; margin: 0 auto; padding: 1rem 1.5rem 4rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; } h3 { font-size: 1rem; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; }
th, td { text-align: left; vertical-align: top; padding: .2rem .55rem; border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #888; vertical-align: bottom; }
[style*="right"] { font-variant-numeric: tabular-nums; } td[style*="right"] { white-space: nowrap; }
figure { margin: 0; } img { max-width: 100%; } figcaption { font-size: 13px; color: #444; }
pre { background: #f4f4f4; padding: .6rem; overflow-x: auto; font-size: 13px; }
"""


def code(lines: Iterable[str]) -> str:
    """Markdown of lines as they are typed."""
    return "\n".join(f"    {line}" for line in lines)


def picture(name: str, caption: str) -> str:
    """Markdown of the picture ``name``.png, its caption below it and as its description."""
    return f"![{caption}]({name}.png)\n\n{caption}"


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[bool]) -> str:
    """Markdown of a table; the cells' text is shown as it is.

    Args:
        head: names of the columns.
        rows: cells.
        right: True for each column that is flush right, as numbers are.
    """
    rule = ["---:" if flush else "---" for flush in right]
    lines = [map(_literal, head), rule, *(map(_literal, row) for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def number(value: float | None, places: int | None = None) -> str:
    """Number to so many decimal places, or to about three digits (whole numbers whole); a dash for None."""
    if value is None:
        return "–"
    if places is None:
        places = 0 if value == round(value) else _places(value)
    return f"{value:,.{places}f}"


def interval(value: float | None, low: float | None, high: float | None, places: int | None = None) -> str:
    """``1.50 [1.20, 1.80]``, all with the same places; the value alone if there is no interval."""
    if value is None or low is None or high is None:
        return number(value, places)
    if places is None:
        places = _places(max(abs(end) for end in (value, low, high)))
    return f"{value:,.{places}f} [{low:,.{places}f}, {high:,.{places}f}]"


def web_page(title: str, text: str, pictures: Mapping[str, bytes], colours: Mapping[str, str]) -> bytes:
    """Web page of a Markdown text, UTF-8.

    Args:
        title: title of the browser's window.
        text: Markdown; HTML in it is shown as text.
        pictures: PNG of each picture, by name.
        colours: CSS colour of a table cell, by its text.

    Raises:
        KeyError: if the text names a picture that is not given.
    """
    markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = markdown.parse(text)
    for place, token in enumerate(tokens):
        if token.type != "inline":
            continue
        if tokens[place - 1].type == "td_open" and token.content in colours:
            tokens[place - 1].attrSet("style", f"color: {colours[token.content]}; font-weight: 600")
        if [child.type for child in token.children or ()] == ["image"]:
            tokens[place - 1:place + 5] = _figure(tokens[place - 1:place + 5], pictures)
    body = markdown.renderer.render(tokens, markdown.options, {})
    body = body.replace("<table>", '<div class="table"><table>').replace("</table>", "</table></div>")
    return f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<style>{_STYLE}</style>
<main>
{body}</main>
</html>
""".encode()


def _figure(paragraphs: Sequence[Token], pictures: Mapping[str, bytes]) -> list[Token]:
    """Figure made of two paragraphs, a picture and its caption; the picture's bytes go into the page."""
    start, inline, end, *caption = paragraphs
    (image,) = inline.children or []
    name = str(image.attrs["src"]).removesuffix(".png")
    image.attrSet("src", f"data:image/png;base64,{base64.b64encode(pictures[name]).decode()}")
    start.tag = end.tag = "figure"
    start.attrSet("id", name)
    caption[0].tag = caption[-1].tag = "figcaption"
    return [start, inline, *caption, end]


def _literal(text: str) -> str:
    """Markdown that shows a text as it is."""
    return re.sub(r"([\\`*_|\[\]])", r"\\\1", text).replace("<", "&lt;")


def _places(value: float) -> int:
    """Decimal places of a number of this size."""
    return 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2 if abs(value) >= 0.1 else 3
