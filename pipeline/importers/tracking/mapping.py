"""Maps of tracking tables: a small TOML file that gives a table's names, units, axes and teams."""

from __future__ import annotations

from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, field_validator

from pipeline.pitch import Kind
from pipeline.toml import fitted, tables
from schemas import SIDES, Side

EventName = Literal["kick-off", "goal", "fault", "stop", "play", "half", "end"]


class _Map(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Columns(_Map):
    """The file's names of our columns. A column that the map names must be in the file.

    ``vx`` and ``vy`` are lengths per second, ``omega`` is an angle per second in the sense of the heading.
    """

    frame: str = "frame"
    t: str = "t"
    segment: str = "segment"
    team: str = "team"
    player: str = "player"
    x: str = "x"
    y: str = "y"
    heading: str = "heading"
    vx: str = "vx"
    vy: str = "vy"
    omega: str = "omega"
    score_home: str = "score_home"
    score_away: str = "score_away"
    game_state: str = "game_state"


class Units(_Map):
    """The file's units."""

    length: Literal["m", "cm", "mm"] = "m"
    angle: Literal["rad", "deg"] = "rad"
    time: Literal["s", "ms", "us", "ns"] = "s"


class Axes(_Map):
    """The file's axes, on a pitch drawn with our +x to the right and our +y up.

    Attributes:
        x: direction in which the file's x grows.
        y: direction in which the file's y grows; down in images.
        heading: sense in which headings grow, seen from above; zero is along the file's +x.
        origin: the pitch's centre, or the corner where the file's x and y are smallest.
    """

    x: Literal["right", "left"] = "right"
    y: Literal["up", "down"] = "up"
    heading: Literal["ccw", "cw"] = "ccw"
    origin: Literal["centre", "corner"] = "centre"


class PitchMap(_Map):
    """The pitch, metres. Absent lengths are those of the kind; an absent kind is inferred."""

    kind: Kind | None = None
    length: float | None = Field(default=None, ge=0.1, le=1000)
    width: float | None = Field(default=None, ge=0.1, le=1000)
    goal_width: float | None = Field(default=None, ge=0.01, le=1000)
    goal_depth: float | None = Field(default=None, ge=0, le=100)


class Teams(_Map):
    """The file's names of the teams and the ball. If neither team is named, the home team is inferred.

    Attributes:
        home, away: the file's name of this team. If both are given, rows of other teams are left out. If
            the table has one team only, that team must be named here.
        ball: the ball's name.
        home_attacks: side that home attacks in the first period, on a pitch drawn as in ``Axes``.
    """

    home: str | None = None
    away: str | None = None
    ball: str = "ball"
    home_attacks: Literal["right", "left"] | None = None


class TrackingMap(_Map):
    """Map of a tracking table; the default is the plain form (see ``match.match_of``).

    Attributes:
        columns, units, axes, pitch, teams: one TOML table each.
        states: the file's words for states of the game. Each is an event of schema Referee, alone or with
            ``home`` or ``away`` (``DirectAlly = "fault home"``).
    """

    columns: Columns = Columns()
    units: Units = Units()
    axes: Axes = Axes()
    pitch: PitchMap = PitchMap()
    teams: Teams = Teams()
    states: dict[str, str] = Field(default_factory=dict)

    @field_validator("states")
    @classmethod
    def _states_are_events(cls, states: dict[str, str]) -> dict[str, str]:
        for word, meaning in states.items():
            event, *team = meaning.split()
            if event not in get_args(EventName) or len(team) > 1 or not set(team) <= set(SIDES):
                raise ValueError(
                    f"{word} is {meaning!r}, not one of {', '.join(get_args(EventName))} "
                    "with home, away or nothing after it"
                )
        return states

    def settings(self) -> dict[str, object]:
        """Settings that differ from the default, as JSON values; part of the match's key."""
        return self.model_dump(mode="json", exclude_defaults=True)

    def meaning(self, word: str) -> tuple[str, Side | None] | None:
        """Event and team of a word of ``states``; None if the map does not have the word."""
        if word not in self.states:
            return None
        event, *team = self.states[word].split()
        return event, next((side for side in SIDES if side in team), None)


def load_map(text: str, where: str = "the map") -> TrackingMap:
    """Map from TOML.

    Args:
        text: TOML with the tables of :class:`TrackingMap`.
        where: the file's name, for messages.

    Raises:
        BadSettings: if it is not TOML or has a key or value that does not fit.
    """
    keys = "See pipeline/importers/tracking/mapping.py for all keys and values"
    return fitted(TrackingMap, tables(text, where), where, keys)
