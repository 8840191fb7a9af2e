"""Our teams drive robots that others simulate, and others drive robots that we simulate."""

import json
import math
import signal
import socket
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from threading import Event as Flag
from threading import Thread

import numpy as np
import polars as pl
import pytest
from conftest import ROOT
from hypothesis import given
from hypothesis import strategies as st
from support import ssl_games, vsss_messages
from support.protobufs import message_class
from support.terminal import HUNG_UP, SCRIPT
from test_packets import REFEREE, T0, VISION, of_log
from test_watch import Call

from pitchlore.flows.commands.addresses import addressed
from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.game.bodies import BALL, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.packets import vsss
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import Stream, channels
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.live.bodies import BodyTracker
from pitchlore.pipeline.live.driver import BLIND_S, Driver, Job, streams_of
from pitchlore.pipeline.live.encoding import (
    Wheels,
    environment,
    referee_command,
    robot_control,
    wheel_commands,
)
from pitchlore.pipeline.live.referee_state import RefereeState
from pitchlore.pipeline.live.remote import RemoteController, asked
from pitchlore.pipeline.live.screening import MALFORMED, laid_out
from pitchlore.pipeline.live.sockets import Sender
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.sessions.driving import DriveOutcome, drive_team
from pitchlore.pipeline.sessions.simulating import STREAMS, simulate
from pitchlore.pipeline.store import Store

STATIC, REMOTE = TeamSettings(kind="static"), TeamSettings(kind="remote")
PEER = ROOT / ".venv-counterparts" / "bin" / "python"
unit = pytest.mark.unit
speeds = st.floats(-2, 2, allow_nan=False)


@unit
@given(st.lists(st.builds(Wheels, st.booleans(), st.integers(0, 20), speeds, speeds), max_size=8))
def test_commands_come_back(commands: list[Wheels]) -> None:
    """FIRASim's commands are read as they were written, to a wheel's rounding."""
    found = asked(wheel_commands(commands))
    assert [(one.yellow, one.number) for one in found] == [(one.yellow, one.number) for one in commands]
    for one, other in zip(found, commands, strict=True):
        assert (one.left, one.right) == pytest.approx((other.left, other.right))


@unit
@given(st.binary(max_size=80))
def test_no_bytes_are_a_broken_command(data: bytes) -> None:
    controller = RemoteController(3, 1.2)
    for command in asked(data):
        controller.ask(command)
    wheels = np.full((3, 2), np.nan)
    controller.think(0, np.zeros((7, 6)), wheels)
    assert np.abs(wheels).max() <= 1.2


def test_a_peer_of_the_referee() -> None:
    """The package V3SProtoComm reads our referee's commands, and we read its: each foul, colour and half, and the clock."""
    if not PEER.exists():
        pytest.skip("V3SProtoComm is not installed: make counterparts")
    fouls = ("FREE_KICK", "PENALTY_KICK", "GOAL_KICK", "FREE_BALL", "KICKOFF", "STOP", "GAME_ON", "HALT")
    colours, halves = ("BLUE", "YELLOW", "NONE"), ("NO_HALF", "FIRST_HALF", "SECOND_HALF")
    cases = [(f, c, h, 12.5 * f + c + 0.25) for f in range(len(fouls)) for c in range(len(colours)) for h in range(len(halves))]
    asked: list[dict[str, object]] = [{"hex": referee_command(f, c, t, h).hex()} for f, c, h, t in cases]
    asked += [{"foul": fouls[f], "teamcolor": colours[c], "gameHalf": halves[h], "timestamp": t} for f, c, h, t in cases]
    done = subprocess.run([PEER, ROOT / "tests" / "counterparts" / "vss_referee_peer.py"], text=True, capture_output=True,
                          input="\n".join(map(json.dumps, asked)), timeout=60, check=True)
    reported = [json.loads(line) for line in done.stdout.splitlines()]
    theirs = [{"foul": fouls[f], "teamcolor": colours[c], "gameHalf": halves[h], "timestamp": t, "foulQuadrant": "NO_QUADRANT"}
              for f, c, h, t in cases]
    assert reported[: len(cases)] == theirs
    packets = [Packet(REFEREE, T0, bytes.fromhex(each["hex"])) for each in reported[len(cases):]]
    said, lost = vsss.commands(*laid_out(packets)[:1], np.full(len(packets), T0), *laid_out(packets)[1:])
    assert lost == 0
    words = {name.replace("_", "").lower(): name for name in fouls}
    for one, (f, c, h, t) in zip(said, cases, strict=True):
        foul, _, colour = one.state.partition("_")
        assert (words[foul], colour.upper()) == (fouls[f], "" if colours[c] == "NONE" else colours[c])
        assert (max(one.half, 0), one.clock_s) == (h, t)


