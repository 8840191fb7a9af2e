"""The replay page: what was recorded is on it, nothing else gets in, and it needs no network."""

import base64
import json
import re
import struct
import zlib

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.handmade import derived, handmade
from support.recordings import RSIM, imported

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.pipeline.views.replay import FAMILIES, page
from pitchlore.pipeline.views.replay.packing import HEADED, NO_STRENGTH, SEEN, SUSPECT, TURN
from pitchlore.schemas import Goals, Matches, Referee, Situations, Trajectories

MS = 1_000_000
VSSS = PITCHES[Kind.VSSS]
NASTY = "</script><script>alert(1)</script><!--{{payload}}{{title}}\"'&\u2028"


def match(**changed):
    row = dict.fromkeys(Matches.dtypes()) | {
        "match_id": "m-1", "source": "m.parquet", "home": "Blues", "away": "Oranges", "duration_s": 1.0,
        "robots_per_team": 3, "complete": True, "kind": "vsss", "frames": 1, "format": "tracking",
    }
    return pl.DataFrame([row | changed], schema=Matches.dtypes())


def trajectories(rows):
    """Trajectories from (t_ms, team, robot, x, y, theta[, segment[, suspect]]); frames are numbered by time."""
    filled = [(*row, *(0, False)[len(row) - 6:]) for row in rows]
    times = sorted({row[0] for row in filled})
    table = pl.DataFrame(
        [
            {"match_id": "m-1", "frame": times.index(t), "t_ns": t * MS, "team": team, "robot": robot, "x": x, "y": y,
             "theta": theta, "segment": segment, "suspect": suspect, "turned": False}
            for t, team, robot, x, y, theta, segment, suspect in filled
        ],
        schema=Trajectories.dtypes(),
    )
    return table.sort("team", "robot", "t_ns")


def situations(rows):
    """Situations from (team, robot, code, name, start_ms, end_ms, strength, target)."""
    return pl.DataFrame(
        [("m-1", team, robot, "striker", code, name, start * MS, end * MS, strength, target, 0)
         for team, robot, code, name, start, end, strength, target in rows],
        schema=Situations.dtypes(), orient="row",
    )


STILL = trajectories([(0, "ball", None, 0.0, 0.0, None), (0, "home", 1, -0.3, 0.1, 0.0), (0, "away", 2, 0.3, 0.1, 3.0)])


def make(played=STILL, done=None, goals=None, referee=None, pitch=VSSS, about=None, passes=None, shots=None,
         gap_s=None, **options):
    shown = handmade(pitch, gap_s=gap_s, matches=match() if about is None else about, trajectories=played,
                  situations=done, goals=goals, referee=referee, passes=passes, shots=shots)
    return page(shown, **options)


def decode(html):
    """The page's facts and samples, by the format that pipeline/views/replay/packing.py documents."""
    (payload,) = re.findall(r'<script type="application/octet-stream" id="payload">([A-Za-z0-9+/=]*)</script>', html)
    raw = zlib.decompress(base64.b64decode(payload, validate=True))
    (length,) = struct.unpack_from("<I", raw)
    facts = json.loads(raw[4 : 4 + length])
    S, B, at = facts["samples"], len(facts["bodies"]), 4 + length

    def take(n):
        nonlocal at
        at += n
        return np.frombuffer(raw[at - n : at], np.uint8)

    def values(rows, width, S=S):
        planes = take(rows * S * width).reshape(width, rows, S).astype(np.int64)
        zigzag = sum(plane << 8 * i for i, plane in enumerate(planes))
        return (zigzag >> 1) ^ -(zigzag & 1)

    def summed(off):
        steps = off.copy()
        for i in range(2, S):
            before, now = ticks[i - 1] - ticks[i - 2], ticks[i] - ticks[i - 1]
            if facts["joined"][i] and facts["joined"][i - 1] and before > 0:
                steps[:, i] += (2 * steps[:, i - 1] * now + before) // (2 * before)
            steps[:, i] = steps[:, i].astype(np.int16)
        return np.cumsum(steps, axis=1).astype(np.int16)

    ticks, tick = np.cumsum(values(1, 4)[0]), facts["tick"]
    facts["time"] = np.rint(ticks * tick).astype(int)
    facts["joined"], facts["mask"] = take(S), take(S * B).reshape(B, S)
    facts["x"], facts["y"], facts["heading"] = (summed(values(B, 2)) for _ in range(3))
    done, N = facts["situations"], sum(n for _, n in facts["situations"]["bodies"])
    kinds = [done["kinds"][kind] for kind in values(1, 2, N)[0]]
    facts["situations"] = {
        "body": [body for body, n in done["bodies"] for _ in range(n)],
        **{name: [kind[part] for kind in kinds] for part, name in enumerate(("code", "target", "role"))},
        **{name: np.rint(values(1, 4, N)[0] * tick).astype(int).tolist() for name in ("after", "lasts")},
        "strength": [None if percent == NO_STRENGTH else percent for percent in take(N).tolist()],
        "follows": take(N).tolist(),
    }
    assert at == len(raw)
    return facts


