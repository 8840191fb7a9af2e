"""Maps of tracking tables: a small TOML file that gives a table's names, units, axes and teams."""

from __future__ import annotations

from typing import Annotated, Literal, Self, get_args

from pydantic import AliasChoices, BaseModel, ConfigDict, Field, field_validator, model_validator

from pitchlore.pipeline.base.toml import fitted, toml_tables
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.importers.forms.presets import with_form
from pitchlore.pipeline.importers.ssl_logs.settings import SslMap
from pitchlore.pipeline.importers.topics.settings import TopicMap
from pitchlore.schemas import SIDES, Side

EventName = Literal["kick-off", "goal", "fault", "stop", "play", "half", "end"]


class _Map(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


#: The name of a column, or its number: the first is 1.
Column = str | Annotated[int, Field(ge=1)]


#: Metres of a file's unit.
Metres = Annotated[float, Field(gt=0, le=1000)]


class Columns(_Map):
    """The file's names or numbers of our columns. A column that the map names must be in the file.

    ``period`` is the half: its time may begin anew. ``vx`` and ``vy`` are lengths per second, ``omega`` is an
    angle per second in the sense of the heading, ``option`` is what the robot's team logged that it does, a
    code of Table 1; empty where it logged nothing.
    """

    frame: Column = "frame"
    t: Column = "t"
    period: Column = "period"
    segment: Column = "segment"
    team: Column = "team"
    player: Column = "player"
    x: Column = "x"
    y: Column = "y"
    heading: Column = "heading"
    vx: Column = "vx"
    vy: Column = "vy"
    omega: Column = "omega"
    option: Column = "option"
    score_home: Column = "score_home"
    score_away: Column = "score_away"
    game_state: Column = "game_state"


class BodyColumns(_Map):
    """The file's names or numbers of a body's columns, in a table with one row a sample."""

    x: Column
    y: Column
    heading: Column | None = None
    vx: Column | None = None
    vy: Column | None = None
    omega: Column | None = None
    option: Column | None = None


class Units(_Map):
    """The file's units. An absent unit of angles is found from the headings (``forms.angles``).

    Attributes:
        length: unit of places and velocities. Or a part of the pitch: its whole is 1 (share), 100 (percent)
            or 2 (half, from -1 to 1); parts need the pitch's kind.
        metres: metres of a unit along and across, where it is none of these.
        angle: unit of headings, and per second of ``omega``; the map may call it ``angle_unit``, too.
        time: unit of ``t``, where it is a number; spreadsheets count days.
        speed: time of velocities: they are lengths a second, or a sample.
    """

    length: Literal["m", "cm", "mm", "share", "percent", "half"] = "m"
    metres: tuple[Metres, Metres] | None = None
    angle: Literal["rad", "deg", "grad", "turn"] | None = Field(
        default=None, validation_alias=AliasChoices("angle", "angle_unit")
    )
    time: Literal["s", "ms", "us", "ns", "min", "days"] = "s"
    speed: Literal["second", "sample"] = "second"


class Sampling(_Map):
    """Samples a second: ``t``, or else ``frame``, counts them then."""

    hz: float | None = Field(default=None, gt=0, le=10_000)


class Axes(_Map):
    """The file's axes, on a pitch drawn with our +x to the right and our +y up.

    Attributes:
        x: direction in which the file's x grows.
        y: direction in which the file's y grows; down in images.
        heading: sense in which headings grow, seen from above; zero is along the file's +x.
        origin: the pitch's centre, or the corner where the file's x and y are smallest. Without it, it is
            found from the places (``forms.origin``); parts of the pitch are from a corner, but for halves.
        centre: place of the pitch's centre in the file, where it is neither.
    """

    x: Literal["right", "left"] = "right"
    y: Literal["up", "down"] = "up"
    heading: Literal["ccw", "cw"] = "ccw"
    origin: Literal["centre", "corner"] = "centre"
    centre: tuple[float, float] | None = None


class PitchMap(_Map):
    """The pitch, metres. Absent lengths are those of the kind; an absent kind is inferred."""

    kind: Kind | None = None
    length: float | None = Field(default=None, ge=0.1, le=1000)
    width: float | None = Field(default=None, ge=0.1, le=1000)
    goal_width: float | None = Field(default=None, ge=0.01, le=1000)
    goal_depth: float | None = Field(default=None, ge=0, le=100)


class TeamNames(_Map):
    """The file's names of the teams and the ball. If neither team is named, the home team is inferred.

    Attributes:
        home, away: the file's name of this team. If both are given, rows of other teams are left out. If
            the table has one team only, that team must be named here.
        ball: the ball's name.
        home_attacks: side that home attacks in the first period, on a pitch drawn as in ``Axes``.
        names: names to use for the file's, such as a team's for a colour.
        named_by: columns in which a team's name stands, by the file's word for it.
    """

    home: str | None = None
    away: str | None = None
    ball: str = "ball"
    home_attacks: Literal["right", "left"] | None = None
    names: dict[str, str] = Field(default_factory=dict)
    named_by: dict[str, Column] = Field(default_factory=dict)

    def named(self, theirs: str) -> str:
        """The name to use for a name of the file."""
        return self.names.get(theirs, theirs)


class GoalFinding(_Map):
    """Goals of a table that has no score and no states that tell goals (``ball_goals``).

    Attributes:
        from_ball: whether they, and restarts, are found from the ball.
        confidence: least confidence of a goal.
    """

    from_ball: bool = True
    confidence: float = Field(default=0.5, ge=0, le=1)


class TrackingMap(_Map):
    """Map of a tracking table; the default is the plain form (see ``match.match_of``).

    Attributes:
        columns, units, axes, pitch, teams, goals: one TOML table each.
        bodies: for a table with one row a sample, the columns of each body: ``"blue 0" = {x = 2, y = 3}``, a
            team and a player, or the ball's name. Without it they are found from the columns' names.
        states: the file's words for states of the game. Each is an event of schema Referee, alone or with
            ``home`` or ``away`` (``DirectAlly = "fault home"``).
        ssl: how an SSL log is read, which besides this uses ``pitch`` and ``teams``.
        topics: for a recording of ROS 2 or Foxglove, its topics and the bodies in their messages.
    """

    columns: Columns = Columns()
    units: Units = Units()
    time: Sampling = Sampling()
    axes: Axes = Axes()
    pitch: PitchMap = PitchMap()
    teams: TeamNames = TeamNames()
    goals: GoalFinding = GoalFinding()
    bodies: dict[str, BodyColumns] = Field(default_factory=dict)
    states: dict[str, str] = Field(default_factory=dict)
    ssl: SslMap = SslMap()
    topics: tuple[TopicMap, ...] = ()

    @model_validator(mode="after")
    def _bodies_are_players(self) -> Self:
        for body in self.bodies:
            if body != self.teams.ball and not all(body.rpartition(" ")):
                raise ValueError(
                    f"the body {body!r} is neither a team and a player nor the ball {self.teams.ball!r}")
        return self

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

    def numbers_columns(self) -> bool:
        """True if it numbers a column of the file, as it has to where they have no names."""
        named = [self.columns, *self.bodies.values()]
        return any(isinstance(theirs, int) for columns in named for _, theirs in columns)

    def meaning(self, word: str) -> tuple[str, Side | None] | None:
        """Event and team of a word of ``states``; None if the map does not have the word."""
        if word not in self.states:
            return None
        event, *team = self.states[word].split()
        return event, next((side for side in SIDES if side in team), None)


def load_map(text: str, where: str = "the map") -> TrackingMap:
    """Map from TOML.

    Args:
        text: TOML with the tables of :class:`TrackingMap`, and optionally ``form``, a map to begin from.
        where: the file's name, for messages.

    Raises:
        BadSettings: if it is not TOML or has a key or value that does not fit.
    """
    tables = with_form(toml_tables(text, where), where)
    return fitted(TrackingMap, tables, where, "Mend the map, or leave the key out")