@unit
def test_remote_controller() -> None:
    """Wheels turn as they were last asked for, no faster than they can; others' numbers are left out."""
    controller, wheels = RemoteController(2, 1.0), np.full((2, 2), np.nan)
    controller.think(0, np.zeros((5, 6)), wheels)
    assert wheels.tolist() == [[0, 0], [0, 0]]
    for command in (Wheels(False, 1, 0.5, -3.0), Wheels(False, 2, 1.0, 1.0), Wheels(False, 0, math.nan, 0.0)):
        controller.ask(command)
    controller.think(1, np.zeros((5, 6)), wheels)
    assert wheels.tolist() == [[0, 0], [0.5, -1.0]]


def bodies(robots: int = 3) -> F64:
    """Bodies that differ in every number."""
    found = np.arange(6.0 * (1 + 2 * robots)).reshape(-1, 6) / 100 + 0.01
    found[BALL, THETA] = found[BALL, 5] = 0.0
    return found


@unit
def test_environment_comes_back() -> None:
    """FIRASim's frames are read as they were written, blue's robots before yellow's."""
    data = environment(7, bodies(), PITCHES[Kind.VSSS], (2, 1))
    found = vsss.environments(*laid_out([Packet(VISION, T0, data)]))
    assert found.frames.tolist() == [[7, 2, 1, 1.5, 1.3, 0.4, 0.1]]
    blue = found.bodies[found.bodies[:, vsss.TEAM] == 1]
    assert blue[:, vsss.ID].tolist() == [0, 1, 2]
    np.testing.assert_allclose(blue[:, vsss.X:], bodies()[1:4])
    yellow = found.bodies[found.bodies[:, vsss.TEAM] == 0]
    np.testing.assert_allclose(yellow[:, vsss.X:], bodies()[4:])


@unit
def test_robot_control() -> None:
    """Protobuf's library reads SSL's simulation control, every required field of it, though it is 0.

    The fields are those of RoboCup-SSL/ssl-simulation-protocol (``proto/ssl_simulation_robot_control.proto`` at
    9bec36d).
    """
    control = message_class({
        "MoveLocalVelocity": [("forward", 1, "!float"), ("left", 2, "!float"), ("angular", 3, "!float")],
        "RobotMoveCommand": [("local_velocity", 2, "MoveLocalVelocity")],
        "RobotCommand": [("id", 1, "!uint32"), ("move_command", 2, "RobotMoveCommand"), ("kick_speed", 3, "float")],
        "RobotControl": [("robot_commands", 1, "*RobotCommand")],
    }, "RobotControl")
    said = control.FromString(robot_control([(0, 0.5, -1.0), (3, 0.0, 0.0)]))
    assert said.IsInitialized()
    assert not any(command.HasField("kick_speed") for command in said.robot_commands)
    moves = [(command.id, command.move_command.local_velocity) for command in said.robot_commands]
    assert [(number, move.forward, move.left, move.angular) for number, move in moves] == [(0, 0.5, 0.0, -1.0), (3, 0.0, 0.0, 0.0)]


@unit
def test_sight_of_a_simulator_that_sends_velocities() -> None:
    """Poses and velocities are the packet's; a robot that is not seen stays, one that never was is aside."""
    tracker = BodyTracker("vsss", 3, PITCHES[Kind.VSSS], 60.0)
    there = bodies(2)
    tracker.take([Packet(VISION, T0, environment(1, there, PITCHES[Kind.VSSS], (0, 0)))])
    seen, visible = tracker.now()
    np.testing.assert_allclose(seen[[0, 1, 2, 4, 5]], there, atol=1e-12)
    assert visible[[0, 1, 2, 4, 5]].all()
    assert abs(seen[3, X]) > 0.75
    seen, visible = tracker.now()
    assert not visible.any()
    np.testing.assert_allclose(seen[1, : VX], there[1, : VX])
    assert time.monotonic() - tracker.seen_s < 60


