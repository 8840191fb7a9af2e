"""What all importers keep to, and how a recording is told and named."""

from __future__ import annotations

import gzip
import random
import re

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.recordings import ALL, INSPER, RCSS, RSIM, SSL, imported, recording

from pipeline.errors import BadRecording
from pipeline.importers import source
from pipeline.matches.frame import MatchLog
from schemas import Quality, Referee


def same(one: MatchLog, two: MatchLog) -> bool:
    return (
        one.info == two.info
        and all(
            getattr(one.frames, part).tobytes() == getattr(two.frames, part).tobytes()
            for part in ("number", "t_ns", "ball", "offsets", "robots")
        )
        and one.referee.equals(two.referee)
        and one.quality.equals(two.quality)
    )


@pytest.mark.parametrize("name", ALL)
def test_a_real_recording_becomes_a_sound_match(name: str) -> None:
    match = imported(name)
    frames, info = match.frames, match.info
    Referee.validate(match.referee)
    Quality.validate(match.quality)
    assert frames.t_ns[0] == 0
    assert (np.diff(frames.t_ns) > 0).all()
    assert (np.diff(frames.offsets) >= 0).all()
    assert match.referee["t_ns"].is_sorted()
    assert match.referee["t_ns"].is_between(0, int(frames.t_ns[-1])).all()
    # periods are consecutive and cover all samples
    assert info.periods[0].start_ns == 0
    assert info.periods[-1].end_ns == frames.t_ns[-1] + 1
    assert all(a.end_ns == b.start_ns for a, b in zip(info.periods[:-1], info.periods[1:], strict=True))
    # no body is further out than players and balls go: into the net and over the line
    margin = 0.1 * info.pitch.length
    for bodies in (frames.robots, frames.ball):
        assert np.nanmax(np.abs(bodies["x"])) < info.pitch.length / 2 + margin
        assert np.nanmax(np.abs(bodies["y"])) < info.pitch.width / 2 + margin
    theta = frames.robots["theta"]
    assert (theta > -np.float32(np.pi) - 1e-6).all()
    assert (theta <= np.float32(np.pi)).all()


@pytest.mark.parametrize(
    ("name", "home", "away", "score"),
    [
        (RSIM, "blue", "yellow", (21, 4)),
        (SSL, "TIGERs", "RoboCIn", (1, 0)),
        (RCSS, "KickRunA", "KickRunB", (0, 3)),
        (INSPER, "finalmente", "final", (0, 0)),
    ],
)
def test_teams_and_goals_are_those_of_the_match(
    name: str, home: str, away: str, score: tuple[int, int]
) -> None:
    match = imported(name)
    assert (match.info.home, match.info.away) == (home, away)
    assert match.referee.select("score_home", "score_away").row(-1) == score
    goals = match.referee.filter(pl.col("event") == "goal")["team"].cast(pl.String).to_list()
    assert (goals.count("home"), goals.count("away")) == score


@pytest.mark.parametrize("name", ALL)
def test_importing_again_gives_the_same_match(name: str) -> None:
    assert same(imported(name), imported.__wrapped__(name))
    assert imported(name).info.match_id == source.match_id("renamed/" + name, recording(name))


@pytest.mark.parametrize("name", [RSIM, SSL, RCSS])
def test_every_goal_of_a_real_match_falls_where_the_scorer_attacks(name: str) -> None:
    """Teams, scores and directions are found apart from each other; here they must agree."""
    match = imported(name)
    goals = match.referee.filter(pl.col("event") == "goal")
    for t_ns, team in goals.select("t_ns", pl.col("team").cast(pl.String)).iter_rows():
        period = next(p for p in match.info.periods if p.start_ns <= t_ns < p.end_ns)
        attacks = period.home_attacks * (1 if team == "home" else -1)
        before = (match.frames.t_ns > t_ns - 1_000_000_000) & (match.frames.t_ns <= t_ns)
        x = match.frames.ball["x"][before]
        assert np.nanmax(x * attacks) > 0.9 * match.info.pitch.goal_x, (t_ns, team)


# --- what a file is -----------------------------------------------------------------------------

CSV = b"frame,t,team,player,x,y\n0,0.0,ball,,0,0\n0,0.0,a,1,0.1,0\n0,0.0,b,1,-0.1,0\n"


