"""Reading and writing a match of eight minutes: ours, mcap's, and what zstd alone takes."""

import io

import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from mcap_ros2._dynamic import serialize_dynamic
from mcap_ros2.decoder import DecoderFactory

from pipeline import matches
from pipeline.channels import FRAME, TOPICS
from pipeline.frame import BALL_DTYPE, ROBOT_DTYPE, Frames, MatchInfo, MatchLog
from pipeline.pitch import PITCHES, Kind

FRAMES, ROBOTS = 28_800, 6
INFO = MatchInfo(
    match_id="bench-0", source="bench", format="world", home="a", away="b", pitch=PITCHES[Kind.VSSS], software="bench"
)


@pytest.fixture(scope="module")
def log():
    """60 Hz; bodies drift smoothly, every float has a full mantissa."""
    rng = np.random.default_rng(0)

    def path(scale):
        push = np.convolve(rng.normal(size=FRAMES).cumsum(), np.ones(15) / 15, "same")
        return (scale * np.sin(push / 20)).astype(np.float32)

    def speed(positions):
        return np.gradient(positions) * 60

    ball, robots = np.zeros(FRAMES, BALL_DTYPE), np.zeros((FRAMES, ROBOTS), ROBOT_DTYPE)
    robots["team"], robots["id"] = np.arange(ROBOTS) // 3, np.arange(ROBOTS) % 3
    for body in (ball, *(robots[:, i] for i in range(ROBOTS))):
        for name, rate, scale in (("x", "vx", 0.7), ("y", "vy", 0.6), ("theta", "omega", 3.1)):
            if name in body.dtype.names:
                body[name] = path(scale)
                body[rate] = speed(body[name])
    times = np.arange(FRAMES, dtype=np.int64) * 16_666_667
    offsets = np.arange(FRAMES + 1, dtype=np.int64) * ROBOTS
    return MatchLog(INFO, Frames(np.arange(FRAMES, dtype=np.uint32), times, ball, offsets, robots.reshape(-1)))


@pytest.fixture(scope="module")
def data(log):
    stream = io.BytesIO()
    matches.write(log, stream)
    return stream.getvalue()


@pytest.fixture(scope="module")
def chunks(data):
    return [r for r in StreamReader(io.BytesIO(data), emit_chunks=True).records if isinstance(r, Chunk)]


def ours_read(data, chunks):
    return len(matches.read(data, where="bench").frames)


def mcap_and_mcap_ros2(data, chunks):
    return sum(1 for _ in make_reader(io.BytesIO(data), True, [DecoderFactory()]).iter_decoded_messages())


def mcap_iterator(data, chunks):
    return sum(1 for _ in make_reader(io.BytesIO(data), True).iter_messages())


def limit_zstd_and_copy(data, chunks):
    decompressor = zstandard.ZstdDecompressor()
    return FRAMES if b"".join([decompressor.decompress(chunk.data) for chunk in chunks]) else 0


@pytest.mark.benchmark(group="read a match log")
@pytest.mark.parametrize("how", [ours_read, mcap_and_mcap_ros2, mcap_iterator, limit_zstd_and_copy])
def test_read(benchmark, how, data, chunks):
    benchmark.extra_info.update(units=FRAMES, unit="messages")
    slow = how is mcap_and_mcap_ros2
    assert benchmark.pedantic(how, args=(data, chunks), rounds=2 if slow else 15, warmup_rounds=1) == FRAMES


def ours_write(log, payloads, raw):
    matches.write(log, stream := io.BytesIO())
    return stream.tell()


def mcap_writer_of_ready_payloads(log, payloads, raw):
    """Without the time that it takes to encode them."""
    writer = Writer(stream := io.BytesIO(), enable_data_crcs=True)
    writer.start("ros2")
    schema = writer.register_schema("pitchlore/msg/Frame", "ros2msg", TOPICS[FRAME].definition().encode())
    channel = writer.register_channel("/frame", "cdr", schema)
    for t_ns, payload in payloads:
        writer.add_message(channel, t_ns, payload, t_ns)
    writer.finish()
    return stream.tell()


def limit_zstd(log, payloads, raw):
    compressor = zstandard.ZstdCompressor(level=matches.LEVEL)
    return sum(len(compressor.compress(content)) for content in raw)


@pytest.mark.benchmark(group="write a match log")
@pytest.mark.parametrize("how", [ours_write, mcap_writer_of_ready_payloads, limit_zstd])
def test_write(benchmark, how, log, data, chunks):
    payloads = [(m.log_time, m.data) for _, _, m in make_reader(io.BytesIO(data)).iter_messages()]
    raw = [zstandard.decompress(chunk.data) for chunk in chunks]
    benchmark.extra_info.update(units=FRAMES, unit="messages")
    size = benchmark.pedantic(how, args=(log, payloads, raw), rounds=10, warmup_rounds=1)
    assert size > 1_000_000


@pytest.mark.benchmark(group="encode a frame message")
@pytest.mark.parametrize("how", ["mcap_ros2 encoder"])
def test_encode(benchmark, how, log):
    """What mcap's writer needs on top for each message."""
    encode = serialize_dynamic("pitchlore/msg/Frame", TOPICS[FRAME].definition())["pitchlore/msg/Frame"]
    robots = [dict(zip(ROBOT_DTYPE.names, r.item(), strict=True)) for r in log.frames.robots[:ROBOTS]]
    frame = {"frame": 0, "ball_x": 0.0, "ball_y": 0.0, "ball_vx": 0.0, "ball_vy": 0.0, "robots": robots}
    benchmark.extra_info.update(units=1, unit="messages")
    benchmark(encode, frame)
