"""The tables options and clues of a match."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Kind, Pitch
from pitchlore.pipeline.game.tactics.executors.actions import (
    ADVERSARY_GOAL,
    OPPONENT,
    OWN_GOAL,
    STAND,
    THING,
    VERB,
)
from pitchlore.pipeline.numbers.arrays import F32, I8, I16, I64
from pitchlore.pipeline.numbers.trees import Trees, logits
from pitchlore.pipeline.settings import OptionSettings
from pitchlore.pipeline.stages.options.habits import by_habits
from pitchlore.pipeline.stages.options.robots import RobotTraits
from pitchlore.pipeline.stages.options.windows import Bodies, OptionWindows, bodies, windows_of
from pitchlore.schemas import ROLES, SIDES, Clues, Options
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.sights import SIGHT

#: Cells of what is seen within a role: the ball's distance, whether the robot is behind it, the third of the
#: pitch that it is in, whether a team-mate is nearer.
_CELLS = (4, 2, 3, 2)
_NEVER = (1 << 63) - 1
_SIGHTS = {name: place for place, name in enumerate(SIGHT)}


def options(
    trajectories: pl.DataFrame, pitch: Pitch, settings: OptionSettings, trees: Trees,
    logged: pl.DataFrame | None = None, teams: Collection[str] = SIDES,
) -> tuple[pl.DataFrame, pl.DataFrame, dict[str, RobotTraits]]:  # fmt: skip
    """Recover the options of a match's robots from their poses.

    Robots of other leagues than VSSS drive in another way than executors do: their matches have no rows.

    Args:
        trajectories: rows of schema Trajectories of one match.
        pitch: pitch of the match.
        settings: windows, robots and habits.
        trees: the ratios of these settings, :func:`pipeline.stages.options.likelihood.shipped_ratios`.
        logged: options that teams logged themselves (:func:`logged_options`): only the column ``logged`` is
            from it.
        teams: the sides whose options are recovered.

    Returns:
        Rows of schema Options and of schema Clues; and the robots of each side, as they were assumed.
    """
    robots = dict[str, RobotTraits]()
    if pitch.kind != Kind.VSSS or trajectories.is_empty():
        return Options.empty(), Clues.empty(), robots
    match = bodies(trajectories, settings.sample_s)
    rows, clues = [Options.empty()], [Clues.empty()]
    for team, numbers in enumerate(match.numbers):
        if SIDES[team] not in teams:
            continue
        own = windows_of(match, team, pitch, settings)
        if not len(own.first):
            continue
        robots[SIDES[team]] = own.robots
        ratios = ratios_of(own.features, trees)
        shared = _columns(trajectories["match_id"][0], match, own, team)
        clues.append(shared.with_columns(
            pl.Series("sight", own.sight).arr.eval(pl.element().fill_nan(None)), ratios=pl.Series(ratios),
        ).select(list(Clues.dtypes())).cast(pl.Schema(Clues.dtypes())))
        known = _logged(shared, logged)
        both = numbers, match.numbers[1 - team]
        rows.append(_joined(known, own, ratios, both, team, pitch, settings))
    return pl.concat(rows), pl.concat(clues), robots


def ratios_of(features: F32, trees: Trees) -> F32:
    """Logarithms of ratios, float32 [W, A], from float32 [W, A, F].

    To look at options that drive alike once only was slower than to look at all, a tree after the other.
    """
    flat = logits(trees, features.reshape(-1, features.shape[2]))
    return flat.reshape(features.shape[:2]).astype(np.float32)


def cells_of(sight: F32, role: I64, pitch: Pitch) -> tuple[I64, I64]:
    """The cell of what each robot sees, int64 [W], and the role of each cell, int64 [C].

    Args:
        sight: float32 [W, 30].
        role: int64 [W], indices in ROLES.
        pitch: its thirds, and its kind's distances.
    """
    scales = SCALES[pitch.kind]
    digits = (
        np.digitize(sight[:, _SIGHTS["ball_distance"]], [scales.contact * 1.3, scales.close, scales.near]),
        sight[:, _SIGHTS["behind"]] > 0,
        np.digitize(sight[:, _SIGHTS["ball_x"]], [-pitch.goal_x / 3, pitch.goal_x / 3]),
        sight[:, _SIGHTS["nearer"]] > 0,
    )
    within = np.ravel_multi_index(tuple(np.asarray(digit, dtype=np.int64) for digit in digits), _CELLS)
    each = int(np.prod(_CELLS))
    return role * each + within, np.repeat(np.arange(len(ROLES)), each)


def _columns(match_id: str, match: Bodies, own: OptionWindows, team: int) -> pl.DataFrame:
    """The columns that windows have in both tables, and ``place``, the robot's row."""
    numbers = np.array(match.numbers[team], dtype=np.int16)
    return pl.DataFrame({
        "robot": numbers[own.robot - 1],
        "role": pl.Series(ROLES).gather(pl.Series(own.role)).cast(pl.Enum(ROLES)),
        "start_ns": match.t_ns[own.first], "end_ns": match.t_ns[own.first + own.samples],
        "segment": match.segment[own.first], "place": own.robot,
    }).with_columns(match_id=pl.lit(match_id), team=pl.lit(SIDES[team], dtype=pl.Enum(SIDES)))


