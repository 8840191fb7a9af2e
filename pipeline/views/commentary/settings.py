"""Settings of the commentary: all its numbers."""

from __future__ import annotations

from pydantic import Field

from pipeline.toml import Frozen


class CommentarySettings(Frozen):
    """Thresholds of the commentary, chosen by us; they give about eight lines a minute.

    Attributes:
        flicker_s: longest gap within one touch, if no other robot touches the ball.
        line_s: longest stretch after a touch from which the ball's course is taken.
        shot_s: time within which a shot would reach the goal line at constant speed.
        shot_speed: least speed of a shot, m/s on the scale of VSSS (``Scales.speed``).
        shot_apart_s: attempts of one team that follow within this time are one shot, the last.
        wide: greatest distance of a wide shot from the goal's centre, in goal widths.
        pass_m: least length of a pass, in units of ``Scales.close``.
        pass_s: longest duration of a pass.
        hold_s: in a duel a shorter touch does not take the ball.
        spell_s: least time on the ball that is told.
        spell_touches: least number of touches in that time.
        lead_s: longest time before a goal from which its story is told.
        lead_steps: most situations in that story.
        chances_apart_s: least time between two chances that are told; of closer ones the greatest is told.
        play_apart_s: passes and possession are told only if no other moment is closer than this.
        lull_s: after this time without a moment, possession is told.
        scramble_s: a lull is a scramble if the ball changes sides at least once in this time, on average.
        most_frequent: number of situations listed for each role in the summary.
    """

    flicker_s: float = Field(default=0.1, ge=0)
    line_s: float = Field(default=0.1, gt=0)
    shot_s: float = Field(default=1.0, gt=0)
    shot_speed: float = Field(default=0.4, gt=0)
    shot_apart_s: float = Field(default=1.0, ge=0)
    wide: float = Field(default=1.0, ge=0.5)
    pass_m: float = Field(default=1.0, gt=0)
    pass_s: float = Field(default=1.5, gt=0)
    hold_s: float = Field(default=0.1, ge=0)
    spell_s: float = Field(default=3.0, gt=0)
    spell_touches: int = Field(default=3, ge=1)
    lead_s: float = Field(default=4.0, gt=0)
    lead_steps: int = Field(default=4, ge=1)
    chances_apart_s: float = Field(default=2.0, ge=0)
    play_apart_s: float = Field(default=5.0, ge=0)
    lull_s: float = Field(default=15.0, gt=0)
    scramble_s: float = Field(default=2.0, gt=0)
    most_frequent: int = Field(default=3, ge=1)
