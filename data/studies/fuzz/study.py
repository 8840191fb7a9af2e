"""Ten minutes of broken recordings: every format, and maps.

``make fuzz``, or ``study.py SECONDS [SEED]`` with the tests on Python's path. A recording of each format is
broken in ways that files break and attackers break them: bits flipped, stretches cut, doubled, moved, taken
from another format; numbers replaced by extremes; compressed again. It has to be read, or refused by an error
of ours in one short line, within the bounds. What is not is written beside the counts, and becomes a case of
``tests/hostile/make.py``.
"""

from __future__ import annotations

import gzip
import random
import re
import resource
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import polars as pl
from recordings.make import FILES

from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map

#: Most that one input may take.
SECONDS, MEGABYTES = 10, 1024
_EXTREMES = (
    b"0", b"-1", b"1e308", b"-1e-308", b"nan", b"inf", b"9" * 30, b"18446744073709551615", b"2147483648", b"",
    b"\xff\xfe", b"\x1b[2J", b"null", b"(", b")", b"\0")
#: What is broken.
WHOLE: dict[str, bytes] = {name: make() for name, make in FILES.items()}
Break = Callable[[bytes, random.Random], bytes]


def flips(data: bytes, rng: random.Random) -> bytes:
    """Some bits are flipped."""
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def cut(data: bytes, rng: random.Random) -> bytes:
    """A stretch is left out, or the end."""
    a, b = sorted((rng.randrange(len(data)), rng.randrange(len(data))))
    return data[:a] if rng.random() < 0.5 else data[:a] + data[b:]


def doubled(data: bytes, rng: random.Random) -> bytes:
    """A stretch comes again, perhaps many times, perhaps elsewhere."""
    a, b = sorted((rng.randrange(len(data)), rng.randrange(len(data))))
    part, at = data[a:b][:5_000] * rng.choice((1, 2, 50)), rng.randrange(len(data))
    return data[:at] + part + data[at:]


def words(data: bytes, rng: random.Random) -> bytes:
    """Numbers and words are replaced by extremes."""
    found = list(re.finditer(rb"-?\d+\.?\d*|[a-z_]{3,}", data))
    if not found:
        return flips(data, rng)
    for match in sorted(rng.sample(found, min(len(found), rng.choice((1, 3, 20)))), key=lambda m: -m.start()):
        data = data[:match.start()] + rng.choice(_EXTREMES) + data[match.end():]
    return data


def integers(data: bytes, rng: random.Random) -> bytes:
    """Binary integers, lengths among them, become extremes."""
    out = bytearray(data)
    for _ in range(rng.choice((1, 2, 5))):
        size = rng.choice((1, 2, 4, 8))
        value = rng.choice(
            (0, 1, 255, (1 << 31) - 1, 1 << 31, (1 << 32) - 1, 1 << 40, (1 << 63) - 1, 1 << 63, (1 << 64) - 1)
        )
        at = rng.randrange(max(1, len(out) - size))
        out[at:at + size] = (value & ((1 << 8 * size) - 1)).to_bytes(size, "little")
    return bytes(out)


def mixed(data: bytes, rng: random.Random) -> bytes:
    """A stretch of another format takes the place of one."""
    other = rng.choice(list(WHOLE.values()))
    a, b = sorted((rng.randrange(len(data)), rng.randrange(len(data))))
    at = rng.randrange(len(other))
    return data[:a] + other[at:at + rng.randrange(1, 2_000)] + data[b:]


def packed(data: bytes, rng: random.Random) -> bytes:
    """Gzipped, and broken then."""
    return rng.choice((flips, cut, integers))(gzip.compress(data, compresslevel=1), rng)


BREAKS: tuple[Break, ...] = (flips, cut, doubled, words, integers, mixed, packed)


class TooLong(BaseException):
    """An input took longer than it may."""


def _too_long(_number: int, _frame: FrameType | None) -> None:
    raise TooLong


def outcome(data: bytes, name: str, mapping: TrackingMap) -> str:
    """The outcome of reading: "read", "refused", or what is wrong."""
    signal.alarm(SECONDS)
    try:
        read(open_source(data, name), mapping)
    except PitchloreError as error:
        line = str(error)
        return (
            "refused" if line.isprintable() and len(line) < 2_000
            else f"a line that is not one: {line[:80]!r}")
    except TooLong:
        return "takes too long"
    except BaseException as error:
        return f"{type(error).__name__}: {str(error)[:80]}"
    finally:
        signal.alarm(0)
    return "read"


def map_outcome(data: bytes) -> str:
    """The outcome of reading a map."""
    try:
        load_map(data.decode(errors="replace"))
    except PitchloreError:
        return "refused"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:80]}"
    return "read"


def main(out: Path, seconds: float, seed: int) -> int:
    """Break and read until time is over. Returns the number of findings."""
    signal.signal(signal.SIGALRM, _too_long)
    rng = random.Random(seed)  # noqa: S311 (no secret)
    counts, found = Counter[tuple[str, str, str]](), 0
    mapping = load_map(WHOLE["tracking-csv/mapped.csv.toml"].decode())
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        name, whole = rng.choice(list(WHOLE.items()))
        breaking = rng.choice(BREAKS)
        data = breaking(whole, rng)
        if rng.random() < 0.3 and data:
            data = rng.choice(BREAKS)(data, rng)
        is_map = name.endswith(".toml")
        said = map_outcome(data) if is_map else outcome(
            data, Path(name).name, mapping if name.endswith("mapped.csv") else TrackingMap())
        counts["map" if is_map else name.partition("/")[0], breaking.__name__,
               said if said in ("read", "refused") else "found"] += 1
        if said not in ("read", "refused"):
            found += 1
            (out / f"found-{seed}-{found}-{Path(name).name}").write_bytes(data)
            print(f"{name} {breaking.__name__}: {said}", flush=True)
    rows = [{"format": form, "broken by": how, "outcome": said, "inputs": n}
            for (form, how, said), n in sorted(counts.items())]
    table = pl.DataFrame(rows).pivot(
        "outcome", index=["format", "broken by"], values="inputs", aggregate_function="sum")
    outcomes = sorted(set(table.columns) - {"format", "broken by"})
    table.select("format", "broken by", pl.col(outcomes).fill_null(0)).sort("format", "broken by").write_csv(
        out / "fuzz.csv")
    print(f"{sum(counts.values())} inputs in {seconds:.0f} s, {found} findings")
    return found


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_DATA, (MEGABYTES << 20,) * 2)
    sys.exit(1 if main(Path(__file__).parent, float(sys.argv[1]), int((sys.argv[2:] or ["1"])[0])) else 0)
