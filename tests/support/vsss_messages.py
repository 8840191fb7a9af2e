"""VSSS packets for tests, written from field numbers, without any library of the league's or protobuf's.

The numbers are written here once more, so that a wrong one in ``pipeline.importers.packets.vsss`` shows.
"""

from collections.abc import Iterable

from support.ssl_messages import f64, integer, span

FREE_KICK, PENALTY_KICK, GOAL_KICK, FREE_BALL, KICKOFF, STOP, GAME_ON, HALT = range(8)
BLUE, YELLOW, NEITHER = range(3)

#: A robot's number, x, y (m) and orientation (radians).
Robot = tuple[int, float, float, float]


def _robot(robot: Robot) -> bytes:
    number, x, y, theta = robot
    return integer(1, number or None) + f64(2, x or None) + f64(3, y or None) + f64(4, theta or None)


def environment(
    step: int, ball: tuple[float, float] | None = (0.0, 0.0), yellow: Iterable[Robot] = (), blue: Iterable[Robot] = (),
    *, goals: tuple[int, int] | None = None, size: tuple[float, float, float, float] | None = (1.3, 1.5, 0.4, 0.1),
) -> bytes:
    """FIRASim's environment; goals are blue's and yellow's, the size is width, length, goal's width and depth."""
    frame = b"" if ball is None else span(1, f64(1, ball[0] or None) + f64(2, ball[1] or None) + f64(3, 0.02))
    frame += b"".join(span(2, _robot(robot)) for robot in yellow) + b"".join(span(3, _robot(robot)) for robot in blue)
    data = integer(1, step or None) + span(2, frame)
    if size is not None:
        data += span(3, b"".join(f64(i, metres) for i, metres in enumerate(size, 1)))
    if goals is not None:
        data += integer(4, goals[0] or None) + integer(5, goals[1] or None)
    return data


def command(foul: int, colour: int = NEITHER, *, quadrant: int = 0, clock: float = 1.0, half: int | None = 1) -> bytes:
    """VSSReferee's command."""
    return (integer(1, foul or None) + integer(2, colour or None) + integer(3, quadrant or None) + f64(4, clock or None)
            + integer(5, half))
