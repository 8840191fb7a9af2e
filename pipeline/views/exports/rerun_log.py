"""A match for Rerun's viewer; the only module that imports rerun (extra ``rerun``).

The recording has a blueprint of its own: the pitch from above, a lane of situations for each robot, and the
referee's events. Archetypes: ``LineStrips2D`` the pitch, ``Points2D`` a body with its number, ``Arrows2D``
its heading, ``StateChange`` what a robot does, ``TextLog`` the referee's events. Rerun's y points down in
a 2D view, so ours is turned. Two files of one match differ in the ids that Rerun gives their chunks.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import polars as pl
import pyarrow as pa  # a list with None becomes text in Rerun, an Arrow null ends a lane
import rerun as rr
import rerun.blueprint as rrb

from pitchlore.pipeline.game.pitch import SCALES
from pitchlore.pipeline.views.exports.content import BALL, ExportedMatch, places
from pitchlore.pipeline.views.exports.drawing import COLOURS, outline

#: The timeline: time since the first sample.
MATCH = "match"
#: Time without a sample after which a body is taken off the pitch, ns.
_AWAY_NS = 500_000_000


def recording(content: ExportedMatch) -> bytes:
    """The match as a recording (.rrd) with its blueprint."""
    info = content.log.info
    stream = rr.RecordingStream("pitchlore", recording_id=info.match_id, send_properties=False)
    with tempfile.TemporaryDirectory(prefix="pitchlore-") as folder:
        path = Path(folder) / "match.rrd"
        stream.save(path, default_blueprint=_blueprint(content))
        _pitch(stream, content)
        _bodies(stream, content)
        _situations(stream, content)
        _referee(stream, content)
        stream.flush()
        stream.disconnect()
        return path.read_bytes()


def _blueprint(content: ExportedMatch) -> rrb.Blueprint:
    """The pitch beside the events, over the lanes of situations."""
    pitch = content.log.info.pitch
    x, y = 0.5 * pitch.length + 2 * pitch.goal_depth, 0.54 * pitch.width
    above = rrb.Spatial2DView(
        origin="/pitch", name="pitch", background=[22, 60, 38],
        visual_bounds=rrb.VisualBounds2D(x_range=[-x, x], y_range=[-y, y]),
    )
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                above, rrb.TextLogView(origin="/referee", name="referee"), column_shares=[3, 1]),
            rrb.StateTimelineView(origin="/situations", name="situations"), row_shares=[2, 1],
        ),
        rrb.TimePanel(timeline=MATCH), collapse_panels=True,
    )


def _pitch(stream: rr.RecordingStream, content: ExportedMatch) -> None:
    lines = [[(x, -y) for x, y in line] for line in outline(content.log.info.pitch)]
    width = 0.001 * content.log.info.pitch.length
    stream.log("pitch/lines", rr.LineStrips2D(lines, colors=COLOURS["chalk"], radii=width), static=True)


def _bodies(stream: rr.RecordingStream, content: ExportedMatch) -> None:
    """Places and headings over time; a body that is away has no point meanwhile."""
    scales = SCALES[content.log.info.pitch.kind]
    radius = max(scales.robot_radius, 0.009 * content.log.info.pitch.length)
    for (team, player), (t_ns, found) in sorted(places(content.bodies()).items(), key=str):
        ball = player is None
        path = f"pitch/{BALL}" if ball else f"pitch/{team}/{player}"
        stream.log(path, rr.Points2D.from_fields(
            colors=COLOURS[team], radii=0.6 * radius if ball else radius, draw_order=2.0 if ball else 1.0,
            labels=None if ball else [str(player)], show_labels=not ball,
        ), static=True)
        if ball:
            path_of_heading = None
        else:
            path_of_heading = f"{path}/heading"
            stream.log(path_of_heading, rr.Arrows2D.from_fields(colors=COLOURS["chalk"], radii=0.15 * radius),
                       static=True)
        away = np.flatnonzero(np.diff(t_ns) > _AWAY_NS)
        gone = t_ns[away] + _AWAY_NS // 2
        times = np.concatenate([t_ns, gone])
        order = np.argsort(times, kind="stable")
        counts = np.concatenate([np.ones(len(t_ns), dtype=int), np.zeros(len(gone), dtype=int)])[order]
        when = rr.TimeColumn(MATCH, duration=times[order].astype("timedelta64[ns]"))
        points = np.column_stack([found[:, 0], -found[:, 1]])
        stream.send_columns(path, [when], rr.Points2D.columns(positions=points).partition(counts))
        known = np.isfinite(found[:, 3])
        if path_of_heading is not None and known.any():
            turn = found[known, 3]
            arrows = 1.8 * radius * np.column_stack([np.cos(turn), -np.sin(turn)])
            stream.send_columns(
                path_of_heading,
                [rr.TimeColumn(MATCH, duration=t_ns[known].astype("timedelta64[ns]"))],
                rr.Arrows2D.columns(vectors=arrows, origins=points[known]),
            )


def _situations(stream: rr.RecordingStream, content: ExportedMatch) -> None:
    """Situations of each robot, as a lane of states; no state where it does nothing that has a name."""
    done = content.match.situations.with_columns(pl.col("team").cast(pl.String))
    by = done.sort("team", "robot", "start_ns")
    for (team, robot), rows in by.partition_by(["team", "robot"], as_dict=True, maintain_order=True).items():
        starts, ends = rows["start_ns"].to_numpy(), rows["end_ns"].to_numpy()
        labels = [f"{code:03d} {name}" for code, name in rows.select("code", "name").iter_rows()]
        stops = np.append(ends[:-1] < starts[1:], values=True)
        times = np.concatenate([starts, ends[stops]])
        order = np.argsort(times, kind="stable")
        states: list[str | None] = [*labels, *[None] * int(stops.sum())]
        when = rr.TimeColumn(MATCH, duration=times[order].astype("timedelta64[ns]"))
        stream.send_columns(
            f"situations/{team}/{robot}", [when],
            rr.StateChange.columns(state=pa.array([states[i] for i in order], type=pa.string())))


def _referee(stream: rr.RecordingStream, content: ExportedMatch) -> None:
    heard = content.log.referee.sort("t_ns", maintain_order=True)
    if heard.is_empty():
        return
    texts = [
        " ".join(str(word) for word in (event, team, None if home is None else f"{home} : {away}") if word)
        for event, team, home, away in heard.select("event", "team", "score_home", "score_away").iter_rows()
    ]
    when = rr.TimeColumn(MATCH, duration=heard["t_ns"].to_numpy().astype("timedelta64[ns]"))
    stream.send_columns("referee", [when], rr.TextLog.columns(text=texts, level=["INFO"] * len(texts)))
