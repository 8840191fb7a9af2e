"""Messages of the game controller, as events, names, sides and score."""

import polars as pl
import pytest
from support import ssl_messages as ssl
from support.ssl_games import FRAMES, STEP, Referee, command, frames, match, ordered, play, reported, stage
from support.ssl_messages import Team

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.settings import ImportSettings


def test_commands() -> None:
    """Each command is an event; what is prepared begins with NORMAL_START, of the team for which it was prepared."""
    game = play(
        (0, {"command": command("HALT")}),
        (2, {"command": command("STOP")}),
        (4, {"command": command("PREPARE_KICKOFF_YELLOW")}),
        (6, {"command": command("NORMAL_START"), "stage": stage("NORMAL_FIRST_HALF")}),
        (20, {"command": command("STOP")}),
        (22, {"command": command("BALL_PLACEMENT_BLUE")}),
        (24, {"command": command("DIRECT_FREE_BLUE")}),
        (40, {"command": command("HALT")}),
        (42, {"command": command("FORCE_START")}),
        (50, {"command": command("INDIRECT_FREE_YELLOW")}),
        (60, {"command": command("TIMEOUT_YELLOW")}),
        (70, {"command": command("PREPARE_PENALTY_BLUE")}),
        (72, {"command": command("NORMAL_START")}),
        (80, {"command": command("PREPARE_PENALTY_BLUE")}),
        (82, {"command": command("STOP")}),
        (84, {"command": command("NORMAL_START")}),
    )
    assert [(frame, event, team) for frame, event, team, *_ in reported(game)] == [
        (0, "stop", None), (2, "stop", None), (6, "kick-off", "away"), (20, "stop", None), (22, "stop", None),
        (24, "fault", "home"), (40, "stop", None), (42, "play", None), (50, "fault", "away"), (60, "stop", None),
        (72, "fault", "home"),
        (80, "stop", None),  # a penalty is prepared while play is on: it stops
        (82, "stop", None), (84, "play", None),  # and was called off
    ]
    assert game.referee["note"].to_list()[2] == "PREPARE_KICKOFF_YELLOW"
    assert (game.info.home, game.info.away) == ("Blues", "Yellows")


@pytest.mark.parametrize(("said", "wanted"), [
    # the score rises when people have agreed; the goal is when play was stopped, and so is the score from then on
    ([(0, {"command": command("NORMAL_START"), "stage": stage("NORMAL_FIRST_HALF")}),
      (30, {"command": command("HALT")}),
      (40, {"command": command("STOP"), "blue": Team("Blues", 1)}),
      (44, {"command": command("PREPARE_KICKOFF_YELLOW")}),
      (50, {"command": command("NORMAL_START")}),
      (80, {"command": command("STOP"), "yellow": Team("Yellows", 1)})],
     [(0, "play", None, 0, 0), (30, "goal", "home", 1, 0), (40, "stop", None, 1, 0), (50, "kick-off", "away", 1, 0),
      (80, "goal", "away", 1, 1)]),
    # a goal that is taken back becomes a stop, and the score from it on is what it was before
    ([(0, {"command": command("NORMAL_START")}),
      (30, {"command": command("HALT"), "blue": Team("Blues", 1)}),
      (40, {"command": command("STOP"), "blue": Team("Blues", 0)}),
      (50, {"command": command("FORCE_START")})],
     [(0, "play", None, 0, 0), (30, "stop", None, 0, 0), (40, "stop", None, 0, 0), (50, "play", None, 0, 0)]),
    # the score with which a log begins is no goal; a rise by two is two goals
    ([(0, {"command": command("FORCE_START"), "blue": Team("Blues", 3)}),
      (40, {"command": command("STOP"), "blue": Team("Blues", 5)})],
     [(0, "play", None, 3, 0), (40, "goal", "home", 4, 0), (40, "goal", "home", 5, 0)]),
])
def test_goals(said: list[tuple[int, dict[str, object]]], wanted: list[tuple[object, ...]]) -> None:
    """Goals and scores are those on which people agree in the end."""
    game = play(*said)
    assert reported(game) == wanted
    assert ("goal taken back" in game.referee["note"]) == (wanted[1][1] == "stop")


def test_stages() -> None:
    """A later half is half-time, the end of the game is the end; HALT with either says nothing more."""
    game = play(
        (0, {"command": command("NORMAL_START"), "stage": stage("NORMAL_FIRST_HALF")}),
        (30, {"command": command("HALT"), "stage": stage("NORMAL_HALF_TIME")}),
        (40, {"stage": stage("NORMAL_SECOND_HALF_PRE"), "side": True}),
        (44, {"command": command("FORCE_START"), "stage": stage("NORMAL_SECOND_HALF")}),
        (60, {"command": command("HALT"), "stage": stage("EXTRA_TIME_BREAK")}),
        (90, {"command": command("HALT"), "stage": stage("POST_GAME")}),
    )
    assert [(frame, event) for frame, event, *_ in reported(game)] == [
        (0, "play"), (30, "half"), (44, "play"), (60, "half"), (90, "end")]


