"""The options of every command."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.placement.places import VARIABLE
from pitchlore.pipeline.settings import RunSettings, parse_settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.paths import check_root

#: Any of these makes a folder a data folder.
_SIGNS = ("*/*.receipt.json", "*/*/manifest.json", "quarantine/*.json", "catalog.duckdb", "inbox", "playing",
          "watching", "runs", "seasons", "server")
_OTHERWISE = "Name the data folder with --data, or fill this one: `pitchlore import FILE`"


#: An option without a value.
Flag = Annotated[bool, Parameter(negative=(), show_default=False)]


@Parameter(name="*")
@dataclass(frozen=True)
class Common:
    """Options of every command.

    Attributes:
        data: Data folder.
        debug: Show tracebacks and Prefect's log.
    """

    data: Annotated[Path, Parameter(env_var="PITCHLORE_DATA")] = Path("data")
    debug: Flag = False

    @property
    def store(self) -> Store:
        """The store in the data folder, for a command that makes something; the folder may be new.

        Raises:
            BadSettings: as for :func:`pipeline.store.paths.check_root`, or :class:`pipeline.store.Store`.
            StorageFailed: if it is in a bucket that cannot be reached.
        """
        store = Store(self.data)
        check_root(store.root)
        store.catch_up()
        return store

    @property
    def existing(self) -> Store:
        """The store in the data folder, for a command that looks at what is there.

        Raises:
            BadSettings: if it is not a folder.
            NotFound: if it does not exist, or holds nothing of a data folder.
            StorageFailed: if it is in a bucket that cannot be reached, and there is no copy.
        """
        store = Store(self.data)
        check_root(store.root)
        store.catch_up_or_say()
        if not store.root.exists():
            raise NotFound("there is no such folder", where=store.where, next_step=_OTHERWISE)
        if not any(next(store.root.glob(sign), None) for sign in _SIGNS):
            raise NotFound("is not a data folder, or nothing has been imported into it",
                           where=store.where, next_step=_OTHERWISE)
        return store

    def settings(self, path: Path | None) -> RunSettings:
        """The defaults, overridden by a TOML file.

        Raises:
            NotFound: if the file cannot be read.
            BadSettings: if it is not TOML, or has a key or value that does not fit.
        """
        if path is None:
            return RunSettings()
        return parse_settings(Files(path.parent).foreign(path), where=str(path))


DEFAULTS = Common()
#: Option: where pieces of work are done.
On = Annotated[str | None, Parameter(name="--on", show_default=False, help=(
    "Where work is done: threads:N, processes:N, dask:local:N or dask://HOST:PORT (default: what the "
    f"settings say, else {VARIABLE} in the environment, else processes, one for each core)."
))]  # fmt: skip
Json = Annotated[bool, Parameter(name="--json", negative=(), show_default=False)]
