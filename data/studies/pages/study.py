"""Pictures of each page of the scout, as two versions of the product make it of one league.

``study.py DATA OUT OLD`` plays ten matches of three scripted teams and exports them as CSV under the names
Foxes, Wolves and Bears (:data:`MATCHES`). Two versions import them, run, and write their pages: OLD, the
``pitchlore`` of an older checkout, and this one. OUT gets ``NAME.webp``, the top of the page before | today
at 1366 px; ``NAME-more.webp``, today's at 390 px | dark | on paper; and ``pages.csv``. Clips stand still, so
that pictures of equal pages are equal.
"""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from shutil import which
from typing import Any, NamedTuple

import polars as pl
from harness import PITCHLORE
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

#: The teams of the league, and the scripts that play them.
TEAMS = {"foxes": "static", "wolves": "human-like", "bears": "pressing"}
#: The matches: home and away of the recording, its day, its minutes; seeds are 101 and on.
MATCHES = (
    ("foxes", "wolves", "2026-09-12", 6), ("bears", "foxes", "2026-09-12", 5),
    ("wolves", "bears", "2026-09-12", 7), ("wolves", "foxes", "2026-09-12", 4),
    ("foxes", "bears", "2026-09-12", 8), ("foxes", "wolves", "2026-10-17", 7),
    ("bears", "wolves", "2026-10-17", 5), ("bears", "foxes", "2026-10-17", 6),
    ("wolves", "foxes", "2026-10-17", 8), ("wolves", "bears", "2026-10-17", 4))
#: Kinds of pages: their name here, and which one of the scout's files is taken.
PAGES = {
    "first": "index.html", "team": "teams/foxes-*.html", "match": "matches/wolves-foxes-2026-10-17-*.html",
    "report": "against/wolves-*.html", "compare": "compare.html", "behaviours": "behaviours/foxes-*.html",
    "maps": "maps/foxes-*.html", "policies": "policies.html", "policy": "policies/foxes-*.html",
    "situations": "situations.html", "words": "words.html",
    "replay": "replays/wolves-foxes-2026-10-17-*.html"}
#: Of a page so many pixels are shown at most; the width of a screen, of a phone, of A4 within its margins.
TALL, WIDE, PHONE, PAPER = 1200, 1366, 390, 696
#: Two pictures and three are reduced to this; the quality of their compression, 0 to 100; pixels between.
SCALES, QUALITY, GAP = {2: 0.6, 3: 0.5}, 45, 12
#: What counts as a picture of a page, for how far down the first one is.
DRAWN = "main :is(svg.pitch, svg.strip, .clip canvas, svg.top), body > :not(main) canvas"


class Looked(NamedTuple):
    """A page as it is seen.

    Attributes:
        image: its top.
        height: height of the whole page, px.
        first: place of its first picture below the top, px; None where it has none.
    """

    image: Image.Image
    height: int
    first: int | None


def called(*words: object) -> str:
    """Run a command, and return what it prints.

    Raises:
        CalledProcessError: if it fails.
    """
    return subprocess.run([*map(str, words)], check=True, stdout=subprocess.PIPE, text=True).stdout  # noqa: S603


def league(folder: Path, matches: Sequence[tuple[str, str, str, float]] = MATCHES) -> list[Path]:
    """Play and export the matches into a folder; the CSVs that are there stay."""
    found = []
    for seed, (home, away, day, minutes) in enumerate(matches, 101):
        found.append(path := folder / f"{home}-{away}-{day}.csv")
        if path.exists():
            continue
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as data:
            (match,) = json.loads(called(
                PITCHLORE, "record", "--data", data, "--home", TEAMS[home], "--away", TEAMS[away],
                "--seed", seed, "--minutes", minutes, "--json"))
            called(PITCHLORE, "export", match["match_id"], "--data", data, "--to", "csv", "--output", data)
            (table,) = (pl.read_csv(file, infer_schema_length=None) for file in Path(data).glob("*.csv"))
        names = {script: team.title() for team, script in TEAMS.items()}
        kept = ("frame", "t", pl.col("team").replace(names), "player", "x", "y", "heading")
        table.select(*kept).write_csv(path)
    return found


