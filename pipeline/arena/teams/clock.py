"""When the robots of a team that looks behaviours up in states decide."""

from __future__ import annotations

from typing import NamedTuple

from pitchlore.pipeline.base.bounds import Pause
from pitchlore.pipeline.base.toml import Frozen


class ClockSettings(Frozen):
    """When robots decide. All do when play starts. By default, the paper's clock, when a behaviour is over.

    Attributes:
        least_s: least time that a behaviour lasts, seconds, unless play stops or an event interrupts it. If
            it is over before, its last code is begun anew until then.
        interrupts: whether events interrupt behaviours. When the team wins or loses the ball
            (:func:`pipeline.game.tactics.ball.holder`), all its robots decide. When a robot's role changes,
            it decides. A robot that chooses the code that it is executing goes on with it.
        begin_ended: whether a robot begins codes whose end holds already. If not, it leaves such codes of a
            behaviour out, and chooses among the behaviours that have others.
    """

    least_s: Pause = 0.0
    interrupts: bool = False
    begin_ended: bool = True


#: The clock of the paper's settings; ids of matches with it do not say it.
PAPER = ClockSettings()


class Clock(NamedTuple):
    """Settings of a clock for compiled functions.

    Attributes:
        least: least time that a behaviour lasts, frames; not negative.
        interrupts, begin_ended: see :class:`ClockSettings`.
    """

    least: int
    interrupts: bool
    begin_ended: bool

    @classmethod
    def of(cls, settings: ClockSettings, hz: float) -> Clock:
        """The clock at so many frames a second; times are rounded to frames."""
        return cls(round(settings.least_s * hz), settings.interrupts, settings.begin_ended)
