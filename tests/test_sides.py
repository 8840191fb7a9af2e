"""Sides: whose knowledge the rows of a match make; one team in one league by default."""

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.settings import SideSettings, parse_settings
from pitchlore.pipeline.stages.sides import sides
from pitchlore.pipeline.stages.sides.teams import (
    Team,
    TeamRecord,
    imitated,
    of_teams,
    sides_of,
    teams,
)
from pitchlore.schemas import SIDES, Sides


def match(home="Reds", away="Blues", kind="vsss", name="a", goals=(3, 1)):
    return pl.DataFrame({"match_id": [f"{name}-0123456789ab"], "home": [home], "away": [away], "kind": [kind],
                         "score_home": [goals[0]], "score_away": [goals[1]]})


def counted(of, **settings):
    """Teams that home and away count for."""
    return sides(of, SideSettings(**settings))["counts_as"].to_list()


def rows(*of_sides, name="a"):
    return pl.DataFrame(
        {"match_id": [f"{name}-0123456789ab"] * len(of_sides), "team": list(of_sides), "row": range(len(of_sides))},
        schema_overrides={"team": pl.Enum(SIDES)})


class TestSides:
    def test_each_by_itself(self):
        """By default each side counts for its own team."""
        found = sides(match(), SideSettings())
        assert found.columns == list(Sides.dtypes())
        assert found.drop("match_id").rows() == [
            ("home", "Reds", "vsss", "Reds", 3, 1), ("away", "Blues", "vsss", "Blues", 1, 3)]

    def test_against_itself(self):
        """Two sides of one name are one team."""
        assert counted(match("static", "static")) == ["static", "static"]
        assert teams(sides(match("static", "static"), SideSettings())) == {Team("static", "vsss"): TeamRecord(1, 1, 0)}

    @pytest.mark.parametrize(("settings", "whom"), [
        ({"watch": ("away",)}, [None, "Blues"]),
        ({"teams": ("Reds",)}, ["Reds", None]),
        ({"teams": ("Greens",)}, [None, None]),
        ({"kind": "ssl"}, [None, None]),
        ({"kind": "vsss"}, ["Reds", "Blues"]),
        ({"pools": {"us": ("Reds", "Greens")}}, ["us", "Blues"]),
        ({"pools": {"us": ("Reds",), "others": ("*",)}}, ["us", "others"]),
        ({"pools": {"all": ("*",), "us": ("Reds",)}}, ["us", "all"]),
        ({"pools": {"us": ("Reds",)}, "teams": ("us",)}, ["us", None]),
        ({"pools": {"us": ("Reds",)}, "teams": ("Reds",)}, ["us", None]),
    ])
    def test_settings(self, settings, whom):
        """Teams are left out, and pooled, by name."""
        assert counted(match(), **settings) == whom

    def test_name_of_a_pool(self):
        """A pool does not take the name of a team that is not in it."""
        with pytest.raises(BadSettings, match=r"the pool 'Blues' has the name of a team that is not in it"):
            counted(match(), pools={"Blues": ("Reds",)})
        assert counted(match(), pools={"Blues": ("Reds", "Blues")}) == ["Blues", "Blues"]

    def test_in_two_pools(self):
        """A team is in one pool at most."""
        with pytest.raises(BadSettings, match=r"sides: a team is named twice \(it is: Reds, Reds\)"):
            parse_settings(b'[sides]\npools = { a = ["Reds"], b = ["Reds"] }', "x.toml")


def played(*matches, **settings):
    """Sides of several matches."""
    return pl.concat(sides(match(*of, name=f"m{i}", **more), SideSettings(**settings)) for i, (of, more) in enumerate(matches))


