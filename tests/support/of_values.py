"""Hand-made moments of play, and the rows they give."""

import numpy as np
import polars as pl
from support.rows import S, bodies, referee

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import MomentSettings
from pitchlore.pipeline.stages.values.moments import moments
from pitchlore.schemas import Moments
from pitchlore.schemas.values import FEATURES

VSSS = PITCHES[Kind.VSSS]
NAMES = list(FEATURES)


NOTHING = referee()


def tracks(until=10.0, each=0.5, spans=((0.0, 100.0),), **places):
    """Bodies that stand still; segment n from its first to its last second, nothing between."""
    places = places or {"ball": (0.25, 0.1), "home_1": (0.1, 0.2, 0.3, "m"), "away_1": (0.5, -0.1, 3.0, "m")}
    index = pl.lit(None, dtype=pl.Int32)
    for n, (lo, hi) in enumerate(spans):
        index = pl.when(pl.col("t_ns").is_between(round(lo * S), round(hi * S))).then(n).otherwise(index)
    return bodies(np.arange(0, until, each), **places).with_columns(segment=index.cast(pl.Int32))


def looked_at(table, events=NOTHING, **settings):
    return Moments.validate(moments(table, events, VSSS, MomentSettings(**settings)))
