"""Progress bars, and what is waited for: code that is compiled once on a machine."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rich.console import Console, RenderableType
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from pitchlore.pipeline.engine.progress import listener

#: Seconds after a compiled function was kept, for which the next is said to be compiled; few take longer.
_NEXT_S = 4.0
#: Line below the bars meanwhile. It indents as they do.
_COMPILING = Text(f"{'':>13} compiling, once on this machine", style="dim")


class Waiting(Progress):
    """Progress bars with a line below them while functions are compiled, by this process or another."""

    def __init__(self, *columns: TextColumn | BarColumn | MofNCompleteColumn | TimeElapsedColumn) -> None:
        self.ends = False
        self._kept, self._begun = Path(os.environ["NUMBA_CACHE_DIR"]), time.time()
        console = Console(stderr=True)
        # on a screen they make room for the answer, a file keeps them
        super().__init__(*columns, console=console, transient=console.is_terminal)

    def get_renderables(self) -> Iterable[RenderableType]:
        """The bars, and the line."""
        yield from super().get_renderables()
        if not self.ends and self._compiles():
            yield _COMPILING

    def _compiles(self) -> bool:
        """True if nothing was ever compiled here, or some function just now: numba keeps an index of each."""
        kept = 0.0
        for index in self._kept.glob("*/*.nbi"):
            with suppress(OSError):  # it is replaced
                kept = max(kept, index.stat().st_mtime)
        return not kept or kept > max(self._begun, time.time() - _NEXT_S)


class Bars:
    """Progress bars, one for each stage with work; a :class:`pipeline.engine.progress.Listener`."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.bars: dict[str, TaskID] = {}
        self.starting: TaskID | None = progress.add_task("starting", total=None)

    def begin(self, noun: str, total: int) -> None:
        """Add to a stage's bar."""
        if not total:
            return
        if self.starting is not None:
            self.progress.remove_task(self.starting)
            self.starting = None
        if noun in self.bars:
            bar = next(task for task in self.progress.tasks if task.id == self.bars[noun])
            self.progress.update(bar.id, total=(bar.total or 0) + total)
        else:
            self.bars[noun] = self.progress.add_task(noun, total=total)

    def advance(self, noun: str, name: str) -> None:
        """Move a stage's bar on."""
        self.progress.advance(self.bars[noun])

    def end(self) -> None:
        """Remove what is shown while nothing has begun."""
        if self.starting is not None:
            self.progress.remove_task(self.starting)
            self.starting = None


@contextmanager
def bars() -> Iterator[Bars]:
    """Progress bars on standard error, which hear the work of the body."""
    columns = (TextColumn("{task.description:>13}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Waiting(*columns) as progress:
        shown = Bars(progress)
        token = listener.set(shown)
        try:
            yield shown
        finally:
            listener.reset(token)
            progress.ends = True
            shown.end()
