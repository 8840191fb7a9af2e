"""The 36-element state: what its levels are, that both teams see it alike, and what it can count."""

from math import pi, prod

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.rows import WORDS, S, bodies, referee

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.state import (
    BinEdges,
    Observation,
    abstract_state,
    elements,
    encode,
    encode_one,
    project,
    radix,
)
from pitchlore.pipeline.state.keys import columns, decode
from pitchlore.pipeline.state.table import LEVELS, TABLE
from pitchlore.schemas import KEYS, ROLES, SIDES, Referee

#: The paper's count of states (section 4).
PAPER_STATES = 80_621_568

VSSS = PITCHES[Kind.VSSS]
NOBODY = Referee.empty()
SIX = {
    "home_1": (-0.7, 0.0, 0.0, "g"), "home_2": (-0.3, 0.1, 0.0, "m"), "home_3": (0.19, 0.0, 0.0, "s"),
    "away_1": (0.7, 0.0, pi, "g"), "away_2": (0.4, -0.2, pi, "m"), "away_3": (0.0, 0.3, pi, "s"),
}
#: Elements that the key self6 keeps for a midfield.
SELF6 = [
    "distance of own midfield to ball", "orientation of own midfield to ball", "own midfield in relation to ball and its own goal",
    "orientation of own midfield to its adversary's goal", "distance of ball to own goal", "distance of ball to adversary's goal",
]
BY_NAME = {element.name: i for i, element in enumerate(TABLE)}


def size(key):
    """The number of states of a key."""
    return prod(column.levels for column in columns(key))


def see(table, team=0, t=0.0, events=NOBODY, pitch=VSSS):
    """The level names by element name, None where the state is unknown."""
    found, known = elements(table, events, pitch, np.array([team]), np.array([round(t * S)]))
    if not known[0]:
        assert not found.any()
        return None
    return {element.name: element.levels[level] for element, level in zip(TABLE, found[0], strict=True)}


class TestCounts:
    def test_keys(self):
        """Keys go from fine to coarse, and their names say how many elements they keep."""
        assert [int(key.lstrip("abcdefghijklmnopqrstuvwxyz")) for key in KEYS] == [len(columns(key)) for key in KEYS]
        assert {key: size(key) for key in KEYS} == {
            "full36": 270_826_551_115_776, "full35": 90_275_517_038_592, "ego19": PAPER_STATES, "team19": PAPER_STATES,
            "self9": 3 * 3 * 2 * 4 * 9 * 8 * 3, "self6": 3 * 3 * 2 * 2 * 9, "role0": 1,
        }
        assert [size(key) for key in KEYS] == sorted(map(size, KEYS), reverse=True)


class TestEncoding:
    @pytest.mark.parametrize("key", KEYS)
    @given(st.data())
    @settings(max_examples=60)
    def test_inverse(self, key, data):
        """Encoding is the inverse of decoding, whatever the key."""
        state = data.draw(st.integers(0, size(key) - 1))
        slot = data.draw(st.integers(0, 2))
        found = np.zeros((1, 36), dtype=np.uint8)
        digits = decode(np.array([state]), key)[0]
        for column, digit in zip(columns(key, slot), digits, strict=True):
            assert digit < column.levels
            found[0, column.element] = digit
        assert encode(found, key, slot=np.array([slot])).item() == state

    @pytest.mark.parametrize("key", ["ego19", "self9", "self6"])
    def test_deciding_robot(self, key):
        """A key of one robot needs the slot of the robot that decides."""
        found = np.zeros((2, 36), dtype=np.uint8)
        found[:, BY_NAME["orientation of own striker to ball"]] = 2
        with pytest.raises(BadSettings, match=f"{key} needs the deciding robot's slot"):
            encode(found, key)
        keeper, striker = encode(found, key, slot=np.array([0, 2]))
        assert keeper == 0
        assert striker > 0

    @pytest.mark.parametrize(("key", "kept"), [
        ("full35", [name for name in BY_NAME if name != "score"]),
        ("self9", [*SELF6, "orientation of own midfield to its own goal", "ball direction", "ball velocity"]),
        ("self6", SELF6),
        ("role0", []),
    ])
    def test_kept_elements(self, key, kept):
        """A midfield's state depends on the elements that its key keeps and on nothing else."""
        for name, element in BY_NAME.items():
            moved = np.zeros((2, 36), dtype=np.uint8)
            moved[1, element] = 1
            before, after = encode(moved, key, slot=np.array([1, 1]))
            assert (before != after) == (name in kept), name

    @pytest.mark.parametrize("key", KEYS)
    @given(st.lists(st.tuples(st.integers(0, 2), *(st.integers(0, int(n) - 1) for n in LEVELS)), max_size=5))
    def test_projection(self, key, rows):
        """A state by any key is a projection of full36, and the same one at a time."""
        table = np.array(rows, dtype=np.uint8).reshape(-1, 37)
        slot, found = table[:, 0].astype(np.int64), np.ascontiguousarray(table[:, 1:])
        states = encode(found, key, slot)
        assert project(encode(found, "full36"), key, slot).tolist() == states.tolist()
        assert [encode_one(row, radix(key, own)) for row, own in zip(found, slot.tolist(), strict=True)] == states.tolist()