@unit
def test_sight_estimates_velocities() -> None:
    """Where a simulator sends none, they come from the poses; SSL's cameras never do."""
    for league, robots in (("vsss", 3), ("ssl", 6)):
        tracker = BodyTracker(league, robots, PITCHES[Kind.VSSS if league == "vsss" else Kind.SSL], 60.0)  # type: ignore[arg-type]
        for frame in range(60):
            x = 0.3 * frame / 60 - 0.2
            if league == "vsss":
                packet = Packet(VISION, T0, vsss_messages.environment(frame, (x, 0.1), [(1, -x, 0.0, 3.0)]))
                row, sign = 1 + 3 + 1, -1
            else:
                content = ssl_games.seen(frame, balls=[ssl_games.Seen(x, 0.1)], blue=[ssl_games.Seen(x, 1.0, 4, 0.5)])
                packet, row, sign = of_log([content])[0], 1 + 4, 1
            tracker.take([packet])
            seen, visible = tracker.now()
        assert visible[[BALL, row]].all()
        assert seen[BALL, VX] == pytest.approx(0.3, rel=0.02)
        assert seen[BALL, VY] == pytest.approx(0.0, abs=1e-6)
        assert seen[row, VX] == pytest.approx(sign * 0.3, rel=0.02)
        assert seen[row, Y] == pytest.approx(0.0 if league == "vsss" else 1.0)


@unit
def test_referee_state() -> None:
    """Robots may move without a referee, and then as the referee says."""
    referee = RefereeState("vsss")
    assert referee.playing
    for foul, playing in ((vsss_messages.KICKOFF, False), (vsss_messages.GAME_ON, True), (vsss_messages.FREE_BALL, False),
                          (vsss_messages.STOP, False), (vsss_messages.HALT, False), (vsss_messages.GAME_ON, True)):
        referee.hear([Packet(REFEREE, T0, vsss_messages.command(foul, half=2))])
        assert referee.playing is playing
    assert (referee.half, referee.score) == (2, None)
    referee.hear([Packet(VISION, T0, vsss_messages.environment(3, goals=(2, 5)))])
    assert referee.score == (2, 5)
    gc, referee = ssl_games.Referee(), RefereeState("ssl")
    for command, stage, playing, half in ((0, 0, False, 1), (4, 0, False, 1), (2, 1, True, 1), (8, 1, True, 1), (1, 1, False, 1), (3, 4, True, 2)):
        referee.hear(of_log([gc.says(0, command=command, stage=stage, blue=gc.blue._replace(score=4))]))
        assert (referee.playing, referee.half, referee.score) == (playing, half, (4, 0))


class Simulator:
    """Another's simulator: it sends frames of a ball and robots that stand, and notes the commands that come."""

    def __init__(self, where: dict[str, int]) -> None:
        self.came: list[tuple[float, list[Wheels]]] = []
        self.sends, self._over = Flag(), Flag()
        self.sends.set()
        self._where = where
        self._ears = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._ears.bind(("127.0.0.1", 0))
        self._ears.settimeout(0.02)
        self.port = self._ears.getsockname()[1]
        self.streams = addressed(streams_of("vsss", "blue"), None, (
            "vision=127.0.0.1:0", "referee=127.0.0.1:0", f"commands=127.0.0.1:{self.port}"))

    @contextmanager
    def running(self) -> Iterator[None]:
        threads = [Thread(target=self._send), Thread(target=self._hear)]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            time.sleep(0.1)
            self._over.set()
            for thread in threads:
                thread.join()
            self._ears.close()

    def _send(self) -> None:
        step = 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mouth:
            while not self._over.wait(1 / 60):
                step += 1
                if self.sends.is_set() and "vision" in self._where:
                    robots = [(i, 0.4, 0.2 * i - 0.2, 3.1) for i in range(3)]
                    ours = [(i, -0.4, 0.2 * i - 0.2, 0.0) for i in range(3)]
                    mouth.sendto(vsss_messages.environment(step, (0.1, 0.2), robots, ours), ("127.0.0.1", self._where["vision"]))

    def _hear(self) -> None:
        while not self._over.is_set():
            try:
                data = self._ears.recv(4096)
            except TimeoutError:
                continue
            self.came.append((time.monotonic(), asked(data)))

    def still(self) -> list[bool]:
        """True for each packet in which all wheels stand."""
        return [all(one.left == one.right == 0 for one in commands) for _, commands in self.came]


