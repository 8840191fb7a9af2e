"""Options of a minute of the recorded match, beside the recogniser's situations."""

import polars as pl
import pytest
from support.recordings import RSIM, bodies_of

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import OptionSettings, SituationSettings
from pitchlore.pipeline.stages.options.likelihood import shipped_ratios
from pitchlore.pipeline.stages.options.recover import options
from pitchlore.pipeline.stages.situations.recognise import recognise

VSSS, SETTINGS = PITCHES[Kind.VSSS], OptionSettings()


@pytest.fixture(scope="module")
def table():
    return bodies_of(RSIM).filter(pl.col("t_ns") < 60e9)


@pytest.mark.benchmark(group="options and situations")
def test_ours_options(timed, table):
    timed(60, "seconds of play", lambda: options(table, VSSS, SETTINGS, shipped_ratios()), rounds=5, warmup_rounds=1)


@pytest.mark.benchmark(group="options and situations")
def test_situations(timed, table):
    timed(60, "seconds of play", lambda: recognise(table, VSSS, SituationSettings()), rounds=5, warmup_rounds=1)
