"""Labels of moments of a match: options and situations of robots, and V."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.matches.frame import no_options
from pitchlore.pipeline.numbers.arrays import F32, F64, I64
from pitchlore.pipeline.stages.options.recover import logged_options
from pitchlore.schemas import SIDES, Decisions, Options

#: The labels that are codes of Table 1, and the column that holds each.
CODES = {"option": "option", "option.logged": "logged", "situation": "code"}


class Labels:
    """Options, situations and V of a match, to be looked up.

    Args:
        match: the match.

    Attributes:
        recovered: whether options were recovered in it.

    Raises:
        NotFound: if the match's stages have not run.
    """

    def __init__(self, match: MatchTables) -> None:
        inputs = match.inputs
        self.recovered = bool(inputs.settings("options").get("recover", False))
        held = inputs.details("matches")
        tables = {
            "option": inputs.table("options", Options) if inputs["options"] else Options.empty(),
            "option.logged": logged_options(
                match.log.decisions if held.get("decisions") != 0 else Decisions.empty(),
                match.log.options if "options" in held else no_options(),
            ).rename({"t_ns": "start_ns", "over_ns": "end_ns"}),
            "situation": match.situations,
        }
        self._rows = {
            name: table.partition_by("team", "robot", as_dict=True) for name, table in tables.items()}
        self._values = match.values

    def codes(self, name: str, side: str, robot: int, t_ns: I64) -> I64:
        """A code of one robot at each time, int64 [T]; 0 where there is none.

        Args:
            name: a label of :data:`CODES`.
            side: home or away.
            robot: its number.
            t_ns: int64 [T], times.
        """
        rows = self._rows[name].get((side, robot))
        if rows is None:
            return np.zeros(len(t_ns), dtype=np.int64)
        codes = np.append(rows[CODES[name]].fill_null(0).to_numpy(), 0).astype(np.int64)
        return codes[_row_at(rows, t_ns)]

    def probability(self, side: str, robot: int, t_ns: I64) -> F32:
        """Probability of one robot's recovered option at each time, float32 [T]; 0 where there is none."""
        rows = self._rows["option"].get((side, robot))
        if rows is None:
            return np.zeros(len(t_ns), dtype=np.float32)
        return np.append(rows["probability"].to_numpy(), np.float32(0))[_row_at(rows, t_ns)]

    def value(self, side: str, segment: int, t_ns: I64) -> F64:
        """V of a team at times of one stretch of play, float64 [T]; NaN if V is known nowhere in the stretch.

        Between two moments V is interpolated; before the first moment of the stretch it is as there, and
        after the last one, too.

        Args:
            side: home or away.
            segment: the stretch of play.
            t_ns: int64 [T], times.
        """
        known = self._values.filter(segment=segment)
        if known.is_empty():
            return np.full(len(t_ns), np.nan)
        sign = 1.0 if side == SIDES[0] else -1.0
        found: F64 = sign * np.interp(t_ns, known["t_ns"].to_numpy(), known["value"].to_numpy())
        return found


def _row_at(rows: pl.DataFrame, t_ns: I64) -> I64:
    """The row of a robot that holds each time, start included, end not, int64 [T]; -1 where none does."""
    row = np.searchsorted(rows["start_ns"].to_numpy(), t_ns, side="right") - 1
    return np.where(t_ns < rows["end_ns"].to_numpy()[row], row, -1)
