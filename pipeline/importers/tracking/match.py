"""Matches of tracking tables: one row per body and sample, from whatever file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.importers.directions import Sign, infer_periods, unsure, votes_of
from pitchlore.pipeline.importers.forms.absent import nothing_seen
from pitchlore.pipeline.importers.forms.angles import RADIANS, angle_unit
from pitchlore.pipeline.importers.forms.clocks import first_time
from pitchlore.pipeline.importers.forms.doubts import check_once, doubts, settled_pitch
from pitchlore.pipeline.importers.forms.origin import Lengths, lengths_of
from pitchlore.pipeline.importers.forms.periods import in_one_time
from pitchlore.pipeline.importers.rows import pack, referee
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.ball_restarts import CENTRE, line_ups
from pitchlore.pipeline.importers.tracking.columns import typed, unmatched
from pitchlore.pipeline.importers.tracking.guesses import guess_home
from pitchlore.pipeline.importers.tracking.mapping import TeamNames, TrackingMap
from pitchlore.pipeline.importers.tracking.scoring import LACKS, OF_A_TABLE, scoring
from pitchlore.pipeline.importers.tracking.states import Course, half_times, referee_events, words_of
from pitchlore.pipeline.matches.frame import OPTION_DTYPE, Frames, MatchInfo, MatchLog, no_options, wrap
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.schemas import SIDES
from pitchlore.schemas.options import OPTIONS

#: Bound on positions, speeds and turn rates: m, m/s, rad/s. A larger value is not a number of a match.
_FURTHEST = 1e6
#: Highest number of a robot (schemas: Int16).
_MAX_ID = 32767
#: Runs of rows of one frame, per frame, above which a file is sorted by body and not by time.
_BY_BODY = 2.0
#: Values that are no options that are shown.
_SHOWN = 8
#: Name of a team that has no rows and that the map does not name.
_NOT_RECORDED = "(not recorded)"


def match_of(
    raw: pl.DataFrame, source: SourceFile, mapping: TrackingMap, cut: str | None = None,
    flaws: Sequence[Flaw] = (), attacks: Sequence[Sign | None] = (),
) -> MatchLog:
    """Match of a tracking table.

    The plain form, which is read without a map, has the columns ``frame``, ``t`` (seconds),
    ``team`` (a name, or 'ball'), ``player`` (null for the ball), ``x``, ``y`` (metres from the
    centre, y up) and optionally ``segment``, ``heading`` (radians counter-clockwise, null where
    unknown), ``option``, ``score_home``, ``score_away`` and ``game_state``. Sampling, duplicated frames and
    reordered frames stay as recorded; only a table that is wholly in falling order of time is reversed.
    A table may lack one of the teams if a map names the other.

    Args:
        raw: the table as the file has it, with the columns under our names (see ``columns.columns_to_read``);
            numbers may be text.
        source: the file; the table is not read from it again.
        mapping: how to read another form.
        cut: why rows are missing at its end, else None.
        flaws: flaws found in the file.
        attacks: directions in which home attacks in the periods, as the source tells them.

    Raises:
        BadRecording: if it is no such table; the message says what it lacks.
    """
    name = source.name
    table, skipped = typed(raw, mapping, name)
    flaws = [*flaws, *([] if cut is None else [Flaw("truncated", cut)]), *skipped]
    flaws += unmatched(table, mapping)
    names, table, unnamed = _teams(table, mapping.teams, name)
    flaws += unnamed
    table, numbers = _players(table, names, flaws)
    if table.is_empty():
        raise BadRecording("has no row of the ball or a player", where=name, next_step=(
            "Name the column of players in a map's [columns] table"))
    table, breaks, anew = in_one_time(table, name)
    table, absent = nothing_seen(table)
    table, angles = _angles(table, mapping, name)
    lengths = lengths_of(table, mapping, name)
    table = _lengths(table, lengths)
    flaws += [*absent, *angles, *lengths.flaws, *anew]
    rows = _arrange(table)
    rows, turned = _in_rising_time(rows)
    flaws += turned
    check_once(rows.table, rows.first, name)
    pitch, guessed_pitch, unsure_pitch = settled_pitch(
        rows.table, rows.column("x"), mapping.pitch, corner=lengths.corner)
    flaws += unsure_pitch
    rows = _turned(rows, mapping, pitch, corner=lengths.corner)
    frames = _frames(rows)
    course = _course(rows, frames, breaks, pitch)
    guessed: dict[str, object] = {}
    if mapping.teams.home is None and mapping.teams.away is None:
        order = np.argsort(frames.t_ns, kind="stable")
        home, evidence = guess_home(course, names, mapping, votes_of(frames)[order], pitch.goal_x)
        guessed["home"] = {"team": names[home], "from": evidence}
        if evidence == "alphabet":
            course, lost = _nobodys(course, names)
            flaws += lost
        if home == 1:
            names = (names[1], names[0])
            rows = rows._replace(team=np.where(rows.team < 2, 1 - rows.team, rows.team))
            frames = _frames(rows)
    if guessed_pitch:
        guessed["pitch"] = pitch.model_dump(mode="json")
    if numbers:
        guessed["players"] = numbers
    said = words_of(course, names, mapping)
    first = mapping.teams.home_attacks
    periods, inferred = infer_periods(
        frames, [*half_times(course, said), *breaks.tolist()],
        None if first is None else (1 if first == "right" else -1), attacks,
    )
    lack = LACKS.get(source.format or "", OF_A_TABLE)
    reported = scoring(course, said, periods, unsure(periods, inferred), pitch, mapping.goals, lack)
    events, unknown = referee_events(
        course, said, CENTRE * pitch.length, source, reported.found, reported.restarts,
        by_ball=reported.origin == "ball",
    )
    flaws += reported.flaws
    options, none = _options(rows, name)
    flaws += doubts(
        frames, pitch, mapping, inferred=guessed_pitch, mapped=source.format not in LACKS)
    flaws += _not_numbers(rows) + none + unknown + inferred
    incomplete = source.damage or cut
    if source.damage is not None:
        flaws.append(Flaw("truncated", source.damage, start_ns=int(frames.t_ns.max())))
    info = MatchInfo(
        match_id=source.match_id, source=name, format="tracking", home=mapping.teams.named(names[0]),
        away=mapping.teams.named(names[1]), started_at=first_time(raw["t"], mapping.units.time), pitch=pitch,
        periods=periods,
        settings={"map": mapping.settings(), "guessed": guessed, "goals": reported.settings()},
        software=RELEASE, complete=incomplete is None,
        incomplete_reason=incomplete,
    )
    return MatchLog(
        info=info, frames=frames, referee=referee(source.match_id, events),
        quality=quality_table(source.match_id, flaws), options=options,
    )


class _Rows(NamedTuple):
    """A table ordered by frame, with its most used columns as arrays.

    Attributes:
        table: one row a body and frame; ``x``, ``y`` in metres.
        frame: int64 [N] index of each row's frame.
        first: int64 [F] index of each frame's first row.
        team: int64 [N] 0 or 1 for the teams, 2 for the ball.
    """

    table: pl.DataFrame
    frame: I64
    first: I64
    team: I64

    def column(self, name: str) -> F64:
        """A column as float64 [N]; NaN where it is null, absent or out of bounds."""
        if name not in self.table.columns:
            return np.full(len(self.table), np.nan)
        values = self.table[name].cast(pl.Float64).fill_null(float("nan")).to_numpy()
        return np.where(np.abs(values) < _FURTHEST, values, np.nan)


def _teams(
    table: pl.DataFrame, teams: TeamNames, name: str
) -> tuple[tuple[str, str], pl.DataFrame, list[Flaw]]:
    """Names of home and away (sorted if the map names neither), and the rows of both and the ball.

    If the table has only one team, a map must name it; the other has no rows.
    """
    found = sorted(set(table["team"].unique().to_list()) - {teams.ball})
    given = [team for team in (teams.home, teams.away) if team is not None]
    alone = len(found) == 1 and found[0] in given
    missing = [team for team in given if team not in found]
    if missing and not alone:
        raise BadRecording(
            f"has no team {missing[0]!r}; it has {', '.join(found) or 'none'}", where=name,
            next_step="Mend the map's [teams] table",
        )
    left = [team for team in found if team not in given] or [_NOT_RECORDED] * alone
    if len(given) < 2 and len(given) + len(left) != 2:
        many = {0: "no team", 1: "one team"}.get(len(found), f"{len(found)} teams")
        raise BadRecording(
            f"has {many} besides {teams.ball!r}: {', '.join(found[:8]) or 'none'}", where=name,
            next_step="Name home, away and ball in a map's [teams] table" + (
                "; if the other team was not recorded, naming this one will do" if len(found) == 1 else ""
            ),
        )
    home = teams.home or next(team for team in left if team != teams.away)
    away = teams.away or next(team for team in left if team != home)
    ours = table.filter(pl.col("team").is_in([home, away, teams.ball]))
    flaws = []
    if len(ours) < len(table):
        flaws.append(Flaw("skipped", "rows of other teams", len(table) - len(ours)))
    return (home, away), ours, flaws


def _players(
    table: pl.DataFrame, names: tuple[str, str], flaws: list[Flaw]
) -> tuple[pl.DataFrame, dict[str, dict[str, int]]]:
    """Table with ``id`` UInt16 (0 for the ball) and ``side``, and the numbers that names were given.

    Numbers from 0 to 32767 are kept. If a team has any other player, its players are numbered in
    alphabetical order. Rows of robots without a player are left out.
    """
    side = pl.col("team").replace_strict({names[0]: 0, names[1]: 1}, default=2, return_dtype=pl.Int64)
    table = table.with_columns(side.alias("side"))
    whole = table.filter((pl.col("side") == 2) | pl.col("player").is_not_null())
    if len(whole) < len(table):
        flaws.append(Flaw("skipped", "rows of robots without a player", len(table) - len(whole)))
    numbers: dict[str, dict[str, int]] = {}
    ids = pl.col("player").cast(pl.Int64, strict=False)
    for code, team in enumerate(names):
        players = whole.filter(pl.col("side") == code)["player"].unique().sort()
        known = players.cast(pl.Int64, strict=False)
        if not known.is_between(0, _MAX_ID).fill_null(False).all():
            numbers[team] = {player: number for number, player in enumerate(players)}
            new = pl.col("player").replace_strict(numbers[team], default=None, return_dtype=pl.Int64)
            ids = pl.when(pl.col("side") == code).then(new).otherwise(ids)
    ids = pl.when(pl.col("side") == 2).then(0).otherwise(ids)
    return whole.with_columns(ids.cast(pl.UInt16).alias("id")), numbers


def _lengths(table: pl.DataFrame, lengths: Lengths) -> pl.DataFrame:
    """Table with lengths in metres, from the file's origin or the centre that a map gives."""
    axes = zip(("x", "y"), ("vx", "vy"), lengths.metres, lengths.centre, strict=True)
    return table.with_columns(
        (pl.col(column) - (zero if column in ("x", "y") else 0.0)) * metres
        for *columns, metres, zero in axes for column in columns
        if column in table.columns and (metres != 1.0 or zero)
    )


