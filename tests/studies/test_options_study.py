"""The study of options runs: its ratios, its classes, its table."""

from functools import partial

import polars as pl
import pytest
from options import alike, dealt, drawn, shipped, study

from pitchlore.pipeline.settings import OptionSettings
from pitchlore.pipeline.stages.options.likelihood import ratios_to_bytes, shipped_ratios


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """This process compiles; those of the study find it."""
    dealt.rows(dealt.Job(1, noisy=False, every=1, seconds=2.0))


@pytest.mark.parametrize(("robots", "described"), [("arena", dealt.rows), ("measured", drawn.drawn_rows)])
def test_ratios(robots, described, tmp_path):
    """Trees are fitted to matches of dealt teams, in our arena or in any, and written as those that are shipped."""
    shipped.main(tmp_path / "ratios.npz", matches=2, seconds=6.0, trees=2, described=described)
    assert (tmp_path / "ratios.npz").stat().st_size > 1000
    assert ratios_to_bytes(shipped_ratios(robots))[:2] == (tmp_path / "ratios.npz").read_bytes()[:2]


def test_robots_are_measured():
    """Two minutes of an arena that was drawn show its motors, its limit of commands, and how thick its bodies are."""
    for seed in (4_483_001, 4_483_002):
        arena = drawn.drawn(seed)
        log = dealt.played(dealt.Job(seed, noisy=False, every=1, seconds=120.0), partial(drawn.into, arena))
        for own in dealt.known(log, OptionSettings(robots="measured")):
            shown = own.windows.robots
            assert shown.top == pytest.approx(min(arena.robots.top, 1.2), rel=0.05)
            assert shown.together == (arena.robots.together and arena.robots.top < 1.2)
            assert shown[4:7] == pytest.approx(arena.robots[4:7], abs=0.004)


def test_classes(tmp_path):
    """Each option has a class; those that drive alike share one."""
    alike.main(tmp_path / "alike.csv", matches=1, seconds=6.0)
    assert len(alike.classes(tmp_path / "alike.csv")) == 31
    assert len(set(alike.classes())) < 31


def test_table(tmp_path):
    """The table has the recogniser and a shuffle beside what is recovered."""
    study.main(tmp_path, tmp_path / "kappa.csv", ("constant:044/088/047",), count=1, seconds=8.0)
    table = pl.read_csv(tmp_path / "kappa.csv")
    assert table.height == 8
    assert table.filter(pl.col("options") == "classes")["recovered"].max() > table["shuffled"].abs().max()