def malformed(port: int, packets: int = 3) -> None:
    """Packets that no league's program sends."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mouth:
        for _ in range(packets):
            mouth.sendto(b"\x0a\xff", ("127.0.0.1", port))


def driven(data: Path, during: Sequence[tuple[float, str]], seconds: float = 2.5) -> tuple[DriveOutcome, Simulator]:
    """Drive the static team against a simulator; ``during`` are times at which vision goes off or on, or a flood comes."""
    where: dict[str, int] = {}
    simulator = Simulator(where)

    def script() -> None:
        began = time.monotonic()
        for at, what in during:
            time.sleep(max(0.0, began + at - time.monotonic()))
            if what == "flood":
                malformed(where["vision"], 20_000)
                continue
            (simulator.sends.set if what == "on" else simulator.sends.clear)()

    def listening(addresses: object) -> None:
        where["vision"] = int(dict(addresses)["vision"].rpartition(":")[2])  # type: ignore[call-overload]
        malformed(where["vision"])
        Thread(target=script).start()

    with simulator.running():
        done = drive_team(
            Store(data), Job("vsss", "blue", STATIC, "static", streams=simulator.streams, seconds=seconds), listening=listening)
    return done, simulator


def test_drives_in_a_flood(tmp_path: Path) -> None:
    """A flood of broken packets is counted, and robots are driven on after it."""
    done, simulator = driven(tmp_path, [(0.3, "flood")], seconds=4.0)
    assert sum(done.refused.values()) > 1_000
    still = simulator.still()
    assert not all(still[len(still) // 2:])
    assert still[-5:] == [True] * 5


def test_drives_and_stops(tmp_path: Path) -> None:
    """Commands go out 60 times a second, robots stop 0.3 s after vision, and when it ends; the log tells it."""
    done, simulator = driven(tmp_path, [(1.0, "off"), (1.6, "on")], seconds=2.6)
    still, times = simulator.still(), [at for at, _ in simulator.came]
    assert done.blind >= 1  # a busy computer sees nothing for 0.3 s more often
    assert done.file is not None
    assert done.refused == {("vision", MALFORMED): 3}
    assert len(times) > 100
    assert not all(still[:60])
    stops = [at for at, (was, now) in zip(times[1:], pairwise(still), strict=True) if now and not was]
    begun = times[still.index(False)]
    assert any(stop - begun == pytest.approx(1.0 + BLIND_S, abs=0.6) for stop in stops)
    assert any(not now for at, now in zip(times, still, strict=True) if at > stops[0] + 0.2), "it goes on with vision"
    assert still[-5:] == [True] * 5
    match = read(open_source(done.file.read_bytes(), done.file.name))
    assert match.info.complete
    assert (match.info.home, match.info.away) == ("static", "adversary")
    assert match.referee.filter(event="stop")["note"].to_list()[0] == "vision lost"
    assert len(match.frames) > 60
    scores = match.referee.select("score_home", "score_away")
    assert scores.null_count().row(0) == (scores.height, scores.height), "nobody reported a score"
    assert match.quality["flaw"].to_list() == ["goals unknown"]


def test_stops_without_vision_by_a_clock_that_is_set_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Robots stop soon after vision is lost, also where the computer's clock is set back by an hour then."""
    real, began = time.time_ns, time.monotonic()
    monkeypatch.setattr(time, "time_ns", lambda: real() - 3_600 * 10**9 * (time.monotonic() > began + 1.0))
    done, simulator = driven(tmp_path, [(1.0, "off")], seconds=3.0)
    assert done.blind >= 1
    still = simulator.still()
    assert not all(still)
    assert all(still[-30:])


