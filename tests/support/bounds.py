"""Cost of a call: seconds, and the memory that this process takes more."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from support.processes import line, tell

ROOT = Path(__file__).parents[2]

_CALL = """
import json, resource, sys, time
from pathlib import Path
from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.tracking.mapping import load_map
from pitchlore.pipeline.store import Store
from recordings.make import FILES

for name, make in FILES.items():  # what is loaded and compiled once for all
    if not name.endswith((".toml", "mapped.csv")):
        read(open_source(make(), name))
print("ready", flush=True)
for line in sys.stdin:
    file, mapping = map(Path, json.loads(line))
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    def peak():
        (kb,) = (line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))
        return int(kb) / 1024
    before, begun, said = peak(), time.perf_counter(), "read"
    try:
        store = Store(Path("."))
        data = store.foreign(file, megabytes=1024)
        given = load_map(store.foreign(mapping).decode(errors="replace"), str(mapping)) if mapping.name else load_map("")
        read(open_source(data, file.name), given)
    except PitchloreError as error:
        said = f"{type(error).__name__}: {error}"
    print(json.dumps([said, time.perf_counter() - begun, peak() - before]), flush=True)
"""


class Reader:
    """A process that reads recordings, and says what that cost."""

    def __init__(self) -> None:
        here = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests"), *sys.path])}
        self.process = subprocess.Popen([sys.executable, "-c", _CALL], env=here, text=True, encoding="utf-8",
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert line(self.process) == "ready"

    def read(self, file: Path, mapping: Path | None = None) -> tuple[str, float, float]:
        """Outcome of reading a file; seconds; MiB."""
        tell(self.process, json.dumps([str(file), str(mapping or "")]))
        said: list[Any] = json.loads(line(self.process))
        return said[0], said[1], said[2]

    def close(self) -> None:
        """End the process."""
        self.process.communicate()
