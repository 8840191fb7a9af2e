"""Damage of SSL logs that nobody thought of: only errors of ours, soon, and what is read is a sound match."""

import time

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings.make import FILES
from support import ssl_messages as ssl
from support.recordings import assert_sound
from support.ssl_games import Referee, frames, ordered

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.ssl_logs.wire import FIXED32, FIXED64, SPAN, VARINT, fields

GC = Referee()
#: A log of vision and a referee, and one of a tracker.
LOGS = (
    ssl.log(ordered([GC.says(f, command=2 if f else 0) for f in range(0, 40, 4)], frames(40)), index=True),
    FILES["ssl-log/tracked.log"](),
)
#: Longest time for one of these small logs, seconds, on a machine that does much else.
SOON_S = 20.0


def check(data: bytes) -> None:
    """Read a log, which may be refused in one line."""
    begin, match, said = time.monotonic(), None, "fuzz.log: "
    try:
        match = read(open_source(data, "fuzz.log"))
    except BadRecording as error:
        said = str(error)
    assert "\n" not in said
    assert said.startswith("fuzz.log: ")
    if match is not None:
        assert_sound(match)
        assert np.isfinite(match.frames.robots["x"]).all()
    assert time.monotonic() - begin < SOON_S


@settings(max_examples=60)
@given(st.sampled_from(LOGS), st.lists(st.tuples(st.integers(min_value=0), st.integers(0, 255)), max_size=40),
       st.integers(min_value=0), st.integers(0, 3_000), st.binary(max_size=200))
def test_bytes_that_are_others(data: bytes, changes: list[tuple[int, int]], at: int, length: int, piece: bytes) -> None:
    """Any bytes after the header become any others; then a piece is cut out, and any bytes take its place."""
    damaged = bytearray(data)
    for place, value in changes:
        damaged[16 + place % (len(data) - 16)] = value
    at = 16 + at % (len(data) - 16)
    check(bytes(damaged[:at] + piece + damaged[at + length :]))


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(-(2**63), 2**63 - 1), st.integers(0, 15), st.binary(max_size=60)), max_size=30))
def test_messages_of_anything(messages: list[tuple[int, int, bytes]]) -> None:
    """Sound heads, with any times and any contents."""
    check(ssl.log(ssl.Message(*message) for message in messages))


# --- the wire format, beside a literal decoder ------------------------------------------------------


def literal(data: bytes) -> tuple[list[tuple[int, int, bytes | int]], bool]:
    """Fields of a message, one after another: number, wire type, and the value or its bytes; and whether it is damaged."""
    found: list[tuple[int, int, bytes | int]] = []
    at = 0

    def varint() -> int | None:
        nonlocal at
        value = 0
        for i in range(10):
            if at == len(data):
                return None
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << (7 * i)
            if byte < 0x80:
                value &= 2**64 - 1
                return value - 2**64 if value >= 2**63 else value
        return None

    while at < len(data):
        tag = varint()
        if tag is None or tag >> 3 <= 0:
            return found, True
        kind = tag & 7
        length: int | None = {FIXED32: 4, FIXED64: 8}.get(kind)
        if kind == VARINT:
            value = varint()
            if value is None:
                return found, True
            found.append((tag >> 3, kind, value))
            continue
        if kind == SPAN:
            length = varint()
        if length is None or not 0 <= length <= len(data) - at:
            return found, True
        found.append((tag >> 3, kind, data[at : at + length]))
        at += length
    return found, False


numbers = st.one_of(st.integers(0, 300), st.integers(0, 2**64 - 1), st.integers(-(2**63), -1))
sound = st.lists(st.one_of(
    st.builds(ssl.integer, st.integers(1, 40), numbers), st.builds(ssl.f32, st.integers(1, 40), st.floats(width=32)),
    st.builds(ssl.f64, st.integers(1, 3_000), st.floats()), st.builds(ssl.span, st.integers(1, 40), st.binary(max_size=300)),
), max_size=8).map(b"".join)


@settings(max_examples=300)
@given(st.lists(st.one_of(sound, st.binary(max_size=40), st.builds(lambda a, n: a[:n], sound, st.integers(0, 30))), max_size=6))
def test_fields(messages: list[bytes]) -> None:
    """All messages at once give what a decoder gives that reads byte after byte."""
    ends = np.cumsum([len(message) for message in messages], dtype=np.int64)
    starts = ends - np.array([len(message) for message in messages], dtype=np.int64)
    whole = b"".join(messages)
    found, damaged = fields(np.frombuffer(whole, np.uint8), starts, ends)
    for i, message in enumerate(messages):
        rows = found.at(np.flatnonzero(found.of == i))
        values = [
            (number, kind, value if kind == VARINT else whole[value:end])
            for number, kind, value, end in zip(*(c.tolist() for c in (rows.number, rows.kind, rows.value, rows.end)), strict=True)
        ]
        assert (values, bool(damaged[i])) == literal(message)


def test_signalling() -> None:
    """A NaN that signals, which a broken log may hold, is read without a warning (`make fuzz` found one)."""
    data = np.frombuffer(b"\x0d\x01\x00\x80\x7f", np.uint8)  # field 1, four bytes
    found, _ = fields(data, np.array([0]), np.array([len(data)]))
    assert np.isnan(found.reals(data, 1)[1]).tolist() == [True]
