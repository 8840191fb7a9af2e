"""Goals found from the ball, where nothing in a recording tells them.

The ball crosses a goal line between the posts, and then it is put back to the centre, or play stops. If it is
put elsewhere, it was no goal. Each finding has a confidence: the share of such findings that were goals in
matches whose score is known.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.importers.tracking.ball_restarts import (
    CENTRE,
    MISSING,
    Ball,
    BallRestart,
    cuts_of,
    put_back,
)
from pitchlore.pipeline.matches.frame import runs
from pitchlore.pipeline.numbers.arrays import Bools

#: How the ball crossed the goal line. "over": the whole ball was seen behind it. "line": only its centre was,
#: when it was last seen. "unseen": it was on its way into the goal when it was last seen.
Crossing = Literal["over", "line", "unseen"]
#: What followed. "centre": the ball was put back to the centre. "elsewhere": it was seen until it was put
#: elsewhere, as after a foul. "stopped": it stayed behind the line, or was not seen any more. "played on": it
#: came back over the line.
Sequel = Literal["centre", "elsewhere", "stopped", "played on"]

#: Share of the findings of each kind that were goals, rounded down to hundredths: the Laplace estimate of
#: data/studies/ball_goals/kinds.csv. Those of ``OURS`` are set, not measured.
CONFIDENCE: dict[tuple[Crossing, Sequel], float] = {
    ("over", "centre"): 0.99, ("over", "elsewhere"): 0.1, ("over", "stopped"): 0.98,
    ("over", "played on"): 0.1,
    ("line", "centre"): 0.95, ("line", "elsewhere"): 0.1, ("line", "stopped"): 0.3,
    ("unseen", "centre"): 0.98, ("unseen", "elsewhere"): 0.1, ("unseen", "stopped"): 0.2,
    ("unseen", "played on"): 0.1,
}
#: The study has no ball on the line that stays there. Play that goes on, or a ball that is put elsewhere,
#: speaks against a goal; the study's goals of these kinds lost their kick-offs, which were cut out.
OURS: tuple[tuple[Crossing, Sequel], ...] = (
    ("line", "stopped"), ("over", "played on"), ("unseen", "played on"),
    ("over", "elsewhere"), ("line", "elsewhere"), ("unseen", "elsewhere"))

#: Longest time from the crossing to the ball at the centre, s. An SSL team takes a minute to kick off.
RESTART_S = 90.0
#: Longest time without a sample of the ball after which it may be seen in the goal without having been seen
#: to enter, s.
_HIDDEN_S = 2.0
#: A ball that stays behind the line so long is out of play, s.
_STAYS_S = 1.0
#: An unseen crossing is at most so long after the last sample, s, on the line of the samples before it, s.
_AHEAD_S, _BACK_S = 0.25, 0.15
#: How far behind the back of a goal a sample may be, as a share of the pitch's length.
_BEHIND = 0.03


class BallGoal(NamedTuple):
    """A goal found from the ball.

    Attributes:
        t_ns: time of the first sample beyond the line, or of the last one before it.
        end: +1 if it is the goal at +x, -1 at -x.
        confidence: chance that it is a goal, in [0, 1].
        crossing, sequel: how it was found.
        restart_ns: time at which the ball was put back to the centre, or else was seen again; None if never,
            or if it was put elsewhere.
    """

    t_ns: int
    end: int
    confidence: float
    crossing: Crossing
    sequel: Sequel
    restart_ns: int | None


class _Visit(NamedTuple):
    """A stay of the ball in a goal, or its way into one: samples ``first`` to ``last``, included."""

    first: int
    last: int
    end: int
    crossing: Crossing
    back: bool


def ball_goals(ball: Ball, pitch: Pitch, restarts: Sequence[BallRestart]) -> list[BallGoal]:
    """Goals found from the ball, in order of time.

    The ball's centre crosses a goal line between the posts, and it does not come back before the whole ball
    has crossed; or it was lost on its way into the goal. Crossings while the states say that play is stopped
    are none. A kick-off at the centre, or another restart before it, belongs to the last crossing before it,
    if that is at most ``RESTART_S`` old.

    Args:
        ball: where it was seen.
        pitch: pitch of the match; its middle is (0, 0).
        restarts: found from the ball (:func:`ball_restarts`).
    """
    if len(ball.t_ns) < 2:
        return []
    cuts = cuts_of(ball, pitch)
    visits = sorted(_visits(ball, pitch, cuts))
    centred = put_back(ball, pitch, cuts)
    elsewhere = np.searchsorted(ball.t_ns, [restart.t_ns for restart in restarts])
    found = []
    for at, visit in enumerate(visits):
        until = visits[at + 1].first if at + 1 < len(visits) else len(ball.t_ns)
        latest = int(np.searchsorted(ball.t_ns, ball.t_ns[visit.last] + round(RESTART_S * 1e9), "right"))
        kick_off, put = (
            next(iter(those[(those > visit.last) & (those < min(until, latest))].tolist()), until)
            for those in (centred, elsewhere))
        sequel: Sequel = (
            "elsewhere" if put < kick_off and not cuts[visit.last + 1:put].any()
            else "centre" if kick_off < until else "played on" if visit.back else "stopped")
        again = kick_off if sequel == "centre" else visit.last + 1
        found.append(BallGoal(
            int(ball.t_ns[visit.first]), visit.end, CONFIDENCE[visit.crossing, sequel], visit.crossing,
            sequel, int(ball.t_ns[again]) if again < len(ball.t_ns) and sequel != "elsewhere" else None,
        ))
    return found


def _visits(ball: Ball, pitch: Pitch, cuts: Bools) -> Iterator[_Visit]:
    """The ball's stays in the goals while play is on, and its ways into them that were not seen to end."""
    radius = SCALES[pitch.kind].ball_radius
    deep = np.abs(ball.x) - pitch.goal_x
    inside = (deep > 0) & (deep <= pitch.goal_depth + _BEHIND * pitch.length)
    inside &= np.abs(ball.y) <= pitch.goal_width / 2
    stretch = np.cumsum(cuts)
    step_s = np.diff(ball.t_ns)
    lost = np.concatenate((cuts[1:] | (step_s > MISSING * np.median(step_s)), [True]))
    ends = np.flatnonzero(lost & ~inside & ~ball.stopped)
    for low, high in runs(inside):
        parts = low + np.flatnonzero(np.diff(stretch[low:high])) + 1
        for first, after in zip([low, *parts], [*parts, high], strict=True):
            if ball.stopped[first] or not _came(ball, pitch, int(first), cut=bool(cuts[first])):
                continue
            whole = bool(deep[first:after].max() >= radius)
            back = after < len(cuts) and not cuts[after]
            if back and not whole:
                continue
            stays = ball.t_ns[after - 1] - ball.t_ns[first] >= round(_STAYS_S * 1e9)
            yield _Visit(int(first), int(after) - 1, int(np.sign(ball.x[first])), "over" if whole else "line",
                         back and not stays)
    starts = np.maximum.accumulate(np.where(cuts, np.arange(len(cuts)), 0))
    for last in ends.tolist():
        end = _heads_in(ball, pitch, int(starts[last]), last)
        if end and not _seen_in(ball, inside, last):
            yield _Visit(last, last, end, "unseen", back=last + 1 < len(cuts) and not cuts[last + 1])


