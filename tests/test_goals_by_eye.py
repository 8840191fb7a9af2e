"""Goals of five matches, attributed by two people's eyes and by the pipeline."""

from functools import cache

import polars as pl
import pytest
from conftest import ROOT
from support.handmade import derived
from support.recordings import RCSS, RSIM, SSL, read, recording

VERDICTS = pl.read_csv(ROOT / "data" / "studies" / "labels" / "goals.csv")
PLAYED = ("static-static.mcap", "static-human-like.mcap")
#: Goals of which the pipeline says another kind than both judges: it sees a touch that they do not.
OTHER_KIND = {25, 27, 42, 47}


@cache
def attributed(name: str) -> pl.DataFrame:
    """Verdicts of a match beside what the pipeline says."""
    if name in PLAYED:
        data = (ROOT / "tests" / "recordings" / "goals" / name).read_bytes()
    else:
        data = recording(name)
    log = read(data, name)
    other = pl.col("team").replace({"home": "away", "away": "home"})
    ours = derived(log)["goals"].select(
        "t_ns", "robot", pl.col("kind").cast(pl.String), of=pl.when(pl.col("kind") == "error").then(
            other.cast(pl.String)).otherwise(pl.col("team").cast(pl.String)))
    return VERDICTS.filter(pl.col("recording") == name).join(ours, on="t_ns", validate="1:1")


@pytest.mark.parametrize("name", [RSIM, SSL, RCSS, *PLAYED])
def test_maker(name):
    """Each goal is given to the robot that both judges saw make it."""
    goals = attributed(name)
    assert goals.height == VERDICTS.filter(pl.col("recording") == name).height > 0
    assert goals["robot"].null_count() == 0, "every goal was made by somebody"
    agreed = goals.filter(pl.col("a_robot") == pl.col("b_robot"), pl.col("a_team") == pl.col("b_team"))
    assert agreed.select("goal", team="of", robot=pl.col("robot").cast(pl.Int64)).rows() == agreed.select(
        "goal", "a_team", "a_robot").rows()


@pytest.mark.parametrize("name", [RSIM, SSL, RCSS, *PLAYED])
def test_kind(name):
    """Where the judges agree, the kind is theirs, but for the goals named above."""
    agreed = attributed(name).filter(pl.col("a_kind") == pl.col("b_kind"))
    differ = agreed.filter(pl.col("kind") != pl.col("a_kind"))["goal"].to_list()
    assert set(differ) == OTHER_KIND & set(agreed["goal"].to_list())
