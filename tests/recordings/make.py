"""Synthetic recordings: one short match, the sketch, written in every format that can be imported.

Run it to write the files anew: ``PYTHONPATH=tests python tests/recordings/make.py``. The folder of a file is the name of
its reader in ``pipeline.importers.readers.READERS``; the map of ``x.csv`` is ``x.csv.toml``.
"""

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from support import ssl_messages as ssl
from support.mcap_logs import written
from support.tracking import parquet

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.packets.recorder import Packet, PacketRecorder
from pitchlore.pipeline.importers.rows import Event, pack, referee
from pitchlore.pipeline.matches.frame import MatchInfo, MatchLog, Period

HERE = Path(__file__).parent
NAMES = ("amber", "blue")
PITCH = PITCHES[Kind.SIM2D]
FRAMES = 20
STEP_NS = 100_000_000
#: team, number, x, y (m) of each robot at the start, vx, vy (m/s). No axis is like another.
ROBOTS = (
    (0, 1, -45.0, 2.0, 0.5, 1.0), (0, 2, -20.0, 15.0, 4.0, -3.0),
    (1, 1, 46.0, -1.0, -0.25, 0.75), (1, 3, 12.0, -9.0, -2.0, -5.0),
)
#: Frames in which robot 3 of blue is not seen.
UNSEEN = (5, 6)
#: Frame and place of the ball, metres; in between it moves straight.
BALL = ((0, 0.0, 0.0), (6, 48.0, 3.0), (7, 53.0, 4.0), (8, 0.0, 0.0), (11, -9.0, 12.0), (12, 0.0, 0.0),
        (16, -50.0, 1.0), (17, -53.0, -2.0), (18, 0.0, 0.0), (19, 3.0, 6.0))
#: Frame, event, team, score of home and away after it, the word of rcssserver.
EVENTS = (
    (0, "kick-off", "home", 0, 0, "kick_off_l"), (1, "play", None, 0, 0, "play_on"),
    (7, "goal", "home", 1, 0, "goal_l"), (8, "kick-off", "away", 1, 0, "kick_off_r"),
    (9, "play", None, 1, 0, "play_on"), (12, "half", None, 1, 0, ""),
    (12, "kick-off", "away", 1, 0, "kick_off_r"), (13, "play", None, 1, 0, "play_on"),
    (17, "goal", "away", 1, 1, "goal_r"), (18, "kick-off", "home", 1, 1, "kick_off_l"),
    (19, "end", None, 1, 1, "time_over"),
)


def sketch() -> MatchLog:
    """The match that every file tells."""
    frames = np.arange(FRAMES, dtype=np.int64)
    t_s = frames * STEP_NS / 1e9
    at, x, y = np.array(BALL).T
    ball = {"x": np.interp(frames, at, x), "y": np.interp(frames, at, y)}
    ball |= {f"v{axis}": np.gradient(ball[axis], t_s) for axis in ("x", "y")}
    owners, columns = [], {name: [] for name in ("team", "id", "x", "y", "theta", "vx", "vy", "omega")}
    for team, number, x0, y0, vx, vy in ROBOTS:
        seen = frames[~np.isin(frames, UNSEEN)] if (team, number) == (1, 3) else frames
        owners.append(seen)
        values = (team, number, x0 + vx * t_s[seen], y0 + vy * t_s[seen], np.arctan2(vy, vx), vx, vy, 0.0)
        for name, value in zip(columns, values, strict=True):
            columns[name].append(np.broadcast_to(value, len(seen)))
    info = MatchInfo(
        match_id="sketch-0", source="made by tests/recordings/make.py", format="tracking", home=NAMES[0],
        away=NAMES[1], pitch=PITCH, software="tests",
        periods=(Period(start_ns=0, end_ns=(FRAMES - 1) * STEP_NS + 1, home_attacks=1, inferred=False),),
    )
    events = [Event(f * STEP_NS, event, team, home, away, word) for f, event, team, home, away, word in EVENTS]
    robots = {name: np.concatenate(parts) for name, parts in columns.items()}
    packed = pack((frames + 1).astype(np.uint32), frames * STEP_NS, ball, np.concatenate(owners), robots)
    return MatchLog(info=info, frames=packed, referee=referee(info.match_id, events))