def _came(ball: Ball, pitch: Pitch, first: int, *, cut: bool) -> bool:
    """True if the ball came into the goal by its front, as far as that was seen."""
    if first == 0:
        return False
    x, y = np.abs(ball.x[first - 1:first + 1]), ball.y[first - 1:first + 1]
    if x[0] > pitch.goal_x:
        return False
    if cut:
        way = np.hypot(ball.x[first] - ball.x[first - 1], y[1] - y[0])
        hidden = ball.t_ns[first] - ball.t_ns[first - 1] <= round(_HIDDEN_S * 1e9)
        return bool(hidden and way <= 2 * CENTRE * pitch.length)
    at_line = y[0] + (y[1] - y[0]) * (pitch.goal_x - x[0]) / (x[1] - x[0])
    return bool(abs(at_line) <= pitch.goal_width / 2)


def _seen_in(ball: Ball, inside: Bools, last: int) -> bool:
    """True if the ball is next seen in a goal, soon after sample ``last``."""
    after = last + 1
    soon = after < len(inside) and ball.t_ns[after] - ball.t_ns[last] <= round(_HIDDEN_S * 1e9)
    return bool(soon and inside[after])


def _heads_in(ball: Ball, pitch: Pitch, start: int, last: int) -> int:
    """Goal into which the ball goes straight after sample ``last``: +1, -1, or 0 for none.

    Its direction and speed are those of its last ``_BACK_S``, in which it has to be seen twice from sample
    ``start`` on.
    """
    since = max(start, int(np.searchsorted(ball.t_ns, ball.t_ns[last] - round(_BACK_S * 1e9))))
    since = min(since, max(start, last - 1))
    if since == last:
        return 0
    time_s = (ball.t_ns[last] - ball.t_ns[since]) / 1e9
    vx, vy = (ball.x[last] - ball.x[since]) / time_s, (ball.y[last] - ball.y[since]) / time_s
    end = int(np.sign(vx))
    left = pitch.goal_x - end * ball.x[last]
    if end == 0 or left < 0 or left > abs(vx) * _AHEAD_S:
        return 0
    at_line = ball.y[last] + vy * left / abs(vx)
    return end if abs(at_line) <= pitch.goal_width / 2 else 0
