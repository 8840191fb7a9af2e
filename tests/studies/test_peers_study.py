"""The study of peers: a network as arrays, the rows of its tables, and the decisions that are exported."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from looking.learners import STATIC
from peers import logged, playing
from peers.network import Network, load
from peers.playing import by_network, played
from peers.results import ahead, curve, learners, markdown
from peers.teams import OURS

from pitchlore.pipeline.arena.env import BEHAVIOURS
from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.arena.match.sighted import scales
from pitchlore.schemas import ROLES
from pitchlore.schemas.sights import SIGHT


def network(activation="relu"):
    """Two numbers in; the first output is that of |x|, the second is what is left of 1."""
    return Network(
        (np.array([[1.0, -1.0], [0.0, 0.0]], dtype=np.float32), np.array([[1.0, 0.0], [1.0, 0.0]], dtype=np.float32)),
        (np.zeros(2, dtype=np.float32), np.array([0.0, 1.0], dtype=np.float32)), activation)


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_network(activation, tmp_path):
    """It chooses the greatest output, and the same after it was kept."""
    seen = np.array([[-3.0, 9.0], [0.5, 9.0], [2.0, 9.0]], dtype=np.float32)
    path = tmp_path / "network.npz"
    network(activation).save(path)
    expected = [0, 1, 0] if activation == "relu" else [1, 1, 1]  # of tanh the two halves cancel out
    assert network(activation).choose(seen).tolist() == load(path).choose(seen).tolist() == expected


@pytest.mark.slow
def test_played(tmp_path, monkeypatch):
    """A network plays pairs of matches once; what was played is there the next time, and no other team's."""
    path = tmp_path / "network.npz"
    Network((np.zeros((33, 32), dtype=np.float32),), (np.eye(32, dtype=np.float32)[0],), "relu").save(path)
    choose = by_network(path)
    found = played("one", choose, "best-constant", [3], tmp_path)
    assert found.columns == ["seed", "difference"]
    assert found["difference"].item() < 0, "it does the same all the time"
    monkeypatch.setattr(playing, "differences", lambda *_: pytest.fail("it has played that"))
    assert played("one", choose, "best-constant", [3], tmp_path).equals(found)
    assert played("one", choose, "best-constant", [4], tmp_path, there=True).is_empty()
    assert played("one", choose, "constant:044", [3], tmp_path, there=True).is_empty()
    assert played("other", choose, "best-constant", [3], tmp_path, there=True).is_empty()


