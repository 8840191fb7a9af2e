"""The laws of the game as numbers: what the referee counts, and where the marks on a pitch are.

The game is that of the IEEE Very Small Size League, three a side: FIRA's laws 8 to 13 as the league's
own referee program applies them when it decides alone. That program is VSSSLeague/VSSReferee. Its files
were read at these commits: ``src/constants/constants.json`` 18de86c; ``src/utils/utils.cpp`` and
``src/utils/types/field/field_default_3v3.h`` c792f76; its checkers as
:func:`pipeline.arena.physics.referee.referee_call` names them. docs/decisions/arena.md ("Laws of VSSReferee",
"Places at a penalty") compares the versions, and lists what that program does otherwise. On other pitches
everything scales.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

from pydantic import Field

from pitchlore.pipeline.base.bounds import MANY, Count, Pause, Positive, Seconds
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.game.pitch import MARKINGS, PITCHES, SCALES, Kind, Pitch

#: Calls of the referee at a frame. From KICK_OFF to HALF the bodies are put to their places at that
#: frame and play goes on from there; at GOAL, FOUL and END it stops.
PLAY_ON, KICK_OFF, FREE_BALL, PENALTY, GOAL_KICK, HALF, GOAL, FOUL, END = range(9)

# Markings of a VSSS pitch as shares of its length, width and goal.
_VSSS, _LINES = PITCHES[Kind.VSSS], MARKINGS[Kind.VSSS]
_AREA_DEPTH, _AREA_WIDTH = _LINES.areas[0][0] / _VSSS.length, _LINES.areas[0][1] / _VSSS.goal_width
_MARK_X, _MARK_Y = _LINES.marks[1][0] / _VSSS.length, _LINES.marks[1][1] / _VSSS.width
_CIRCLE, _CORNER = _LINES.circle / _VSSS.length, _LINES.corner / _VSSS.length
# The robots must find room: the league's pitch is 20 by 17.3 robots.
_LENGTH_IN_ROBOTS, _WIDTH_IN_ROBOTS = 19.9, 16.0


class RefereeSettings(Frozen):
    """Length of a match, and the calls of the referee.

    Attributes:
        duration_s: duration of the whole match, pauses included: the clock never stops. The paper's games
            take about eight minutes (section 6); the league plays two times five (``halfTime``).
        halves: number of equal parts; the teams change sides between them.
        pause_s: pause of play from a goal or a foul to the restart, at least one frame. Ours: the program
            waits two times ``transitionTime``, 7 s, three times after a goal, so that teams or people can
            place the robots. Here they are placed at once, and the clock never stops.
        stuck_speed: greatest speed at which a ball may be stuck, m/s on a VSSS pitch; elsewhere times the
            pitch's ``Scales.speed`` (``ballMinSpeedForStuck``, 0.1).
        stuck_s: time for which a stuck ball is slow (``stuckedBallTime``, 5.0).
        crowd: least number of robots of one team in a goal area that is too many (the checkers' 2; FIRA:
            more than one).
        crowd_s: longest time for which too many robots may be there together with the ball
            (``ballInAreaMaxTime``, 3.0).
        remember_crowds: whether a crowd is remembered until the ball leaves the area. It then annuls a goal
            or is a foul, however short it was (``useRefereeSuggestions``, false). Off, only a crowd that
            lasts is a foul, as in the first release.
        penalty: whether there are penalties. Without them a crowd of defenders is no foul, and a stuck ball
            gives a free ball instead.
        penalty_share: share of the crowds of defenders that are judged a foul, by the frame at which they
            would be. The program calls all when it decides alone. People may call fewer: FIRA's law 8
            excepts a robot that does not affect play.
        keeper_on_line: whether the goalkeeper that faces a penalty touches its goal line, as FIRA's law 11
            and the program's places have it. Off, there are 1 to 3 cm between them.
        goal_kick: whether there are goal kicks. Without them a crowd of attackers is no foul, and a stuck
            ball gives a free ball instead.
        scatter: greatest random offset of a robot at a restart, in robot lengths along each axis and in
            radians of its heading, so that no two matches are alike. Ours.
    """

    duration_s: float = Field(default=480.0, gt=0, le=86_400)
    halves: Count = 2
    pause_s: Pause = 0.5
    stuck_speed: Positive = 0.10
    stuck_s: Seconds = 5.0
    crowd: int = Field(default=2, ge=2, le=MANY)
    crowd_s: Seconds = 3.0
    remember_crowds: bool = True
    penalty: bool = True
    penalty_share: float = Field(default=1.0, ge=0, le=1, exclude_if=lambda share: share == 1)
    keeper_on_line: bool = Field(default=False, exclude_if=lambda on_line: not on_line)
    goal_kick: bool = True
    scatter: float = Field(default=0.1, ge=0, le=0.15)


class Marks(NamedTuple):
    """Marks of a pitch, metres from the centre.

    Lengths along x are shares of the pitch's length, lengths along y of its width. The width of the goal
    area is a share of the goal's. A VSSS pitch has the numbers in brackets.

    Attributes:
        goal_x: the goal lines (0.75).
        side_y: the side lines (0.65).
        goal_line: the centre of a ball that is wholly past a goal line is beyond this.
        post: the goal posts (0.20).
        area_x: where the goal areas begin, towards the goal line (0.60).
        area_y: their ends across (0.35). Their arcs count as outside, as in VSSReferee.
        mark_x: the marks of free balls and penalties (0.375).
        mark_y: the marks of free balls (0.40); those of penalties are at y = 0.
        circle: radius of the centre circle, and a robot's distance from a free ball (0.20).
        corner: length cut off at each corner, along each side, m (0.07).
        near: distance within which a robot contests a stuck ball: 1.5 robot lengths (0.1125), or the
            contact distance if that is greater, as in 2D, where robots kick from afar.
        robot: half a robot's length.
    """

    goal_x: float
    side_y: float
    goal_line: float
    post: float
    area_x: float
    area_y: float
    mark_x: float
    mark_y: float
    circle: float
    corner: float
    near: float
    robot: float

    @classmethod
    def of(cls, pitch: Pitch) -> Self:
        """The marks of a pitch.

        Raises:
            BadSettings: if its goals are too shallow for a whole ball, or if it is too small for the
                places that the laws give to robots.
        """
        scales = SCALES[pitch.kind]
        robot, ball = scales.robot_radius, scales.ball_radius
        if pitch.goal_depth <= 2 * ball:
            raise BadSettings(
                f"a goal {pitch.goal_depth:g} m deep is too shallow for a whole ball of {2 * ball:g} m",
                where="pitch", next_step="Make the goals deeper",
            )
        length, width = _LENGTH_IN_ROBOTS * 2 * robot, _WIDTH_IN_ROBOTS * 2 * robot
        if pitch.length < length or pitch.width < width:
            raise BadSettings(
                f"{pitch.length:g} by {pitch.width:g} m is too small for robots of {2 * robot:g} m",
                where="pitch: length, width", next_step=f"Make it at least {length:.3g} by {width:.3g} m",
            )
        return cls(
            goal_x=pitch.goal_x,
            side_y=pitch.width / 2,
            goal_line=pitch.goal_x + ball,
            post=pitch.goal_width / 2,
            area_x=pitch.goal_x - _AREA_DEPTH * pitch.length,
            # a goal nearly as wide as the pitch leaves room beside its area
            area_y=min(_AREA_WIDTH * pitch.goal_width, 0.8 * pitch.width) / 2,
            mark_x=_MARK_X * pitch.length,
            mark_y=_MARK_Y * pitch.width,
            circle=_CIRCLE * pitch.length,
            corner=_CORNER * pitch.length,
            near=max(3 * robot, scales.contact),
            robot=robot,
        )


def frames_lasting(seconds: float, hz: float) -> int:
    """The least number of frames that take at least this time; rounding errors do not add a frame."""
    return math.ceil(round(seconds * hz, 6))
