"""Bodies of SSL logs: cameras joined to samples, the ball among false ones, trackers."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from support import ssl_messages as ssl
from support.ssl_games import EPOCH, GEOMETRY, STEP, flaws, frames, match, ns, ordered, seen
from support.ssl_messages import TRACKER, VISION_2010, Message, Seen, Tracked

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.store import Store

YELLOW = '[teams]\nhome = "yellow"\n'


def robots(game: MatchLog, frame: int) -> list[tuple[int, int, float, float]]:
    """Team, number, x, y of each robot of a sample; lengths to the millimetre."""
    rows = game.frames.robots[game.frames.offsets[frame] : game.frames.offsets[frame + 1]]
    return [(int(r["team"]), int(r["id"]), round(float(r["x"]), 3), round(float(r["y"]), 3)) for r in rows]


def ball_x(game: MatchLog) -> list[float | None]:
    """x of the ball in each sample, to the millimetre; None where it was not seen."""
    return [None if np.isnan(x) else round(float(x), 3) for x in game.frames.ball["x"]]


# --- several cameras ------------------------------------------------------------------------------


def test_a_round_is_a_sample() -> None:
    """One frame of each camera is a sample, also if one loses a frame, comes late or has more frames; 41 ms apart, two are."""
    a = [seen(f, camera=0, yellow=[Seen(1, 0, 1)]) for f in range(6)]
    b = [seen(f, camera=7, later=0.004, yellow=[Seen(-1, 0, 2)]) for f in range(6) if f != 3]
    game = match(ordered(a, b))
    assert np.round(game.frames.t_ns / 1e9 / STEP).tolist() == list(range(6))
    assert [len(robots(game, f)) for f in range(6)] == [2, 2, 2, 1, 2, 2]
    assert game.frames.number.tolist() == list(range(6))

    game = match([seen(0, camera=0, yellow=[Seen(1, 0, 1)]), seen(0, camera=1, later=0.041, yellow=[Seen(-1, 0, 2)])])
    assert [len(robots(game, f)) for f in range(2)] == [1, 1]


def test_overlap() -> None:
    """A robot and a ball that two cameras see are one each: the mean, weighted by confidence."""
    game = match([
        seen(0, camera=0, balls=[Seen(0.00, 0.5, confidence=0.9)], yellow=[Seen(1.00, 0.0, 3, 3.1, confidence=0.9)]),
        seen(0, camera=1, balls=[Seen(0.04, 0.5, confidence=0.3)], yellow=[Seen(1.04, 0.0, 3, -3.1, confidence=0.3)]),
    ], YELLOW)
    assert robots(game, 0) == [(0, 3, 1.01, 0.0)]
    assert ball_x(game) == [0.01]
    theta = float(game.frames.robots["theta"][0])
    assert abs(theta) == pytest.approx(3.1 + 2 * (np.pi - 3.1) / 4, abs=1e-3)  # across the turn, a quarter of the way


def test_a_robot_at_two_places() -> None:
    """It stays where it was last; without a last place the more confident detection is right. The other is counted."""
    said = [
        seen(0, yellow=[Seen(1.0, 0.0, 3, confidence=0.5), Seen(3.0, 0.0, 3, confidence=0.9)]),
        seen(1, yellow=[Seen(1.0, 0.0, 3, confidence=0.9), Seen(3.0, 0.0, 3, confidence=0.5)]),
    ]
    game = match(said, YELLOW)
    assert [robots(game, f) for f in range(2)] == [[(0, 3, 3.0, 0.0)]] * 2
    assert flaws(game)["skipped"] == 2


def test_a_later_camera_is_moved_back() -> None:
    """A body of a camera that is 8 ms later is where it was at the sample's time; its heading, too."""
    speed, turn = 2.0, 3.0
    said = []
    for f in range(10):
        t = f * STEP + 0.008
        said += [seen(f, camera=0, yellow=[Seen(3, 0, 1)]),
                 seen(f, camera=1, later=0.008, balls=[Seen(-2 + speed * t, 1.0)],
                      blue=[Seen(-3 + speed * t, 0.0, 5, 3.0 + turn * t)])]
    game = match(said)
    t = game.frames.t_ns / 1e9
    np.testing.assert_allclose(game.frames.ball["x"][1:], (-2 + speed * t)[1:], atol=1e-5)
    blue = game.frames.robots[game.frames.robots["id"] == 5]
    np.testing.assert_allclose(blue["x"][1:], (-3 + speed * t)[1:], atol=1e-5)
    turned = np.angle(np.exp(1j * (blue["theta"] - (3.0 + turn * t))))
    np.testing.assert_allclose(turned[1:], 0, atol=1e-4)


