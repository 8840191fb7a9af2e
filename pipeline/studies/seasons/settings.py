"""What a season is: how many games, against whom, and how the apprentice learns from them."""

from __future__ import annotations

from importlib.resources import files
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pipeline.errors import NotFound
from pipeline.settings import Frozen, Settings, fitted, none_twice, over, tables
from schemas.seasons import Opponent

#: Each game's matches have seeds of their own, so many to a season.
_SEEDS_A_SEASON = 100_000
_SEEDS_A_GAME = 100


class SeasonSettings(MatchSettings):
    """How a season is played and learned from (paper sections 4 and 6, Figure 2).

    Its matches are those of ``MatchSettings``: three a side on a VSSS pitch, if nothing is said; the
    paper's games take about eight minutes.

    Attributes:
        games: of a season; the paper plays 35.
        opponents: who is played against, each in seasons of its own, if nobody is named.
        lead: goals that the apprentice is ahead by at the start of a game.
        lead_from: first game at which it is; before, games start 0 : 0. The paper changes the score
            against its static opponent at game 11.
        lead_against: opponents against which it is.
        practice: further matches a game that are learned from as well but not counted in the tables.
        explore: chance that a robot takes any behaviour that it knows for a state instead of the best, at
            the first game.
        explore_last: the same at the last game; in between it changes evenly. Practice matches explore as
            much, the counted one does as ``explore_counted`` says.
        posterior_std: of the apprentice, see ``TeamSettings``: it draws values at each restart.
        lcb_weight: of the apprentice, likewise, in the counted match of a game.
        explore_counted: whether the counted match of a game explores, or draws values, too.
        min_visits: visits that a state needs at least to be looked up by a finer key.
        pipeline: settings of all stages.
    """

    games: int = Field(default=35, ge=1)
    opponents: Annotated[tuple[Opponent, ...], AfterValidator(none_twice)] = Field(
        default=("static",), min_length=1)
    lead: int = Field(default=0, ge=0)
    lead_from: int = Field(default=11, ge=1)
    lead_against: tuple[Opponent, ...] = ("static",)
    practice: int = Field(default=0, ge=0, lt=_SEEDS_A_GAME)
    explore: float = Field(default=0.1, ge=0, le=1)
    explore_last: float = Field(default=0.1, ge=0, le=1)
    posterior_std: float = Field(default=0.0, ge=0)
    lcb_weight: float = Field(default=0.0, ge=0)
    explore_counted: bool = True
    min_visits: int = Field(default=0, ge=0)
    pipeline: Settings = Settings()


class Season(Frozen):
    """One season: whose settings, against whom, by which chances.

    Attributes:
        name: of the settings.
        opponent: of all its games.
        seed: decides all that is left to chance.
        settings: how it is played.
    """

    name: str
    opponent: Opponent
    seed: int = Field(ge=0, lt=10_000)
    settings: SeasonSettings

    @property
    def id(self) -> str:
        """Settings, opponent and seed."""
        return f"{self.name}-{self.opponent}-{self.seed}"

    @property
    def grows(self) -> bool:
        """Whether more games can be added: not if exploration changes up to the last."""
        return self.settings.explore == self.settings.explore_last

    def of_each_game(self) -> dict[str, Any]:
        """All that decides what is played in a game and learned from it, JSON-able.

        Against whom other seasons are played does not, nor how many games follow, if the season grows.
        """
        said = self.model_dump(mode="json")
        del said["settings"]["opponents"]
        if self.grows:
            del said["settings"]["games"]
        return said

    def lead(self, game: int) -> int:
        """Goals that the apprentice is ahead by when a game starts (games count from 1)."""
        own = self.settings
        return own.lead if self.opponent in own.lead_against and game >= own.lead_from else 0

    def recipes(self, game: int, policy: str | None) -> list[Recipe]:
        """The matches of a game, the counted one first; the apprentice is home.

        Args:
            game: from 1.
            policy: label of the policy that the apprentice plays, None for none.
        """
        own = self.settings
        along = (game - 1) / max(own.games - 1, 1)
        explore = own.explore + along * (own.explore_last - own.explore)
        first = self.seed * _SEEDS_A_SEASON + game * _SEEDS_A_GAME
        explores = [own.explore_counted, *[True] * own.practice]
        return [
            Recipe(
                home=TeamSettings(
                    kind="learned", policy=policy, min_visits=own.min_visits,
                    explore=explore if tries else 0.0, posterior_std=own.posterior_std if tries else 0.0,
                    lcb_weight=own.lcb_weight if match == 0 else 0.0,
                ),
                away=TeamSettings(kind=self.opponent),
                seed=first + match, score=(self.lead(game), 0), **own.of_match(),
            )
            for match, tries in enumerate(explores)
        ]  # fmt: skip


def names() -> list[str]:
    """The settings that come along."""
    folder = files("pipeline.studies.seasons").joinpath("named")
    return sorted(path.name.removesuffix(".toml") for path in folder.iterdir() if path.name.endswith(".toml"))


def named(name: str) -> SeasonSettings:
    """Settings that come along.

    Raises:
        NotFound: if there are none of this name.
    """
    return parse(_text(name), where=f"{name}.toml")


def parse(data: bytes | str, where: str) -> SeasonSettings:
    """Settings from TOML; ``base`` names settings that come along, of which the file says what differs.

    Raises:
        BadSettings: if it is not TOML, or has a key or value that does not fit.
        NotFound: if there are no settings of the name of ``base``.
    """
    return fitted(
        SeasonSettings, _unfolded(tables(data, where)), where, "See pipeline/studies/seasons/settings.py")


def _unfolded(said: dict[str, Any]) -> dict[str, Any]:
    base = said.pop("base", None)
    return said if base is None else over(_unfolded(tables(_text(base), f"{base}.toml")), said)


def _text(name: str) -> str:
    if name not in names():
        raise NotFound(
            f"there are no settings {name!r}", next_step=f"Name a file, or one of {', '.join(names())}")
    return files("pipeline.studies.seasons").joinpath("named", f"{name}.toml").read_text(encoding="utf-8")
