"""How a table is read: which of its columns, and what becomes of them, for text and Parquet alike."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.forms.clocks import check_fine, in_nanoseconds, sampled, unit_by_steps
from pitchlore.pipeline.importers.forms.naming import by_words
from pitchlore.pipeline.importers.forms.words import BALLS, bare
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.columns import REQUIRED, column_name, columns_to_read
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.importers.tracking.wide import OF_A_SAMPLE, Wide, named_bodies, unfolded, wide
from pitchlore.pipeline.matches.quality import Flaw

#: Columns of the ball that a table may have in each row.
_OF_THE_BALL = ("x", "y", "vx", "vy")


class Read(NamedTuple):
    """A table under our names, its map with all that was found, and flaws."""

    table: pl.DataFrame
    mapping: TrackingMap
    flaws: list[Flaw]


class TablePlan(NamedTuple):
    """How a table is read.

    Attributes:
        mapping: the map, with columns that were found by words.
        wide: the bodies' columns of a table with a row a sample; None for one with a row a body.
        theirs: columns of one with a row a body, our name to the file's.
        ball: columns that each of its rows has of the ball, our name to the file's.
        teams: columns that name a team, by the file's word for it.
        flaws: notes of columns that were found by words.
    """

    mapping: TrackingMap
    wide: Wide | None
    theirs: dict[str, str]
    ball: dict[str, str]
    teams: dict[str, str]
    flaws: list[Flaw]

    def names(self) -> list[str]:
        """The file's columns that are read, each once."""
        ours = self.theirs.values() if self.wide is None else self.wide.names()
        return list(dict.fromkeys([*ours, *self.ball.values(), *self.teams.values()]))

    def applied(self, table: pl.DataFrame, source: SourceFile) -> Read:
        """The table under our names.

        Args:
            table: the columns ``names()``; text is without blanks around it.
            source: the file.

        Raises:
            BadRecording: if times or teams cannot be told.
        """
        mapping, flaws = self.mapping, [*self.flaws]
        names = {word: _first(table[column]) for word, column in self.teams.items()}
        if self.wide is not None:
            named = unfolded(table, self.wide, source)
        else:
            named = table.select(pl.col(theirs).alias(ours) for ours, theirs in self.theirs.items())
            named, more = _with_balls(named, mapping)
            flaws += more
            if self.ball:
                named, more = self._with_ball(named, table, source)
                flaws += more
        teams = mapping.teams.model_copy(update={
            "names": {word: name for word, name in names.items() if name} | mapping.teams.names})
        mapping = mapping.model_copy(update={"teams": teams})
        named, mapping, said = _timed(named, mapping, source.name)
        return Read(named, mapping, [*flaws, *_said(said)])

    def _with_ball(
        self, named: pl.DataFrame, table: pl.DataFrame, source: SourceFile
    ) -> tuple[pl.DataFrame, list[Flaw]]:
        """The table with rows of the ball, from the columns of each row, unless it has such rows."""
        ball = self.mapping.teams.ball
        if (named["team"] == ball).any():
            return named, []
        key = [column for column in ("period", "segment", "frame", "t") if column in named.columns]
        more = [column for column in ("game_state", "score_home", "score_away") if column in named.columns]
        rows = named.select(*key, *more).with_columns(
            pl.lit(ball).alias("team"), pl.lit(None, dtype=named["player"].dtype).alias("player"),
            *(table[theirs].alias(ours) for ours, theirs in self.ball.items()))
        rows = rows.with_row_index("row").filter(pl.struct(key).is_first_distinct())
        if len(named) + len(rows) > source.limits.rows:
            raise source.too_much(f"{len(named) + len(rows)} rows with those of the ball", "rows")
        whole = pl.concat([rows, named.with_row_index("row")], how="diagonal_relaxed")
        note = f"the ball is read from the columns {', '.join(self.ball.values())} of each row"
        return whole.sort("row", maintain_order=True).drop("row"), [Flaw("assumed", note)]


def plan_of(found: list[str], mapping: TrackingMap, name: str) -> TablePlan:
    """How a table is read, from the names of its columns and the map.

    Raises:
        BadRecording: if it lacks a column that is needed, or that the map names.
    """
    teams = {word: column_name(column, found) for word, column in mapping.teams.named_by.items()}
    if missing := [column for column in teams.values() if column not in found]:
        raise BadRecording(f"has no column {missing[0]}", where=name, next_step="Mend the map's named_by")
    only_ball = set(mapping.bodies) == {mapping.teams.ball}
    mapped = mapping.model_copy(update={"bodies": {}}) if only_ball else mapping
    of_samples, said = by_words(found, _counted_by(mapped, found), OF_A_SAMPLE)
    if mapping.bodies.keys() - {mapping.teams.ball} or len(named_bodies(found, mapping.teams.ball)) > 1:
        _check_rate(of_samples, found, name)
    columns = wide(found, of_samples, name)
    if columns is not None:
        return TablePlan(of_samples, columns, {}, {}, teams, [*columns.flaws, *_said(said)])
    resolved, said = by_words(found, _counted_by(mapped, found), tuple(type(mapping.columns).model_fields))
    resolved = _counted_by(resolved, found)
    _check_rate(resolved, found, name)
    theirs = columns_to_read(found, resolved.columns, name, REQUIRED)
    free = [column for column in found if column not in theirs.values()]
    ball = named_bodies(free, mapping.teams.ball).get((mapping.teams.ball, None), {})
    if only_ball:
        ball = mapping.bodies[mapping.teams.ball].model_dump(exclude_none=True)
        ball = {ours: column_name(column, found) for ours, column in ball.items()}
    ball = {ours: column for ours, column in ball.items() if ours in _OF_THE_BALL}
    if not {"x", "y"} <= ball.keys():
        ball = {}
    return TablePlan(resolved, None, theirs, ball, teams, _said(said))


