"""Settings of the commentary: all its numbers."""

from __future__ import annotations

from pydantic import Field

from pitchlore.pipeline.base.toml import Frozen


class CommentarySettings(Frozen):
    """Thresholds of the commentary, chosen by us; they give about eight lines a minute.

    Attributes:
        pass_m: least length of a pass that is reported, in units of ``Scales.close``.
        spell_s: least time on the ball that is reported.
        spell_touches: least number of touches in that time.
        lead_s: longest time before a goal from which its story is reported.
        lead_steps: most situations in that story.
        chances_apart_s: least time between two reported chances; of closer ones the greatest is.
        play_apart_s: shots that are blocked or not seen to arrive, passes, possession are reported only if no
            greater or earlier moment is closer than this.
        lull_s: after this time without a moment, possession is reported.
        scramble_s: a lull is a scramble if the ball changes sides at least once in this time, on average over
            the time in which a team has it, or if duels last longer than that time.
        most_frequent: number of situations listed for each role in the summary.
    """

    pass_m: float = Field(default=1.0, gt=0)
    spell_s: float = Field(default=3.0, gt=0)
    spell_touches: int = Field(default=3, ge=1)
    lead_s: float = Field(default=4.0, gt=0)
    lead_steps: int = Field(default=4, ge=1)
    chances_apart_s: float = Field(default=2.0, ge=0)
    play_apart_s: float = Field(default=5.0, ge=0)
    lull_s: float = Field(default=15.0, gt=0)
    scramble_s: float = Field(default=2.0, gt=0)
    most_frequent: int = Field(default=3, ge=1)
