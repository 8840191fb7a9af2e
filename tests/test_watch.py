"""The match that is being played is recorded as its packets arrive, whatever else arrives."""

import json
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from threading import Event, Thread

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import ssl_games
from support.recordings import same_frames
from support.ssl_messages import integer, log
from support.terminal import HUNG_UP, SCRIPT
from test_packets import REFEREE, T0, VISION, imported, listed, of_log, vsss_packets

from pitchlore.flows.commands.addresses import addressed
from pitchlore.pipeline.base.errors import BadSettings, StorageFailed
from pitchlore.pipeline.engine.recordings import WATCHING, inbox, useless
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LEAGUES, ON_DEMAND, OPTIONS, LeagueName
from pitchlore.pipeline.live.screening import FLOOD, LARGE, MALFORMED, SECOND, Screen
from pitchlore.pipeline.live.sockets import Received, Receiver
from pitchlore.pipeline.live.status import Status
from pitchlore.pipeline.sessions import watching
from pitchlore.pipeline.sessions.watching import Watched, watch
from pitchlore.pipeline.store import Store

HERE, THERE = ("10.0.0.1", 5000), ("10.0.0.2", 5000)
#: Unicast loopback, on ports that are free.
LOOPBACK = {league: tuple(stream._replace(group="127.0.0.1", port=0) for stream in (*streams, *ON_DEMAND[league]))
            for league, streams in LEAGUES.items()}

Send = Callable[[int, bytes], None]
Call = Callable[..., tuple[int, str, str]]


def watched(
    monkeypatch: pytest.MonkeyPatch, data: Path, league: LeagueName, send: Callable[[Sequence[Send]], None],
) -> Watched:
    """Watch while a thread sends, and 0.3 s more; ``send`` gets three senders."""
    threads: list[Thread] = []
    over = Event()
    monkeypatch.setattr(watching, "until_stopped", lambda: nullcontext(over.is_set))

    def listening(addresses: dict[str, str]) -> None:
        ports = {stream.channel: int(addresses[stream.name].rpartition(":")[2]) for stream in LOOPBACK[league]}

        def go() -> None:
            with ExitStack() as mouths:
                send([mouths.enter_context(mouth(ports)) for _ in range(3)])
            time.sleep(0.3)
            over.set()

        threads.append(Thread(target=go))
        threads[0].start()

    done = watch(Store(data), league, LOOPBACK[league], seconds=30.0, listening=listening)
    threads[0].join()
    return done


@contextmanager
def mouth(ports: Mapping[int, int]) -> Iterator[Send]:
    """A sender with a port of its own: sends content to a stream, by its channel."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        yield lambda channel, content: sender.sendto(content, ("127.0.0.1", ports[channel])) and None


def paced(send: Send, packets: Sequence[Packet], a_second: float) -> None:
    """Send packets at a pace, as far as this computer keeps it."""
    began = time.monotonic()
    for number, packet in enumerate(packets):
        time.sleep(max(0.0, began + number / a_second - time.monotonic()))
        send(packet.channel, packet.data)


def test_live_is_as_from_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same SSL traffic gives the same match, received over the network or imported from the league's log."""
    gc = ssl_games.Referee()
    messages = ssl_games.ordered(
        ssl_games.frames(400), [gc.says(0, command=1), gc.says(40, command=2, stage=1), gc.says(300, command=1)])
    done = watched(monkeypatch, tmp_path, "ssl", lambda senders: paced(senders[0], of_log(messages), 500.0))
    assert done.file is not None
    assert (done.packets, done.frames_lost, done.refused) == (len(messages), 0, {})
    live, logged = imported(done.file.read_bytes()), ssl_games.match(log(messages))
    assert same_frames(live.frames, logged.frames)
    assert live.referee.drop("match_id").equals(logged.referee.drop("match_id"))
    assert live.info.complete


def test_whatever_else_arrives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Broken packets, another league's, large ones, a second sender and a flood neither stop nor fill it."""
    packets = [packet for packet in vsss_packets(3.0) if packet.channel == VISION]
    other = ssl_games.frames(1)[0].content

    def send(senders: Sequence[Send]) -> None:
        good, bad, second = senders
        for number, packet in enumerate(packets):
            good(packet.channel, packet.data)
            if number % 30 == 10:
                bad(VISION, b"\xff" * 20)
                bad(VISION, other)
                bad(REFEREE, b"")
                bad(VISION, b"x" * 60_000)
                second(packet.channel, packet.data)
            time.sleep(0.005)
        for _ in range(10_000):
            bad(VISION, b"\xff" * 100)
        for packet in packets:
            good(packet.channel, packet.data)
            time.sleep(0.005)

    done = watched(monkeypatch, tmp_path, "vsss", send)
    assert done.file is not None
    assert done.packets >= 1.5 * len(packets)  # the system may drop some in the flood
    assert done.refused["vision", LARGE] == 6
    assert done.refused["vision", SECOND] == 6
    assert done.refused["referee", MALFORMED] == 6
    assert done.refused["vision", MALFORMED] > 12
    assert done.refused["vision", FLOOD] > 1_000
    kept, _ = listed(done.file.read_bytes())
    assert {packet.data for packet in kept} <= {packet.data for packet in packets}
    assert done.file.stat().st_size < 200_000


