"""The camera above the pitch: it sees bodies late, with noise, and not in every frame.

Its errors are those of FIRASim's vision: Gaussian noise, sending delay, vanishing bodies (its
``configwidget.cpp`` 8955749). Like the program behind a real camera, it estimates velocities from the
poses that were seen.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pitchlore.pipeline.base.bounds import Amount, Seconds
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.game.bodies import BALL, COLUMNS, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit

# A body that was seen so many deviations of the noise beyond where it can have gone was put there.
_DEVIATIONS = 6.0


class CameraSettings(Frozen):
    """Errors of the camera: none by default, which takes no time.

    Attributes:
        position_noise: standard deviation of each coordinate of a position, metres (FIRASim, grSim: 0.003).
        heading_noise: standard deviation of a robot's heading, radians (FIRASim, grSim: 2 degrees).
        latency_s: age of the picture, seconds; rounded to whole frames.
        robot_unseen: probability that a robot is not seen in a frame, independent for each robot and frame.
        ball_unseen: the same for the ball.
        smoothing_s: time constant of the filter that estimates velocities: a sample of this age counts 1/e
            of a new one. With a noise of 3 mm at 60 Hz a velocity has an error of 1.7 cm/s (standard
            deviation) and is a tenth of a second late. With half the time constant the error is 4.6 cm/s,
            and the delay is half as long. Ours.
    """

    position_noise: Amount = 0.0
    heading_noise: Amount = 0.0
    latency_s: float = Field(default=0.0, ge=0, le=1)
    robot_unseen: float = Field(default=0.0, ge=0, lt=1)
    ball_unseen: float = Field(default=0.0, ge=0, lt=1)
    smoothing_s: Seconds = 0.05

    @property
    def off(self) -> bool:
        """True if bodies are seen as they are."""
        return not any(
            (self.position_noise, self.heading_noise, self.latency_s, self.robot_unseen, self.ball_unseen)
        )


class Camera:
    """View of players and of the log, a frame at a time.

    A camera that is off passes its input on. Any other camera sees poses only. It estimates velocities by a
    fading-memory filter of first degree on each coordinate (Brookner 1998, "Tracking and Kalman Filtering
    Made Easy", section 1.2.6). Let a body be seen ``k`` frames after it was seen last, and
    ``theta = exp(-k / (hz smoothing_s))``. The filter's position then moves by ``1 - theta²`` of its error,
    and its velocity by ``(1 - theta)²`` of the error over ``k / hz``. A body that is seen further away than
    it can have driven or rolled was put there, and its velocity starts from 0, as all do.

    What is random in a frame depends on ``rng`` and the frame's number alone, not on the settings.

    Args:
        settings: its errors.
        pitch: its kind tells how fast bodies can be.
        robots: N, robots a side.
        hz: frames a second.
        rng: decides noise and what is not seen; a camera that is off draws nothing.

    Attributes:
        off: whether bodies are seen as they are.
        latency: frames between what is there and what is seen of it.
    """

    def __init__(
        self, settings: CameraSettings, pitch: Pitch, robots: int, hz: float, rng: np.random.Generator
    ) -> None:
        rows = 1 + 2 * robots
        self.latency = round(settings.latency_s * hz)
        self.off = settings.off
        self._rng = rng
        self._frame = 0
        self._past = np.zeros((self.latency + 1, rows, COLUMNS))
        self._noise = np.zeros((rows, 3))
        self._luck = np.zeros(rows)
        self._chance = np.full(rows, settings.robot_unseen)
        self._chance[BALL] = settings.ball_unseen
        scales = SCALES[pitch.kind]
        self._reach = np.full(rows, scales.max_robot_speed / hz)
        self._reach[BALL] = scales.max_ball_speed / hz
        self._constants = np.array(
            [settings.position_noise, settings.heading_noise, hz, math.exp(-1 / (hz * settings.smoothing_s))]
        )
        self._unseen_for = np.zeros(rows, dtype=np.int64)
        self._track = np.zeros((rows, COLUMNS))
        self._seen = np.zeros((rows, COLUMNS))
        self._visible = np.ones(rows, dtype=np.bool_)

    def see(self, bodies: F64) -> tuple[F64, Bools]:
        """The bodies as they are seen at the next frame.

        All bodies are seen at the first frame, and in the first ``latency`` frames as they were at it.
        One that is not seen keeps the pose and velocity with which it was seen last: players go on from
        there, while the log leaves it out.

        Args:
            bodies: float64 [1 + 2 N, 6] as they are at this frame; neither changed nor kept.

        Returns:
            The bodies as they are seen, float64 [1 + 2 N, 6], and which of them were, bool [1 + 2 N].
            Both arrays are the camera's own and change with the next call; the first is ``bodies``
            itself if the camera is off.
        """
        if self.off:
            return bodies, self._visible
        slots = len(self._past)
        if self._frame == 0:
            self._past[:] = bodies
        self._past[self._frame % slots] = bodies
        self._rng.standard_normal(out=self._noise)
        self._rng.random(out=self._luck)
        look(
            self._past[(self._frame + 1) % slots], self._noise, self._luck, self._chance, self._reach,
            self._constants, self._frame == 0, self._unseen_for, self._track, self._seen, self._visible,
        )  # fmt: skip
        self._frame += 1
        return self._seen, self._visible


@njit(cache=True, nogil=True, error_model="numpy")
def look(
    there: F64, noise: F64, luck: F64, chance: F64, reach: F64, constants: F64, first: bool,
    unseen_for: I64, track: F64, seen: F64, visible: Bools,
) -> None:
    """One frame of the camera.

    Args:
        there: float64 [1 + 2 N, 6], what it looks at.
        noise: float64 [1 + 2 N, 3], of variance 1, for x, y and theta.
        luck: float64 [1 + 2 N] in [0, 1); a body is not seen where it is below ``chance``.
        chance: float64 [1 + 2 N].
        reach: float64 [1 + 2 N], metres that a body goes in a frame at most.
        constants: deviations of position (m) and heading (rad), frames a second, theta of one frame.
        first: whether it is the first frame.
        unseen_for: int64 [1 + 2 N], frames since each was seen; changed.
        track: float64 [1 + 2 N, 6], the filter's poses and velocities; changed.
        seen: float64 [1 + 2 N, 6]; changed.
        visible: bool [1 + 2 N]; written.
    """
    position, heading, hz, decay = constants
    for row in range(there.shape[0]):
        unseen_for[row] += 1
        visible[row] = first or luck[row] >= chance[row]
        if not visible[row]:
            continue
        frames = unseen_for[row]
        unseen_for[row] = 0
        x = there[row, X] + position * noise[row, 0]
        y = there[row, Y] + position * noise[row, 1]
        theta = 0.0
        if row != BALL:
            theta = _wrapped(there[row, THETA] + heading * noise[row, 2])
        gone = math.hypot(x - seen[row, X], y - seen[row, Y])
        seen[row, X], seen[row, Y], seen[row, THETA] = x, y, theta
        if first or gone > frames * reach[row] + _DEVIATIONS * position:
            track[row, X], track[row, Y], track[row, THETA] = x, y, theta
            track[row, VX] = track[row, VY] = track[row, OMEGA] = 0.0
        else:
            fade, past_s = decay**frames, frames / hz
            for pose in range(3):
                ahead = track[row, pose] + past_s * track[row, VX + pose]
                wrong = seen[row, pose] - ahead
                if pose == THETA:
                    wrong = _wrapped(wrong)
                track[row, pose] = ahead + (1 - fade * fade) * wrong
                track[row, VX + pose] += (1 - fade) ** 2 / past_s * wrong
        seen[row, VX], seen[row, VY], seen[row, OMEGA] = track[row, VX], track[row, VY], track[row, OMEGA]


@njit(cache=True, nogil=True, error_model="numpy")
def _wrapped(angle: float) -> float:
    """The same angle in (-pi, pi]."""
    turned = math.pi - (math.pi - angle) % (2 * math.pi)
    return math.pi if turned <= -math.pi else turned