@pytest.mark.parametrize(
    ("head", "is_a"),
    [
        (b"\x89MCAP0\r\n and more", "mcap"),
        (b"ULG5\n(show 0)", "rcg"),
        (b"ULG\x03\x00", "rcg"),
        (b"PAR1....PAR1", "tracking-parquet"),
        (CSV, "tracking-csv"),
        (CSV.replace(b",", b";"), "tracking-csv"),
        (b"\xef\xbb\xbf" + CSV, "tracking-csv"),
    ],
)
def test_the_format_is_told_from_the_content(head: bytes, is_a: str) -> None:
    assert source.detect(head, "liar.txt") == is_a
    assert source.detect(gzip.compress(head), "liar.mcap") == is_a


@pytest.mark.parametrize(
    "junk",
    [
        b"", gzip.compress(b""), b"Dear referee, the match was good, fast, fair, and short.\nYours, a fan\n",
        b"\x00" * 100, b"{}", b"1,2,3,4,5\n1,2,3,4,5\n", b"\x1f\x8b not gzip",
    ],
)
def test_what_is_no_recording_is_refused_with_a_next_step(junk: bytes) -> None:
    with pytest.raises(BadRecording, match=r"\. .*(Give an MCAP log|Copy or record)") as refusal:
        source.detect(junk, "junk.bin")
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).startswith("junk.bin: ")


def test_gzip_is_unpacked_whole_in_parts_or_refused() -> None:
    noise = random.Random(1).randbytes(300_000)
    packed = gzip.compress(noise)
    assert source.content(noise, "a.gz") == (noise, None)
    assert source.content(packed, "a.gz") == (noise, None)
    assert source.content(packed + packed, "a.gz") == (noise + noise, None)
    assert source.content(packed + b"\0" * 512, "a.gz") == (noise, None)

    data, damage = source.content(packed[: len(packed) // 2], "a.gz")
    assert noise.startswith(data)
    assert len(data) > 100_000
    assert damage == "the gzip stream is cut off"

    data, damage = source.content(packed + b"tail", "a.gz")
    assert data == noise
    assert damage is not None

    wrong_sum = packed[:-8] + bytes(8)
    assert source.content(wrong_sum, "a.gz").damage is not None

    with pytest.raises(BadRecording, match=r"^a\.gz: .*cut off"):
        source.content(packed[:11], "a.gz")


def test_a_decompression_bomb_is_refused() -> None:
    bomb = gzip.compress(bytes(100 << 20), compresslevel=1)
    with pytest.raises(BadRecording, match=r"^bomb\.gz: unpacks to more than"):
        source.content(bomb, "bomb.gz", ratio=100)
    with pytest.raises(BadRecording, match=r"^bomb\.gz: unpacks to more than"):
        source.content(bomb, "bomb.gz", limit=1 << 20)


@pytest.mark.parametrize(
    ("name", "slug"),
    [
        ("rsim-vss-3v3.parquet", "rsim-vss-3v3"),
        ("20220712-A_0-vs-B_3.rcg.gz", "20220712-a-0-vs-b-3"),
        ("../../etc/passwd", "passwd"),
        ("C:\\logs\\Jogo Único.csv", "jogo-unico"),
        ("'; DROP TABLE matches; --.csv", "drop-table-matches"),
        ("日本.parquet", "match"),
        ("", "match"),
        ("-", "match"),
        (".parquet", "parquet"),
        ("x" * 99, "x" * 40),
        ("x" * 39 + "--y", "x" * 39),
    ],
)
def test_hostile_names_become_safe(name: str, slug: str) -> None:
    assert source.match_id(name, b"data") == f"{slug}-3a6eb0790f39"


@given(st.text(max_size=80), st.binary(max_size=40))
def test_every_name_makes_a_valid_identity(name: str, data: bytes) -> None:
    assert re.fullmatch(r"[a-z0-9][a-z0-9-]{0,63}", source.match_id(name, b"x" + data))


def test_the_same_content_has_the_same_hash_whatever_it_is_called() -> None:
    one = source.match_id("a.csv", CSV)
    assert source.match_id("b.csv", CSV)[-12:] == one[-12:]
    assert source.match_id("a.csv.gz", gzip.compress(CSV)) == one
    assert source.match_id("a.csv", CSV + b"\n")[-12:] != one[-12:]


def test_of_a_corrupt_gzip_what_comes_before_the_damage_is_kept() -> None:
    noise = random.Random(2).randbytes(300_000).hex().encode()
    packed = bytearray(gzip.compress(noise, compresslevel=0))  # stored: the damage is met at a block's head
    packed[len(packed) // 2 :] = b"\xff" * (len(packed) - len(packed) // 2)
    data, damage = source.content(bytes(packed), "a.gz")
    assert damage is not None
    assert "corrupt" in damage
    assert len(data) > 0.45 * len(noise)
    assert noise.startswith(data[: int(0.45 * len(noise))])
