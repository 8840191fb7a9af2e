"""Restarts: their kinds, what came of each, and the control of any moment of play."""

import polars as pl
import pytest
from support.recordings import ALL, RSIM, bodies_of, imported
from test_events import HOME, found, match

from pitchlore.pipeline.importers.rcg.events import _RESTARTS
from pitchlore.pipeline.importers.tracking.states import _WORDS_OF
from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.pipeline.settings import EventSettings
from pitchlore.pipeline.stages.events.derive import events
from pitchlore.pipeline.stages.events.restarts import kind_of
from pitchlore.pipeline.views.scout.restarts import SOON_S, any_moment, paid
from pitchlore.schemas import Restarts
from pitchlore.schemas.restarts import RESTARTS

#: Home 1 kicks the ball towards the adversary's goal at 1 s.
SHOOTS = [(0, 0.3, 0), (1, 0.3, 0), (1.5, 0.7, 0), (4, 0.7, 0)]
SHOOTER = {(HOME, 1): (0.24, 0.0)}


@pytest.mark.parametrize(("note", "kind"), [
    ("GOAL_KICK_YELLOW", "goal kick"), ("free ball", "free ball"), ("freeball_b", "free ball"), ("drop_ball", "free ball"),
    ("penalty_kick_l", "penalty"), ("indirect_free_kick_r", "free kick"), ("directEnemy", "free kick"),
    ("kick_in_l", "kick-in"), ("corner_kick_r", "corner"), ("throwIn", "kick-in"), (None, "other"), ("segment", "other"),
])
def test_kind(note, kind):
    """The source's word tells the kind, however it is written."""
    assert kind_of("fault", note) == kind
    assert kind_of("kick-off", note) == "kick-off"


@pytest.mark.parametrize("word", [*_WORDS_OF["fault"].split(), *sorted(_RESTARTS)])
def test_every_word_of_the_importers(word):
    """Each word that an importer takes for a restart has a kind."""
    assert kind_of("fault", word) in set(RESTARTS) - {"other", "kick-off"}


def test_both_sides():
    """A restart has a row for each side: its shot is the other's shot against."""
    table = Restarts.validate(found(match(SHOOTS, SHOOTER)).restarts)
    home, away = table.rows(named=True)
    assert (home["team"], home["own"], away["team"], away["own"]) == ("home", True, "away", False)
    assert home["taken_ns"] <= home["shot_ns"] == away["against_ns"]
    assert home["against_ns"] is away["shot_ns"] is home["goal_ns"] is None
    assert home["taken_ns"] == 0


def test_nobody_restarts():
    """A restart of neither team is nobody's own; one that nobody takes has no time."""
    table = found(match([(0, 0, 0), (4, 0, 0)], {(HOME, 1): (0.5, 0.5)}, referee=((0, "fault", None),))).restarts
    assert table.select("own", "taken_ns", "kind").unique().rows() == [(None, None, "other")]
    assert table["segment"].to_list() == [0, 0]


def test_goal():
    """The goal that ends the play after a restart is the scorer's, and conceded by the other."""
    log = match(SHOOTS, SHOOTER, referee=((0, "kick-off", "away"), (2, "goal", "home"), (3, "kick-off", "away")))
    first = found(log).restarts.filter(pl.col("t_ns") == 0)
    assert first.select("team", "goal_ns", "conceded_ns").rows() == [("home", 2 * 10**9, None), ("away", None, 2 * 10**9)]


def test_no_play_after():
    """A restart that the next one replaces before a sample of play has no segment, and what follows is the next one's."""
    log = match(SHOOTS, SHOOTER, referee=((0, "stop", None), (0.5, "fault", "home"), (0.5, "kick-off", "home")))
    table = found(log).restarts.filter("own")
    assert table.select("kind", pl.col("segment").is_null(), pl.col("shot_ns").is_null()).rows() == [
        ("other", True, True), ("kick-off", False, False)]


@pytest.mark.parametrize("name", ALL)
def test_on_recordings(name):
    """Two rows a restart; shots are those of the table shots, and a side's are the other's against."""
    log = imported(name)
    it = found(log)
    table = Restarts.validate(it.restarts)
    given = log.referee.filter(pl.col("event").is_in(["kick-off", "fault"]))
    assert table.height == 2 * given.height > 0
    assert table["t_ns"].to_list() == [t for t in sorted(given["t_ns"].to_list()) for _ in range(2)]
    assert set(table["shot_ns"].drop_nulls()) <= set(it.shots["t_ns"])
    home, away = (table.filter(pl.col("team") == side) for side in ("home", "away"))
    for one, other in (("shot_ns", "against_ns"), ("goal_ns", "conceded_ns")):
        assert home[one].equals(away[other].rename(one))
        assert away[one].equals(home[other].rename(one))
    assert (table.drop_nulls("shot_ns")["shot_ns"] >= table.drop_nulls("shot_ns")["taken_ns"]).all()
    assert table["segment"].drop_nulls().value_counts()["count"].to_list() == [2] * table["segment"].drop_nulls().n_unique()


def test_control():
    """The control counts the samples of play that are followed by a shot or a goal, as a loop over them does."""
    log, table = imported(RSIM), bodies_of(RSIM)
    it = events(table, log.referee, log.info.pitch, EventSettings())
    both = any_moment(table, it.shots, log.referee)
    ball = table.filter(pl.col("team") == "ball", pl.col("segment").is_not_null())
    goals = [(t, team) for t, event, team in log.referee.select("t_ns", "event", "team").iter_rows() if event == "goal"]
    ends = dict(ball.group_by("segment").agg(pl.col("t_ns").max()).iter_rows())
    shots = it.shots.select("t_ns", "segment", "team").rows()
    hits = {side: [0, 0] for side in both}
    for t_ns, segment in ball.select("t_ns", "segment").iter_rows():
        for side, counts in hits.items():
            counts[0] += any(0 <= at - t_ns <= SOON_S * 1e9 and there == segment and of == side for at, there, of in shots)
            # a goal lies at the end of its segment
            counts[1] += any(0 <= at - t_ns <= SOON_S * 1e9 and of == side and 0 <= at - ends[segment] < 1e9 for at, of in goals)
    assert both["home"].n == ball.height
    assert {side: [it.shot, it.goal] for side, it in both.items()} == hits
    assert (both["home"].against, both["home"].conceded) == (both["away"].shot, both["away"].goal)


def test_paid():
    """Shares are of a kind's own restarts, within 8 s of the first touch, with Wilson's interval."""
    second = 10**9
    rows = [{"match_id": "m-1", "t_ns": n, "team": "home", "own": own, "kind": kind, "taken_ns": taken, "shot_ns": shot}
            for n, (own, kind, taken, shot) in enumerate((
                (True, "penalty", 0, 8 * second), (True, "penalty", 0, 8 * second + 1), (True, "penalty", None, None),
                (False, "penalty", 0, 0), (None, "free ball", 0, 0)))]
    penalty, ball = paid(Restarts.of(rows))
    assert (penalty.kind, penalty.shot.hits, penalty.shot.n, ball.own) == ("penalty", 1, 3, None)
    assert (penalty.shot.low, penalty.shot.high) == wilson(1, 3)
    assert paid(Restarts.empty()) == []
