"""Situations: the right code at the right time, and nothing a user could not rely on."""

from math import pi

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from support.literal import BALL, Found, Match, recognise_literally
from support.recordings import INSPER, RCSS, RSIM, SSL, beside, bodies_of, imported
from support.scenes import FRO, SCENES, THERE, TO, film, goes, stands, walk

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind, Pitch
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations.dense import dense_match
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.situations.rulebook import rule_table, term_table
from pitchlore.pipeline.stages.situations.rules import RULES, TABLE_1, Start
from pitchlore.schemas import Situations

VSSS = PITCHES[Kind.VSSS]
DEFAULT = SituationSettings()
SAMPLE_S = 1 / 40


def found_by(table: pl.DataFrame, *, team: str = "home", robot: int = 1, kind: Kind = Kind.VSSS) -> pl.DataFrame:
    """One robot's situations."""
    situations = Situations.validate(recognise(table, PITCHES[kind], DEFAULT))
    return situations.filter((pl.col("team") == team) & (pl.col("robot") == robot))


def check(table: pl.DataFrame, code: int, target: str | None, start_s: float, end_s: float) -> None:
    """Exactly one situation of the code, there (to a sample)."""
    rows = found_by(table).filter(pl.col("code") == code)
    assert rows.height == 1, found_by(table)["code"].to_list()
    row = rows.row(0, named=True)
    assert row["target"] == target
    assert row["name"] == TABLE_1[code][0]
    assert row["start_ns"] / 1e9 == pytest.approx(start_s, abs=1.01 * SAMPLE_S)
    assert row["end_ns"] / 1e9 == pytest.approx(end_s, abs=1.01 * SAMPLE_S)
    assert (row["strength"] is None) if code == 194 else row["strength"] >= 0.5 - 1e-6


class TestScenes:
    @pytest.mark.parametrize("name", SCENES)
    def test_scene(self, name):
        """Each scene has exactly one situation of its code, at its time and with its target."""
        bodies, seconds, code, target, start_s, end_s = SCENES[name]
        check(film(bodies, seconds), code, target, start_s, end_s)

    @pytest.mark.parametrize(("role", "approaches", "leaves"), [
        ("goalkeeper", 138, 150), ("midfield", 139, 151), ("striker", 140, 152),
    ])
    def test_opponent_by_its_role(self, role, approaches, leaves):
        """The code tells the opponent's role, whether it is approached or left."""
        roles = {"away-4": role}
        check(film({"home-1": TO, "away-4": THERE}, 1.0, roles=roles), approaches, "away-4", 0.0, 0.7)
        check(film({"home-1": FRO, "away-4": THERE}, 1.0, roles=roles), leaves, "away-4", 0.0, 0.7)

    @pytest.mark.parametrize(("mine", "theirs", "approaches", "leaves"), [
        ("goalkeeper", "midfield", 162, 173), ("midfield", "striker", 162, 173), ("striker", "goalkeeper", 162, 173),
        ("goalkeeper", "striker", 163, 174), ("midfield", "goalkeeper", 163, 174), ("striker", "midfield", 163, 174),
    ])
    def test_teammate_by_role(self, mine, theirs, approaches, leaves):
        """A teammate's code tells whether its role is one or two further in the circle of roles."""
        roles = {"home-1": mine, "home-2": theirs}
        check(film({"home-1": TO, "home-2": THERE}, 1.0, roles=roles), approaches, "home-2", 0.0, 0.7)
        check(film({"home-1": FRO, "home-2": THERE}, 1.0, roles=roles), leaves, "home-2", 0.0, 0.7)

    def test_codes_have_scenes(self):
        """Every code of Table 1 has a scene."""
        shown = {scene[2] for scene in SCENES.values()} | {138, 139, 140, 150, 151, 152, 162, 163, 173, 174}
        assert shown == set(TABLE_1)

    def test_possession(self):
        """Possession reads: reaches the ball, is with it, guides it, kicks it."""
        table = film({
            "ball": goes((0, 0, 0, 0), (0.5, 0, 0, 0), (1.1, 0.24, 0, 0), (1.6, 0.74, 0, 0)),
            "home-1": goes((0, -0.26, 0, 0), (0.5, -0.06, 0, 0), (1.1, 0.18, 0, 0), (1.6, 0.38, 0, 0)),
        }, 1.6)
        assert found_by(table)["code"].to_list()[:4] == [44, 1, 11, 21]


