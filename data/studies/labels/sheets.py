"""Pictures of the moments for labellers: positions and motion, and nothing that the code makes of them."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import polars as pl
from labels.agreement import ROW
from labels.moments import Recording
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke

from pitchlore.pipeline.game.pitch import SCALES, Kind, Pitch

mpl.use("Agg")
#: Colours of the teams: (robot, its past).
_TEAMS = {"home": "#1f6fd0", "away": "#d9541e"}
_BALL = "#111111"
#: Half the length of the film, s, by league; and the times of the close-ups.
SPAN_S = {Kind.VSSS: 1.0, Kind.SSL: 1.0, Kind.SIM2D: 1.5}
_CLOSE = (-0.6, -0.4, -0.2, 0.0, 0.2, 0.4)
_ROLE = {"goalkeeper": "g", "midfield": "m", "striker": "s"}
#: Robots on one picture of dials.
_DIALS = 24


def pictures(folder: Path, labelled: Path, recorded: dict[str, Recording]) -> None:
    """Draw all moments, and the turns of the robots that a labeller said to stand.

    Args:
        folder: gets the pictures, sheets/NNN.png and dials/NNN.png.
        labelled: folder of moments.csv and the labels.
        recorded: recordings by name; moments of others are not drawn.
    """
    moments = pl.read_csv(labelled / "moments.csv").filter(pl.col("recording").is_in(list(recorded)))
    for part in ("sheets", "dials"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    for moment, name, t_ns in moments.select("moment", "recording", "t_ns").iter_rows():
        sheet(recorded[name], t_ns, f"moment {moment}", folder / "sheets" / f"{moment:03d}.png")
    shown = standing(labelled).join(moments, on="moment").sort("moment", "team", "robot")
    cases = [
        (recorded[name], t_ns, team, robot, f"{moment} {team} {robot}")
        for moment, team, robot, name, t_ns in shown.select(*ROW, "recording", "t_ns").iter_rows()]
    for first in range(0, len(cases), _DIALS):
        dials(cases[first:first + _DIALS], folder / "dials" / f"{first // _DIALS + 1:03d}.png")


def standing(labelled: Path) -> pl.DataFrame:
    """The robots that a labeller said to stand by the sheet alone: columns of ROW."""
    labels = [
        pl.read_csv(labelled / f"labels-{who}.csv", schema_overrides={"also": pl.String}) for who in "ab"]
    return pl.concat(labels).filter(pl.coalesce("first", "code") == 184).select(ROW).unique()


def sheet(recording: Recording, t_ns: int, title: str, path: Path) -> None:
    """Draw one moment: the whole pitch with the paths of all bodies, and close-ups of the ball.

    On the pitch, a robot stands where it is at the moment. Its past path is a solid line, its future path a
    dotted one, with a tick each 0.2 s. The line from its centre is its heading. The letter after its number
    is its role: goalkeeper, midfield, striker. The film shows one stretch of play: nothing from before a
    restart.
    """
    kind = recording.pitch.kind
    span = round(SPAN_S[kind] * 1e9)
    play = recording.table.filter(pl.col("t_ns") == t_ns)["segment"].first()
    film = recording._replace(table=recording.table.filter(pl.col("segment") == play, ~pl.col("suspect")))
    seen = film.table.filter(pl.col("t_ns").is_between(t_ns - span, t_ns + span))
    figure = Figure(figsize=(11.2, 10.7), dpi=100)
    grid = figure.add_gridspec(2, 6, height_ratios=(8.4, 2.0), hspace=0.05, wspace=0.03,
                               left=0.005, right=0.995, top=0.97, bottom=0.005)
    pitch = figure.add_subplot(grid[0, :])
    figure.suptitle(title, fontsize=10, y=0.995)
    _pitch(pitch, recording.pitch)
    for (team, robot), body in sorted(seen.group_by("team", "robot"), key=lambda kv: str(kv[0])):
        _path(pitch, body.sort("t_ns"), str(team), robot, t_ns, kind)
    for column, offset in enumerate(_CLOSE):
        _close_up(figure.add_subplot(grid[1, column]), film, t_ns, offset)
    figure.savefig(path)


def _pitch(axes: Axes, pitch: Pitch, margin: float = 0.02) -> None:
    half, side, goal = pitch.length / 2, pitch.width / 2, pitch.goal_width / 2
    axes.add_patch(Rectangle((-half, -side), pitch.length, pitch.width, fill=False, lw=1.2, ec="#777"))
    axes.plot((0, 0), (-side, side), lw=0.6, c="#bbb")
    for end, colour in ((-1, _TEAMS["home"]), (1, _TEAMS["away"])):
        axes.plot((end * half,) * 2, (-goal, goal), lw=5, c=colour, solid_capstyle="butt")
    axes.set_xlim(
        -half - pitch.goal_depth - margin * pitch.length, half + pitch.goal_depth + margin * pitch.length)
    axes.set_ylim(-side - margin * pitch.width, side + margin * pitch.width)
    axes.set_aspect("equal")
    axes.axis("off")


def _at(body: pl.DataFrame, t_ns: int, most_ns: int = 130_000_000) -> dict[str, float] | None:
    """The body's row nearest to a time."""
    if body.is_empty():
        return None
    off = np.abs(body["t_ns"].to_numpy() - t_ns)
    return body.row(int(off.argmin()), named=True) if off.min() <= most_ns else None