def test_cameras_with_clocks_of_their_own() -> None:
    """A camera whose clock is 5 s ahead is moved by as much, and said."""
    a = [seen(f, camera=0, yellow=[Seen(1, 0, 1)]) for f in range(20)]
    b = [seen(f, camera=1, later=5.0, yellow=[Seen(-1, 0, 2)], sent=f * STEP + 0.001) for f in range(20)]
    game = match(ordered(a, b))
    assert len(game.frames) == 20
    assert [len(robots(game, f)) for f in range(20)] == [2] * 20
    assert flaws(game)["clock leap ahead"] == 20


def test_many_cameras() -> None:
    """Frames of more cameras than there can be are counted and left out."""
    game = match([seen(0, camera=camera, later=camera * 1e-4, yellow=[Seen(1, 0, 1)]) for camera in range(40)])
    assert len(game.frames) == 1
    assert flaws(game)["skipped"] == 8


# --- what is not there ----------------------------------------------------------------------------


def test_vanishing_robots_and_absent_colours() -> None:
    """A body that is not seen is not there; samples without any robot, or one colour, stay."""
    said = [
        seen(0, yellow=[Seen(1, 0, 1), Seen(1, 1, 2)], blue=[Seen(-1, 0, 1)], balls=[Seen(0, 0)]),
        seen(1, yellow=[Seen(1, 0, 1)], blue=[Seen(-1, 0, 1)]),
        seen(2, yellow=[Seen(1, 0, 1)]),
        seen(3),
        seen(4, blue=[Seen(-1, 0, 1)], balls=[Seen(0, 0)]),
    ]
    game = match(said)
    assert game.frames.counts().tolist() == [3, 2, 1, 0, 1]
    assert ball_x(game) == [0.0, None, None, None, 0.0]
    assert len(game.info.periods) == 1


def test_no_robot_at_all() -> None:
    """A log with a ball only is a match of nobody."""
    game = match([seen(f, balls=[Seen(0.1 * f, 0)], geometry=GEOMETRY) for f in range(5)])
    assert game.frames.counts().tolist() == [0] * 5
    assert game.info.pitch.length == 9.0


def test_half_a_field() -> None:
    """The pitch is the geometry's also if cameras see one half of it, which is flagged."""
    game = match([seen(f, geometry=GEOMETRY, balls=[Seen(1.0, 0)], yellow=[Seen(0.5, 1, 1)], blue=[Seen(4.2, 0, 1)])
                  for f in range(5)])
    assert (game.info.pitch.length, game.info.pitch.width) == (9.0, 6.0)
    assert [p.home_attacks for p in game.info.periods] == [-1]  # blue stands nearer to the end at +x
    (flaw,) = game.quality.filter(flaw="half a pitch").iter_rows(named=True)
    assert (flaw["count"], flaw["start_ns"], flaw["end_ns"]) == (5, 0, game.frames.t_ns.max() + 1)
    assert flaw["note"].startswith("bodies were only seen at x > -0.9 m: the cameras show half the pitch")


