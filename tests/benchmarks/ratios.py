"""Print what `make bench` measured as ratios: ours against each alternative of its group.

A benchmark says in ``extra_info`` how many ``units`` of work it did (``unit`` names them), else its time is
shown; one whose name holds the word ``ours`` is the one that the others of its group are compared with. The
``imports`` of a command are named beside it, in milliseconds.
"""

import json
import re
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any


def rate(benchmark: dict[str, Any]) -> float:
    """Units of work a second, by the fastest round."""
    return float(benchmark["extra_info"].get("units", 1)) / float(benchmark["stats"]["min"])


def is_ours(benchmark: dict[str, Any]) -> bool:
    """True if its name holds the word ours (and not behaviours)."""
    return re.search("(?<![a-z])ours(?![a-z])", benchmark["name"]) is not None


def main(path: str) -> None:
    """Print a Markdown table of a pytest-benchmark JSON file."""
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for benchmark in json.loads(Path(path).read_text(encoding="utf-8"))["benchmarks"]:
        groups[benchmark["group"] or benchmark["name"]].append(benchmark)
    print("| what | who | rate | ours is |\n|---|---|---|---|")
    for group, members in sorted(groups.items()):
        ours = max((rate(b) for b in members if is_ours(b)), default=None)
        for benchmark in sorted(members, key=rate, reverse=True):
            ratio = "" if ours is None or is_ours(benchmark) else f"{ours / rate(benchmark):,.2f}×"
            test, _, case = benchmark["name"].removeprefix("test_").partition("[")
            name = case.removesuffix("]") or test.replace("_", " ")
            print(f"| {group} | {name}{_imports(benchmark)} | {_shown(benchmark)} | {ratio} |")


def _shown(benchmark: dict[str, Any]) -> str:
    unit = benchmark["extra_info"].get("unit")
    return f"{rate(benchmark):,.0f} {unit}/s" if unit else f"{1 / rate(benchmark):.2f} s"


def _imports(benchmark: dict[str, Any]) -> str:
    found = benchmark["extra_info"].get("imports", {})
    return f" (imports [ms]: {', '.join(f'{package} {ms}' for package, ms in found.items())})" if found else ""


if __name__ == "__main__":
    main(sys.argv[1])