def _path(axes: Axes, body: pl.DataFrame, team: str, robot: int | None, t_ns: int, kind: Kind) -> None:
    colour = _TEAMS.get(team, _BALL)
    x, y, t = (body[name].to_numpy() for name in ("x", "y", "t_ns"))
    for part, style, width in ((t <= t_ns, "-", 2.0), (t >= t_ns, ":", 1.6)):
        axes.plot(x[part], y[part], style, lw=width, c=colour, alpha=0.65, zorder=2)
    ticks = np.arange(-2_000_000_000, 2_000_000_001, 200_000_000) + t_ns
    for tick in ticks[(ticks >= t[0]) & (ticks <= t[-1]) & (ticks != t_ns)]:
        axes.plot(
            np.interp(tick, t, x), np.interp(tick, t, y), ".", ms=4 if tick < t_ns else 3, c=colour, zorder=3)
    now = _at(body, t_ns)
    if now is None:
        return
    if team == "ball":
        axes.plot(now["x"], now["y"], "o", ms=7, mfc="white", mec="black", mew=2, zorder=6)
        return
    least = {Kind.VSSS: 0.0, Kind.SSL: 0.13, Kind.SIM2D: 0.75}[kind]
    radius = max(SCALES[kind].robot_radius, least)
    _robot(axes, now, radius, colour, f"{robot}{_ROLE.get(str(now['role']), '')}", 9)
    for offset in (-500_000_000, 500_000_000):
        other = _at(body, t_ns + offset)
        if other is not None and other["theta"] is not None:
            axes.plot((other["x"], other["x"] + 0.8 * radius * np.cos(other["theta"])),
                      (other["y"], other["y"] + 0.8 * radius * np.sin(other["theta"])),
                      c=colour, lw=1, alpha=0.6, zorder=3)


def _robot(axes: Axes, now: dict[str, float], radius: float, colour: str, label: str, size: float) -> None:
    x, y, theta = now["x"], now["y"], now["theta"]
    axes.add_patch(Circle((x, y), radius, fc=colour, ec="white", lw=0.8, alpha=0.85, zorder=4))
    if theta is not None:
        axes.plot((x, x + 1.7 * radius * np.cos(theta)), (y, y + 1.7 * radius * np.sin(theta)),
                  c="black", lw=2, zorder=5)
    edge = radius * axes.transData.transform((1, 0))[0] - radius * axes.transData.transform((0, 0))[0]
    axes.annotate(
        label, (x, y), (0, edge * 72 / axes.figure.dpi + 2), textcoords="offset points", ha="center",
        va="bottom", fontsize=size, color=colour, weight="bold", zorder=9,
        path_effects=[withStroke(linewidth=2.5, foreground="white")])