@pytest.mark.parametrize(("x", "y", "said"), [
    ([-0.5, -4.0], 0.0, "x < 0.9 m"), ([-4.0, 4.0], 2.5, "y > -0.6 m"), ([-4.0, 4.0], -2.5, "y < 0.6 m"),
    ([-4.0, 4.0], 0.3, None), ([-0.4, 0.4], 0.0, None),
])
def test_which_half(x: list[float], y: float, said: str | None) -> None:
    """It is a half along or across; bodies near the middle tell nothing."""
    game = match([seen(f, geometry=GEOMETRY, balls=[Seen(x[f], y)], yellow=[Seen(x[f], y, 1)]) for f in range(2)])
    notes = game.quality.filter(flaw="half a pitch")["note"].to_list()
    assert [note.partition("seen at ")[2].partition(":")[0] for note in notes] == ([said] if said else [])


# --- several senders ------------------------------------------------------------------------------


def test_two_senders_at_once() -> None:
    """If two programs call their camera 0, the one with the most frames is read; the other is said."""
    ours = [seen(f, yellow=[Seen(1, 0, 1)], blue=[Seen(-1, 0, 1)]) for f in range(60)]
    other = [seen(f, later=0.003, yellow=[Seen(-3, 2, 1)]) for f in range(20, 50)]
    shifted = []
    for f, message in zip(range(20, 50), other, strict=True):  # it counts its frames by itself, by a clock of its own
        content = ssl.vision(9_000 + f, EPOCH + 77 + f * STEP, yellow=[Seen(-3, 2, 1)])
        shifted.append(message._replace(content=content))
    game = match(ordered(ours, shifted), YELLOW)
    assert game.frames.number.tolist() == list(range(60))
    assert {robots(game, f)[0] for f in range(60)} == {(0, 1, 1.0, 0.0)}
    assert game.quality.filter(flaw="skipped").select("count", "note").rows() == [
        (30, "frames of another sender of camera 0: who sent the most is read")]
    assert not {"clock leap ahead", "clock jump back"} & flaws(game).keys()


def test_a_sender_that_starts_anew() -> None:
    """A program that was restarted counts from 0 again, and is read on; so are frames that overtook each other."""
    said = [seen(f, yellow=[Seen(1, 0, 1)]) for f in range(60)]
    again = [m._replace(content=ssl.vision(n, EPOCH + (n + 60) * STEP, yellow=[Seen(1, 0, 1)]), received=ns((n + 60) * STEP))
             for n, m in enumerate(said)]
    swapped = [*said[:10], said[11], said[10], *said[12:]]
    game = match([m._replace(received=said[i].received) for i, m in enumerate(swapped)] + again)
    assert len(game.frames) == 120
    assert "skipped" not in flaws(game)


def test_a_while_without_anybody() -> None:
    """Both colours are absent for two seconds: the samples stay, empty, and play goes on with the same robots."""
    there = [seen(f, geometry=GEOMETRY, balls=[Seen(0.01 * f, 0)], yellow=[Seen(3, 0, 1)], blue=[Seen(-3, 0, 2)])
             for f in range(300)]
    nobody = [seen(f, balls=[Seen(0.01 * f, 0)]) for f in range(300)]
    game = match([nobody[f] if 100 <= f < 228 else there[f] for f in range(300)])
    assert game.frames.counts().tolist() == [2] * 100 + [0] * 128 + [2] * 72
    assert ball_x(game) == [round(0.01 * f, 3) for f in range(300)]
    assert game.info.complete
    assert robots(game, 99) == robots(game, 228) == [(0, 2, -3.0, 0.0), (1, 1, 3.0, 0.0)]


@pytest.mark.parametrize(("reach", "length"), [(4.3, 9.0), (5.8, 12.0), (0.7, 12.0)])
def test_without_geometry(reach: float, length: float) -> None:
    """The pitch is that of the division in whose reach the robots are, and said to be guessed."""
    game = match([seen(f, yellow=[Seen(reach, 0, 1)], blue=[Seen(-reach, 0, 1)]) for f in range(5)])
    assert (game.info.pitch.kind, game.info.pitch.length) == (Kind.SSL, length)
    assert game.info.settings["guessed"]
    given = match([seen(f, yellow=[Seen(reach, 0, 1)]) for f in range(5)], "[pitch]\nlength = 4\nwidth = 3")
    assert (given.info.pitch.length, given.info.pitch.width, given.info.settings["guessed"]) == (4.0, 3.0, {})


