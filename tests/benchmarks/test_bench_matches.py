"""Reading and writing a match of eight minutes: ours, mcap's, and what decompression alone takes."""

import io
import struct
import zlib

import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from mcap_ros2._dynamic import serialize_dynamic
from mcap_ros2.decoder import DecoderFactory
from support.mcap_logs import frame_dict, written

from pitchlore.pipeline import matches
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.matches.channels import FRAME, TOPICS
from pitchlore.pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames, MatchInfo, MatchLog

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
    return written(log)


@pytest.fixture(scope="module")
def chunks(data):
    return [r for r in StreamReader(io.BytesIO(data), emit_chunks=True).records if isinstance(r, Chunk)]


def decompress_only(data, chunks):
    decompressor = zstandard.ZstdDecompressor()
    return FRAMES if b"".join([decompressor.decompress(chunk.data) for chunk in chunks]) else 0


def decompress_and_check(data, chunks):
    """All that vouches for the bytes, by zlib and zstd, in C: no record is looked at."""
    decompressor = zstandard.ZstdDecompressor()
    sound = all(zlib.crc32(decompressor.decompress(chunk.data)) == chunk.uncompressed_crc for chunk in chunks)
    summary, = struct.unpack_from("<Q", data, len(data) - 28)
    end = summary - 13  # the DataEnd record
    return FRAMES if sound and zlib.crc32(data[:end]) == int.from_bytes(data[summary - 4 : summary], "little") else 0


@pytest.mark.benchmark(group="read a match log")
@pytest.mark.parametrize(
    ("how", "rounds"),
    [
        pytest.param(lambda data, _: len(matches.read(data, where="bench").frames), 100, id="ours"),
        pytest.param(lambda data, _: sum(1 for _ in make_reader(io.BytesIO(data), True, [DecoderFactory()]).iter_decoded_messages()),
                     5, id="mcap + mcap_ros2"),
        pytest.param(lambda data, _: sum(1 for _ in make_reader(io.BytesIO(data), True).iter_messages()),
                     10, id="mcap, messages not decoded"),
        pytest.param(decompress_only, 100, id="bound: zstd into one buffer, no checks"),
        pytest.param(decompress_and_check, 100, id="bound: zstd and both CRCs, no record read"),
    ],
)
def test_read(timed, how, rounds, data, chunks):
    assert timed(FRAMES, "messages", how, args=(data, chunks), rounds=rounds, warmup_rounds=1) == FRAMES


@pytest.fixture(scope="module")
def dicts(log):
    """Each message as mcap_ros2 wants it."""
    return [frame_dict(log.frames, i) for i in range(FRAMES)]


def mcap_log(times, payloads):
    writer = Writer(stream := io.BytesIO(), enable_data_crcs=True)
    writer.start("ros2")
    schema = writer.register_schema("pitchlore/msg/Frame", "ros2msg", TOPICS[FRAME].definition().encode())
    channel = writer.register_channel("/frame", "cdr", schema)
    for t_ns, payload in zip(times, payloads, strict=True):
        writer.add_message(channel, t_ns, payload, t_ns)
    writer.finish()
    return stream.tell()


@pytest.mark.benchmark(group="write a match log")
@pytest.mark.parametrize(
    "how", ["ours", "mcap + mcap_ros2", "mcap, messages encoded before", "bound: zstd of the ready chunks"]
)
def test_write(timed, how, log, data, chunks, dicts):
    times = log.frames.t_ns.tolist()
    payloads = [m.data for _, _, m in make_reader(io.BytesIO(data)).iter_messages()]
    raw = [zstandard.decompress(chunk.data) for chunk in chunks]
    encode = serialize_dynamic("pitchlore/msg/Frame", TOPICS[FRAME].definition())["pitchlore/msg/Frame"]
    assert encode(dicts[7]) == payloads[7]

    def ours():
        matches.write(log, stream := io.BytesIO())
        return stream.tell()

    run = {
        "ours": ours,
        "mcap + mcap_ros2": lambda: mcap_log(times, map(encode, dicts)),
        "mcap, messages encoded before": lambda: mcap_log(times, payloads),
        "bound: zstd of the ready chunks": lambda: sum(
            len(zstandard.ZstdCompressor(level=matches.LEVEL).compress(content)) for content in raw
        ),
    }[how]
    rounds = 3 if how.startswith("mcap") else 20
    assert timed(FRAMES, "messages", run, rounds=rounds, warmup_rounds=1) > 1_000_000