def test_a_team_tells_its_options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Options that a team sends are in the match; broken and forged ones, and a flood, are counted and change nothing."""
    packets = [packet for packet in vsss_packets(2.0) if packet.channel == VISION]
    bad = (b"", b"[" * 30_000, b"\xff", b'{"team": "blue", "robot": 1, "option": 7}', b'{"team": "red", "robot": 1, "option": 44}',
           b'{"team": "blue", "robot": 1, "option": 4' + b"4" * 5_000 + b"}", b'{"team": "blue", "robot": "1", "option": 44}')

    def tell(send: Send, team: str, robot: int, option: int | None) -> None:
        send(OPTIONS.channel, json.dumps({"team": team, "robot": robot, "option": option}).encode())

    def send(senders: Sequence[Send]) -> None:
        good, blue, forger = senders
        for number, packet in enumerate(packets):
            if number % 30 == 10:
                tell(blue, "blue", 1, (44, 46, None, 184)[number // 30])
            if number == 40:
                for content in bad:
                    forger(OPTIONS.channel, content)
                tell(forger, "blue", 1, 1)
                tell(forger, "yellow", 2, 98)
            good(packet.channel, packet.data)
            time.sleep(0.01)
        for _ in range(5_000):
            forger(OPTIONS.channel, b"[" * 1_000)

    done = watched(monkeypatch, tmp_path, "vsss", send)
    assert done.file is not None
    assert (done.packets, done.options) == (len(packets), 5)
    assert done.refused["options", SECOND] == 1
    assert done.refused["options", MALFORMED] >= len(bad)
    match = imported(done.file.read_bytes())
    found = {team: [row["option"] for row in match.options if row["team"] == team and row["robot"] == 2 - (team == 0)]
             for team in (0, 1)}
    assert found == {0: [44, 46, 0, 184], 1: [98]}
    assert len(match.options) == 5
    assert match.info.home == "blue"
    status = Status("vsss")
    status.see([Packet(OPTIONS.channel, T0, b"")])
    assert (status.line(T0, 0), status.packets) == ("0 frames/s, 0 lost, 1 options", 0)


def received(packets: Sequence[Packet], sender: tuple[str, int] = HERE) -> list[Received]:
    return [Received(packet, sender) for packet in packets]


def counted(screen: Screen) -> dict[str, int]:
    """Refused packets by reason."""
    return {why: count for (_, why), count in screen.refused.items()}


@pytest.mark.unit
@pytest.mark.parametrize("league", list(LEAGUES))
def test_every_stream_refuses_the_others(league: LeagueName) -> None:
    """A packet is of one stream only; geometry and frames pass as vision."""
    gc = ssl_games.Referee()
    ssl = of_log([*ssl_games.frames(2), gc.says(0, command=1)])
    vsss = vsss_packets(0.5)
    mine, others = (ssl, vsss) if league == "ssl" else (vsss, ssl)
    assert Screen(league).sound(received(mine)) == mine
    for stream in LEAGUES[league]:
        strange = [packet._replace(channel=stream.channel) for packet in others]
        screen = Screen(league)
        assert screen.sound(received(strange)) == [], stream
        assert counted(screen) == {MALFORMED: len(strange)}


@pytest.mark.unit
def test_a_second_sender_is_heard_when_the_first_is_silent() -> None:
    """One computer may send for each camera; two that send the same camera are a match and its replay."""
    screen = Screen("ssl")

    def camera(number: int, t: float, sender: tuple[str, int]) -> int:
        content = ssl_games.seen(1, camera=number).content
        return len(screen.sound(received([Packet(4, T0 + round(t * 1e9), content)], sender)))

    assert camera(0, 0.0, HERE) == 1
    assert camera(1, 0.1, THERE) == 1
    assert camera(0, 0.2, THERE) == 0
    assert camera(0, 0.9, THERE) == 0
    assert camera(0, 1.1, THERE) == 1
    assert camera(0, 1.2, HERE) == 0
    assert counted(screen) == {SECOND: 3}
    assert camera(0, -3_600.0, HERE) == 1, "the clock was set back"


@pytest.mark.unit
def test_a_flood_of_senders_is_forgotten() -> None:
    """However many senders there are, memory does not grow, and after a second there is room for others."""
    screen, packet = Screen("vsss"), vsss_packets(0.1)[-1]
    for number in range(2_000):
        screen.sound(received([packet._replace(t_ns=T0 + number)], (f"10.0.{number // 250}.{number % 250}", 1)))
    assert len(screen._rates) <= 256
    assert counted(screen)[FLOOD] > 1_000
    assert screen.sound(received([packet._replace(t_ns=T0 + 2 * 10**9)], ("10.9.9.9", 1)))
    for number in range(2_000):
        screen.sound(received([packet._replace(t_ns=T0 + 2 * 10**9 + number)], (f"10.1.{number // 250}.{number % 250}", 1)))
    assert screen.sound(received([packet], ("10.9.9.9", 2))), "the clock was set back"


@pytest.mark.unit
def test_status() -> None:
    """The line has frames, losses, score and clock, as the packets say."""
    gc = ssl_games.Referee()
    status = Status("ssl")
    assert status.line(T0, 0) == "0 frames/s, 0 lost"
    status.see(of_log([*ssl_games.frames(20), *ssl_games.frames(30, first=25)]))
    status.see(of_log([gc.says(40, command=2, stage=1, blue=gc.blue._replace(score=3))]))
    now = ssl_games.ns(30 / 64)
    assert status.line(now, 7) == (
        "50 frames/s, 5 lost, 7 refused, Yellows 0 : 3 Blues, normal first half, normal start, 0:00 left")
    assert status.line(now - 3_600 * 10**9, 0).startswith("0 frames/s"), "the clock was set back"
    status = Status("vsss")
    status.see([packet for packet in vsss_packets(11.0) if packet.data])
    assert status.line(T0 + 11 * 10**9, 0) == "60 frames/s, 0 lost, blue 1 : 0 yellow, gameon, half 1, 0:10"


@pytest.mark.unit
def test_time_left() -> None:
    """The game controller's time left is in microseconds and may be negative."""
    gc = ssl_games.Referee()
    packet = of_log([gc.says(0, command=1)])[0]
    for left, said in ((65_000_000, "1:05 left"), (-5_000_000, "-0:05 left")):
        zigzag = (left << 1) ^ (left >> 63)
        status = Status("ssl")
        status.see([packet._replace(data=packet.data + integer(3, zigzag))])
        assert status.line(packet.t_ns, 0).endswith(said)