def bodies(facts):
    """(t_ms, team, robot) -> (x, y, theta or None, suspect) of everything on the page."""
    out = {}
    for b, (team, robot) in enumerate(facts["bodies"]):
        for s in np.flatnonzero(facts["mask"][b] & SEEN):
            mask = facts["mask"][b, s]
            theta = facts["heading"][b, s] * 2 * np.pi / TURN if mask & HEADED else None
            x, y = (facts[axis][b, s] * facts["quantum"] for axis in "xy")
            out[int(facts["time"][s]), team, robot] = (x, y, theta, bool(mask & SUSPECT))
    return out


def turned(a, b):
    """The angle between two headings."""
    return abs((a - b + np.pi) % (2 * np.pi) - np.pi)


coordinates = st.floats(-0.75, 0.75, width=32)
recorded = st.dictionaries(
    st.tuples(
        st.integers(0, 40).map(lambda slot: slot * 50),
        st.sampled_from([("ball", None), ("home", 0), ("home", 11), ("away", 0), ("away", 7)]),
    ),
    st.tuples(coordinates, coordinates, st.none() | st.floats(-3.125, 3.125, width=32), st.booleans()),
    min_size=1, max_size=60,
)


def table_of(rows):
    """Trajectories of what was recorded."""
    return trajectories([(t, *body, x, y, None if body[0] == "ball" else theta, 0, suspect)
                         for (t, body), (x, y, theta, suspect) in rows.items()])


@settings(max_examples=60)
@given(recorded, st.sampled_from(Kind))
def test_bodies(rows, kind):
    """Every body is where it was, and missing where it was missing."""
    facts = decode(make(table_of(rows), pitch=PITCHES[kind]))
    shown = bodies(facts)
    assert shown.keys() == {(t, *body) for t, body in rows}
    for (t, team, robot), (x, y, theta, suspect) in shown.items():
        was_x, was_y, was_theta, was_suspect = rows[t, (team, robot)]
        assert abs(x - was_x) <= facts["quantum"] / 2 + 1e-9
        assert abs(y - was_y) <= facts["quantum"] / 2 + 1e-9
        assert suspect == was_suspect
        if team == "ball" or was_theta is None:
            assert theta is None
        else:
            assert turned(theta, was_theta) <= np.pi / TURN + 1e-6


@pytest.mark.parametrize(("kind", "quantum"), [(Kind.VSSS, 0.001), (Kind.SSL, 0.001), (Kind.SIM2D, 0.005)])
def test_quantum(kind, quantum):
    """Positions are kept to 1 mm, and to 5 mm on the large pitch of the 2D simulation."""
    assert decode(make(pitch=PITCHES[kind]))["quantum"] == quantum


def test_jump():
    """A jump across the whole range survives."""
    table = trajectories([(0, "ball", None, -32.0, 0.0, None), (50, "ball", None, 32.0, 0.0, None), (100, "ball", None, -32.0, 1.0, None)])
    assert [x for x, *_ in bodies(decode(make(table))).values()] == pytest.approx([-32.0, 32.0, -32.0])


def test_slots():
    """The first sample of each slot is shown at the time it was recorded."""
    table = trajectories([(t, "ball", None, t / 1000, 0.0, None) for t in (0, 12, 49, 51, 60, 99, 100, 140, 151)])
    facts = decode(make(table, hz=20))
    assert facts["time"].tolist() == [0, 51, 100, 151]
    assert facts["x"][0].tolist() == [0, 51, 100, 151]
    assert decode(make(table, hz=1000))["samples"] == 9