def _said(words: str) -> list[Flaw]:
    return [Flaw("assumed", words)] if words else []


def _counted_by(mapping: TrackingMap, found: list[str]) -> TrackingMap:
    """The map with frames as the time, where it tells their rate and no column of the time is there."""
    there = mapping.columns.t in found or "t" in mapping.columns.model_fields_set
    if mapping.time.hz is None or there:
        return mapping
    resolved, _ = by_words(found, mapping, ("frame",))
    frame = column_name(resolved.columns.frame, found)
    if frame not in found:
        return mapping
    columns = resolved.columns.model_copy(update={"t": frame, "frame": frame})
    return resolved.model_copy(update={"columns": columns})


def _check_rate(mapping: TrackingMap, found: list[str], name: str) -> None:
    """Refuse a table whose samples are counted, and nothing tells their rate."""
    frame = column_name(mapping.columns.frame, found)
    if frame in found and mapping.columns.t not in found and "t" not in mapping.columns.model_fields_set:
        raise BadRecording(f"has no time, only {frame}", where=name, next_step=(
            "Say in a map how many of them a second has, [time] hz = 10, or what is the time, [columns] t"))


def _first(column: pl.Series) -> str | None:
    """The first text in a column."""
    known = column.cast(pl.String).drop_nulls()
    return next((text.strip(' "') for text in known[:1000] if text.strip(' "')), None)


def _with_balls(named: pl.DataFrame, mapping: TrackingMap) -> tuple[pl.DataFrame, list[Flaw]]:
    """The table with the ball's name in its rows, where they have another word for it, or no team."""
    ball = mapping.teams.ball
    if "ball" in mapping.teams.model_fields_set or named["team"].dtype.is_nested():
        return named, []
    team, player = (pl.col(column).cast(pl.String) for column in ("team", "player"))
    words = named.select(team.unique()).to_series().drop_nulls().to_list()
    if ball in words or not words:
        return named, []
    called = [word for word in words if bare(word) in BALLS]
    players = named.select(player.unique()).to_series().drop_nulls().to_list()
    balls = [word for word in players if bare(word) in BALLS]
    if called:
        at, what = team.is_in(called), f"the team {called[0]} was"
    elif balls:
        at, what = player.is_in(balls), f"the player {balls[0]} was"
    else:
        nobody = team.is_null() | team.is_in(["", "null", "None", "NA", "nan", "NaN"])
        key = [column for column in ("period", "segment", "frame", "t") if column in named.columns]
        rows = named.filter(nobody)
        if not len(rows) or rows.select(pl.struct(key).is_duplicated().any()).item():
            return named, []
        at, what = nobody, "rows without a team, one a sample, were"
    changed = named.with_columns(
        pl.when(at).then(pl.lit(ball)).otherwise(team).alias("team"),
        pl.when(at).then(None).otherwise(player).alias("player"))
    return changed, [Flaw("assumed", f"{what} taken for the ball")]


def _timed(named: pl.DataFrame, mapping: TrackingMap, name: str) -> tuple[pl.DataFrame, TrackingMap, str]:
    """The table with times in nanoseconds, if they are no numbers or count samples; velocities a second.

    Of numbers the unit is found, and said, if the map does not say it.
    """
    hz, said = mapping.time.hz, ""
    times = sampled(named["t"], hz) if hz is not None else in_nanoseconds(named["t"], name)
    if times is not None:
        if hz is None and "frame" in named.columns:
            check_fine(times, named["frame"], name)
        named = named.with_columns(times.alias("t"))
        mapping = mapping.model_copy(update={"units": mapping.units.model_copy(update={"time": "ns"})})
    else:
        unit, said = unit_by_steps(named["t"], named.get_column("frame", default=None), name)
        if "time" in mapping.units.model_fields_set:
            said = ""
        else:
            mapping = mapping.model_copy(update={"units": mapping.units.model_copy(update={"time": unit})})
    if mapping.units.speed == "sample":
        if hz is None:
            raise BadRecording("has velocities a sample, by the map, and no rate", where=name,
                               next_step="Say the samples a second in the map: [time] hz = 10")
        named = named.with_columns(pl.col(column).cast(pl.Float64, strict=False) * hz
                                   for column in ("vx", "vy", "omega") if column in named.columns)
    return named, mapping, said
