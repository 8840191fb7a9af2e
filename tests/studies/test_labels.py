"""The study of labels: its measures on tables made by hand, and its tables beside its data."""

from __future__ import annotations

import shutil

import polars as pl
import pytest
from conftest import RECORDINGS, ROOT
from labels import agreement, kicks, shares
from labels.moments import Recording, draw, recordings
from labels.sheets import dials, sheet, standing
from labels.study import agreed, read_answers, study
from polars.testing import assert_frame_equal
from support.recordings import ALL, RSIM, beside
from support.scenes import film, goes, stands

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.schemas import Commands, Passes, Possession, Referee, Situations

FOLDER = ROOT / "data" / "studies" / "labels"
S = 1_000_000_000


def labels_of(*rows):
    """Both labellers' labels: (moment, a, a's others, b, b's others), of home 1."""
    return pl.DataFrame(
        [(moment, "home", 1, *rest) for moment, *rest in rows], orient="row",
        schema=[*agreement.ROW, "a", "a_also", "b", "b_also"])


def said_of(*rows):
    """Answers: (moment, before, now, near now), of home 1."""
    return pl.DataFrame(
        [(moment, "home", 1, before, str(before), now, near) for moment, before, now, near in rows], orient="row",
        schema=[*agreement.ROW, "before", "near_before", "now", "near_now"])


MOMENTS = pl.DataFrame({"moment": [1, 2, 3, 4], "league": ["ssl"] * 4, "use": ["mend"] * 4})
LABELS = labels_of((1, 46, "118", 46, ""), (2, 46, "", 34, "46"), (3, 184, "", 184, ""), (4, 34, "", 34, ""))
SAID = said_of((1, 194, 118, "46 118"), (2, 194, 46, "46"), (3, 184, 184, "184"), (4, 194, 0, "34 194"))


