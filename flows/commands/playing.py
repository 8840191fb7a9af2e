"""Options of the commands that play matches: settings of matches and of teams."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any

from cyclopts import Parameter
from cyclopts.types import NonNegativeFloat, NonNegativeInt, NormFloat, PositiveInt
from cyclopts.validators import Number

from pitchlore.flows.commands.common import UserPath
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import MatchSettings, match_settings
from pitchlore.pipeline.arena.teams.clock import ClockSettings
from pitchlore.pipeline.arena.teams.constant import BEST, constant
from pitchlore.pipeline.arena.teams.table import SCRIPTED
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.toml import overlaid, toml_tables
from pitchlore.pipeline.engine.teams import entrant, playing
from pitchlore.pipeline.stages.evaluations import Entrant
from pitchlore.pipeline.store import Store

#: Words that name teams, for help texts.
TEAM_WORDS = f"{', '.join(SCRIPTED)}, learned, learned:3, constant:044, {BEST}, or a season's id"
#: Option of a command: a team that plays.
WhoPlays = Annotated[str, Parameter(help=f"Team: {TEAM_WORDS}.")]

#: Seed of the first of many matches. Twice the last one's, of an evaluation, is an integer of 64 bits.
Seed = Annotated[int, Parameter(validator=Number(gte=0, lte=1 << 61))]
#: Number of matches.
Many = Annotated[int, Parameter(validator=Number(gte=1, lte=1_000_000))]

#: Default length of a match, minutes; the paper's games take about as long.
MINUTES = 8.0


@Parameter(name="*")
@dataclass(frozen=True)
class Playing:
    """How matches are played.

    Attributes:
        settings: TOML file: how the matches differ from those of VSSS.
        minutes: Length of a match, minutes (default: from the settings, else 8, in `play` 2).
        robots: Robots per team (default: from the settings, else 3).
    """

    settings: UserPath | None = None
    minutes: Annotated[float | None, Parameter(validator=Number(gt=0, lt=math.inf))] = None
    robots: PositiveInt | None = None

    def matches(self, store: Store, minutes: float = MINUTES) -> MatchSettings:
        """The default match, overridden by the file, and the file by the options.

        Args:
            store: reads the file.
            minutes: length of a match if neither file nor option gives it.

        Raises:
            NotFound: if the file cannot be read.
            BadSettings: if it is not TOML, or a key or value does not fit.
        """
        said = _lasting(minutes)
        if self.settings is not None:
            said = overlaid(said, toml_tables(store.foreign(self.settings), str(self.settings)))
            match_settings(said, str(self.settings))
        if self.minutes is not None:
            said = overlaid(said, _lasting(self.minutes))
        if self.robots is not None:
            said["robots"] = self.robots
        return match_settings(said, "the options")


def _lasting(minutes: float) -> dict[str, Any]:
    return {"referee": {"duration_s": 60 * minutes}}


_LOOKS = "a team that looks (its policy's learner is \"sight\")"
_IN_STATES, _CONSTANT = "a team that looks behaviours up in states", "a constant team"
_CLOCK = tuple(ClockSettings.model_fields)
#: An option that the help leaves to docs/how-to/play.md.
_HIDDEN = Parameter(show=False)
#: Kinds of learned teams, and the options that each has.
_OPTIONS = {
    _LOOKS: ("explore", "predict_s", "clock_s"),
    _IN_STATES: ("explore", "lcb_weight", "min_visits", "predict_s", *_CLOCK),
    _CONSTANT: ("predict_s", *_CLOCK),
}


@Parameter(name="*")
@dataclass(frozen=True)
class Learners:
    """How learned teams play.

    The help shows two of them; docs/how-to/play.md explains all.

    Attributes:
        explore: Share of tries of learned teams. See docs/how-to/play.md for --clock-s, --lcb-weight,
            --min-visits, --least-s, --interrupts, --begin-ended.
        lcb_weight: Standard errors that a learned team subtracts from each value, for a lower confidence
            bound.
        min_visits: Visits of a state from which a learned team uses its finer key.
        predict_s: Seconds that a learned team reckons bodies ahead, for a late camera.
        clock_s: Seconds between decisions of a team that looks.
        least_s: Least time of a behaviour of a learned or constant team, seconds.
        interrupts: Winning or losing the ball, or another role, interrupts these behaviours.
        begin_ended: A robot begins codes whose end holds already.
    """

    explore: NormFloat | None = None
    lcb_weight: Annotated[NonNegativeFloat | None, _HIDDEN] = None
    min_visits: Annotated[NonNegativeInt | None, _HIDDEN] = None
    predict_s: NormFloat | None = None
    clock_s: Annotated[float | None, _HIDDEN, Parameter(validator=Number(gt=0, lt=math.inf))] = None
    least_s: Annotated[float | None, _HIDDEN, Parameter(validator=Number(gte=0, lt=math.inf))] = None
    interrupts: Annotated[bool | None, _HIDDEN] = None
    begin_ended: Annotated[bool | None, _HIDDEN] = None

    def entrants(self, store: Store, *words: str) -> tuple[list[Entrant], dict[str, PolicyTables]]:
        """The teams that words name, and the policies that they play by label.

        Each team gets those of the options that its kind has.

        Raises:
            NotFound, BadSettings: see :func:`pipeline.engine.teams.entrant`.
            BadSettings: if an option is given that none of the teams has.
        """
        policies: dict[str, PolicyTables] = {}
        asked = {name: value for name, value in asdict(self).items() if value is not None}
        named = [(word, entrant(store, word, policies)) for word in words]
        has = [_options(word, team, policies) for word, team in named]
        unknown = next((name for name in asked if not any(name in names for names in has)), None)
        if unknown is not None:
            having = [kind for kind, names in _OPTIONS.items() if unknown in names]
            verb = "has" if len(having) == 1 else "have"
            raise BadSettings(f"only {' and '.join(having)} {verb} this option", where=option(unknown),
                              next_step="Leave it out, or name such a team")
        return [playing(team, **{name: asked[name] for name in names if name in asked})
                for (_, team), names in zip(named, has, strict=True)], policies


def _options(word: str, team: Entrant, policies: Mapping[str, PolicyTables]) -> Sequence[str]:
    """The options that a team has: none without a policy."""
    policy = team.settings.policy
    if policy is None:
        return ()
    if constant(word) is not None:
        return _OPTIONS[_CONSTANT]
    return _OPTIONS[_LOOKS if policies[policy].appraisals is not None else _IN_STATES]


def option(name: str) -> str:
    """The option of a field."""
    return f"--{name.replace('_', '-')}"


AS_USUAL, AS_LEARNED = Playing(), Learners()
