"""A small arena of SSL: robots that drive in all directions, as the recording shows that they can, in pymunk.

Our arena moves robots on two wheels, so this study has its own. Acceleration and speed of robots, how the
ball slows down, how often and how hard robots kick are measured in the recording. It has no heights, no
referee but goals and balls that are out, and no laws of distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pymunk
from omnidirectional.recording import HZ, STEPS, Stretch

from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, X, Y
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F64

#: A ball within this of a robot's middle, and so near to its heading (radians), lies at its front: the widest
#: that a kick began from in the recording; a kick adds so much speed, m/s, within 0.1 s, along the heading.
FRONT, _FACES, _KICK, _ALONG = 0.13, 0.6, 1.0, math.radians(45)
#: Fewer kicks than this of one team are too few: those of both are taken.
_FEW = 5
#: A ball rolls freely if nobody is within this, metres; one that is faster than this, m/s, slides.
_FREE, _SLIDES = 0.4, 3.0
#: Share of changes of velocity, and of speeds, that are possible.
_MOST = 0.99
#: Ours: share of its speed relative to a robot that a ball at the robot's front keeps from frame to frame;
#: steps of a frame; masses, kg; metres from the lines to the walls, and to where a ball that was out is put;
#: a ball so slow, m/s, for so long, s, is put in the middle.
_HELD, _SUBSTEPS, _ROBOT_KG, _BALL_KG = 0.7, 2, 2.5, 0.046
_MARGIN, _INSIDE, _STUCK, _STUCK_S = 0.3, 0.2, 0.1, 5.0


class Limits(NamedTuple):
    """Robots and kicks of one team, as they are recorded.

    Attributes:
        top: speed that 99 % of its samples do not exceed, m/s.
        acceleration: change of velocity in 0.1 s that 99 % do not exceed, m/s².
        kicks: float64 [K], speeds of the ball after its kicks, m/s; of both teams if it has too few.
        own_kicks: number of its own kicks.
        aside: standard deviation of a kick's direction from the heading, radians.
        front_s: time for which the ball lies at the front of one of its robots, s.
    """

    top: float
    acceleration: float
    kicks: F64
    own_kicks: int
    aside: float
    front_s: float

    @property
    def rate(self) -> float:
        """Kicks in a second with the ball at the front."""
        return self.own_kicks / self.front_s if self.front_s else 0.0


class Rolling(NamedTuple):
    """Losses of speed of a free ball, m/s²: medians below and above the speed at which it slides."""

    slow: float
    fast: float


def fronts(bodies: F64) -> F64:
    """Distances of the ball from robots [..., 2 N], metres; infinite where it is not at their fronts."""
    away = bodies[..., :1, :2] - bodies[..., 1:, :2]
    off = np.arctan2(away[..., 1], away[..., 0]) - bodies[..., 1:, THETA]
    off = np.abs((off + np.pi) % (2 * np.pi) - np.pi)
    far = np.linalg.norm(away, axis=-1)
    found: F64 = np.where((far < FRONT) & (off < _FACES), far, np.inf)
    return found


def kicked(stretch: Stretch) -> list[tuple[int, float, float]]:
    """Kicks of a stretch: row of the robot from 0, speed of the ball after it, angle from the heading."""
    places, found, free = stretch.places, list[tuple[int, float, float]](), 0
    velocity, front = places[:, BALL, VX:VX + 2], fronts(places)
    for t in range(2 * STEPS, len(places) - 2 * STEPS):
        near = front[t - STEPS:t + 1].min(axis=0)
        before, after = velocity[t - STEPS], velocity[t + STEPS + 1]
        gain = float(np.linalg.norm(after) - np.linalg.norm(before))
        if t < free or not np.isfinite(near.min()) or gain < _KICK:
            continue
        robot = int(near.argmin())
        aside = math.atan2(after[1], after[0]) - places[t, 1 + robot, THETA]
        aside = (aside + math.pi) % (2 * math.pi) - math.pi
        if abs(aside) < _ALONG:
            best = float(np.linalg.norm(velocity[t:t + 3 * STEPS], axis=1).max())
            found.append((robot, best, aside))
            free = t + HZ // 5
    return found


def limits(parts: Sequence[Stretch], robots: int) -> tuple[Limits, Limits]:
    """Robots and kicks of both teams, from their play; N robots a side."""
    kicks = [kick for part in parts for kick in kicked(part)]
    found = []
    for team in range(2):
        rows = slice(1 + team * robots, 1 + (team + 1) * robots)
        own = [kick for kick in kicks if kick[0] // robots == team]
        taken = own if len(own) >= _FEW else kicks
        moved = [part.places[STEPS:, rows, VX:VX + 2] for part in parts]
        change = [np.linalg.norm(each[6:] - each[:-6], axis=2).ravel() * HZ / 6 for each in moved]
        speeds = np.concatenate([np.linalg.norm(each, axis=2).ravel() for each in moved])
        near = [fronts(part.places)[:, team * robots:(team + 1) * robots] for part in parts]
        front = sum(int(np.isfinite(each).any(axis=1).sum()) for each in near)
        found.append(Limits(
            float(np.nanquantile(speeds, _MOST)), float(np.nanquantile(np.concatenate(change), _MOST)),
            np.array([speed for _, speed, _ in taken]), len(own),
            float(np.sqrt(np.mean([aside**2 for *_, aside in taken]))) if taken else 0.0, front / HZ))
    return found[0], found[1]


def rolling(parts: Sequence[Stretch]) -> Rolling:
    """Losses of speed of the ball where nobody is near, over 8 samples."""
    speeds, losses = list[float](), list[float]()
    for part in parts:
        ball, others = part.places[:, BALL], part.places[:, 1:, :2]
        near = np.nanmin(np.linalg.norm(others - ball[:, None, :2], axis=2), axis=1)
        speed = np.linalg.norm(ball[:, VX:VX + 2], axis=1)
        for t in range(STEPS + 4, len(part.places) - 4):
            if near[t - 4:t + 5].min() > _FREE and min(speed[t - 4], speed[t + 4]) > 0.3:
                speeds.append(float(speed[t]))
                losses.append(float(speed[t - 4] - speed[t + 4]) * HZ / 8)
    of, lost = np.array(speeds), np.array(losses)
    slow, fast = (lost[chosen] for chosen in (of <= _SLIDES, of > _SLIDES))
    return Rolling(*(max(float(np.median(each)), 0.0) if len(each) else 0.0 for each in (slow, fast)))


class World:
    """Robots and a ball that move a frame at a time; goals are counted.

    Args:
        pitch: its lines.
        teams: limits of home's robots, and of away's.
        roll: how the ball slows down.
        kick_offs: float64 [2, 1 + 2 N, 6], recorded places at a kick-off of home, and at one of away.
        rng: decides when robots kick, how hard, and how far aside.

    Attributes:
        bodies: float64 [1 + 2 N, 6], in the pitch frame; the same array always.
        goals: number of home's goals, and of away's.
        kicks: likewise.
        outs: times that the ball was out.
        stuck: times that it was put in the middle because it lay still.
        restarted: whether all bodies were put to their places in the last frame.
    """

    def __init__(
        self, pitch: Pitch, teams: tuple[Limits, Limits], roll: Rolling, kick_offs: F64,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self._pitch, self._teams, self._roll, self._kick_offs, self._rng = pitch, teams, roll, kick_offs, rng
        self._robots = (kick_offs.shape[1] - 1) // 2
        self._scales, self._still = SCALES[pitch.kind], 0
        self.bodies: F64 = np.zeros(kick_offs.shape[1:])
        self.goals, self.kicks, self.outs, self.stuck = [0, 0], [0, 0], 0, 0
        self.restarted = False
        self._space, self._own = self._build()

    def _build(self) -> tuple[pymunk.Space, list[pymunk.Body]]:
        space, own = pymunk.Space(), list[pymunk.Body]()
        for row in range(len(self.bodies)):
            radius = self._scales.ball_radius if row == BALL else self._scales.robot_radius
            body = pymunk.Body(_BALL_KG if row == BALL else _ROBOT_KG, math.inf)
            shape = pymunk.Circle(body, radius)
            shape.elasticity, shape.friction = (1.0, 0.0) if row == BALL else (0.2, 0.3)
            space.add(body, shape)
            own.append(body)
        end, side = self._pitch.goal_x + _MARGIN + 1.0, self._pitch.width / 2 + _MARGIN + 1.0
        for one, other in (((-end, side), (end, side)), ((-end, -side), (end, -side)),
                           ((-end, -side), (-end, side)), ((end, -side), (end, side))):
            wall = pymunk.Segment(space.static_body, one, other, 1.0)
            wall.elasticity = 0.2
            space.add(wall)
        return space, own

    def kick_off(self, team: int) -> None:
        """Put all bodies to the places that they had at a recorded kick-off of a team."""
        for body, (x, y, theta, *_) in zip(self._own, self._kick_offs[team].tolist(), strict=True):
            body.position, body.velocity, body.angle, body.angular_velocity = (x, y), (0.0, 0.0), theta, 0.0
        self._space.reindex_shapes_for_body(self._own[BALL])
        self.restarted, self._still = True, 0
        self._publish()

    def frame(self, changes: F64, turns: F64) -> None:
        """Advance by a frame.

        Args:
            changes: float64 [2 N, 2], acceleration of each robot, m/s²; more than it can is cut.
            turns: float64 [2 N], turn rates, rad/s.
        """
        self.restarted = False
        for row, (change, turn) in enumerate(zip(changes.tolist(), turns.tolist(), strict=True)):
            can, body = self._teams[row // self._robots], self._own[1 + row]
            size = math.hypot(*change)
            part = min(1.0, can.acceleration / size) / HZ if size else 0.0
            vx, vy = body.velocity.x + part * change[0], body.velocity.y + part * change[1]
            slower = min(1.0, can.top / (math.hypot(vx, vy) + 1e-9))
            body.velocity, body.angular_velocity = (slower * vx, slower * vy), turn
        self._play_ball()
        for _ in range(_SUBSTEPS):
            self._space.step(1 / (HZ * _SUBSTEPS))
        self._publish()
        self._whistle()

    def _play_ball(self) -> None:
        """Let the ball roll, be held and be kicked."""
        ball = self._own[BALL]
        speed = ball.velocity.length
        loss = (self._roll.fast if speed > _SLIDES else self._roll.slow) / HZ
        if speed > 0.0:
            ball.velocity = ball.velocity * max(0.0, 1.0 - loss / speed)
        front = fronts(self.bodies)
        robot = int(front.argmin())
        if not np.isfinite(front[robot]):
            return
        holder, team = self._own[1 + robot], robot // self._robots
        ball.velocity = holder.velocity + (ball.velocity - holder.velocity) * _HELD
        can = self._teams[team]
        if self._rng.random() < can.rate / HZ:
            aimed = holder.angle + can.aside * self._rng.standard_normal()
            hard = float(self._rng.choice(can.kicks))
            ball.velocity = (hard * math.cos(aimed), hard * math.sin(aimed))
            self.kicks[team] += 1

    def _publish(self) -> None:
        for row, body in enumerate(self._own):
            theta = math.atan2(math.sin(body.angle), math.cos(body.angle))
            self.bodies[row] = (*body.position, theta, *body.velocity, body.angular_velocity)
        self.bodies[BALL, THETA] = self.bodies[BALL, OMEGA] = 0.0

    def _whistle(self) -> None:
        """Count a goal, put a ball that is out back, and one that lies still to the middle."""
        x, y = self.bodies[BALL, X], self.bodies[BALL, Y]
        end, side = self._pitch.goal_x, self._pitch.width / 2
        self._still = self._still + 1 if math.hypot(*self.bodies[BALL, VX:VX + 2]) < _STUCK else 0
        if abs(x) > end and abs(y) < self._pitch.goal_width / 2:
            scorer = 0 if x > 0 else 1
            self.goals[scorer] += 1
            self.kick_off(1 - scorer)
        elif abs(x) > end or abs(y) > side:
            self.outs += 1
            end, side = end - _INSIDE, side - _INSIDE
            self._put_ball(min(max(x, -end), end), min(max(y, -side), side))
        elif self._still > _STUCK_S * HZ:
            self.stuck += 1
            self._put_ball(0.0, 0.0)

    def _put_ball(self, x: float, y: float) -> None:
        ball = self._own[BALL]
        ball.position, ball.velocity = (x, y), (0.0, 0.0)
        self._space.reindex_shapes_for_body(ball)
        self._still = 0
        self._publish()
