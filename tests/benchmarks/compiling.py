"""Seconds of CPU that numba takes for the first import, run and played match of a machine, by function.

    python -m tests.benchmarks.compiling
"""

import os
import time
from collections import defaultdict
from tempfile import TemporaryDirectory

from numba.core import event

import pitchlore


class _Clock(event.Listener):
    """Seconds of each function without those of the functions that it calls."""

    def __init__(self):
        self.seconds, self.open = defaultdict(float), []

    def on_start(self, _):
        self.open.append([time.thread_time(), 0.0])

    def on_end(self, ended):
        begin, inner = self.open.pop()
        took = time.thread_time() - begin
        if self.open:
            self.open[-1][1] += took
        function = ended.data["dispatcher"].py_func
        self.seconds[f"{function.__module__}.{function.__qualname__}"] += took - inner


def main():
    clock = _Clock()
    event.register("numba:compile", clock)
    match = pitchlore.read("data/samples/rsim-vss-3v3.parquet")
    for what, make in {
        "import": lambda: match.situations, "behaviours": lambda: match.sequences,
        "a match": lambda: pitchlore.play("static", "human-like", minutes=0.1),
    }.items():
        make()
        print(f"{what}: {sum(clock.seconds.values()):.1f} s, {len(clock.seconds)} functions")
        for name, seconds in sorted(clock.seconds.items(), key=lambda row: -row[1])[:20]:
            print(f"  {seconds:6.2f} {name}")
        clock.seconds.clear()


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = folder
        from numba.core import config

        config.reload_config()
        main()
