"""The replay page: a match with its situations and goals, for a browser.

One self-contained HTML file: markup and style from ``page.html``, the scripts of :data:`SCRIPTS`, and the
match as one deflated, base64-encoded payload. The page fetches nothing. All text from data is inside the
payload, or escaped in the title, so data can never become markup.

A page in the scout's folder (:func:`linked`) has neither scripts nor payload. It loads the code of all
replays, the script with the match's payload that the clips load too, and the list of the teams' behaviours.

Payload, after base64 and inflate (zlib): uint32 little-endian length of the JSON; the JSON in
UTF-8 (its keys are written in :func:`_facts`); then for S samples and B bodies

======== ===== ================================================================================
what     bytes meaning
======== ===== ================================================================================
time     4 S   milliseconds since the first sample
joined   S     1 where the sample goes on from the one before without a cut
mask     S B   body by body: SEEN, SUSPECT and HEADED bits
x        2 S B body by body, in quanta of the JSON's ``quantum`` metres
y        2 S B the same
heading  2 S B turns counter-clockwise from +x, in 1 / TURN
======== ===== ================================================================================

time is differences along the samples, from zero; x, y and heading are differences of their differences,
because bodies keep their speed more often than their place. A body that is not SEEN repeats its last value.
All are zigzagged and stored one byte plane after the other, lowest first, because small differences leave
planes of zeros that deflate to nothing.
"""

from __future__ import annotations

import base64
import html
import json
import struct
import zlib
from collections.abc import Sequence
from importlib import resources
from typing import Any

import numpy as np
import polars as pl

from pipeline.arrays import I64, Bools
from pipeline.errors import BadSettings, NotFound
from pipeline.pitch import SCALES, Kind, Pitch
from pipeline.settings import GramSettings
from pipeline.windows import followed
from schemas import SIDES, Passes, Shots, note_on

#: Mask bits: the body has a sample; the sample is an implausible jump; its heading is known.
SEEN, SUSPECT, HEADED = 1, 2, 4

#: Headings are stored in this many steps a turn (0.35 degrees each).
TURN = 1024

#: Samples further apart are never joined, seconds.
GAP_S = 0.5

#: The situations' families and their codes, first to last (paper Table 1).
FAMILIES: tuple[tuple[str, tuple[tuple[int, int], ...]], ...] = (
    ("has the ball", ((1, 11),)),
    ("kicks, loses or leaves it", ((21, 33),)),
    ("to and from the ball", ((34, 47), (67, 68))),
    ("orients", ((57, 57), (78, 78), (108, 108))),
    ("to and from the goals", ((88, 98), (118, 128))),
    ("to and from robots", ((138, 174),)),
    ("does not move", ((184, 184),)),
    ("moves randomly", ((194, 194),)),
)

#: The page's scripts, in their order: the payload read, painting, what can be found, the list of it, mouse
#: and fingers, where the payload comes from, and keys, clicks and time.
SCRIPTS = ("match.js", "draw.js", "find.js", "panel.js", "pointers.js", "load.js", "controls.js")

#: Names of teams that say which colour their robots wear in the leagues of two colours.
WORN = ("blue", "yellow")

#: What a page says whose code is missing; the code removes it.
_LONE = ('<p id="lone">The code of this page is missing: replay.js belongs into the folder above. '
         "Copy the scout's folder as a whole.</p>")

#: Situations this far apart or further are not consecutive, seconds, unless the caller says otherwise.
_APART_S = GramSettings().gap_s