def pages(pitchlore: str, data: Path, recordings: Sequence[Path]) -> Path:
    """The folder of a version's pages of the recordings, made unless it is there."""
    if not (data / "scout" / "index.html").exists():
        called(pitchlore, "import", *recordings, "--data", data)
        for word in ("run", "scout"):
            called(pitchlore, word, "--data", data)
    return data / "scout"


@contextmanager
def opened(
    browser: Browser, address: str, width: int, dark: bool = False, tall: int = TALL
) -> Iterator[Page]:
    """A page that has loaded, clips and all, at a width."""
    look: Any = {"color_scheme": "dark" if dark else "light", "reduced_motion": "reduce"}
    context = browser.new_context(viewport={"width": width, "height": tall}, **look)
    page = context.new_page()
    page.goto(address)
    page.wait_for_timeout(2500)
    yield page
    context.close()


def looked(page: Page) -> Looked:
    """The top of a page as it stands, and how long it is."""
    first = page.evaluate("""(which) => { const found = document.querySelector(which);
        return found && Math.round(found.getBoundingClientRect().top + scrollY); }""", DRAWN)
    height = page.evaluate("Math.ceil(document.body.getBoundingClientRect().bottom)")
    shown = Image.open(io.BytesIO(page.screenshot()))
    return Looked(shown.crop((0, 0, shown.width, min(shown.height, height))), height, first)


def beside(path: Path, images: Sequence[Image.Image]) -> None:
    """Write images side by side, reduced."""
    scale = SCALES[len(images)]
    small = [it.convert("RGB").resize((round(it.width * scale), round(it.height * scale))) for it in images]
    size = sum(it.width + GAP for it in small) - GAP, max(it.height for it in small)
    whole, left = Image.new("RGB", size, "#888"), 0
    for it in small:
        whole.paste(it, (left, 0))
        left += it.width + GAP
    whole.save(path, quality=QUALITY, method=6)


def main(browser: Browser, out: Path, before: Path, today: Path, kinds: Sequence[str] = tuple(PAGES)) -> None:
    """Write the pictures and the table of some kinds of pages, from two folders of pages."""
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    for kind in kinds:
        tall = 900 if kind == "replay" else TALL  # a replay is one screen
        seen = []
        for scout in (before, today):
            (file, *_) = sorted(scout.glob(PAGES[kind]))
            for width in (WIDE, PHONE):
                with opened(browser, file.as_uri(), width, tall=tall if width == WIDE else TALL) as page:
                    seen.append(looked(page))
        wide, phone, *own = seen
        with opened(browser, file.as_uri(), WIDE, dark=True, tall=tall) as page:
            dark = looked(page)
        with opened(browser, file.as_uri(), WIDE) as page:
            page.evaluate("dispatchEvent(new Event('beforeprint'))")
            page.emulate_media(media="print")
            page.set_viewport_size({"width": PAPER, "height": TALL})
            paper = looked(page)
        beside(out / f"{kind}.webp", [wide.image, own[0].image])
        beside(out / f"{kind}-more.webp", [own[1].image, dark.image, paper.image])
        rows.append((kind, *(part for it in (wide, own[0]) for part in (it.height, it.first)),
                     phone.height, own[1].height))
    with (out / "pages.csv").open("w", newline="", encoding="utf-8") as table:
        csv.writer(table, lineterminator="\n").writerows([
            ("page", "before_px", "before_first_picture_px", "today_px", "today_first_picture_px",
             "before_phone_px", "today_phone_px"), *rows])


if __name__ == "__main__":
    data, here, old = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    tables = league(data / "csv")
    written = pages(old, data / "before", tables), pages(PITCHLORE, data / "today", tables)
    with sync_playwright() as player:
        chromium = player.chromium.launch(executable_path=which("chromium"), args=["--no-sandbox"])
        main(chromium, here, *written)
        chromium.close()
