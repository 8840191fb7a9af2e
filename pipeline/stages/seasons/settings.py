"""Settings of a season: its games, its opponents, and how the apprentice learns."""

from __future__ import annotations

from importlib.resources import files
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pitchlore.pipeline.arena.teams.clock import PAPER, ClockSettings
from pitchlore.pipeline.base.bounds import MANY, Amount, Count, Seconds
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.base.text import did_you_mean
from pitchlore.pipeline.base.toml import Frozen, fitted, overlaid, toml_tables
from pitchlore.pipeline.settings import Settings, none_twice
from pitchlore.schemas.seasons import PERSON

#: Seeds reserved for the matches of one season, and of one game.
_SEEDS_A_SEASON = 100_000
_SEEDS_A_GAME = 100
#: Settings of stages whose defaults are others in a season: its apprentices learn by what they try.
_LEARNS: dict[str, Any] = {"policies": {"learner": "sarsa"}}
#: The opponent that is the apprentice itself, with the policy of the game before.
ITSELF = "itself"


class SeasonSettings(MatchSettings):
    """Settings of a season (paper, sections 4 and 6, Figure 2).

    Its matches have ``MatchSettings``: by default three a side on a VSSS pitch. The paper's games take about
    eight minutes.

    Attributes:
        games: number of games; the paper plays 35.
        opponents: words of opponents if the command names none, each in seasons of its own.
        lead: goals that the apprentice is ahead by at the start of a game.
        lead_from: first game with this lead; earlier games start 0 : 0. The paper changes the score against
            its static opponent at game 11.
        lead_against: names of opponents against which the apprentice has the lead.
        practice: further matches beside each game, for learning only; the tables do not count them.
        explore: probability in the first game that a robot takes any behaviour that it knows for a state
            instead of the best.
        explore_last: the same in the last game; between them it changes linearly. Practice matches explore
            as much; see ``explore_counted`` for the game itself.
        explore_s: how long an apprentice that appraises what it sees holds what it tries, seconds.
        posterior_std: standard deviation of a value known from one episode, goals. The apprentice draws its
            values from this posterior at each restart.
        lcb_weight: goals subtracted from a value known from one episode, in the counted match of a game.
        explore_counted: whether the counted match of a game explores, too, and draws values.
        min_visits: least visits of a state to be looked up by a finer key.
        clock: when an apprentice decides that looks behaviours up in states; by default as in the paper.
        clock_s: time between decisions of an apprentice that appraises what it sees.
        predict_s: how far ahead the apprentice predicts bodies, because its camera is late.
        pipeline: settings of all stages; the learner is "sarsa" unless they say so.
    """

    games: int = Field(default=35, ge=1, le=1_000_000)
    opponents: Annotated[tuple[str, ...], AfterValidator(none_twice)] = Field(
        default=("static",), min_length=1)
    lead: int = Field(default=0, ge=0, le=MANY)
    lead_from: Count = 11
    lead_against: tuple[str, ...] = ("static",)
    practice: int = Field(default=0, ge=0, lt=_SEEDS_A_GAME)
    explore: float = Field(default=0.1, ge=0, le=1)
    explore_last: float = Field(default=0.1, ge=0, le=1)
    explore_s: float = Field(default=0.0, ge=0, le=10, exclude_if=lambda explore_s: explore_s == 0)
    posterior_std: Amount = 0.0
    lcb_weight: Amount = 0.0
    explore_counted: bool = True
    min_visits: int = Field(default=0, ge=0, le=MANY)
    clock: ClockSettings = Field(default=PAPER, exclude_if=lambda clock: clock == PAPER)
    clock_s: Seconds = 0.5
    predict_s: float = Field(default=0.0, ge=0, le=1, exclude_if=lambda predict_s: predict_s == 0)
    pipeline: Settings = Settings.model_validate(_LEARNS)

    @model_validator(mode="before")
    @classmethod
    def _learns(cls, said: Any) -> Any:
        """The settings, with the defaults of a season for its stages."""
        own = said.get("pipeline", {}) if isinstance(said, dict) else None
        return said | {"pipeline": overlaid(_LEARNS, own)} if isinstance(own, dict) else said

    @property
    def matches_a_game(self) -> int:
        """Matches of a game: the counted one, and those for learning only."""
        return 1 + self.practice


class Rival(Frozen):
    """An opponent as it plays.

    Attributes:
        word: its word, as people call it.
        team: the team. :data:`ITSELF` plays as the apprentice does in each game, without exploration.
    """

    word: str
    team: TeamSettings


class StartingTeam(Frozen):
    """An imitation as which an apprentice begins a season.

    Attributes:
        word: its word, imitated:NAME.
        policy, knowledge: versions in the imitation's folder.
        label: the policy's name in recipes.
    """

    word: str
    policy: int
    knowledge: int
    label: str