@pytest.mark.parametrize("never", [(0.1, 6, 1, 0.18), (300, 200, 20, 150), (9, 6, 0.005, 0.18)])
def test_geometry_that_changes(never: tuple[float, ...]) -> None:
    """The size that is said most often counts; one that no pitch has does not."""
    other, none = ssl.size(12, 9, 1.8, 0.18), ssl.size(*never)
    said = [seen(f, geometry=[none, GEOMETRY, other, GEOMETRY, none, none][f], yellow=[Seen(1, 0, 1)]) for f in range(6)]
    assert match(said).info.pitch.length == 9.0


@pytest.mark.parametrize("kind", [VISION_2010, ssl.VISION_2014])
def test_geometry_of_both_forms(kind: int) -> None:
    """Either form is known by what it says, whatever type the message has."""
    for geometry in (ssl.size(6.05, 4.05, 0.7, 0.18), ssl.legacy_size(6.05, 4.05, 0.7, 0.18)):
        said = [seen(f, geometry=geometry, yellow=[Seen(1, 0, 1)])._replace(kind=kind) for f in range(3)]
        pitch = match(said).info.pitch
        assert (pitch.length, pitch.width, pitch.goal_width, pitch.goal_depth) == (6.05, 4.05, 0.7, 0.18)


def test_unusable_detections() -> None:
    """Robots without a number, places that are no numbers and low confidences are left out; the rest stays."""
    nan = float("nan")
    said = [seen(0, balls=[Seen(nan, 0), Seen(0.5, 0, confidence=0.2)],
                 yellow=[Seen(1, 0), Seen(1, 0, 32), Seen(nan, 0, 4), Seen(1, 1, 5, confidence=0.4), Seen(2, 2, 6, nan)])]
    game = match(said, YELLOW)
    assert robots(game, 0) == [(0, 5, 1.0, 1.0), (0, 6, 2.0, 2.0)]
    assert np.isnan(game.frames.robots["theta"][1])
    assert flaws(game)["skipped"] == 2
    assert flaws(game)["not a number"] == 2
    strict = match(said, f"{YELLOW}[ssl]\nrobot_confidence = 0.5\nball_confidence = 0.5")
    assert robots(strict, 0) == [(0, 6, 2.0, 2.0)]
    assert ball_x(strict) == [None]


# --- the ball -------------------------------------------------------------------------------------


def balls(*places: list[tuple[float, float]], mapping: str = "") -> MatchLog:
    """A game whose frames have balls at these x, with these confidences."""
    return match([seen(f, balls=[Seen(x, 0, confidence=c) for x, c in at], yellow=[Seen(4, 2, 1)], blue=[Seen(-4, 2, 1)],
                       geometry=GEOMETRY) for f, at in enumerate(places)], mapping)


@pytest.mark.parametrize(("places", "wanted"), [
    # seen beside the ball it is another one, also when the ball is hidden and it is more confident
    ([[(0, 0.9)], [(0.02, 0.9), (3, 0.99)], [(0.04, 0.9), (3, 0.99)], [(3, 0.99)], [(3, 0.99)], [(0.1, 0.8), (3, 0.9)]],
     [0.0, 0.02, 0.04, None, None, 0.1]),
    # the ball is not seen: one that was not seen beside it takes its place at once, it was put there
    ([[(0, 0.9)], [(0.02, 0.9)], [(-4, 0.9)], [(-4, 0.9)]], [0.0, 0.02, -4.0, -4.0]),
    # a rival is the ball after the ball was not seen for a second
    ([[(0, 0.9), (3, 0.5)], *[[(3, 0.5)]] * 65], [0.0, *[None] * 64, 3.0]),
])
def test_which_ball(places: list[list[tuple[float, float]]], wanted: list[float | None]) -> None:
    """The ball stays the ball while others are seen beside it; each other is counted."""
    game = balls(*places)
    assert ball_x(game) == wanted
    others = sum(map(len, places)) - sum(x is not None for x in wanted)
    assert flaws(game).get("skipped", 0) == others


