"""Options of the commands that play matches: settings of matches and of teams."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import polars as pl
from cyclopts import Parameter
from cyclopts.types import NonNegativeFloat, NonNegativeInt, NormFloat, PositiveInt
from cyclopts.validators import Number

from flows.teams import entrant
from pipeline.arena.match.recipe import MatchSettings, match_settings
from pipeline.arena.teams.table import SCRIPTED
from pipeline.errors import BadSettings
from pipeline.settings import over, tables
from pipeline.store import Store
from pipeline.studies.evaluations import Entrant

#: Words that name teams, for help texts.
TEAM_WORDS = (
    f"{', '.join(SCRIPTED)}, learned (the newest policy), learned:3 or 3 (a version), or the id of a season "
    "(best-static-1) for its apprentice"
)
#: Option of a command: who plays.
WhoPlays = Annotated[str, Parameter(help=f"Team: {TEAM_WORDS}.")]

#: Of a match, unless a settings file or option says otherwise: the paper's games take about as long.
MINUTES = 8.0


@Parameter(name="*")
@dataclass(frozen=True)
class Playing:
    """How matches are played.

    Attributes:
        settings: TOML file with `robots` and the tables pitch, physics, referee and camera, as far as they
            differ from a VSSS match. `[pitch]` with `kind = "ssl"` sets another league's pitch only; its
            robots drive as in VSSS unless `[physics]` says otherwise.
        minutes: Length of a match, minutes (default: as the settings say, else 8, in `play` 2).
        robots: Robots per team (default: as the settings say, else 3).
    """

    settings: Path | None = None
    minutes: Annotated[float | None, Parameter(validator=Number(gt=0, lt=math.inf))] = None
    robots: PositiveInt | None = None

    def matches(self, store: Store, minutes: float = MINUTES) -> MatchSettings:
        """The usual match, what the file says on top of it, and the options on top of that.

        Args:
            store: that reads the file.
            minutes: of a match, if neither says.

        Raises:
            NotFound: if the file cannot be read.
            BadSettings: if it is not TOML, or a key or value does not fit.
        """
        said = _lasting(minutes)
        if self.settings is not None:
            said = over(said, tables(store.foreign(self.settings), str(self.settings)))
            match_settings(said, str(self.settings))
        if self.minutes is not None:
            said = over(said, _lasting(self.minutes))
        if self.robots is not None:
            said["robots"] = self.robots
        return match_settings(said, "the options")


def _lasting(minutes: float) -> dict[str, Any]:
    return {"referee": {"duration_s": 60 * minutes}}


@Parameter(name="*")
@dataclass(frozen=True)
class Learners:
    """How learned teams play.

    Attributes:
        explore: Chance that a learned team's robot tries any behaviour instead of the best (default 0).
        lcb_weight: Standard errors that a learned team takes off each value, a lower confidence bound
            (default as in its season, else 0).
        min_visits: Visits that a state needs to be looked up by a finer key (default likewise).
    """

    explore: NormFloat | None = None
    lcb_weight: NonNegativeFloat | None = None
    min_visits: NonNegativeInt | None = None

    def entrants(self, store: Store, *words: str) -> tuple[list[Entrant], Mapping[str, pl.DataFrame]]:
        """The teams that words name, and the policies that they play by label.

        Raises:
            NotFound, BadSettings: see :func:`flows.teams.entrant`.
            BadSettings: if none of them has learned anything, and yet it is said how learned teams play.
        """
        policies: dict[str, pl.DataFrame] = {}
        asked = asdict(self)
        teams = [entrant(store, word, policies, **asked) for word in words]
        said = ", ".join(f"--{name.replace('_', '-')}" for name, value in asked.items() if value is not None)
        if said and all(team.settings.kind != "learned" for team in teams):
            raise BadSettings(f"of {' and '.join(words)} none is a learned team", where=said,
                              next_step="Leave it out, or name learned, learned:VERSION or a season's id")
        return teams, policies


AS_USUAL, AS_LEARNED = Playing(), Learners()
