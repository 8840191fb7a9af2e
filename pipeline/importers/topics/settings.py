"""Topics of one recording: the table ``[[topics]]`` of its map."""

from __future__ import annotations

from typing import Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


class TopicFields(BaseModel):
    """Fields of a message, as paths such as ``pose.position.x``; absent ones are found by their names.

    Attributes:
        t: time of the message, instead of its log time.
        team, player: team and player of an item.
        x, y, heading, vx, vy, omega: as the columns of a table.
        orientation: a quaternion, whose turn about the vertical is the heading.
        game_state, score_home, score_away: as the columns of a table; they hold until the next message.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    t: str | None = None
    team: str | None = None
    player: str | None = None
    x: str | None = None
    y: str | None = None
    heading: str | None = None
    orientation: str | None = None
    vx: str | None = None
    vy: str | None = None
    omega: str | None = None
    game_state: str | None = None
    score_home: str | None = None
    score_away: str | None = None


class TopicMap(BaseModel):
    """One topic of a recording, and the bodies in its messages.

    A body is a team and a player (``"blue 1"``), or the ball's name.

    Attributes:
        topic: its name.
        body: the one body of a message, or of the first item of its list.
        bodies: the bodies of a list's items, in its order.
        team: the team of a list's items; players are numbered from 0 in its order, or by ``columns.player``.
        frames: the bodies of transforms, by the name of the child frame.
        each: path of the list; without it, it is found.
        columns: paths of fields.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    topic: str = Field(min_length=1)
    body: str | None = None
    bodies: tuple[str, ...] = ()
    team: str | None = None
    frames: dict[str, str] = Field(default_factory=dict)
    each: str | None = None
    columns: TopicFields = TopicFields()

    @model_validator(mode="after")
    def _says_one_thing(self) -> Self:
        fields = self.columns
        said = [self.body, self.bodies, self.frames, self.team or fields.team]
        told = fields.game_state or fields.score_home or fields.score_away
        if sum(map(bool, said)) > 1 or not (any(said) or told):
            raise ValueError(
                f"{self.topic} needs one of body, bodies, team, frames, columns.team, or a state or score")
        return self
