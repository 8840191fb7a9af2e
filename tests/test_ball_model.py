"""The model of the ball: known frictions and kicks are found again, also those of our own arena."""

import numpy as np
import pytest

import pitchlore
from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.toml import fitted, toml_tables
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.rows import pack
from pitchlore.pipeline.matches.frame import Frames
from pitchlore.pipeline.views.exports.ball_model import ball_model, physics_toml

SSL = PITCHES[Kind.SSL]


def kicks(count: int, sliding: float, rolling: float, *, noise: float = 0.002, robot: bool = False) -> Frames:
    """Kicks of 2 to 6 m/s in all directions, 1.5 s at 70 Hz each, half a second apart; perhaps a robot goes with the ball."""
    rng, parts, times = np.random.default_rng(3), [], []
    for kick in range(count):
        t = np.arange(105) / 70
        speed, angle = rng.uniform(2, 6), rng.uniform(-np.pi, np.pi)
        switch = 2 / 7 * speed / sliding if sliding else 0.0  # a solid sphere rolls at 5/7 of its speed
        before, after = np.minimum(t, switch), np.maximum(t - switch, 0)
        way = speed * t - sliding * before**2 / 2 - sliding * switch * after - rolling * after**2 / 2
        parts.append(np.column_stack([way * np.cos(angle), way * np.sin(angle)]) + rng.normal(0, noise, (len(t), 2)))
        times.append(t + 2 * kick)
    ball, t_ns = np.concatenate(parts), np.round(np.concatenate(times) * 1e9).astype(np.int64)
    there = np.arange(len(t_ns)) if robot else np.empty(0, np.int64)
    bodies = {"team": np.zeros(len(there), np.uint8), "id": np.ones(len(there), np.uint16), "x": ball[there, 0] + 0.1, "y": ball[there, 1]}
    return pack(np.arange(len(t_ns), dtype=np.uint32), t_ns, {"x": ball[:, 0], "y": ball[:, 1]}, there, bodies)


@pytest.mark.parametrize(("sliding", "rolling"), [(3.0, 0.26), (4.5, 0.4), (6.0, 0.1)])
def test_known_balls(sliding: float, rolling: float) -> None:
    """Friction, the share at which the ball rolls and the kicks' speeds are those that were put in; the file is settings."""
    model = ball_model(kicks(40, sliding, rolling), SSL, "x")
    assert model.sliding is not None
    assert model.share is not None
    assert model.kicked is not None
    assert model.rolling.value == pytest.approx(rolling, abs=0.03)
    assert model.rolling.low <= rolling + 0.02
    assert model.rolling.high >= rolling - 0.02
    assert model.sliding.value == pytest.approx(sliding, rel=0.08)
    assert model.share.value == pytest.approx(5 / 7, abs=0.03)
    assert len(model.kicks) > 30
    assert 1.85 <= model.kicks[0] <= model.kicked.value <= model.kicks[-1] <= 6.15
    text = physics_toml(model, "x")
    assert fitted(MatchSettings, toml_tables(text, "x"), "x", "").physics.rolling == pytest.approx(model.rolling.value, rel=1e-3)
    assert f"acc_slide = {-model.sliding.value:.3g}" in text


def test_what_is_no_slide() -> None:
    """A ball that only rolls has no slide; one that a robot is beside is not free; too few rolls are refused."""
    model = ball_model(kicks(20, 0.0, 0.3), SSL, "x")
    assert model.rolling.value == pytest.approx(0.3, abs=0.02)
    assert (model.sliding, len(model.kicks)) == (None, 0)
    with pytest.raises(BadRecording, match="x: has 0 free rolls of the ball, fewer than 5"):
        ball_model(kicks(20, 3.0, 0.3, robot=True), SSL, "x")


@pytest.mark.slow
def test_the_arena(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """The arena's own ball rolls as its settings say, and a match that is exported gives them back."""
    match = pitchlore.play(minutes=1.5, seed=3, arena=MatchSettings.model_validate({"physics": {"rolling": 0.7}}))
    (file,) = match.export("physics", tmp_path)
    told = fitted(MatchSettings, toml_tables(file.read_text(), "x"), "x", "").physics.rolling
    assert told == pytest.approx(0.7, abs=0.05)
