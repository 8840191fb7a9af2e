"""Seasons against any team: learned ones, the apprentice itself, several in turn."""

import pytest

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.teams import load_rival, rivals
from pitchlore.pipeline.stages.seasons.settings import ITSELF, Season, parse_season
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Games

SHORT = 'base = "best-in-games"\ngames = 3\n[referee]\nduration_s = 10\n'
OWN = parse_season(SHORT, where="short.toml")


@pytest.mark.slow
def test_in_turn(call, tmp_path):
    """A script, a constant team and the apprentice itself take turns; what is there is not played again."""
    (tmp_path / "short.toml").write_text(SHORT)
    words = ("season", "--settings", tmp_path / "short.toml", "--in-turn", "--opponent", "pressing", "--opponent", "constant:044",
             "--opponent", ITSELF, "--on", "threads:1", "--data", tmp_path / "data")
    code, out, _ = call(*words)
    assert (code, "short-pressing-constant-044-itself-1" in out) == (0, True)
    store = Store(tmp_path / "data")
    (receipt,) = store.receipts("seasons")
    assert store.read_table(receipt, "games", Games)["opponent"].unique().to_list() == ["pressing-constant-044-itself"]
    season = Store(store.root / receipt.details["store"])
    aways = [match.settings["away"] for match in sorted(season.receipts("matches"), key=lambda match: match.settings["seed"])]
    assert [away["kind"] for away in aways] == ["pressing", "learned", "learned"]
    assert aways[1]["policy"].startswith("constant:044")
    second, last = season.manifests("policies")[1:]
    assert aways[2]["policy"].endswith(second.files["policies"].sha256)
    assert last.version == second.version + 1
    assert call(*words)[0] == 0
    assert len(list(season.receipts("matches"))) == 3
    # an apprentice is an opponent like any other, as long as it does not learn
    name, found = rivals(store, (receipt.name,))
    assert (name[:23], len(name), found[0].word) == ("short-pressing-constant", 32, receipt.name)
    load_rival(store, found[0], known := {})
    assert list(known) == [found[0].team.policy]
    changed = found[0].model_copy(update={"team": found[0].team.model_copy(update={"policy": "v1 0"})})
    with pytest.raises(BadSettings, match="has learned since the season began"):
        load_rival(store, changed, {})


def test_names(tmp_path):
    """A season is named for its opponents; a long name ends with a hash."""
    store = Store(tmp_path)
    assert [rivals(store, (word,)) for word in ("static", "person")] == [("static", ()), ("person", ())]
    assert rivals(store, ("constant:44/21/21",))[0] == "constant-44-21-21"
    name, found = rivals(store, ("static", "pressing", "counter", "constant:44/21/21"))
    assert len(name) == 32
    season = Season(name="x", opponent=name, rivals=found, seed=1, settings=OWN)
    assert [season.rival(game).word for game in (1, 2, 5)] == ["static", "pressing", "static"]


@pytest.mark.parametrize(("words", "why"), [
    (("nobody",), "'nobody' is no team"), (("remote",), "takes no turns"), (("static", "person"), "takes no turns")])
def test_refused(call, tmp_path, words, why):
    """A word that names no opponent is one line, before a game is played."""
    code, _, err = call("season", "--in-turn", "--data", tmp_path / "data", *(part for word in words for part in ("--opponent", word)))
    assert (code, why in err) == (1, True)
    assert not (tmp_path / "data" / "seasons").exists()
