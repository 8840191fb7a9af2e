"""Recordings of packets: written as they come, read whole or damaged, and imported as matches."""

import io
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from support import vsss_messages
from support.ssl_messages import Message

from pitchlore.pipeline.base.errors import BadRecording, DamagedLog
from pitchlore.pipeline.importers.packets.recorder import Packet, PacketRecorder
from pitchlore.pipeline.importers.packets.recording import PacketRecording, is_recording
from pitchlore.pipeline.importers.packets.streams import LEAGUES, LeagueName
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.tracking.mapping import load_map
from pitchlore.pipeline.matches.frame import MatchLog

T0 = 1_750_000_000_000_000_000
VISION, REFEREE = (stream.channel for stream in LEAGUES["vsss"])
pytestmark = pytest.mark.unit


def recorded(league: LeagueName, packets: list[Packet], *, close: bool = True, at_once: int = 50) -> bytes:
    """A recording, handed over after every so many packets."""
    stream = io.BytesIO()
    recorder = PacketRecorder(stream, league)
    for first in range(0, len(packets), at_once):
        recorder.record(packets[first:first + at_once])
        recorder.flush()
    if close:
        recorder.close()
    return stream.getvalue()


def of_log(messages: list[Message]) -> list[Packet]:
    """An SSL log's messages as packets."""
    return [Packet(message.kind, message.received, message.content) for message in messages]


def listed(data: bytes) -> tuple[list[Packet], list[str]]:
    """Packets of a recording, and why it is not whole."""
    recording = PacketRecording(data, "x.mcap")
    found = [Packet(channel, t_ns, packets.data[start:end].tobytes()) for packets in recording.packets()
             for channel, t_ns, start, end in zip(*(column.tolist() for column in packets[1:]), strict=True)]
    return found, recording.reasons()


def vsss_packets(seconds: float = 20.0, *, goals: bool = True) -> list[Packet]:
    """A match at 60 Hz: the ball rolls into yellow's goal at 10 s, and the referee calls the kick-off."""
    found = []
    for step in range(round(60 * seconds)):
        t, t_ns = step / 60, T0 + round(step * 1e9 / 60)
        scored = t >= 10
        x = min(0.08 * t, 0.79) if not scored else 0.0
        yellow = [(i, 0.4, 0.2 * i - 0.2, math.pi) for i in range(3)]
        blue = [(i, -0.4 + 0.01 * t, 0.2 * i - 0.2, 0.1 * math.sin(t)) for i in range(3)]
        score = (int(scored), 0) if goals else None
        said = {0: (vsss_messages.KICKOFF, vsss_messages.BLUE), 20: (vsss_messages.GAME_ON, vsss_messages.NEITHER),
                600: (vsss_messages.KICKOFF, vsss_messages.YELLOW), 640: (vsss_messages.GAME_ON, vsss_messages.NEITHER)}
        if step in said:
            found.append(Packet(REFEREE, t_ns, vsss_messages.command(*said[step], clock=t)))
        found.append(Packet(VISION, t_ns, vsss_messages.environment(step, (x, 0.0), yellow, blue, goals=score)))
    return found


def imported(data: bytes, mapping: str = "") -> MatchLog:
    return read(open_source(data, "hall.mcap"), load_map(mapping))


packets_of_ssl = st.lists(st.builds(
    Packet, st.sampled_from([stream.channel for stream in LEAGUES["ssl"]]), st.integers(0, 2**62), st.binary(max_size=300),
), max_size=40)


@given(packets_of_ssl, st.integers(1, 40))
def test_what_is_recorded_is_read(packets: list[Packet], at_once: int) -> None:
    found, reasons = listed(recorded("ssl", packets, at_once=at_once))
    assert (found, reasons) == (packets, [])


@given(packets_of_ssl, st.integers(1, 10), st.data())
def test_a_killed_recording_keeps_what_was_handed_over(packets: list[Packet], at_once: int, drawn: st.DataObject) -> None:
    """Cut anywhere, a recording is read as far as it is there, and says that it is cut."""
    data = recorded("ssl", packets, at_once=at_once, close=False)
    found, reasons = listed(data)
    assert found == packets
    assert any("cut off" in reason for reason in reasons)
    begun = len(recorded("ssl", [], close=False))
    less, reasons = listed(data[:drawn.draw(st.integers(begun, len(data)))])
    assert less == packets[:len(less)]
    assert reasons


