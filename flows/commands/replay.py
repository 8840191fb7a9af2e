"""The command replay: a match as a web page or a film."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, UserPath
from pitchlore.flows.commands.printing import console, print_stand_in


def replay(
    match: str, *, output: Annotated[UserPath | None, Parameter(alias="-o")] = None, hz: float = 20.0,
    gif: UserPath | None = None,
    start: Annotated[float, Parameter(name="--from")] = 0.0, seconds: float = 20.0,
    common: Common = DEFAULTS,
) -> None:
    """Write a match as one web page with pitch, situations, goals, passes and shots, or a part as a GIF.

    The page needs no network.

    Args:
        match: Id of the match, or its beginning.
        output: File to write (default: replays/MATCH.html in the data folder).
        hz: Samples per second of play in the page.
        gif: Write an animation of a part of the match into this file instead.
        start: Start of the animation, seconds since the first sample.
        seconds: Length of the animation, seconds. It ends with the match at the latest.
        common: Options of every command.
    """
    shown = common.league.match(match)
    if gif is not None:
        shown.film(gif, start_s=start, seconds=seconds)
        lasts = min(seconds, shown.info["duration_s"] - start)
        said = f"{gif} ({gif.stat().st_size / 1e6:.2f} MB): {lasts:.4g} s from {start:g} s on"
        console().print(said, soft_wrap=True)
        return
    path = shown.replay(output, hz=hz)
    console().print(f"{path} ({path.stat().st_size / 1e6:.2f} MB): open it in a browser", soft_wrap=True)
    print_stand_in(shown.home, shown.away)