class TestLevels:
    def test_scene(self):
        """Home sees all 36 levels of a scene as they are worked out by hand."""
        seen = see(bodies([0.0], ball=(0.0, 0.0, 0.3, 0.0), **SIX))
        robots = [f"{side} {role}" for side in ("own", "adversary's") for role in ROLES]
        assert seen == {
            "distance of own goalkeeper to ball": "far",  # 0.70
            "distance of own midfield to ball": "near",  # 0.32
            "distance of own striker to ball": "too close",  # 0.19
            "distance of adversary's goalkeeper to ball": "far",
            "distance of adversary's midfield to ball": "near",  # 0.447
            "distance of adversary's striker to ball": "near",  # 0.30
            "distance of ball to own goal": "close",  # 0.75
            "distance of ball to adversary's goal": "close",
            **{f"orientation of {robot} to ball": "front" for robot in robots},
            "orientation of own striker to ball": "back",  # the ball is behind it
            "orientation of adversary's striker to ball": "side",
            **{f"orientation of {robot} to its own goal": "away" for robot in robots},
            **{f"orientation of {robot} to its adversary's goal": "pointing" for robot in robots},
            **{f"{robot} in relation to ball and its own goal": "before" for robot in robots},
            "own striker in relation to ball and its own goal": "after",
            "ball direction": "0 degrees", "ball velocity": "medium", "score": "drawing", "game situation": "normal",
        }

    @pytest.mark.parametrize(("element", "places", "levels"), [
        # a robot faces the ball within 45 degrees, and has it behind beyond 135
        ("orientation of own midfield to ball", [{"home_2": (-0.3, 0.0, heading, "m")} for heading in (
            0.0, pi / 4 - 0.01, pi / 4 + 0.01, -pi / 2, 3 * pi / 4 - 0.01, 3 * pi / 4 + 0.01, pi)],
         ["front", "front", "side", "side", "side", "back", "back"]),
        # it points at a goal within an angle that widens as the goal gets near: 45 degrees at 0.2 m
        ("orientation of own striker to its adversary's goal", [{"home_3": (x, 0.0, pi / 5, "s")} for x in (0.0, 0.55)],
         ["away", "pointing"]),
        ("distance of ball to own goal", [{"ball": (x, 0.0)} for x in (-0.75, -0.36, -0.34, 0.01, 0.36)],
         ["very close", "very close", "close", "far", "far"]),
        ("distance of ball to adversary's goal", [{"ball": (x, 0.0)} for x in (-0.75, -0.36, -0.34, 0.01, 0.36)],
         ["far", "far", "far", "close", "very close"]),
        ("ball velocity", [{"ball": (0.0, 0.0, speed, 0.0)} for speed in (0.0, 0.09, 0.11, 0.59, 0.61)],
         ["slow", "slow", "medium", "medium", "fast"]),
    ])
    def test_bounds(self, element, places, levels):
        """A level begins and ends where it is said to."""
        assert [see(bodies([0.0], **{"ball": (0.0, 0.0), **SIX, **place}))[element] for place in places] == levels

    @pytest.mark.parametrize(("degrees", "sector"), [(0, 0), (22, 0), (23, 45), (90, 90), (-90, 270), (-23, 315),
                                                    (180, 180), (-180, 180), (-22, 0)])
    def test_ball_direction(self, degrees, sector):
        """The ball's direction is a sector of 45 degrees, counted from the adversary's goal."""
        velocity = (0.3 * np.cos(np.radians(degrees)), 0.3 * np.sin(np.radians(degrees)))
        table = bodies([0.0], ball=(0.0, 0.0, *velocity), **SIX)
        assert see(table)["ball direction"] == f"{sector} degrees"
        assert see(table, team=1)["ball direction"] == f"{(sector + 180) % 360} degrees"

    def test_scale(self):
        """The bounds of levels scale with the kind of match."""
        assert BinEdges.of(VSSS)[2:4] == pytest.approx((0.40, 0.75))
        large = PITCHES[Kind.SIM2D]
        assert BinEdges.of(large)[2:4] == pytest.approx((28.0, 52.5))
        assert (BinEdges.of(large).slow, BinEdges.of(large).medium) == pytest.approx((0.8, 4.8))
        scene = {name: (50 * x, 50 * y, theta, role) for name, (x, y, theta, role) in SIX.items()}
        assert see(bodies([0.0], ball=(8.0, 0.0), **scene), pitch=large)["distance of own striker to ball"] == "too close"


