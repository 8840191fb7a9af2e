"""The match of a kloppy dataset."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from html import unescape
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.football.providers import KLOPPY
from pitchlore.pipeline.importers.football.squad import Stay, shirt_numbers
from pitchlore.pipeline.importers.football.told import TURNING, attacks_told, orientation_of, score_told
from pitchlore.pipeline.importers.rows import Event, referee
from pitchlore.pipeline.importers.source import SourceFile, slug
from pitchlore.pipeline.importers.tracking.mapping import Axes, PitchMap, TeamNames, TrackingMap
from pitchlore.pipeline.importers.tracking.match import match_of as match_of_table
from pitchlore.pipeline.matches.frame import NO_HEIGHTS, Heights, MatchLog
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.schemas import SIDES

if TYPE_CHECKING:
    from kloppy.domain import TrackingDataset

    #: A dataset of positions, as kloppy's loaders give it.
    KloppyDataset: TypeAlias = TrackingDataset

#: States of the table that is made of a dataset, and the events that they are.
_STATES = {"alive": "play", "dead": "stop", "half": "half"}
_BALL = "ball"
#: Providers whose y kloppy 3.19.1 turns upside down. Metrica counts from the top left, by the README of its
#: sample data, and so does the system in which kloppy hands its CSV over, but it writes 1 - y.
_MIRRORED = {"metrica-csv"}
#: Longest break between two periods, ns; longer ones are no time of the match.
_LONGEST_BREAK_NS = 3_600_000_000_000


class _Samples(NamedTuple):
    """A dataset in columns: F frames, N rows of players.

    Attributes:
        t_ns: int64 [F], since the first sample; the periods one after the other, with the time between them.
        period: int64 [F], the periods' ids.
        alive: bool [F], whether the ball is in play; true where the provider does not say.
        ball: float64 [3, F], x, y and height in the dataset's system; NaN where not known.
        frame: int64 [N], the frame of each player's row.
        who: int64 [N], index in ``players``.
        places: float64 [2, N].
        players: kloppy's players, in the order in which they are first seen.
    """

    t_ns: I64
    period: I64
    alive: Any
    ball: F64
    frame: I64
    who: I64
    places: F64
    players: list[Any]


def match_of_dataset(dataset: TrackingDataset, source: SourceFile | None = None) -> MatchLog:
    """The match of any kloppy ``TrackingDataset``: kind human, our axes and units.

    Lengths become metres by the dataset's pitch, whatever its coordinate system. A player has the number on
    the shirt; nameless tracks share places (:func:`pipeline.importers.football.squad.shirt_numbers`), so that
    a substitute is another body and a lost track is not. Each period begins with the ball in play; where the
    provider says that it is dead, play is stopped. Goals are found from the ball, because datasets of
    positions tell none; the provider's final score is that of the end. The ball's height is kept where it is
    given (``MatchLog.heights``).

    Args:
        dataset: dataset of positions, in the order of time.
        source: the files that it was read from; None if it comes from elsewhere. The match's id is then of
            its positions.

    Raises:
        BadRecording: if it has no sample, or not two teams.
    """
    name = source.name if source else str(dataset.metadata.game_id or "dataset")
    if not dataset.records or len(dataset.metadata.teams) != 2:
        raise BadRecording("is not a match of two teams with samples", where=name,
                           next_step="Give a dataset of kloppy's with positions of both teams")
    if orientation_of(dataset) in TURNING:
        raise BadRecording("has axes that turn with who has the ball", where=name, next_step=(
            'Transform it before, as with dataset.transform(to_orientation="HOME_AWAY")'))
    samples = _samples(dataset)
    length, width = _size(dataset)
    table, about = _table(dataset, samples, length, width)
    if source is not None and source.provider in _MIRRORED:
        table = table.with_columns(-pl.col("y"))
    if source is None:
        parts = (samples.t_ns, samples.ball, samples.places)
        digest = sha256(b"".join(part.tobytes() for part in parts)).hexdigest()
        source = SourceFile(name, b"", None, KLOPPY, digest, f"{slug(name)}-{digest[:12]}")
    goal = PITCHES[Kind.HUMAN]
    mapping = TrackingMap(
        pitch=PitchMap(kind=Kind.HUMAN, length=length, width=width, goal_width=goal.goal_width),
        axes=Axes(origin="centre"),
        teams=TeamNames(home=SIDES[0], away=SIDES[1], ball=_BALL),
        states={state: _STATES[state] for state in table["game_state"].unique()},
    )
    told = attacks_told(dataset, source)
    match = match_of_table(table, source, mapping, attacks=[
        told.get(period) for period in np.unique(samples.period).tolist()])
    names = [_text(team.name) or side for team, side in zip(dataset.metadata.teams, SIDES, strict=True)]
    settings = {**match.info.settings, "provider": _text(dataset.metadata.provider), **about}
    settings.pop("map", None)  # it is ours, and says nothing that the pitch does not
    score = score_told(dataset, source)
    quality = quality_table(match.info.match_id, _too_many(match, score))
    info = match.info.model_copy(update={
        "format": KLOPPY, "home": names[0], "away": names[1], "settings": settings,
        "started_at": dataset.metadata.date,
    })
    return replace(
        match, info=type(info).model_validate(info.model_dump()), heights=_heights(samples),
        quality=pl.concat([match.quality, quality]),
        referee=pl.concat([match.referee, _end(score, match)]).sort("t_ns", maintain_order=True),
    )


def _text(value: Any) -> str | None:
    """Text of a provider as one of Python's own: XML's has another type, and letters of HTML in some."""
    return None if value is None else unescape(str(value))


def _samples(dataset: TrackingDataset) -> _Samples:
    """The dataset in columns."""
    offsets = _offsets(dataset)
    t_ns, period, alive, ball = [], [], [], []
    frame, who, places = list[int](), list[int](), list[tuple[float, float]]()
    index: dict[Any, int] = {}
    nowhere = (np.nan, np.nan, np.nan)
    for number, record in enumerate(dataset.records):
        t_ns.append(offsets[record.period.id] + _ns(record.timestamp))
        period.append(record.period.id)
        alive.append(record.ball_state is None or record.ball_state.value == "alive")
        at = record.ball_coordinates
        ball.append(nowhere if at is None else (at.x, at.y, _number(getattr(at, "z", None))))
        for player, data in record.players_data.items():
            if data.coordinates is not None:
                frame.append(number)
                who.append(index.setdefault(player, len(index)))
                places.append((data.coordinates.x, data.coordinates.y))
    times = np.array(t_ns, dtype=np.int64)
    return _Samples(
        times - times.min(), np.array(period), np.array(alive, dtype=np.bool_),
        np.array(ball, dtype=np.float64).reshape(-1, 3).T, np.array(frame, dtype=np.int64),
        np.array(who, dtype=np.int64), np.array(places, dtype=np.float64).reshape(-1, 2).T, list(index),
    )


def _number(value: float | None) -> float:
    return np.nan if value is None else float(value)


def _ns(span: Any) -> int:
    """A timedelta in nanoseconds."""
    return int(round(span.total_seconds() * 1e6) * 1000)


def _offsets(dataset: TrackingDataset) -> dict[int, int]:
    """Time of each period's beginning, ns from the first one's; a period never begins before the last ended.

    Providers give the beginnings as times of the day, or since the first frame; Second Spectrum's are
    milliseconds, which kloppy takes for frames. Where they give the same one
    twice, or more than ``_LONGEST_BREAK_NS`` between two periods, these follow each other.
    """
    spans: dict[int, tuple[int, int]] = {}
    for record in dataset.records:
        now = _ns(record.timestamp)
        low, high = spans.get(record.period.id, (now, now))
        spans[record.period.id] = min(low, now), max(high, now)
    periods = sorted((p for p in dataset.metadata.periods if p.id in spans), key=lambda period: period.id)
    step = round(1e9 / dataset.metadata.frame_rate) if dataset.metadata.frame_rate else 1_000_000_000
    offsets: dict[int, int] = {}
    end = 0
    for period in periods:
        begins = _ns(period.start_timestamp - periods[0].start_timestamp)
        low, high = spans[period.id]
        if offsets and not end + step <= begins + low <= end + _LONGEST_BREAK_NS:
            begins = end + step - low
        offsets[period.id] = begins
        end = begins + high
    return offsets


def _size(dataset: TrackingDataset) -> tuple[float, float]:
    """Length and width of the pitch, metres: the dataset's, else those of the usual one."""
    pitch, usual = dataset.metadata.pitch_dimensions, PITCHES[Kind.HUMAN]
    return float(pitch.pitch_length or usual.length), float(pitch.pitch_width or usual.width)