def page(
    match: pl.DataFrame,
    trajectories: pl.DataFrame,
    situations: pl.DataFrame,
    goals: pl.DataFrame,
    referee: pl.DataFrame,
    pitch: Pitch,
    *,
    hz: float = 20.0,
    passes: pl.DataFrame | None = None,
    shots: pl.DataFrame | None = None,
    told: Sequence[tuple[int, str]] = (),
    gap_s: float = _APART_S,
) -> str:
    """The page as HTML; the same tables give the same page.

    The page shows the first sample of each 1 / ``hz`` seconds. Errors of rounding are at most half a
    quantum in position (0.5 mm; 2D: 2.5 mm), 0.5 ms in time, and 0.18 degrees in heading. Between two
    samples of one stretch of play the page moves bodies evenly. Missing bodies and gaps stay missing.

    Args:
        match: schema Matches, one row.
        trajectories: schema Trajectories, of that match; at least one row.
        situations: schema Situations, of that match.
        goals: schema Goals, of that match.
        referee: schema Referee, of that match.
        pitch: the field of play.
        hz: most samples shown a second, in (0, 1000].
        passes: schema Passes, of that match; None: the page lists none.
        shots: schema Shots, of that match; None: the page lists none.
        told: the commentary's sentences with their times, ns since the first sample, by time.
        gap_s: two situations of a robot at least so far apart are not consecutive, seconds.

    Raises:
        NotFound: if there is nothing to show.
        BadSettings: if ``hz`` is out of its bounds.
        SchemaMismatch: if situations of one robot overlap.
    """
    facts, packed = payload(match, trajectories, situations, goals, referee, pitch, hz=hz, passes=passes,
                            shots=shots, told=told, gap_s=gap_s)
    return _filled(facts["home"], facts["away"], packed, source="", allowed="'unsafe-inline'",
                   code=f"<script>\n{script()}\n</script>")


def linked(match_id: str, home: str, away: str, *, up: str = "../") -> str:
    """The page of a match whose payload is in the script ``data/ID.js`` of the folder to which ``up`` leads.

    That script calls ``scoutMatch(ID, payload)``. ``known.js`` beside ``data`` calls
    ``scoutKnown(list of [league, team, ids of behaviours])``. The code is ``replay.js`` (:func:`script`).

    The page leads back to ``matches/ID.html`` and ``index.html`` of that folder.

    Args:
        match_id: id of the match.
        home: name of the home team, for the title.
        away: name of the away team.
        up: leads from the page to that folder.
    """
    source = f' data-match="{html.escape(match_id)}" data-up="{html.escape(up)}"'
    match, league = (html.escape(f"{up}{page}.html") for page in (f"matches/{match_id}", "index"))
    back = f'  <nav aria-label="pages"><a href="{match}">the match</a> <a href="{league}">league</a></nav>\n'
    return _filled(home, away, "", source=source, allowed="'self' file:", back=back,
                   code=f'{_LONE}\n<script src="{html.escape(up)}replay.js"></script>')


def script() -> str:
    """The page's code; in the scout's folder it is the file ``replay.js``."""
    return "\n".join(['"use strict";', *(asset(name) for name in SCRIPTS)])


def _filled(
    home: str, away: str, packed: str, *, source: str, allowed: str, code: str, back: str = ""
) -> str:
    """The page with its blanks filled.

    ``allowed`` scripts run, ``source`` says whence the match comes, ``back`` leads to pages about it.
    """
    blank = asset("page.html").replace("{{code}}", code).replace("{{allowed}}", allowed)
    blank = blank.replace("{{back}}", back).replace("{{source}}", source).replace("{{payload}}", packed)
    # the title goes in last, so that nothing in it is taken for a blank to fill
    return blank.replace("{{title}}", html.escape(f"{home} – {away} · Pitchlore replay"))