def test_a_ball_that_never_moved() -> None:
    """A thing that lies still loses against a rival that moves, however confident it is."""
    game = balls(*[[(3, 0.99), (-1 + 0.02 * f, 0.5)] for f in range(40)])
    assert ball_x(game)[0] == 3.0
    assert ball_x(game)[-1] == pytest.approx(-1 + 0.02 * 39, abs=1e-3)


def test_no_ball() -> None:
    """A log without a ball says so; no map can name one."""
    found = match([seen(frame, geometry=GEOMETRY, blue=[Seen(2.0, 0.1 * frame, 2, 3.0)]) for frame in range(40)])
    (flaw,) = found.quality.filter(flaw="ball lost").rows(named=True)
    assert flaw["note"] == "no ball was seen at all: no situation with it can be recognised"


def test_balls_beyond_the_pitch() -> None:
    """A ball more than a metre beyond the lines, or as far as a map says, is none."""
    assert ball_x(balls([(5.6, 0.9), (5.4, 0.3)])) == [5.4]
    assert ball_x(balls([(5.6, 0.9), (5.4, 0.3)], mapping="[ssl]\nbeyond = 2")) == [5.6]
    assert flaws(balls([(5.6, 0.9)]))["skipped"] == 1


def test_many_balls() -> None:
    """More balls than are followed at once: the ball stays the ball."""
    spare = [(0.2 * i - 4, 0.5) for i in range(40) if abs(0.2 * i - 4) > 0.3]
    assert ball_x(balls([(0, 0.9)], *[[(0.005 * f, 0.4), *spare] for f in range(1, 20)]))[-1] == pytest.approx(0.095, abs=1e-3)


# --- trackers -------------------------------------------------------------------------------------


def track(frame: int, x: float, uuid: str = "u-1", name: str | None = "TIGERs", **changes: object) -> Message:
    content = ssl.tracked(
        frame, EPOCH + frame * STEP, [Tracked(x, 0.5, 1.0, -1.0), Tracked(3, 3)],
        [Tracked(x, 1.0, 0.5, 0.25, 1, 4, 0.3, -2.0), Tracked(-x, 1.0, None, None, 2, 4, -0.3)],
        uuid=uuid, name=name, **changes,  # type: ignore[arg-type]
    )
    return Message(ns(frame * STEP) + 1, TRACKER, content)


@pytest.mark.parametrize("doubles", [False, True], ids=["floats", "doubles"])
def test_tracker(doubles: bool) -> None:
    """A tracker's bodies come with their velocities, and the match says whose they are; the first ball is the ball."""
    game = match(ordered(frames(20), [track(f, 1.0, doubles=doubles) for f in range(20)]), YELLOW)
    assert game.info.settings["source"] == {"tracker": "u-1", "name": "TIGERs"}
    ball, first = game.frames.ball[3], game.frames.robots[0]
    assert ball.tolist() == pytest.approx((1.0, 0.5, 1.0, -1.0))
    assert first.tolist() == pytest.approx((0, 4, 1.0, 1.0, 0.3, 0.5, 0.25, -2.0))
    assert np.isnan(game.frames.robots["vx"][1])
    assert len(game.frames) == 20
    assert game.info.pitch.length == 9.0  # vision's geometry


def test_which_source() -> None:
    """A tracker is preferred if it was there for nine tenths of the time; the one with the most frames, or the one
    that is asked for."""
    many = [track(f, 1.0) for f in range(100)]
    few = [track(f, 2.0, "u-2", "ER-Force") for f in range(0, 100, 2)]
    both = ordered(frames(100), many, few)

    def x(mapping: str) -> float:
        return round(float(match(both, mapping).frames.ball["x"][0]), 3)

    assert x("") == 1.0
    assert x('[ssl]\nsource = "tracker"') == 1.0
    assert x('[ssl]\nsource = "ER-Force"') == 2.0
    assert x('[ssl]\nsource = "u-2"') == 2.0
    assert x('[ssl]\nsource = "vision"') == -1.0
    late = ordered(frames(100), many[20:])
    assert match(late).info.settings["source"] == {"vision": "1 cameras"}
    assert match(late, '[ssl]\nsource = "tracker"').info.settings["source"] == {"tracker": "u-1", "name": "TIGERs"}
    trackers = match(both).info.settings["trackers"]
    assert trackers == [{"tracker": "u-1", "name": "TIGERs", "frames": 100},
                        {"tracker": "u-2", "name": "ER-Force", "frames": 50}]