def _close_up(axes: Axes, recording: Recording, t_ns: int, offset: float) -> None:
    """Draw what is around the ball some time before or after the moment."""
    kind, table = recording.pitch.kind, recording.table
    at = t_ns + round(offset * 1e9)
    near = table.filter(pl.col("t_ns").is_between(at - 130_000_000, at + 130_000_000))
    reach = {Kind.VSSS: 0.28, Kind.SSL: 1.0, Kind.SIM2D: 6.0}[kind]
    ball = _at(near.filter(pl.col("team") == "ball"), at)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(f"{offset:+.1f} s" if offset else "the moment", fontsize=10, pad=2,
                   weight="normal" if offset else "bold")
    axes.set_aspect("equal")
    if ball is None:
        axes.text(0.5, 0.5, "not in the film", ha="center", transform=axes.transAxes)
        return
    _pitch(axes, recording.pitch)
    axes.axis("on")
    axes.set_xlim(ball["x"] - reach, ball["x"] + reach)
    axes.set_ylim(ball["y"] - reach, ball["y"] + reach)
    scales = SCALES[kind]
    for (team, robot), body in sorted(near.group_by("team", "robot"), key=lambda kv: str(kv[0])):
        now = _at(body, at)
        if (
            team != "ball" and now is not None and abs(now["x"] - ball["x"]) < reach
            and abs(now["y"] - ball["y"]) < reach
        ):
            if kind == Kind.SIM2D:
                axes.add_patch(
                    Circle(
                        (now["x"], now["y"]), scales.contact, fill=False, ls=":", ec=_TEAMS[str(team)],
                        zorder=3)
                )
            _robot(axes, now, scales.robot_radius, _TEAMS[str(team)], str(robot), 9)
    axes.add_patch(
        Circle((ball["x"], ball["y"]), scales.ball_radius, fc="white", ec="black", lw=1.5, zorder=8))


def dials(cases: list[tuple[Recording, int, str, int, str]], path: Path) -> None:
    """Draw how robots turn around a moment, as dials: a sheet hides the turns of robots that stand.

    The seven hands of a dial are the robot's headings from 0.6 s before the moment (yellow) to 0.6 s after it
    (violet); the thick one is the moment's. The letters on the rim are where the ball (B), the own goal (O)
    and the adversary's goal (A) are from there.

    Args:
        cases: recording, time of the moment, team, robot, title; at most 24.
        path: the picture's.
    """
    figure = Figure(figsize=(11.2, 8.0), dpi=100)
    grid = figure.add_gridspec(
        4, 6, hspace=0.12, wspace=0.02, left=0.005, right=0.995, top=0.97, bottom=0.005)
    for place, (film, t_ns, team, robot, title) in enumerate(cases):
        axes = figure.add_subplot(grid[place // 6, place % 6])
        axes.set_title(title, fontsize=10, pad=1)
        axes.set_aspect("equal")
        axes.axis("off")
        axes.set_xlim(-1.35, 1.35)
        axes.set_ylim(-1.35, 1.35)
        axes.add_patch(Circle((0, 0), 1.0, fill=False, ec="#999"))
        near = film.table.filter(pl.col("t_ns").is_between(t_ns - 800_000_000, t_ns + 800_000_000))
        body = near.filter(pl.col("team") == team, pl.col("robot") == robot).sort("t_ns")
        for step in range(-3, 4):
            then = _at(body, t_ns + step * 200_000_000)
            if then is not None and then["theta"] is not None:
                colour = mpl.colormaps["plasma_r"](0.08 + 0.84 * (step + 3) / 6)
                axes.plot(
                    (0, np.cos(then["theta"])), (0, np.sin(then["theta"])), c=colour, lw=2 if step else 5)
        now, ball = _at(body, t_ns), _at(near.filter(pl.col("team") == "ball").sort("t_ns"), t_ns)
        side = 1 if team == "home" else -1
        goal = film.pitch.goal_x * side
        for letter, point in (
            ("B", ball and (ball["x"], ball["y"])), ("O", (-goal, 0.0)), ("A", (goal, 0.0)),
        ):
            if now and point:
                turn = np.arctan2(point[1] - now["y"], point[0] - now["x"])
                axes.text(
                    1.18 * np.cos(turn), 1.18 * np.sin(turn), letter, ha="center", va="center", fontsize=11,
                    weight="bold" if letter == "B" else "normal")
    figure.savefig(path)
