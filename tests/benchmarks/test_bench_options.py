"""Options of a minute of the recorded match: ratios with and without sharing, and the whole beside the recogniser."""

import numpy as np
import polars as pl
import pytest
from support.recordings import RSIM, imported

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.numbers.trees import logits
from pitchlore.pipeline.settings import OptionSettings, SituationSettings, TrajectorySettings
from pitchlore.pipeline.stages.options.likelihood import shipped_ratios
from pitchlore.pipeline.stages.options.recover import options, ratios_of
from pitchlore.pipeline.stages.options.windows import bodies, windows_of
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.trajectories.derive import trajectories

VSSS, SETTINGS = PITCHES[Kind.VSSS], OptionSettings()


@pytest.fixture(scope="module")
def table():
    whole = trajectories(imported(RSIM), TrajectorySettings())[0]
    return whole.filter(pl.col("t_ns") < 60e9)


@pytest.fixture(scope="module")
def features(table):
    return windows_of(bodies(table, SETTINGS.sample_s), 0, VSSS, SETTINGS).features


@pytest.mark.benchmark(group="ratios of a team's options")
def test_ours(timed, features):
    timed(len(features), "windows", lambda: ratios_of(features, shipped_ratios()), rounds=5, warmup_rounds=1)


@pytest.mark.benchmark(group="ratios of a team's options")
def test_each_by_itself(timed, features):
    flat = features.reshape(-1, features.shape[2])
    assert np.isfinite(timed(len(features), "windows", lambda: logits(shipped_ratios(), flat), rounds=5)).all()


@pytest.mark.benchmark(group="options and situations")
def test_ours_options(timed, table):
    timed(60, "seconds of play", lambda: options(table, VSSS, SETTINGS, shipped_ratios()), rounds=5, warmup_rounds=1)


@pytest.mark.benchmark(group="options and situations")
def test_situations(timed, table):
    timed(60, "seconds of play", lambda: recognise(table, VSSS, SituationSettings()), rounds=5, warmup_rounds=1)