def _metres(dataset: TrackingDataset, x: F64, y: F64, length: float, width: float) -> tuple[F64, F64]:
    """Places in metres from the centre, y up on a pitch that is drawn with +x to the right."""
    system = dataset.metadata.coordinate_system
    along, across = system.pitch_dimensions.x_dim, system.pitch_dimensions.y_dim
    up = 1.0 if system.vertical_orientation.value == "bottom-to-top" else -1.0
    ours_x = ((x - along.min) / (along.max - along.min) - 0.5) * length
    ours_y = ((y - across.min) / (across.max - across.min) - 0.5) * width * up
    return ours_x, ours_y


def _table(
    dataset: TrackingDataset, samples: _Samples, length: float, width: float
) -> tuple[pl.DataFrame, dict[str, object]]:
    """The tracking table of a dataset (``tracking.match.match_of``), and what is known of its players."""
    home = dataset.metadata.teams[0]
    players = samples.players
    side = np.array([int(player.team.team_id != home.team_id) for player in players], dtype=np.int64)
    first, last = _seen(samples)
    number = np.zeros(len(players), dtype=np.int64)
    squads: dict[str, dict[str, object]] = {}
    substitutes: list[tuple[int, str, int]] = []
    for code, word in enumerate(SIDES):
        ours = np.flatnonzero(side == code).tolist()
        number[ours] = shirt_numbers([Stay(_shirt(players[i]), int(first[i]), int(last[i])) for i in ours])
        named = [i for i in ours if _shirt(players[i]) == number[i]]
        squads[word] = {str(number[i]): _text(players[i].full_name) for i in named}
        substitutes += [
            (int(first[i]), word, int(number[i])) for i in named if players[i].starting is False
        ]
    state = _states(samples)
    x, y = _metres(dataset, samples.places[0], samples.places[1], length, width)
    ball_x, ball_y = _metres(dataset, samples.ball[0], samples.ball[1], length, width)
    frames = np.arange(len(samples.t_ns))
    robots = pl.DataFrame({
        "frame": samples.frame, "t": samples.t_ns[samples.frame], "team": np.array(SIDES)[side[samples.who]],
        "player": number[samples.who].astype(str), "x": x, "y": y, "game_state": state[samples.frame],
    })
    ball = pl.DataFrame({
        "frame": frames, "t": samples.t_ns, "team": np.full(len(frames), _BALL),
        "player": pl.Series([None] * len(frames), dtype=pl.String), "x": ball_x, "y": ball_y,
        "game_state": state,
    })
    table = pl.concat([ball, robots]).with_columns(pl.col("t") / 1e9).with_columns(
        pl.col("x", "y").fill_nan(None)).sort("frame", maintain_order=True)
    return table, {"players": squads, "substitutes": [
        {"t_ns": at, "team": word, "number": shirt} for at, word, shirt in sorted(substitutes)]}


