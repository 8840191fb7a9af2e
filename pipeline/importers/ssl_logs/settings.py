"""Settings of one SSL log: the table ``[ssl]`` of its map."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class SslMap(BaseModel):
    """How an SSL log is read.

    Attributes:
        source: where bodies come from. ``auto``: the tracker with the most frames if it was there for nine
            tenths of the vision's time, else vision; ``vision``; ``tracker``: the one with the most frames;
            or the uuid or the name of a tracker.
        robot_confidence, ball_confidence: vision's detections with less confidence are left out.
        visibility: tracked bodies with this visibility or less are not seen: the tracker only guesses them.
        beyond: balls farther than this beyond the lines are not the ball, metres.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    source: str = Field(default="auto", min_length=1, max_length=200)
    robot_confidence: float = Field(default=0.0, ge=0, le=1)
    ball_confidence: float = Field(default=0.0, ge=0, le=1)
    visibility: float = Field(default=0.0, ge=0, lt=1)
    beyond: float = Field(default=1.0, ge=0, le=100)