class TestTeams:
    def test_leagues(self):
        """A name in two leagues is two teams, and a pool, too."""
        two = ((("Reds", "Blues", "vsss"), {}), (("Reds", "Greens", "ssl"), {}))
        assert {team: record.matches for team, record in teams(played(*two)).items()} == {
            Team("Blues", "vsss"): 1, Team("Greens", "ssl"): 1, Team("Reds", "ssl"): 1, Team("Reds", "vsss"): 1}
        assert list(teams(played(*two, pools={"all": ("*",)}))) == [Team("all", "ssl"), Team("all", "vsss")]

    def test_record(self):
        """Matches, those without decisions of their own, and goals in these; an unknown score is none."""
        found = teams(played((("Reds", "Blues"), {}), (("Blues", "Reds"), {"goals": (0, 4)}), (("Reds", "Blues"), {"goals": (None, None)})),
                      {"m1-0123456789ab": ["home"]})
        assert found == {Team("Blues", "vsss"): TeamRecord(3, 2, -2), Team("Reds", "vsss"): TeamRecord(3, 3, 6)}

    def test_imitated(self):
        """Policies imitate the team of most matches, the better one of several, or the one that is named."""
        counts = teams(played((("Reds", "Blues"), {}), (("Reds", "Greens"), {"goals": (0, 9)})))
        assert imitated(counts, None) == ("Reds", "vsss")
        assert imitated(counts, "Greens") == ("Greens", "vsss")
        assert imitated(teams(played((("Blues", "Reds"), {"goals": (1, 3)}))), None) == ("Reds", "vsss")
        assert imitated(teams(played((("Reds", "Blues"), {"goals": (1, 1)}))), None) == ("Blues", "vsss")
        assert imitated({}, None) is None
        with pytest.raises(NotFound, match=r"no team 'Pinks' counts \(those that do: Blues, Greens, Reds\)"):
            imitated(counts, "Pinks")

    def test_learner(self):
        """A team that logged decisions is not imitated while another was watched; who is imitated stays so."""
        counts = teams(played(*[(("learned", "Reds"), {"goals": (9, 0)})] * 3, (("Reds", "Blues"), {})),
                       {f"m{i}-0123456789ab": ["home"] for i in range(3)})
        assert imitated(counts, None) == ("Reds", "vsss")
        assert imitated(counts, None, Team("Blues", "vsss")) == ("Blues", "vsss")
        assert imitated(counts, "Reds", Team("Blues", "vsss")) == ("Reds", "vsss")
        assert imitated(counts, None, Team("Blues", "ssl")) == ("Reds", "vsss")


class TestRows:
    def test_of_teams(self):
        """Rows of sides that count get their team, in order; the others are left out."""
        own = pl.concat([sides(match(), SideSettings(watch=("away",))),
                         sides(match("Blues", "Reds", name="b"), SideSettings(watch=("home",)))])
        found = of_teams(pl.concat([rows("home", "away", "away"), rows("home", "away", name="b")]), own)
        assert found.select("match_id", "team", "kind", "row").rows() == [
            ("a-0123456789ab", "Blues", "vsss", 1), ("a-0123456789ab", "Blues", "vsss", 2),
            ("b-0123456789ab", "Blues", "vsss", 0)]

    @given(st.lists(st.sampled_from(["Reds", "Blues", "Greens"]), min_size=2, max_size=2),
           st.sampled_from([(), ("Reds",), ("Reds", "Blues"), ("*",)]), st.sampled_from([("home",), ("away",), SIDES]))
    def test_rows_of_each_team(self, names, pool, watch):
        """Rows of sides that are watched become rows of teams; each team has those of its sides."""
        own = sides(match(*names), SideSettings(pools={"pool": pool}, watch=watch))
        there = of_teams(rows("home", "away"), own)
        assert there["row"].to_list() == [SIDES.index(side) for side in watch]
        for team in teams(own):
            mine = there.filter(**team._asdict())
            assert sorted(SIDES[row] for row in mine["row"]) == sorted(sides_of(team, own)["team"].cast(pl.String))
        assert sides_of(None, own).is_empty()