class Body(NamedTuple):
    """One body at one sample of the sketch: metres, seconds, radians; the ball's team is None."""

    frame: int
    team: int | None
    number: int | None
    x: float
    y: float
    theta: float | None
    vx: float
    vy: float


def bodies(frame: int) -> Iterator[Body]:
    """The ball and the robots of a frame, as they are in the sketch."""
    frames = sketch().frames
    ball = frames.ball[frame]
    yield Body(frame, None, None, *map(float, (ball["x"], ball["y"])), None, float(ball["vx"]), float(ball["vy"]))
    for row in frames.robots[frames.offsets[frame] : frames.offsets[frame + 1]]:
        yield Body(frame, int(row["team"]), int(row["id"]),
                   *(float(row[name]) for name in ("x", "y", "theta", "vx", "vy")))


def score(frame: int) -> tuple[int, int]:
    """Goals of home and away at a frame."""
    return next((event[3], event[4]) for event in reversed(EVENTS) if event[0] <= frame)


def state(frame: int, words: dict[tuple[str, str | None], str]) -> str:
    """The words of a frame's events; the last ones hold on until the next event."""
    last = max(event[0] for event in EVENTS if event[0] <= frame)
    return "+".join(words[event[1:3]] for event in EVENTS if event[0] == last)


# --- formats --------------------------------------------------------------------------------------

#: What follows a player's body and neck in each version of the log: arm, view, stamina, counts.
TAILS = {
    4: "(v h 180) (s 4000 1 1) (c 0 0 1 0 38 0 0 0 0 0 0)",
    5: "3.5 -20.1 (v h 90) (s 8000 1 1 130600) (f r 7) (c 0 0 1 0 38 0 0 0 0 0 0)",
    6: "(v l 120) (fp 0 0) (s 8000 1 1 130600) (c 0 0 1 0 38 0 0 0 0 0 0 0)",
}


def rcg(version: int) -> bytes:
    """A text log of rcssserver: y down, degrees clockwise, metres per cycle; halves of 10 cycles."""
    lines = [f"ULG{version}", "(server_param (goal_width 14.02)(half_time 1)(simulator_step 100))"]
    for frame in range(FRAMES):
        cycle = frame + 1
        modes = [event[5] for event in EVENTS if event[0] == frame and event[5]]
        lines += [f"(playmode {cycle} {mode})" for mode in modes]
        if modes:
            lines.append("(team {} {} {} {} {})".format(cycle, *NAMES, *score(frame)))
        ball, *players = bodies(frame)
        parts = [f"((b) {ball.x:.4f} {-ball.y:.4f} {ball.vx / 10:.5f} {-ball.vy / 10:.5f})"]
        parts += [
            f"(({'lr'[p.team]} {p.number}) 0 0x1 {p.x:.4f} {-p.y:.4f} {p.vx / 10:.5f} {-p.vy / 10:.5f} "
            f"{-np.degrees(p.theta):.5f} 15 {TAILS[version]})" for p in players
        ]
        # the server names every player; one that is off the pitch has no state
        parts += [f"((r 3) 0 0 3 37 0 0 0 0 {TAILS[version]})"] * (frame in UNSEEN)
        lines.append(f"(show {cycle} {' '.join(parts)})")
    return "\n".join([*lines, ""]).encode()


_PLAIN = {
    ("kick-off", "home"): "kickoff_a", ("kick-off", "away"): "kickoff_b", ("goal", "home"): "goal_a",
    ("goal", "away"): "goal_b", ("play", None): "play", ("half", None): "half", ("end", None): "time_over",
}


