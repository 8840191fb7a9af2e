"""RoboCup 2D text logs: hand-written ones with known values, and damaged ones."""

import gzip
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings.make import TAILS
from support.recordings import INSPER, RCSS, imported, same_frames, taken_for
from support.recordings import read as opened

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.matches import made as noun
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.importers.rcg import reading as rcg
from pitchlore.pipeline.importers.readers import open_source
from pitchlore.pipeline.importers.readers import read as read_source
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.store import Store
from pitchlore.schemas import AWAY, HOME, Commands, Stamina

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


@pytest.mark.slow
def test_long_log() -> None:
    """A log of 100,000 cycles is one match, each cycle a sample."""
    match = read(log(PARAMS, *map(show, range(1, 100_001))))
    assert len(match.frames) == 100_000
    assert match.frames.t_ns[-1] - match.frames.t_ns[0] == 99_999 * 100_000_000
    assert match.info.incomplete_reason == "the log ends before time over"


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
    assert (match.info.settings["version"], match.info.settings["step_ms"]) == (version, 100)


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


@pytest.mark.parametrize("version", [4, 5, 6])
def test_stamina(version: int) -> None:
    """Stamina is that of the first line of each ten seconds, of players on the pitch; version 4 has no capacity."""
    def spent(cycle: int, number: str, state: str = "0x1") -> str:
        whole = player(group(version), number=number, state=state, version=version)
        return re.sub(r"\(s \d+ 1 1", f"(s {8000 - 10 * cycle}.5 0.75 0.9", whole)

    lines = [counted(cycle, spent(cycle, "r 2"), spent(cycle, "l 1"), spent(cycle, "r 3", "0"))
             for cycle in [*range(1, 50), *range(120, 231)]]
    found = next(table for table, schema in noun(read(log(PARAMS, *lines, version=version))).tables if schema is Stamina)
    assert not len(Stamina.filter(found)[1])
    capacity = None if version == 4 else 130600.0
    assert found.drop("match_id").rows() == [
        (at * 10**9, team, robot, stamina, 0.75, pytest.approx(0.9), capacity)
        for at, stamina in ((0, 7990.5), (11.9, 6800.5), (21.9, 5800.5)) for team, robot in (("home", 1), ("away", 2))]


def test_stamina_of_a_real_log() -> None:
    """The least stamina of a real log lies below what is full, and nobody gains more than the server gives in ten seconds."""
    found = next(table for table, schema in noun(imported(RCSS)).tables if schema is Stamina)
    assert found.height == 132 == 6 * found["t_ns"].n_unique()
    assert 0 < found["stamina"].min() < 8000 == found["stamina"].max()
    assert (found["stamina"].diff(6).drop_nulls() <= 100 * 60).all()
    assert found.filter(pl.col("capacity").diff(6) > 0)["t_ns"].n_unique() == 1, "it is filled up at half-time"


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


# --- JSON, names in quotes, several logs -------------------------------------------------------------

#: A match by its events: (cycle, playmode), score, and (cycle, ball, dashes) of a player each side.
STORY: list[tuple] = [
    ("team", 0, 0, 0), ("playmode", 0, "kick_off_l"), ("show", 1, 0.5, 3), ("playmode", 2, "play_on"), ("show", 2, -1.25, 4),
    ("playmode", 3, "goal_l"), ("team", 3, 1, 0), ("show", 3, 52.75, 6), ("playmode", 4, "time_over"), ("show", 4, 52.75, 6), ("team", 4, 1, 0),
]


def story_in_text(names: tuple[str, str] = ("Left", "Right")) -> bytes:
    """The story as version 6 writes it."""
    tail = TAILS[6].rpartition(" (c ")[0]
    said = {
        "team": lambda cycle, left, right: f"(team {cycle} {names[0]} {names[1]} {left} {right})",
        "playmode": lambda cycle, mode: f"(playmode {cycle} {mode})",
        "show": lambda cycle, x, dashes: (
            f"(show {cycle} ((b) {x} -20.5 0.25 0)"
            f" ((l 1) 0 0x9 -10.5 4 0.1 0.2 30 -45{tail} (c {group(dash=dashes, change_focus=1)}))"
            f" ((r 11) 3 0x1 20 5 0 1e-05 -179.5 90{tail} (c {group()})))"),
    }
    return log("(server_param (goal_width 14.02)(half_time 300)(simulator_step 100))", *(said[kind](*rest) for kind, *rest in STORY))


