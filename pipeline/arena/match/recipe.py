"""The recipe of a match: with the same code, the same recipe plays the same match byte for byte."""

from __future__ import annotations

import re
from typing import Any

from pydantic import Field, field_validator

from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.physics.settings import PhysicsSettings
from pitchlore.pipeline.arena.teams.clock import PAPER, ClockSettings
from pitchlore.pipeline.arena.teams.constant import PREFIX
from pitchlore.pipeline.arena.teams.people import People
from pitchlore.pipeline.arena.teams.table import TeamKind
from pitchlore.pipeline.base.digests import fingerprint
from pitchlore.pipeline.base.toml import Frozen, fitted
from pitchlore.pipeline.game.pitch import PITCHES, Kind, Pitch

#: The usual time between decisions, seconds; the ids of matches with it do not say it.
_CLOCK_S = 0.5


class TeamSettings(Frozen):
    """Settings of a team.

    Three fields keep their first names as ``serialization_alias``, because ids of matches are made of them.

    Attributes:
        kind: name of a team in ``pipeline.arena.teams.table.TEAMS``.
        people: for a human-like team: the ranges that its person is drawn from.
        policy: for a learned team: label and SHA-256 of the policy's table. None: the team knows nothing
            yet and moves randomly.
        explore: for a learned team: probability that a robot takes any behaviour that it knows for the
            state instead of the best.
        explore_s: for a learned team that appraises what it sees: time for which a robot holds what it tries,
            seconds, rounded to whole decisions; at least until the next one.
        posterior_std: for a learned team: standard deviation of a value known from one episode, goals; it
            falls with the root of the evidence. At each restart the team draws a value for each action
            from this posterior, and plays by these values until play stops (posterior sampling: Strens
            2000; Osband, Russo and Van Roy 2013).
        lcb_weight: for a learned team: goals subtracted from a value known from one episode, falling with
            the root of the evidence (a lower confidence bound). Of two equal values the team prefers the
            one with more evidence.
        min_visits: for a learned team: least visits of a state to be looked up by a finer key.
        clock: for a learned team that looks behaviours up in states: when its robots decide.
        clock_s: for a learned team that appraises what it sees: time between its decisions, seconds.
        predict_s: the team acts on the bodies as it reckons them to be so much later than it sees them,
            seconds, rounded to whole frames (``pipeline.arena.teams.predicting``). Not for a person.
    """

    kind: TeamKind
    people: People = People()
    policy: str | None = None
    explore: float = Field(default=0.0, ge=0, le=1)
    explore_s: float = Field(default=0.0, ge=0, le=10, exclude_if=lambda explore_s: explore_s == 0)
    posterior_std: float = Field(default=0.0, ge=0, serialization_alias="doubt")
    lcb_weight: float = Field(default=0.0, ge=0, serialization_alias="caution")
    min_visits: int = Field(default=0, ge=0, serialization_alias="trust")
    clock: ClockSettings = Field(default=PAPER, exclude_if=lambda clock: clock == PAPER)
    clock_s: float = Field(default=_CLOCK_S, gt=0, exclude_if=lambda clock_s: clock_s == _CLOCK_S)
    predict_s: float = Field(default=0.0, ge=0, le=1, exclude_if=lambda predict_s: predict_s == 0)

    @property
    def name(self) -> str:
        """Name of the team in logs: its kind, or the word of the constant team that it is."""
        return self.policy if self.policy is not None and self.policy.startswith(PREFIX) else self.kind


class MatchSettings(Frozen):
    """Settings of matches that do not depend on the teams. In TOML: ``robots``, and a table for each field.

    Attributes:
        robots: robots of each team; as many as find room on the pitch.
        pitch: the pitch. Lengths that are not given are those of the league that ``kind`` names.
        physics: physics of the arena, by default those of VSSS robots and their ball on every pitch. The
            pitch's kind decides the sizes of robots and ball.
        referee: the laws, which scale with the pitch.
        camera: the camera by which teams and log see the match; the referee sees all. Off by default.
    """

    robots: int = Field(default=3, ge=1, le=128)
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
        """These settings by name, for other models that include them."""
        return {name: getattr(self, name) for name in MatchSettings.model_fields}


def varied(settings: MatchSettings | None, robots: int | None, minutes: float | None) -> dict[str, Any]:
    """Settings of matches by name, for other models; None of each argument leaves what is usual."""
    usual = (settings or MatchSettings()).of_match()
    if robots is not None:
        usual["robots"] = robots
    if minutes is not None:
        usual["referee"] = usual["referee"].model_dump() | {"duration_s": 60 * minutes}
    return usual


def match_settings(said: dict[str, Any], where: str) -> MatchSettings:
    """The default settings of matches, overridden by a file.

    Args:
        said: keys and tables of a TOML file.
        where: name of the file, for errors.

    Raises:
        BadSettings: if a key or value does not fit; names the first.
    """
    return fitted(
        MatchSettings, said, where,
        "It has robots and tables pitch, physics, referee, camera; "
        "docs/how-to/settings.md says where all keys are",
    )


def team_slug(*teams: str) -> str:
    """Names of teams as part of a file's name or an id: ``constant-044-021-021-static``."""
    return re.sub(r"[^a-z0-9-]", "-", "-".join(teams))


class Recipe(MatchSettings):
    """A match before it is played.

    Attributes:
        home: the team that attacks +x in the first half.
        away: the other team.
        seed: seed of all random numbers.
        score: goals of home and away at the start.
    """

    home: TeamSettings
    away: TeamSettings
    seed: int = Field(ge=0)
    score: tuple[int, int] = (0, 0)

    @property
    def match_id(self) -> str:
        """Id of the match: teams, seed, and a hash of the whole recipe."""
        return f"{team_slug(self.home.name, self.away.name)}-{self.seed}-{fingerprint(self)[:12]}"
