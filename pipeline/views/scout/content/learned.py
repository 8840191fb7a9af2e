"""Sources of the newest knowledge: maps, grams and decisions of its matches."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import polars as pl

from pitchlore.pipeline.base.digests import canonical, digest
from pitchlore.pipeline.engine.knowledge import learned_from, lineage
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.views.scout.content.sources import Known, LeagueMatch, TeamName
from pitchlore.pipeline.views.scout.typical import typical
from pitchlore.schemas import SIDES, Decisions, Grams, Neurons


class Learned:
    """The maps and decisions behind a version of the knowledge, read when they are asked for.

    Only what the version was made from is used. If an output was made anew since, it is left out until the
    next version.

    Args:
        store: the data folder.
        known: the newest knowledge; None if there is none.
        league: the matches that have run.

    Attributes:
        key: digest of all that is used.
    """

    def __init__(self, store: Store, known: Known | None, league: Sequence[LeagueMatch]) -> None:
        self._store = store
        self._teams = {(match.name, side): team for match in league
                       for side, team in zip(SIDES, (match.home, match.away), strict=True)}
        self._behaviours = None if known is None else _behaviours(store, known)
        self._decisions: dict[str, tuple[Receipt, list[str]]] = {}
        there = {match.name for match in league}
        for version in () if known is None else lineage(store, known.manifest):
            for match, learned in learned_from(version).items():
                receipt = store.receipt("decisions", learned.group)
                if receipt is None or match not in there:
                    continue
                if receipt.details.get("matches", {}).get(match, {}).get("sha256") == learned.sha256:
                    self._decisions.setdefault(learned.group, (receipt, []))[1].append(match)
        self.key = digest(canonical([
            None if self._behaviours is None else self._behaviours.digests(),
            {group: [receipt.digests(), matches] for group, (receipt, matches) in self._decisions.items()}]))

    @property
    def mapped(self) -> bool:
        """True if the maps of the version are there."""
        return self._behaviours is not None

    def neurons(self, team: TeamName) -> pl.DataFrame:
        """Rows of schema Neurons of a team alone; none without maps."""
        return self._neurons.filter(team=team.name, kind=team.kind)

    def grams(self, team: TeamName) -> pl.DataFrame:
        """Rows of schema Grams of a team alone; none without maps."""
        return self._grams.filter(team=team.name, kind=team.kind)

    def typical(self, team: TeamName) -> pl.DataFrame:
        """How many times as often a team shows its grams as others of its league, by role and codes."""
        league = self._grams.filter(kind=team.kind)
        least = 1 if self._behaviours is None else int(self._behaviours.settings["support_at_least"])
        return typical(league.filter(team=team.name), league.filter(pl.col("team") != team.name), least)

    def decisions(self, team: TeamName) -> pl.DataFrame:
        """Rows of schema Decisions of a team, in order."""
        sides = [(match, side) for (match, side), own in self._teams.items() if own == team]
        played = pl.DataFrame(sides, orient="row", schema={"match_id": pl.String, "team": pl.Enum(SIDES)})
        return self._decided.join(played, on=("match_id", "team"), how="semi", maintain_order="left")

    @cached_property
    def _neurons(self) -> pl.DataFrame:
        if self._behaviours is None:
            return Neurons.empty()
        return table_of(self._store, self._behaviours, Neurons)

    @cached_property
    def _grams(self) -> pl.DataFrame:
        if self._behaviours is None:
            return Grams.empty()
        return table_of(self._store, self._behaviours, Grams)

    @cached_property
    def _decided(self) -> pl.DataFrame:
        return pl.concat([Decisions.empty(), *(
            table_of(self._store, receipt, Decisions).filter(pl.col("match_id").is_in(matches))
            for receipt, matches in self._decisions.values())])


def _behaviours(store: Store, known: Known) -> Receipt | None:
    """The output that a version's behaviours were selected in, if it stands and has neurons."""
    inputs = known.manifest.inputs
    names = {label.split("/")[1] for label in inputs if label.startswith("behaviours/")}
    for name in names:
        receipt = store.receipt("behaviours", name)
        if receipt is not None and "neurons" in receipt.files and receipt.digests().items() <= inputs.items():
            return receipt
    return None
