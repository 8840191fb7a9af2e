"""The study of omnidirectional robots: options that were driven are found again; its tables are whole."""

import numpy as np
import polars as pl
import pytest
from conftest import ROOT
from omnidirectional import learning, playing, straight, study
from omnidirectional.recording import HZ, recorded
from omnidirectional.world import Limits, Rolling, World

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.schemas.options import OPTIONS

STUDY = ROOT / "data" / "studies" / "omnidirectional"


def driven(path, seconds=40.0, robots=3):
    """A recording of robots that drive to the ball, or stand, by turns; the ball rolls elsewhere each second."""
    rng, frames = np.random.default_rng(0), int(seconds * HZ)
    places, speeds = rng.uniform(-3, 3, (2 * robots, 2)), np.zeros((2 * robots, 2))
    goes = rng.integers(0, 2, (frames // HZ + 1, 2 * robots))
    ball, rolls, rows, going = np.zeros(2), np.zeros(2), [], []
    for frame in range(frames):
        if frame % HZ == 0:
            rolls = rng.uniform(-3, 3, 2) - ball  # to another place in a second
        ball = ball + rolls / HZ
        away = ball - places
        far = np.linalg.norm(away, axis=1, keepdims=True) + 1e-9
        wanted = goes[frame // HZ][:, None] * away / far * np.minimum(np.sqrt(far), 1.5)
        speeds += np.clip(wanted - speeds, -5 / HZ, 5 / HZ)
        places += speeds / HZ
        going.append(goes[frame // HZ])
        common = {"frame": frame, "t": frame / HZ}
        rows.append({**common, "team": "ball", "player": None, "x": ball[0], "y": ball[1], "heading": None})
        rows += [{**common, "team": "one" if k < robots else "two", "player": k % robots, "x": x, "y": y, "heading": 0.0}
                 for k, (x, y) in enumerate(places)]
    pl.DataFrame(rows, infer_schema_length=None).write_parquet(path)
    return np.array(going)


@pytest.fixture(scope="module")
def match(tmp_path_factory):
    path = tmp_path_factory.mktemp("omnidirectional") / "ssl-driven.parquet"
    return driven(path), recorded(path)


def test_options_are_found(match):
    """The way to drive is told from motion, where robots drive in two ways by turns."""
    going, recording = match
    known = learning.windows(recording.stretches, 0, recording.pitch.goal_x)
    told = learning.chained(known, 2).told(known)[1].argmax(axis=1)
    starts = np.array([round(each.start_s * HZ) for each in recording.stretches])
    first = starts[known.stretch] + known.sample + learning.WINDOW // 2
    home = 0 if recording.names[0] == "one" else 3
    done = going[first, home + known.robot - 1]
    assert max(np.mean(told == done), np.mean(told != done)) > 0.75


def test_tables(match, tmp_path):
    """Tables have all rows, and who goes straight to an executor's aim is explained by that executor."""
    _, recording = match
    whole = max(recording.stretches, key=lambda each: each.seconds)
    length = len(whole.places) // 4
    parts = [whole._replace(places=whole.places[k * length:(k + 1) * length], start_s=k * length / HZ) for k in range(4)]
    ahead = study.main(recording._replace(stretches=parts), tmp_path, counts=(2,))
    committed = pl.read_csv(STUDY / "ahead.csv")
    assert ahead.columns == committed.columns
    assert set(ahead["by"]) == set(committed["by"])
    error = dict(ahead.filter(of="place after 0.5 s, cm").select("by", "error").iter_rows())
    assert error["the habitual options"] < error["the last velocity"] < error["standing still"]
    assert error["the option that the motion shows"] < error["the option before, carried on; options dealt anew"]


def test_executors_go_straight():
    """The executor that reaches the ball drives there sideways as well; the one that stands stops."""
    view = np.zeros((3, 6))
    view[0, :2], view[1, 3], view[2, 0] = (0.0, 2.0), 1.0, 4.0
    packed = Measures.of(PITCHES[Kind.SSL], top=2.0, axle=0.16, acceleration=4.0, frame_s=1 / HZ).packed()
    codes = np.array([OPTIONS[0], 44, 184])
    way = straight.ways(view[None], np.array([1]), codes, packed, 2.0, 4.0, np.array([30, 120]), HZ)[0]
    assert way[1, 1] == pytest.approx([0.1, 2.0], abs=0.1)
    assert way[2, 0] == pytest.approx(way[2, 1])


def world(kicks, front_s=1.0):
    """Two robots; home's heads to +x with the ball at its front, away's stands at the other goal."""
    start = np.zeros((3, 6))
    start[1, 0], start[2, :2], start[2, 2] = -0.115, (4.0, 3.0), np.pi
    can = Limits(2.0, 4.0, np.array([5.0]), kicks, 0.0, front_s)
    return World(PITCHES[Kind.SSL], (can, can), Rolling(0.3, 2.0), np.stack([start, start]), np.random.default_rng(0))


def test_world():
    """A robot keeps its limits and carries the ball; a kicked ball slows down, and is a goal; then all stand as at first."""
    carries = world(kicks=0)
    carries.kick_off(0)
    speeds = []
    for _ in range(HZ):
        carries.frame(np.array([[9.0, 0.0], [0.0, 0.0]]), np.zeros(2))
        speeds.append(carries.bodies[1, 3])
    assert np.diff(speeds).max() <= 4.0 / HZ + 1e-9
    assert max(speeds) <= 2.0 + 1e-9
    assert carries.bodies[0, 0] - carries.bodies[1, 0] < 0.2
    assert carries.bodies[0, 0] > 0.8
    scores = world(kicks=1, front_s=1 / HZ)
    scores.kick_off(0)
    hard = []
    while not scores.goals[0] and len(hard) < 5 * HZ:
        scores.frame(np.zeros((2, 2)), np.zeros(2))
        hard.append(scores.bodies[0, 3])
    assert scores.goals == [1, 0]
    assert scores.kicks == [1, 0]
    assert scores.restarted
    assert scores.bodies[1, 0] == pytest.approx(-0.115)
    assert max(hard) > 4.9 > 3.5 > hard[-2] > hard[-1]


def test_matches(match, tmp_path, monkeypatch):
    """Each way to play plays, standing and all; who stands at mean places stays there."""
    _, recording = match
    whole = max(recording.stretches, key=lambda each: each.seconds)
    first = recording.stretches[0]
    monkeypatch.setattr(playing, "_MIDDLE", 9.0)
    parts = recording._replace(stretches=[first, whole] if first is not whole else [whole, *recording.stretches[1:]])
    table = playing.main(parts, tmp_path, seeds=(1, 2), seconds=2.0, counts=(2,))
    committed = pl.read_csv(STUDY / "played.csv")
    assert table.columns == committed.columns
    assert set(table.select("home", "away", "of").rows()) == set(committed.select("home", "away", "of").rows())
    speed = dict(table.filter(away="standing", of="robot_speed_home").select("home", "mean").iter_rows())
    assert speed["habits"] > 0.1


def test_other_leagues_are_refused():
    """A recording of differential robots gets one line."""
    with pytest.raises(BadSettings, match="do not drive sideways"):
        recorded(ROOT / "data" / "samples" / "rsim-vss-3v3.parquet")
