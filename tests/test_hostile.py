"""One bad recording never stops the others, whatever it is: names, links, pipes, sizes."""

from __future__ import annotations

import io
import json
import multiprocessing
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import redirect_stdout
from html.parser import HTMLParser
from pathlib import Path

import polars as pl
import pytest
from hostile.make import DERBY, HOSTILE, Hostile
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from recordings.make import FILES
from support.processes import answering, line, pitchlore, tell
from support.recordings import same

from pitchlore.flows.commands.printing import print_frame
from pitchlore.pipeline.base.errors import BadRecording, BadSettings, NotFound, PitchloreError
from pitchlore.pipeline.base.text import printable
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.isolated import _answer, read_isolated
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.recordings import Recording, inbox, strangers
from pitchlore.pipeline.engine.stage import Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.settings import ImportSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.views.commentary.summary import heading, summary_lines
from pitchlore.pipeline.views.replay.animation import animation

#: Names of files that have harmed programs: terminals, shells, logs.
NAMES = [b"newline\nin it.csv", b"\x1b]0;owned\x07\x1b[31mred.csv", b"not utf-8 \xff\xfe.csv", b"-rf.csv", b"$(reboot).csv",
         "\u202egpj.csv".encode(), b"'; drop table matches; --.csv", b"x" * 251 + b".csv", b" .csv", b"[bold]markup[].csv", b"[] closed.csv",
         b"\\[link=x]back.csv", b":warning:.csv",
         "нападающий.csv".encode()]


@pytest.fixture(scope="module")
def reader() -> Iterator[subprocess.Popen[str]]:
    """A process that reads, and says what that cost."""
    with answering("support.bounds") as process:
        assert line(process) == "ready"
        yield process


@pytest.mark.slow
@pytest.mark.parametrize("case", HOSTILE, ids=lambda case: case.name)
def test_bounds(tmp_path, reader, case: Hostile):
    """A hostile recording is refused in one line, or read; and both cost little time and memory."""
    file, mapping = tmp_path / case.name, None
    file.write_bytes(case.content())
    if case.mapping is not None:
        mapping = tmp_path / f"{case.name}.toml"
        mapping.write_text(case.mapping)
    tell(reader, json.dumps([str(file), str(mapping or "")]))
    said, seconds, megabytes = json.loads(line(reader))
    assert re.search(case.said, said) if case.said else said == "read", said
    assert "\n" not in said
    assert len(said) < 2_000
    assert seconds < case.seconds
    assert megabytes < case.megabytes + 3 * file.stat().st_size / (1 << 20)


