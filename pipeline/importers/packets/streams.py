"""Streams that the leagues send while a match is played, and their addresses.

Sources: for SSL the defaults of the league's recorder (RoboCup-SSL/ssl-go-tools,
``cmd/ssl-log-recorder/ssl-log-recorder.go`` at 0b55551). For VSSS those of the league's referee
(VSSSLeague/VSSReferee, ``src/constants/constants.json`` at 0528e93), whose vision is FIRASim.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

LeagueName = Literal["ssl", "vsss"]


class Stream(NamedTuple):
    """One kind of packets of a league.

    Attributes:
        name: name of the stream, unique in its league.
        channel: id of its channel in a recording; for SSL also the type of its messages in a game log.
        group: IPv4 address to which it is sent.
        port: UDP port.
    """

    name: str
    channel: int
    group: str
    port: int


#: The streams of each league.
LEAGUES: dict[LeagueName, tuple[Stream, ...]] = {
    "ssl": (
        Stream("vision", 4, "224.5.23.2", 10006),
        Stream("vision-2010", 2, "224.5.23.2", 10005),
        Stream("tracker", 5, "224.5.23.2", 10010),
        Stream("referee", 3, "224.5.23.1", 10003),
    ),
    "vsss": (
        Stream("vision", 1, "224.0.0.1", 10002),
        Stream("referee", 2, "224.5.23.2", 10003),
    ),
}
assert set(LEAGUES) == set(get_args(LeagueName))

#: What teams tell of their own robots (``told``); it is no stream of a league, and has no address of its own.
OPTIONS = Stream("options", 100, "127.0.0.1", 0)
#: Streams that are listened to only where people say.
ON_DEMAND: dict[LeagueName, tuple[Stream, ...]] = {"ssl": (), "vsss": (OPTIONS,)}

#: Largest content of a UDP packet over IPv4, bytes.
LARGEST = 65_507


def channels(league: LeagueName) -> dict[str, int]:
    """Channel of each stream of a league, by its name."""
    return {stream.name: stream.channel for stream in LEAGUES[league]}


def topic(league: LeagueName, stream: Stream) -> str:
    """Topic of a stream in a recording."""
    return f"/{league}/{stream.name}"