def logged_options(decisions: pl.DataFrame, changes: npt.NDArray[np.void]) -> pl.DataFrame:
    """Options that teams logged themselves: team, robot, t_ns, over_ns and logged, in the order of t_ns.

    Args:
        decisions: rows of schema Decisions: they count for a team that logged no changes. A behaviour of
            several codes does not say when it goes on to the next: ``logged`` is null there.
        changes: OPTION_DTYPE [O], changes of options (``MatchLog.options``). The last of a robot never ends.
    """
    codes = pl.col("behaviour_id").str.split("-").list
    chosen = decisions.filter("chosen").select(
        pl.col("team").cast(pl.Enum(SIDES)), pl.col("robot").cast(pl.Int16), "t_ns", over_ns="end_ns",
        logged=pl.when(codes.len() == 2).then(codes.last()).cast(pl.Int16))
    told = pl.DataFrame(changes).select(
        pl.col("team").replace_strict(dict(enumerate(SIDES)), return_dtype=pl.Enum(SIDES)), "robot", "t_ns",
        over_ns=pl.col("t_ns").shift(-1, fill_value=_NEVER).over("team", "robot"),
        logged=pl.col("option").replace(0, None))
    return pl.concat([told, chosen.join(told, on="team", how="anti")]).sort("t_ns", maintain_order=True)


def _logged(shared: pl.DataFrame, made: pl.DataFrame | None) -> pl.DataFrame:
    """The windows with ``logged``: the code that the team logged for the window's middle."""
    middle = ((pl.col("start_ns") + pl.col("end_ns")) // 2).alias("middle")
    if made is None or made.is_empty():
        return shared.with_columns(logged=pl.lit(None, dtype=pl.Int16))
    found = shared.with_columns(middle).with_row_index("window").sort("middle").join_asof(
        made, left_on="middle", right_on="t_ns", by=["team", "robot"], check_sortedness=False).sort("window")
    return found.with_columns(
        logged=pl.when(pl.col("over_ns") > pl.col("middle")).then("logged"),
    ).drop("window", "middle", "t_ns", "over_ns")


def _joined(
    shared: pl.DataFrame, own: OptionWindows, ratios: F32, numbers: tuple[tuple[int, ...], tuple[int, ...]],
    team: int, pitch: Pitch, settings: OptionSettings,
) -> pl.DataFrame:  # fmt: skip
    """Rows of schema Options: neighbouring windows of one robot with the same option are one row.

    ``numbers`` are those of the team's robots and of the adversary's.
    """
    place = shared["place"].to_numpy()
    starts, ends = shared["start_ns"].to_numpy(), shared["end_ns"].to_numpy()
    begins = np.ones(len(place), dtype=np.bool_)
    begins[1:] = (place[1:] != place[:-1]) | (starts[1:] != ends[:-1])
    cell, roles = cells_of(own.sight, own.role, pitch)
    posterior = by_habits(ratios.astype(np.float64), cell, roles, settings)
    best = posterior.argmax(axis=1)
    option = np.array(OPTIONS, dtype=np.int16)[best]
    aim = own.aims[np.arange(len(best)), best]
    logged = shared["logged"].fill_null(-1).to_numpy()
    new = begins.copy()
    new[1:] |= (option[1:] != option[:-1]) | (aim[1:] != aim[:-1]) | (logged[1:] != logged[:-1])
    return shared.with_columns(
        pl.Series("option", option),
        pl.Series("probability", posterior[np.arange(len(best)), best]),
        pl.Series("target", _targets(option, aim, *numbers, team), dtype=pl.String),
        pl.Series("row", np.cumsum(new)),
    ).group_by("row", maintain_order=True).agg(
        pl.all().exclude("end_ns", "probability").first(), pl.col("end_ns").last(),
        pl.col("probability").mean(),
    ).select(list(Options.dtypes())).cast(pl.Schema(Options.dtypes()))


def _targets(
    option: I16, aim: I8, mine: tuple[int, ...], theirs: tuple[int, ...], team: int
) -> list[str | None]:
    """The target of each option, in words."""
    words = {OWN_GOAL: "own-goal", ADVERSARY_GOAL: "adversary-goal"}
    count = max(len(mine), len(theirs))
    named: list[str | None] = []
    for code, row in zip(option.tolist(), aim.tolist(), strict=True):
        thing = int(THING[code])
        if VERB[code] == STAND:
            named.append(None)
        elif thing < OPPONENT:
            named.append(words.get(thing, "ball"))
        elif row < 0:
            named.append(None)
        elif row <= count:
            named.append(f"{SIDES[team]}-{mine[row - 1]}")
        else:
            named.append(f"{SIDES[1 - team]}-{theirs[row - count - 1]}")
    return named
