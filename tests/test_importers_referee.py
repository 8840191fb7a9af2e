"""Referee events of tracking tables, from states of the game, scores and segments."""

import polars as pl
import pytest
from support.tracking import course, events, flaws, read

from pitchlore.pipeline.importers.tracking.mapping import load_map


def test_events_of_states() -> None:
    """A state is an event on its first frame; a goal of the same frame comes first."""
    match = read(course(
        ("kickoff_a", 0, 0), ("play", 0, 0), ("kickoff_b+goal_a", 1, 0), ("play", 1, 0), ("freeball", 1, 0),
        ("freeball", 1, 0), (None, 1, 0), ("stop", 1, 0), ("play", 1, 0), ("penalty_b", 1, 0),
        ("half+kickoff_b", 1, 0), ("time_over", 1, 0),
    ))
    assert events(match) == [
        (0, "kick-off", "home", 0, 0),
        (2, "goal", "home", 1, 0), (2, "kick-off", "away", 1, 0),
        (4, "fault", None, 1, 0),
        (7, "stop", None, 1, 0),
        (8, "play", None, 1, 0),
        (9, "fault", "away", 1, 0),
        (10, "half", None, 1, 0), (10, "kick-off", "away", 1, 0),
        (11, "end", None, 1, 0),
    ]


STATES, SCORED = "game_state", "game_state,score_home,score_away"


@pytest.mark.parametrize(("columns", "states", "wanted"), [
    # a goal in the states that does not count is a stop; one that is taken back becomes one
    (SCORED, [("play", 0, 0), ("goal_a", 0, 0), ("play", 2, 0), ("stop", 1, 0), ("kickoff_b", 1, 0)], [
        (0, "play", None, 0, 0), (1, "stop", None, 0, 0), (2, "goal", "home", 1, 0), (2, "stop", None, 2, 0),
        (2, "play", None, 2, 0), (3, "stop", None, 1, 0), (4, "kick-off", "away", 1, 0)]),
    (SCORED, [("play", 0, 0), ("goal", 0, 0), ("kickoff_a", 0, 0), ("goal", 1, 0), ("kickoff_b", 1, 0)], [
        (0, "play", None, 0, 0), (1, "stop", None, 0, 0), (2, "kick-off", "home", 0, 0), (3, "goal", "home", 1, 0),
        (4, "kick-off", "away", 1, 0)]),
    # without scores, goals are those of the states
    (STATES, [("kickoff_a",), ("goal_b+kickoff_a",), ("goal_a",), ("kickoff_b",)], [
        (0, "kick-off", "home", 0, 0), (1, "goal", "away", 0, 1), (1, "kick-off", "home", 0, 1),
        (2, "goal", "home", 1, 1), (3, "kick-off", "away", 1, 1)]),
    # a kick-off without a half-time before it follows a goal, even if the scoring team is unknown
    (STATES, [("kickoff",), ("play",), ("kickoff",), ("play",)], [
        (0, "kick-off", None, 0, 0), (2, "goal", None, None, None), (2, "kick-off", None, None, None)]),
    (STATES, [("kickoff_a",), ("play",), ("kickoff_b",), ("half",), ("kickoff_b",), ("play",), ("kickoff_a",)], [
        (0, "kick-off", "home", 0, 0), (2, "goal", "home", 1, 0), (2, "kick-off", "away", 1, 0), (3, "half", None, 1, 0),
        (4, "kick-off", "away", 1, 0), (6, "goal", "away", 1, 1), (6, "kick-off", "home", 1, 1)]),
    # a score that nobody tells stays unknown
    (STATES, [("play",), ("freeball",)], [(0, "play", None, None, None), (1, "fault", None, None, None)]),
])
def test_goals_and_scores(columns: str, states: list[tuple[object, ...]], wanted: list[tuple[object, ...]]) -> None:
    """Goals are those of the score, else of the states; what nobody tells is unknown."""
    assert events(read(course(*states, columns=columns))) == wanted