class TestMeaning:
    def test_role(self):
        """The role of a situation is the one at its start."""
        table = film({"home-1": stands(0.1, 0.3)}, 1.0).with_columns(
            role=pl.when(pl.col("frame") < 10).then(pl.lit("striker")).otherwise(pl.lit("midfield")).cast(
                pl.Enum(["goalkeeper", "midfield", "striker"])
            )
        )
        assert found_by(table)["role"].to_list() == ["striker"]

    def test_sideways_driver(self):
        """A robot that can drive sideways approaches what it drives to, not what it faces."""
        bodies = {"ball": stands(0, 3.0), "home-1": goes((0, 0, 1.0, 0), (1, 0, 2.0, 0))}
        codes = {kind: set(recognise(film(bodies, 1.0), PITCHES[kind], DEFAULT)["code"]) for kind in Kind}
        assert 46 in codes[Kind.SSL]
        assert 46 not in codes[Kind.SIM2D]

    def test_faces(self):
        """VSSS robots play the ball with their backs, too, SSL robots do not, 2D players and people all around."""
        held = {Kind.VSSS: 0.06, Kind.SSL: 0.10, Kind.SIM2D: 0.8, Kind.HUMAN: 0.8}
        around = {Kind.SIM2D, Kind.HUMAN}
        for side, kinds in ((0, set(Kind)), (pi, {Kind.VSSS, *around}), (pi / 2, around)):
            has = {
                kind for kind, off in held.items()
                if 1 in found_by(film({"ball": stands(off, 0), "home-1": stands(0, 0, side)}, 1.0), kind=kind)["code"]
            }
            assert has == kinds, side

    def test_at_its_side_in_2d(self):
        """A 2D player receives the ball at its side, and kicks it from there."""
        bodies = {"ball": goes((0, 8, 0, 0), (1, 0.8, 0, 0), (1.5, 0.8, 0, 0), (2.5, 15, 0, 0)), "home-1": stands(0, 0, pi / 2)}
        rows = found_by(film(bodies, 2.5, hz=10), kind=Kind.SIM2D)
        kicks = rows.filter(pl.col("code") == 21, pl.col("start_ns") > 1.2e9)
        assert rows["code"][0] == 45
        assert (kicks["start_ns"] / 1e9).to_list() == pytest.approx([1.5], abs=0.101)

    @pytest.mark.parametrize(("off", "kicks"), [(0.8, True), (0.38, False)])
    def test_tap_or_bump_in_2d(self, off, kicks):
        """A 2D ball that leaves slowly was kicked, unless the player's body may have pushed it."""
        bodies = {"ball": goes((0, off, 0, 0), (0.5, off, 0, 0), (1.5, off + 2, 0, 0)), "home-1": stands(0, 0)}
        assert (21 in found_by(film(bodies, 1.5, hz=10), kind=Kind.SIM2D)["code"]) == kicks

    @pytest.mark.parametrize(("back", "kick"), [(1.0, True), (0.6, False), (0.2, False)])
    def test_rebound(self, back, kick):
        """A ball that comes back slow was not kicked, one that comes back as fast was."""
        bodies = {"ball": goes((0, 0.46, 0, 0), (0.4, 0.06, 0, 0), (0.8, 0.06 + 0.4 * back, 0, 0)), "home-1": stands(0, 0, pi / 2)}
        assert (21 in found_by(film(bodies, 0.8))["code"]) == kick

    def test_holding_ends_before_kick(self):
        """Holding the ball does not swallow the sample in which it is kicked."""
        bodies, seconds, *_ = SCENES["kicks a resting ball"]
        rows = found_by(film(bodies, seconds))
        assert rows["code"].to_list()[:2] == [1, 21]
        # the ball moves from 0.5 s on
        assert rows["end_ns"][0] <= 0.5e9 <= rows["start_ns"][1] < rows["end_ns"][1] <= 0.55e9

    def test_own_half(self):
        """A run up the pitch leads away from the own goal in the own half, and to the other goal beyond it."""
        rows = found_by(film({"home-1": goes((0, -0.65, 0, 0), (2.4, 0.55, 0, 0))}, 2.4))
        assert rows["code"].to_list() == [98, 118]
        # 0.85 m from the own goal is VERY_FAR: x = 0.1 after 1.5 s
        assert rows["start_ns"][1] / 1e9 == pytest.approx(1.5, abs=2 * SAMPLE_S)

