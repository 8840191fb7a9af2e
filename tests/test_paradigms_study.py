"""The study of section 5: a run of seconds."""

import pytest
from paradigms import study

pytestmark = pytest.mark.slow


def test_run(tmp_path):
    """The study plays each of its plans and writes; played again, nothing is played anew."""
    out, data = tmp_path / "out", tmp_path / "data"
    plan = (("--quick", "--figure", 5, "--runs", 2),)
    study.main(out, data, plan)
    assert {"figure-5-r2-quick.points.csv", "figure-5-r2-quick.verdicts.csv"} <= {path.name for path in out.iterdir()}
    before = {path: path.stat().st_mtime_ns for path in data.rglob("*.receipt.json")}
    assert before
    study.main(out, data, plan)
    assert before == {path: path.stat().st_mtime_ns for path in data.rglob("*.receipt.json")}
    assert [words[:2] for words in study.PLAN] == [(), ("--figure", 4), ("--figure", 6)]