def _angles(table: pl.DataFrame, mapping: TrackingMap, name: str) -> tuple[pl.DataFrame, list[Flaw]]:
    """Table with angles in radians, and the flaw of a unit that nothing named."""
    unit, flaws = mapping.units.angle, list[Flaw]()
    if "heading" in table.columns:
        heading = table["heading"].fill_null(float("nan")).to_numpy()
        unit, flaws = angle_unit(heading, unit, name)
    radians = RADIANS[unit or "rad"]
    return table.with_columns(
        pl.col(column) * radians for column in ("heading", "omega")
        if column in table.columns and radians != 1.0
    ), flaws


def _arrange(table: pl.DataFrame) -> _Rows:
    """Rows grouped by frame, frames in the order of the file.

    If a body has two rows of one frame number and time, the frame was recorded twice. If the file is
    sorted by body, its frames are put in order of time.
    """
    frame, first = _stretches(table)
    body = table["side"].to_numpy() << 16 | table["id"].to_numpy()
    told = np.sort(frame << 18 | body)
    # frame after frame, as most files are, and no body twice in one
    if not (told[1:] == told[:-1]).any() and table.select("frame", "t_ns")[first].is_unique().all():
        return _Rows(table, frame, first, table["side"].to_numpy())
    key = ["frame", "t_ns"]
    table = table.with_columns(again=pl.int_range(pl.len()).over([*key, "side", "id"]))
    key.append("again")
    table = table.with_columns(row=pl.int_range(pl.len()))
    table = table.with_columns(lead=pl.col("row").first().over(key))
    frames = table["lead"].n_unique()
    runs = int((table["lead"].diff() != 0).sum()) + 1
    table = table.sort(["t_ns", "frame", "again", "row"] if runs > _BY_BODY * frames else ["lead", "row"])
    frame, first = _stretches(table, "lead")
    return _Rows(table.drop("again", "row", "lead"), frame, first, table["side"].to_numpy())