class TestMissing:
    def test_unknown_heading(self):
        """An unknown value fulfils neither a condition nor its opposite."""
        # without a heading the robot is neither facing the ball nor not facing it
        table = film(SCENES["is hit by the ball"][0], 0.88).with_columns(theta=pl.lit(None, pl.Float32))
        assert set(found_by(table)["code"]) == {184}

    @pytest.mark.parametrize("name", [name for name, scene in SCENES.items() if scene[3] == "ball"])
    def test_lost_ball(self, name):
        """While the ball is not seen nothing of it begins: what is missing is nowhere, and not at the centre."""
        bodies, seconds, _, _, start_s, _ = SCENES[name]
        table = film(bodies, seconds)
        gone = pl.col("team") == "ball"
        assert found_by(table.filter(~gone)).filter(pl.col("target") == "ball").is_empty()
        lost = found_by(table.filter(~gone | (pl.col("t_ns") <= start_s * 1e9))).filter(pl.col("target") == "ball")
        assert lost.filter(pl.col("start_ns") > start_s * 1e9).is_empty()

    @pytest.mark.parametrize("path", [TO, FRO])
    @pytest.mark.parametrize("other", ["away-4", "home-2"])
    def test_lost_robot(self, path, other):
        """A robot that is not seen is neither approached nor left."""
        table = film({"home-1": path, other: THERE}, 1.0)
        seen = found_by(table)["target"].to_list()
        assert other in seen
        lost = found_by(table.filter((pl.col("team") + "-" + pl.col("robot").cast(pl.String) != other) | (pl.col("t_ns") > 0.9e9)))
        assert other not in lost["target"].to_list()

    def test_play_stopped(self):
        """Situations end where play stops and begin again where it goes on."""
        table = film({"home-1": stands(0.1, 0.3)}, 3.0).with_columns(
            segment=pl.when(pl.col("frame").is_between(40, 79)).then(None).otherwise(pl.col("frame") // 80).cast(pl.Int32)
        )
        rows = found_by(table)
        assert rows["start_ns"].to_list() == [0, 2_000_000_000]
        assert rows["end_ns"].to_list() == [1_000_000_000, 3_000_000_000]
        assert rows["segment"].to_list() == [0, 1]

    def test_nothing_at_all(self):
        """Without rows, without play or without robots there are no situations."""
        empty = film({"home-1": stands(0, 0)}, 1.0).clear()
        assert recognise(empty, VSSS, DEFAULT).schema == Situations.empty().schema
        stopped = film({"home-1": stands(0, 0)}, 1.0).with_columns(segment=pl.lit(None, pl.Int32))
        assert recognise(stopped, VSSS, DEFAULT).is_empty()
        assert recognise(film({"ball": stands(0, 0)}, 1.0), VSSS, DEFAULT).is_empty()

    def test_unsorted_is_refused(self):
        table = film({"ball": stands(0, 0), "home-1": stands(0, 0)}, 1.0)
        for broken in (table.sort("t_ns", "team"), table.reverse()):
            with pytest.raises(SchemaMismatch, match="sorted"):
                recognise(broken, VSSS, DEFAULT)

    def test_two_matches_are_refused(self):
        table = film({"home-1": stands(0, 0)}, 1.0)
        with pytest.raises(SchemaMismatch, match="more than one match"):
            recognise(pl.concat([table, table.with_columns(match_id=pl.lit("other"))]), VSSS, DEFAULT)


def rows_of(table: pl.DataFrame, pitch: Pitch, options: SituationSettings = DEFAULT) -> list[Found]:
    columns = ("team", "robot", "role", "code", "start_ns", "end_ns", "strength", "target", "segment")
    return [Found(*row) for row in recognise(table, pitch, options).select(columns).iter_rows()]


def assert_same(fast: list[Found], slow: list[Found]) -> None:
    assert [row._replace(strength=None) for row in fast] == [row._replace(strength=None) for row in slow]
    for one, other in zip(fast, slow, strict=True):
        assert one.strength == (None if other.strength is None else pytest.approx(other.strength, abs=1e-6))


class TestLiteral:
    @pytest.mark.slow
    @pytest.mark.parametrize(("name", "start_s", "end_s", "least_codes"), [
        (RSIM, 290, 305, 25), (SSL, 113, 114.5, 10), (RCSS, 0, 30, 14), (INSPER, 5, 9, 14),
    ])
    def test_same_on_recordings(self, name, start_s, end_s, least_codes):
        """Recordings have the situations that the literal reading of the rules finds."""
        log, table = imported(name), bodies_of(name)
        clip = table.filter(pl.col("t_ns").is_between(start_s * 10**9, end_s * 10**9, closed="left"))
        fast = rows_of(clip, log.info.pitch)
        assert len({row.code for row in fast}) >= least_codes
        assert_same(fast, recognise_literally(clip, log.info.pitch, DEFAULT))

    @pytest.mark.slow
    @settings(max_examples=25)
    @given(
        seed=st.integers(0, 2**32 - 1), sideways=st.booleans(),
        options=st.just(DEFAULT) | st.builds(
            SituationSettings, fire_at=st.floats(0.05, 1.0), least_share=st.floats(0, 1), **dict.fromkeys(
                ("flicker_s", "lull_s", "longest_s", "random_least_s", "random_longest_s"), st.floats(0.01, 1.0))),
    )
    def test_same_on_walks(self, seed, sideways, options):
        """Random walks have the situations that the literal reading of the rules finds, under any settings."""
        pitch = VSSS.model_copy(update={"kind": Kind.SSL if sideways else Kind.VSSS})
        table = walk(seed, omnidirectional=sideways)
        assert_same(rows_of(table, pitch, options), recognise_literally(table, pitch, options))


class TestProperties:

    def test_blocks_do_not_show(self, monkeypatch):
        """The size of the blocks that are computed at once does not show in the situations."""
        clip = bodies_of(RSIM).filter(pl.col("t_ns") < 30 * 10**9)
        whole = recognise(clip, VSSS, DEFAULT)
        monkeypatch.setattr("pitchlore.pipeline.stages.situations.matching.REGISTERS", 3_000)
        assert_frame_equal(whole, recognise(clip, VSSS, DEFAULT))


class TestTables:
    def test_rules_cover_table_1(self):
        table = rule_table()
        assert set(table["code"]) == set(TABLE_1)
        assert table.filter(pl.col("code") != 194)["initial"].null_count() == 0
        assert dict(table.select("code", "priority").iter_rows()) == {
            code: priority for code, (_, priority) in TABLE_1.items()
        }

    def test_final_conditions(self):
        """Each rule has a final condition or a playing time."""
        assert all(bool(rule.final) == (rule.start != Start.WHILE) == (not rule.lasts) for rule in RULES)
        lasting = rule_table().filter(pl.col("start") == "while", pl.col("code") != 194)
        assert lasting["final"].str.starts_with("playing_time is (").all()

    @pytest.mark.parametrize("kind", list(Kind))
    def test_terms_have_crossings(self, kind):
        """Every term has a value at which it rises or falls."""
        table = term_table(kind)
        assert set(table["variable"]) == {"distance", "orientation", "bearing", "playing time", "velocity"}
        assert table.select((pl.col("rises_at").is_not_null() | pl.col("falls_at").is_not_null()).all()).item()

    def test_priorities_are_the_papers(self):
        """Names and priorities are those of the paper's Table 1, but for one apostrophe."""
        path = beside("README.md").parent.parent / "paper" / "table1_situations.csv"
        paper = pl.read_csv(path)
        assert {row["code"]: (row["name"].replace("it's own", "its own"), row["priority"]) for row in paper.iter_rows(named=True)}.items() <= TABLE_1.items()


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from([Kind.VSSS, Kind.SIM2D]))
def test_same_as_literal(seed, kind):
    """Jolts and gains are those of the literal recogniser, on matches with holes, stops and suspect samples."""
    table = walk(seed)
    found = dense_match(table, SCALES[kind]).ball[5:7]
    match = Match(table, PITCHES[kind])
    for place, frame in enumerate(match.frames):
        if BALL in match.at[frame]:
            assert found[:, place] == pytest.approx(match.ball_jolts[frame], abs=1e-5)
        else:
            assert np.isnan(found[:, place]).all()