@pytest.mark.slow
def test_hostile_names(tmp_path, call, monkeypatch):
    """Files with hostile names are imported like others; no name reaches a terminal as it is."""
    data = tmp_path / "data"
    box = os.fsencode(data / "inbox")
    Path(os.fsdecode(box)).mkdir(parents=True)
    for number, name in enumerate(NAMES):
        with open(os.path.join(box, name), "wb") as file:  # noqa: PTH118, PTH123 (bytes)
            file.write(DERBY.replace(b"0.1,", b"0.%d1," % (number + 1)))
    done = subprocess.run([*pitchlore(), "import", *(os.path.join(box, name) for name in NAMES), "--data", data],  # noqa: PTH118
                          capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"%d imported" % len(NAMES) in done.stdout
    monkeypatch.chdir(data / "inbox")
    assert "0 imported, 1 already here" in call("import", "[bold]markup[].csv", "--data", data)[1]
    _, shown, _ = call("sql", "from matches", "--csv", "--data", data)
    assert shown.count("\n") == 1 + len(NAMES)
    for text in (done.stdout.decode(), done.stderr.replace(b"\x1b[?25h", b"").decode(), shown):
        assert all(c.isprintable() or c == "\n" for c in re.sub(r"[━╺╸]", "", text)), [c for c in text if not c.isprintable()]


def test_pipes_and_links(tmp_path):
    """Only regular files inside the inbox are read; pipes, devices and links that lead out are named."""
    store = Store(tmp_path / "data")
    box = store.root / "inbox"
    box.mkdir(parents=True)
    (tmp_path / "secret.csv").write_bytes(DERBY)
    (box / "derby.csv").write_bytes(DERBY)
    (box / "again.csv").symlink_to(box / "derby.csv")
    os.mkfifo(box / "pipe.csv")
    (box / "out.csv").symlink_to(tmp_path / "secret.csv")
    (box / "device.csv").symlink_to("/dev/zero")
    (box / "nothing.csv").symlink_to(box / "gone.csv")
    (box / "itself.csv").symlink_to(box / "itself.csv")
    (box / "outside").symlink_to(tmp_path)
    assert [recording.file.name for recording in inbox(store)] == ["again.csv", "derby.csv"]
    assert {Path(name).name for name in strangers(store)} == {
        "pipe.csv", "out.csv", "device.csv", "nothing.csv", "itself.csv", "outside"}


@pytest.mark.parametrize("name", ["derby.csv.toml", "map.toml"])
def test_map_that_leads_out(tmp_path, name):
    """A map in the inbox that is a link out of it is not read, nor is its recording: both are named."""
    store = Store(tmp_path / "data")
    box = store.root / "inbox"
    box.mkdir(parents=True)
    (tmp_path / "secret.toml").write_text("password = 1")
    (box / "derby.csv").write_bytes(DERBY)
    (box / name).symlink_to(tmp_path / "secret.toml")
    assert inbox(store) == []
    assert [Path(name).name for name in strangers(store)] == ["derby.csv"]
    (box / name).unlink()
    (box / name).symlink_to(box / "gone.toml")
    assert inbox(store) == []


def test_pipe_as_a_map(tmp_path):
    """A pipe as a map or a recording is refused at once; nothing waits for it."""
    store = Store(tmp_path / "data")
    (tmp_path / "derby.csv").write_bytes(DERBY)
    os.mkfifo(tmp_path / "map.toml")
    os.mkfifo(tmp_path / "pipe.csv")
    for recording in (Recording(file=tmp_path / "derby.csv", mapping=tmp_path / "map.toml"),
                      Recording(file=tmp_path / "pipe.csv"), Recording(file=Path("/dev/zero")),
                      Recording(file=Path("/proc/self/status"))):
        begun = time.monotonic()
        with pytest.raises(NotFound, match=r"is not a regular file\. Name a file"):
            take_in(store, recording)
        assert time.monotonic() - begun < 5


def test_limits_are_settings(tmp_path):
    """A limit that a file exceeds is named, and can be raised."""
    store = Store(tmp_path / "data")
    file = tmp_path / "derby.csv"
    file.write_bytes(DERBY)
    with pytest.raises(BadRecording, match=r"derby.csv: has 61 lines, more than the limit rows = 60. .* raise rows in the \[imports\]"):
        take_in(store, Recording(file=file), ImportSettings(rows=60))
    (record,) = store.quarantined()
    assert "rows = 60" in record.reason
    take_in(store, Recording(file=file), ImportSettings(rows=61))
    assert store.quarantined() == []
    file.write_bytes(DERBY + b"1" * (1 << 20))
    with pytest.raises(NotFound, match="is larger than the limit of 1 MiB"):
        take_in(store, Recording(file=file), ImportSettings(megabytes=1))


def test_bounded_records(tmp_path):
    """The messages about a recording are bounded, whatever the recording says."""
    store = Store(tmp_path)
    store.quarantine("matches", "m", BadRecording("x" * 1_000_000, where="y" * 1_000_000))
    (record,) = store.quarantined()
    assert len(record.reason) < 1_100


# --- a process of its own ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mcap/whole.mcap", "rcg/ulg6.rcg", "tracking-csv/plain.csv", "tracking-parquet/plain.parquet"])
def test_isolated_reading(tmp_path, name):
    """Read in a process of its own, a recording is the same match."""
    file = tmp_path / Path(name).name
    file.write_bytes(FILES[name]())
    source = open_source(file.read_bytes(), file.name)
    assert same(read_isolated([file], source, TrackingMap())[0], read(source))


def test_isolated_refusal(tmp_path):
    """A refusal comes back as itself."""
    file = tmp_path / "x.csv"
    file.write_bytes(DERBY.splitlines()[0])
    with pytest.raises(BadRecording) as here:
        read(open_source(file.read_bytes(), file.name))
    with pytest.raises(BadRecording) as there:
        read_isolated([file], open_source(file.read_bytes(), file.name), TrackingMap())
    assert str(there.value) == str(here.value)


def test_reader_brought_down(tmp_path):
    """A recording that needs more memory or time than it may have is refused, and the next one is read."""
    file = tmp_path / "rows.csv"
    rows = b"".join(b"%d,%.2f,ball,,0,0\n" % (i, i / 100) for i in range(1_000_000))
    file.write_bytes(DERBY.splitlines(keepends=True)[0] + rows)
    limits = ImportSettings(memory_megabytes=300)
    with pytest.raises(BadRecording, match=r"brings its reader down|cannot be read .*emory"):
        read_isolated([file], open_source(file.read_bytes(), file.name, limits), TrackingMap())
    limits = ImportSettings(seconds=0.001)
    with pytest.raises(BadRecording, match=r"takes longer than the limit seconds = 0\.001 to read"):
        read_isolated([file], open_source(file.read_bytes(), file.name, limits), TrackingMap())
    store = Store(tmp_path / "data")
    file.write_bytes(DERBY)
    assert take_in(store, Recording(file=file), ImportSettings(isolate=True))[1]


#: Python that runs first in each process: a parser that faults on what is named bad, as compiled code of a library may.
FAULT = """
import ctypes, importlib.util, sys

class Faulty:
    def find_spec(self, name, path=None, target=None):
        if name != "pitchlore.pipeline.importers.readers":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        load = spec.loader.exec_module
        def loaded(module):
            load(module)
            read = module.read
            module.read = lambda source, *more: ctypes.string_at(0) if source.name.startswith("bad") else read(source, *more)
        spec.loader.exec_module = loaded
        return spec

sys.meta_path.insert(0, Faulty())
"""


def test_a_fault_of_a_parser(tmp_path):
    """A parser of any format that faults takes its own recording with it; the next one is imported."""
    (tmp_path / "sitecustomize.py").write_text(FAULT)
    firsts = {name.partition("/")[0]: name for name in sorted(FILES, reverse=True)}
    bad = []
    for kind, name in firsts.items():
        bad.append(tmp_path / f"bad-{kind}{Path(name).suffix}")
        bad[-1].write_bytes(FILES[name]())
    (tmp_path / "good.csv").write_bytes(DERBY)
    command = pitchlore("import", "--isolate", *bad, tmp_path / "good.csv", "--data", tmp_path / "data")
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": os.pathsep.join((str(tmp_path), *sys.path[1:]))})
    assert (done.returncode, "1 imported, 0 already here" in done.stdout) == (1, True), done.stdout + done.stderr
    assert done.stdout.count("brings its reader down (exit code -11)") == len(bad) >= 5


def test_nobody_waits_for_a_reader(tmp_path, monkeypatch):
    """A reader whose command was killed ends without a word."""
    monkeypatch.setattr("resource.setrlimit", lambda *_: None)
    here, there = multiprocessing.Pipe(duplex=False)
    here.close()
    _answer(there, [str(tmp_path / "none.csv")], None, "0", "m-1", TrackingMap(), ImportSettings(), 4096, 1)


def test_others_go_on(tmp_path):
    """Hostile recordings among others: the others are imported, and each hostile one is named."""
    folder = tmp_path / "in"
    folder.mkdir()
    cases = [case for case in HOSTILE if case.said and case.mapping is None and case.name.startswith(("q", "d", "empty", "rows"))]
    for case in cases:
        (folder / case.name).write_bytes(case.content())
    for number in range(3):
        (folder / f"good{number}.csv").write_bytes(DERBY.replace(b"0.1,", b"0.%d1," % (number + 1)))
    store = Store(tmp_path / "data")
    report = import_all(store, [Recording(file=file) for file in sorted(folder.iterdir())], ImportSettings(isolate=True))
    assert len(report.made) == 3
    assert sorted(Path(name).name for name in report.failed) == sorted(case.name for case in cases)


# --- text -------------------------------------------------------------------------------------------


@given(st.text(st.characters(codec=None)))
def test_printable(text):
    """Whatever a stranger writes is printable in the end, and can be encoded."""
    shown = printable(text, 100)
    assert shown.isprintable()
    assert len(shown) <= 100
    assert shown.encode() is not None
    assert printable(shown, 100) == shown


@pytest.mark.parametrize("kind", [BadRecording, BadSettings, NotFound, PitchloreError])
def test_errors_cross_processes(kind):
    """An error that comes from another process is itself: class, parts and line."""
    import pickle

    error = kind("is empty", where="x\n.csv", next_step="Record it again")
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.where) == (kind, r"x\n.csv: is empty. Record it again.", r"x\n.csv")


