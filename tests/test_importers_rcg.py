"""RoboCup 2D text logs: hand-written ones with known values, and damaged ones."""

from collections.abc import Sequence

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings.make import TAILS
from support.recordings import INSPER, RCSS, imported, taken_for

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.importers.rcg import reading as rcg
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.schemas import AWAY, HOME, Commands

PARAMS = "(server_param (goal_width 7.32)(half_time 1)(simulator_step 100))"


def show(cycle: int, ball: str = "0 0 0 0", version: int = 6, left: str = "-10 0 0 0 0 0") -> str:
    tail = " " + TAILS[version]
    return (
        f"(show {cycle} (({'b'}) {ball}) ((l 1) 0 0x9 {left}{tail}) ((l 2) 0 0 -12 -37 0 0 0 0{tail})"
        f" ((r 11) 3 0x1 20 5 0 0 180 90{tail}))"
    )


def log(*lines: str, version: int = 6) -> bytes:
    return "\n".join([f"ULG{version}", *lines, ""]).encode()


def read(data: bytes) -> MatchLog:
    return rcg.read(taken_for(data, "game.rcg", "rcg"), TrackingMap())


def events(match: MatchLog) -> list[tuple[object, ...]]:
    tenths = pl.col("t_ns") // 100_000_000
    text = pl.col("event", "team").cast(pl.String)
    return match.referee.select(tenths, text, "score_home", "score_away", "note").rows()


@pytest.mark.parametrize("version", [4, 5, 6])
def test_axes_and_cycles(version: int) -> None:
    """The server's axes, speeds and cycles become ours."""
    line = show(7, "1.5 -20 0.25 -0.5", version, left="-10.5 4 0.1 0.2 30 -45")
    match = read(log(line, version=version))
    assert match.frames.ball.tolist() == [(1.5, 20.0, 2.5, 5.0)]
    left, right = match.frames.robots
    assert left["team"] == HOME
    assert right["team"] == AWAY
    assert (left["id"], right["id"]) == (1, 11)
    assert (left["x"], left["y"]) == (-10.5, -4.0)
    assert left["vx"] == pytest.approx(1.0)
    assert left["vy"] == pytest.approx(-2.0)
    assert left["theta"] == pytest.approx(-np.pi / 6)  # the body's: the neck does not matter
    assert right["theta"] == pytest.approx(np.pi)
    assert np.isnan(left["omega"])
    assert match.frames.number.tolist() == [7]
    assert match.info.settings == {"version": version, "step_ms": 100}


#: A log that begins after goals.
MIDDLE = (PARAMS, show(300), "(playmode 301 kick_off_l)", show(301), "(playmode 350 goal_r)")


