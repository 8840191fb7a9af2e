"""How matches are played, from a file and from options: other pitches, numbers of robots, and a camera."""

import json

import numpy as np
import pytest

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.recipe import MatchSettings, match_settings
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.toml import toml_tables
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.store import Store


def settings(text):
    return match_settings(toml_tables(text, "here"), "here")


@pytest.fixture
def recorded(tmp_path, call):
    """Record by a settings file; what the command says, and the logs."""

    def run(text, *words):
        (tmp_path / "match.toml").write_text(text)
        code, out, _ = call("record", "--settings", tmp_path / "match.toml", *words, "--json", "--data", tmp_path / "data")
        assert code == 0
        rows, store = json.loads(out), Store(tmp_path / "data")
        return rows, [log.read(store.read(store.receipt("matches", row["match_id"]), "log"), where="log") for row in rows]

    return run


def test_defaults():
    """An empty file gives the default settings."""
    assert settings("") == MatchSettings()


@pytest.mark.parametrize(("text", "pitch"), [
    ('[pitch]\nkind = "ssl"', PITCHES[Kind.SSL]),
    ('[pitch]\nkind = "2d"', PITCHES[Kind.SIM2D]),
    ("[pitch]\nlength = 2.2\nwidth = 1.8", PITCHES[Kind.VSSS].model_copy(update={"length": 2.2, "width": 1.8})),
    ('[pitch]\nkind = "ssl"\nlength = 9.0', PITCHES[Kind.SSL].model_copy(update={"length": 9.0})),
])
def test_pitch(text, pitch):
    """A pitch is named by its league, by numbers, or by both."""
    assert settings(text) == MatchSettings(pitch=pitch)


@pytest.mark.parametrize(("text", "words"), [
    ("[pitch]\nlenght = 3", r"pitch\.lenght: there is no such key \(did you mean length\?\)"),
    ("[cammera]\nlatency_s = 0.1", r"cammera: there is no such key \(did you mean camera\?\)"),
    ('[pitch]\nkind = "3d"', "pitch.kind: input should be 'vsss', 'ssl', '2d' or 'human'"),
    ("[pitch]\nlength = inf", r"pitch\.length: input should be a finite number"),
    ('pitch = "ssl"', "pitch: "),
    ("robots = 0", "robots: input should be greater than or equal to 1"),
    ("[camera]\nrobot_unseen = 1.0", r"camera\.robot_unseen: input should be less than 1"),
])
def test_bad_settings(text, words):
    """A setting that does not fit is one line of error."""
    with pytest.raises(BadSettings, match=f"^here: {words}.*It has robots and tables pitch, physics, referee, camera") as error:
        settings(text)
    assert "\n" not in str(error.value)


def test_six_a_side(recorded):
    """A whole match of six a side can be played on the pitch of another league."""
    text = 'robots = 6\n[pitch]\nkind = "ssl"\n[physics]\nwheel_speed = 3.0\n[referee]\nduration_s = 20.0'
    (row,), (match,) = recorded(text, "--away", "human-like")
    assert match.info.pitch == PITCHES[Kind.SSL]
    assert match.info.complete
    assert row["duration_s"] == 20.0
    assert "a second script" in row["note"]
    robots = match.frames.robots
    assert {(int(r["team"]), int(r["id"])) for r in robots[:12]} == {(team, n) for team in (0, 1) for n in range(1, 7)}
    assert np.abs(robots["x"]).max() < 6.0 + 0.18
    assert np.abs(robots["y"]).max() < 4.5
    speed = np.hypot(robots["vx"], robots["vy"])
    assert 2.0 < speed.max() < 4.0  # as fast as they were told that they can be


def test_through_a_camera(recorded):
    """A whole match can be played through a camera, and its log has what the camera saw."""
    text = "[referee]\nduration_s = 20.0\n[camera]\nposition_noise = 0.003\nrobot_unseen = 0.05\nball_unseen = 0.1"
    (row,), (match,) = recorded(text)
    (_,), (clear,) = recorded("[referee]\nduration_s = 20.0")
    assert row["note"] is None
    frames = match.frames
    assert len(frames.robots) / (6 * len(frames)) == pytest.approx(0.95, abs=0.01)
    assert np.isnan(frames.ball["x"]).mean() == pytest.approx(0.1, abs=0.03)
    assert len(clear.frames.robots) == 6 * len(clear.frames)
    # what a ball goes from frame to frame hardly changes; noise of 3 mm in three places does by 3 mm x √6
    jitter, smooth = (np.nanmedian(np.abs(np.diff(seen.ball["x"].astype(float), 2))) for seen in (frames, clear.frames))
    assert smooth < 0.0005
    assert jitter == pytest.approx(0.6745 * 0.003 * 6**0.5, rel=0.15)


def test_options_before_file(recorded):
    """Options go before the file."""
    rows, logs = recorded("robots = 5\n[referee]\nduration_s = 90.0", "--robots", "2", "--minutes", "0.05", "--matches", "2")
    assert [row["duration_s"] for row in rows] == [3.0, 3.0]
    assert all(len(match.frames.robots) == 4 * len(match.frames) for match in logs)


def test_evaluation_settings(tmp_path, call):
    """An evaluation is played by the same settings file."""
    (tmp_path / "match.toml").write_text('robots = 2\n[pitch]\nkind = "ssl"\n[referee]\nduration_s = 3.0')
    code, out, _ = call("evaluate", "--policy", "static", "--against", "human-like", "--matches", "2", "--on", "processes:1",
                        "--json", "--data", tmp_path / "data", "--settings", tmp_path / "match.toml")
    assert code == 0
    found = json.loads(out)
    assert found["minutes"] == 0.05
    assert "a second script" in found["note"]
    (receipt,) = Store(tmp_path / "data").receipts("evaluations")
    evaluation = receipt.settings["evaluation"]
    assert (evaluation["robots"], evaluation["pitch"]["length"]) == (2, 12.0)