def plain() -> pl.DataFrame:
    """A tracking table in the plain form; its clock starts at 10 s."""
    return pl.DataFrame([
        {
            "frame": body.frame + 1, "t": round(10 + body.frame / 10, 1),
            "team": "ball" if body.team is None else NAMES[body.team], "player": body.number,
            "x": round(body.x, 5), "y": round(body.y, 5),
            "heading": None if body.theta is None else round(body.theta, 6),
            "score_home": score(frame)[0], "score_away": score(frame)[1], "game_state": state(frame, _PLAIN),
        }
        for frame in range(FRAMES) for body in bodies(frame)
    ])


_OWN_WORDS = {
    ("kick-off", "home"): "Anstoss H", ("kick-off", "away"): "Anstoss G", ("goal", "home"): "Tor H",
    ("goal", "away"): "Tor G", ("play", None): "laeuft", ("half", None): "Pause", ("end", None): "Schluss",
}
MAP = """[columns]
frame = "Nr"
t = "ms"
team = "side"
player = "id"
x = "px"
y = "py"
heading = "angle"
vx = "vpx"
vy = "vpy"
omega = "spin"
game_state = "phase"

[units]
length = "cm"
angle = "deg"
time = "ms"

[axes]
x = "left"
y = "down"
heading = "cw"
origin = "corner"

[pitch]
kind = "2d"

[teams]
home = "amber"
ball = "Ball"
home_attacks = "right"

[states]
"Anstoss H" = "kick-off home"
"Anstoss G" = "kick-off away"
"Tor H" = "goal home"
"Tor G" = "goal away"
laeuft = "play"
Pause = "half"
Schluss = "end"
"""


def mapped() -> bytes:
    """A tracking table in CSV that needs the map: its camera looks from the other side.

    Centimetres from the corner that we call upper right, x to the left, y down, degrees clockwise from
    its x, milliseconds of the day, names of its own and no score.
    """
    lines = ["Nr;ms;side;id;px;py;angle;vpx;vpy;spin;phase"]
    for frame in range(FRAMES):
        for body in bodies(frame):
            side = "Ball" if body.team is None else NAMES[body.team]
            angle = spin = ""
            if body.theta is not None:
                angle, spin = f"{np.degrees(np.pi - body.theta):.4f}", "0"
            place = f"{(PITCH.length / 2 - body.x) * 100:.2f};{(PITCH.width / 2 - body.y) * 100:.2f}"
            speed = f"{-body.vx * 100:.2f};{-body.vy * 100:.2f}"
            lines.append(f"{frame + 1};{36_000_000 + 100 * frame};{side};{body.number or ''};{place};{angle};"
                         f"{speed};{spin};{state(frame, _OWN_WORDS)}")
    return "\n".join([*lines, ""]).encode()


SSL_MAP = """[pitch]
kind = "2d"
"""
#: As it is if yellow is home, which a log never says.
TRACKED_MAP = f"""{SSL_MAP}
[teams]
home = "amber"

[ssl]
source = "tracker"
"""
#: Numbers of the referee's commands: for what is prepared, that of yellow; blue's is one more.
_HALT, _NORMAL_START, _PREPARE_KICKOFF = 0, 2, 4


def _ssl_referee(frame: int, home: int) -> Iterator[ssl.Message]:
    """The referee's packets before a frame; ``home`` is 0 if yellow is home, 1 if blue is."""
    half = sum(event[:2] <= (frame, "half") and event[1] == "half" for event in EVENTS)
    teams = [ssl.Team(NAMES[int(colour != home)], score(frame)[int(colour != home)]) for colour in (0, 1)]
    said = {event[1]: event[2] for event in EVENTS if event[0] == frame}
    stage = 13 if "end" in said else 3 * half + ("kick-off" not in said)
    commands = [_HALT] if "goal" in said else []
    if "kick-off" in said:
        colour = home if said["kick-off"] == "home" else 1 - home
        commands = [_PREPARE_KICKOFF + colour, _NORMAL_START]
    for command in commands or [_HALT if frame in (7, 17) else _NORMAL_START]:
        content = ssl.referee(
            stage, command, 10 * frame + command if commands else 10 * (frame - 1) + _NORMAL_START, *teams,
            t=10 + frame / 10, blue_on_positive=home == 0, source="gc",
        )
        yield ssl.Message(_received(frame), ssl.REFEREE, content)


