"""Decisions as a Minari dataset: written by the command, loaded by Minari, equal to the table."""

import json
import re
import sys

import minari
import polars as pl
import pytest
from conftest import clip
from polars.testing import assert_frame_equal
from support.league import bring
from support.played import policy

from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.matches import import_recording
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.state import encode
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views import datasets
from pitchlore.schemas import ROLES, Decisions

pytestmark = pytest.mark.slow

ID = "derby/decisions-v0"


@pytest.fixture(scope="module")
def league(tmp_path_factory):
    """A played match with logged decisions and a recorded one, and a version of the knowledge."""
    folder = tmp_path_factory.mktemp("datasets")
    store = Store(folder / "data")
    known = PolicyTables(policy(*((role, 0, codes, 0.5) for role in ROLES for codes in ("046-044-021", "194"))))
    record(store, Recipe(
        home=TeamSettings(kind="learned", policy="known", explore=0.5), away=TeamSettings(kind="static"), seed=9,
        referee=RefereeSettings(duration_s=20.0)), {"known": known})
    clip(0.0, 30.0).write_csv(folder / "derby.csv")
    import_recording(store, Recording(file=folder / "derby.csv"))
    bring(store)
    return store


@pytest.fixture
def written(league, call, tmp_path, monkeypatch):
    """Writes a dataset; what the command says."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))

    def write(*words):
        code, out, err = call("minari", *words, "--data", league.root)
        return code, out, err

    return write


def table(store) -> pl.DataFrame:
    return store.read_table(store.receipt("decisions", "all"), "decisions", Decisions)


def rebuilt(dataset) -> pl.DataFrame:
    """The table of decisions, of nothing but what Minari loads."""
    known = dataset.storage.metadata
    reported = dataset.storage.get_episode_metadata(range(dataset.total_episodes))
    rows = []
    for episode, own in zip(dataset.iterate_episodes(), reported, strict=True):
        assert all(seen in dataset.observation_space for seen in episode.observations)
        assert all(action in dataset.action_space for action in episode.actions)
        assert len(episode.observations) == len(episode.actions) + 1
        infos, options = episode.infos, own["options"]
        states = encode(episode.observations[:-1], "full36")
        for t, action in enumerate(episode.actions):
            behaviour = known["behaviours"][action]
            rows.append({
                "match_id": options["match_id"], "team": options["team"], "robot": int(options["robot"]),
                "role": known["roles"][infos["role"][t]], "t_ns": int(infos["t_ns"][t]),
                "end_ns": int(infos["t_ns"][t + 1]), "state": int(states[t]),
                "behaviour_id": None if behaviour == "194" else behaviour,
                "chosen": bool(infos["chosen"][t]), "random": bool(infos["random"][t]),
                "reward": float(episode.rewards[t]), "episode": int(options["episode"]),
                "ends": "terminal" if episode.terminations[t] else "truncated" if episode.truncations[t] else None,
                "value": float(infos["value"][t]),
            })
    return pl.DataFrame(rows, schema=Decisions.dtypes())


def test_round_trip(league, written):
    """All decisions of all matches come back, logged and observed ones, with their provenance."""
    code, out, err = written(ID, "--json")
    assert code == 0, err
    said = json.loads(out)
    dataset = minari.load_dataset(ID)
    expected = table(league)
    assert_frame_equal(rebuilt(dataset), expected)
    assert expected["chosen"].any()
    assert not expected["chosen"].all()
    assert expected["behaviour_id"].null_count() > 0
    assert said["steps"] == dataset.total_steps == expected.height
    known = dataset.storage.metadata
    assert known["knowledge_version"] == 1
    assert {match.split("-")[0]: seed for match, seed in known["matches"].items()} == {"derby": None, "learned": 9}
    assert known["code_permalink"] == league.receipt("decisions", "all").software
    assert len(known["elements"]) == 36
    assert {own.get("seed") for own in dataset.storage.get_episode_metadata(range(dataset.total_episodes))} == {None, 9}


def test_of_some_matches(league, written):
    """A match by the beginning of its id; Minari's own sampling works on it."""
    code, out, _ = written(ID, "derby")
    assert code == 0
    assert f'minari.load_dataset("{ID}")' in out
    dataset = minari.load_dataset(ID)
    assert_frame_equal(rebuilt(dataset), table(league).filter(pl.col("match_id").str.starts_with("derby")))
    long = dataset.filter_episodes(lambda episode: len(episode.actions) > 1)
    assert 0 < len(long) < len(dataset)
    assert len(dataset.sample_episodes(2)) == 2


@pytest.mark.parametrize(("words", "said"), [
    ((ID, "nobody"), r"nobody: no match with decisions is called so \(there are: derby-"),
    (("derby",), "derby: is no id of a Minari dataset. Name it NAME-v0"),
    (("../up-v0",), "is no id of a Minari dataset"),
])
def test_errors(written, words, said):
    code, out, err = written(*words)
    assert (code, out) == (1, "")
    assert re.search(said, err)


def test_never_over_another(written, tmp_path):
    written(ID)
    before = sorted((tmp_path / "minari").rglob("*"))
    code, _, err = written(ID)
    assert code == 1
    assert "there is such a dataset already" in err
    assert sorted((tmp_path / "minari").rglob("*")) == before


def test_nothing_half_written(league, tmp_path, monkeypatch):
    """If an episode cannot be written, there is no dataset."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    origin = datasets.DecisionSource({}, None, "pitchlore", {})  # no match has a seed, not even None
    with pytest.raises(KeyError):
        datasets.write_dataset(ID, table(league), origin)
    assert not (tmp_path / "minari" / ID).exists()


def test_without_the_extra(written, monkeypatch):
    """Where Minari is not installed, the command names the extra."""
    monkeypatch.setitem(sys.modules, "minari", None)
    monkeypatch.delitem(sys.modules, "pitchlore.pipeline.views.datasets")
    monkeypatch.delattr("pitchlore.pipeline.views.datasets")
    code, _, err = written(ID)
    assert code == 1
    assert "needs minari, which is not installed. Install the extra pitchlore[rl]" in err
