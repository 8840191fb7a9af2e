"""Set-up and freeing of memory that the processes of a command share."""

import ctypes
import re
import subprocess
import sys
from pathlib import Path

import pytest

#: Keeps a few of many pieces, so that what lies between them is free and no heap can shrink.
_PIECES = """
import re
from pitchlore.pipeline.base.system import give_back
def held():
    return int(re.search(r"RssAnon:\\s+(\\d+)", open("/proc/self/status").read()).group(1)) / 1000
pieces = [bytearray(100_000) for _ in range(2_000)]
kept = pieces[::50]
before = held()
del pieces
freed = held()
give_back()
print(before, freed, held())
"""


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="not glibc")
def test_memory_is_given_back():
    """Memory that a process has freed in pieces goes back to the system; freeing alone keeps it."""
    said = subprocess.run([sys.executable, "-c", _PIECES], capture_output=True, text=True, check=True,
                          cwd=Path(__file__).parents[1])
    before, freed, now = map(float, re.findall(r"[\d.]+", said.stdout))
    assert freed > before - 50, "the control: it is kept"
    assert now < before - 150, "of 200 MB"