def _received(frame: int) -> int:
    return 1_700_000_000_000_000_000 + frame * STEP_NS


def ssl_vision() -> list[ssl.Message]:
    """An SSL log of two cameras, which overlap by 20 m; millimetres, seconds since 10 s; blue is home."""
    messages = []
    for frame in range(FRAMES):
        messages += _ssl_referee(frame, 1)
        ball, *robots = bodies(frame)
        for camera, sign in ((0, -1), (1, 1)):
            seen: list[list[ssl.Seen]] = [[], [], []]
            for body in (ball, *robots):
                if body.x * sign >= -10:
                    of = 2 if body.team is None else 1 - body.team
                    seen[of].append(ssl.Seen(body.x, body.y, body.number, body.theta))
            geometry = ssl.size(PITCH.length, PITCH.width, PITCH.goal_width, PITCH.goal_depth, 3.0) if frame % 8 == 3 else None
            content = ssl.vision(frame + 1, 10 + frame / 10, camera=camera, yellow=seen[0], blue=seen[1], balls=seen[2],
                                 geometry=geometry)
            messages.append(ssl.Message(_received(frame) + camera, ssl.VISION_2014, content))
    return messages


def packets() -> bytes:
    """The same messages as `pitchlore watch` records them."""
    stream = io.BytesIO()
    recorder = PacketRecorder(stream, "ssl")
    recorder.record([Packet(message.kind, message.received, message.content) for message in ssl_vision()])
    recorder.close()
    return stream.getvalue()


def ssl_tracked() -> bytes:
    """An SSL log of a tracker, metres, of version 0 and with an index; yellow is home."""
    geometry = ssl.size(PITCH.length, PITCH.width, PITCH.goal_width, PITCH.goal_depth, 3.0)
    messages = [ssl.Message(_received(0) - 1, ssl.VISION_2014, ssl.span(2, geometry))]
    for frame in range(FRAMES):
        messages += _ssl_referee(frame, 0)
        ball, *robots = bodies(frame)
        tracked = [ssl.Tracked(b.x, b.y, b.vx, b.vy, b.team + 1, b.number, b.theta, 0.0) for b in robots]
        if frame in UNSEEN:  # the tracker still guesses where it is
            tracked.append(ssl.Tracked(9.0, 9.0, 0.0, 0.0, 2, 3, 0.0, 0.0, visibility=0.0))
        content = ssl.tracked(frame + 1, 10 + frame / 10, [ssl.Tracked(ball.x, ball.y, ball.vx, ball.vy)], tracked)
        messages.append(ssl.Message(_received(frame), ssl.TRACKER, content))
    return ssl.log(messages, version=0, index=True)


def mcap() -> bytes:
    """The sketch in our own log."""
    return written(sketch())


#: What makes each file, by its path in this folder.
FILES: dict[str, Callable[[], bytes]] = {
    "mcap/whole.mcap": mcap,
    "packets/ssl.mcap": packets,
    "packets/ssl.mcap.toml": lambda: SSL_MAP.encode(),
    "rcg/ulg4.rcg": lambda: rcg(4),
    "rcg/ulg5.rcg": lambda: rcg(5),
    "rcg/ulg6.rcg": lambda: rcg(6),
    "ssl-log/tracked.log": ssl_tracked,
    "ssl-log/tracked.log.toml": lambda: TRACKED_MAP.encode(),
    "ssl-log/vision.log": lambda: ssl.log(ssl_vision()),
    "ssl-log/vision.log.toml": lambda: SSL_MAP.encode(),
    "tracking-csv/mapped.csv": mapped,
    "tracking-csv/mapped.csv.toml": lambda: MAP.encode(),
    "tracking-csv/plain.csv": lambda: plain().write_csv().encode(),
    "tracking-parquet/plain.parquet": lambda: parquet(plain()),
}

if __name__ == "__main__":
    for name, make in FILES.items():
        (HERE / name).parent.mkdir(exist_ok=True)
        (HERE / name).write_bytes(make())
