"""The options of every command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter, Token

from pitchlore.flows.commands.printing import warn
from pitchlore.flows.left_out import leave_out
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.base.text import did_you_mean
from pitchlore.pipeline.base.toml import overlaid
from pitchlore.pipeline.engine.folder import existing
from pitchlore.pipeline.settings import RunSettings, parse_settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.paths import check_root, named_path
from pitchlore.schemas import SIDES

if TYPE_CHECKING:
    from pitchlore.pipeline.face.league import League


def _path(_type: object, words: Sequence[Token]) -> Path:
    return named_path(words[0].value)


#: A path that the user names (:func:`pipeline.store.paths.named_path`): the type of all of the command line.
UserPath = Annotated[Path, Parameter(converter=_path)]
#: Names of settings of a run.
NAMED = ("paper", "paper-literal")
#: Option: settings of the stages.
RunFile = Annotated[UserPath | None, Parameter(name="--settings", help=(
    f"Named settings ({', '.join(NAMED)}), or a TOML file with those that differ from the defaults."))]
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

    data: Annotated[UserPath, Parameter(env_var="PITCHLORE_DATA")] = Path("data")
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

        What is damaged is left out of its answer, with a line, and the exit code says so.

        Raises:
            BadSettings: if it is not a folder.
            NotFound: if it does not exist, or holds nothing of a data folder.
            StorageFailed: if it is in a bucket that cannot be reached, and there is no copy.
        """
        store = existing(self.data)
        store.leave_out = leave_out
        return store

    @property
    def league(self) -> League:
        """The league in the data folder, for a command that reads; errors as for :attr:`existing`."""
        from pitchlore.pipeline.face.league import League  # noqa: PLC0415 (other commands start sooner without it)

        return League(self.existing, say=warn)

    def settings(self, path: Path | None) -> RunSettings:
        """The defaults, overridden by a TOML file or by settings of a name in :data:`NAMED`.

        Raises:
            NotFound: if the file cannot be read, or there are no settings of that name.
            BadSettings: if it is not TOML, or has a key or value that does not fit.
        """
        if path is None:
            return RunSettings()
        word = str(path)
        if word in NAMED:
            return named_run(word)
        if not path.suffix and not path.exists():
            raise NotFound(f"there are no settings {word!r}{did_you_mean(word, NAMED)}",
                           next_step=f"Name a file, or one of {', '.join(NAMED)}")
        return parse_settings(Files(path.parent).foreign(path), where=str(path))


def named_run(name: str) -> RunSettings:
    """The paper's settings of a season (``pipeline/stages/seasons/named``), for recordings.

    Nothing is chosen in a recording, so both sides count, and what was seen is learned from, in all matches.
    """
    from pitchlore.pipeline.stages.seasons.settings import named_settings  # noqa: PLC0415 (it loads the arena)

    season = named_settings(name).pipeline.model_dump(exclude_unset=True)
    return RunSettings.model_validate(overlaid(season, {
        "sides": {"watch": SIDES}, "knowledge": {"accumulate": False},
        "policies": {"learn_from": "both", "last_matches": None}}))


DEFAULTS = Common()
#: Option: where pieces of work are done.
On = Annotated[str | None, Parameter(name="--on", show_default=False, help=(
    "Place of the work: threads:N, processes:N, dask:local:N or dask://HOST:PORT."
))]  # fmt: skip
Json = Annotated[bool, Parameter(name="--json", negative=(), show_default=False)]
