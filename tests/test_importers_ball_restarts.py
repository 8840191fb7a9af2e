"""Restarts found from the ball: what counts, what does not, and what a match says of it."""

import io

import polars as pl
import pytest
from support.balls import put, way
from support.recordings import RSIM, SSL, imported, recording
from support.tracking import parquet, read

from pitchlore.pipeline.game.pitch import PITCHES, Kind, Pitch
from pitchlore.pipeline.importers.tracking.ball_restarts import Ball, ball_restarts
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.stages.events.restarts import kind_of

VSSS = PITCHES[Kind.VSSS]
#: A ball in play.
PLAYED = ((0.0, 0.0, 0.0), (3.0, -0.5, 0.3))
PENALTY, FREE_BALL, GOAL_KICK, NOWHERE = (0.375, 0.0), (-0.375, 0.4), (0.6, -0.35), (0.2, 0.3)


def found(ball: Ball, pitch: Pitch = VSSS) -> list[tuple[float, str | None, int, bool]]:
    """Time in tenths of seconds, kind and end of each restart, and whether the robots were put, too."""
    return [(round(it.t_ns / 1e8) / 10, it.kind, it.end, it.lined_up) for it in ball_restarts(ball, pitch)]


@pytest.mark.parametrize("line_ups", [(), (3.0,)])
@pytest.mark.parametrize(("place", "kind", "end"), [
    (PENALTY, "penalty", 1), (FREE_BALL, "free ball", -1), (GOAL_KICK, "goal kick", 1)])
def test_marks(place: tuple[float, float], kind: str, end: int, line_ups: tuple[float, ...]) -> None:
    """A ball that is put on a mark is the restart of that mark, at either end."""
    ball = way(*PLAYED, *put(3.0, *place), (6.0, 0.7, 0.6), line_ups=line_ups)
    assert found(ball) == [(3.0, kind, end, bool(line_ups))]
    assert found(ball._replace(x=-ball.x, y=-ball.y)) == [(3.0, kind, -end, bool(line_ups))]


def test_with_the_robots() -> None:
    """With the robots, a ball that is hit at once or lay there already is a restart, also where there is no mark."""
    assert found(way(*PLAYED, *put(3.0, *PENALTY, lies=0.15), (3.5, 0.74, 0.1), line_ups=(3.0,))) == [
        (3.0, "penalty", 1, True)]
    again = (*PLAYED, *put(3.0, *FREE_BALL, lies=12.0))
    assert found(way(*again, line_ups=(3.0, 8.5))) == [(3.0, "free ball", -1, True), (8.5, "free ball", -1, True)]
    assert found(way(*PLAYED, *put(3.0, *NOWHERE), line_ups=(3.0,))) == [(3.0, None, 1, True)]


def test_one_restart_in_steps() -> None:
    """A ball that is put first, and teams that are put one after the other, are one restart, at the last step."""
    ball = way(*PLAYED, *put(3.0, *FREE_BALL, lies=9.0), line_ups=(4.0, 5.5))
    assert found(ball) == [(5.5, "free ball", -1, True)]


@pytest.mark.parametrize(("points", "line_ups"), [
    ((*PLAYED, *put(3.0, *NOWHERE)), ()),  # no mark
    ((*PLAYED, *put(3.0, 0.0, 0.0)), (3.0,)),  # a kick-off
    ((*PLAYED, *put(3.0, *PENALTY, lies=0.3), (3.5, 0.7, 0.1)), ()),  # does not lie there
    ((*PLAYED, *put(3.0, *PENALTY, lies=1.0), *put(4.0, -0.5, 0.35)), ()),  # a tracker's glitch, and it comes back
    ((*PLAYED, *put(3.0, *FREE_BALL), *put(5.0, 0.5, 0.1, 1.0), *put(6.0, *FREE_BALL)), ()),  # it was there before
    ((*PLAYED, *put(3.0, 0.3, 0.3, lies=0.05), *put(3.05, -0.5, 0.35)), (3.0, 3.05)),  # the camera's, of all bodies
    ((*PLAYED, (6.0, *PENALTY), (9.0, *PENALTY), (10.0, 0.7, 0.1)), ()),  # carried by a hand
    ((*PLAYED, (4.0, *PENALTY), (9.0, *PENALTY)), ()),  # rolls there, and lies still
])
def test_no_restart(points: tuple[tuple[float, float, float], ...], line_ups: tuple[float, ...]) -> None:
    assert found(way(*points, line_ups=line_ups)) == []


def test_hidden_ball() -> None:
    """A ball that was hidden meanwhile may have rolled to the mark where it is seen again."""
    assert found(way(*PLAYED, *put(3.0, *PENALTY), lost=(2.4, 3.1))) == []


@pytest.mark.parametrize("kind", [Kind.SSL, Kind.SIM2D, Kind.HUMAN])
def test_other_leagues(kind: Kind) -> None:
    """Where the rules have no such marks only a ball that is put with the robots is a restart, of no kind."""
    pitch = PITCHES[kind]
    ball = way(*PLAYED, *put(3.0, *PENALTY), line_ups=(3.0,))
    ball = ball._replace(x=ball.x * pitch.length / VSSS.length, y=ball.y * pitch.width / VSSS.width)
    assert found(ball, pitch) == [(3.0, None, 1, True)]
    assert found(ball._replace(line_ups=ball.line_ups * 0), pitch) == []


