"""The options of every command."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.errors import BadSettings
from pipeline.settings import Settings, parse_settings
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
        """The store in the data folder.

        Raises:
            BadSettings: if what is there is not a folder.
        """
        there = next((path for path in (self.data, *self.data.parents) if path.exists()), None)
        if there is not None and not there.is_dir():
            raise BadSettings("is not a folder", where=str(there),
                              next_step="Name the data folder with --data")
        return Store(self.data)

    def settings(self, path: Path | None) -> Settings:
        """The defaults, with what a TOML file says on top.

        Raises:
            NotFound: if the file cannot be read.
            BadSettings: if it is not TOML, or has a key or value that does not fit.
        """
        return Settings() if path is None else parse_settings(self.store.foreign(path), where=str(path))


DEFAULTS = Common()
Json = Annotated[bool, Parameter(name="--json", negative=())]
