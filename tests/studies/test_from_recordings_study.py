"""The study of teams from recordings runs: copies, controls, one table; what was done is not done again."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from from_recordings import rebuilt, study


def test_table(tmp_path, monkeypatch):
    """A constant team is recorded; what is learned from it, and its controls, play static."""
    monkeypatch.setattr(study, "workers", lambda: ThreadPoolExecutor(1))
    small = study.Study(tmp_path / "data", recorded=(1,), pairs=2, seconds=20.0)
    table = study.main(small, tmp_path, teams=("best-constant",))
    assert table["team"].to_list() == [
        "itself", "copy", "copy, noisy camera", "recognised codes, Sarsa", "copy, clues shuffled"]
    assert table["recordings"].to_list() == [0, 1, 1, 1, 1]
    assert table["matches"].unique().to_list() == [4]
    assert study.main(small, tmp_path, teams=("best-constant",)).equals(table)


def test_rebuilt(tmp_path, monkeypatch):
    """Policies play an original and its copy, and matches are described: a row for each comparison."""
    monkeypatch.setattr(rebuilt, "workers", lambda: ThreadPoolExecutor(1))
    small = study.Study(tmp_path / "data", recorded=(1,), seconds=20.0)
    sizes = rebuilt.Rebuilt(small, ("static", "constant:044", "random"), pairs=1, described=2, minutes=0.1, halvings=2)
    tables = rebuilt.main(sizes, tmp_path, ("best-constant", "static"))
    assert tables["rebuilt-leads"].height == 2 * 3 * 3
    assert tables["rebuilt"].group_by("demonstrator").len()["len"].to_list() == [3, 3]
    assert tables["rebuilt-told"].height == 2 * len(rebuilt.DESCRIPTIONS)


def test_told():
    """Teams of other habits are always told apart, halves of one team are not; leads of one order are correlated."""
    rng = np.random.default_rng(0)
    one, same, other = (rng.normal(mean, 1, (40, 5)) for mean in (0, 0, 9))
    assert rebuilt.told(one, other, rng) == 1.0
    assert rebuilt.told(one, same, rng) == pytest.approx(0.5, abs=0.1)
    leads = np.arange(10.0)
    assert rebuilt.correlation(leads, leads**3) == pytest.approx({"spearman": 1, "low": 1, "high": 1})
    found = rebuilt.correlation(leads, np.array([1, 0, 3, 2, 5, 4, 7, 6, 9, 8]))
    assert found["spearman"] == pytest.approx(1 - 6 * 10 / 990)
    assert found["low"] < found["spearman"] < found["high"] <= 1
