"""The randomised trial of the team that looks: who acts how, what a second is worth, and what is earned."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from looking import seconds as played
from looking.choosing import Chooser
from looking.decisions import cells
from looking.effects import differences, shares, worth_of
from looking.lots import FIRST, WHOLE, Trial
from looking.seconds import seconds

from pitchlore.pipeline.arena.env import BEHAVIOURS, ParallelMatch, parallel_env
from pitchlore.pipeline.arena.teams.appraising import ActionValues, appraiser_of
from pitchlore.schemas import ROLES, Appraisals
from pitchlore.schemas.sights import SIGHT

TRIAL = FIRST["looking-held"]
WAYS = TRIAL.ways
LOOKS, CONSTANT, BLIND = range(len(WAYS))
#: Length of a match.
SECONDS = 240
UP = list(SIGHT).index("ball_x")


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Matches are shorter than those of the study."""
    monkeypatch.setattr(played, "pitch_of", lambda opponent, side: parallel_env(
        opponent, side=side, actions="behaviours", observations="sights", step_s=0.2, minutes=SECONDS / 60))


@pytest.fixture(scope="module")
def appraiser() -> ActionValues:
    """Everybody may reach the ball (044) or stand (088); to reach is better where the ball is far up."""
    pairs = pl.DataFrame({"role": role, "behaviour_id": f"{role}-{code}"} for role in ROLES for code in ("044", "088"))
    leaf = {"version": 1, "code": 44, "tree": 1, "node": 0, "feature": None, "threshold": None, "missing_left": None,
            "left": None, "right": None, "value": 0.0}
    return appraiser_of(pairs, Appraisals.of([
        leaf | {"tree": 0},
        leaf | {"feature": "ball_x", "threshold": 0.0, "missing_left": True, "left": 1, "right": 2},
        leaf | {"node": 1, "value": -1.0}, leaf | {"node": 2, "value": 1.0},
        leaf | {"code": 88, "tree": 0}]))[0]


def at(up: list[float]) -> np.ndarray:
    """Sights with the ball here along the pitch."""
    found = np.zeros((len(up), len(SIGHT)), np.float32)
    found[:, UP] = up
    return found


def test_ways_to_act(appraiser):
    """A looking robot follows what it sees; another plays a constant team's part; the blind one looks elsewhere."""
    choose = Chooser(appraiser, WAYS, np.random.default_rng(1))
    roles = np.array([0, 1, 2, 2])
    sights = at([0.5, -0.5, 0.5, -0.5])
    acts = [BEHAVIOURS[action] for action in choose(sights, roles, np.full(4, LOOKS))]
    assert acts == [44, 88, 44, 88]
    assert [BEHAVIOURS[action] for action in choose(sights, roles, np.full(4, CONSTANT))] == [1, 88, 44, 44]
    assert choose.anew(np.array([LOOKS, CONSTANT, BLIND])).tolist() == [True, False, True]
    strikers, halves = np.full(2000, 2), at([0.5] * 1000 + [-0.5] * 1000)
    choose.keep(halves, strikers)
    blind = np.array(BEHAVIOURS)[choose(halves, strikers, np.full(2000, BLIND))]
    for seen in (blind[:1000], blind[1000:]):
        assert np.mean(seen == 44) == pytest.approx(0.5, abs=0.1), "whatever it sees itself"


def drawn(effect: dict[str, float], seconds: int = 30_000) -> pl.DataFrame:
    """Seconds whose change has an effect of looking by role, and none of being blind."""
    rng = np.random.default_rng(3)
    role, way = rng.choice(ROLES, seconds), rng.integers(len(WAYS), size=seconds)
    change = rng.normal(scale=0.1, size=seconds) + np.where(way == LOOKS, [effect[each] for each in role], 0.0)
    return pl.DataFrame({"role": role, "way": way, "first": rng.random(seconds) < 0.1, "change": change})