def _seen(samples: _Samples) -> tuple[I64, I64]:
    """First and last time at which each player is seen, int64 [players] each, ns."""
    times = samples.t_ns[samples.frame]
    first = np.full(len(samples.players), np.iinfo(np.int64).max)
    last = np.zeros(len(samples.players), dtype=np.int64)
    np.minimum.at(first, samples.who, times)
    np.maximum.at(last, samples.who, times)
    return first, last


def _shirt(player: Any) -> int | None:
    """The number on a player's shirt; None for a track that is nobody's."""
    known = str(player.jersey_no)
    return int(known) if known.isdigit() else None


def _states(samples: _Samples) -> Any:
    """State of the game at each frame, as in ``_STATES``, object [F]."""
    state = np.where(samples.alive, "alive", "dead").astype(object)
    begins = np.flatnonzero(np.diff(samples.period, prepend=samples.period[:1] - 1))
    for at in begins[1:]:
        state[at - 1] = "half"
    return state


def _heights(samples: _Samples) -> Heights:
    """The ball's height where it is known."""
    known = np.isfinite(samples.ball[2])
    if not known.any():
        return NO_HEIGHTS
    return Heights(samples.t_ns[known], samples.ball[2][known].astype(np.float32))


def _too_many(match: MatchLog, score: tuple[int, int] | None) -> list[Flaw]:
    """Flaw of more goals of a team than the provider's final score has; none without a score."""
    found = [match.referee.filter(event="goal", team=side).height for side in SIDES]
    if score is None or all(goals <= final for goals, final in zip(found, score, strict=True)):
        return []
    note = (f"{found[0]} : {found[1]} goals were found from the ball, but the provider's score is "
            f"{score[0]} : {score[1]}: some are none")
    return [Flaw("goals inferred", note, sum(found))]


def _end(score: tuple[int, int] | None, match: MatchLog) -> pl.DataFrame:
    """The end of the match with the provider's final score; no row without one."""
    final = [] if score is None else [
        Event(int(match.frames.t_ns.max()), "end", None, *score, "the provider's score")]
    return referee(match.info.match_id, final)