@pytest.mark.slow
@given(recorded, st.sampled_from([0.002, 0.02, 0.2]))
def test_near(rows, near):
    """Samples are left out only where lines between the others bring all bodies near their places."""
    table = table_of(rows)
    facts, every = decode(make(table, near=near)), decode(make(table))
    time, least = facts["time"], near + facts["quantum"] / 2 + every["quantum"] / 2 + 1e-9
    assert set(time) <= set(every["time"])
    assert {every["time"][0], every["time"][-1]} <= set(time)
    assert set(facts["time"][facts["joined"] == 0]) == set(every["time"][every["joined"] == 0])
    for b in range(len(facts["bodies"])):
        for s, t in enumerate(every["time"]):
            after = min(np.searchsorted(time, t), len(time) - 1)
            left = after if time[after] == t else after - 1
            assert facts["mask"][b, left] == every["mask"][b, s], "whether it is seen changes at no other time"
            for axis in "xy":
                line = np.interp(t, time[[left, after]], facts[axis][b, [left, after]])
                assert abs(line * facts["quantum"] - every[axis][b, s] * every["quantum"]) <= least
            turn = np.interp(t, time[[left, after]], np.unwrap(facts["heading"][b, [left, after]] * 2 * np.pi / TURN))
            assert turned(turn, every["heading"][b, s] * 2 * np.pi / TURN) <= 0.2 + 2 * np.pi / TURN


def test_near_leaves_out():
    """Samples of a body on its course are a quarter of a second apart; where it turns, there is one."""
    table = trajectories([(t, "ball", None, abs(t - 1000) / 1000, 0.0, None) for t in range(0, 2001, 50)])
    facts = decode(make(table, near=0.01))
    assert facts["time"].tolist() == [0, 250, 500, 750, 1000, 1250, 1500, 1750, 2000]
    assert decode(make(table))["samples"] == 41


@pytest.mark.parametrize(("option", "value"), [
    *(("near", value) for value in (-0.1, float("nan"), float("inf"))), *(("hz", value) for value in (0, -1, float("nan"), 1e6))])
def test_refused(option, value):
    """A distance or a rate that cannot be is refused."""
    with pytest.raises(BadSettings, match=f"{option} cannot be"):
        make(**{option: value})


def test_gaps():
    """Gaps and restarts are not bridged."""
    table = trajectories([
        (0, "ball", None, 0.0, 0.0, None, 0), (50, "ball", None, 0.0, 0.0, None, 0),
        (100, "ball", None, 0.1, 0.0, None, 1),  # another stretch of play
        (150, "ball", None, 0.1, 0.0, None, None), (200, "ball", None, 0.1, 0.0, None, None),  # play is stopped
        (900, "ball", None, 0.1, 0.0, None, None),  # more than half a second without a sample
    ])
    facts = decode(make(table))
    assert facts["joined"].tolist() == [0, 1, 0, 0, 1, 0]
    assert facts["play"] == [[0, 50], [100, 100]]


def test_human_like_note():
    """The page says that a human-like team is a second script."""
    assert "a second script" in decode(make(about=match(home="human-like")))["note"]
    assert decode(make())["note"] is None


def test_facts():
    """Situations, goals, scores and restarts are on the page."""
    done = situations([
        ("home", 1, 21, "Robot kicks the ball", 0, 400, 0.756, "ball"),
        ("home", 1, 194, "Robot moves randomly", 400, 900, None, None),
        ("away", 2, 139, "Robot approaches midfield adversary", 100, 300, 1.0, "home-1"),
    ])
    goals = pl.DataFrame([("m-1", 900 * MS, "home", 1, "direct", "referee", None)], schema=Goals.dtypes(), orient="row")
    referee = pl.DataFrame(
        [("m-1", 900 * MS, "goal", "home", 1, 0, None), ("m-1", 950 * MS, "kick-off", "away", 1, 0, "kickoff_y")],
        schema=Referee.dtypes(), orient="row",
    )
    facts = decode(make(done=done, goals=goals, referee=referee))
    assert facts["bodies"] == [["ball", None], ["home", 1], ["away", 2]]
    assert facts["situations"] == {
        "body": [1, 1, 2], "code": [21, 194, 139], "after": [0, 0, 100], "lasts": [400, 500, 200],
        "strength": [76, None, 100], "target": ["ball", None, "home-1"], "role": ["striker"] * 3,
        "follows": [0, 1, 0],
    }
    assert facts["names"]["21"] == "Robot kicks the ball"
    assert facts["goals"] == [[900, "home", 1, "direct"]]
    assert facts["scores"] == [[900, 1, 0], [950, 1, 0]]
    assert facts["events"] == [[900, "goal", "home", None], [950, "kick-off", "away", "kickoff_y"]]


