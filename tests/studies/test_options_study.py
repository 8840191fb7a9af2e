"""The study of options runs: its ratios, its classes, its table."""

import polars as pl
import pytest
from options import alike, dealt, shipped, study

from pitchlore.pipeline.stages.options.likelihood import ratios_to_bytes, shipped_ratios


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """This process compiles; those of the study find it."""
    dealt.rows(dealt.Job(1, noisy=False, every=1, seconds=2.0))


def test_ratios(tmp_path):
    """Trees are fitted to matches of dealt teams, and written as those that are shipped."""
    shipped.main(tmp_path / "ratios.npz", matches=2, seconds=6.0, trees=2)
    assert (tmp_path / "ratios.npz").stat().st_size > 1000
    assert ratios_to_bytes(shipped_ratios())[:2] == (tmp_path / "ratios.npz").read_bytes()[:2]


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
