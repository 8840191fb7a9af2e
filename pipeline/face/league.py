"""A league: all matches of a data folder, and what was learned from them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import polars as pl

from pitchlore.pipeline.base.errors import BadQuery, BadSettings, NotFound
from pitchlore.pipeline.engine.catalog import distrust, files_of, refresh
from pitchlore.pipeline.engine.folder import existing
from pitchlore.pipeline.engine.outputs import find_match, match_names
from pitchlore.pipeline.engine.tables import stored_match
from pitchlore.pipeline.face.match import Match
from pitchlore.pipeline.face.versions import Knowledge, Policy
from pitchlore.pipeline.settings import ImportSettings, RunSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import named_path
from pitchlore.pipeline.store.query import ask, relation
from pitchlore.pipeline.store.tables import scan
from pitchlore.schemas import PUBLIC

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.match.controllers import LearnedTeam
    from pitchlore.pipeline.engine.progress import RunReport
    from pitchlore.pipeline.engine.teams import TeamOptions
    from pitchlore.pipeline.store.query import Relation
    from pitchlore.pipeline.views.decided import Dataset
    from pitchlore.pipeline.views.lerobot.write import LeRobotFolder
    from pitchlore.pipeline.views.scout.content.write import WrittenPages

_log = logging.getLogger(__name__)
#: Columns of the table of a league's matches.
_SHOWN = "match_id, home, away, score_home, score_away, duration_s, hz, complete"


def open(data: str | Path = "data", *, leave_out: bool = False) -> League:  # noqa: A001 (as one says it)
    """The league in a data folder, which `pitchlore import` and `pitchlore run` fill.

    Args:
        data: the folder, or the URL of a bucket.
        leave_out: answer without what is damaged, with a warning for each file. Otherwise whatever needs a
            damaged file raises a :class:`pitchlore.PitchloreError`.

    Returns:
        The league. It is read only when something is asked for.

    Raises:
        NotFound: if the folder does not exist, or is no data folder.
        BadSettings: if it is a file, or if the environment does not say how a bucket is reached.
        StorageFailed: if it is in a bucket that cannot be reached, and there is no copy.

    Examples:
        >>> league = pitchlore.open("league")
        >>> len(league.matches)
        1
    """
    store = existing(named_path(data))
    if leave_out:
        store.leave_out = lambda error: _log.warning("left out: %s", error)
    return League(store)


class LeagueMatches(Mapping[str, Match]):
    """The matches of a league by id; the beginning of an id will do. A notebook shows them as a table.

    Args:
        league: the league.
    """

    def __init__(self, league: League) -> None:
        self._league = league

    def __getitem__(self, match: str) -> Match:
        return self._league.match(match)

    def __iter__(self) -> Iterator[str]:
        return iter(match_names(self._league.store))

    def __len__(self) -> int:
        return len(match_names(self._league.store))

    def __contains__(self, match: object) -> bool:
        return match in match_names(self._league.store)

    @property
    def frame(self) -> pl.DataFrame:
        """The matches with teams, score, duration [s] and rate [Hz], a row each, sorted by id."""
        return self._league.ask(f"select {_SHOWN} from matches order by match_id")  # noqa: S608 (a constant)

    def __repr__(self) -> str:
        return repr(self.frame)

    def _repr_html_(self) -> str:
        return self.frame._repr_html_()


class League:
    """All matches of a data folder, and what was learned from them; :func:`pitchlore.open` gives one.

    Args:
        store: the data folder; it says whether an answer may leave out what is damaged.
        say: receives the age of a bucket's copy, a line.

    Examples:
        >>> league = pitchlore.open("league")
        >>> league.sql("select count(*) as goals from goals").fetchall()
        [(2,)]
        >>> league.lazy("passes").select("team").collect().height
        3
    """

    def __init__(self, store: Store, say: Callable[[str], None] = _log.warning) -> None:
        self.store = store
        self._say = say
        self._age = ""  # of the copy of a bucket, as it was last said

    def __repr__(self) -> str:
        return f"<League {self.store.where}: {len(self.matches)} matches>"

    @property
    def matches(self) -> LeagueMatches:
        """The matches by id: ``league.matches["derby"]`` is a :class:`pitchlore.Match`."""
        return LeagueMatches(self)

    def match(self, match: str) -> Match:
        """A match by its id.

        Args:
            match: the id, or its beginning.

        Raises:
            NotFound: if it fits no match or several; of a match of a season, the error names its folder.
        """
        return Match(stored_match(self.store, find_match(self.store, match), seen={}), self.store)

    @staticmethod
    def tables() -> pl.DataFrame:
        """The columns of all public tables: table, column, type, and meaning with its unit."""
        return pl.DataFrame([
            {"table": name, "column": column, "type": str(schema.dtypes()[column]), "meaning": meaning}
            for name, schema in PUBLIC.items() for column, meaning in schema.meanings().items()
        ])

    def sql(self, query: str, *parameters: object) -> Relation:
        """A query of all tables in DuckDB's SQL, which can only read.

        Args:
            query: one statement.
            parameters: values for its ``?``, in order.

        Returns:
            DuckDB's relation: ``.pl()`` gives a frame, ``.fetchall()`` rows; a notebook shows it. It reads
            the files when its rows are asked for.

        Raises:
            BadQuery: if the statement does not only read, or if DuckDB refuses it.
        """
        return relation(self._catalogue(), query, parameters)

    def ask(self, query: str, *parameters: object) -> pl.DataFrame:
        """The rows of a query as a frame, all of them in memory; Ctrl-C stops it.

        Args:
            query: one statement of DuckDB's SQL that only reads.
            parameters: values for its ``?``, in order.

        Raises:
            BadQuery: if the statement does not only read; if DuckDB refuses it; if a column has no equal in
                a frame.
        """
        with self.store.keeping():
            path = self._catalogue()
            try:
                return ask(path, query, parameters)
            except BadQuery as error:
                if str(self.store.root.resolve()) not in str(error):
                    raise
            # DuckDB cannot read a file: its bytes changed, while its size and time did not
            distrust(self.store)
            return ask(self._catalogue(), query, parameters)

    def lazy(self, table: str) -> pl.LazyFrame:
        """A table over all matches as a lazy frame, for what does not fit in memory.

        It scans the files that the receipts name, never a folder.

        Args:
            table: name of a public table.

        Raises:
            BadSettings: if there is no such table.
        """
        if table not in PUBLIC:
            raise BadSettings(f"there is no table {table!r}", next_step=f"Name one of {', '.join(PUBLIC)}")
        if PUBLIC[table].VIEW:
            return self.ask(f'from "{table}"').lazy()
        self._catalogue()
        found = scan(files_of(self.store, table), PUBLIC[table])
        if "match_id" not in PUBLIC[table].columns() or table == "matches":
            return found
        there = [receipt.name for receipt in self.store.receipts("matches")]
        return found.filter(pl.col("match_id").is_in(there))

    @property
    def versions(self) -> dict[str, list[int]]:
        """Numbers of the versions of ``knowledge`` and ``policies``, ascending."""
        return {noun: self.store.versions(noun) for noun in ("knowledge", "policies")}

    def knowledge(self, version: int | None = None) -> Knowledge:
        """A version of the knowledge.

        Args:
            version: its number; None: the newest.

        Raises:
            NotFound: if there is no such version.
        """
        return Knowledge(self.store, self.store.manifest("knowledge", self._numbered("knowledge", version)))

    def policy(self, version: int | None = None) -> Policy:
        """A version of the policy.

        Args:
            version: its number; None: the newest.

        Raises:
            NotFound: if there is no such version.
        """
        return Policy(self.store, self.store.manifest("policies", self._numbered("policies", version)))

    def run(
        self, *recordings: str | Path, settings: Settings = Settings(), train: bool = True,
        on: str | None = "threads",
    ) -> RunReport:
        """Import recordings, and make all that is new: tables, behaviours, knowledge, policy.

        It does what ``pitchlore run`` does, and makes the same bytes. What fails is in the report, and stops
        nothing else.

        Args:
            recordings: files to import, each with the map beside it; without any those in the inbox.
            settings: settings of all stages.
            train: whether to make a policy when the knowledge is new.
            on: where work is done: threads:N, processes:N (a script then needs ``if __name__ ==
                "__main__"``), dask:local:N or dask://HOST:PORT; None: what PITCHLORE_ON says, else processes.

        Returns:
            Numbers of the versions, and of each stage what was made, kept and failed.

        Raises:
            BadSettings: if ``on`` names no place.
            PitchloreError: by which all work would fail: folder, bucket or cluster cannot be used.

        Examples:
            >>> pitchlore.open("league").run(train=False).failures
            {}
        """
        from pitchlore.pipeline.engine.recordings import with_map  # noqa: PLC0415 (loaded when asked for)
        from pitchlore.pipeline.engine.run import run  # noqa: PLC0415 (loaded when asked for)

        limits = settings.imports if isinstance(settings, RunSettings) else ImportSettings()
        files = [with_map(named_path(each)) for each in recordings] or None
        return run(self.store.root, files, settings, train, limits, on)

    def team(self, word: str, **options: Unpack[TeamOptions]) -> LearnedTeam:
        """A learned team for :func:`pitchlore.play`, or as an opponent in environments.

        Args:
            word: ``learned`` for the newest policy, ``learned:3`` for a version, ``imitated:NAME`` for the
                imitation of a team, or the id of a season for its apprentice.
            options: how it plays: explore, lcb_weight, min_visits and so on; as it learned without.

        Raises:
            BadSettings: if the word names no such team, or if an option does not fit.
            NotFound: if the policy does not exist, or if the season or the imitation has none yet.
        """
        from pitchlore.pipeline.engine.teams import learned_team  # noqa: PLC0415 (loaded when asked for)

        return learned_team(self.store, word, **options)

    def scout(
        self, *names: str, folder: str | Path | None = None, mine: str = "", on: str | None = "threads"
    ) -> WrittenPages:
        """Write web pages about the league, its matches, teams and behaviours; pages that stand are kept.

        Args:
            names: teams or matches (ids, or their beginnings) that the pages are of; without any all.
            folder: folder to write into; None: ``scout`` in the data folder, or one for the named ones.
            mine: the team that the first page tells of; empty: both teams of the newest match.
            on: where pages are made, as for :meth:`run`.

        Returns:
            The first page, the numbers of pages written and kept, and the folder's size in bytes.

        Raises:
            NotFound: if no match has run, or if a name fits none.
            BadSettings: if the data folder is a bucket, and no folder is named.
        """
        from pitchlore.pipeline.engine.placement.places import placed  # noqa: PLC0415 (loaded when asked for)
        from pitchlore.pipeline.views.scout.content.write import write_pages  # noqa: PLC0415 (loaded when asked for)

        with placed(on, self.store.root):
            return write_pages(self.store, None if folder is None else named_path(folder), names, mine)

    def minari(self, dataset: str, *matches: str) -> Dataset:
        """Write decisions of matches as a dataset of Minari, where Minari keeps its own.

        Args:
            dataset: id of the dataset: ``NAME-v0`` or ``NAMESPACE/NAME-v0``.
            matches: ids of matches, or their beginnings; without any, all that have decisions.

        Returns:
            Path, numbers of episodes and steps, behaviours and matches of the dataset.

        Raises:
            NotFound: if Minari is not installed, or if there are no such decisions.
            BadSettings: if the id is none of Minari's, or is taken.
        """
        from pitchlore.pipeline.views.decided import write_decisions  # noqa: PLC0415 (loaded when asked for)

        return write_decisions(self.store, dataset, matches)

    def lerobot(
        self, *matches: str, folder: str | Path | None = None, fps: int | None = None
    ) -> LeRobotFolder:
        """Write matches as a dataset of LeRobot (v3.0): what each team saw and did, frame by frame.

        Args:
            matches: ids of matches of one league, or their beginnings; without any all.
            folder: folder of the dataset, made here; None: ``exports/lerobot`` in the data folder.
            fps: frames a second; None: 20, or the rate of the slowest recording where that is less.

        Returns:
            Folder, numbers of episodes and frames, frames a second, robots of a team, matches.

        Raises:
            BadSettings: if the folder is there, or the matches are of several leagues or too slow.
            NotFound: if there is no such match, or if its stages have not run.
            BadRecording: if a match has no headings.
        """
        from pitchlore.pipeline.views.lerobot.write import write_lerobot  # noqa: PLC0415 (loaded when asked for)

        return write_lerobot(self.store, None if folder is None else named_path(folder), matches, fps)

    def _catalogue(self) -> Path:
        """The catalogue, brought up to date; the store says whether damaged files may be left out."""
        path, left_out = refresh(self.store)
        age = "" if self.store.mirror is None else self.store.mirror.age()
        if age != self._age:
            self._age = age
            self._say(f"{self.store.where}: {age}")
        for error in left_out:
            self.store.go_on_without(error)
        return path

    def _numbered(self, noun: str, version: int | None) -> int:
        """A version's number; the newest one's for None."""
        versions: Sequence[int] = self.store.versions(noun)
        if version is None and not versions:
            word = "policy" if noun == "policies" else noun
            raise NotFound(f"there is no {word} yet", where=self.store.where,
                           next_step="Run `pitchlore run` first")
        return versions[-1] if version is None else version
