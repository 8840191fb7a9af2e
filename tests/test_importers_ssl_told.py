"""Tables of what the game controller and trackers tell: game events and kicks, each once, with its source."""

from pathlib import Path

import polars as pl
import pytest
from support.ssl_games import EPOCH, STEP, Referee, frames, match, ns, ordered
from support.ssl_messages import TRACKER, Message, Team, Tracked, f32, f64, integer, log, span, tracked

from pitchlore.pipeline.engine.matches import made
from pitchlore.pipeline.engine.memory import MemoryInputs
from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.matches import packed
from pitchlore.pipeline.matches import read as read_log
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import Settings
from pitchlore.schemas import GameEvents, Kicks

YELLOW, BLUE = 1, 2


def vector(*values: float) -> bytes:
    return b"".join(f32(i, value) for i, value in enumerate(values, 1))


def event(field: int, content: bytes, kind: int | None = None, *origins: str) -> bytes:
    """A game event: its payload, its type, who saw it."""
    return (span(field, content) + integer(40, kind) + b"".join(span(41, origin) for origin in origins)
            + integer(49, 1_750_000_000_000_000) + span(50, f"{field}"))


CRASH = event(22, integer(1, YELLOW) + integer(2, 3) + integer(3, 7) + span(4, vector(1.5, -2.0)) + f32(5, 1.75), 22, "TIGERs", "ER-Force")
OWN_GOAL = event(39, integer(1, BLUE) + integer(2, 4) + span(3, vector(4.5, 0.25)) + span(4, vector(1.0, 1.0)) + f32(5, 0.125)
                 + integer(6, YELLOW) + span(9, "ball too high"), 39, "TIGERs")
STUCK = event(2, span(1, vector(0.5, 0.5)) + f32(2, 10.0), 2)
UNKNOWN = event(49, integer(1, BLUE), 77)


def tables(game: MatchLog) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The tables of a match that was written and read once."""
    again = read_log(packed(game), where="x")
    found = {schema.NAME: table for table, schema in made(again).tables}
    return found.get("game_events", GameEvents.empty()), found.get("kicks", Kicks.empty())


def test_game_events() -> None:
    """An event that is repeated in each packet is one; a proposal and what became of it are told apart; teams are sides."""
    gc, messages = Referee(), []
    for frame in range(90):
        extra = b""
        if 20 <= frame < 60:
            extra += span(16, CRASH) + span(17, span(1, OWN_GOAL) + integer(2, int(frame >= 30)) + span(3, "group"))
        if frame >= 50:
            extra += span(16, STUCK) + span(16, UNKNOWN) + span(16, b"\xff\xff")
        packet = gc.says(frame, yellow=Team("Y"), blue=Team("B"))
        messages.append(packet._replace(content=packet.content + extra))
    spare = Referee("spare").says(5)
    other = spare._replace(content=spare.content + span(16, event(37, integer(1, BLUE), 37)))
    events, kicks = tables(match(ordered(messages, [other], frames(100))))
    assert kicks.is_empty()
    shown = events.select(
        (pl.col("t_ns") / 1e9 / STEP).round(3), "event", "state", "source", "team", "robot", "robot_team", "victim", "x", "y", "from_x",
        "measure", "value", "note").rows()
    both = ("away", 3, "away", 7, 1.5, -2.0, None, "crash_speed", 1.75, None)
    goal = ("home", 4, "away", None, 4.5, 0.25, 1.0, "max_ball_height", 0.125, "ball too high")
    assert shown == [
        (20.0, "BOT_CRASH_UNIQUE", "event", "ER-Force, TIGERs", *both),
        (20.0, "POSSIBLE_GOAL", "proposal", "TIGERs", *goal),
        (30.0, "POSSIBLE_GOAL", "accepted proposal", "TIGERs", *goal),
        (50.0, "NO_PROGRESS_IN_GAME", "event", "game controller", None, None, None, None, 0.5, 0.5, None, "time", 10.0, None),
    ]


def kicked(frame: int, start: int, team: int, number: int, speed: float) -> bytes:
    """A tracked frame of a ball that was kicked."""
    ball = (span(1, vector(1.0, 0.5)) + span(2, vector(speed, 0.25, 2.0)) + f64(3, EPOCH + start * STEP) + f64(4, EPOCH + 200 * STEP)
            + span(5, vector(4.0, 1.0)) + span(6, integer(1, number) + integer(2, team)))
    return span(5, ball)


def test_axes() -> None:
    """Places are where home attacks +x: turned where blue's goal is at +x."""
    gc = Referee()
    gc.side = True
    packet = gc.says(5)
    events, _ = tables(match(ordered([packet._replace(content=packet.content + span(16, OWN_GOAL))], frames(100))))
    assert events.select("x", "y", "from_x", "from_y", "value").rows() == [(-4.5, -0.25, -1.0, -1.0, 0.125)]