def test_stops_whatever_ends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error while it drives leaves robots standing, and the log where the next run finds it."""
    calls = 0

    def fails(*_: object) -> None:
        nonlocal calls
        calls += 1
        if calls > 20:
            raise RuntimeError("broken")

    monkeypatch.setattr("pitchlore.pipeline.live.driver.see", fails)
    where: dict[str, int] = {}
    simulator = Simulator(where)
    with simulator.running(), pytest.raises(RuntimeError, match="broken"):
        drive_team(Store(tmp_path), Job("vsss", "blue", STATIC, "static", streams=simulator.streams, seconds=20.0),
                   listening=lambda addresses: where.update(vision=int(addresses["vision"].rpartition(":")[2])))
    assert simulator.still()[-5:] == [True] * 5


def test_stops_when_it_is_ended(tmp_path: Path) -> None:
    """Ctrl-C leaves robots standing, and the log where the next run finds it (other ends: ``test_watch.py``)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        vision = free.getsockname()[1]
    simulator = Simulator({"vision": vision})
    with simulator.running(), subprocess.Popen(
        [*HUNG_UP, SCRIPT, "drive", "--team", "static", "--as", "blue", "--data", tmp_path,
         "--at", f"vision=127.0.0.1:{vision}", "--at", "referee=127.0.0.1:0",
         "--at", f"commands=127.0.0.1:{simulator.port}"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:
        end = time.monotonic() + 60
        while simulator.still().count(False) < 10:
            assert time.monotonic() < end
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=20)
        assert (process.returncode, "Kept in" in out) == (0, True), errors
    assert simulator.still()[-5:] == [True] * 5
    (file,) = (tmp_path / "inbox").iterdir()
    assert read(open_source(file.read_bytes(), file.name)).info.complete


def test_score_at_which_we_came(tmp_path: Path) -> None:
    """The first score that is reported is no goal; one that rises is. Before it nobody knows the score."""
    reported: list[tuple[int, int] | None] = [None] * 20 + [(3, 1)] * 20 + [(4, 1)] * 20
    job = Job("vsss", "blue", STATIC, "static")
    with (tmp_path / "m.mcap").open("wb") as stream:
        driver = Driver(job, PITCHES[Kind.VSSS], stream, "m")

        def arrived(timeout: float) -> list[Packet]:
            if timeout:
                time.sleep(timeout)
                return []
            robots = [(i, 0.4, 0.2 * i - 0.2, 3.1) for i in range(3)]
            data = vsss_messages.environment(1, (0.1, 0.2), robots, robots, goals=reported.pop(0))
            return [Packet(channels("vsss")["vision"], time.time_ns(), data)]

        driver.run(arrived, lambda _: None, lambda: not reported, lambda _: None)
        driver.close()
    match = read(open_source((tmp_path / "m.mcap").read_bytes(), "m.mcap"))
    events = match.referee.select(pl.col("event").cast(pl.String), pl.col("team").cast(pl.String), "score_home", "score_away")
    assert events.rows() == [
        ("play", None, None, None), ("goal", "home", 4, 1), ("play", None, 4, 1), ("stop", None, 4, 1), ("end", None, 4, 1)]
    assert match.referee["note"].to_list()[3] == "ended"
    assert match.quality.is_empty()


def test_ended_before_the_first_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A recording that ends between the first vision and the first frame leaves no log, and says so."""
    monkeypatch.setattr(Driver, "run", lambda *_: None)
    done, simulator = driven(tmp_path, [])
    assert (done.file, done.vision) == (None, True)
    assert simulator.still() == [True] * len(simulator.came)
    assert not list((tmp_path / "playing").iterdir())


@unit
@pytest.mark.parametrize(("attacks", "colour", "first"), [
    (None, "blue", 1), (None, "yellow", 1), ("left", "blue", -1), ("left", "yellow", 1), ("right", "yellow", -1)])
def test_directions(attacks: str | None, colour: str, first: int) -> None:
    """Blue attacks +x unless it is said otherwise, and sides change at half-time."""
    job = Job("vsss", colour, STATIC, "static", attacks=attacks)  # type: ignore[arg-type]
    assert (job.home_attacks(1), job.home_attacks(2)) == (first, -first)


def test_a_peer_sees_and_drives(tmp_path: Path) -> None:
    """The package vsss-client, unmodified, sees our frames and drives our robots."""
    if not PEER.exists():
        pytest.skip("vsss-client is not installed: make counterparts")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        vision = free.getsockname()[1]
    streams = {stream.name: stream for stream in addressed(STREAMS, None, (
        f"vision=127.0.0.1:{vision}", "referee=127.0.0.1:9", "commands=127.0.0.1:0"))}
    peer: list[subprocess.Popen[str]] = []

    def listening(where: str) -> None:
        command = [PEER, ROOT / "tests" / "counterparts" / "vsss_peer.py", str(vision), where.rpartition(":")[2], "1.2"]
        peer.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        assert peer[0].stdout is not None
        assert "ready\n" in iter(peer[0].stdout.readline, ""), "the package does not start"

    how = MatchSettings(referee=RefereeSettings(duration_s=3.0)).of_match()
    done = simulate(Store(tmp_path), Recipe(**how, home=REMOTE, away=STATIC, seed=1), {}, streams, listening=listening)
    out, errors = peer[0].communicate(timeout=20)
    assert peer[0].returncode == 0, errors
    first, last, frames = json.loads(out)
    assert frames > 30
    assert done.commands > 60
    assert first["field"] == [1.5, 1.3]
    assert (len(first["blue"]), first["yellow"]) == (3, 3)
    moved = [math.dist(one[1:], other[1:]) for one, other in zip(first["blue"], last["blue"], strict=True)]
    assert max(moved) > 0.2
    assert Store(tmp_path).receipt("matches", done.match_id) is not None


def test_served(tmp_path: Path) -> None:
    """Others are told that the ball is in play before the first frame in which it is, and each frame has its number."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ears:  # for both streams: packets keep their order
        ears.bind(("127.0.0.1", 0))
        ears.settimeout(0.3)
        here = f"127.0.0.1:{ears.getsockname()[1]}"
        streams = {stream.name: stream for stream in addressed(STREAMS, None, (
            f"vision={here}", f"referee={here}", "commands=127.0.0.1:0"))}
        how = MatchSettings(referee=RefereeSettings(duration_s=1.2)).of_match()
        done = simulate(Store(tmp_path), Recipe(**how, home=STATIC, away=REMOTE, seed=1), {}, streams,
                        listening=lambda where: malformed(int(where.rpartition(":")[2])))
        assert (done.commands, done.others) == (0, 3)
        came: list[bytes] = []
        with suppress(TimeoutError):
            while True:
                came.append(ears.recv(4096))
    steps, on = [], []
    for data in came:
        frames = vsss.environments(*laid_out([Packet(VISION, T0, data)])).frames
        referee = RefereeState("vsss")
        if len(frames):
            steps.append(int(frames[0, vsss.STEP]))
        else:
            referee.hear([Packet(REFEREE, T0, data)])
            on += [len(steps)] * referee.playing
    assert steps == list(range(steps[0], steps[0] + done.frames))
    assert on[0] == 0  # a kick-off is play
    assert len(on) == 2  # and it is said each second


def test_served_in_a_flood(tmp_path: Path) -> None:
    """A match that is served goes on in a flood of broken packets, which are counted."""
    streams = {stream.name: stream for stream in addressed(STREAMS, None, (
        "vision=127.0.0.1:9", "referee=127.0.0.1:9", "commands=127.0.0.1:0"))}
    how = MatchSettings(referee=RefereeSettings(duration_s=1.2)).of_match()
    done = simulate(Store(tmp_path), Recipe(**how, home=STATIC, away=REMOTE, seed=1), {}, streams, listening=lambda where: (
        Thread(target=malformed, args=(int(where.rpartition(":")[2]), 20_000)).start()))
    assert (done.frames, done.commands) == (72, 0)
    assert done.others > 1_000
    assert Store(tmp_path).receipt("matches", done.match_id) is not None


def test_served_again(tmp_path: Path, call: Call) -> None:
    """A recipe holds no other program's play: a second match of the same teams has the next seed."""
    found = []
    for _ in range(2):
        code, out, err = call(
            "record", "--home", "static", "--away", "remote", "--serve", "vsss", "--minutes", "0.01", "--seed", "7", "--at",
            "vision=127.0.0.1:9", "--at", "referee=127.0.0.1:9", "--at", "commands=127.0.0.1:0", "--data", tmp_path, "--json")
        assert code == 0, err
        found.append(json.loads(out)["match_id"])
    receipts = list(Store(tmp_path).receipts("matches"))
    assert sorted(receipt.name for receipt in receipts) == sorted(found)
    assert sorted(receipt.settings["seed"] for receipt in receipts) == [7, 8]


@contextmanager
def namespace() -> Iterator[list[str]]:
    """Words that run a command in a network of its own, in which loopback carries multicast."""
    enter = ["unshare", "--user", "--map-root-user", "--net"]
    ready = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo"
    try:
        done = subprocess.run([*enter, "sh", "-c", ready], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip("there is no unshare here, which makes a network namespace")
    if done.returncode:
        pytest.skip(f"no network namespace with multicast can be made here ({done.stderr.strip()})")
    yield [*enter, "sh", "-c", f"{ready} && exec \"$@\"", "sh"]


TWO = """
pitchlore="$1"; cd "$2"
"$pitchlore" drive --team static --as blue --interface 127.0.0.1 --data blue --json > blue.json 2> blue.said &
"$pitchlore" drive --team pressing --as yellow --interface 127.0.0.1 --data yellow --json > yellow.json 2> yellow.said &
"$pitchlore" watch vsss --interface 127.0.0.1 --data watch --json > watch.json 2> watch.said &
until [ "$(cat *.said | grep -c Listening)" = 3 ] || [ $((tries = tries + 1)) -gt 600 ]; do sleep 0.1; done
"$pitchlore" record --home remote --away remote --serve vsss --minutes 0.05 --interface 127.0.0.1 --data sim \\
    --json > sim.json
pkill -INT -P $$ -f "(drive|watch) " ; wait
"""


def test_two_of_our_teams(tmp_path: Path) -> None:
    """A match between two driving processes, over the league's own groups, is as any other, and can be watched."""
    with namespace() as inside:
        done = subprocess.run([*inside, "sh", "-c", TWO, "sh", SCRIPT, tmp_path],
                              capture_output=True, text=True, check=False, timeout=120)
    sim, blue, yellow, watch = (
        json.loads((tmp_path / f"{name}.json").read_text()) for name in ("sim", "blue", "yellow", "watch"))
    assert sim["frames"] == 180, done.stderr
    assert sim["commands"] > 120
    match = Store(tmp_path / "sim").receipt("matches", sim["match_id"])
    assert match is not None
    assert match.details["complete"]
    for driver in (blue, yellow):
        assert driver["frames"] > 60
        assert driver["score"] == list(sim["score"])
    assert watch["packets"] >= sim["frames"]
    assert (watch["frames_lost"], watch["refused"]) == (0, [])


@pytest.mark.parametrize(("words", "said"), [
    (["record", "--serve", "vsss", "--matches", "2"], "--matches 2: only one match is served. Leave it out."),
    (["record", "--home", "remote"], "remote: another program drives this team. Use `pitchlore record --serve vsss`."),
    (["drive", "--team", "static", "--as", "blue", "--at", "eyes=1"], "--at eyes=1 names no stream and address"),
    (["drive", "--team", "static", "--as", "blue", "--at", "commands=no.such.invalid:5"], "'no.such.invalid' is no address. Name an IPv4"),
    (["watch", "ssl", "--group", ""], "pitchlore: '' is no address. Name an IPv4"),
    (["watch", "ssl", "--interface", "eth0"], "--interface: 'eth0' is no address of a network card. Name an IPv4 address"),
    (["record", "--serve", "vsss", "--interface", "x", "--at", "commands=127.0.0.1:0"], "--interface: 'x' is no address of a network card."),
    (["record", "--serve", "vsss", "--interface", "203.0.113.7", "--at", "commands=localhost:0"], "is no address of a network card."),
])
def test_refusals(words: list[str], said: str, tmp_path: Path, call: Call) -> None:
    code, _, err = call(*words, "--data", tmp_path)
    assert (code, said in err) == (1, True)


def test_packets_that_are_not_sent_are_told(caplog: pytest.LogCaptureFixture) -> None:
    """Packets that the system does not take, as without a network, are told at the end, with the reason."""
    with Sender() as sender:
        for _ in range(2):
            sender.send(Stream("vision", 1, "255.255.255.255", 9), b"x")
    assert "2 packets were not sent, the last to 255.255.255.255:9 (Permission denied)." in caplog.text


def test_no_vision(tmp_path: Path, call: Call) -> None:
    code, out, _ = call(
        "drive", "--team", "static", "--as", "yellow", "--at", "vision=127.0.0.1:0", "--at", "referee=127.0.0.1:0",
        "--at", "commands=127.0.0.1:9", "--seconds", "0.3", "--data", tmp_path)
    assert (code, "No vision came: is the simulator running" in out) == (1, True)
