"""Check, at the import, that the situations of a recording are recognised."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import cache
from threading import Thread

import numpy as np
import polars as pl

from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.rows import few_frames
from pitchlore.pipeline.matches.frame import MatchInfo, MatchLog
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.settings import SituationSettings, TrajectorySettings
from pitchlore.schemas.situations import MOVES_RANDOMLY

#: Time of a match that is looked at, from where play begins, ns; it bounds what the look costs.
LOOKED_NS = 120_000_000_000
#: Events from which on play is on.
_ON = ("kick-off", "fault", "play")


def with_recognition(match: MatchLog) -> MatchLog:
    """The match, with the flaw *poor recognition* if its first two minutes of play show too few situations.

    They are recognised with the default settings, and compared with what this kind of match usually shows
    (:mod:`pipeline.stages.situations.usual`). A match that has the flaw already keeps it as it is.
    """
    flaw = None if "poor recognition" in match.quality["flaw"] else _poor(match)
    if flaw is None:
        return match
    return replace(match, quality=pl.concat([match.quality, quality_table(match.info.match_id, [flaw])]))


@cache
def warm() -> None:
    """Begin to load and compile what :func:`with_recognition` needs, once, while a recording is read.

    The first time on a machine that takes ten seconds, of which reading hides a part; numba lets who asks
    meanwhile wait for it. If it fails, as when Ctrl-C breaks off a module's loading, who asks meets that.
    """
    info = MatchInfo(match_id="few", source="few", format="few", home="a", away="b", pitch=PITCHES[Kind.SSL],
                     software=RELEASE)
    def load() -> None:
        with suppress(Exception, KeyboardInterrupt):  # polars raises the second in any thread
            _poor(MatchLog(info, few_frames()))

    Thread(target=load, name="recogniser", daemon=True).start()


def _poor(match: MatchLog) -> Flaw | None:
    """The flaw of a match whose situations are hardly recognised, else None."""
    from pitchlore.pipeline.stages.situations.recognise import recognise  # noqa: PLC0415 (numba's code is loaded with it)
    from pitchlore.pipeline.stages.situations.usual import recognition  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.trajectories.derive import trajectories  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.trajectories.heights import with_heights  # noqa: PLC0415 (see above)

    bodies, _ = trajectories(_begin(match), TrajectorySettings())
    pitch = match.info.pitch
    seen = recognise(with_heights(bodies, match.heights), pitch, SituationSettings())
    shown = recognition(seen, pitch.kind)
    if not shown.poor:
        return None
    headings = np.isfinite(match.frames.robots["theta"]).any() or (len(bodies) and pitch.kind == "human")
    cure = "check units, axes and the pitch's kind in a map" if headings else (
        "no robot has a heading, and most situations need it: give it (column heading)")
    note = (f"{shown.codes} situations besides {MOVES_RANDOMLY} where {pitch.kind.value} matches show "
            f"{shown.usual:.0f}, and {shown.random:.0%} of the time 'moves randomly': {cure}")
    return Flaw("poor recognition", note, len(match.frames))


def _begin(match: MatchLog) -> MatchLog:
    """The match from where play begins, for ``LOOKED_NS``."""
    frames = match.frames
    on = match.referee.filter(pl.col("event").cast(pl.String).is_in(_ON))["t_ns"]
    start = int(on[0]) if len(on) else 0
    chosen = (frames.t_ns >= start) & (frames.t_ns < start + LOOKED_NS)
    return replace(match, frames=frames.where(chosen))
