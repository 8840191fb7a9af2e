"""The command drive: one of our teams drives others' robots."""

from __future__ import annotations

import sys
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.types import PositiveFloat, PositiveInt

from pitchlore.flows.commands.addresses import At, Interface, addressed, listening_to
from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.playing import AS_LEARNED, Learners, Seed, WhoPlays
from pitchlore.flows.commands.printing import console, print_json, say
from pitchlore.pipeline.sessions.driving import Job, Protocol, TeamColour, drive_team, streams_of


def drive_robots(
    *,
    team: WhoPlays,
    side: Annotated[TeamColour, Parameter(name="--as")],
    protocol: Protocol = "vsss",
    robots: PositiveInt = 3,
    attacks: Literal["right", "left"] | None = None,
    at: At = (),
    interface: Interface = None,
    seconds: PositiveFloat | None = None,
    seed: Seed = 1,
    learners: Learners = AS_LEARNED,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Let a team drive robots that another program simulates, until Ctrl-C.

    It sees FIRASim's packets, or those of SSL-Vision, and sends commands 60 times a second. Robots stand
    while the referee does not let play go on, when no vision came for 0.3 s, and when the command ends. What
    was seen and decided is logged; `run` takes the log.

    Args:
        team: The team that drives.
        side: Colour of the robots.
        protocol: vsss (FIRASim) or ssl-sim (SSL's simulation protocol).
        robots: Robots a side, with the numbers from 0.
        attacks: Where the team attacks in the first half (default: as the game controller says, else blue to
            the right, yellow to the left).
        at: Address of one stream.
        interface: Network card.
        seconds: How long (default: until Ctrl-C).
        seed: Seed of what the team leaves to chance.
        learners: How a learned team plays.
        json: Print JSON.
        common: Options of every command.
    """
    store = common.store
    (entrant,), policies = learners.entrants(store, team)
    streams = addressed(streams_of(protocol, side), None, at)

    done = drive_team(store, Job(
        protocol, side, entrant.settings, team, policies, robots, attacks, streams, interface, seconds, seed,
    ), say=say, listening=lambda addresses: say(listening_to(addresses)))
    if json:
        print_json({"file": None if done.file is None else str(done.file), "frames": done.frames,
                    "vision_lost": done.blind, "score": done.score, "seconds": round(done.seconds, 1),
                    "refused": [{"stream": stream, "why": why, "packets": count}
                                for (stream, why), count in sorted(done.refused.items())]})
        sys.exit(0 if done.file is not None else 1)
    for (stream, why), count in sorted(done.refused.items()):
        console().print(f"Left out: {count} packets to {stream} ({why})")
    if done.file is None:
        console().print(
            "It ended before its first frame: nothing is logged." if done.vision else
            "No vision came: is the simulator running, and does it send to this computer?")
    else:
        score = "? : ?" if done.score is None else "{} : {}".format(*done.score)
        console().print(
            f"blue {score} yellow, {done.frames} frames in play, losses of vision: {done.blind}. "
            f"Kept in {done.file}; `pitchlore run` takes it.", soft_wrap=True)
    sys.exit(0 if done.file is not None else 1)
