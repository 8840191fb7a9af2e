"""The command situations: the rules and fuzzy terms, printed or drawn."""

from __future__ import annotations

from typing import Literal

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json, UserPath
from pitchlore.flows.commands.printing import console, print_frame, print_json
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.stages.situations.rulebook import rule_table, term_table
from pitchlore.pipeline.views.plots.matches import memberships
from pitchlore.pipeline.views.plots.style import plot_png


def situations(
    *,
    kind: Literal["vsss", "ssl", "2d", "human"] = "vsss",
    terms: Flag = False,
    plot: UserPath | None = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Print the rules of all situations, or their fuzzy terms.

    Args:
        kind: League whose distances and speeds are shown.
        terms: Print the trapezoids of the fuzzy terms instead of the rules.
        plot: Draw the fuzzy terms into this PNG file instead (the paper's Figure 1, reconstructed).
        json: Print JSON.
        common: Options of every command.
    """
    store = common.store
    if plot is not None:
        store.write_bytes(plot, plot_png(memberships(term_table(Kind(kind)))))
        console().print(f"{plot}: membership functions of {kind}", soft_wrap=True)
        return
    frame = term_table(Kind(kind)) if terms else rule_table()
    if json:
        print_json(frame.to_dicts())
    else:
        print_frame(frame)
