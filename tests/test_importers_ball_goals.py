"""Goals found from the ball: what counts, what does not, and what a match says of it."""

import io

import numpy as np
import polars as pl
import pytest
from support.balls import put, way
from support.recordings import RSIM, SSL, imported, recording
from support.tracking import course, events, parquet, read

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.tracking.ball_goals import CONFIDENCE, BallGoal, ball_goals
from pitchlore.pipeline.importers.tracking.ball_restarts import Ball, ball_restarts
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap

VSSS = PITCHES[Kind.VSSS]
#: Times, s, and places, m, of a ball that goes into the goal at +x and lies there.
SHOT = ((0.0, 0.2, 0.0), (1.0, 0.74, 0.05), (1.1, 0.82, 0.06), (1.6, 0.82, 0.06))


def found(ball: Ball) -> list[tuple[str, str, int]]:
    """How each goal was found, and at which end."""
    goals = ball_goals(ball, VSSS, ball_restarts(ball, VSSS))
    return [(goal.crossing, goal.sequel, goal.end) for goal in goals]


@pytest.mark.parametrize("end", [1, -1])
def test_over_the_line_and_back_to_the_centre(end: int) -> None:
    """A ball that is behind the line and then at the centre is a goal; its time is that of the crossing."""
    ball = way(*SHOT, *put(1.6, 0.0, 0.0))
    (goal,) = ball_goals(ball._replace(x=end * ball.x), VSSS, [])
    crossed = ball.t_ns[np.flatnonzero(ball.x > VSSS.goal_x)[0]]
    centred = ball.t_ns[np.flatnonzero((ball.t_ns > 1.5e9) & (ball.x < 0.1))[0]]
    assert goal == BallGoal(int(crossed), end, CONFIDENCE["over", "centre"], "over", "centre", int(centred))


@pytest.mark.parametrize(("ball", "wanted"), [
    # put back when its centre has crossed: it was on the line
    (way((0.0, 0.2, 0.0), (1.0, 0.755, 0.05), *put(1.0, 0.0, 0.0)), ("line", "centre", 1)),
    # lost on its way into the goal, and then at the centre
    (way((0.0, 0.0, 0.0), (1.0, 0.73, 0.05), *put(2.0, 0.0, 0.0), lost=(0.98, 2.0)), ("unseen", "centre", 1)),
    (way(*SHOT, (4.0, 0.01, 0.0), (6.0, 0.01, 0.0)), ("over", "centre", 1)),  # carried by a hand, and lies still
    (way(*SHOT), ("over", "stopped", 1)),  # no kick-off: it stays behind the line, or is not seen any more
    (way(*SHOT, (3.0, 0.82, 0.06), (4.0, 0.3, 0.3), (6.0, -0.3, 0.3)), ("over", "stopped", 1)),
])
def test_what_follows(ball: Ball, wanted: tuple[str, str, int]) -> None:
    """A goal is told by how the ball crossed the line and by what followed."""
    assert found(ball) == [wanted]


def test_played_on() -> None:
    """A ball that comes back over the line and is played on is hardly a goal."""
    (goal,) = ball_goals(way(*SHOT[:3], (1.3, 0.6, 0.1), (9.0, -0.3, 0.3)), VSSS, [])
    assert (goal.sequel, goal.confidence) == ("played on", CONFIDENCE["over", "played on"])
    assert goal.confidence < TrackingMap().goals.confidence


@pytest.mark.parametrize(("place", "line_ups"), [((-0.375, 0.0), (1.6,)), ((0.6, 0.35), ()), ((0.1, 0.5), (1.6,))])
def test_put_elsewhere(place: tuple[float, float], line_ups: tuple[float, ...]) -> None:
    """A ball that is put elsewhere than to the centre was no goal: it was annulled, or a foul had come before."""
    ball = way(*SHOT, *put(1.6, *place), (4.0, 0.5, 0.3), *put(9.0, 0.0, 0.0), line_ups=line_ups)
    (goal,) = ball_goals(ball, VSSS, ball_restarts(ball, VSSS))
    assert (goal.sequel, goal.restart_ns) == ("elsewhere", None)
    assert goal.confidence < TrackingMap().goals.confidence
    assert found(way(*SHOT, *put(1.6, 0.0, 0.0), *put(8.0, *place))) == [("over", "centre", 1)]


@pytest.mark.parametrize("points", [
    ((0.0, 0.2, 0.3), (1.0, 0.82, 0.3), *put(1.5, 0.0, 0.0)),  # beside the posts
    ((0.0, 0.2, 0.0), (1.0, 0.76, 0.0), (1.5, 0.5, 0.0), *put(6.0, 0.0, 0.0)),  # not the whole ball
    ((0.0, 0.2, 0.4), (1.0, 0.82, 0.4), (1.5, 0.82, 0.0), *put(2.0, 0.0, 0.0)),  # in from the side, behind the line
    ((0.0, 0.2, 0.0), (1.0, 0.3, 0.0), *put(1.0, 0.82, 0.0), *put(3.1, 0.0, 0.0)),  # a camera saw it there
    (*put(0.0, 0.0, 0.0), (4.0, 0.3, 0.3), *put(4.0, 0.0, 0.0)),  # a kick-off alone
])
def test_no_goal(points: tuple[tuple[float, float, float], ...]) -> None:
    assert found(way(*points)) == []