def payload(
    match: pl.DataFrame,
    trajectories: pl.DataFrame,
    situations: pl.DataFrame,
    goals: pl.DataFrame,
    referee: pl.DataFrame,
    pitch: Pitch,
    *,
    hz: float = 20.0,
    passes: pl.DataFrame | None = None,
    shots: pl.DataFrame | None = None,
    told: Sequence[tuple[int, str]] = (),
    gap_s: float = _APART_S,
) -> tuple[dict[str, Any], str]:
    """The facts of a match, and the payload (see the module); arguments and errors as for :func:`page`."""
    if not 0 < hz <= 1000:
        raise BadSettings(f"hz cannot be {hz}", where="replay", next_step="Choose one in (0, 1000]")
    if trajectories.is_empty():
        name = str(match["match_id"][0])
        raise NotFound("has no trajectories", where=name, next_step="Run `pitchlore run` on it first")
    bodies = _bodies(trajectories)
    shown = _shown(trajectories, hz)
    quantum = _quantum(pitch)
    facts = _facts(match, bodies, shown, situations, goals, referee, pitch, gap_s) | {
        "quantum": quantum, "told": [(round(t_ns / 1e6), text) for t_ns, text in told],
        "passes": _passes(Passes.empty() if passes is None else passes),
        "shots": _shots(Shots.empty() if shots is None else shots)}
    text = json.dumps(facts, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    raw = struct.pack("<I", len(text)) + text + _samples(trajectories, bodies, shown, quantum)
    return facts, base64.b64encode(zlib.compress(raw)).decode("ascii")


def asset(name: str) -> str:
    """The text of a file of the page."""
    return resources.files(__name__).joinpath(name).read_text(encoding="utf-8")


def _bodies(trajectories: pl.DataFrame) -> pl.DataFrame:
    """Every body of the match: team, robot and its index ``body``; the ball, home, then away."""
    found = trajectories.select("team", "robot").unique().sort("team", "robot")
    return found.with_columns(pl.col("team").cast(pl.String)).with_row_index("body")


def _shown(trajectories: pl.DataFrame, hz: float) -> pl.DataFrame:
    """The frames to show: frame, t_ns, segment, ``ms``, ``joined``, and the index ``sample``."""
    slot_ns = 1e9 / hz
    gap_ns = int(GAP_S * 1e9)
    return (
        trajectories.group_by("frame")
        .agg(pl.col("t_ns").first(), pl.col("segment").max())
        .sort("t_ns", "frame")
        # half a microsecond of grace for times that were rounded down from the slot's edge
        .unique(((pl.col("t_ns") + 500) / slot_ns).floor(), keep="first", maintain_order=True)
        .with_columns(
            ms=_ms("t_ns"),
            joined=(
                pl.col("segment").eq_missing(pl.col("segment").shift())
                & (pl.col("t_ns").diff() <= gap_ns).fill_null(value=False)
            ),
        )
        .with_row_index("sample")
    )


def _quantum(pitch: Pitch) -> float:
    """Metres a step of int16, so that bodies up to a pitch length from the centre fit."""
    return next(step for step in (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1) if 32767 * step >= pitch.length)


def _samples(trajectories: pl.DataFrame, bodies: pl.DataFrame, shown: pl.DataFrame, quantum: float) -> bytes:
    """The binary half of the payload."""
    rows = (
        trajectories.with_columns(pl.col("team").cast(pl.String))
        .join(bodies, on=["team", "robot"], nulls_equal=True)
        .join(shown.select("frame", "sample"), on="frame")
    )
    cell = (rows["body"].to_numpy(), rows["sample"].to_numpy())
    shape = (len(bodies), len(shown))
    limit = 32767 * quantum

    headed = rows["theta"].is_not_null() & rows["theta"].is_not_nan().fill_null(value=False)
    mask = np.zeros(shape, np.uint8)
    mask[cell] = SEEN + SUSPECT * rows["suspect"].to_numpy() + HEADED * headed.to_numpy()

    channels = []
    for name, scale, bit in (("x", quantum, SEEN), ("y", quantum, SEEN), ("theta", 2 * np.pi / TURN, HEADED)):
        values = np.zeros(shape)
        values[cell] = rows[name].fill_null(0.0).fill_nan(0.0).cast(pl.Float64).clip(-limit, limit).to_numpy()
        steps = _held(np.rint(values / scale).astype(np.int64), mask & bit > 0)
        moves = np.diff(steps, axis=1, prepend=0)
        if name == "theta":  # the short way round
            moves = (moves + TURN // 2) % TURN - TURN // 2
        channels.append(_planes(np.diff(moves, axis=1, prepend=0).ravel(), 2))
    time = _planes(np.diff(shown["ms"].to_numpy(), prepend=0), 4)
    joined = shown["joined"].to_numpy().astype(np.uint8).tobytes()
    return b"".join([time, joined, mask.tobytes(), *channels])


def _held(values: I64, known: Bools) -> I64:
    """``values`` [B, S], the unknown ones replaced by the last known one; zero before the first."""
    last = np.maximum.accumulate(np.where(known, np.arange(values.shape[1]), -1), axis=1)
    return np.where(last >= 0, np.take_along_axis(values, np.maximum(last, 0), axis=1), 0)


def _planes(differences: I64, width: int) -> bytes:
    """Differences [N] modulo 256 ** width, zigzagged, as ``width`` byte planes."""
    signed = differences.astype(f"<i{width}").astype(np.int64)
    zigzag = ((signed << 1) ^ (signed >> 63)).astype(f"<u{width}")
    return zigzag.view(np.uint8).reshape(-1, width).T.tobytes()


def _facts(
    match: pl.DataFrame,
    bodies: pl.DataFrame,
    shown: pl.DataFrame,
    situations: pl.DataFrame,
    goals: pl.DataFrame,
    referee: pl.DataFrame,
    pitch: Pitch,
    gap_s: float,
) -> dict[str, Any]:
    """The JSON half of the payload; all times are milliseconds since the first sample."""
    row = match.row(0, named=True)
    kept = ("match_id", "home", "away", "complete", "incomplete_reason")
    scales = SCALES[pitch.kind]
    scores = referee.drop_nulls(["score_home", "score_away"]).sort("t_ns", maintain_order=True)
    play = shown.drop_nulls("segment").group_by("segment", maintain_order=True)
    stretches = play.agg(pl.col("ms").min().alias("start"), pl.col("ms").max().alias("end"))
    events = referee.sort("t_ns", maintain_order=True)
    names = situations.select("code", "name").unique().sort("code")
    return {name: row[name] for name in kept} | {
        "note": note_on(row["home"], row["away"]),
        "worn": _worn(row["home"], row["away"], pitch),
        "pitch": pitch.model_dump(mode="json"),
        "robot_radius": scales.robot_radius,
        "ball_radius": scales.ball_radius,
        "gap": int(GAP_S * 1e3),
        "turn": TURN,
        "samples": len(shown),
        "bodies": bodies.select("team", "robot").rows(),
        "play": stretches.select("start", "end").rows(),
        "scores": scores.select(_ms("t_ns"), "score_home", "score_away").rows(),
        "goals": goals.sort("t_ns").select(_ms("t_ns"), "team", "robot", "kind").rows(),
        "events": events.select(_ms("t_ns"), "event", "team", "note").rows(),
        "families": FAMILIES,
        "names": {str(code): name for code, name in names.rows()},
        "situations": _situations(situations, bodies, gap_s),
    }


def _worn(home: str, away: str, pitch: Pitch) -> dict[str, str] | None:
    """The colour that each side wears, if the league has two and the teams are named by them; else None."""
    names = [name.strip().lower() for name in (home, away)]
    known = pitch.kind in (Kind.VSSS, Kind.SSL) and sorted(names) == sorted(WORN)
    return dict(zip(SIDES, names, strict=True)) if known else None


def _passes(passes: pl.DataFrame) -> list[tuple[Any, ...]]:
    """Of each pass: times of pass and receipt, team, robot, receiver, direction, whether it is through."""
    return passes.sort("t_ns").select(
        _ms("t_ns"), _ms("received_ns"), pl.col("team").cast(pl.String), "robot", "receiver",
        pl.col("direction").cast(pl.String), "through").rows()


def _shots(shots: pl.DataFrame) -> list[tuple[Any, ...]]:
    """Of each shot: time, team, robot, outcome, and distance in metres, to the centimetre."""
    return shots.sort("t_ns").select(
        _ms("t_ns"), pl.col("team").cast(pl.String), "robot", pl.col("outcome").cast(pl.String),
        pl.col("distance").cast(pl.Float64).round(2)).rows()


def _situations(situations: pl.DataFrame, bodies: pl.DataFrame, gap_s: float) -> dict[str, list[Any]]:
    """Columns of equal length, sorted by body and start; strength in percent.

    ``after`` is how long after the end of the body's situation before (of its first: after zero) one begins,
    ``lasts`` how long it lasts, ms. ``follows`` is 1 where a situation follows the one before without a
    break, as in the table sequences.
    """
    ordered = followed(situations.sort("team", "robot", "start_ns"), gap_s)
    return (
        ordered.with_columns(pl.col("team").cast(pl.String))
        .join(bodies, on=["team", "robot"])
        .sort("body", "start_ns")
        .select(
            "body",
            "code",
            (_ms("start_ns") - _ms("end_ns").shift(1).over("body").fill_null(0)).alias("after"),
            (_ms("end_ns") - _ms("start_ns")).alias("lasts"),
            (pl.col("strength") * 100).round().cast(pl.Int8).alias("strength"),
            "target",
            pl.col("role").cast(pl.String),
            pl.col("follows").cast(pl.Int8),
        )
        .to_dict(as_series=False)
    )


def _ms(column: str) -> pl.Expr:
    return (pl.col(column) / 1e6).round().cast(pl.Int64)