class TestDirection:
    def test_slow_ball(self):
        """A slow ball keeps its last direction; before it has moved it has the first level."""
        table = bodies([0.0, 1.0, 2.0], ball=(0.0, 0.0), **SIX)
        ball = pl.col("team") == "ball"
        table = table.with_columns(
            vy=pl.when(ball & (pl.col("frame") == 1)).then(0.3).when(ball & (pl.col("frame") == 2)).then(-0.04)
            .otherwise(pl.col("vy")).cast(pl.Float32)
        )
        assert [see(table, t=t)["ball direction"] for t in (0.0, 1.0, 2.0)] == [
            "0 degrees", "90 degrees", "90 degrees"]

    def test_restart(self):
        """The ball's direction is not held over a restart."""
        table = bodies([0.0, 1.0], ball=(0.0, 0.0), **SIX).with_columns(
            vy=pl.when((pl.col("team") == "ball") & (pl.col("frame") == 0)).then(0.3).otherwise(pl.col("vy"))
            .cast(pl.Float32),
            segment=pl.col("frame").cast(pl.Int32),
        )
        assert see(table, t=0.0)["ball direction"] == "90 degrees"
        assert see(table, t=1.0)["ball direction"] == "0 degrees"


class TestScore:
    EVENTS = referee((1.0, "goal", "away"), (2.0, "goal", "home"), (3.0, "goal", "home"))

    @pytest.mark.parametrize(("t", "home", "away"), [
        (0.5, "drawing", "drawing"), (1.0, "losing", "winning"), (2.5, "drawing", "drawing"),
        (3.0, "winning", "losing"),
    ])
    def test_counted_goals(self, t, home, away):
        """The score is that of the observing team, and counts goals if it is not logged."""
        table = bodies([0.5, 1.0, 2.5, 3.0], ball=(0.0, 0.0), **SIX)
        assert see(table, 0, t, self.EVENTS)["score"] == home
        assert see(table, 1, t, self.EVENTS)["score"] == away

    @pytest.mark.parametrize(("events", "scores"), [
        # it is the logged one if there is one
        ([(0.0, "kick-off", "home", 0, 3), (1.0, "goal", "home", None, None)], {0.0: "losing", 2.0: "losing"}),
        # a goal of an unknown team leaves it as it was, unless a score is logged with it
        ([(0.0, "kick-off", None, 0, 0), (1.0, "goal", "away", 0, 1), (2.0, "goal", None, None, None),
          (3.0, "goal", "home", None, None)], {1.5: "losing", 2.5: "losing", 3.5: "drawing"}),
        ([(0.5, "goal", None, 1, 0)], {1.0: "winning"}),
    ])
    def test_logged_score(self, events, scores):
        """A score that is logged counts, and a goal of an unknown team does not by itself."""
        table = bodies(list(scores), ball=(0.0, 0.0), **SIX)
        assert {t: see(table, 0, t, referee(*events))["score"] for t in scores} == scores


class TestSituation:
    @pytest.mark.parametrize(("event", "segment", "level"), [
        ("goal", None, "goal"), ("fault", None, "fault"), ("kick-off", None, "normal"), ("goal", 0, "normal"),
    ])
    def test_between_segments(self, event, segment, level):
        """Between segments the game situation is that of the last event; in a segment it is normal, whatever came before."""
        table = bodies([1.0], ball=(0.0, 0.0), **SIX).with_columns(segment=pl.lit(segment, dtype=pl.Int32))
        assert see(table, t=1.0, events=referee((0.5, event, "home")))["game situation"] == level


class TestSlots:
    def test_shared_role(self):
        """If several hold a role, its slot goes to the one nearest to the ball."""
        scene = SIX | {"home_4": (-0.05, 0.0, 0.0, "m")}
        assert see(bodies([0.0], ball=(0.0, 0.0), **scene))["distance of own midfield to ball"] == "too close"

    def test_vacant_role(self):
        """If nobody holds a role, its slot goes to the robot nearest in rank."""
        scene = {name: place for name, place in SIX.items() if name not in ("home_3", "away_2", "away_3")}
        seen = see(bodies([0.0], ball=(0.0, 0.0), **scene))
        assert seen["distance of own striker to ball"] == seen["distance of own midfield to ball"] == "near"
        assert seen["distance of adversary's striker to ball"] == "far"


