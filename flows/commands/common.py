"""What all commands share: common options, output for people and for programs, progress bars."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import polars as pl
from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from pipeline.recognition.rules import TABLE_1
from pipeline.store import Store


@Parameter(name="*")
@dataclass(frozen=True)
class Common:
    """Options of every command.

    Attributes:
        data: The data folder.
        debug: Show tracebacks and Prefect's log.
    """

    data: Annotated[Path, Parameter(env_var="PITCHLORE_DATA")] = Path("data")
    debug: Annotated[bool, Parameter(negative=())] = False

    @property
    def store(self) -> Store:
        """The store in the data folder."""
        return Store(self.data)


def print_json(value: object) -> None:
    """Write a value as JSON to standard output, for programs."""
    json.dump(value, sys.stdout, indent=1, allow_nan=False, default=str)
    sys.stdout.write("\n")


def console() -> Console:
    """The terminal; a file or pipe gets lines that are not wrapped."""
    return Console() if sys.stdout.isatty() else Console(width=200)


def print_frame(frame: pl.DataFrame, title: str = "") -> None:
    """Write a table for people, every row."""
    table = Table(title=title or None, header_style="bold", title_justify="left")
    for name, dtype in frame.schema.items():
        table.add_column(name, justify="right" if dtype.is_numeric() else "left", overflow="fold")
    for row in frame.iter_rows():
        table.add_row(*map(_cell, row))
    console().print(table)


def spelt(codes: str) -> pl.Expr:
    """What a behaviour's codes mean, for people: column ``reads``."""
    names = {code: name.removeprefix("Robot ") for code, (name, _) in TABLE_1.items()}
    return pl.col(codes).list.eval(
        pl.element().replace_strict(names, return_dtype=pl.String)
    ).list.join(", ").alias("reads")


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value).replace("[", r"\[") if isinstance(value, (str, list)) else str(value)


class Bars:
    """Progress bars, one a stage that has something to do; a :class:`flows.stage.Listener`."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.bars: dict[str, TaskID] = {}

    def begin(self, noun: str, total: int) -> None:
        """Add to a stage's bar."""
        if not total:
            return
        if noun in self.bars:
            bar = self.progress.tasks[self.bars[noun]]
            self.progress.update(self.bars[noun], total=(bar.total or 0) + total)
        else:
            self.bars[noun] = self.progress.add_task(noun, total=total)

    def advance(self, noun: str, name: str) -> None:
        """Move a stage's bar on."""
        self.progress.advance(self.bars[noun])


@contextmanager
def bars() -> Iterator[Bars]:
    """Progress bars on standard error while a flow runs."""
    columns = (TextColumn("{task.description:>13}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True)) as progress:
        yield Bars(progress)
