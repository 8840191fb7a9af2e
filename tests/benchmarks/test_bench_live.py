"""A match that is being played: its situations part by part, and all that a window needs of it.

The alternative to parts is to recognise the whole segment of play anew at each sample. A window needs the
packets decoded, velocities, situations, and a picture.
"""

import os

import polars as pl
import pytest
from support.as_packets import vsss_packets_of
from support.recordings import RSIM, bodies_of, imported

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.live.following import Follower, prepare
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations.incremental import Recogniser
from pitchlore.pipeline.stages.situations.recognise import recognise

SETTINGS = SituationSettings()
PITCH = PITCHES[Kind.VSSS]
#: Seconds of play, and how often a segment of play is looked at.
SECONDS, EVERY = 10.0, 8


@pytest.fixture(scope="module")
def parts():
    """Samples of the longest segment's first thirty seconds, in parts of so many."""
    table = bodies_of(RSIM).drop_nulls("segment")
    longest = table["segment"].value_counts(sort=True)["segment"][0]
    table = table.filter(pl.col("segment") == longest)
    sample = table["frame"].rank("dense") - 1
    return [table.filter(sample // EVERY == part) for part in range(1200 // EVERY)]


@pytest.mark.benchmark(group="situations while a match is played")
def test_ours(timed, parts):
    def run():
        recogniser = Recogniser("m", PITCH, SETTINGS)
        for part in parts:
            recogniser.take(part)
            found = recogniser.open()
        return found

    found = timed(len(parts), "looks", run, rounds=5, warmup_rounds=1)
    whole = recognise(pl.concat(parts).sort("team", "robot", "t_ns"), PITCH, SETTINGS)
    assert found.drop("match_id").equals(whole.drop("match_id"))


@pytest.mark.benchmark(group="situations while a match is played")
def test_the_segment_anew(timed, parts):
    whole = pl.concat(parts).sort("team", "robot", "t_ns")
    ends = [part["t_ns"].max() for part in parts]
    timed(len(parts), "looks", lambda: [recognise(whole.filter(pl.col("t_ns") <= end), PITCH, SETTINGS) for end in ends],
          rounds=5, warmup_rounds=1)


@pytest.mark.benchmark(group="a match in a window")
def test_follow_and_paint(timed):
    pygame = pytest.importorskip("pygame", reason="pygame-ce is not installed (the extra `play`)")
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    from pitchlore.pipeline.arena.window.screen import Board
    from pitchlore.pipeline.sessions.showing import picture_of

    packets = vsss_packets_of(imported(RSIM), SECONDS, 0)
    prepare("vsss")

    def run():
        follower = Follower("vsss")
        for packet in packets:
            follower.take([packet])
            live = follower.snapshot()
            if live is not None:
                board.match(live.pitch, live.names, 3)
                board.show(picture_of(live, "game on", None, 0.0))

    with Board(PITCH, ("blue", "yellow"), 3) as board:
        timed(SECONDS, "seconds of play, 40 pictures each", run, rounds=5, warmup_rounds=1)
    pygame.quit()