def test_unknown_scorer():
    """A goal of an unknown team is on the page, marked as unknown."""
    goals = pl.DataFrame(
        [("m-1", 400 * MS, None, None, None, "referee", None), ("m-1", 900 * MS, "home", 1, "direct", "referee", None)], schema=Goals.dtypes(), orient="row"
    )
    referee = pl.DataFrame(
        [("m-1", 0, "kick-off", None, 0, 0, None), ("m-1", 400 * MS, "goal", None, None, None, "goal"),
         ("m-1", 900 * MS, "goal", "home", None, None, None)], schema=Referee.dtypes(), orient="row",
    )
    html = make(goals=goals, referee=referee)
    facts = decode(html)
    assert facts["goals"] == [[400, None, None, None], [900, "home", 1, "direct"]]
    assert facts["scores"] == [[0, 0, 0]]  # what is shown from the goal on is in the script: unknown
    assert "goal, scorer unknown" in html
    assert ".chip.unknown {" in html


def test_families():
    """Every code of the paper has one family, and every family a colour in light and in dark."""
    for code in TABLE_1:
        assert sum(first <= code <= last for _, ranges in FAMILIES for first, last in ranges) == 1, code
    style = make()
    assert all(style.count(f"--family-{i}: #") == 2 for i in range(len(FAMILIES)))  # light and dark


@pytest.mark.parametrize("place", ["home", "away", "incomplete_reason", "target", "note"])
def test_markup_in_data(place):
    """Data never becomes markup."""
    plain = make(about=match(home="H", away="A", incomplete_reason="x"))
    about = {"home": "H", "away": "A", "incomplete_reason": "x"}
    done, referee = None, None
    if place in about:
        about[place] = NASTY
    elif place == "note":
        referee = pl.DataFrame([("m-1", 0, "stop", None, None, None, NASTY)], schema=Referee.dtypes(), orient="row")
    else:
        done = situations([("home", 1, 21, "n", 0, 400, 0.5, NASTY)])
    html = make(about=match(**about), done=done, referee=referee)
    outside = r"(id=\"payload\">)[^<]*(?=</script>)|(<title>)[^<]*(?=</title>)"
    assert re.sub(outside, "", html) == re.sub(outside, "", plain)
    assert json.dumps(NASTY)[1:-1] in json.dumps(decode(html), default=str)  # as it was, but as data


def test_title():
    """Team names are in the title, escaped."""
    assert "<title>A &amp; B – &lt;i&gt; · Pitchlore replay</title>" in make(about=match(home="A & B", away="<i>"))


def test_no_network():
    """The page asks the network for nothing."""
    html = make()
    assert "default-src 'none'" in html
    assert "://" not in html
    assert not re.search(r"<(link|img|iframe|base)\b|\bsrc=|@import|fetch\(|XMLHttpRequest|WebSocket|import\(", html)


def test_mask():
    """The script reads the mask as it was written."""
    assert f"const SEEN = {SEEN}, SUSPECT = {SUSPECT}, HEADED = {HEADED}, NO_STRENGTH = {NO_STRENGTH};" in make()


def test_markup_parts():
    """The markup has every part that the script asks for."""
    html = make()
    asked = set(re.findall(r'\$\("([\w-]+)"\)', html))
    asked |= {"goal-back", "goal-on", "frame-back", "frame-on", "labels", "skip", "filter", "whole", "help"}
    assert len(asked) > 15
    assert [name for name in asked if f'id="{name}"' not in html] == []


def test_row_order():
    """The same tables give the same page in any order of rows."""
    table = trajectories([(t, team, 1, t / 1000, 0.0, 1.0) for t in range(0, 1000, 50) for team in ("home", "away")])
    assert make(table) == make(table.sample(fraction=1.0, shuffle=True, seed=1))


def test_nothing_to_show():
    """A match without trajectories is refused by its name."""
    with pytest.raises(NotFound, match=r"^m-1: has no trajectories\. Run"):
        make(Trajectories.empty())


@pytest.mark.slow
def test_page_size():
    """Ten minutes of a real match fit in a megabyte, to the millimetre."""
    made = derived(imported(RSIM))
    table = made["trajectories"]
    html = make(table, done=made["situations"], goals=made["goals"], passes=made["passes"], shots=made["shots"])
    assert len(html.encode()) < 1_000_000
    facts = decode(html)
    assert facts["samples"] == 12_000
    rows = table.filter(pl.col("frame") % 2 == 0)
    shown = bodies(facts)
    assert len(shown) == len(rows)
    for t, team, robot, x, y, theta in rows[::97].select("t_ns", "team", "robot", "x", "y", "theta").rows():
        at = shown[t // MS, team, robot]
        assert at[:2] == pytest.approx((x, y), abs=0.0005 + 1e-7)
        assert (at[2] is None) if theta is None else turned(at[2], theta) <= np.pi / TURN + 1e-6