def _stretches(table: pl.DataFrame, *key: str) -> tuple[I64, I64]:
    """Number of each row's stretch of rows that are alike in columns, and the first row of each stretch."""
    columns = [table[name].to_numpy() for name in key or ("frame", "t_ns")]
    anew = np.any([np.diff(column) != 0 for column in columns], axis=0)
    first = np.concatenate([[0], np.flatnonzero(anew) + 1]).astype(np.int64)
    return np.repeat(np.arange(len(first), dtype=np.int64), np.diff(first, append=len(table))), first


def _in_rising_time(rows: _Rows) -> tuple[_Rows, list[Flaw]]:
    """Rows with their frames reversed if all times fall, and the flaw that says so.

    A clock that counts down, while frame numbers or the score rise, is counted from its start.
    """
    t_ns, number = (rows.table[column].to_numpy()[rows.first] for column in ("t_ns", "frame"))
    if len(t_ns) < 2 or not bool(np.all(np.diff(t_ns) < 0)):
        return rows, []
    score = rows.column("score_home")[rows.first] + rows.column("score_away")[rows.first]
    if bool(np.all(np.diff(number) > 0)) or score[-1] > score[0]:
        table = rows.table.with_columns(t_ns=int(t_ns.max()) - pl.col("t_ns"))
        return _arrange(table), [Flaw("assumed", "t counts down: times are those since its start", len(t_ns))]
    note = "the table is in falling order of time: turned round; if t counts down, write the time since then"
    flaw = Flaw("reordered frame", note, len(t_ns), int(t_ns[-1]), int(t_ns[0]) + 1)
    return _arrange(rows.table.sort("t_ns", maintain_order=True)), [flaw]


