"""The ball, chosen among the balls that cameras see.

A false ball is mostly an orange thing that stays in view: a spare ball, a shoe, a pattern. So each ball that
is seen is followed, and one that was seen together with the ball is another one, its rival. TIGERs Mannheim's
vision filter follows balls in the same way, with a Kalman filter each and a gate of 15 m/s (AutoReferee,
``BallTracker`` at 0841013). Here nothing is filtered, because stages of ours clean trajectories and take
velocities.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from pitchlore.pipeline.game.pitch import SCALES, Kind

#: A ball that moved faster is another one, m/s; and how far a detection may be off besides, metres.
_FASTEST = SCALES[Kind.SSL].max_ball_speed
_SLACK = 0.1
#: Balls that are followed at once, and time after which one that is not seen is forgotten, seconds.
FOLLOWED = 16
_FORGOTTEN_S = 10.0
#: Time after which a rival takes the place of a ball that is not seen, seconds.
_RIVAL_AFTER_S = 1.0
#: A ball that never got farther from where it was first seen has not moved, and a rival that did has, metres.
_STILL, _MOVED = 0.05, 0.5


@dataclass(slots=True, eq=False)
class _Followed:
    """A ball that is followed.

    Attributes:
        x, y: where it was last seen, metres.
        seen: when that was, seconds.
        first_x, first_y: where it was first seen.
        reach: how far it has been from there.
        rival: whether it was seen together with the ball.
    """

    x: float
    y: float
    seen: float
    first_x: float
    first_y: float
    reach: float = 0.0
    rival: bool = False

    def at(self, x: float, y: float, t: float) -> None:
        """It is seen at a place and time."""
        self.x, self.y, self.seen = x, y, t
        self.reach = max(self.reach, hypot(x - self.first_x, y - self.first_y))


class BallChooser:
    """Says which of the balls that are seen at one time is the ball; it remembers those of before."""

    def __init__(self) -> None:
        self._followed: list[_Followed] = []
        self._ball: _Followed | None = None

    def choose(self, found: list[tuple[float, float, float]], t: float) -> tuple[float, float] | None:
        """Place of the ball; None if it is not seen.

        The ball that was last chosen is chosen again if it is seen. If it is not, one that is not its rival
        takes its place at once: the ball was moved or came out elsewhere. A rival does after
        ``_RIVAL_AFTER_S``. One that moves also replaces a ball that never moved. Among several, the most
        confident is chosen.

        Args:
            found: x, y (metres) and confidence of each ball that is seen.
            t: the time, seconds.
        """
        if not found:
            return None
        balls = self._follow(found, t)
        ball = self._ball
        seen = balls.index(ball) if ball is not None and ball in balls else None
        lost = ball is None or not abs(t - ball.seen) <= _RIVAL_AFTER_S
        best: int | None = None
        for i, other in enumerate(balls):
            if other is None:
                continue
            if ball is not None and seen is not None:
                other.rival = other is not ball
                fits = other.rival and ball.reach <= _STILL and other.reach >= _MOVED
            else:
                fits = lost or not other.rival
            if fits and (best is None or found[i][2] > found[best][2]):
                best = i
        if best is None:
            return None if seen is None else found[seen][:2]
        chosen = balls[best]
        assert chosen is not None
        if ball is not None and seen is None and not lost:  # it is the same ball, so it has moved if that has
            chosen.reach = max(chosen.reach, ball.reach)
        for other in balls:
            if other is not None:
                other.rival = other is not chosen
        self._ball = chosen
        return found[best][:2]

    def _follow(self, found: list[tuple[float, float, float]], t: float) -> list[_Followed | None]:
        """The ball that each is: nearest pairs first, the rest are new; None for more than ``FOLLOWED``."""
        self._followed = [ball for ball in self._followed
                          if ball is self._ball or abs(t - ball.seen) <= _FORGOTTEN_S]
        pairs = []
        for k, ball in enumerate(self._followed):
            reach = _FASTEST * abs(t - ball.seen) + _SLACK
            for i, (x, y, _) in enumerate(found):
                away = hypot(x - ball.x, y - ball.y)
                if away <= reach:
                    pairs.append((away, i, k))
        which: list[_Followed | None] = [None] * len(found)
        taken: set[int] = set()
        for _, i, k in sorted(pairs):
            if which[i] is None and k not in taken:
                which[i] = self._followed[k]
                taken.add(k)
        for i, (x, y, _) in enumerate(found):
            here = which[i] or self._new(x, y, t, which)
            which[i] = here
            if here is not None:
                here.at(x, y, t)
        return which

    def _new(self, x: float, y: float, t: float, seen: list[_Followed | None]) -> _Followed | None:
        """A new ball, perhaps instead of that which was seen the longest ago; None if all are seen."""
        if len(self._followed) == FOLLOWED:
            old = [ball for ball in self._followed if ball is not self._ball and ball not in seen]
            if not old:
                return None
            self._followed.remove(min(old, key=lambda ball: ball.seen))
        self._followed.append(ball := _Followed(x, y, t, x, y))
        return ball
