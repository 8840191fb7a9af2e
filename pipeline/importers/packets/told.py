"""Options that a team tells of its own robots while it plays: a packet has one robot's, as JSON.

``{"team": "blue", "robot": 1, "option": 44}``: from now on blue 1 does 044 of Table 1, until the team tells
another option of it, or null.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from pitchlore.schemas.options import OPTIONS


def _known(code: int) -> int:
    if code not in OPTIONS:
        raise ValueError(f"{code} is not an option of Table 1")
    return code


class ToldOption(BaseModel):
    """A robot's option, as its team tells it.

    Attributes:
        team: its colour.
        robot: its number.
        option: code of Table 1; None if the team tells none from now on.
    """

    model_config = ConfigDict(frozen=True, strict=True)

    team: Literal["blue", "yellow"]
    robot: int = Field(ge=0, lt=32)
    option: Annotated[int, AfterValidator(_known)] | None


def told_option(data: bytes) -> ToldOption | None:
    """The option in a packet; None if it is no such packet."""
    try:
        return ToldOption.model_validate_json(data)
    except ValidationError:
        return None