def test_kick_off_of_the_last_crossing() -> None:
    """One kick-off tells one goal, the last crossing before it, and not after more than a minute and a half."""
    back = (*SHOT[:3], (1.3, 0.6, 0.1), (5.0, 0.6, 0.1))
    again = tuple((t + 6.0, x, y) for t, x, y in SHOT)
    assert [kind[1] for kind in found(way(*back, *again, *put(7.6, 0.0, 0.0)))] == ["played on", "centre"]
    late = (*back, (100.0, 0.6, 0.1), *put(100.0, 0.0, 0.0))
    assert [kind[1] for kind in found(way(*late))] == ["played on"]


def test_stopped_by_the_states() -> None:
    """A ball that goes into a goal while the states say that play is stopped is no goal."""
    ball = way(*SHOT, *put(1.6, 0.0, 0.0))
    assert found(ball._replace(stopped=np.ones(len(ball.t_ns), bool))) == []


@pytest.mark.parametrize("samples", [0, 1])
def test_too_few_samples(samples: int) -> None:
    assert ball_goals(Ball(*(column[:samples] for column in way(*SHOT))), VSSS, []) == []


# --- a match without a score ------------------------------------------------------------------------

def positions(name: str) -> pl.DataFrame:
    """A recording's positions, and nothing else."""
    return pl.read_parquet(io.BytesIO(recording(name))).select("frame", "t", "team", "player", "x", "y")


def test_positions_only() -> None:
    """All goals of a recording with positions only are found, each of its team; the score stays unknown."""
    reported = imported(RSIM).referee.filter(pl.col("event") == "goal")
    match = read(parquet(positions(RSIM)))
    goals = match.referee.filter(pl.col("event") == "goal")
    assert goals["team"].to_list() == reported["team"].to_list()
    assert (goals["t_ns"] - reported["t_ns"]).abs().max() <= 1e9  # type: ignore[operator]
    assert match.referee["score_home"].null_count() == len(match.referee)
    assert set(match.referee["event"].cast(pl.String)) == {"play", "goal", "kick-off", "fault"}
    assert match.info.settings["goals"] == {
        "from": "ball", "confidence": {str(t): CONFIDENCE["line", "centre"] for t in goals["t_ns"]}}
    (flaw,) = match.quality.filter(flaw="goals inferred").iter_rows(named=True)
    assert flaw["count"] == 25
    assert flaw["note"] == ("nothing tells goals, so they were found from the ball: on the line, then at the centre 25. "
                            "No score is made of them")


@pytest.mark.parametrize(("goals", "says"), [
    ({"from_ball": False}, "the map says from_ball = false"),
    ({"confidence": 1.0}, "25 less sure than 1 left out"),
])
def test_settings_of_the_map(goals: dict[str, object], says: str) -> None:
    """A map may ask for surer goals, or for none from the ball."""
    match = read(parquet(positions(RSIM)), TrackingMap.model_validate({"goals": goals}))
    assert "goal" not in match.referee["event"].cast(pl.String)
    (flaw,) = match.quality.filter(flaw="goals unknown").iter_rows(named=True)
    assert says in flaw["note"]
    assert "add columns score_home and score_away" in flaw["note"]


def test_no_ball() -> None:
    """Without a ball nothing is found, and the flaw says so."""
    match = read(parquet(positions(RSIM).filter(pl.col("team") != "ball", pl.col("frame") < 200)))
    (flaw,) = match.quality.filter(flaw="goals unknown").iter_rows(named=True)
    assert "the ball was never seen" in flaw["note"]
    assert flaw["count"] == 200


def test_score_of_nobody() -> None:
    """A score that nobody knows stays unknown, whatever the states say; the ball tells who scored before a kick-off."""
    table = pl.read_parquet(io.BytesIO(recording(SSL)))
    table = table.with_columns(pl.lit(None, dtype=pl.Int64).alias(score) for score in ("score_home", "score_away"))
    match = read(parquet(table), TrackingMap.model_validate({"teams": {"home": "TIGERs", "away": "RoboCIn"}}))
    assert match.referee.select("score_home", "score_away").null_count().row(0) == (len(match.referee),) * 2
    assert [row[2] for row in events(match) if row[1] == "goal"] == ["home"]
    assert match.info.settings["goals"] == {"from": "kick-off"}


@pytest.mark.parametrize(("states", "score"), [
    ((("kickoff_a",), ("play",), ("goal_a",), ("kickoff_b",)), (1, 0)),
    ((("stop",), ("kickoff_a",), ("play",), ("goal_a",), ("kickoff_b",)), (1, 0)),
    ((("play",), ("goal_a",), ("kickoff_b",)), (None, None)),  # the match began before the recording
])
def test_score_of_states(states: tuple[tuple[str], ...], score: tuple[int | None, int | None]) -> None:
    """States count goals from the first kick-off of a match; a recording that begins later has no score."""
    assert events(read(course(*states, columns="game_state")))[-1][3:] == score
