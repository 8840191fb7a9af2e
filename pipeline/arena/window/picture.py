"""The contents of the window at one frame of a match."""

from typing import NamedTuple

from pipeline.bodies import F64


class Picture(NamedTuple):
    """A frame of a match as the window shows it.

    Attributes:
        bodies: float64 [1 + 2 N, 6] in the pitch frame.
        home_attacks: +1 if home attacks +x, else -1.
        score: goals of home and away.
        clock_s: seconds played.
        duration_s: of the match.
        driven: row of the robot that a person drives, None if they drive none.
        message: in large letters over the pitch; none if empty.
    """

    bodies: F64
    home_attacks: int
    score: tuple[int, int]
    clock_s: float
    duration_s: float
    driven: int | None = None
    message: str = ""