def story_in_json(version: int) -> bytes:
    """The story as a server of a version writes it in JSON (its ``SerializerMonitorJSON``)."""
    new = version >= 19
    def team(side: str, name: str, score: int) -> dict:
        return ({} if new else {"side": side}) | {"name": name, "score": score, "pen_score": 0, "pen_miss": 1}

    def player(side: str, number: int, kind: int, state: int, place: tuple, **counts: int) -> dict:
        counted = {name: counts.get(name, 0) for name in COUNTED[:11 if version < 18 else 12]}
        return {"side": side, "unum": number, "type": kind, "state": state, **dict(zip(("x", "y", "vx", "vy", "body", "neck"), place, strict=True)),
                "px": 3.5, "py": -20.1, "vq": "h", "vw": 90, "stamina": 8000, "effort": 1, "recovery": 1, "capacity": 130600,
                "fside": "r", "fnum": 7, **(counted if new else {"count": counted})}

    said = {
        "team": lambda cycle, left, right: {"time": cycle, **(
            {"l": team("l", "Left", left), "r": team("r", "Right", right)} if new else
            {"teams": [team("l", "Left", left), team("r", "Right", right)]})},
        "playmode": lambda cycle, mode: {"time": cycle, "stime": 2, "mode": mode},
        "show": lambda cycle, x, dashes: {"time": cycle, "ball": {"x": x, "y": -20.5, "vx": 0.25, "vy": 0}, "players": [
            player("l", 1, 0, 9, (-10.5, 4, 0.1, 0.2, 30, -45), dash=dashes, change_focus=1),
            player("r", 11, 3, 1, (20, 5, 0, 1e-05, -179.5, 90))]},
    }
    params = {"goal_width": 14.02, "half_time": 300, "simulator_step": 100, "team_l_start": "./start.sh", "synch_mode": False}
    objects = [(kind, said[kind](*rest)) for kind, *rest in STORY]
    objects = [("server_param", params), ("player_type", {"id": 0, "player_speed_max": 1.05}), *objects[:3],
               ("msg", {"time": 1, "board": 1, "message": 'a "quoted"\tbackslash \\ text'}),
               ("team_graphic", {"side": "l", "x": 0, "y": 0, "xpm": ["8 8 2 1"]}), *objects[3:]]
    if new:
        lines = [{"version": "19.0.0"}, {"timestamp": "2024-07-17T10:00:00+0900"}, *({kind: body} for kind, body in objects)]
    else:
        lines = [{"type": "header", "version": f"{version}.0.1", "timestamp": "2024-07-17T10:00:00+0900"}, *(
            {"type": kind, "params": body} if kind == "server_param" else {"type": kind} | body for kind, body in objects)]
    texts = (json.dumps(line, separators=(",", ":")).replace("\\t", "\t") for line in lines)  # std::quoted escapes no control characters
    return ({17: "ULG6\n", 18: "JSON\n"}.get(version, "") + "[\n" + ",\n".join(texts) + "\n]\n").encode()


def same_story(match: MatchLog, told: MatchLog) -> bool:
    """True if two logs tell the same bodies, events and commands."""
    return same_frames(match.frames, told.frames) and match.referee.drop("match_id").equals(told.referee.drop("match_id")) and (
        match.commands.drop("match_id").equals(told.commands.drop("match_id")))


LAID_OUT = {
    "as written": bytes, "minified": lambda data: data.replace(b"\n", b"").replace(b"ULG6", b"ULG6\n").replace(b"JSON", b"JSON\n"),
    "indented": lambda data: data.replace(b"},\n{", b"} ,\n\n   {  ").replace(b"[\n", b"[\n   ", 1),
    "Windows": lambda data: data.replace(b"\n", b"\r\n"),
}


