"""A process that reads recordings, and says what that cost: seconds, and the memory that it takes more.

A line of standard input is a file and its map as JSON; the answer is the outcome, seconds and MiB.
"""

import json
import sys
import time
from pathlib import Path

from recordings.make import FILES

from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.tracking.mapping import load_map
from pitchlore.pipeline.store import Store


def peak() -> float:
    """Most memory since the last look began anew, MiB."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


def main() -> None:
    """Answer lines until there are no more."""
    for name, make in FILES.items():  # what is loaded and compiled once for all
        if not name.endswith((".toml", "mapped.csv")):
            read(open_source(make(), name))
    print("ready", flush=True)
    for line in sys.stdin:
        file, mapping = map(Path, json.loads(line))
        Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
        before, begun, said = peak(), time.perf_counter(), "read"
        try:
            store = Store(Path())
            data = store.foreign(file, megabytes=1024)
            given = load_map(store.foreign(mapping).decode(errors="replace"), str(mapping)) if mapping.name else load_map("")
            read(open_source(data, file.name), given)
        except PitchloreError as error:
            said = f"{type(error).__name__}: {error}"
        print(json.dumps([said, time.perf_counter() - begun, peak() - before]), flush=True)


if __name__ == "__main__":
    main()