@pytest.mark.parametrize("source", ["auto", "vision"])
def test_kicks(source: str) -> None:
    """A kick that is told in each frame is one, at its last estimate; it is there also where cameras are read."""
    messages = []
    for frame in range(100):
        content = tracked(frame, EPOCH + frame * STEP, [Tracked(1.0, 0.5)], [Tracked(-2.0, 0.0, team=YELLOW, number=1)])
        kick = b"" if frame < 10 or 40 <= frame < 50 else kicked(
            frame, 9, YELLOW, 3, 5.0 - frame / 64) if frame < 40 else kicked(frame, 48, BLUE, 6, 3.0)
        # the tracked frame is the packet's last field: once more, with the kick
        whole = span(1, "u-1") + span(2, "TIGERs") + span(3, _frame(content) + kick)
        messages.append(Message(ns(frame * STEP) + 1, TRACKER, whole))
    game = match(ordered(messages, frames(100)), f'[teams]\nhome_attacks = "right"\n[ssl]\nsource = "{source}"')
    _, kicks = tables(game)
    assert kicks.select(pl.col("t_ns") / 1e9 / STEP, "source", "team", "robot", "x", "vx", "vz", pl.col("stop_ns") / 1e9 / STEP,
                        "stop_x").rows() == [
        (pytest.approx(9, abs=1e-4), "TIGERs", "away", 3, 1.0, 5.0 - 39 / 64, 2.0, pytest.approx(200, abs=1e-4), 4.0),
        (pytest.approx(48, abs=1e-4), "TIGERs", "home", 6, 1.0, 3.0, 2.0, pytest.approx(200, abs=1e-4), 4.0)]
    seen = MatchTables(MemoryInputs(game, Settings()))
    assert seen.kicks.equals(kicks)
    assert seen.game_events.is_empty()


def _frame(packet: bytes) -> bytes:
    """The tracked frame of a packet: all after its uuid and name."""
    head = len(span(1, "u-1") + span(2, "TIGERs"))
    at = head + 1
    while packet[at] & 0x80:
        at += 1
    return packet[at + 1:]


def test_sql(tmp_path: Path) -> None:
    """Both tables are there for SQL, and empty where nothing tells them."""
    from pitchlore import open as opened
    from pitchlore.pipeline.engine.imports import import_all
    from pitchlore.pipeline.engine.recordings import Recording
    from pitchlore.pipeline.store import Store

    gc = Referee()
    packet = gc.says(5)
    file = tmp_path / "x.log"
    file.write_bytes(log(ordered([packet._replace(content=packet.content + span(16, STUCK))], frames(100))))
    import_all(Store(tmp_path / "data"), [Recording(file=file)])
    league = opened(tmp_path / "data")
    assert league.sql("select event, value from game_events").fetchall() == [("NO_PROGRESS_IN_GAME", 10.0)]
    assert league.sql("select count(*) from kicks").fetchall() == [(0,)]