@pytest.mark.parametrize(("messages", "source", "said"), [
    ([track(0, 1.0)], "Immortals", "has no tracker 'Immortals'; its trackers: TIGERs .u-1.. Give .ssl. source"),
    ([track(0, 1.0)], "vision", "has no vision frames; its trackers: TIGERs .u-1."),
    (frames(5), "tracker", "has no tracker's packets"),
    ([Message(ns(0), ssl.REFEREE, ssl.referee(0, 0, 1))], "", "has no vision or tracker frames, only 1 packets of a referee"),
])
def test_a_source_that_is_not_there(messages: list[Message], source: str, said: str) -> None:
    """A source that the log does not have is refused, with those that it has."""
    with pytest.raises(BadRecording, match=said):
        match(messages, f'[ssl]\nsource = "{source}"' if source else "")


def test_the_source_is_said(tmp_path: Path) -> None:
    """The receipt of a match, and so the line below the table of an import, names the source of its bodies."""
    for name, messages, said in (
        ("a.log", [track(f, 1.0) for f in range(5)], "the tracker TIGERs, uuid u-1"),
        ("b.log", [track(f, 1.0, name=None) for f in range(5)], "the tracker without a name, uuid u-1"),
        ("c.log", frames(5), "vision, 1 cameras"),
    ):
        (tmp_path / name).write_bytes(ssl.log(messages))
        receipt, *_ = take_in(Store(tmp_path / "data"), Recording(file=tmp_path / name))
        assert receipt.details["bodies"] == said


def test_what_a_tracker_only_guesses() -> None:
    """A body with visibility 0 is not seen; a map can ask for more. A body without visibility is."""
    def said(visibility: float | None) -> list[Message]:
        content = ssl.tracked(0, EPOCH, [Tracked(0, 0, visibility=visibility)],
                              [Tracked(1, 1, team=1, number=1, visibility=visibility)])
        return [Message(ns(0), TRACKER, content)]

    assert [match(said(v)).frames.counts().tolist() for v in (0.0, 0.4, None)] == [[0], [1], [1]]
    assert [ball_x(match(said(v))) for v in (0.0, 0.4, None)] == [[None], [0.0], [0.0]]
    assert match(said(0.4), "[ssl]\nvisibility = 0.5").frames.counts().tolist() == [0]


def test_unusable_tracked_robots() -> None:
    """A robot without team or number is left out, and so is one that comes twice."""
    content = ssl.tracked(0, EPOCH, [], [
        Tracked(1, 1, team=1, number=1), Tracked(2, 2, team=1, number=1), Tracked(1, 1, team=0, number=2),
        Tracked(1, 1, team=2), Tracked(float("inf"), 1, team=2, number=3)])
    game = match([Message(ns(0), TRACKER, content)], YELLOW)
    assert robots(game, 0) == [(0, 1, 1.0, 1.0)]
    assert (flaws(game)["skipped"], flaws(game)["not a number"]) == (2, 1)


def test_started_at() -> None:
    """A match begins when its first sample was captured; a clock without a date gives none."""
    assert match(frames(3)).info.started_at.timestamp() == EPOCH  # type: ignore[union-attr]
    content = ssl.vision(0, 12.5, yellow=[Seen(1, 0, 1)])
    assert match([Message(ns(0), ssl.VISION_2014, content)]).info.started_at is None
    assert pl.Series(match(frames(3)).frames.t_ns).is_sorted()
