"""Settings of the commentary: all its numbers."""

from __future__ import annotations

from pitchlore.pipeline.base.bounds import Count, Pause, Positive, Seconds
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

    pass_m: Positive = 1.0
    spell_s: Seconds = 3.0
    spell_touches: Count = 3
    lead_s: Seconds = 4.0
    lead_steps: Count = 4
    chances_apart_s: Pause = 2.0
    play_apart_s: Pause = 5.0
    lull_s: Seconds = 15.0
    scramble_s: Seconds = 2.0
    most_frequent: Count = 3
