"""The map belongs to the match: it is kept until another is given."""

from pathlib import Path

import pytest

from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.lacking import remarks
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.store import Store

CSV = "Nr;ms;who;no;px;py\n" + "".join(
    f"{i};{20 * i};{team};{no};{x};1\n" for i in range(3)
    for team, no, x in (("pill", "", 0), ("reds", 1, 20), ("blues", 1, -20)))
MAP = """
columns = {frame = "Nr", t = "ms", team = "who", player = "no", x = "px", y = "py"}
units = {time = "ms", length = "cm"}
teams = {home = "reds", ball = "pill"}
"""


@pytest.fixture
def derby(tmp_path: Path) -> tuple[Store, Path, Path]:
    """A data folder into which a recording came with a map that is not beside it."""
    file, mapping = tmp_path / "here" / "derby.csv", tmp_path / "league.toml"
    file.parent.mkdir()
    file.write_text(CSV)
    mapping.write_text(MAP)
    store = Store(tmp_path / "data")
    receipt, new, _ = take_in(store, Recording(file=file, mapping=mapping))
    assert new
    assert receipt.details["home"] == "reds"
    return store, file, mapping


def test_kept_when_made_anew(derby: tuple[Store, Path, Path]) -> None:
    """Importing again without a map changes nothing; a match that has to be made anew is made with the map that it has."""
    store, file, _ = derby
    report = import_all(store, [Recording(file=file)])
    assert (report.kept, report.made) == (1, [])
    (before,) = store.receipts("matches")
    (store.root / before.files["log"].path).unlink()
    receipt, new, _ = take_in(store, Recording(file=file))
    assert new
    assert (receipt.details["home"], receipt.key) == ("reds", before.key)


def test_another(derby: tuple[Store, Path, Path]) -> None:
    """Another map takes its place; an empty one takes it away, which this recording cannot do without."""
    store, file, mapping = derby
    mapping.write_text(MAP.replace('"reds"', '"blues"'))
    receipt, new, _ = take_in(store, Recording(file=file, mapping=mapping))
    assert new
    assert receipt.details["home"] == "blues"
    assert take_in(store, Recording(file=file))[:2] == (receipt, False)
    mapping.write_text("")
    with pytest.raises(Exception, match=rf"has 3 teams.* {receipt.name} stays as it was\.$"):
        take_in(store, Recording(file=file, mapping=mapping))
    assert store.quarantined() == []
    (kept,) = store.receipts("matches")
    assert kept.details["home"] == "blues"


def test_weighty_remarks(derby: tuple[Store, Path, Path]) -> None:
    """The weightiest of too many remarks are said: unknown goals before the team that was taken as home."""
    store, file, mapping = derby
    mapping.write_text(MAP.replace('home = "reds", ', ""))
    take_in(store, Recording(file=file, mapping=mapping))
    told, more = remarks(store, store.receipts("matches"), most=1)
    assert "Nothing is learned from this match" in told
    assert more == "… and 1 remark of less weight (table quality)."
