"""Short SSL games for tests: packets by second, as logs and as matches."""

from collections.abc import Iterable

from support.ssl_messages import REFEREE, VISION_2014, Message, Seen, Team, log, referee, size, vision

from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.ssl_logs.stages import COMMANDS, STAGES
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map
from pitchlore.pipeline.matches.frame import MatchLog

#: Unix time at which the games begin, seconds; a sum with a sixty-fourth of a second is exact.
EPOCH = 1_750_000_000.0
GEOMETRY = size(9.0, 6.0, 1.0, 0.18)
STEP = 1 / 64


def ns(t: float) -> int:
    """Receive time of what is sent at ``t`` seconds after the begin."""
    return round((EPOCH + t) * 1e9)


def seen(frame: int, *, camera: int = 0, later: float = 0.0, geometry: bytes | None = None,
         balls: Iterable[Seen] = (), yellow: Iterable[Seen] = (), blue: Iterable[Seen] = (),
         sent: float | None = None) -> Message:
    """A frame of a camera, at frame times ``STEP``, captured ``later`` seconds after."""
    t = frame * STEP + later
    content = vision(frame, EPOCH + t, camera=camera, balls=balls, yellow=yellow, blue=blue, geometry=geometry)
    return Message(ns(t) if sent is None else ns(sent), VISION_2014, content)


def frames(count: int, first: int = 0) -> list[Message]:
    """Frames of one camera: a ball that rolls, one robot a side; the first has the geometry."""
    return [
        seen(frame, geometry=GEOMETRY if frame == first else None, balls=[Seen(-1 + frame * 0.01, 0.5)],
             yellow=[Seen(-2.0, 0.0, 1, 0.1)], blue=[Seen(2.0, 0.0, 2, 3.0)])
        for frame in range(first, first + count)
    ]


class Referee:
    """The game controller's packets, each with what changed."""

    def __init__(self, source: str | None = "gc") -> None:
        self.stage, self.command, self.counter = 0, 0, 0
        self.yellow, self.blue = Team("Yellows"), Team("Blues")
        self.side: bool | None = False
        self._source = source

    def says(self, frame: int, *, command: int | None = None, **changes: object) -> Message:
        """A packet just before a frame."""
        if command is not None:
            self.command, self.counter = command, self.counter + 1
        for name, value in changes.items():
            setattr(self, name, value)
        content = referee(self.stage, self.command, self.counter, self.yellow, self.blue, t=EPOCH + frame * STEP,
                          blue_on_positive=self.side, source=self._source)
        return Message(ns(frame * STEP) - 1, REFEREE, content)


def ordered(*parts: Iterable[Message]) -> list[Message]:
    """Messages in the order in which they were received."""
    return sorted((message for part in parts for message in part), key=lambda message: message.received)


def match(messages: Iterable[Message] | bytes, mapping: str = "", name: str = "game.log") -> MatchLog:
    """The match of a log."""
    data = messages if isinstance(messages, bytes) else log(messages)
    return read(open_source(data, name), load_map(mapping) if mapping else TrackingMap())


def flaws(match: MatchLog) -> dict[str, int]:
    """Number of each flaw."""
    rows = match.quality.select("flaw", "count").rows()
    return {str(flaw): sum(count for other, count in rows if other == flaw) for flaw, _ in rows}


#: Frames of a game that is told by ``play``.
FRAMES = 100


def command(word: str) -> int:
    return COMMANDS.index(word)


def stage(word: str) -> int:
    return STAGES.index(word)


def reported(match: MatchLog) -> list[tuple[object, ...]]:
    """Frame, event, team, score of each event."""
    rows = match.referee.select("t_ns", "event", "team", "score_home", "score_away").rows()
    return [(round(t_ns / 1e9 / STEP), *rest) for t_ns, *rest in rows]


def play(*said: tuple[int, dict[str, object]], referee: Referee | None = None, mapping: str = "") -> MatchLog:
    """A game in which the referee says this before these frames."""
    gc = referee or Referee()
    return match(ordered([gc.says(frame, **what) for frame, what in said], frames(FRAMES)), mapping)