class TestAgreement:
    def test_kappa(self):
        """Kappa is the agreement above chance, as a share of what is left above it."""
        a, b = pl.Series([1, 1, 2, 2]), pl.Series([1, 2, 2, 2])
        # three of four agree; by chance 1/2 · 1/4 + 1/2 · 3/4 = 1/2
        assert agreement.kappa(a, b) == pytest.approx((0.75 - 0.5) / 0.5)
        assert agreement.kappa(a, a) == 1
        assert agreement.kappa(a, pl.Series([2, 2, 1, 1])) == -1

    def test_agreement(self):
        """Agreement is the mean over the labellers; loosely, a code in `also` counts too."""
        row = agreement.agreement(LABELS, SAID, MOMENTS).row(by_predicate=pl.col("league") == "ssl", named=True)
        assert (row["robots"], row["both"]) == (4, 0.75)
        assert row["kappa"] == pytest.approx((0.75 - 5 / 16) / (1 - 5 / 16), abs=1e-3)
        assert (row["before"], row["now"]) == (0.25, 3 / 8)  # 3: both; now 2: labeller a
        assert row["now_loosely"] == 5 / 8  # 1: among a's others; 2: among b's as well
        assert (row["random_before"], row["random_now"], row["random_a"]) == (1, 0, 0)

    def test_all_leagues(self):
        """The leagues are added up for each use."""
        moments = MOMENTS.with_columns(league=pl.Series(["ssl", "ssl", "2d", "2d"]))
        table = agreement.agreement(LABELS, SAID, moments)
        assert dict(table.select("league", "robots").iter_rows()) == {"2d": 2, "all": 4, "ssl": 2}
        assert dict(table.select("league", "both").iter_rows()) == {"2d": 1, "all": 0.75, "ssl": 0.5}

    def test_interval(self):
        """Moments are drawn again, not robots."""
        moment = pl.Series([1] * 50 + [2] * 50)
        assert agreement.interval(moment, pl.Series([1.0] * 50 + [0.0] * 50)) == (0.0, 1.0)
        assert agreement.interval(moment, pl.Series([1.0, 0.0] * 50)) == (0.5, 0.5)
        low, high = agreement.interval(pl.Series(range(400)), pl.Series([1.0, 0.0] * 200))
        assert (low, high) == pytest.approx((0.45, 0.55), abs=0.01)

    def test_by_code(self):
        """Labels that both labellers give are looked for in the answers, and the answers in the labels."""
        rows = {row["code"]: row for row in agreement.by_code(LABELS, SAID, MOMENTS).iter_rows(named=True)}
        assert set(rows) == {34, 46, 118, 184, 194}
        assert (rows[46]["both"], rows[46]["kept_a"]) == (1, 0.5)
        assert (rows[46]["found_now"], rows[46]["near_now"]) == (0, 1)
        assert (rows[46]["said_now"], rows[46]["right_now"]) == (1, 1)  # of moment 2, where a says so
        assert (rows[118]["both"], rows[118]["found_now"], rows[118]["right_now"]) == (0, None, 0)
        assert (rows[194]["said_before"], rows[194]["right_before"]) == (3, 0)

    def test_answers(self):
        """An answer is the situation at the moment, 0 in a gap; near are those within 0.3 s."""
        table = film({"home-1": stands(0, 0), "away-2": stands(0.3, 0), "ball": stands(0, 0.5)}, 3.0)
        situations = pl.DataFrame(
            {"team": ["home"] * 3, "robot": [1] * 3, "code": [46, 21, 34], "start_ns": [0, S, 2 * S],
             "end_ns": [S, 3 * S // 2, 5 * S // 2]})
        moments = pl.DataFrame({"moment": [1, 2, 3], "recording": ["film"] * 3, "t_ns": [S // 2, S, 19 * S // 10]})
        found = agreement.answers(moments, {"film": table}, {"film": situations})
        assert found.filter(pl.col("team") == "home").select("moment", "now", "near_now").rows() == [
            (1, 46, "46"), (2, 21, "21 46"), (3, 0, "34")]
        assert found.filter(pl.col("team") == "away").select("robot", "now", "near_now").unique().rows() == [(2, 0, "")]


def commands(*rows):
    """Rows of schema Commands from (robot of home, tenth of a second, command)."""
    return pl.DataFrame(
        [("film", "home", robot, tenth * S // 10, command, 1) for robot, tenth, command in rows],
        schema=Commands.dtypes(), orient="row")


def spans(*rows):
    """Acts or situations from (robot of home, start, end in tenths of a second)."""
    return pl.DataFrame(
        [("home", robot, start * S // 10, end * S // 10) for robot, start, end in rows], orient="row",
        schema={"team": pl.String, "robot": pl.Int64, "start_ns": pl.Int64, "end_ns": pl.Int64})


class TestKicks:
    def test_acts(self):
        """An act is a run of commands of a player at most 0.3 s apart, in play."""
        given = commands((1, 1, "kick"), (1, 2, "kick"), (1, 5, "kick"), (1, 9, "kick"), (2, 1, "kick"), (1, 4, "dash"),
                         (1, 30, "kick"))
        in_play = pl.Series([tenth * S // 10 for tenth in range(20)])
        assert kicks.acts(given, "kick", in_play).rows() == spans((1, 1, 5), (1, 9, 9), (2, 1, 1)).rows()
        assert kicks.acts(given, "catch", in_play).is_empty()

    @pytest.mark.parametrize(("found", "named"), [
        ([(1, 8, 9)], True),  # ends a cycle before
        ([(1, 7, 8)], False),
        ([(1, 13, 15)], True),  # begins a cycle after
        ([(1, 14, 15)], False),
        ([(2, 10, 12)], False),  # of another robot
        ([(1, 0, 1), (1, 11, 12)], True),
        ([], False),
    ])
    def test_named(self, found, named):
        """A situation of the player within a cycle of the act names it."""
        assert kicks.named(spans((1, 10, 12)), spans(*found)).to_list() == [named]

    def test_conditions(self):
        """An act is found from the ball's speed after, its distance before, and who was near before."""
        bodies = {  # cycles of 0.1 s; both kick in the cycle that 1.1 s shows
            "ball": goes((0, 0.8, 0, 0), (1.0, 0.8, 0, 0), (2.0, 5.8, 0, 0)),
            "home-1": stands(0, 0), "home-2": stands(0.8, 0.38), "away-1": stands(3, 0), "away-2": stands(-20, 0),
        }
        played = Recording(film(bodies, 2.0, hz=10), Referee.empty(), Commands.empty(), PITCHES[Kind.SIM2D])
        found = kicks.with_conditions(spans((1, 11, 11), (2, 11, 11), (1, 5, 5)), played)
        assert found.select("fast", "at_body", "pressed").rows() == [
            (True, False, True), (True, True, True), (False, False, True)]
        alone = played._replace(table=played.table.filter(~((pl.col("team") == "away") & (pl.col("robot") == 1))))
        assert kicks.with_conditions(spans((1, 11, 11)), alone)["pressed"].to_list() == [False]

    def test_judged(self):
        """Recall is over the server's acts, precision over the recogniser's situations, by group."""
        bodies = {"ball": goes((0, 0.8, 0, 0), (1.0, 0.8, 0, 0), (3.0, 16.8, 0, 0)), "home-1": stands(0, 0)}
        given = commands((1, 5, "kick"), (1, 11, "kick"), (1, 20, "catch"))
        names = {"team": "home", "robot": 1, "match_id": "film", "role": "striker", "name": ""}
        situations = pl.concat([Situations.empty(), pl.DataFrame(
            [{**names, "code": code, "start_ns": start * S // 10, "end_ns": end * S // 10}
             for code, start, end in [(1, 3, 5), (21, 10, 11), (21, 25, 26)]],
            schema_overrides={name: Situations.dtypes()[name] for name in (*names, "code", "start_ns", "end_ns")},
        )], how="diagonal")
        table = kicks.judged(situations, Recording(film(bodies, 3.0, hz=10), Referee.empty(), given, PITCHES[Kind.SIM2D]))
        rows = {(row["command"], row["group"]): row for row in table.iter_rows(named=True)}
        assert rows["kick", "all"] == {
            "command": "kick", "group": "all", "acts": 2, "recall": 0.5, "family": 1.0, "situations": 2, "precision": 0.5}
        assert (rows["kick", "fast"]["recall"], rows["kick", "slow"]["recall"]) == (1.0, 0.0)
        assert (rows["kick", "under pressure"]["acts"], rows["kick", "under pressure"]["recall"]) == (0, None)
        assert (rows["catch", "all"]["acts"], rows["catch", "all"]["recall"]) == (1, 0.0)
        assert rows["tackle", "all"]["acts"] == 0


class TestShares:
    def test_summary(self):
        """Times are added up by code; standing is no moving."""
        lasts = [(184, 2.0), (46, 1.0), (194, 0.5), (21, 0.1), (194, 0.5), (45, 0.16)]
        ends = pl.Series([seconds for _, seconds in lasts]).cum_sum() * S
        table = pl.DataFrame({"code": [code for code, _ in lasts], "end_ns": ends.round().cast(pl.Int64)}).with_columns(
            start_ns=pl.col("end_ns").shift(1, fill_value=0))
        found = shares.summary(table)
        assert (found["situations"], found["n_023"], found["n_045"], found["brief"]) == (6, 0, 1, pytest.approx(1 / 3))
        assert found["median_s"] == pytest.approx(0.5)
        assert found["random"] == pytest.approx(1 / 4.26)
        assert found["random_moving"] == pytest.approx(1 / 2.26)

    def test_on_ball(self):
        """A hand-over is given or received well if a 023 of the one, or a 045 of the other, is beside it."""
        passes = pl.DataFrame([
            {"team": "home", "robot": 1, "receiver": 2, "t_ns": t * S, "received_ns": (t + 1) * S}
            for t in (1, 5)])
        possession = pl.DataFrame([{"start_ns": 0, "end_ns": 8 * S}, {"start_ns": 8 * S, "end_ns": 10 * S}])
        situations = pl.DataFrame([
            {"team": "home", "robot": 1, "code": 23, "start_ns": S // 2, "end_ns": S},
            {"team": "home", "robot": 1, "code": 45, "start_ns": 6 * S, "end_ns": 7 * S},  # of the one that passes
            {"team": "home", "robot": 2, "code": 45, "start_ns": 2 * S + S // 10, "end_ns": 3 * S},
            {"team": "away", "robot": 1, "code": 23, "start_ns": 5 * S, "end_ns": 6 * S},
        ])
        assert shares.on_ball(possession, passes, situations) == {
            "handovers": 2, "given": 0.5, "received": 0.5, "spells_per_s": 0.2}
        nothing = shares.on_ball(Possession.empty(), Passes.empty(), situations)
        assert nothing == {"handovers": 0, "given": None, "received": None, "spells_per_s": None}


class TestData:
    def test_labels(self):
        """Both labelled every robot of every moment with codes of the table."""
        labels = agreement.read_labels(FOLDER)
        assert set(labels["moment"]) == set(range(1, 201))
        for who in "ab":
            assert pl.read_csv(FOLDER / f"labels-{who}.csv", schema_overrides={"also": pl.String}).height == labels.height
        assert labels.select(agreement.ROW).equals(read_answers(FOLDER).select(agreement.ROW))

    @pytest.mark.parametrize("name", ["agreement.csv", "codes.csv"])
    def test_tables(self, name):
        """The tables follow from labels and answers (`make study-labels`)."""
        found = agreed(FOLDER)[name]
        assert_frame_equal(found, pl.read_csv(FOLDER / name, schema=found.schema), abs_tol=1e-9)

    @pytest.mark.slow
    def test_study(self, tmp_path):
        """The answers are those of the recogniser as it is, from as many recordings as there are."""
        folder = shutil.copytree(FOLDER, tmp_path / "labels")
        study(folder, recordings(RECORDINGS))
        for path in sorted(FOLDER.glob("*.csv")):
            assert (folder / path.name).read_bytes() == path.read_bytes(), f"{path.name}: run make study-labels"

    @pytest.mark.slow
    def test_rows_are_kept(self, tmp_path):
        """Rows about recordings that are absent are kept."""
        folder = shutil.copytree(FOLDER, tmp_path / "labels")
        study(folder, recordings(tmp_path))
        assert pl.read_csv(folder / "shares.csv").equals(pl.read_csv(FOLDER / "shares.csv"))
        assert pl.read_csv(folder / "kicks.csv").equals(pl.read_csv(FOLDER / "kicks.csv"))
        assert read_answers(folder).equals(read_answers(FOLDER))

    @pytest.mark.slow
    def test_moments(self):
        """Drawn again, the moments are the same."""
        for name in ALL:
            beside(name)
        again = draw(recordings(RECORDINGS))
        assert again.cast(pl.Schema({"moment": pl.Int64})).rows() == pl.read_csv(FOLDER / "moments.csv").rows()

    @pytest.mark.slow
    def test_pictures(self, tmp_path):
        """A moment and a robot's turn are drawn."""
        recorded = recordings(tmp_path)
        moments = pl.read_csv(FOLDER / "moments.csv").filter(pl.col("recording") == RSIM)
        t_ns = moments["t_ns"][0]
        sheet(recorded[RSIM], t_ns, "moment 1", tmp_path / "sheet.png")
        dials([(recorded[RSIM], t_ns, "home", 1, "1 home 1")], tmp_path / "dials.png")
        assert all((tmp_path / name).stat().st_size > 10_000 for name in ("sheet.png", "dials.png"))

    def test_standing(self):
        """Robots that a labeller said to stand were looked at again."""
        again = pl.concat([pl.read_csv(FOLDER / f"labels-{who}.csv", schema_overrides={"also": pl.String}) for who in "ab"])
        changed = again.filter(pl.col("first").is_not_null())
        assert (changed["first"] == 184).all()
        assert changed.join(standing(FOLDER), on=agreement.ROW, how="anti").is_empty()
