"""A document of headings, sentences, tables and pictures, written as one web page or as Markdown.

The web page is one file that fetches nothing, its pictures inside; Markdown names the pictures as files
beside it. Sentences may be marked as in Markdown: ``**strong**``, ``*emphasis*`` and ```code```; cells of
tables, titles and lines of code are taken as they are, whatever is in them.
"""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading of level 1 (the document's), 2 or 3."""

    text: str
    level: int = 2


@dataclass(frozen=True, slots=True)
class Sentences:
    """A paragraph."""

    text: str


@dataclass(frozen=True, slots=True)
class Code:
    """Lines as they are typed."""

    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Grid:
    """A table of texts.

    Attributes:
        head: names of the columns.
        rows: cells.
        right: of each column, whether it is flush right, as numbers are.
        colours: cell to the CSS colour that it is written in on the web page.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[bool, ...]
    colours: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Picture:
    """A plot.

    Attributes:
        name: of its file, without suffix.
        caption: sentences under it, which are also said to who does not see it.
        png: its bytes.
    """

    name: str
    caption: str
    png: bytes


Block = Heading | Sentences | Code | Grid | Picture

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; margin: 0; }
main { max-width: 1100px; margin: 0 auto; padding: 1rem 1.5rem 4rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; } h3 { font-size: 1rem; }
.table { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; }
th, td { text-align: left; vertical-align: top; padding: .2rem .55rem; border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #888; vertical-align: bottom; }
.right { text-align: right; font-variant-numeric: tabular-nums; } td.right { white-space: nowrap; }
figure { margin: 0; } img { max-width: 100%; } figcaption { font-size: 13px; color: #444; }
pre { background: #f4f4f4; padding: .6rem; overflow-x: auto; font-size: 13px; }
"""

_MARKS = (
    (re.compile(r"\*\*(.+?)\*\*"), r"<strong>\1</strong>"),
    (re.compile(r"\*(.+?)\*"), r"<em>\1</em>"),
    (re.compile(r"`(.+?)`"), r"<code>\1</code>"),
)


def to_html(title: str, blocks: Sequence[Block]) -> bytes:
    """The document as one web page in UTF-8.

    Args:
        title: of the browser's window.
        blocks: in order.
    """
    body = "\n".join(_html(block) for block in blocks)
    return f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<style>{_STYLE}</style>
<main>
{body}
</main>
</html>
""".encode()


def to_markdown(blocks: Sequence[Block]) -> str:
    """The document as Markdown, its pictures as ``NAME.png`` beside it.

    Args:
        blocks: in order.
    """
    return "\n\n".join(_markdown(block) for block in blocks) + "\n"


def _html(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"<h{level}>{html.escape(text)}</h{level}>"
        case Sentences(text):
            return f"<p>{_marked(text)}</p>"
        case Code(lines):
            text = "\n".join(lines)
            return f"<pre>{html.escape(text)}</pre>"
        case Grid():
            return _html_table(block)
        case Picture(name, caption, png):
            source = f"data:image/png;base64,{base64.b64encode(png).decode()}"
            return (f'<figure id="{html.escape(name)}"><img alt="{html.escape(caption)}" src="{source}">'
                    f"<figcaption>{_marked(caption)}</figcaption></figure>")


def _html_table(grid: Grid) -> str:
    colours = dict(grid.colours)

    def line(cells: Sequence[str], tag: str) -> str:
        written = []
        for cell, right in zip(cells, grid.right, strict=True):
            look = ' class="right"' if right else ""
            if cell in colours:
                look += f' style="color: {colours[cell]}; font-weight: 600"'
            written.append(f"<{tag}{look}>{html.escape(cell)}</{tag}>")
        return f"<tr>{''.join(written)}</tr>"

    body = "\n".join(line(cells, "td") for cells in grid.rows)
    return (f'<div class="table"><table>\n<thead>{line(grid.head, "th")}</thead>\n'
            f"<tbody>\n{body}\n</tbody>\n</table></div>")


def _marked(text: str) -> str:
    text = html.escape(text, quote=False)
    for mark, tag in _MARKS:
        text = mark.sub(tag, text)
    return text


def _markdown(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {text}"
        case Sentences(text):
            return text
        case Code(lines):
            return "\n".join(f"    {line}" for line in lines)
        case Grid(head, rows, right):
            rule = tuple("---:" if flush else "---" for flush in right)
            table = [tuple(map(_cell, head)), rule, *(tuple(map(_cell, row)) for row in rows)]
            return "\n".join(f"| {' | '.join(cells)} |" for cells in table)
        case Picture(name, caption, _):
            return f"![{caption}]({name}.png)\n\n{caption}"


def _cell(text: str) -> str:
    """Text that Markdown takes as it is."""
    text = re.sub(r"([\\`*_|\[\]])", r"\\\1", text)
    return text.replace("<", "&lt;")
