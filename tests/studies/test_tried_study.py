"""The study of what was tried: at which number of matches a point stands, and what is averaged."""

from __future__ import annotations

import polars as pl
from looking.tried import KINDS, curves


def test_curves():
    """A counted match stands at the matches that were learned from before it, those of each game; a peer's at its number.

    The first game of a season has learned from nothing, and has no point.
    """
    found = pl.DataFrame(
        [("seasons", "best", 1, 1, -50.0), ("seasons", "best", 1, 3, 2.0), ("seasons", "best", 2, 3, 4.0),
         ("imitation", "looking-all", 1, 14, 5.0), ("peers", "ppo", 1, 140, -3.0)],
        schema=["study", "name", "seed", "game", "difference"], orient="row")
    said = {kind.name: kind.said for kind in KINDS}
    assert curves(found).select("kind", "matches", "apprentices", "difference").rows() == [
        (said["best"], 8, 2, 3.0), (said["looking-all"], 130, 1, 5.0), (said["ppo"], 140, 1, -3.0)]
    assert curves(found)["low"][0] < 3.0 < curves(found)["high"][0]
    assert curves(found)["low"][1:].null_count() == 2, "one apprentice says nothing of others"