def test_markdown():
    """A stranger's text in a report is shown as it is, and becomes no link, picture or HTML."""
    report = StageReport(noun="matches", failed={"![x](http://a.b/c.png)<script>": "see [this](http://a.b) | `x`"})
    for row in report.markdown().splitlines()[2:]:
        bare = re.sub(r"\\.", "", row.replace("**", ""))
        assert not re.search(r"[\[\]()<>!`|]", bare), row


@pytest.mark.parametrize("title", ["", "[/] [red]x \x1b[31m\n y"])
def test_cells(capsys, title):
    """A table for people shows what a cell holds, and no more."""
    print_frame(pl.DataFrame({"a": ["\x1b]0;owned\x07[bold]x[/bold]\nnext"]}), title=title)
    shown = capsys.readouterr().out
    assert "".join(printable(title, 100).split()) in "".join(shown.split()), "it is neither markup nor an order to the terminal"
    assert r"\x1b]0;owned\x07[bold]x[/bold]\nnext" in shown
    assert "\x1b]" not in shown


# --- names of teams, in all that shows them ---------------------------------------------------------

#: What has harmed terminals, pages, tables, formulas, spreadsheets and shells.
NASTY = ["<script>alert(1)</script>", "</title>", "{{payload}}", "$\\frac{", "$x", "_", "\x1b[31m", "\x07", "\n", "\r", "\t",
         "\u2028", "\u202e", "\u200b", "\x85", "[red]", "[/]", "=1+1", "|", "`", "![a](b)", "' or 1=1 --", "%s", "{0}", "\x00",
         "\ud83d\ude00".encode("utf-16", "surrogatepass").decode("utf-16"), "ב", "名", "x" * 300, '"', "&lt;", "\\", "../.."]


