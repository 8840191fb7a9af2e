"""Versions of what a league has learned: the knowledge, and policies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import polars as pl

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.engine.habits import copy_of, matches_of
from pitchlore.pipeline.engine.knowledge import imitates, known_shares, learned_from, of_imitated
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.policies import known_play, looks, way_of_play
from pitchlore.pipeline.engine.versions import WITHOUT
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.schemas import Appraisals, Behaviours, Habits, Occasions, Policies, Returns, States, Table

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.match.controllers import LearnedTeam
    from pitchlore.pipeline.engine.teams import TeamOptions
    from pitchlore.pipeline.stages.knowledge import Difference


class Version:
    """An immutable version of the knowledge or of the policies.

    Args:
        store: the data folder.
        manifest: record of the version.
    """

    def __init__(self, store: Store, manifest: Manifest) -> None:
        self._store, self._manifest = store, manifest
        self._tables: dict[str, pl.DataFrame] = {}

    def _table(self, schema: type[Table]) -> pl.DataFrame:
        """A table of the version, read once."""
        if schema.NAME not in self._tables:
            self._tables[schema.NAME] = table_of(self._store, self._manifest, schema)
        return self._tables[schema.NAME]

    @property
    def version(self) -> int:
        """Its number, from 1."""
        return self._manifest.version

    @property
    def parent(self) -> int | None:
        """The version that it follows or was made from; None for the first."""
        return self._manifest.parent

    @property
    def imitates(self) -> str | None:
        """The team that policies imitate, with its league, as in ``blue (vsss)``; None: all teams."""
        team = imitates(self._manifest)
        return None if team is None else f"{team.team} ({team.kind})"

    @property
    def manifest(self) -> dict[str, Any]:
        """Record of the version: inputs, settings, seed, files with their SHA-256, and counts."""
        return self._manifest.model_dump(mode="json")

    @property
    def details(self) -> dict[str, Any]:
        """Counts and facts of the version."""
        return self._manifest.details

    @property
    def made_without(self) -> list[str]:
        """Matches and versions that it was made without, because they were damaged or refused."""
        return list(self._manifest.details.get(WITHOUT, ()))

    @property
    def key(self) -> str:
        """Key of the work that made it, 16 hexadecimal digits."""
        return self._manifest.key

    def __repr__(self) -> str:
        return f"<{type(self).__name__} version {self.version}, parent {self.parent}>"


class Knowledge(Version):
    """A version of the knowledge: behaviours of each team, and the states in which they were chosen.

    :meth:`pitchlore.League.knowledge` gives one.

    Args:
        store: the data folder.
        manifest: record of the version.

    Raises:
        CorruptFile: by a table whose file is damaged.
    """

    @property
    def behaviours(self) -> pl.DataFrame:
        """Rows of the table ``behaviours`` of this version."""
        return self._table(Behaviours)

    @property
    def imitated(self) -> pl.DataFrame:
        """The rows of :attr:`behaviours` of the team that policies imitate."""
        return of_imitated(self._manifest, self.behaviours)

    @property
    def occasions(self) -> pl.DataFrame:
        """Rows of the table ``occasions`` of this version."""
        return self._table(Occasions)

    @property
    def habits_of(self) -> str:
        """The matches that its habits were learned from, in words; empty where all of the team count."""
        of = copy_of(self.details)
        return matches_of(of) if of else ""

    @property
    def habits(self) -> pl.DataFrame:
        """Rows of the table ``habits`` of this version; none if no options of the imitated team are known."""
        return self._table(Habits) if Habits.NAME in self._manifest.files else Habits.empty()

    @property
    def known(self) -> dict[str, float]:
        """Shares of the imitated team's decisions whose state is known, by each key, from fine to coarse.

        Each decision is left out in turn: its state is known if the team chose a behaviour there elsewhere.
        """
        return known_shares(of_imitated(self._manifest, self.occasions))

    def picture(self, dpi: int = 80) -> bytes:
        """Value against support of each behaviour, as PNG; a notebook shows it for the version itself.

        Args:
            dpi: dots per inch, 20 to 1,000; the picture is 9 by 5 inches.

        Raises:
            BadSettings: if it has other dots.
            CorruptFile: if the table's file is damaged.
        """
        from pitchlore.pipeline.views.plots.matches import plot_behaviours  # noqa: PLC0415 (loaded when asked for)
        from pitchlore.pipeline.views.plots.style import plot_png  # noqa: PLC0415 (loaded when asked for)

        if not 20 <= dpi <= 1_000:
            raise BadSettings(f"cannot be {dpi}", where="dpi", next_step="Choose 20 to 1,000 dots per inch")
        return plot_png(plot_behaviours(self.behaviours), dpi=dpi)

    _repr_png_ = picture

    @property
    def matches(self) -> list[str]:
        """Ids of the matches that this version has added, sorted."""
        return list(learned_from(self._manifest))

    def since(self, earlier: Knowledge) -> Difference:
        """Changes from an earlier version to this one.

        Args:
            earlier: the other version.

        Returns:
            ``behaviours``, a row for each that differs, and ``roles``, their counts by role.

        Raises:
            CorruptFile: if a file of one of them is damaged.
        """
        from pitchlore.pipeline.stages.knowledge import diff  # noqa: PLC0415 (loaded when asked for)

        return diff(earlier.behaviours, self.behaviours, earlier.occasions, self.occasions)


class Policy(Version):
    """A version of the policy: the value of each behaviour in each state.

    :meth:`pitchlore.League.policy` gives one.

    Args:
        store: the data folder.
        manifest: record of the version.

    Raises:
        CorruptFile: by a table whose file is damaged.
        NotFound: by a table that the version was made without.
    """

    @property
    def values(self) -> pl.DataFrame:
        """Rows of the table ``policies`` of this version: ``q`` is a discounted goal difference."""
        return self._table(Policies)

    @property
    def states(self) -> pl.DataFrame:
        """Rows of the table ``states``, with ``elements``: each state in words, a list of ``name: level``."""
        if States.NAME not in self._manifest.files:
            raise NotFound(f"policy version {self.version} was trained before states were kept",
                           where=self._store.where, next_step="Train the next version: `pitchlore train`")
        from pitchlore.pipeline.state.words import with_elements  # noqa: PLC0415 (it loads numba)

        return with_elements(self._table(States))

    @property
    def returns(self) -> pl.DataFrame:
        """Rows of the table ``returns``: returns of the episodes, by state and behaviour."""
        return self._table(Returns)

    @property
    def appraisals(self) -> pl.DataFrame:
        """Rows of the table ``appraisals``: weights of what robots see; none if the policy goes by states."""
        return self._table(Appraisals)

    @property
    def looks(self) -> bool:
        """True if the policy chooses by what robots see, and not by states."""
        return looks(self._manifest)

    @property
    def plays(self) -> str:
        """How its robots choose, in a sentence; and why it is no copy of a team, where that was asked."""
        return way_of_play(self._manifest)

    @property
    def known(self) -> dict[str, float]:
        """The shares :attr:`Knowledge.known` of the knowledge that it was trained on.

        Empty if the policy looks, or if that version of the knowledge is no longer there.
        """
        return {} if self.looks else known_play(self._store, self._manifest)

    def team(self, **options: Unpack[TeamOptions]) -> LearnedTeam:
        """The policy as a team for :func:`pitchlore.play`, or as an opponent in environments.

        Args:
            options: how it plays: explore, lcb_weight, min_visits and so on; it plays as it learned without.

        Raises:
            BadSettings: if an option does not fit.
        """
        from pitchlore.pipeline.engine.teams import learned_team  # noqa: PLC0415 (loaded when asked for)

        return learned_team(self._store, f"learned:{self.version}", **options)
