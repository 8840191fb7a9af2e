"""What is worth telling: every number of the commentary."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings import Frozen


class CommentarySettings(Frozen):
    """What is told of a match. The numbers are ours: with them it is about eight lines a minute.

    Attributes:
        flicker_s: a robot's touch goes on over a gap of at most so long, if nobody else touches the ball.
        line_s: the ball's course after a touch is taken from at most so long a stretch.
        shot_s: a shot would be at the goal line within so long, if the ball kept its speed.
        shot_speed: least speed of a shot, m/s on the scale of VSSS (``Scales.speed``).
        shot_apart_s: attempts of one team that follow within so long are one shot, the last.
        wide: a shot is wide, and not something else, up to so many goal widths from the centre of the goal.
        pass_m: the ball goes at least so far in a pass, in units of ``Scales.close``.
        pass_s: and is at most so long on its way.
        spell_s: least time for which a team must keep the ball to be told.
        spell_touches: and robots' touches in it.
        lead_s: what led to a goal lies at most so long before it.
        lead_steps: and is at most so many situations.
        chances_apart_s: of the chances that lie closer together the greatest is told.
        play_apart_s: passes and possession are told only where nothing else is for so long.
        lull_s: where nothing was told for so long, it is told whose the ball was.
        scramble_s: there the ball changes sides at least this often, on average, in a scramble.
        most_frequent: situations of each role in the summary.
    """

    flicker_s: float = Field(default=0.1, ge=0)
    line_s: float = Field(default=0.1, gt=0)
    shot_s: float = Field(default=1.0, gt=0)
    shot_speed: float = Field(default=0.4, gt=0)
    shot_apart_s: float = Field(default=1.0, ge=0)
    wide: float = Field(default=1.0, ge=0.5)
    pass_m: float = Field(default=1.0, gt=0)
    pass_s: float = Field(default=1.5, gt=0)
    spell_s: float = Field(default=3.0, gt=0)
    spell_touches: int = Field(default=3, ge=1)
    lead_s: float = Field(default=4.0, gt=0)
    lead_steps: int = Field(default=4, ge=1)
    chances_apart_s: float = Field(default=2.0, ge=0)
    play_apart_s: float = Field(default=5.0, ge=0)
    lull_s: float = Field(default=15.0, gt=0)
    scramble_s: float = Field(default=2.0, gt=0)
    most_frequent: int = Field(default=3, ge=1)