def _turned(rows: _Rows, mapping: TrackingMap, pitch: Pitch, *, corner: bool) -> _Rows:
    """Rows in our axes: origin at the centre, y up, headings counter-clockwise from our +x."""
    axes = mapping.axes
    x_sign = 1.0 if axes.x == "right" else -1.0
    y_sign = 1.0 if axes.y == "up" else -1.0
    turn = 1.0 if axes.heading == "ccw" else -1.0
    zero = 0.0 if axes.x == "right" else np.pi
    changed = {
        "x": (rows.column("x") - (pitch.length / 2 if corner else 0.0)) * x_sign,
        "y": (rows.column("y") - (pitch.width / 2 if corner else 0.0)) * y_sign,
        "vx": rows.column("vx") * x_sign,
        "vy": rows.column("vy") * y_sign,
        "theta": wrap(rows.column("heading") * turn + zero),
        "omega": rows.column("omega") * turn,
    }
    # a value that is not a number is distinguished from one that is absent
    given = rows.table["x"].is_not_null() & rows.table["y"].is_not_null()
    aimed = rows.table["heading"].is_not_null() if "heading" in rows.table.columns else given & False
    table = rows.table.with_columns(
        *(pl.Series(name, values) for name, values in changed.items()),
        given.alias("given"), aimed.alias("aimed"),
    )
    return rows._replace(table=table)


def _seen(rows: _Rows) -> Bools:
    """Mask of rows with a position, bool [N]."""
    return np.isfinite(rows.column("x")) & np.isfinite(rows.column("y"))


def _not_numbers(rows: _Rows) -> list[Flaw]:
    """Flaws of positions and headings that are not numbers, one per body and kind."""
    sided = rows.table.with_columns(pl.Series("side", rows.team))
    flaws = []
    for what, given, there in (
        ("place", "given", _seen(rows)), ("heading", "aimed", np.isfinite(rows.column("theta")))
    ):
        bad = sided.filter(given, ~pl.Series(there))
        found = bad.group_by("side", "id").agg(
            pl.len(), pl.col("t_ns").min().alias("start"), pl.col("t_ns").max().alias("end")
        )
        flaws += [
            Flaw(
                "not a number", f"{what} taken for missing", count, start, end + 1,
                "ball" if side == 2 else SIDES[side], None if side == 2 else robot,
            )
            for side, robot, count, start, end in found.sort("side", "id").iter_rows()
        ]
    return flaws


