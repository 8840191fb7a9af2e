"""What the chain makes of known matches, to the last digit; `make golden` makes them anew."""

from __future__ import annotations

import difflib

import pytest
from golden.cases import CASES, HERE


@pytest.mark.parametrize("name", CASES)
def test_golden(name):
    wanted = (HERE / name).read_text(encoding="utf-8").splitlines()
    got = CASES[name]().splitlines()
    changes = list(difflib.unified_diff(wanted, got, "golden", "now", lineterm="", n=0))
    assert not changes, "\n".join(changes[:40])


def test_no_golden_is_orphaned():
    assert {str(p.relative_to(HERE)) for p in HERE.glob("*/*.txt")} == set(CASES)
