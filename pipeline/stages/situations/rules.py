"""The rules as data: Table 1's situations, each with its initial and final condition.

Codes, names and priorities are the paper's (Table 1). Conditions and times are ours, because the paper
prints none (docs/decisions/numbers.md, docs/decisions/situations.md).
:mod:`pipeline.stages.situations.conditions` defines the language of the conditions.

Signals
    ``ball_distance``, ``own_goal_distance``, …: from the robot's centre.
    ``nearest_ball_distance``: ``ball_distance`` if no other robot is nearer to the ball, else far off.
    ``ball_off_heading``: angle between the robot's heading and the bearing of the ball.
    ``ball_off_face``: angle between the nearest side of the robot that plays the ball and the bearing of the
    ball. A VSSS robot plays it with its front and its back, an SSL robot with its front, a 2D player all
    around, for which the angle is 0.
    ``ball_off_course``: the same for the robot's course, the direction in which it drives. The course is
    the heading, or its opposite while the robot reverses; for omnidirectional robots it is the direction
    of motion.
    ``robot_off_ball_course``: angle between the ball's direction of travel and the bearing of the robot.
    ``course_off_ball_course``: angle between the robot's course and the ball's direction of travel.
    ``ball_jolt``, ``ball_gain``: how much the ball's velocity has just changed, and its speed
    (:func:`pipeline.stages.situations.dense.jolts`).
    ``ball_y_way_off_course``: angle between the robot's course and the ball's direction of travel across the
    pitch, straight to one side or the other.
    ``ball_x``, ``ball_y``: the points level with the ball along and across the pitch: (ball's x, robot's y)
    and (robot's x, ball's y).
    ``other_…``: another robot; the rule runs for each in turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

#: Code to name and priority, 1 is the highest, else None (Table 1, with one apostrophe less in "its own").
TABLE_1: dict[int, tuple[str, int | None]] = {
    1: ("Robot with the ball", 1),
    11: ("Robot guides the ball", 2),
    21: ("Robot kicks the ball", 3),
    22: ("Robot loses the ball", 4),
    23: ("Robot yields the ball", 4),
    33: ("Robot leaves the ball", 5),
    34: ("Robot moves away from the ball", 10),
    44: ("Robot reaches the ball", 6),
    45: ("Robot receives the ball", 7),
    46: ("Robot approaches the ball", 9),
    47: ("Ball hits the robot", 8),
    57: ("Robot orients to the ball", 11),
    67: ("Robot goes ball's X direction", 12),
    68: ("Robot goes ball's Y direction", 13),
    78: ("Robot orients to its own goal", 14),
    88: ("Robot approaches its own goal", 15),
    98: ("Robot moves away from its own goal", 16),
    108: ("Robot orients to adversary's goal", 17),
    118: ("Robot approaches the adversary's goal", 18),
    128: ("Robot moves away from adversary's goal", 19),
    138: ("Robot approaches goalkeeper adversary", 21),
    139: ("Robot approaches midfield adversary", 21),
    140: ("Robot approaches striker adversary", 21),
    150: ("Robot moves away from goalkeeper adversary", 24),
    151: ("Robot moves away from midfield adversary", 24),
    152: ("Robot moves away from striker adversary", 24),
    162: ("Robot approaches role +1 teammate", 23),
    163: ("Robot approaches role +2 teammate", 23),
    173: ("Robot moves away from role+1 teammate", 22),
    174: ("Robot moves away from role+2 teammate", 22),
    184: ("Robot does not move", 20),
    194: ("Robot moves randomly", None),
}


class Start(StrEnum):
    """Start of a situation; it decides how the rule is applied.

    ONSET: where the initial condition set in; the condition describes the motion itself.
    LATEST: where the initial condition last held; the condition describes the state before.
    WHILE: where the initial condition set in. The situation lasts while it holds. Instead of a final
        condition, the playing time since it set in must reach a term.
    """

    ONSET = "onset"
    LATEST = "latest"
    WHILE = "while"


class Target(StrEnum):
    """Target of a situation; in tables another robot has its team and number instead."""

    BALL = "ball"
    OWN_GOAL = "own-goal"
    ADVERSARY_GOAL = "adversary-goal"
    OPPONENT = "opponent"
    TEAMMATE = "teammate"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule that recognises a situation; a situation has one or more.

    Attributes:
        code: code of Table 1. A rule about another robot has three codes. For an opponent they go by its role
            (goalkeeper, midfield, striker); for a teammate, by the number of roles that it is ahead on the
            circle of roles (0, 1, 2). Code 0 is no situation.
        variant: name of the rule among the situation's rules.
        initial: the condition that marks it as possible.
        final: the condition that completes it, within ``limit_s`` of the mark; empty for WHILE.
        start: start of the situation.
        target: its target.
        limit_s: seconds for which a mark holds after the initial condition last held. For WHILE, the
            longest situation; a longer stretch is cut.
        lasts: for WHILE, a term of the playing time: the condition must have held for so long, or longer.
        once: for WHILE, whether only the first ``limit_s`` of the stretch count.
    """

    code: int | tuple[int, int, int]
    variant: str
    initial: str
    final: str
    start: Start
    target: Target
    limit_s: float
    lasts: str = ""
    once: bool = False


