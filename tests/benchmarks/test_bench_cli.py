"""How long a command takes from the shell's prompt and back, beside Python itself and the libraries it needs.

`python -X importtime` of each command names what it spends its start on: the heaviest packages are listed.
"""

import subprocess
import sys
from collections import Counter

import pytest
from conftest import SAMPLE, clip
from support.processes import COMMAND_LINE

from pitchlore.flows.server import Keeper
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.store import Store

#: Ends the process where its first task would begin.
TO_THE_FIRST_TASK = "import os; from pitchlore.pipeline.engine import imports; imports.take_in = lambda *_: os._exit(0)\n"
#: Packages that are named beside a command.
MOST = 6

LIBRARIES = "import polars, duckdb"
#: Commands, and what each is measured beside.
COMMANDS = {
    "--help": (("--help",), "pass"),
    "kb list": (("kb", "list"), LIBRARIES),
    "sql": (("sql", "select count(*) from matches"), LIBRARIES),
    "import, nothing new": (("import", str(SAMPLE)), LIBRARIES),
}


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cli")
    take_in(Store(folder), Recording(file=SAMPLE))
    return folder


def python(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True)


def heaviest(code: str, *words: str) -> dict[str, int]:
    """Imports of a process: package to its own modules' milliseconds, the heaviest."""
    spent: Counter[str] = Counter()
    for line in python("-X", "importtime", "-c", code, *words).stderr.splitlines():
        own, _, name = line.removeprefix("import time:").partition("|")
        if line.startswith("import time:") and own.strip().isdigit():
            spent[name.rpartition("|")[2].strip().partition(".")[0]] += int(own)
    return {package: round(spent[package] / 1000) for package, _ in spent.most_common(MOST)}


def measure(benchmark, code: str, *words: str) -> None:
    benchmark.extra_info["imports"] = heaviest(code, *words)
    benchmark.pedantic(lambda: python("-c", code, *words), rounds=5, warmup_rounds=1)


CASES = [
    pytest.param(command, ours, id=f"ours, {command}" if ours else f"python -c '{beside}', beside {command}")
    for command, (_, beside) in COMMANDS.items() for ours in (True, False)
]


@pytest.mark.parametrize(("command", "ours"), CASES)
def test_prompt_to_prompt(benchmark, data, command, ours):
    words, beside = COMMANDS[command]
    benchmark.group = f"pitchlore {command}, from prompt to prompt"
    if not ours:
        measure(benchmark, beside)
    else:
        measure(benchmark, COMMAND_LINE, *words, *(("--data", str(data)) if command != "--help" else ()))


@pytest.mark.benchmark(group="pitchlore import, from prompt to the first task")
@pytest.mark.parametrize("server", ["ours", "ours, as a flow of the server that the folder keeps"])
def test_start(benchmark, tmp_path, server):
    clip(0.0, 5.0).write_csv(tmp_path / "derby.csv")
    if "keeps" in server:
        python("-c", COMMAND_LINE, "server", "start", "--data", str(tmp_path / "data"))
    measure(benchmark, TO_THE_FIRST_TASK + COMMAND_LINE, "import", str(tmp_path / "derby.csv"),
            "--data", str(tmp_path / "data"))
    Keeper(tmp_path / "data").stop()


@pytest.mark.benchmark(group="pitchlore import, from prompt to the first task")
def test_python_import_prefect(benchmark):
    measure(benchmark, "import prefect")
