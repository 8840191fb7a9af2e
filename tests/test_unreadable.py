"""A file that cannot be read does not count as a file that is not there (docs/explanation/guarantees.md).

Every command that answers, and each way in which a file can be unreadable: damage is left out with a line and exit
code 3, or refused with 1 where nothing is left to answer; what the system refuses to read stops the command.
"""

from __future__ import annotations

import builtins
import errno
import io
import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import pytest
from conftest import clip, run
from support.closed import GROUP, OTHER, ROOT, as_user, close

import pitchlore
from pitchlore.pipeline.base.errors import CorruptFile, PitchloreError, ReadFailed
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.engine.run import train_policy
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.sealed import read_anew

# --- unreadable files -------------------------------------------------------------------------------


def flipped(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-9])


def another(path: Path) -> None:
    """Bytes of another place, as by a copy with a wrong name; where there is no other, half of them."""
    others = [other for other in path.parent.glob(f"*{path.name[-13:]}") if other != path]
    path.write_bytes(others[0].read_bytes() if others else path.read_bytes()[:path.stat().st_size // 2])


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def dangling(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.parent / "nothing")


@contextmanager
def failing(path: Path, number: int = errno.EIO) -> Iterator[None]:
    """A disk that fails where a file is: reads of it end so, whoever opens it in Python."""
    opened = io.open
    read_anew()

    def refuse(file: object, *rest: object, **named: object) -> object:
        if not isinstance(file, int) and Path(os.fsdecode(file)) == path:
            raise OSError(number, os.strerror(number), str(path))
        return opened(file, *rest, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(io, "open", refuse)
        patch.setattr(builtins, "open", refuse)
        yield


@contextmanager
def closed(path: Path) -> Iterator[None]:
    close(path)
    read_anew()  # a process does not open what it has read, and what looks the same
    with as_user():
        yield


#: Kinds of damage, and of files that the system refuses to read, each with its words.
DAMAGED: dict[str, Callable[[Path], None]] = {each.__name__: each for each in (flipped, cut, another, folder, pipe, dangling)}
REFUSED = {"closed": (closed, "Permission denied"), "failing": (failing, "Input/output error"),
           "stale": (lambda path: failing(path, errno.ESTALE), "Stale file handle")}

# --- readers ----------------------------------------------------------------------------------------

#: Files of a league with two matches; the first match is M.
PLACES = {
    "match": "matches/M.receipt.json", "stage": "situations/M.receipt.json", "table": "situations/M-*.situations.parquet",
    "knowledge": "knowledge/v0001/manifest.json", "run": "runs/*.json",
}
LEFT_OUT, NOT_ANSWERED = 3, 1
#: Exit codes of readers by the place that is damaged; elsewhere 0. M is the match that is harmed, N the other one.
READERS: dict[str, dict[str, int]] = {
    "sql|select count(*) from matches": dict.fromkeys(("match", "stage", "table", "knowledge"), LEFT_OUT),
    "commentary|M": dict.fromkeys(("match", "stage", "table"), NOT_ANSWERED),
    "replay|M": dict.fromkeys(("match", "stage", "table"), NOT_ANSWERED),
    "export|M|--to|csv": {"match": NOT_ANSWERED},
    "commentary|N": {},
    "export|N|--to|csv": {},
    "kb|list": {"knowledge": LEFT_OUT},
    "kb|show": {"knowledge": NOT_ANSWERED},
    "policy|show": {},
    "runs": {"run": LEFT_OUT},
    "run|--plan": {},
    "verify": dict.fromkeys(("match", "stage", "table", "knowledge"), NOT_ANSWERED),
    "quarantine": {},
}
#: The scout takes seconds; of a stage it reads receipts as the others do.
SLOW = {"scout": dict.fromkeys(("match", "table", "knowledge"), LEFT_OUT)}
#: Files that a plan reads, besides those of the run: what it is of, it says.
PLANNED = {"match", "stage", "table", "knowledge", "run"}


@pytest.fixture
def league(finished, tmp_path) -> Path:
    """A copy of the league, without its inbox, and with a catalogue."""
    data = shutil.copytree(finished, tmp_path / "data", ignore=shutil.ignore_patterns("inbox", "catalog.duckdb", ".looked.json"))
    refresh(Store(data))
    return data


def match_of(data: Path, number: int = 0) -> str:
    return sorted(path.name.removesuffix(".receipt.json") for path in (data / "matches").glob("*.receipt.json"))[number]


def place(data: Path, which: str) -> Path:
    """The file of a place."""
    (found,) = data.glob(PLACES[which].replace("M", match_of(data)))
    return found


def words(reader: str, data: Path) -> list[str]:
    named = {"M": match_of(data), "N": match_of(data, 1)}
    return [named.get(word, word) for word in reader.split("|")] + ["--data", str(data)]


@pytest.mark.parametrize("kind", DAMAGED)
@pytest.mark.parametrize("where", PLACES)
def test_damage_is_said(league, call, where, kind):
    """Each reader answers with what stands, names what it left out, and exits with 3; with 1 if nothing stands."""
    path = place(league, where)
    DAMAGED[kind](path)
    # those that do not read the file are asked once
    asked = {reader: codes for reader, codes in READERS.items() if kind == "flipped" or where in codes}
    if kind == "flipped" and where in SLOW["scout"]:
        asked |= SLOW
    for reader, codes in asked.items():
        code, out, err = call(*words(reader, league))
        wanted = codes.get(where, 0)
        assert code == wanted, (reader, out, err)
        assert (str(path) in out + err) == bool(wanted) or reader == "run|--plan", reader
        if wanted == LEFT_OUT:
            (line,) = (line for line in err.splitlines() if "left out" in line)
            assert str(path) in line
    with pytest.raises(PitchloreError, match=path.name) if where in READERS[next(iter(READERS))] else nullcontext():
        pitchlore.open(league).sql("select count(*) from matches").fetchall()
    assert pitchlore.open(league, leave_out=True).sql("select count(*) from goals").fetchall()


@pytest.mark.parametrize("kind", REFUSED)
@pytest.mark.parametrize("where", PLACES)
def test_refusal_is_no_damage(league, call, where, kind):
    """A file that the system refuses to read stops whoever needs it, in a line that does not call it damaged."""
    path = place(league, where)
    (league / "catalog.duckdb").unlink()  # so that tables are looked at
    with REFUSED[kind][0](path):
        for reader, codes in READERS.items():
            code, out, err = call(*words(reader, league))
            stops = where in (PLANNED if reader == "run|--plan" else codes)
            assert code == int(stops), (reader, out, err)
            if stops:
                said = [line for line in (out + err).splitlines() if str(path) in line]
                assert said
                assert all(REFUSED[kind][1] in line for line in said)
                assert not any(word in line for line in said for word in ("lost or", "--restore-from", "to make it anew"))
        if where in READERS[next(iter(READERS))]:
            for leave_out in (False, True):
                with pytest.raises(ReadFailed):
                    pitchlore.open(league, leave_out=leave_out).sql("select count(*) from matches")


def test_refusal_that_no_glance_shows(league, call):
    """A table whose mode has changed since the catalogue was made is named by who asks it or makes the catalogue anew."""
    path = place(league, "table")
    assert call("sql", "select 1", "--data", league)[0] == 0
    with closed(path):
        for query in ("select count(*) from situations", "select count(*) from matches"):
            code, out, err = call("sql", query, "--data", league)
            assert (code, out) == (1, "")
            assert err.startswith(f"pitchlore: {path}: cannot be read (Permission denied). Let this user read it, or call ")
            for receipt in (league / "acts").glob("*.receipt.json"):
                receipt.unlink()  # so that it is made anew


def test_own_paths_are_text(league, call):
    """A path that the user names is printed without its control characters."""
    code, out, err = call("replay", match_of(league), "--output", league / "a\x1b[2J\nb.html", "--data", league)
    assert (code, err) == (0, "")
    assert out.startswith(f"{league}/a\\x1b[2J\\nb.html (")


# --- those that make something ----------------------------------------------------------------------


def kept(data: Path) -> dict[str, bytes]:
    """All that was made, but the log of runs."""
    return {str(path.relative_to(data)): path.read_bytes() for noun in ("matches", "situations", "knowledge", "policies")
            for path in (data / noun).rglob("*") if path.is_file() and not path.name.startswith(".")}


@pytest.mark.parametrize("where", ["match", "stage", "table"])
@pytest.mark.parametrize("kind", ["flipped", "another", "dangling"])
def test_run_makes_again(league, call, where, kind):
    """A damaged receipt is made again, that of a match from its log; no version is made without the match."""
    before = {name: data for name, data in kept(league).items() if "receipt" not in name}
    path = place(league, where)
    DAMAGED[kind](path)
    assert call("run", "--data", league)[0] == 0
    assert not path.is_symlink()
    assert {name: data for name, data in kept(league).items() if "receipt" not in name} == before
    assert call("sql", "select count(distinct match_id) n from situations", "--data", league, "--json")[::2] == (0, "")
    assert call("verify", "--data", league)[0] == 0


def test_version_says_what_it_lacks(league, tmp_path, call):
    """A match that nothing can make again goes into quarantine by name; the next version says that it lacks it."""
    backup = shutil.copytree(league, tmp_path / "backup")
    match = match_of(league)
    flipped(place(league, "match"))
    flipped(next((league / "matches").glob(f"{match}-*.log.mcap")))
    flipped(league / "knowledge" / "v0001" / "manifest.json")
    code, _, err = call("train", "--data", league)
    assert (code, "v0001/manifest.json: is not what was written" in err) == (1, True)
    code, out, _ = call("run", "--data", league)
    assert code == 1
    assert f"made without {match}, knowledge version 1" in out
    assert match in call("quarantine", "--data", league)[1]
    lacks = [match, "knowledge version 1"]
    for noun, words in (("knowledge", ("kb", "show")), ("policies", ("policy", "show"))):
        assert Store(league).manifest(noun, 2).details["without"] == lacks
        assert f"made without {', '.join(lacks)}" in call(*words, "--data", league)[1]
    code, out, _ = call("kb", "list", "--json", "--data", league)
    assert (code, [row["made_without"] for row in json.loads(out)]) == (LEFT_OUT, [", ".join(lacks)])
    assert train_policy(league).version == 2
    assert call("verify", "--restore-from", backup, "--data", league)[0] == 0
    assert run(league).failures == {}
    assert call("quarantine", "--data", league)[1] == "nothing is in quarantine\n"
    newest = Store(league).latest("knowledge")
    assert newest is not None
    assert (newest.details["matches"], "without" in newest.details) == (2, False)


@pytest.mark.parametrize("kind", REFUSED)
@pytest.mark.parametrize("where", ["match", "stage", "table", "knowledge"])
def test_nothing_is_made_of_less(league, tmp_path, call, where, kind):
    """Where the system refuses to read a file, nothing is replaced, and nothing is trained on the rest."""
    early = tmp_path / "early.parquet"
    clip(0.0, 60.0).write_parquet(early)  # M again
    before, path = kept(league), place(league, where)
    (league / "catalog.duckdb").unlink()
    with REFUSED[kind][0](path):
        for words in (("run",), ("train",), *((("import", early),) if where == "match" else ())):
            code, out, err = call(*words, "--data", league)
            assert (code, REFUSED[kind][1] in out + err, str(path) in out + err) == (1, True, True), (words, out, err)
    assert kept(league) == before


@pytest.mark.parametrize("what", [".lock", "matches", "inbox", "runs", "."])
def test_closed_folders_and_locks(league, call, what):
    """A folder that may not be searched is not empty, and a lock that may not be taken is said."""
    (league / "inbox").mkdir()
    close(league / what)
    with as_user():
        for words in (["run"], *([["sql", "select 1"]] if what in (".lock", "matches", ".") else [])):
            code, out, err = call(*words, "--data", league)
            assert (code, "(Permission denied)" in out + err) == (1, True), (words, out, err)


@pytest.mark.skipif(not ROOT, reason="only root can give files to another user")
def test_two_users(league, call, tmp_path):
    """Two users of a group work in one folder in turn: folders with the setgid bit, a umask of 002."""
    for path in [league, *league.rglob("*")]:
        os.chown(path, OTHER, GROUP)
        path.chmod(0o2775 if path.is_dir() else 0o664)
    for number, start in enumerate((120.0, 200.0)):
        file = tmp_path / f"more-{number}.parquet"
        clip(start, start + 20.0).write_parquet(file)
        before = os.umask(0o002)
        with as_user(GROUP):
            for words in (["import", file], ["run"], ["sql", "select count(*) from matches"], ["verify"], ["prune"]):
                code, out, err = call(*words, "--data", league)
                assert code == 0, (words, out, err)
        os.umask(before)
        for path in [league, *league.rglob("*")]:  # the other user's turn: what is his was this one's
            assert path.stat().st_gid == GROUP
            os.chown(path, OTHER if path.stat().st_uid == 0 else 0, GROUP)
    assert match_of(league, 3)


def test_damage_in_python(league, call):
    """Notebooks and programs get the error; what they ask to leave out is warned of. `prune` keeps what it may name."""
    path = place(league, "match")
    flipped(path)
    code, out, err = call("prune", "--data", league)
    assert (code, out, str(path) in err) == (LEFT_OUT, "0 superseded files removed\n", True)
    opened = pitchlore.open(league)
    assert len(opened.matches) == 2
    with pytest.raises(CorruptFile, match="checksum differs"):
        opened.match(match_of(league))
    assert opened.match(match_of(league, 1)).goals.height >= 0
    other = match_of(league, 1)
    stray = Path(shutil.copy(path.with_name(f"{other}.receipt.json"), path.with_name(f"{other} (copy).receipt.json")))
    code, out, _ = call("run", "--data", league)
    assert (code, f"{stray}: is the receipt of matches {other}. Remove it." in out) == (1, True), out
    stray.unlink()
    assert call("run", "--data", league)[0] == 0