MACROS: dict[str, str] = {
    "touching": "ball_distance is CONTACT",
    "first_at_ball": "nearest_ball_distance is CONTACT",
    "facing_ball": "ball_off_face is FACING",
    "has_ball": "first_at_ball and facing_ball",
    "struck": "ball_jolt is MUCH_FASTER and not ball_gain is (SLOWER or MUCH_SLOWER)",
    "tapped": "ball_jolt is (FASTER or MUCH_FASTER) and not ball_distance is BODY",
    "keeps_ball": "has_ball and not struck and not tapped",
    "moving": "speed is (FASTER or MUCH_FASTER)",
    "ball_slow": "ball_speed is (EQUAL or FASTER)",
    "ball_moving": "ball_speed is (FASTER or MUCH_FASTER)",
    "beside_ball": "ball_distance is (CLOSE or NEAR)",
    "ball_goes_off": "robot_off_ball_course is BACK",
    "ball_comes": "robot_off_ball_course is FACING",
    "opponent_touching": "opponent_ball_distance is CONTACT",
    "teammate_touching": "teammate_ball_distance is CONTACT",
    "nobody_else_touching": "not opponent_touching and not teammate_touching",
    "nobody_else_near": "not opponent_ball_distance is (CONTACT or CLOSE or NEAR)"
    " and not teammate_ball_distance is (CONTACT or CLOSE or NEAR)",
}

_O, _L, _W = Start.ONSET, Start.LATEST, Start.WHILE
_NEARER = (("FAR", "NEAR"), ("NEAR", "CLOSE"))
_FARTHER = (("CLOSE", "NEAR"), ("NEAR", "FAR"))


def _ladder(
    code: tuple[int, int, int], thing: str, target: Target, steps: tuple[tuple[str, str], ...]
) -> tuple[Rule, ...]:
    """Rules for driving to (or from) a thing, one for each step from a distance term to the next."""
    course = "FACING" if steps[-1][1] == "CLOSE" else "BACK"
    return tuple(
        Rule(
            code, f"{here} to {there}".lower(),
            f"{thing}_distance is {here} and {thing}_off_course is {course} and moving",
            f"{thing}_distance is {there}", _O, target, 0.30,
        )
        for here, there in steps
    )


def _goes(code: int, thing: str, course: str, target: Target) -> Rule:
    """Rule for driving to (or from) a goal for some time."""
    return Rule(code, "", f"{thing}_off_course is {course} and moving", "", _W, target, 2.0, lasts="SHORT")


def _turn(code: int, thing: str, target: Target) -> Rule:
    """Rule for turning to a thing: from 36 degrees off or more to 24 or less."""
    return Rule(
        code, "", f"very(not {thing}_off_heading is FACING)", f"very({thing}_off_heading is FACING)",
        _L, target, 0.50,
    )


def _level(code: int, thing: str) -> tuple[Rule, Rule]:
    """Rules for driving along (or across) the pitch: until level with the ball, and for some time."""
    goes = f"not {thing}_distance is CONTACT and {thing}_off_course is FACING and moving"
    return (
        Rule(
            code, "gets level", goes,
            f"{thing}_distance is CONTACT and ball_distance is (NEAR or FAR or VERY_FAR)", _O, _BALL, 0.20,
        ),
        Rule(code, "goes", goes, "", _W, _BALL, 2.0, lasts="SHORT"),
    )