def test_any_reader_of_mcap_reads_it() -> None:
    packets = vsss_packets(1.0)
    reported = [(channel.topic, message.log_time, message.data) for _, channel, message in
            make_reader(io.BytesIO(recorded("vsss", packets))).iter_messages(log_time_order=False)]
    topics = {VISION: "/vsss/vision", REFEREE: "/vsss/referee"}
    assert reported == [(topics[packet.channel], packet.t_ns, packet.data) for packet in packets]


def test_a_recording_is_no_log_of_ours() -> None:
    data = recorded("ssl", [])
    assert is_recording(data)
    assert open_source(data, "x.mcap").format == "packets"
    with pytest.raises(DamagedLog, match=r"x\.mcap: does not say which league's packets it has"):
        PacketRecording(data.replace(b"ssl", b"xxx"), "x.mcap")


def test_vsss() -> None:
    """Bodies, pitch, score and the referee's words come out as they were sent."""
    match = imported(recorded("vsss", vsss_packets()))
    assert (match.info.format, match.info.home, match.info.away) == ("vsss-packets", "blue", "yellow")
    assert (match.info.pitch.length, match.info.pitch.width, match.info.pitch.goal_width) == (1.5, 1.3, 0.4)
    assert match.info.started_at is not None
    assert match.info.started_at.timestamp() == pytest.approx(T0 / 1e9)
    assert match.info.complete
    assert len(match.frames) == 1200
    np.testing.assert_allclose(match.frames.t_ns, np.round(np.arange(1200) * 1e9 / 60), atol=200)
    np.testing.assert_allclose(match.frames.ball["x"][:590], 0.08 * np.arange(590) / 60, atol=1e-6)
    robot = match.frames.robots[:6]
    assert robot["team"].tolist() == [0, 0, 0, 1, 1, 1]
    assert robot["id"].tolist() == [0, 1, 2, 0, 1, 2]
    np.testing.assert_allclose(robot["x"], [-0.4] * 3 + [0.4] * 3, atol=1e-6)
    np.testing.assert_allclose(np.abs(robot["theta"][3:]), math.pi, atol=1e-6)
    reported = match.referee.select("event", "team", "score_home", "score_away").rows()
    assert reported == [("kick-off", "home", 0, 0), ("goal", "home", 1, 0), ("kick-off", "away", 1, 0)]


@pytest.mark.parametrize("size", [(1e6, 1.5, 0.4, 0.1), (1.3, 0.01, 0.4, 0.1), (1.3, 1.5, 1e-3, 0.1), (1.3, 1.5, 0.4, math.inf)])
def test_vsss_size_that_none_has(size: tuple[float, float, float, float]) -> None:
    """A packet whose pitch cannot be tells none: that of the others stands."""
    packets = vsss_packets(2.0)
    packets.append(Packet(VISION, packets[-1].t_ns + 1, vsss_messages.environment(120, size=size)))
    match = imported(recorded("vsss", packets))
    assert (match.info.pitch.length, match.info.pitch.width, match.info.pitch.goal_depth) == (1.5, 1.3, 0.1)


@pytest.mark.parametrize("teams", ['home = "yellow"\naway = "blue"', 'home = "yellow"', 'away = "blue"'])
def test_vsss_by_a_map(teams: str) -> None:
    """A map says who is home: bodies, score and goals are then as it says."""
    match = imported(recorded("vsss", vsss_packets()), f"[teams]\n{teams}\n")
    assert (match.info.home, match.info.away) == ("yellow", "blue")
    assert match.frames.robots["x"][0] > 0
    (goal,) = match.referee.filter(event="goal").select("team", "score_home", "score_away").rows()
    assert goal == ("away", 0, 1)


def test_vsss_teams_by_their_names() -> None:
    """A map gives colours the names of teams, so that knowledge is of teams; a colour that is none is named."""
    match = imported(recorded("vsss", vsss_packets(2.0)), '[teams.names]\nblue = "Us"\nyellow = "Rivals"\ngreen = "?"\n')
    assert (match.info.home, match.info.away) == ("Us", "Rivals")
    assert match.quality.filter(flaw="unmatched map")["note"].to_list() == [
        "words of the map that are nowhere in the table: [teams.names] green"]