def test_what_a_second_is_worth():
    """An effect is found in the role that has it, within its interval; where there is none, none is earned."""
    rows = drawn({"goalkeeper": 0.0, "midfield": 0.02, "striker": -0.02})
    found = {(row["way"], row["less"], row["role"]): row for row in differences(rows, TRIAL, ["role"]).iter_rows(named=True)}
    for other in (WHOLE, "blind"):
        midfield, goalkeeper = found["looks", other, "midfield"], found["looks", other, "goalkeeper"]
        assert midfield["low"] < 0.02 < midfield["high"]
        assert goalkeeper["low"] < 0 < goalkeeper["high"]
    found = {(row["way"], row["less"]): (row["surely_more"], row["surely_less"])
              for row in shares(rows, TRIAL, ["role"]).iter_rows(named=True)}
    assert found["looks", WHOLE] == pytest.approx((0.3, 0.3), abs=0.01), "a third each, less the first seconds"
    assert found["blind", WHOLE] == (0, 0)
    few = differences(rows.head(1), TRIAL, ["role"])
    assert few["difference"].null_count() == few.height == 3


def test_each_roles_best_constant():
    """Each role's best constant of the draw comes first; looking has its half of the tickets, and no row."""
    trial = Trial(("looks", "looks", "constant:044", "constant:021/088/001"), range(1))
    assert trial.ways == ["looks", "constant:044", "constant:021/088/001"]
    rng = np.random.default_rng(2)
    role, way = rng.choice(ROLES, 6000), rng.integers(3, size=6000)
    better = (role == "striker") & (way == 1) | (role != "striker") & (way == 2)
    rows = pl.DataFrame({"role": role, "way": way, "change": rng.normal(scale=0.1, size=6000) + 0.05 * better})
    found = worth_of(rows, trial)
    assert found["role"].to_list() == [role for role in ROLES for _ in range(2)]
    assert found["code"].to_list() == [21, 44, 88, 44, 44, 1]
    assert found["seconds"].sum() == (way > 0).sum()
    assert (found["low"] < found["change"]).all()


def test_seconds_of_a_match(appraiser):
    """Each robot and second of play is a row; V changes alike for a team's robots; the draw is fair."""
    rows = seconds(appraiser, TRIAL, [5])
    assert set(rows["role"]) == {0, 1, 2}
    assert rows.height % 3 == 0
    assert 2 * SECONDS * 3 * 0.8 < rows.height <= 2 * SECONDS * 3
    assert rows.group_by("way").len()["len"].min() > 0.28 * rows.height
    assert rows["change"].is_between(-2, 2).all()
    team = rows["change"].to_numpy().reshape(-1, 3)
    assert (team == team[:, :1]).all()
    assert 0 < rows["first"].sum() < rows.height / 4
    assert rows["cell"].is_between(0, 35).all()
    assert len(np.unique(cells(at([-0.5, 0.0, 0.5])))) == 3


def test_what_the_lot_says_is_done(appraiser, monkeypatch):
    """Each robot acts in each second as the draw says, and begins anew unless it is a constant; goals count with their sign."""
    done, goals, on, step, begin = [], [], [], ParallelMatch.step, ParallelMatch.begin_anew

    class AsTheLotSays(Chooser):
        """Its action is the number of the way."""

        def __call__(self, sights, roles, ways):
            return ways

    def stepped(pitch, actions):
        on.append(pitch.match.in_play)
        found = step(pitch, actions)
        done.append([*actions.values()])
        goals.append(found[1][pitch.possible_agents[0]])
        return found

    monkeypatch.setattr(played, "Chooser", AsTheLotSays)
    monkeypatch.setattr(ParallelMatch, "step", stepped)
    anew = []
    monkeypatch.setattr(ParallelMatch, "begin_anew", lambda pitch, agents: (anew.append(len(agents)), begin(pitch, agents)))
    rows = seconds(appraiser, TRIAL, [5])

    whole = 2 * 5 * SECONDS  # steps of both matches' whole seconds; a last one is shorter
    acts = np.array(done[:whole]).reshape(-1, 5, 2, 3)  # seconds, steps, matches, robots
    assert (acts == acts[:, :1]).all(), "for a second"
    assert anew[:whole] == (acts != CONSTANT).sum(axis=3).ravel().tolist()
    begun = np.array(on[:whole]).reshape(-1, 5, 2)[:, 0]
    assert rows["way"][: 3 * begun.sum()].to_list() == acts[:, 0][begun].ravel().tolist()
    scored = np.array(goals[:whole]).reshape(-1, 5, 2).sum(axis=1)[begun]
    change = rows["change"].to_numpy().reshape(-1, 3)[: len(scored), 0]
    assert {*scored} >= {-1, 0, 1}
    assert (np.sign(change) == np.sign(scored))[scored != 0].all()