class TestMissing:
    def test_unknown_state(self):
        """Without ball, speed, heading, sample, adversary or any row the state is unknown."""
        whole = bodies([0.0], ball=(0.0, 0.0), **SIX)
        ball = pl.col("team") == "ball"
        assert see(whole) is not None
        assert see(whole, t=5.0) is None
        assert see(whole.filter(~ball)) is None
        assert see(whole.filter(pl.col("team") != "away")) is None
        assert see(whole.clear()) is None
        assert see(whole.with_columns(vx=pl.when(ball).then(None).otherwise("vx"))) is None
        assert see(whole.with_columns(suspect=ball)) is None
        assert see(whole.with_columns(theta=pl.lit(None, dtype=pl.Float32))) is None

    def test_suspect_robot(self):
        """A suspect robot counts as absent."""
        whole = bodies([0.0], ball=(0.0, 0.0), **SIX)
        gone = pl.col("robot") == 3
        assert see(whole.with_columns(suspect=gone.fill_null(value=False))) == see(whole.filter(gone.not_() | gone.is_null()))


coordinate = st.floats(-0.7, 0.7).filter(lambda x: abs(x) > 1e-3)


@st.composite
def scenes(draw):
    scene = {"ball": tuple(draw(coordinate) for _ in range(4))}
    for team in SIDES:
        for robot, role in enumerate(draw(st.lists(st.sampled_from(list(WORDS)), min_size=1, max_size=4))):
            scene[f"{team}_{robot}"] = (draw(coordinate), draw(coordinate), draw(st.floats(-3.0, 3.0)), role)
    return scene


@pytest.mark.slow
@given(scenes())
@settings(max_examples=80)
def test_both_views(scene):
    """The away team's view has the two sides' slots and goals swapped, and the ball going the other way."""
    found, known = elements(bodies([0.0], **scene), NOBODY, VSSS, np.array([0, 1]), np.zeros(2, dtype=np.int64))
    assert known.all()
    assert (found < LEVELS).all()
    home, away = found
    swap = [3, 4, 5, 0, 1, 2, 7, 6, 11, 12, 13, 8, 9, 10, *range(20, 26), *range(14, 20), 29, 30, 31, 26, 27, 28]
    assert away[:32].tolist() == home[swap].tolist()
    moving = np.hypot(*np.array(scene["ball"][2:], dtype=np.float32).astype(float)) >= 0.05
    assert (home[32], away[32]) == ((home[32], (home[32] + 4) % 8) if moving else (0, 0))
    assert away[33:].tolist() == home[33:].tolist()


@given(scenes())
@settings(max_examples=40)
def test_exchanged_teams(scene):
    """A match that is turned and has its teams exchanged is seen the same."""
    other = {"home": "away", "away": "home"}
    turned = {}
    for name, place in scene.items():
        team, _, robot = name.partition("_")
        if team == "ball":
            turned[name] = tuple(-v for v in place)
        else:
            x, y, theta, role = place
            turned[f"{other[team]}_{robot}"] = (-x, -y, theta - pi if theta > 0 else theta + pi, role)
    at = (np.array([0, 1]), np.zeros(2, dtype=np.int64))
    one, _ = elements(bodies([0.0], **scene), NOBODY, VSSS, *at)
    two, _ = elements(bodies([0.0], **turned), NOBODY, VSSS, *at)
    # float32 angles may fall on either side of a break when turned; positions are exact
    exact = [*range(8), *range(26, 32), 33, 34, 35]
    assert one[0][exact].tolist() == two[1][exact].tolist()
    assert one[1][exact].tolist() == two[0][exact].tolist()


def test_one_moment():
    """One moment has the same state without tables as with them."""
    names = [name for name in SIX if name.startswith(("home", "away"))]
    robots = np.array([SIX[name][:3] for name in names])
    sides = np.array([SIDES.index(name[:4]) for name in names])
    roles = np.array([ROLES.index(WORDS[SIX[name][3]]) for name in names])
    out = np.empty(36, dtype=np.uint8)
    ball = np.array([0.0, 0.0, 0.3, 0.0])
    seen = Observation(robots, sides, roles, ball, 1.0, 0.0, 1, 0)
    assert abstract_state(seen, BinEdges.of(VSSS), out)
    found, _ = elements(bodies([0.0], ball=tuple(ball), **SIX), NOBODY, VSSS, np.array([0]), np.array([0]))
    assert out.tolist() == found[0].tolist()