class Tags(HTMLParser):
    """The tags of a page, with the names of their attributes."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, tuple[str, ...]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, tuple(name for name, _ in attrs)))


def shown(folder: Path, home: str, away: str) -> tuple[str, list[str], bytes]:
    """A match of teams of these names through the stages: its page, lines of text, and a film."""
    store = Store(folder)
    rows = [(i, i / 50, team, robot, x + i / 500, y) for i in range(60) for team, robot, x, y in (
        ("ball", None, 0.0, 0.0), (home, "1", -0.3, 0.1), (away, "1", 0.3, -0.1))]
    pl.DataFrame(rows, schema=["frame", "t", "team", "player", "x", "y"], orient="row").write_parquet(folder / "x.parquet")
    receipt, *_ = take_in(store, Recording(file=folder / "x.parquet"))
    scope = Scope(matches=(receipt.name,))
    STAGES.make(store, Settings(), scope, {"sides", "trajectories", "situations", "goals", "events"})
    match = League(store).match(receipt.name)
    path, reported, out = match.replay(), match.commentary(), io.StringIO()
    catalogue = refresh(store)[0]
    with redirect_stdout(out):
        print_frame(ask(catalogue, "select home, away, source from matches"), title=receipt.details["home"])
        print_frame(ask(catalogue, "from sides"))
    lines = [*heading(reported.summary), *(moment.line() for moment in reported.moments), *summary_lines(reported.summary),
             *out.getvalue().splitlines(), *ask(catalogue, "from matches").write_csv().splitlines()]
    film = animation(match, start_s=0.0, seconds=0.1)
    return path.read_text(encoding="utf-8"), lines, film


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> list[tuple[str, tuple[str, ...]]]:
    """The tags of a page of teams with plain names."""
    return Tags(shown(tmp_path_factory.mktemp("plain"), "Lions", "Tigers")[0]).found


@pytest.mark.slow
@settings(max_examples=1)
@given(*[st.lists(st.sampled_from(NASTY), min_size=1, max_size=4).map("".join)] * 2)
@example("<script>alert(1)</script>\x1b]0;owned\x07", "$\\frac{[/red]\u202e\n")
def test_hostile_teams(plain, tmp_path_factory, home, away):
    """Whatever teams are called, pages have no tag more, lines no character that cannot be printed, and films are drawn."""
    assume(printable(home, 200).strip() != printable(away, 200).strip())
    assume(not {home.strip(), away.strip()} & {"", "ball"})
    page, lines, film = shown(tmp_path_factory.mktemp("teams"), home, away)
    assert Tags(page).found == plain
    assert not [line for line in lines if not line.isprintable()]
    assert film.startswith(b"GIF89a")
