"""The flaws of a recording in words, from the table quality."""

from __future__ import annotations

import polars as pl

#: What each flaw is called on the pages, and what its count counts; columns flaw and count of Quality.
WORDS = {
    "duplicate frame": ("repeated", "samples"), "reordered frame": ("out of order", "samples"),
    "clock jump back": ("clock jumped back", "samples"), "clock leap ahead": ("clock leapt ahead", "samples"),
    "gap": ("without samples", "gaps"), "ball jump": ("ball jumped", "ball samples"),
    "robot jump": ("a robot jumped", "robot samples"), "damaged chunk": ("file is damaged", "chunks"),
    "damaged record": ("file is damaged", "records"), "truncated": ("file is cut off", ""),
    "ball lost": ("ball not seen", "samples"), "not a number": ("place or heading is no number", "values"),
    "direction inferred": ("direction of attack inferred", "samples"),
    "direction unknown": ("direction of attack unknown, taken as to the right", "samples"),
    "skipped": ("left out", "items"), "slow sampling": ("sampled slowly", "samples"),
    "off the pitch": ("robots off the pitch", "robot samples"),
    "scorer unknown": ("scoring team unknown", "goals"),
    "goals inferred": ("goals found from the path of the ball, not told by the recording", "goals"),
    "goals unknown": ("goals unknown: the recording does not tell them", ""),
    "unit of angle": ("unit of headings doubtful", "headings"),
    "text encoding": ("encoding of the text assumed", ""),
    "unmatched map": ("words of the map match nothing", ""),
    "poor recognition": ("few situations recognised", ""),
    "home inferred": ("nothing tells which team is home", ""),
    "assumed": ("some of its meaning was assumed: the table quality says what", ""),
    "several matches": ("one of several matches of a recording", ""),
    "colours switched": ("teams changed colours", "times"),
    "score corrected": ("score corrected by people", "times"),
    "implausible": ("no course of play: nothing is learned from it", ""),
    "half a pitch": ("only half of the pitch is seen", "samples"),
}


def flaws(quality: pl.DataFrame, samples: int) -> str:
    """The flaws of a recording: what each is, and its count; of samples also of how many.

    Args:
        quality: rows of schema Quality of one match.
        samples: number of samples of the match.
    """
    counts = quality.group_by(pl.col("flaw").cast(pl.String)).agg(pl.col("count").sum()).sort("flaw")
    return "; ".join(_said(flaw, count, samples) for flaw, count in counts.iter_rows())


def _said(flaw: str, count: int, samples: int) -> str:
    """One kind of flaw; samples that were left out may be more than those that are there."""
    what, counted = WORDS[flaw]
    if not counted:
        return what
    if counted == "samples" and count == samples:
        return what
    if counted == "samples" and count < samples:
        return f"{what}: {count:,} of {samples:,} samples"
    return f"{what}: {count:,} {counted if count != 1 else counted.removesuffix('s')}"
