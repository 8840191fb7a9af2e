"""Seasons through Prefect and the command line: several at once, and failures on their own."""

from threading import Barrier

import pytest

from pitchlore.pipeline.base.errors import StorageFailed
from pitchlore.pipeline.engine import season as loop
from pitchlore.pipeline.engine.season import play_seasons
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Games, Growth

SHORT = 'base = "paper"\ngames = 3\nlead_from = 3\n[referee]\nduration_s = 20'
#: What is really played.
SHORTER = SHORT.replace("= 3", "= 2").replace("= 20", "= 3")


def season(seed, text=SHORT):
    return Season(name="short", opponent="static", seed=seed, settings=parse_season(text, where="short.toml"))


@pytest.fixture(scope="module")
def together(tmp_path_factory):
    """A data folder with two seasons that two processes played at once."""
    data = tmp_path_factory.mktemp("together")
    report = play_seasons(data, [season(1, SHORTER), season(2, SHORTER)], on="processes:2")
    assert report.failed == {}
    assert sorted(report.made) == [f"short-static-{seed} game {game}" for seed in (1, 2) for game in (1, 2)]
    return data


def test_seasons_at_once(together):
    """Seasons played at once are whole, and a second run plays none of them again."""
    store = Store(together)
    matches = []
    for seed in (1, 2):
        receipt = store.receipt("seasons", season(seed).id)
        games, growth = store.read_table(receipt, "games", Games), store.read_table(receipt, "growth", Growth)
        assert games["game"].to_list() == [1, 2]
        assert growth.height == 6
        matches.append(games["match_id"].to_list())
    assert not set(matches[0]) & set(matches[1])
    again = play_seasons(together, [season(1, SHORTER), season(2, SHORTER), season(2, SHORTER)], on="threads:1")
    assert (again.made, again.kept, again.failed) == ([], 2, {})


def test_jobs(tmp_path, monkeypatch):
    """As many seasons are played at once as there are workers."""
    met = Barrier(3, timeout=60)
    monkeypatch.setattr(loop, "take_game", lambda *_: met.wait())
    one_game = SHORT.replace("games = 3", "games = 1")
    report = play_seasons(tmp_path, [season(seed, one_game) for seed in range(6)], on="threads:3")
    assert (len(report.made), report.failed) == (6, {})


def test_failed_season(tmp_path, monkeypatch):
    """A season that fails stops alone and says why."""
    Store(tmp_path).commit(Work("seasons", season(3).id, {}, version=1), Made())
    tried = []

    def take(data, turn, discard):
        tried.append(turn.label)
        if turn == (season(1), 2):
            raise ValueError("a bug,\nsay")
        if turn == (season(2), 1) and tried.count(turn.label) == 1:
            raise StorageFailed("cannot be written", next_step="Free space")

    monkeypatch.setattr(loop, "take_game", take)
    longer = season(4, SHORT.replace("games = 3", "games = 4"))
    report = play_seasons(tmp_path, [*map(season, (1, 2, 3)), longer], on="threads:1")
    assert report.failed == {
        "short-static-1 game 2":
            "unexpected ValueError: a bug, say. Run again with --debug and report what it says.",
        "short-static-3":
            "short-static-3: was begun with other settings or by another version of pitchlore. Take another seed,"
            f" or remove {tmp_path}/seasons/short-static-3* to play it anew.",
    }
    assert tried.count("short-static-2 game 1") == 2, "the disk may have space again"
    # of the season that has most games left is played next
    assert report.made == [f"short-static-{seed} game {game}" for seed, game in (
        (4, 1), (1, 1), (2, 1), (4, 2), (2, 2), (4, 3), (2, 3), (4, 4))]
