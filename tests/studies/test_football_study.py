"""The study of football: its tables stand beside their controls, and its page says what they say; its whole match."""

from __future__ import annotations

from dataclasses import replace

import polars as pl
import pytest
from conftest import RECORDINGS, ROOT
from football import study
from football.skillcorner import whole_match
from support.football import NEEDS_KLOPPY
from test_recognised import USUAL, poor
from usual.study import situations_of

from pitchlore.pipeline import matches
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.stages.situations.usual import recognition

S = 1_000_000_000
STUDY = ROOT / "data" / "studies" / "football"


def table(name: str) -> pl.DataFrame:
    return pl.read_csv(STUDY / f"{name}.csv")


def test_confusion_adds_up() -> None:
    """The counts of each guess are the frames that the provider names, and its diagonal is what is right."""
    agreement = {row["guess"]: row for row in table("possession").to_dicts()}
    for (guess,), rows in table("confusion").partition_by("guess", as_dict=True).items():
        counts = rows.sort("provider", descending=True).select("home", "away", "nobody").to_numpy()
        assert counts.sum() == agreement[guess]["frames"]
        assert counts[0, 0] + counts[1, 1] == agreement[guess]["right"]
        assert counts[:, 2].sum() == agreement[guess]["frames"] - agreement[guess]["named"]


def test_beside_its_controls() -> None:
    """Where we name a team, we agree more often than the nearest player does, and than a constant."""
    rows = {row["guess"]: row for row in table("possession").to_dicts()}
    column = "agreement_where_ours_is_named"
    assert rows["pitchlore"][column] > rows["nearest player"][column] > rows["constant"][column]
    assert rows["pitchlore"]["low"] < rows["pitchlore"]["agreement"] < rows["pitchlore"]["high"]
    assert rows["pitchlore"]["agreement_where_named"] > rows["pitchlore without heights"]["agreement_where_named"]


def test_spread_is_as_wide_as_in_2d() -> None:
    """Football shows as many codes as 2D's recordings, its time is spread as evenly; as 2D it showed three."""
    rows = table("codes")
    football = rows.row(by_predicate=pl.col("recording") == "SkillCorner", named=True)
    in_2d = rows.filter(pl.col("kind") == "2d", ~pl.col("recording").str.starts_with("SkillCorner"))
    assert football["codes"] >= in_2d["codes"].max()
    assert football["entropy_bits"] >= in_2d["entropy_bits"].max()
    assert rows.row(by_predicate=pl.col("recording") == "SkillCorner, read as 2D", named=True)["codes"] == 3
    assert rows.filter("poor")["recording"].to_list() == ["SkillCorner, read as 2D"]


def test_page() -> None:
    """The page has the figures of the tables."""
    page = (STUDY / "README.md").read_text()
    for name in ("possession", "touches"):
        for row in table(name).to_dicts():
            line = next(line for line in page.splitlines() if line.startswith(f"| {row['guess']} |") and (
                str(row["frames"]) in line.replace(",", "")))
            for value in (row["agreement"], row["agreement_where_named"]):
                assert f"{value:.3f}".lstrip("0") in line
    for row in table("codes").to_dicts():
        assert f"| {row['recording']} | {row['codes']} | {100 * row['moves_randomly']:.1f} % | {row['entropy_bits']:.2f} |" in page


@NEEDS_KLOPPY
@pytest.mark.slow
def test_possession_again(tmp_path) -> None:
    """The study gives the committed counts again, with the situations of all recordings that are there."""
    study.main(tmp_path, RECORDINGS)
    for name in ("possession", "confusion", "touches", "contact"):
        assert (tmp_path / f"{name}.csv").read_bytes() == (STUDY / f"{name}.csv").read_bytes()
    again = pl.read_csv(tmp_path / "codes.csv")
    assert again.equals(table("codes").filter(pl.col("recording").is_in(again["recording"].implode())))


@NEEDS_KLOPPY
@pytest.mark.slow
def test_whole_match() -> None:
    """SkillCorner's match: eleven a side, both halves, its score, substitutes, heights, few numbers."""
    match = whole_match()
    row = matches.row(match)
    assert row.select("score_home", "score_away", "robots_per_team", "hz").row(0) == (4, 0, 11, 10.0)
    assert [period.home_attacks for period in match.info.periods] == [-1, 1]
    assert match.info.started_at is not None
    substitutes = match.info.settings["substitutes"]
    assert isinstance(substitutes, list)
    assert 4 <= len(substitutes) <= 6
    assert all(sub["t_ns"] > 30 * 60 * S for sub in substitutes)
    assert match.frames.most_robots() <= 30
    assert 12 < match.heights.z.max() < 13
    # each goal that the ball tells is of the side that won 4 : 0
    goals = match.referee.filter(pl.col("event") == "goal")["team"].cast(pl.String).to_list()
    assert goals
    assert set(goals) == {"home"}


@NEEDS_KLOPPY
@pytest.mark.slow
def test_football() -> None:
    """Real football shows as many situations as 2D does; as 2D, as it was read before, it has the flaw."""
    match = whole_match()
    situations = situations_of(match)
    shown = recognition(situations, Kind.HUMAN)
    assert shown.codes >= len(USUAL["2d"]["rates"])
    assert shown.random < 0.2
    assert not shown.poor
    assert poor(match) == []
    (note,) = poor(replace(match, info=match.info.model_copy(update={"pitch": PITCHES[Kind.SIM2D]})))
    assert "no robot has a heading" in note