def test_cycles() -> None:
    """Time goes on while the cycle number repeats, and over missing lines; numbers that leap do not make it run away."""
    match = read(log(show(5), show(6), show(6), show(6), show(9), show(10)))
    assert match.frames.number.tolist() == [5, 6, 6, 6, 9, 10]
    assert (match.frames.t_ns // 100_000_000).tolist() == [0, 1, 2, 3, 6, 7]
    stopped = read(log(show(6), show(6), "(show 6 ((b) 0 0", show(6)))
    assert (stopped.frames.t_ns // 100_000_000).tolist() == [0, 1, 3]
    wild = read(log(*(show(cycle) for cycle in (0, 999_999_999, 3, 999_999_999))))
    assert (wild.frames.t_ns // 100_000_000).tolist() == [0, 1, 2, 3]


def test_course() -> None:
    """The play modes of a log become the course of a match."""
    match = read(log(
        PARAMS,
        "(playmode 0 before_kick_off)", "(team 0 Left null 0 0)", show(0),
        "(playmode 1 kick_off_l)", "(team 1 Left Right 0 0)", show(1),
        "(playmode 2 play_on)", show(2),
        "(playmode 3 offside_l)", show(3),
        "(playmode 4 free_kick_r)", show(4),
        "(playmode 5 play_on)", show(5),
        "(playmode 6 goal_r)", "(team 6 Left Right 0 1)", show(6),
        "(playmode 7 kick_off_l)", show(7),
        "(playmode 8 drop_ball)", show(8),
        "(playmode 10 before_kick_off)", show(10),
        "(playmode 11 kick_off_r)", show(11),
        "(playmode 12 goal_kick_l)", show(12),
        "(playmode 13 penalty_setup_l)", show(13),
        "(playmode 20 time_over)", show(14), "(msg 20 1 \"(result 0-1)\")", "(team 20 Left Right 0 1)",
    ))
    assert events(match) == [
        (0, "stop", None, 0, 0, "before_kick_off"),
        (1, "kick-off", "home", 0, 0, "kick_off_l"),
        (2, "play", None, 0, 0, "play_on"),
        (3, "stop", None, 0, 0, "offside_l"),  # the offender's; the restart follows
        (4, "fault", "away", 0, 0, "free_kick_r"),
        (5, "play", None, 0, 0, "play_on"),
        (6, "goal", "away", 0, 1, "goal_r"),
        (7, "kick-off", "home", 0, 1, "kick_off_l"),
        (8, "fault", None, 0, 1, "drop_ball"),
        (10, "half", None, 0, 1, "before_kick_off"),  # half_time 1 s: ten cycles
        (11, "kick-off", "away", 0, 1, "kick_off_r"),
        (12, "fault", "home", 0, 1, "goal_kick_l"),
        (13, "stop", None, 0, 1, "penalty_setup_l"),  # a shoot-out is no play
        (14, "end", None, 0, 1, "time_over"),
    ]
    info = match.info
    assert (info.home, info.away) == ("Left", "Right")
    assert info.complete
    assert info.pitch.kind is Kind.SIM2D
    assert info.pitch.goal_width == 7.32
    # the server never changes sides, not even at half-time
    assert [(p.start_ns, p.end_ns, p.home_attacks, p.inferred) for p in info.periods] == [
        (0, 1_400_000_001, 1, False)
    ]
    assert match.quality.is_empty()


@pytest.mark.parametrize(("lines", "wanted"), [
    # without a pause, the kick-off after the last cycle of the half is half-time
    ((PARAMS, show(9), "(playmode 11 kick_off_r)", show(11)), [("half", None, None), ("kick-off", None, None)]),
    # a log that begins in the second half has no half-time event and keeps its score
    ((PARAMS, "(team 15 A B 2 1)", show(15), "(playmode 16 goal_l)", "(team 16 A B 3 1)", show(16),
      "(playmode 17 kick_off_r)", show(17)),
     [("goal", 3, 1), ("kick-off", 3, 1)]),
    # one that begins after a goal has the score that its first team line tells, less its own goals; else none
    ((*MIDDLE, "(team 350 A B 0 3)", show(350), "(playmode 351 kick_off_l)", show(351)),
     [("kick-off", 0, 2), ("goal", 0, 3), ("half", 0, 3), ("kick-off", 0, 3)]),
    ((*MIDDLE, show(350)), [("kick-off", None, None), ("goal", None, None)]),
    (("(playmode 0 kick_off_l)", show(0), "(playmode 1 goal_l)", show(1)), [("kick-off", 0, 0), ("goal", 1, 0)]),
    # a goal counts once, also if only the score tells of it
    (("(team 0 A B 0 0)", show(1), "(team 2 A B 1 0)", show(2)), [("goal", 1, 0)]),
    (("(team 0 A B 0 0)", show(1), "(team 2 A B 1 0)", "(playmode 2 goal_l)", show(2)), [("goal", 1, 0)]),
])
def test_halves_and_scores(lines: tuple[str, ...], wanted: list[tuple[object, ...]]) -> None:
    """Half-time, goals and the score are found wherever a log begins."""
    assert [(row[1], row[3], row[4]) for row in events(read(log(*lines)))] == wanted


def test_cut_log() -> None:
    """A cut log is kept and marked."""
    whole = log("(playmode 0 kick_off_l)", show(1), show(2), show(3))
    match = read(whole)
    assert not match.info.complete
    assert match.info.incomplete_reason == "the log ends before time over"

    cut = read(whole[:-40])
    assert len(cut.frames) == 2
    assert cut.info.incomplete_reason == "the log is cut off"
    flaw = cut.quality.row(0, named=True)
    assert (flaw["flaw"], flaw["count"], flaw["start_ns"]) == ("truncated", 1, 100_000_000)
    assert "last line was left out" in flaw["note"]

    filled = read(whole + bytes(1000))  # a recorder that was killed before it cut its file to size
    assert len(filled.frames) == 3
    assert filled.info.incomplete_reason == "the log is cut off"


@pytest.mark.parametrize(
    "broken",
    [
        show(2)[:-30],  # two lines run into each other
        show(2).replace("20 5 0 0 180", "20 five 0 0 180"),
        show(2).replace("((b) 0 0", "((b) nan 0"),
        "(show two ((b) 0 0 0 0))",
        "(playmode 2 )",
        "garbage",
        "(server_param (goal_width",
    ],
)
def test_malformed_line(broken: str) -> None:
    """A malformed line is skipped and counted, and its time is not lost."""
    match = read(log(show(1), broken, show(3), broken, show(5), "(playmode 6 time_over)"))
    assert match.frames.number.tolist() == [1, 3, 5]
    assert (match.frames.t_ns // 100_000_000).tolist() == [0, 2, 4]  # its time is not lost
    assert match.quality.select(pl.col("flaw").cast(pl.String), "count").rows() == [("skipped", 2)]
    assert match.info.complete


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "does not begin with ULG4"),
        (b"ULG\x03" + bytes(200), "binary log of version 1 to 3. Convert it to version 4"),
        (b"ULG6\n", "no whole show line"),
        (log(PARAMS, "(playmode 1 kick_off_l)"), "no whole show line"),
        (b"<xml/>", "does not begin with ULG4"),
    ],
)
def test_no_text_log(data: bytes, says: str) -> None:
    """A file that is no text log is refused with the reason."""
    with pytest.raises(BadRecording, match=says):
        read(data)


@pytest.mark.parametrize("state", ["09", "9" * 30, "0x" + "9" * 20])
def test_damaged_state(state: str) -> None:
    """A player's state with a leading zero is decimal; one that no server writes makes a damaged line."""
    match = read(log(show(0), show(1).replace("0x9", state)))
    assert len(match.frames) == (2 if state == "09" else 1)


# --- commands ----------------------------------------------------------------------------------

#: What the group of counters has, in its order: monitor protocols 3, 4 and 5; the last one from version 6 on.
COUNTED = ["kick", "dash", "turn", "catch", "move", "turn_neck", "change_view", "say", "tackle", "pointto", "attentionto", "change_focus"]


def player(counters: str | None, *, number: str = "l 1", state: str = "0x1", version: int = 6) -> str:
    """A player's group with this group of counters, or with none."""
    tail = " " + TAILS[version].rpartition(" (c ")[0] + ("" if counters is None else f" (c {counters})")
    return f"(({number}) 0 {state} -10 0 0 0 0 0{tail})"


def counted(cycle: int, *players: str) -> str:
    return f"(show {cycle} ((b) 0 0 0 0) {' '.join(players)})"


def group(version: int = 6, **counts: int) -> str:
    """The counters of a version; those that are not named are zero."""
    return " ".join(str(counts.get(name, 0)) for name in (COUNTED if version > 5 else COUNTED[:-1]))


def commands(match: MatchLog) -> list[tuple[object, ...]]:
    assert not len(Commands.filter(match.commands)[1])
    tenths = pl.col("t_ns") // 100_000_000
    text = pl.col("team", "command").cast(pl.String)
    return match.commands.with_columns(text).select("team", "robot", tenths, "command", "count").rows()


@pytest.mark.parametrize("version", [4, 5, 6])
def test_commands(version: int) -> None:
    """A counter that rises is a row at the line that first counts it; the first line's counts are none."""
    one, two = group(version, kick=3, turn=7), group(version, kick=4, turn=9, catch=1, tackle=2, dash=1)
    also = group(version, **dict.fromkeys(COUNTED, 1) | {"kick": 4, "turn": 9, "tackle": 2})
    lines = [
        counted(cycle, player(left, version=version), player(right, number="r 11", version=version))
        for cycle, (left, right) in enumerate([(one, one), (one, two), (two, two), (also, two)])
    ]
    match = read(log(*lines, version=version))
    assert commands(match) == [
        ("home", 1, 2, "kick", 1), ("home", 1, 2, "dash", 1), ("home", 1, 2, "turn", 2),
        ("home", 1, 2, "catch", 1), ("home", 1, 2, "tackle", 2),
        ("away", 11, 1, "kick", 1), ("away", 11, 1, "dash", 1), ("away", 11, 1, "turn", 2),
        ("away", 11, 1, "catch", 1), ("away", 11, 1, "tackle", 2),
    ]
    assert set(match.commands["match_id"]) == {"game-0"}
    assert match.quality.is_empty()


def of_one(*counters: str | None, states: Sequence[str] = ()) -> MatchLog:
    """A log of one player, line by line."""
    on = [*states, *["0x1"] * (len(counters) - len(states))]
    return read(log(*(counted(i, player(text, state=on[i])) for i, text in enumerate(counters))))


def test_counters_that_fall() -> None:
    """Where a counter falls the server counts anew: no row there, whatever else rises, and rows again after it."""
    found = of_one(
        group(kick=5, dash=5), group(kick=6, dash=6), group(kick=7, dash=2), group(kick=8, dash=2),
        group(kick=9, move=1), group(kick=10),  # a counter that has no rows tells of it, too
    )
    assert commands(found) == [("home", 1, 1, "kick", 1), ("home", 1, 1, "dash", 1), ("home", 1, 3, "kick", 1)]


def test_commands_over_gaps() -> None:
    """Lines in which a player or its counters are missing are passed over, and the time of a line that is lost."""
    one, two = player(group(kick=1)), player(group(kick=3))
    other = player(group(), number="l 2")
    absent = read(log(counted(0, one, other), counted(1, other), counted(2, two, other)))
    assert commands(absent) == [("home", 1, 2, "kick", 2)]
    lost = read(log(counted(0, one), counted(1, two)[:-9], counted(5, two)))
    assert commands(lost) == [("home", 1, 5, "kick", 2)]


def test_commands_while_play_is_stopped() -> None:
    """Lines of one cycle are samples of their own."""
    found = read(log(*(counted(6, player(group(turn=turns))) for turns in (1, 2, 2, 5))))
    assert commands(found) == [("home", 1, 1, "turn", 1), ("home", 1, 3, "turn", 3)]


def test_commands_off_the_pitch() -> None:
    """A player who is not connected or was sent off is not in the match; what is counted then is not counted later."""
    counters = [group(dash=dashes) for dashes in (0, 1, 3, 4, 5)]
    found = of_one(*counters, states=["0", "0x1", "0x80000", "0x9"])
    assert commands(found) == [("home", 1, 1, "dash", 1), ("home", 1, 3, "dash", 1), ("home", 1, 4, "dash", 1)]
    assert found.frames.counts().tolist() == [0, 1, 0, 1, 1]


@pytest.mark.parametrize("counters", [None, "1", "0 1 2 3", "1 2 3 4 5 6 7 8"])
def test_fewer_counters(counters: str | None) -> None:
    """A log without counters, or with fewer, has no commands and no flaw for it."""
    later = counters and counters.replace("1", "2")
    match = of_one(counters, later)
    assert len(match.frames) == 2
    assert commands(match) == []
    assert match.quality.is_empty()


@pytest.mark.parametrize("broken", [
    group(kick=10**9), group(kick=-1), group().replace("0", "x", 1), group(kick=10**40), "", "0  0 0", "1.5 2 3",
])
def test_broken_counters(broken: str) -> None:
    """Counters that are no numbers are flagged, and the sample that they are in is kept."""
    match = of_one(group(kick=1), broken, group(kick=2), broken, group(kick=2))
    assert len(match.frames) == 5
    assert commands(match) == [("home", 1, 2, "kick", 1)]
    flaw = match.quality.row(0, named=True)
    assert (match.quality.height, flaw["flaw"], flaw["count"]) == (1, "skipped", 2)
    assert "counters" in flaw["note"]


def test_no_players() -> None:
    """Lines without players are samples of the ball alone."""
    match = read(log(counted(0), counted(1)))
    assert match.frames.counts().tolist() == [0, 0]
    assert commands(match) == []
    late = read(log(counted(0), counted(1, player(group(kick=1))), counted(2), counted(3, player(group(kick=2)))))
    assert commands(late) == [("home", 1, 3, "kick", 1)]


def test_stray_counters() -> None:
    """Counters belong to the player in whose group they stand."""
    double = player(f"{group(kick=7)}) (c {group(kick=2)}")
    line = counted(1, double, player(None, number="l 2"), player(group(dash=1), number="l 3"))
    stray = line.replace(" ((l 1)", f" (c {group(kick=9)}) ((l 1)")
    start = counted(0, *(player(group(kick=1), number=f"l {number}") for number in (1, 2, 3)))
    for each in (line, stray):
        assert commands(read(log(start, each))) == [("home", 1, 1, "kick", 1)]  # of 3 the kicks fall


counts = st.integers(0, 999_999_999)


@given(st.lists(st.tuples(*[counts] * 5), min_size=1, max_size=12), st.data())
def test_sum_of_commands(values: list[tuple[int, ...]], data: st.DataObject) -> None:
    """The counts of a player's command add up to what its counter rose by, where none falls.

    Other players, and lines without this player or its counters, change nothing.
    """
    names = ["kick", "dash", "turn", "catch", "tackle"]
    rising = list(zip(*map(sorted, zip(*values, strict=True)), strict=True))
    groups = [group(**dict(zip(names, row, strict=True))) for row in rising]
    ways = st.sampled_from(["counted", "there", "absent"])
    seen = data.draw(st.lists(ways, min_size=len(groups), max_size=len(groups)))
    others = [player(group(kick=i % 3, dash=i), number="r 1") for i in range(len(groups))]
    match = read(log(*(
        counted(i, *([] if way == "absent" else [player(text if way == "counted" else None)]), other)
        for i, (text, way, other) in enumerate(zip(groups, seen, others, strict=True))
    )))
    assert match.quality.is_empty()
    kept = [row for row, way in zip(rising, seen, strict=True) if way == "counted"]
    totals = dict(match.commands.filter(team="home").group_by(pl.col("command").cast(pl.String)).agg(
        pl.col("count").cast(pl.Int64).sum()).iter_rows())
    wanted = {name: kept[-1][i] - kept[0][i] for i, name in enumerate(names)} if kept else {}
    assert totals == {name: total for name, total in wanted.items() if total}
    assert match.commands.equals(match.commands.sort("team", "robot", "t_ns", "command"))


@pytest.mark.parametrize(("name", "version", "count", "kicks", "alone"), [(RCSS, 6, 2149, 50, 13), (INSPER, 5, 332, 48, 16)])
def test_real_logs(name: str, version: int, count: int, kicks: int, alone: int) -> None:
    """Real logs are read whole. The sample that first counts a kick has the ball's new velocity, and the next one has not.

    Of kicks in play with no other within one line. A cycle multiplies a free ball's velocity by 0.94.
    """
    match = imported(name)
    assert (len(match.frames), match.info.settings["version"], match.info.complete) == (count, version, name == RCSS)
    assert "skipped" not in match.quality["flaw"]
    kick = match.commands.filter(pl.col("command") == "kick")
    assert kick["count"].sum() == kicks
    t_ns, ball = match.frames.t_ns, match.frames.ball
    velocity = np.stack([ball["vx"], ball["vy"]], axis=1) / 10  # m a cycle
    change = np.concatenate([[0], np.linalg.norm(velocity[1:] - 0.94 * velocity[:-1], axis=1)])
    kicked = np.isin(t_ns, kick["t_ns"].to_numpy())
    play = match.referee.select("t_ns", is_play=pl.col("event") == "play").unique("t_ns", keep="last").sort("t_ns")
    last = np.searchsorted(play["t_ns"].to_numpy(), t_ns, side="right") - 1
    playing = play["is_play"].to_numpy()[last] & (last >= 0)
    at = np.arange(1, len(t_ns) - 1)
    at = at[kicked[at] & ~kicked[at - 1] & ~kicked[at + 1] & playing[at - 1] & playing[at] & playing[at + 1]]
    assert len(at) == alone
    assert (change[at] > 0.2).mean() > 0.9
    assert (change[at + 1] > 0.2).sum() == 0
