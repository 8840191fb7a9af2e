"""Options: what robots did, recovered from their motion."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from conftest import ROOT
from support.looking import pairs_of
from support.mcap_logs import written
from support.played import whole

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.game.tactics.executors.actions import CODES
from pitchlore.pipeline.matches.frame import OPTION_DTYPE, MatchLog
from pitchlore.pipeline.settings import OptionSettings, TrajectorySettings
from pitchlore.pipeline.stages.options.habits import by_habits
from pitchlore.pipeline.stages.options.likelihood import shipped_ratios
from pitchlore.pipeline.stages.options.recover import logged_options, options
from pitchlore.pipeline.stages.options.windows import bodies, starts
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import ROLES, Appraisals, Clues, Options
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.situations import MOVES_RANDOMLY

SETTINGS = OptionSettings()
#: Options of a played team that drive unlike each other.
UNLIKE = (44, 47, 88, 98, 118, 184)


@pytest.fixture(scope="module")
def log() -> MatchLog:
    """Half a minute of a team whose robots take any of some options for a second, against static."""
    home = TeamSettings(kind="learned", policy="any", explore=1.0, explore_s=1.0, clock_s=0.2)
    recipe = Recipe(home=home, away=TeamSettings(kind="static"), seed=3, referee=RefereeSettings(duration_s=30.0))
    policies = {"any": PolicyTables(pairs_of(**dict.fromkeys(ROLES, UNLIKE)), Appraisals.empty())}
    return whole(MatchInPlay(recipe, controllers_of(recipe, policies)))


@pytest.fixture(scope="module")
def table(log) -> pl.DataFrame:
    return trajectories(log, TrajectorySettings())[0]


@pytest.fixture(scope="module")
def found(log, table) -> tuple[pl.DataFrame, pl.DataFrame]:
    return options(table, log.info.pitch, SETTINGS, shipped_ratios(), logged_options(log.decisions, log.options))[:2]


def test_what_was_done_is_seen(found):
    """Options that drive unlike each other are told from motion alone, for most of the time of a match."""
    rows, _ = found
    known = rows.filter(pl.col("logged").is_not_null())
    lasts = (known["end_ns"] - known["start_ns"]).to_numpy()
    alike = {1: 44, 11: 44, 21: 44, 46: 44}  # to the ball, as long as they have not got it
    same = known["option"].replace(alike).to_numpy() == known["logged"].replace(alike).to_numpy()
    assert known["logged"].n_unique() == len(UNLIKE)
    assert np.average(same, weights=lasts) > 0.5
    assert known["team"].unique().to_list() == ["home"]


def test_only_motion_counts(found, log, table):
    """Decisions that the log holds change nothing but the column that shows them."""
    rows, evidence = found
    blind, same, _ = options(table, log.info.pitch, SETTINGS, shipped_ratios())
    assert blind["logged"].null_count() == blind.height
    assert same.equals(evidence)
    windows_of = pl.col("team", "robot", "option", "target", "segment")
    # a change of what is logged parts a row in two
    assert set(blind.select(windows_of).rows()) == set(rows.select(windows_of).rows())


def test_a_team_that_logs_its_options(found, log, table):
    """Options that a team logs are shown, in place of its decisions; before the first and where it logs none, nothing is."""
    (robot, *_) = found[0]["robot"].unique().sort()
    changes = np.array([(5 * 10**9, 44, robot, 0), (9 * 10**9, 0, robot, 0), (12 * 10**9, 1, robot, 0)], OPTION_DTYPE)
    back = matches.read(written(replace(log, options=changes)), where="told.mcap")
    assert np.array_equal(back.options, changes)
    rows, *_ = options(table, log.info.pitch, SETTINGS, shipped_ratios(), logged_options(back.decisions, back.options))
    middle = ((pl.col("start_ns") + pl.col("end_ns")) // 2 / 1e9).alias("middle")
    told = rows.filter(team="home").sort("start_ns").select("robot", "logged", middle)
    mine = told.filter(robot=robot)
    wanted = np.select([mine["middle"] < 5, mine["middle"] < 9, mine["middle"] < 12], [0, 44, 0], 1)
    assert mine["logged"].fill_null(0).to_list() == wanted.tolist()
    assert set(wanted.tolist()) == {0, 1, 44}
    assert told.filter(pl.col("robot") != robot)["logged"].null_count() == len(told) - len(mine)


def test_options_of_a_robot(found, table):
    """Options of one robot never overlap, lie in play, and have targets that exist."""
    rows, evidence = found
    Options.validate(rows)
    Clues.validate(evidence)
    follows = pl.col("start_ns") - pl.col("end_ns").shift().over("team", "robot")
    assert rows.select(follows.min()).item() >= 0
    ends = table.group_by("segment").agg(pl.col("t_ns").min().alias("first"), pl.col("t_ns").max().alias("last"))
    within = rows.join(ends, on="segment")
    assert within.height == rows.height
    assert within.select(((pl.col("start_ns") >= pl.col("first")) & (pl.col("end_ns") <= pl.col("last"))).all()).item()
    robots = {f"{team}-{robot}" for team, robot in table.filter(pl.col("team") != "ball").select(
        pl.col("team").cast(pl.String), "robot").unique().rows()}
    assert set(rows["target"].drop_nulls()) <= robots | {"ball", "own-goal", "adversary-goal"}


def test_unseen(found, log, table):
    """A robot has no options while it is not seen; the others have theirs."""
    seen = table.filter(~((pl.col("team") == "home") & (pl.col("robot") == 2) & (pl.col("t_ns") > 5e9)))
    rows, *_ = options(seen, log.info.pitch, SETTINGS, shipped_ratios())
    mine = (pl.col("team") == "home") & (pl.col("robot") == 2)
    assert rows.filter(mine)["end_ns"].max() <= 5.3e9
    assert rows.filter(~mine)["end_ns"].max() == found[0].filter(~mine)["end_ns"].max()


def test_robots_as_a_match_shows_them(found, log, table):
    """Robots of our arena are found as they are, and their options as well; of a few samples nothing is measured."""
    settings = SETTINGS.model_copy(update={"robots": "measured"})
    rows, _, robots = options(table, log.info.pitch, settings, shipped_ratios("measured"))
    assert robots.keys() == {"home", "away"}
    for own in robots.values():
        assert own.measured
        assert own[:2] == pytest.approx((1.2, 6.0), rel=0.1)
        assert not own.together
        assert own[4:7] == pytest.approx((0, 0, 0), abs=0.003)
    mine = [each.filter(team="home").select("robot", "start_ns", "end_ns", "option") for each in (rows, found[0])]
    both = mine[0].join(mine[1], on=("robot", "start_ns"))
    assert (both["option"] == both["option_right"]).mean() > 0.5
    _, _, few = options(table.filter(pl.col("t_ns") < 2e9), log.info.pitch, settings, shipped_ratios("measured"))
    assert {own.measured for own in few.values()} == {False}
    said = settings.model_dump(mode="json")
    assert said["robots"] == f"measured, trees {digest((ROOT / 'pipeline/stages/options/measured.npz').read_bytes())[:8]}", "raise MEASURED_TREES"
    assert OptionSettings.model_validate(said) == settings


@pytest.mark.parametrize("kind", [kind for kind in Kind if kind != Kind.VSSS])
def test_other_leagues(table, kind):
    """Robots of other leagues drive in another way: no rows."""
    rows, evidence, _ = options(table, PITCHES[kind], SETTINGS, shipped_ratios())
    assert rows.is_empty()
    assert evidence.is_empty()


def test_options_that_there_are():
    """All codes that robots can do but moves randomly."""
    assert (*OPTIONS, MOVES_RANDOMLY) == CODES


def test_habits_are_learned():
    """Windows that say nothing get the option that the robot has in such windows elsewhere."""
    tells = np.array([[4.0, 0.0], [0.0, 4.0], [0.0, 0.0], [0.0, 0.0]] * 25)
    cell = np.array([0, 1, 0, 1] * 25)
    found = by_habits(tells, cell, np.zeros(2, dtype=np.int64), SETTINGS.model_copy(update={"evidence": 1.0}))
    assert found[2, 0] > 0.9
    assert found[3, 1] > 0.9


def test_rare_cells_have_the_habits_of_the_role():
    """A cell that was seen once does not decide by itself."""
    tells = np.array([[2.0, 0.0]] * 50 + [[0.0, 0.5]])
    cell = np.array([0] * 50 + [1])
    found = by_habits(tells, cell, np.zeros(2, dtype=np.int64), SETTINGS)
    assert found[50, 0] > 0.5
    alone = by_habits(tells, cell, np.array([0, 1]), SETTINGS)
    assert alone[50, 1] > 0.5


def test_windows_of_stretches():
    """Windows follow each other from the start of each stretch of play; one without the ball is left out."""
    segment = np.array([0] * 8 + [-1] * 2 + [1] * 7)
    seen = np.ones(17, dtype=np.bool_)
    assert starts(segment, seen, 3).tolist() == [0, 3, 10, 13]
    seen[4] = False
    assert starts(segment, seen, 3).tolist() == [0, 10, 13]


def test_quick_recordings_are_thinned(table):
    """Samples are no closer than they need be, and the first of each stretch of play is kept."""
    every, kept = bodies(table, 1 / 60), bodies(table, 1 / 30)
    assert kept.frame_s == pytest.approx(2 * every.frame_s)
    firsts = [table.filter(pl.col("segment") == segment)["t_ns"].min() for segment in table["segment"].drop_nulls().unique()]
    assert set(firsts) <= set(kept.t_ns.tolist())
