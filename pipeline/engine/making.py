"""Outputs of a match, or of a group of matches, made stage after stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from pitchlore.pipeline.base.errors import in_one_line
from pitchlore.pipeline.engine.costs import Spent, spending
from pitchlore.pipeline.engine.inputs import Seen
from pitchlore.pipeline.engine.stage import Output, Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.mirrors import located


class Outcome(NamedTuple):
    """Outcome of the work on some stages' outputs of one name.

    Attributes:
        made: by noun, whether the output's bytes are new; None if it was done before.
        failed: the error of the stage that failed, in one line, by its noun; later stages were not tried.
        transient: whether it may help to try again.
        costs: cost of each noun that was not done before, the one that failed included.
    """

    made: Mapping[str, bool | None]
    failed: Mapping[str, str] = {}
    transient: bool = False
    costs: Mapping[str, Spent] = {}

    def after(self, before: Outcome) -> Outcome:
        """The outcome with what an earlier try made."""
        spent = {noun: self.costs.get(noun, Spent()).plus(before.costs.get(noun, Spent()))
                 for noun in {**before.costs, **self.costs}}
        made = {**self.made, **{k: v for k, v in before.made.items() if v is not None}}
        return self._replace(made=made, costs=spent)


def make(
    data: Path, nouns: Sequence[str], output: Output, settings: Settings, scope: Scope,
    suspect: frozenset[Path],
) -> Outcome:
    """Make the outputs of some stages with one name, unless they are done; the first error ends the work.

    Args:
        data: the data folder.
        nouns: the stages, in order.
        output: output that each of them makes.
        settings: settings of all stages.
        scope: matches of the run; of a match's output, that match.
        suspect: files that count as damaged (:class:`pipeline.store.outputs.Outputs`).

    Raises:
        PitchloreError: by which all other work would fail, too.
    """
    store = Store(data)
    store.suspect = frozenset(map(located, suspect))
    made: dict[str, bool | None] = {}
    costs: dict[str, Spent] = {}
    seen: Seen | None = None if output.match is None else {}  # what several stages of a match read
    for noun in nouns:
        stage = STAGES[noun]
        with spending() as spent:
            try:
                made[noun] = STAGES.perform(store, stage, output, stage.settings(settings), scope, seen)
            except Exception as error:
                if getattr(error, "for_all", False):
                    raise
                costs[noun] = spent()
                return Outcome(made, {noun: in_one_line(error)}, getattr(error, "transient", False), costs)
            if made[noun] is not None:
                costs[noun] = spent()
    return Outcome(made, costs=costs)