def test_export(tmp_path):
    """Decisions as arrays: what is seen is scaled, an episode is that of a robot, and ends by a goal or otherwise."""
    sight = dict.fromkeys(SIGHT, 0.0) | {"ball_x": 0.4, "behind": -1.0}
    blank = sight | {"to_own_line": None}
    rows = [  # robot, role, episode, behaviour, reward, change
        (1, "goalkeeper", 0, "goalkeeper-044", 0.0, 0.25), (1, "midfield", 0, None, -1.0, -1.0),
        (2, "striker", 0, "striker-184", 0.0, None),
        (2, "striker", 1, "striker-044", 0.0, 0.5), (2, "striker", 1, "striker-044", 1.0, 1.0)]
    decisions = pl.DataFrame([
        {"match_id": "m", "team": "home", "robot": robot, "role": role, "episode": episode, "behaviour_id": behaviour,
         "reward": reward, "change": change, "sight": [*(blank if place == 1 else sight).values()]}
        for place, (robot, role, episode, behaviour, reward, change) in enumerate(rows)],
        schema_overrides={"role": pl.Enum(ROLES), "sight": pl.Array(pl.Float32, len(SIGHT))})
    logged.export(decisions, tmp_path / "decisions.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["decisions.npz"]
    found = np.load(tmp_path / "decisions.npz")
    assert [BEHAVIOURS[action] for action in found["actions"]] == [44, 194, 184, 44, 44]
    assert found["rewards"].tolist() == [0, -1, 0, 0, 1]
    assert found["changes"].tolist() == [0.25, -1, 0, 0.5, 1]
    assert found["terminals"].tolist() == [False, True, False, False, True]
    assert found["timeouts"].tolist() == [False, False, True, False, False]
    seen = found["observations"]
    assert seen[:, len(SIGHT):].tolist() == np.eye(3)[[0, 1, 2, 2, 2]].tolist()
    names = list(SIGHT)
    assert seen[:, names.index("ball_x")] == pytest.approx(0.4 / scales(MatchSettings())[names.index("ball_x")])
    assert seen[:, names.index("behind")].tolist() == [-1.0] * 5
    assert seen[1, names.index("to_own_line")] == 0, "not known"


def results():
    """Two trainings of a peer, one of ours, and a control."""
    common = {"opponent": STATIC, "pairs": 5, "low": -9.0, "high": 9.0}
    return pl.DataFrame([
        {"learner": "static", "seed": None, "matches": 0, "difference": 2.0, **common, "opponent": "human-like"},
        {"learner": OURS, "seed": 1, "matches": 140, "difference": 3.0, **common},
        {"learner": "ppo", "seed": 1, "matches": 140, "difference": 4.0, **common},
        {"learner": "ppo", "seed": 2, "matches": 140, "difference": 6.0, **common},
        {"learner": "dqn", "seed": 1, "matches": 1_400, "difference": 9.0, **common},
    ])


def test_learners():
    """Intervals are over trainings, or over pairs of matches where there is one training; they say which."""
    found = {row["learner"]: row for row in learners(results()).iter_rows(named=True)}
    assert (found["ppo"]["difference"], found["ppo"]["trainings"], found["ppo"]["of"]) == (5.0, 2, "trainings")
    assert found["ppo"]["low"] == pytest.approx(5 - 12.706, abs=0.01)
    assert (found[OURS]["low"], found[OURS]["of"]) == (-9.0, "pairs of matches")


def test_ahead():
    """Ours less a peer's after as many matches: pairs of one seed, or all trainings; there is no row of a single one."""
    common = {"opponent": STATIC, "matches": 140}
    ours = [{"learner": OURS, "seed": seed, "difference": lead} | common for seed, lead in ((51, 9.0), (52, 13.0), (53, 5.0))]
    ppo = [{"learner": "ppo", "seed": seed, "difference": lead} | common for seed, lead in ((21, 4.0), (22, 6.0))]
    bc = [{"learner": "bc", "seed": seed, "difference": lead} | common for seed, lead in ((51, 1.0), (52, 5.0))]
    found = ahead(pl.DataFrame([*ours, *ppo, *bc])).rows_by_key("learner", named=True, unique=True)
    assert (found["ppo"]["difference"], found["bc"]["difference"]) == (9 - 5, 11 - 3)
    assert found["ppo"]["low"] < 0 < found["ppo"]["high"]
    assert found["bc"]["low"] == found["bc"]["high"] == 8, "each is 8 ahead of that which learned from its log"
    assert ahead(pl.DataFrame([*ours[:1], *ppo])).is_empty()


def test_markdown():
    """The best against the static team at equal matches leads, be it a peer; then who had more; then controls."""
    names = [line.split("|")[1].strip() for line in markdown(learners(results())).splitlines()[2:]]
    assert names == ["ppo", f"**{OURS}**", "dqn", "static"]


def test_curve():
    """A row a number of matches; controls, and matches against others, are no part of it."""
    lines = curve(learners(results())).splitlines()
    assert lines[0] == f"| against static after | ppo | {OURS} | dqn |"
    assert lines[2].startswith("| 140 matches | +5.0 [−")
    assert "| +3.0 [−9.0, 9.0]† |" in lines[2], "of one training"
    assert len(lines) == 4


@pytest.mark.parametrize("learner", ["ppo", "dqn"])
def test_stopped(learner, tmp_path, monkeypatch):
    """A training that was stopped goes on from its last whole state, and ends with the same network."""
    pytest.importorskip("stable_baselines3", reason="`make check-env` has it")
    from peers import online  # only now: it needs torch

    monkeypatch.setattr(online, "AT_ONCE", 5)
    monkeypatch.setattr(online, "SAVED_EACH", 10)
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    online.train(learner, 1, whole, 20, None)
    online.train(learner, 1, stopped, 15, None)  # its last whole state is that of 10 matches
    online.train(learner, 1, stopped, 20, None)
    assert {path.name: path.read_bytes() for path in whole.glob("*.npz")}.items() <= {
        path.name: path.read_bytes() for path in stopped.glob("*.npz")}.items()
    assert sorted(path.stem for path in stopped.glob("*.npz")) == [f"{learner}-1-{over}" for over in (0, 15, 20)]
    monkeypatch.setattr(online.Pitches, "step_wait", lambda pitches: pytest.fail("it has played long enough"))
    online.train(learner, 1, stopped, 20, None)
    online.train(learner, 1, stopped, None, 0.0)