class Season(Frozen):
    """One season: settings, opponent and seed.

    Attributes:
        name: name of the settings.
        opponent: name of the opponent: a script's, :data:`PERSON`, or that of its rivals.
        start: the imitation as which the apprentice begins; None: it begins with nothing.
        rivals: opponents that are neither a script nor a person, or that take turns: each plays every so
            manyth game.
        seed: seed of everything random but what a person does; seasons of several people have their own.
        settings: settings of the season.
    """

    name: str
    opponent: str
    start: StartingTeam | None = Field(default=None, exclude_if=lambda start: start is None)
    rivals: tuple[Rival, ...] = Field(default=(), exclude_if=lambda rivals: not rivals)
    seed: int = Field(ge=0, lt=10_000)
    settings: SeasonSettings

    @property
    def id(self) -> str:
        """Name of the season: settings, opponent and seed."""
        return f"{self.name}-{self.opponent}-{self.seed}"

    def rival(self, game: int) -> Rival:
        """The opponent in a game (the first is 1)."""
        if self.rivals:
            return self.rivals[(game - 1) % len(self.rivals)]
        kind = "human" if self.opponent == PERSON else self.opponent
        return Rival(word=self.opponent, team=TeamSettings.model_validate({"kind": kind}))

    @property
    def grows(self) -> bool:
        """True if more games can be added: exploration is the same in all games."""
        return self.settings.explore == self.settings.explore_last

    def of_each_game(self) -> dict[str, Any]:
        """Settings that determine the matches of a game and what is learned from them, for JSON.

        Opponents of other seasons are left out, and the number of games if the season can grow.
        """
        said = self.model_dump(mode="json")
        del said["settings"]["opponents"]
        if self.grows:
            del said["settings"]["games"]
        return said

    def lead(self, game: int) -> int:
        """Goals that the apprentice is ahead by at the start of a game (the first is 1)."""
        own = self.settings
        return own.lead if self.opponent in own.lead_against and game >= own.lead_from else 0

    def recipes(self, game: int, policy: str | None) -> list[Recipe]:
        """Matches of a game, the counted one first; the apprentice is home.

        Args:
            game: number of the game, from 1.
            policy: label of the apprentice's policy; None if it has none.
        """
        own = self.settings
        along = (game - 1) / max(own.games - 1, 1)
        explore = own.explore + along * (own.explore_last - own.explore)
        first = self.seed * _SEEDS_A_SEASON + game * _SEEDS_A_GAME
        rival = self.rival(game)
        plays = TeamSettings(kind="learned", policy=policy, min_visits=own.min_visits, clock=own.clock,
                             clock_s=own.clock_s, predict_s=own.predict_s)
        explores = [own.explore_counted, *[True] * own.practice]
        return [
            Recipe(
                home=plays.model_copy(update={
                    "explore": explore if tries else 0.0,
                    "posterior_std": own.posterior_std if tries else 0.0,
                    "lcb_weight": own.lcb_weight if match == 0 else 0.0,
                    "explore_s": own.explore_s if tries else 0.0,
                }),
                away=plays if rival.word == ITSELF else rival.team,
                seed=first + match, score=(self.lead(game), 0), **own.of_match(),
            )
            for match, tries in enumerate(explores)
        ]  # fmt: skip


def names() -> list[str]:
    """Names of the settings in the package."""
    folder = files("pitchlore.pipeline.stages.seasons").joinpath("named")
    return sorted(path.name.removesuffix(".toml") for path in folder.iterdir() if path.name.endswith(".toml"))


def named_settings(name: str) -> SeasonSettings:
    """Settings in the package, by name.

    Raises:
        NotFound: if there are none of this name.
    """
    return parse_season(_text(name), where=f"{name}.toml")


def parse_season(data: bytes | str, where: str) -> SeasonSettings:
    """Settings from TOML; ``base`` names settings in the package from which the file differs.

    Raises:
        BadSettings: if it is not TOML, or a key or value does not fit.
        NotFound: if there are no settings of the name ``base``.
    """
    return fitted(
        SeasonSettings, _unfolded(toml_tables(data, where)), where,
        "Mend it; docs/how-to/settings.md says where all keys are")


def _unfolded(said: dict[str, Any]) -> dict[str, Any]:
    base = said.pop("base", None)
    return said if base is None else overlaid(_unfolded(toml_tables(_text(base), f"{base}.toml")), said)


def _text(name: str) -> str:
    if name not in names():
        raise NotFound(
            f"there are no settings {name!r}{did_you_mean(name, names())}",
            next_step=f"Name a file, or one of {', '.join(names())}")
    folder = files("pitchlore.pipeline.stages.seasons").joinpath("named")
    return folder.joinpath(f"{name}.toml").read_text(encoding="utf-8")