@pytest.mark.parametrize("version", [17, 18, 19])
@pytest.mark.parametrize("layout", LAID_OUT)
def test_json(version: int, layout: str) -> None:
    """A JSON log is the match that the text log of it is, however it is laid out."""
    match, told = opened(LAID_OUT[layout](story_in_json(version)), "game.rcg"), opened(story_in_text(), "game.rcg")
    assert same_story(match, told)
    assert (match.info.home, match.info.away, match.info.complete, match.info.pitch) == ("Left", "Right", True, told.info.pitch)
    assert (told.info.complete, match.info.settings["version"]) == (True, "json")
    assert match.info.started_at.isoformat() == "2024-07-17T10:00:00+09:00"
    assert match.quality.is_empty()


@pytest.mark.parametrize(("change", "frames", "reason"), [
    (lambda data: data[:data.rindex(b'"show"') + 80], 3, "the log is cut off"),
    (lambda data: data[:data.rindex(b"]")], 4, "the log is cut off"),
    (lambda data: data + bytes(99), 4, "the log is cut off"),
    (lambda data: data.replace(b'"x":-1.25', b'"x":null'), 3, None),
    (lambda data: data.replace(b'"x":-1.25', b'"x":NaN'), 3, None),
    (lambda data: data.replace(b'"x":-1.25', b'"x":' + b'{"x":' * 100_000 + b"0"), 3, None),
    (lambda data: data.replace(b'"x":-1.25', b'"x"-1.25'), 3, None),
    (lambda data: data.replace(b'"ball":{"x":-1.25', b'"bull":{"x":-1.25'), 3, None),
])
def test_damaged_json(change: Callable[[bytes], bytes], frames: int, reason: str | None) -> None:
    """Whole lines of a damaged JSON log are read; the rest is counted."""
    for version in (17, 19):
        match = opened(change(story_in_json(version)), "game.rcg")
        assert len(match.frames) == frames
        assert match.info.incomplete_reason == reason
        flaws = match.quality["flaw"].cast(pl.String).to_list()
        assert flaws == (["truncated"] if reason else ["skipped"])


@pytest.mark.parametrize(("names", "read_as"), [
    (('"Left"', "Right"), ("Left", "Right")), (('"Left Wing"', '"Right Back"'), ("Left Wing", "Right Back")),
    (("Left", '"R. (2) B"'), ("Left", "R. (2) B")), (("null", '"null"'), ("null", "null")),
])
def test_quoted_names(names: tuple[str, str], read_as: tuple[str, str]) -> None:
    """A team's name may stand in quotes, with blanks in it."""
    match = opened(story_in_text(names), "game.rcg")
    assert (match.info.home, match.info.away) == read_as
    assert match.quality.is_empty()
    assert same_story(match, opened(story_in_text(), "game.rcg"))


@pytest.mark.parametrize("logs", [
    (story_in_text(), story_in_text(("C", "D"))), (story_in_text(), story_in_json(19)), (story_in_json(18), story_in_json(17), story_in_text()),
    (story_in_json(19), story_in_json(19)), (story_in_text(), b"ULG5\n", story_in_text()),
])
def test_several_logs(logs: tuple[bytes, ...]) -> None:
    """Logs one after the other in a file are matches of their own, each whole; one without a cycle is none."""
    source, played = open_source(b"".join(logs), "day.rcg"), [log for log in logs if len(log) > 9]
    for number, data in enumerate(played, 1):
        match = read_source(source.numbered(number))
        alone = opened(data, "day.rcg")
        assert same_story(match, alone)
        assert (match.info.home, match.info.complete) == (alone.info.home, True)
        assert match.info.settings["match"] == {"number": number, "of": len(played)}
        assert match.quality["flaw"].cast(pl.String).to_list() == ["several matches"]
    with pytest.raises(BadRecording, match=f"has no match number {number + 1}"):
        read_source(source.numbered(number + 1))


