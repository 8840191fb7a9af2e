"""Section on how much of Table 3 is kick-offs, and what follows for the paper's own table."""

from __future__ import annotations

from collections.abc import Iterator

import polars as pl

from pitchlore.pipeline.stages.report import table3
from pitchlore.pipeline.stages.report.claims import PAPER, WITHOUT_SCORE
from pitchlore.pipeline.stages.report.document import number
from pitchlore.pipeline.stages.report.kickoffs import kick_offs
from pitchlore.pipeline.stages.report.report import estimates
from pitchlore.schemas import called
from pitchlore.schemas.decisions import FIRST_S

#: Length of the paper's games, seconds: "about eight minutes".
_GAME_S = 480.0

#: Headings of the columns of ``kick_offs`` that have intervals.
HEADINGS = {
    "other": "learned actions, %", "later": f"the same without the first {FIRST_S:g} s, %",
    "in_first": f"of the learned, in the first {FIRST_S:g} s, %",
    "states": "states of learned actions, a game",
    "kick_offs": "goals + 1, a game", "each": "learned actions by goals + 1", "r": "r of both, over games",
}

#: Limits of the paper's table, whatever we measure.
NOT_TOLD = (
    "The paper gives no goals of these games. So its 3 to 4 % against the static team, and its 2.50 % against"
    " people, can be kick-offs, learned play, or both: the table alone does not tell.")


def about_kick_offs(games: pl.DataFrame) -> Iterator[str]:
    """Paragraphs on how much of Table 3 is kick-offs, from schema Games; none without the paper's seasons."""
    rows = kick_offs(games)
    if not rows.height:
        return
    yield "## Kick-offs in Table 3"
    yield (
        f"The seasons of `{PAPER}`, and of `{WITHOUT_SCORE}`, whose key has no score, from the first game on "
        "in which their column of Table 3 has learned actions. Robots decide anew at each kick-off and other "
        "restart; the first second after one is counted by itself. A state is of one role. The correlation "
        "is of the share with goals + 1, the number of kick-offs after goals and at the start.")
    yield estimates(rows, HEADINGS, ("settings", "opponent", "seasons", "first", "last"))
    yield "\n".join(f"- {said}" for said in conclusions(rows))
    yield NOT_TOLD


def conclusions(rows: pl.DataFrame) -> Iterator[str]:
    """Consequences for the paper's own table: a paragraph for each row of ``kick_offs``."""
    for row in rows.drop_nulls("in_first").iter_rows(named=True):
        column = table3.column_of(row["opponent"])
        assert column is not None, row
        paper = table3.games(column).filter(pl.col("game") >= row["first"])
        others = float(paper["other_actions"].mean())  # type: ignore[arg-type]
        needed = others / row["each"]
        first = number(row["in_first"])
        said = [
            f"With `{row['settings']}` against {called(row['opponent'])}:",
            f"{first} % of our learned actions fall in the first second of an episode.",
            f"There are {number(row['each'])} of them for each kick-off."]
        if (row["r_low"] or 0.0) > 0.0:
            explained = number(100 * row["r"] ** 2)
            said.append(f"Goals + 1 accounts for {explained} % of their variance over games.")
        if (row["each_low"] or 0.0) > 0.0:
            said.append(
                f"At that rate the paper's {number(others)} learned actions a game (from game {row['first']}"
                f" on) are {number(needed)} kick-offs, one each {number(_GAME_S / needed)} s; ours have"
                f" {number(row['kick_offs'])}.")
        else:
            said.append("They are too few to say anything of the paper's column.")
        yield " ".join(said)
