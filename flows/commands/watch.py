"""The command watch: record the match that is being played."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import Annotated

from cyclopts import Parameter
from cyclopts.types import PositiveFloat

from pitchlore.flows.commands.addresses import At, Interface, addressed, listening_to
from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.printing import console, print_json, say
from pitchlore.pipeline.importers.packets.streams import LEAGUES, ON_DEMAND, OPTIONS, LeagueName, Stream
from pitchlore.pipeline.sessions.showing import Showing
from pitchlore.pipeline.sessions.watching import Watched, watch


def watch_match(
    league: LeagueName,
    *,
    group: str | None = None,
    at: At = (),
    interface: Interface = None,
    seconds: PositiveFloat | None = None,
    replay: Annotated[bool, Parameter(negative="")] = False,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Record the match that is being played, as its packets arrive, until Ctrl-C; `run` takes the recording.

    A line says each second how many frames came, how many were lost, the score and the clock. If the process
    is killed, all but its last half second is kept. A VSSS team may tell what its robots do, by
    --at options=ADDRESS:PORT.

    Args:
        league: ssl (vision, tracker, game controller) or vsss (FIRASim, VSSReferee).
        group: Address of all streams instead of the league's own, such as 127.0.0.1.
        at: Address of one stream.
        interface: Network card.
        seconds: How long (default: until Ctrl-C).
        replay: Also show the match in a window, with the situations as they are recognised.
        json: Print JSON.
        common: Options of every command.
    """
    streams = addressed(LEAGUES[league], group, at, ON_DEMAND[league])
    lines = sys.stderr.isatty()

    def status(line: str) -> None:
        """In a terminal each line takes the place of the one before."""
        sys.stderr.write(f"\r\x1b[K{line}" if lines else f"{line}\n")
        sys.stderr.flush()

    with ExitStack() as stack:
        see = stack.enter_context(Showing(league, "watch", say)).see if replay else lambda _: None
        found = watch(common.store, league, streams, interface=interface, seconds=seconds, say=status,
                      listening=lambda addresses: say(listening_to(addresses)), see=see)
    if lines:
        sys.stderr.write("\n")
    if json:
        print_json({"file": None if found.file is None else str(found.file), "packets": found.packets,
                    "options": found.options, "frames_lost": found.frames_lost,
                    "seconds": round(found.seconds, 1),
                    "refused": [{"stream": stream, "why": why, "packets": count}
                                for (stream, why), count in sorted(found.refused.items())]})
    else:
        _print(found, streams)
    sys.exit(0 if found.file is not None else 1)


def _print(found: Watched, streams: tuple[Stream, ...]) -> None:
    out = console()
    for (stream, why), count in sorted(found.refused.items()):
        out.print(f"Left out: {count} packets to {stream} ({why})")
    if found.file is None:
        of_match = [stream for stream in streams if stream.name != OPTIONS.name]
        where = ", ".join(f"{stream.group}:{stream.port}" for stream in of_match)
        out.print(f"No packet came to {where}. Is this computer in the match's network? "
                  "--interface names the network card.", soft_wrap=True)
    else:
        told = f" and {found.options} options" if found.options else ""
        out.print(f"{found.packets} packets{told} in {found.seconds:.0f} s, {found.frames_lost} frames lost. "
                  f"Kept in {found.file}; `pitchlore run` takes it.", soft_wrap=True)