def in_a_process(data: Path, *options: str, begin: Sequence[str] = HUNG_UP) -> subprocess.Popen[str]:
    """The command in a process of its own, listening on loopback."""
    ports = [option for stream in LEAGUES["vsss"] for option in ("--at", f"{stream.name}=127.0.0.1:0")]
    return subprocess.Popen([*begin, SCRIPT, "watch", "vsss", *ports, "--data", str(data), *options],
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def send_to(process: subprocess.Popen[str], packets: Sequence[Packet]) -> None:
    """Send packets to where a process says that it listens, at 60 Hz."""
    assert process.stderr is not None
    words = process.stderr.readline().split()
    ports = {VISION: int(words[4].rstrip(",").rpartition(":")[2]), REFEREE: int(words[7].rpartition(":")[2])}
    with mouth(ports) as send:
        paced(send, packets, 60.0)


def test_killed(tmp_path: Path, call: Call) -> None:
    """After kill -9 all but the last second is there, and the next run takes it."""
    process = in_a_process(tmp_path)
    packets = vsss_packets(2.0)
    send_to(process, packets)
    process.kill()
    process.communicate()
    (left,) = (tmp_path / WATCHING).iterdir()
    found, reasons = listed(left.read_bytes())
    assert len(packets) - len(found) <= 60
    assert reasons
    store = Store(tmp_path)
    assert [recording.file.parent.name for recording in inbox(store)] == ["inbox"]
    assert not left.exists()
    assert call("import", *(tmp_path / "inbox").iterdir(), "--data", tmp_path)[0] == 0
    (match,) = store.receipts("matches")
    assert not match.details["complete"]
    assert match.details["frames"] >= 60


def ended(process: subprocess.Popen[str], how: signal.Signals, data: Path) -> list[bytes]:
    """Packets in the recording, which has to be whole, of a process that a signal ends."""
    time.sleep(0.3)
    process.send_signal(how)
    out, _ = process.communicate(timeout=30)
    assert (process.returncode, "Kept in" in out) == (0, True)
    (kept,) = (data / "inbox").iterdir()
    found, reasons = listed(kept.read_bytes())
    assert reasons == []
    return [packet.data for packet in found]


def test_stopped(tmp_path: Path) -> None:
    """A closed terminal is a way to end it, and nothing is lost (so is Ctrl-C: ``test_showing.py``)."""
    process, sent = in_a_process(tmp_path), vsss_packets(1.0)
    send_to(process, sent)
    assert ended(process, signal.SIGHUP, tmp_path) == [packet.data for packet in sent]


def test_outlives_its_terminal(tmp_path: Path) -> None:
    """A command under `nohup` does not end when the terminal is closed, but does at SIGTERM, and nothing is lost."""
    process, sent = in_a_process(tmp_path, begin=("nohup",)), vsss_packets(0.5)
    send_to(process, sent)
    process.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    assert process.poll() is None
    assert ended(process, signal.SIGTERM, tmp_path) == [packet.data for packet in sent]


def test_a_recording_in_progress_is_left_alone(tmp_path: Path) -> None:
    """A run beside a watch takes nothing of it; what was killed before anything came is removed."""
    store = Store(tmp_path)
    with store.growing(WATCHING, "ssl-1.mcap") as (path, _):
        assert inbox(store) == []
        assert useless(store) == []
        assert path.exists()
    assert useless(store) == [path]
    assert not path.exists()


def test_nothing_comes(tmp_path: Path, call: Call) -> None:
    """Without a packet there is no recording, and the command says where it listened."""
    words = ("watch", "vsss", "--group", "127.0.0.1", "--at", "vision=127.0.0.1:0", "--at", "referee=127.0.0.1:0",
             "--seconds", "0.2", "--data", tmp_path)
    code, out, _ = call(*words)
    assert code == 1
    assert "No packet came to 127.0.0.1:0, 127.0.0.1:0. Is this computer" in out
    assert json.loads(call(*words, "--json")[1]) == {
        "file": None, "packets": 0, "options": 0, "frames_lost": 0, "seconds": pytest.approx(0.2, abs=0.2), "refused": []}
    assert list((tmp_path / WATCHING).iterdir()) == []
    assert not (tmp_path / "inbox").exists()


@pytest.mark.unit
@pytest.mark.parametrize("word", ["vision", "vision=127.0.0.1", "eyes=127.0.0.1:1", "vision=127.0.0.1:x", "vision=127.0.0.1:70000"])
def test_addresses_that_are_none(word: str) -> None:
    with pytest.raises(BadSettings, match=r"names no stream and address\. Write STREAM=ADDRESS:PORT; the streams are vision, referee"):
        addressed(LEAGUES["vsss"], None, (word,))


@pytest.mark.unit
def test_addresses() -> None:
    """The group is of all streams, and one stream may have another."""
    found = {stream.name: (stream.group, stream.port) for stream in addressed(LEAGUES["ssl"], "224.9.9.9", ("tracker=10.0.0.1:77",))}
    assert found == {"vision": ("224.9.9.9", 10006), "vision-2010": ("224.9.9.9", 10005), "tracker": ("10.0.0.1", 77),
                     "referee": ("224.9.9.9", 10003)}
    asked, *_ = addressed(LEAGUES["vsss"], None, ("options=127.0.0.1:7",), ON_DEMAND["vsss"])[::-1]
    assert asked == OPTIONS._replace(port=7)
    assert OPTIONS.name not in {stream.name for stream in addressed(LEAGUES["vsss"], None, (), ON_DEMAND["vsss"])}


@pytest.mark.unit
@pytest.mark.parametrize(("group", "said"), [
    ("203.0.113.7", "203.0.113.7:0: cannot be listened to (Cannot assign requested address). Name an address"),
    ("nowhere", "nowhere:0: cannot be listened to"),
])
def test_what_cannot_be_listened_to(group: str, said: str) -> None:
    streams = tuple(stream._replace(group=group, port=0) for stream in LEAGUES["vsss"])
    with pytest.raises(BadSettings) as refused:
        Receiver(streams)
    assert str(refused.value).startswith(said)


@pytest.mark.unit
def test_a_port_that_another_program_has() -> None:
    with Receiver(LOOPBACK["vsss"]) as receiver:
        port = int(receiver.addresses["vision"].rpartition(":")[2])
        taken = tuple(stream._replace(port=port) for stream in LOOPBACK["vsss"][:1])
        with pytest.raises(StorageFailed, match=rf"^127\.0\.0\.1:{port}: another program listens to it\."):
            Receiver(taken)


@pytest.mark.unit
@pytest.mark.parametrize("league", list(LEAGUES))
@given(contents=st.lists(st.binary(max_size=200), max_size=12), channel=st.integers(0, 3))
def test_no_bytes_break_it(league: LeagueName, contents: list[bytes], channel: int) -> None:
    """Whatever bytes come, they are recorded or counted, and the status can tell what it heard."""
    stream = LOOPBACK[league][channel % len(LOOPBACK[league])]
    screen, status = Screen(league), Status(league)
    packets = screen.sound(received([Packet(stream.channel, T0 + i, data) for i, data in enumerate(contents)]))
    status.see(packets)
    status.line(T0, 0)
    assert len(packets) + sum(screen.refused.values()) == len(contents)