@pytest.mark.parametrize(
    ("after", "team"),
    [
        ((("play",), ("kickoff_a",)), "away"),  # the next kick-off is the conceding team's
        ((("kickoff_b",), ("play",)), "home"),
        ((("goal+kickoff_b",),), "home"),  # on the goal's own frame
    ],
)
def test_goal_by_kick_off(
    after: tuple[tuple[object, ...], ...], team: str
) -> None:
    """If a state names no scoring team, the team that does not kick off next has scored."""
    goal = () if "goal" in str(after) else (("goal",),)
    match = read(course(("kickoff",), ("play",), *goal, *after, columns="game_state"))
    score = (1, 0) if team == "home" else (0, 1)
    assert events(match)[1] == (2, "goal", team, *score)
    assert events(match)[-1][3:] == score


@pytest.mark.parametrize(
    "after",
    [
        (), ("play",), ("goal+kickoff", "play"), ("kickoff", "kickoff_a"), ("half", "kickoff_a"),
        ("half+kickoff_a",), ("end", "kickoff_a"), ("goal_b", "kickoff_a"),
    ],
)
def test_unknown_team(after: tuple[str, ...]) -> None:
    """If no source names the scoring team, the goal's team is null, and so is the score from then on."""
    first = () if after[:1] == ("goal+kickoff",) else ("goal",)
    states = ("kickoff", "play", *first, *after)
    found = events(read(course(*((state,) for state in states), columns="game_state")))
    assert found[:2] == [(0, "kick-off", None, 0, 0), (2, "goal", None, None, None)]
    # a later goal that is known to be home's does not make the score known again
    assert {row[3:] for row in found[1:]} == {(None, None)}
    if "goal_b" in after:
        assert (3, "goal", "away", None, None) in found


def test_ball_at_centre() -> None:
    """If no state ever stops play, the ball at the centre restarts it after a goal."""
    csv = course(*[(0, 0)] * 2, *[(1, 0)] * 4, columns="score_home,score_away")
    amber = load_map("[teams]\nhome = 'amber'\n")
    match = read(csv.replace("4,4,ball,,0.3,0", "4,4,ball,,0.01,0.02"), amber)
    assert events(match) == [(0, "play", None, 0, 0), (2, "goal", "home", 1, 0), (4, "kick-off", "away", 1, 0)]
    never = read(csv, amber)
    assert events(never)[1:] == [(2, "goal", "home", 1, 0), (3, "kick-off", "away", 1, 0)]


def test_unknown_state() -> None:
    """A state that is not known stops play and is a flaw; a map can give its meaning."""
    csv = course(("play",), ("snack_break",), ("play",), ("snack_break",), columns="game_state")
    match = read(csv)
    assert [row[1] for row in events(match)] == ["play", "stop", "play", "stop"]
    assert flaws(match) == [("skipped", 2, None, None)]
    named = read(csv, load_map("[states]\nsnack_break = 'kick-off away'\n"))
    assert events(named)[1][:3] == (1, "kick-off", "away")
    assert flaws(named) == []


def test_segment_in_play() -> None:
    """A segment that changes in play without a gap is a fault."""
    def rows(*segments: tuple[float, str, str]) -> str:
        return "frame,t,team,player,x,y,segment,game_state\n" + "".join(
            f"{i},{t},{team},1,{x},0,{segment},{state}\n"
            for i, (t, segment, state) in enumerate(segments) for team, x in (("a", 0.7), ("b", -0.7))
        )

    match = read(rows((0, "0", "play"), (0.3, "1", "play"), (2.0, "2", "play"), (2.2, "2", "stop"),
                      (2.4, "3", "stop")))
    assert match.referee.select(pl.col("t_ns") // 10**8, pl.col("event").cast(pl.String), "note").rows() == [
        (0, "play", "play"), (3, "fault", "segment"), (22, "stop", "stop")
    ]