def test_several_logs_are_imported(tmp_path: Path) -> None:
    """An import makes each log a match, and counts files that were there, not matches."""
    (tmp_path / "day.rcg").write_bytes(story_in_text() + story_in_json(19))
    (tmp_path / "copy.rcg").write_bytes(story_in_text(("C", "D")))
    files = [Recording(file=tmp_path / name) for name in ("day.rcg", "copy.rcg")]
    store = Store(tmp_path / "data")
    for made, kept in ((3, 0), (0, 2)):
        report = import_all(store, files)
        assert (len(report.made), report.kept, report.failed) == (made, kept, {})


@pytest.mark.parametrize(("head", "says"), [
    (b"0,0\t(referee kick_off_l)\n0,1\tRecv A_1: (init A (version 14))", "rcssserver's log of what players said .*Import the .rcg that lies beside it"),
    (b"3,12\tRecv HELIOS_7: (dash 100)(turn_neck -3)\n", "without positions"),
    (b"0,0\tRecv Coach: (ok)\n" * 3, r"\(.rcl\)"),
    (b"SQLite format 3\0\x10\0", "rosbag2 records into .*mcap convert"), (b"#ROSBAG V2.0\nE\0\0\0", "bag of ROS 1.*rosbags-convert"),
    (b"100:0,1,9,1100,0,0.1;1,2,7,-3000,100,0.2;:0,0,0,0.0,H,Alive;:\n", "TRACAB's positions.*--from kloppy:tracab METADATA FILE"),
    (b"450:0.30602,0.97029,5,1.11;NaN,NaN,-1,NaN:0.5,0.4\n", "EPTS's positions.*--from kloppy:metrica-epts"),
    (b"1598184000000;0,1,1:0,a2s2,9,52.803,23.617;\n", "Stats Perform.*kloppy:statsperform MA1 FILE"),
    (b",,,Home,,Home,\n,,,11,,1,\nPeriod,Frame,Time [s],Player11,,Player1,\n1,1,0.04,0.1,0.4,0.3,0.6\n", "kloppy:metrica-csv HOME.csv AWAY.csv"),
    (b'<?xml version="1.0"?>\n<PutDataRequest RequestId="1"><Positions/></PutDataRequest>', "kloppy:sportec"),
    (b'{"detection": {"frame_number": 1, "t_capture": 1.5, "camera_id": 0}}\n', "SSL's packets as JSON.*game log"),
    (b'{"timestamp": 1, "type": 2, "message": {"robotsBlue": []}}\n' * 2, "SSL's packets as JSON"),
    (b'{"uuid": "x", "trackedFrame": {"frameNumber": 5}}\n', "SSL's packets as JSON"),
    (b'{"frame": 0, "timestamp": null, "image_corners_projection": {}}\n', "kloppy:skillcorner"),
    (b'{"period": 1, "frameIdx": 0, "gameClock": 0.0, "homePlayers": []}\n', "kloppy:secondspectrum"),
    (b'{"version": "4.1.0", "gameRefId": 10517.0}\n', "kloppy:pff METADATA ROSTERS FILE"),
    (b"PK\3\4\x14\0[Content_Types].xml", "spreadsheet of Excel. Save its sheet of positions as CSV"), (b"PK\3\4\x14\0a.rcg", "a zip archive"),
    (b"BZh91AY", "packed with bzip2"), (b"\xfd7zXZ\0", "xz"), (b"a.rcg".ljust(257, b"\0") + b"ustar", "or tar"),
    (gzip.compress(gzip.compress(b"ULG6\n", mtime=0), mtime=0), "is packed twice. Unpack it once"), (b"%PDF-1.4", "is a PDF"),
    (b"version https://git-lfs.github.com/spec/v1\noid sha256:ba8c\nsize 5\n", "pointer of Git LFS.*git lfs pull"),
    (b'{\n  "FrameData": [\n', "kloppy:tracab"), (b'[\n {\n "utc_time": 17, "phase": 1', "kloppy:signality"),
])
def test_unread(head: bytes, says: str) -> None:
    """A file that is met beside recordings is refused with what it is and what to do."""
    with pytest.raises(BadRecording, match=says) as error:
        opened(head, "found")
    assert "\n" not in str(error.value)
    assert "known format" not in str(error.value)
