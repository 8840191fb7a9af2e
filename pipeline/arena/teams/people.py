"""Settings of the human-like team: the ranges that its person is drawn from."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from pitchlore.pipeline.base.toml import Frozen

Tactic = Literal["aggressive", "defensive", "chaser"]
TACTICS: tuple[Tactic, ...] = ("aggressive", "defensive", "chaser")


def _ordered(span: tuple[float, float]) -> tuple[float, float]:
    if span[0] > span[1]:
        raise ValueError("the least is more than the most")
    return span


_Positive = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Part = Annotated[float, Field(gt=0, le=1)]
ValueRange = Annotated[tuple[_Positive, _Positive], AfterValidator(_ordered)]
ShareRange = Annotated[tuple[_Part, _Part], AfterValidator(_ordered)]


class People(Frozen):
    """Ranges from which a person is drawn uniformly; each pair is the least and the greatest value, included.

    All numbers are ours. A simple reaction to something seen takes people about a quarter of a second.

    Attributes:
        delay_s: delay with which the ball and the other team are seen, seconds.
        wobble_rad: standard deviation of the direction of driving around the intended one, radians.
        wobble_s: correlation time of an error of direction, seconds.
        skill: share of the top speed that the driven robot uses.
        pace: share of the top speed that the others use.
        switch_s: time for which a robot is driven before another may be, seconds.
        tactics: possible tactics of a game, equally likely.
    """

    delay_s: ValueRange = (0.15, 0.35)
    wobble_rad: ValueRange = (0.05, 0.30)
    wobble_s: ValueRange = (0.2, 0.5)
    skill: ShareRange = (0.6, 1.0)
    pace: ShareRange = (0.3, 0.6)
    switch_s: ValueRange = (0.5, 2.0)
    tactics: tuple[Tactic, ...] = Field(default=TACTICS, min_length=1)