_BALL, _OWN, _ADVERSARY = Target.BALL, Target.OWN_GOAL, Target.ADVERSARY_GOAL

RULES: tuple[Rule, ...] = (
    Rule(1, "gains it", "keeps_ball", "", _W, _BALL, 0.15, lasts="SHORT", once=True),
    Rule(1, "holds it", "keeps_ball and ball_speed is EQUAL", "", _W, _BALL, 1.0, lasts="MEDIUM"),
    Rule(
        11, "", "keeps_ball and moving and ball_moving and course_off_ball_course is PARALLEL", "",
        _W, _BALL, 1.0, lasts="SHORT",
    ),
    Rule(
        21, "push", "has_ball and moving and (ball_distance is BODY or nobody_else_near)",
        "not touching and ball_goes_off and ball_speed_over_robot is (FASTER or MUCH_FASTER)"
        " and course_off_ball_course is PARALLEL",
        _L, _BALL, 0.40,
    ),
    Rule(21, "strike", "first_at_ball", "struck", _L, _BALL, 0.06),
    Rule(21, "tap", "first_at_ball and not ball_distance is BODY", "tapped", _L, _BALL, 0.0),
    Rule(22, "", "has_ball", "not touching and opponent_touching", _L, _BALL, 1.0),
    Rule(23, "", "has_ball", "not touching and teammate_touching", _L, _BALL, 2.0),
    Rule(
        33, "", "has_ball",
        "not touching and not ball_off_course is FACING and speed_over_ball is (FASTER or MUCH_FASTER)"
        " and ball_slow and nobody_else_touching",
        _L, _BALL, 0.60,
    ),
    Rule(34, "", "not touching and ball_off_course is AWAY and moving", "", _W, _BALL, 2.0, lasts="SHORT"),
    Rule(
        44, "",
        "beside_ball and facing_ball and speed_over_ball is (EQUAL or FASTER or MUCH_FASTER) and moving",
        "has_ball", _O, _BALL, 0.15,
    ),
    Rule(
        45, "",
        "(beside_ball or ball_distance is FAR) and facing_ball and ball_comes and"
        " (speed_over_ball is (SLOWER or MUCH_SLOWER) or speed_over_ball is EQUAL and not moving)",
        "has_ball", _O, _BALL, 0.15,
    ),
    Rule(46, "", "not touching and ball_off_course is TOWARDS and moving", "", _W, _BALL, 2.0, lasts="SHORT"),
    Rule(
        47, "comes",
        "beside_ball and not facing_ball and ball_comes and speed_over_ball is (SLOWER or MUCH_SLOWER)",
        "touching and not facing_ball", _O, _BALL, 0.15,
    ),
    Rule(
        47, "close by", "ball_distance is CLOSE and not facing_ball", "touching and not facing_ball",
        _L, _BALL, 0.15,
    ),
    _turn(57, "ball", _BALL),
    *_level(67, "ball_x"),
    *_level(68, "ball_y"),
    Rule(
        68, "follows", "ball_moving and ball_y_way_off_course is FACING and moving", "",
        _W, _BALL, 2.0, lasts="SHORT",
    ),
    _turn(78, "own_goal", _OWN),
    _goes(88, "own_goal", "FACING", _OWN),
    # in its own half only: beyond it, the same run is 118, which has a lower priority
    Rule(
        98, "", "not own_goal_distance is VERY_FAR and own_goal_off_course is BACK and moving", "",
        _W, _OWN, 2.0, lasts="SHORT",
    ),
    _turn(108, "adversary_goal", _ADVERSARY),
    _goes(118, "adversary_goal", "FACING", _ADVERSARY),
    _goes(128, "adversary_goal", "BACK", _ADVERSARY),
    *_ladder((138, 139, 140), "other", Target.OPPONENT, _NEARER),
    *_ladder((150, 151, 152), "other", Target.OPPONENT, _FARTHER),
    *_ladder((0, 162, 163), "other", Target.TEAMMATE, _NEARER),
    *_ladder((0, 173, 174), "other", Target.TEAMMATE, _FARTHER),
    Rule(184, "", "speed is EQUAL", "", _W, Target.NOTHING, 2.0, lasts="MEDIUM"),
)
