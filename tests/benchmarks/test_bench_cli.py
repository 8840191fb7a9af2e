"""How long a command takes from the shell's prompt and back, beside Python itself and the libraries it needs.

`python -X importtime` of each command names what it spends its start on: the heaviest packages are printed.
"""

from __future__ import annotations

import subprocess
import sys
from collections import Counter

import pytest
from conftest import SAMPLE

from flows.matches import Recording, import_recording
from pipeline.store import Store

COMMAND_LINE = "import sys; from flows.cli import main; main(sys.argv[1:])"
#: Packages that are named beside a command.
MOST = 6

#: Commands, and what each is measured beside.
COMMANDS = {
    "--help": ("--help",),
    "kb list": ("kb", "list"),
    "sql": ("sql", "select count(*) from matches"),
    "import, nothing new": ("import", str(SAMPLE)),
}
LIBRARIES = "import polars, duckdb"
BESIDE = {"--help": "pass", "kb list": LIBRARIES, "sql": LIBRARIES, "import, nothing new": "import prefect"}


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cli")
    import_recording(Store(folder), Recording(file=SAMPLE))
    return folder


def python(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True)


def heaviest(code: str, *words: str) -> dict[str, int]:
    """What a process imports: package to its own modules' milliseconds, the heaviest."""
    spent: Counter[str] = Counter()
    for line in python("-X", "importtime", "-c", code, *words).stderr.splitlines():
        own, _, name = line.removeprefix("import time:").partition("|")
        if line.startswith("import time:") and own.strip().isdigit():
            spent[name.rpartition("|")[2].strip().partition(".")[0]] += int(own)
    return {package: round(spent[package] / 1000) for package, _ in spent.most_common(MOST)}


def measure(benchmark, command: str, code: str, *words: str) -> None:
    benchmark.group = f"pitchlore {command}, from prompt to prompt"
    benchmark.extra_info.update(units=1000, unit="thousandths of a start", imports=heaviest(code, *words))
    benchmark.pedantic(lambda: python("-c", code, *words), rounds=5, warmup_rounds=1)
    shown = ", ".join(f"{package} {ms}" for package, ms in benchmark.extra_info["imports"].items())
    print(f"\n{benchmark.group}: {benchmark.stats.stats.min:.2f} s; imports [ms]: {shown}")


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: f"ours, {command}")
def test_ours(benchmark, data, command):
    measure(benchmark, command, COMMAND_LINE, *COMMANDS[command],
            *(("--data", str(data)) if command != "--help" else ()))


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: f"python -c '{BESIDE[command]}'")
def test_python(benchmark, command):
    measure(benchmark, command, BESIDE[command])
