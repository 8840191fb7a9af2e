"""The recipe of a match: the same recipe, under the same code, plays the same match byte for byte."""

from __future__ import annotations

from typing import Any

from pydantic import Field, field_validator

from pipeline.arena.physics.camera import CameraSettings
from pipeline.arena.physics.laws import RefereeSettings
from pipeline.arena.physics.settings import PhysicsSettings
from pipeline.arena.teams.people import People
from pipeline.arena.teams.table import TeamKind
from pipeline.pitch import PITCHES, Kind, Pitch
from pipeline.settings import Frozen, fitted
from pipeline.store.receipts import fingerprint


class TeamSettings(Frozen):
    """Settings of a team.

    Three fields have a ``serialization_alias``: their first names, which ids of matches are made of.

    Attributes:
        kind: name of a team in ``pipeline.arena.teams.table.TEAMS``.
        people: of a human-like team: the ranges that its person is drawn from.
        policy: of a learned team: label and SHA-256 of the policy's table; None for a team that knows
            nothing yet, and moves randomly.
        explore: of a learned team: chance that a robot takes any behaviour that it knows for the state
            instead of the best, in [0, 1].
        posterior_std: of a learned team: standard deviation of a value known from one episode, goals; it
            falls with the root of the evidence. At each restart the team draws a value for each action
            from this posterior and plays by these until play stops: exploration that lasts (posterior
            sampling: Strens 2000; Osband, Russo and Van Roy 2013).
        lcb_weight: of a learned team: standard errors that are taken off each value, goals for a value known
            from one episode (a lower confidence bound): of two like values it prefers the better known.
        min_visits: of a learned team: visits that a state needs to be looked up by a finer key.
    """

    kind: TeamKind
    people: People = People()
    policy: str | None = None
    explore: float = Field(default=0.0, ge=0, le=1)
    posterior_std: float = Field(default=0.0, ge=0, serialization_alias="doubt")
    lcb_weight: float = Field(default=0.0, ge=0, serialization_alias="caution")
    min_visits: int = Field(default=0, ge=0, serialization_alias="trust")


class MatchSettings(Frozen):
    """Settings of matches that do not depend on the teams; in TOML ``robots`` and a table a field.

    Attributes:
        robots: a side; as many as find room on the pitch.
        pitch: where. Of the numbers that are not given, those of the league that ``kind`` names.
        physics: of the arena; those of VSSS robots and their ball on whatever pitch. How large both are
            goes by the pitch's kind.
        referee: the laws, which scale with the pitch.
        camera: through which teams and log see the match; the referee sees all. Off by default.
    """

    robots: int = Field(default=3, ge=1)
    pitch: Pitch = PITCHES[Kind.VSSS]
    physics: PhysicsSettings = PhysicsSettings()
    referee: RefereeSettings = RefereeSettings()
    camera: CameraSettings = CameraSettings()

    @field_validator("pitch", mode="before")
    @classmethod
    def _of_its_league(cls, pitch: object) -> object:
        if not isinstance(pitch, dict):
            return pitch
        usual = next((own for own in PITCHES.values() if own.kind == pitch.get("kind", Kind.VSSS)), None)
        return pitch if usual is None else usual.model_dump() | pitch

    def of_match(self) -> dict[str, Any]:
        """These settings by name, for other models that have them, too."""
        return {name: getattr(self, name) for name in MatchSettings.model_fields}


def match_settings(said: dict[str, Any], where: str) -> MatchSettings:
    """The default settings of matches, with those of a file on top.

    Args:
        said: keys and tables of a TOML file.
        where: they are from, for errors.

    Raises:
        BadSettings: if a key or value does not fit; names the first.
    """
    return fitted(
        MatchSettings, said, where,
        "It has robots and tables pitch, physics, referee, camera: see MatchSettings in "
        "pipeline/arena/match/recipe.py for their keys",
    )


class Recipe(MatchSettings):
    """A match before it is played.

    Attributes:
        home: attacks +x in the first half.
        away: the other.
        seed: decides all that is left to chance.
        score: goals of home and away that count from the start.
    """

    home: TeamSettings
    away: TeamSettings
    seed: int = Field(ge=0)
    score: tuple[int, int] = (0, 0)

    @property
    def match_id(self) -> str:
        """Teams, seed, and a hash of everything."""
        return f"{self.home.kind}-{self.away.kind}-{self.seed}-{fingerprint(self)[:12]}"