def test_sides() -> None:
    """Sides are the referee's: a period for each stretch in which blue's goal is at one end. What is not said is inferred."""
    game = play((0, {"side": True}), (40, {"side": False}), (60, {"side": False}))
    periods = [(round(p.start_ns / 1e9 / STEP), p.home_attacks, p.inferred) for p in game.info.periods]
    assert periods == [(0, -1, False), (40, 1, False)]
    assert game.info.periods[-1].end_ns == game.frames.t_ns.max() + 1
    assert "direction inferred" not in game.quality["flaw"]
    yellow = play((0, {"side": True}), mapping='[teams]\nhome = "yellow"')
    assert [p.home_attacks for p in yellow.info.periods] == [1]
    assert (yellow.info.home, yellow.info.away) == ("Yellows", "Blues")
    assert yellow.frames.robots["id"][yellow.frames.robots["team"] == 0].tolist() == [1] * FRAMES

    unsaid = play((0, {"side": None}))  # as of old game controllers: from where the robots stand
    assert [(p.home_attacks, p.inferred) for p in unsaid.info.periods] == [(-1, True)]  # blue stands at +x


def test_names() -> None:
    """Names are the last ones that were typed; without any, the colours; two equal ones get their colours."""
    assert play((0, {"blue": Team("")}), (50, {"blue": Team("Late Blues")})).info.home == "Late Blues"
    unnamed = play((0, {"blue": Team(""), "yellow": Team("")}))
    assert (unnamed.info.home, unnamed.info.away) == ("blue", "yellow")
    twins = play((0, {"blue": Team("A"), "yellow": Team("A")}))
    assert (twins.info.home, twins.info.away) == ("A (blue)", "A (yellow)")
    chosen = play((0, {}), mapping='[teams]\naway = "blues"')
    assert (chosen.info.home, chosen.info.away) == ("Yellows", "Blues")
    with pytest.raises(BadRecording, match=r"has no team 'Greens'; it has Yellows \(yellow\) and Blues \(blue\)"):
        play((0, {}), mapping='[teams]\nhome = "Greens"')


def test_cards() -> None:
    """A card is reported and changes nothing: play goes on, or stays stopped."""
    game = play(
        (0, {"command": command("FORCE_START")}),
        (20, {"yellow": Team("Yellows", yellow=1)}),
        (30, {"command": command("STOP")}),
        (40, {"blue": Team("Blues", red=1)}),
    )
    assert [(frame, event) for frame, event, *_ in reported(game)] == [(0, "play"), (20, "play"), (30, "stop"), (40, "stop")]
    assert game.referee["note"].to_list() == ["FORCE_START", "yellow card for yellow", "STOP", "red card for blue"]


def test_two_game_controllers() -> None:
    """The one with the most packets is heard."""
    other = Referee("spare")
    other.blue = Team("Spare", 9)
    gc = Referee()
    said = [gc.says(i, command=command("FORCE_START") if i == 0 else None) for i in range(10)]
    game = match(ordered(said, [other.says(i, command=0) for i in range(5)], frames(FRAMES)))
    assert game.info.home == "Blues"
    assert reported(game) == [(0, "play", None, 0, 0)]


def test_without_a_referee() -> None:
    """Play is on from the begin; names are colours, and the score is not known."""
    game = match(frames(FRAMES))
    assert [(frame, event) for frame, event, *_ in reported(game)] == [(0, "play")]
    assert game.referee.select(pl.col("score_home", "score_away").null_count()).row(0) == (1, 1)
    assert (game.info.home, game.info.away) == ("blue", "yellow")


def test_damaged_packets() -> None:
    """A packet that lacks what is required, or breaks off, is left out and counted."""
    gc = Referee()
    whole = gc.says(0, command=command("FORCE_START"))
    broken = whole._replace(content=whole.content[:-3])
    empty = whole._replace(content=ssl.integer(1, 5))
    game = match(ordered([whole, broken, empty], frames(FRAMES)))
    assert reported(game) == [(0, "play", None, 0, 0)]
    assert game.quality.filter(pl.col("flaw") == "damaged record").select("count", "note").rows() == [
        (2, "referee packets that cannot be decoded")]


def test_a_score_that_runs_away() -> None:
    """A score that changes by more goals than the limit is refused."""
    gc = Referee()
    said = [gc.says(i, blue=Team("Blues", 900 * (i % 2))) for i in range(4)]
    data = ssl.log(ordered(said, frames(FRAMES)))
    with pytest.raises(BadRecording, match="a score that changes by 1800 goals, more than the limit goals = 1000"):
        read(open_source(data, "x.log", ImportSettings()))
