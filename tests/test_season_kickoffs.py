"""Kick-offs in Table 3, what settings change, and times of decisions: counted by hand."""

import polars as pl
import pytest
from support.seasons import season, tables
from test_season_tables import GAME, KICK, decisions, goals, match

from pitchlore.pipeline.stages.report.kickoffs import kick_offs
from pitchlore.pipeline.stages.report.measures import BRIEF, OTHER, OTHER_TIME
from pitchlore.pipeline.stages.report.report import about_comparisons
from pitchlore.pipeline.stages.report.sensitivity import sensitivity
from pitchlore.pipeline.stages.report.summary import beside_table_3, settings_compared
from pitchlore.pipeline.stages.seasons.tables import game_row

STATIC, HUMAN = "static", "human-like"
S = 1_000_000_000
FRAME = S / 60


def timed(*rows):
    """(start, end, behaviour, state, episode) each, in seconds."""
    made = decisions(*(("home", "striker", state, behaviour, True) for _, _, behaviour, state, _ in rows))
    return made.with_columns(
        t_ns=pl.Series([round(start * S) for start, *_ in rows]), end_ns=pl.Series([round(end * S) for _, end, *_ in rows]),
        episode=pl.Series([episode for *_, episode in rows], dtype=pl.Int32))


def test_times_of_a_game():
    """Times, first seconds and brief decisions of a game, by hand."""
    made = timed(
        (10.0, 10.4, None, 1, 0), (10.4, 10.9, KICK, 2, 0), (10.9, 12.0, None, 3, 0), (12.0, 12.0 + 2 / 60, KICK, 2, 0),
        (12.0 + 2 / 60, 12.0 + 5 / 60, KICK, 4, 0),  # three frames are not brief
        (50.0, 51.0, KICK, 5, 1), (51.0, 51.0 + 1 / 60, None, 5, 1),  # a second after the kick-off is not its first
    )
    row = game_row(*GAME, match(), made, goals(), situations=0).row(0, named=True)
    assert row["played_s"] == pytest.approx(2.0 + 5 / 60 + 1.0 + 1 / 60)
    assert row["other_s"] == pytest.approx(0.5 + 5 / 60 + 1.0)
    assert (row["actions"], row["other_actions"], row["brief_actions"]) == (7, 4, 2)
    assert (row["first_actions"], row["first_other_actions"], row["other_states"]) == (4, 2, 3)
    table = pl.DataFrame([row])
    assert table.select(OTHER_TIME).item() == pytest.approx(100 * row["other_s"] / row["played_s"])
    assert table.select(OTHER).item() == pytest.approx(400 / 7)
    assert table.select(BRIEF).item() == pytest.approx(200 / 7)


def kicking(seed, each=3):
    """A season in which each kick-off brings so many learned actions: 3 × (goals + 1) of 1,000."""
    return season("paper", STATIC, seed, goals=lambda g: (0, g + seed), last=20,
                  other=lambda g: 0.0 if g < 11 else each * (g + seed + 1) / 10)


def test_kick_offs():
    """Learned actions that are three a kick-off are found to be so, and to follow it."""
    games, _ = tables(*(kicking(s) for s in range(3)))
    (row,) = kick_offs(games).iter_rows(named=True)
    assert (row["opponent"], row["first"], row["last"], row["seasons"]) == (STATIC, 11, 20, 3)
    assert row["each"] == pytest.approx(3.0)
    assert row["r"] == pytest.approx(1.0)
    assert row["r_high"] <= 1.0
    assert row["kick_offs"] == pytest.approx(15.5 + 1 + 1)
    assert row["other"] == pytest.approx(100 * 3 * 17.5 / 1000)
    assert (row["in_first"], row["later"]) == (100.0, 0.0)  # the first 200 actions of a game hold all of them


def test_learned_play_is_no_kick_off():
    """Learned actions beyond the first second are seen as such."""
    games, _ = tables(*(season("paper", STATIC, s, last=20, other=lambda g: 50.0 if g > 10 else 0.0) for s in range(3)))
    (row,) = kick_offs(games).iter_rows(named=True)
    assert row["in_first"] == pytest.approx(40.0)  # 200 of 500
    assert row["later"] == pytest.approx(37.5)  # 300 of 800
    assert row["r"] is None  # the share is the same in all games


def test_without_the_score():
    """Settings whose key has no score stand beside the paper's; others do not."""
    some = [season(name, HUMAN, s, last=20, other=lambda g: 3.0) for name in ("paper", "paper-full35", "best") for s in range(3)]
    games, _ = tables(*some)
    assert kick_offs(games).select("settings", "opponent").rows() == [("paper", HUMAN), ("paper-full35", HUMAN)]
    old = games.with_columns(pl.lit(None, pl.Int64).alias("first_other_actions"))
    assert kick_offs(old)["in_first"].to_list() == [None] * 2


def test_sensitivity():
    """A variation stands below what it varies, over the games that both have; it is no setting beside others on the page."""
    # five seasons of the paper's settings, and three of a variation, of fewer games
    some = [season("paper", STATIC, s, last=20, goals=lambda g: (0, 10)) for s in range(5)]
    some += [season("paper-vary-maps-large", STATIC, s, last=14, behaviours=lambda g: 2 * g, goals=lambda g: (0, 10 + g)) for s in range(3)]
    games, growth = tables(*some)
    paper, maps = sensitivity(games, growth, "paper").iter_rows(named=True)
    assert [(row["settings"], row["seasons"], row["games"]) for row in (paper, maps)] == [("paper", 5, 14), ("paper-vary-maps-large", 3, 14)]
    assert (paper["behaviours"], maps["behaviours"]) == (3 * 5 * 14, 3 * 2 * 14)
    assert (paper["difference"], maps["difference"]) == (-10.0, -10 - 12.5)  # games 11 to 14
    assert maps["states"] == 3 * 100 * 14
    assert sensitivity(*tables(season("paper", STATIC)), "paper").height == 0
    assert set(settings_compared(games)["settings"]) == {"paper", "paper-vary-maps-large"}  # who asks for them gets them
    assert "paper-vary-" not in "\n".join(about_comparisons(games))


def test_time_in_table_3():
    """The share of time stands beside the count, and is missing where it was not kept."""
    games, _ = tables(season("paper", STATIC, 0, last=12, other=lambda g: 3.0))
    row = beside_table_3(games.with_columns(other_s=2 * pl.col("other_s")), "paper").filter(opponent=STATIC, game=11).row(0, named=True)
    assert (row["pct"], row["time_pct"]) == (3.0, pytest.approx(6.0))
    old = beside_table_3(games.with_columns(other_s=pl.lit(None, pl.Float64)), "paper").filter(opponent=STATIC, game=11).row(0, named=True)
    assert (old["pct"], old["time_pct"]) == (3.0, None)