@pytest.mark.parametrize("samples", [0, 1])
def test_too_few_samples(samples: int) -> None:
    assert found(Ball(*(column[:samples] for column in way(*PLAYED)))) == []


# --- a match without states -------------------------------------------------------------------------

def table(ball: Ball, *, put_at: float | None = None) -> pl.DataFrame:
    """A table of this ball with two robots a side, which jump at a time: foxes attack +x, owls -x."""
    rows = []
    for at, (t_ns, x, y) in enumerate(zip(ball.t_ns.tolist(), ball.x.tolist(), ball.y.tolist(), strict=True)):
        t = t_ns / 1e9
        rows.append((at, t, "ball", None, x, y))
        line = 0.3 if put_at is not None and t > put_at + 0.001 else 0.0
        # they tremble: a number that recurs exactly would be one for "not seen"
        rows += [(at, t, team, player, end * (0.3 + 0.4 * player) + at * 1e-6, line - 0.6 * player + at * 1e-6)
                 for team, end in (("foxes", -1), ("owls", 1)) for player in (0, 1)]
    return pl.DataFrame(rows, orient="row", schema=["frame", "t", "team", "player", "x", "y"])


def said(data: pl.DataFrame) -> list[tuple[int, str, str | None, str | None]]:
    """Tenths of seconds, event, team and note of each event of a match."""
    text = pl.col("event", "team").cast(pl.String)
    return read(parquet(data)).referee.select((pl.col("t_ns") / 1e8).round().cast(pl.Int64), text, "note").rows()


def test_penalty_that_is_scored() -> None:
    """A ball in the net, put on the penalty mark, and shot into the goal is one goal, and a penalty before it."""
    ball = way((0.0, 0.0, 0.0), (1.0, 0.5, 0.0), (2.5, 0.82, 0.1), *put(2.5, *PENALTY, lies=0.2), (4.0, 0.82, 0.0),
               *put(4.5, 0.0, 0.0))
    assert said(table(ball, put_at=2.5)) == [
        (0, "play", None, None),
        (25, "fault", "home", "penalty: found from the ball and the robots"),
        (38, "goal", "home", "over the line, then at the centre"),
        (45, "kick-off", "away", "the ball is back at the centre"),
    ]


@pytest.mark.parametrize(("place", "team", "note"), [
    ((-0.375, 0.0), "away", "penalty: found from the ball and the robots"),
    ((-0.6, 0.35), "home", "goal kick: found from the ball and the robots"),
    ((-0.375, 0.4), None, "free ball: found from the ball and the robots"),
    ((-0.2, 0.4), None, "ball put elsewhere: found from the ball and the robots"),
])
def test_team(place: tuple[float, float], team: str | None, note: str) -> None:
    """A penalty is of the team that attacks that goal, a goal kick of the other one, and all else of nobody known."""
    assert said(table(way(*PLAYED, *put(3.0, *place)), put_at=3.0))[1:] == [(30, "fault", team, note)]
    assert kind_of("fault", note) == ("other" if "elsewhere" in note else note.partition(":")[0])


def test_with_a_score() -> None:
    """Restarts are found beside a score, too, but none between a goal and its kick-off; where states tell, none is."""
    ball = way((0.0, 0.0, 0.0), (1.0, 0.82, 0.0), (2.0, 0.82, 0.0), *put(2.0, *PENALTY), *put(4.0, 0.0, 0.0), (7.0, 0.2, 0.2),
               *put(7.0, *FREE_BALL))
    scored = table(ball).with_columns(score_home=(pl.col("t") > 1).cast(pl.Int64), score_away=0)
    assert [row[:3] for row in said(scored)] == [
        (0, "play", None), (10, "goal", "home"), (40, "kick-off", "away"), (70, "fault", None)]
    stopped = pl.when(pl.col("t") < 0.1).then(pl.lit("stop")).otherwise(pl.lit("play"))
    assert "fault" not in [row[1] for row in said(scored.with_columns(game_state=stopped))]
    match = read(parquet(scored), TrackingMap.model_validate({"goals": {"from_ball": False}}))
    assert "fault" not in match.referee["event"].cast(pl.String)


def test_recordings() -> None:
    """The free balls of a recording with positions only are found to the sample; in a match of real robots none is."""
    reported = imported(RSIM).referee.filter(pl.col("event") == "fault")["t_ns"]
    positions = {name: pl.read_parquet(io.BytesIO(recording(name))).select("frame", "t", "team", "player", "x", "y")
                 for name in (RSIM, SSL)}
    match = read(parquet(positions[RSIM]))
    faults = match.referee.filter(pl.col("event") == "fault")
    assert faults["t_ns"].to_list() == reported.to_list()
    assert set(faults["note"]) == {"free ball: found from the ball and the robots"}
    assert faults["score_home"].null_count() == len(faults)
    (flaw,) = match.quality.filter(pl.col("note").str.contains("restarts")).iter_rows(named=True)
    assert (flaw["flaw"], flaw["count"]) == ("assumed", 6)
    assert flaw["note"] == "nothing tells restarts, so they were found where the ball was put: free ball 6"
    assert "fault" not in read(parquet(positions[SSL])).referee["event"].cast(pl.String)