@pytest.mark.parametrize(("goals", "channels", "by"), [
    (False, {VISION, REFEREE}, "kick-off"), (True, {VISION}, "score"), (False, {VISION}, "ball")])
def test_vsss_goals(goals: bool, channels: set[int], by: str) -> None:
    """Goals are those of the score, else the next kick-off tells them; of FIRASim alone, which sends neither, the ball."""
    packets = [packet for packet in vsss_packets(goals=goals) if packet.channel in channels]
    match = imported(recorded("vsss", packets))
    assert match.referee.filter(event="goal")["team"].to_list() == ["home"]
    assert match.info.settings["goals"]["from"] == by  # type: ignore[index]


def test_vsss_commands_at_one_time() -> None:
    """None of several commands between two frames is lost; what holds is said again without an event."""
    packets = [packet for packet in vsss_packets(4.0) if packet.channel == VISION]
    for at, *fouls in ((30, vsss_messages.GAME_ON), (90, vsss_messages.KICKOFF, vsss_messages.STOP), (100, vsss_messages.STOP),
                       (150, vsss_messages.GAME_ON), (200, vsss_messages.GAME_ON)):
        packets += [Packet(REFEREE, packets[at].t_ns - 5 + i, vsss_messages.command(foul, vsss_messages.YELLOW))
                    for i, foul in enumerate(fouls)]
    packets.sort(key=lambda packet: packet.t_ns)
    match = imported(recorded("vsss", packets))
    reported = [(round(t_ns * 60 / 1e9), event) for t_ns, event in match.referee.select("t_ns", "event").rows()]
    assert reported == [(30, "play"), (90, "kick-off"), (90, "stop"), (150, "play")]


def test_vsss_second_half() -> None:
    packets = vsss_packets(4.0)
    packets.insert(120, Packet(REFEREE, packets[120].t_ns, vsss_messages.command(vsss_messages.KICKOFF, vsss_messages.BLUE, half=2)))
    assert "half" in imported(recorded("vsss", packets)).referee["event"].to_list()


def test_vsss_broken_packets_are_counted() -> None:
    """Packets that cannot be decoded are left out; a ball that is nowhere is absent."""
    packets = vsss_packets(2.0)
    packets[40] = Packet(VISION, packets[40].t_ns, b"\xff\xff")
    packets[60] = Packet(REFEREE, packets[60].t_ns, b"\x08\x63")
    lost = vsss_messages.environment(70, (math.nan, 0.0), [(0, 0.4, 0.0, 0.0)])
    packets[70] = Packet(VISION, packets[70].t_ns, lost)
    match = imported(recorded("vsss", packets))
    assert len(match.frames) == 118
    assert np.isnan(match.frames.ball["x"]).sum() == 1
    assert match.quality.filter(flaw="skipped")["count"].to_list()[0] == 2


@pytest.mark.parametrize(("league", "packets"), [
    ("vsss", [Packet(REFEREE, T0, vsss_messages.command(vsss_messages.STOP))]), ("vsss", []), ("ssl", [])])
def test_nothing_to_see(league: LeagueName, packets: list[Packet]) -> None:
    with pytest.raises(BadRecording, match=r"^hall\.mcap: has no (frame|vision)"):
        imported(recorded(league, packets))


def test_a_damaged_recording_is_salvaged_and_says_so() -> None:
    """A chunk of a second that is broken costs that second."""
    data = bytearray(recorded("vsss", vsss_packets(), at_once=60))
    place = data.index(b"\x28\xb5\x2f\xfd", len(data) // 2)  # where zstd's content begins
    data[place + 40] ^= 0xFF
    match = imported(bytes(data))
    assert 1_080 <= len(match.frames) < 1_200
    assert not match.info.complete
    (damage,) = match.quality.filter(flaw="damaged chunk").rows(named=True)
    assert 5e9 < damage["start_ns"] < damage["end_ns"] < 20e9
    assert match.quality.filter(flaw="truncated").is_empty()
