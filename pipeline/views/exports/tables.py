"""The plain tracking table, which ``pitchlore import`` reads back, as CSV and Parquet."""

from __future__ import annotations

import io

import numpy as np
import polars as pl

from pitchlore.pipeline.stages.events.restarts import kind_of
from pitchlore.pipeline.stages.trajectories.timeline import STOPPING
from pitchlore.pipeline.views.exports.content import PLAY, STOP, ExportedMatch
from pitchlore.pipeline.views.exports.spreadsheet import safe_csv
from pitchlore.schemas import SIDES


def tracking_table(content: ExportedMatch) -> pl.DataFrame:
    """A match as a tracking table, one row a body and sample.

    Returns:
        Columns ``frame``, ``t`` (s), ``team`` (the team's name, or ball; ``static`` and ``static-2`` where a
        team plays itself, for a table tells teams by their names), ``player``, ``x``, ``y`` (m),
        ``heading`` (rad), ``z`` (m, the ball's height, only where one is known), ``option`` (a code of
        Table 1, only where a team logged one), ``game_state`` and, where one is known, ``score_home`` and
        ``score_away``. The state names an event on the first sample from its
        time on, ``kick-off_home``, ``free-kick_away`` or ``goal_away+stop``, else it is play or stop.
    """
    log = content.log
    bodies = content.bodies()
    home, away = log.info.home, log.info.away
    names = {"home": home, "away": f"{away}-2" if home == away else away, "ball": "ball"}
    states, scores = _states(content)
    reported = [name for name in ("score_home", "score_away") if scores[name].null_count() < len(scores)]
    out = bodies.join(scores.with_columns(game_state=states).with_row_index("sample").cast(
        {"sample": pl.Int64}), on="sample", how="left", maintain_order="left")
    high = ["z"] if out["z"].null_count() < len(out) else []
    told = pl.DataFrame(log.options).select(
        pl.col("team").replace_strict(dict(enumerate(SIDES)), return_dtype=pl.String), "t_ns",
        pl.col("option").replace(0, None), player=pl.col("robot").cast(pl.Int32))
    if len(told):
        out = out.join_asof(told, on="t_ns", by=["team", "player"], check_sortedness=False)
        high.append("option")
    return out.select(
        "frame", pl.col("t_ns").truediv(1e9).alias("t"),
        pl.col("team").replace_strict(names, return_dtype=pl.String), "player", "x", "y", *high, "heading",
        *reported, "game_state",
    )


def _states(content: ExportedMatch) -> tuple[pl.Series, pl.DataFrame]:
    """State of the game at each sample in order of time, String [F], and the score, as in schema Referee."""
    times = content.times()
    reported = content.log.referee.sort("t_ns", maintain_order=True)
    words: list[list[str]] = [[] for _ in times]
    playing = np.full(len(times), not len(reported) or reported["event"][0] not in ("kick-off", "play"))
    home, away = np.full((2, len(times)), np.nan)
    at = np.searchsorted(times, reported["t_ns"].to_numpy())
    for row, index in zip(reported.to_dicts(), at.tolist(), strict=True):
        if index < len(times):
            word = _word(row["event"], row["note"])
            words[index].append(word if row["team"] is None else f"{word}_{row['team']}")
        playing[index:] = row["event"] not in STOPPING
        for score, side in ((home, SIDES[0]), (away, SIDES[1])):
            if row[f"score_{side}"] is not None:
                score[index:] = row[f"score_{side}"]
    states = ["+".join(said) or (PLAY if on else STOP) for said, on in zip(words, playing, strict=True)]
    scores = pl.DataFrame({"score_home": home, "score_away": away}).fill_nan(None).cast(pl.Int16)
    return pl.Series("game_state", states, dtype=pl.String), scores


def _word(event: str, note: str | None) -> str:
    """An event's word; a restart's is its kind, where that is known."""
    kind = kind_of(event, note) if event == "fault" else "other"
    return event if kind == "other" else kind.replace(" ", "-")


def csv(content: ExportedMatch) -> bytes:
    """The table as CSV; numbers are the shortest that read as the same float32, text is no formula."""
    return safe_csv(tracking_table(content)).encode()


def parquet(content: ExportedMatch) -> bytes:
    """The table as Parquet."""
    out = io.BytesIO()
    tracking_table(content).write_parquet(out, statistics=False)
    return out.getvalue()