def _options(rows: _Rows, name: str) -> tuple[npt.NDArray[np.void], list[Flaw]]:
    """Changes of the options that teams logged, OPTION_DTYPE, and the flaw of values that are no options.

    Raises:
        BadRecording: if a column for options has no option.
    """
    if "option" not in rows.table.columns:
        return no_options(), []
    robots = rows.table.select("t_ns", "option", robot="id", team=pl.Series(rows.team)).filter(
        pl.col("team") < 2).sort("t_ns", maintain_order=True)
    known = pl.Series(np.isin(robots["option"].to_numpy(), OPTIONS))
    wrong = robots["option"].filter(~known & robots["option"].is_not_null())
    flaws = list[Flaw]()
    if len(wrong):
        said = ", ".join(f"{value:g}" for value in wrong.unique().sort()[:_SHOWN]).replace("nan", "words")
        what = f"column option has {said}, which a robot cannot do on purpose"
        if not known.any():
            raise BadRecording(what, where=name, next_step=(
                f"Write codes of Table 1 ({', '.join(map(str, OPTIONS))}), or rename the column"))
        flaws = [Flaw("skipped", f"{what}: taken for not logged", len(wrong))]
    robots = robots.with_columns(option=robots["option"].set(~known, 0).fill_null(0).cast(pl.Int16))
    changes = robots.filter(pl.col("option") != pl.col("option").shift(fill_value=0).over("team", "robot"))
    return changes.to_numpy(structured=True).astype(OPTION_DTYPE), flaws


def _frames(rows: _Rows) -> Frames:
    """Samples as recorded."""
    seen = _seen(rows)
    ball, robot = seen & (rows.team == 2), seen & (rows.team < 2)
    columns = {name: rows.column(name) for name in ("x", "y", "vx", "vy", "theta", "omega")}
    balls = {name: np.full(len(rows.first), np.nan) for name in ("x", "y", "vx", "vy")}
    for name, values in balls.items():
        values[rows.frame[ball]] = columns[name][ball]
    return pack(
        rows.table["frame"].to_numpy()[rows.first].astype(np.uint32),
        rows.table["t_ns"].to_numpy()[rows.first],
        balls,
        rows.frame[robot],
        {
            "team": rows.team[robot].astype(np.uint8), "id": rows.table["id"].to_numpy()[robot],
            **{name: values[robot] for name, values in columns.items()},
        },
    )


def _nobodys(course: Course, names: tuple[str, str]) -> tuple[Course, list[Flaw]]:
    """Course without a score where nothing tells which team it is of, and the flaw that says so.

    The home team is the first by the alphabet then.
    """
    say = f'say in a map [teams] home = "{names[0]}" or "{names[1]}"'
    if course.score is None or bool((course.score[:, 0] == course.score[:, 1]).all()):
        note = f"nothing tells which team is home, taken for {names[0]}: {say}"
        return course, [Flaw("home inferred", note)]
    note = f"nothing tells of which team score_home is, so that no goal is taken from the score: {say}"
    return replace(course, score=None, unscored=True), [Flaw("home inferred", note)]


def _course(rows: _Rows, frames: Frames, breaks: I64, pitch: Pitch) -> Course:
    """Course of the match as the table tells it, in order of time."""
    order = np.argsort(frames.t_ns, kind="stable")
    names = [name for name in ("game_state", "segment", "score_home", "score_away") if name in rows.table]
    facts = rows.table.select("t_ns", *names)[rows.first[order]]
    given = {name for name in names if facts[name].null_count() < len(facts)}
    score, starts = None, tuple(np.searchsorted(frames.t_ns[order], breaks).tolist())
    if {"score_home", "score_away"} <= given:
        score = facts.select(pl.col("score_home", "score_away").fill_null(-1)).to_numpy()
        score = _going_on(score, starts)
    unsaid = "game_state" not in given or facts["game_state"].n_unique() == 1
    return Course(
        frames.t_ns[order],
        facts["game_state"].to_list() if "game_state" in given else None,
        score,
        facts["segment"].to_list() if "segment" in given else None,
        frames.ball["x"][order].astype(np.float64),
        frames.ball["y"][order].astype(np.float64),
        score is None and any(name.startswith("score") for name in names),
        starts,
        line_ups(frames, order, pitch) if unsaid else None,
    )


def _going_on(score: I64, breaks: Sequence[int]) -> I64:
    """Score that goes on over periods that each count from 0 : 0."""
    score = score.copy()
    for at in breaks:
        before, after = score[:at].max(axis=0), score[at:]
        if before.any() and not after[0].any():
            score[at:] = np.where(after >= 0, after + np.maximum(before, 0), after)
    return score
