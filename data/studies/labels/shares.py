"""Sums over the situations of a recording: shares of time, durations, and passes beside hand-overs."""

from __future__ import annotations

import polars as pl

#: Situations that last no longer are brief.
BRIEF_S = 0.16
#: A pass or a reception that begins or ends so near to the hand-over belongs to it.
BESIDE_NS = 200_000_000
STANDS, RANDOM, YIELDS, RECEIVES = 184, 194, 23, 45


def summary(situations: pl.DataFrame) -> dict[str, float]:
    """Measures of a table of situations.

    Returns:
        situations, how many; median_s, their median duration; brief, the share that lasts at most
        ``BRIEF_S``; random, the share of 194 in the time of all; random_moving, the same in the time without
        184; and how many are 023 and 045.
    """
    lasts = situations.select("code", s=(pl.col("end_ns") - pl.col("start_ns")) / 1e9)
    total, of = lasts["s"].sum(), dict(lasts.group_by("code").agg(pl.col("s").sum()).iter_rows())
    moving = total - of.get(STANDS, 0.0)
    return {
        "situations": lasts.height, "median_s": lasts["s"].median(),
        "brief": (lasts["s"] <= BRIEF_S + 1e-6).mean(), "random": of.get(RANDOM, 0.0) / total,
        "random_moving": of.get(RANDOM, 0.0) / moving, "n_023": (lasts["code"] == YIELDS).sum(),
        "n_045": (lasts["code"] == RECEIVES).sum()}


def on_ball(
    possession: pl.DataFrame, passes: pl.DataFrame, situations: pl.DataFrame
) -> dict[str, float | None]:
    """Hand-overs and changes of possession, counted in the tables of the stage events.

    Returns:
        handovers, how many passes; given and received, the shares of them beside a 023 of the one and a 045
        of the other; spells_per_s, possessions a second of possession.
    """
    found: dict[tuple[str, int, int], list[tuple[int, int]]] = {}
    for team, robot, code, start, end in situations.filter(pl.col("code").is_in((YIELDS, RECEIVES))).select(
            "team", "robot", "code", "start_ns", "end_ns").iter_rows():
        found.setdefault((team, robot, code), []).append((start, end))

    def beside(team: str, robot: int, code: int, first_ns: int, last_ns: int) -> bool:
        times = found.get((team, robot, code), [])
        return any(start <= last_ns + BESIDE_NS and end >= first_ns - BESIDE_NS for start, end in times)

    pairs = passes.select("team", "robot", "receiver", "t_ns", "received_ns").rows()
    return {
        "handovers": len(pairs),
        "given": _share([beside(team, one, YIELDS, left, came) for team, one, _, left, came in pairs]),
        "received": _share([beside(team, two, RECEIVES, came, came) for team, _, two, _, came in pairs]),
        "spells_per_s": _share(
            [possession.height], float((possession["end_ns"] - possession["start_ns"]).sum()) / 1e9),
    }


def _share(counted: list[bool] | list[int], of: float | None = None) -> float | None:
    of = len(counted) if of is None else of
    return sum(counted) / of if of else None
