"""Values: V at moments, and what situations change of it."""

import numpy as np
import polars as pl
import pytest
from support.of_values import NOTHING, looked_at, tracks
from support.rows import MATCH, S, consecutive, referee, situations

from pitchlore.pipeline.settings import ValueSettings
from pitchlore.pipeline.stages.values.models import shipped
from pitchlore.pipeline.stages.values.worths import values, worths
from pitchlore.schemas import Moments, Values, Worths


def of_moments(*values, each=1.0, segment=0):
    """V to home, one value each second."""
    return Values.validate(pl.DataFrame(
        {"match_id": MATCH, "t_ns": [round(i * each * S) for i in range(len(values))], "segment": segment,
         "home": [max(v, 0.0) for v in values], "away": [max(-v, 0.0) for v in values], "value": list(values)},
        schema=Values.dtypes()))


def worth(table, known=None, events=NOTHING, paths=None, **settings):
    known = of_moments(*np.linspace(-0.5, 0.5, 11)) if known is None else known
    paths = tracks() if paths is None else paths
    found = Worths.validate(worths(table, known, events, paths, ValueSettings(**settings)))
    assert found.select("team", "robot", "start_ns").equals(table.select("team", "robot", "start_ns"))
    return found


class TestWorths:
    def test_change(self):
        """A change is V after minus V before, to the robot's team; V lies on a straight line between moments."""
        table = situations(consecutive([1, 11], start=1.0, each=1.5), consecutive([46], team="away", start=2.0, each=1.0))
        found = worth(table)
        assert found["before"].to_list() == pytest.approx([-0.4, -0.25, 0.3])
        assert found["after"].to_list() == pytest.approx([-0.25, -0.1, 0.2])
        assert found["change"].to_list() == pytest.approx([0.15, 0.15, -0.1])

    def test_telescopes(self):
        """Changes of situations that follow each other add up to the change from the first to the last."""
        known = of_moments(*np.random.default_rng(0).uniform(-1, 1, 11))
        table = situations(consecutive([1, 11, 21, 46, 184], start=0.7, each=1.3))
        found = worth(table, known)
        assert found["change"].sum() == pytest.approx(found["after"][-1] - found["before"][0], abs=1e-12)
        assert found["after"][:-1].to_list() == found["before"][1:].to_list()

    def test_beyond_moments(self):
        """Before the first moment and after the last, V is that of the nearest."""
        found = worth(situations(consecutive([1], start=0.0, each=9.0)), of_moments(0.25, -0.5))
        assert found.select("before", "after").row(0) == (0.25, -0.5)

    def test_segments(self):
        """V is that of the situation's own stretch of play."""
        known = pl.concat([of_moments(0.1, 0.2), of_moments(0.5, 0.75, segment=1)])
        table = situations(consecutive([1], each=1.0), consecutive([1], start=1.0, each=1.0, segment=1))
        assert worth(table, known)["after"].to_list() == [0.2, 0.75]

    def test_unknown_value(self):
        """Without V nothing is known, and nothing changes, also before a goal."""
        table = situations(consecutive([1, 11], each=1.0))
        found = worth(table, Values.empty(), referee((2.0, "goal", "home")), tracks(until=2.5))
        assert found["before"].null_count() == 2
        assert found["after"].to_list() == [None, 1.0]
        assert found["change"].to_list() == [0.0, 0.0]
        assert worth(situations()).is_empty()

    @pytest.mark.parametrize(("team", "sign"), [("home", 1), ("away", -1)])
    def test_goal(self, team, sign):
        """After a goal V is 1 or -1, for the last situation of each robot alone."""
        table = situations(consecutive([1, 11], each=1.0), consecutive([46], robot=2, start=0.5, each=1.4),
                           consecutive([21, 22], team="away", each=1.0))
        found = worth(table, of_moments(0.1, 0.2, 0.3), referee((2.2, "goal", team)), tracks(spans=((0, 2), (3, 9))))
        assert found["after"].to_list() == pytest.approx([0.2, sign, sign, -0.2, -sign])
        assert found["change"].to_list() == pytest.approx([0.1, sign - 0.2, sign - 0.15, -0.1, -sign + 0.2])

    def test_before_goal(self):
        """A situation that ends long before the goal does not end with it."""
        paths = tracks(spans=((0, 2), (3, 9)))
        for end, with_goal in ((0.9, False), (1.1, True)):
            table = situations(consecutive([1], each=end))
            (after,) = worth(table, of_moments(0.0, 0.0), referee((2.2, "goal", "home")), paths, goal_s=1.0)["after"]
            assert (after == 1.0) == with_goal

    @pytest.mark.parametrize("events", [referee((2.2, "goal", None)), referee((2.2, "fault", "home")), referee()])
    def test_no_goal(self, events):
        """A goal of unknown team, a fault and the end of a recording change nothing."""
        found = worth(situations(consecutive([1], each=2.0)), of_moments(0.0, 0.25, 0.5), events,
                      tracks(spans=((0, 2), (3, 9))))
        assert found["after"].to_list() == [0.5]

    def test_places(self):
        """Places are where the robot starts, as its own team sees it; null where it was not seen."""
        table = situations(consecutive([1]), consecutive([11], team="away"), consecutive([21], robot=2))
        found = worth(table).select("x", "y").rows()
        assert found[0] == pytest.approx((0.1, 0.2))
        assert found[1] == (None, None), "robot 2 was not seen"
        assert found[2] == pytest.approx((-0.5, 0.1)), "away's view is turned"


class TestValues:
    def test_home_and_away(self):
        """V is home's chance minus away's; to away it is minus that."""
        looked = looked_at(tracks(until=3.0), referee((3.0, "goal", "home")))
        found = Values.validate(values(looked, shipped()))
        assert found.height == looked.height / 2
        assert (found["value"] == found["home"] - found["away"]).all()
        np.testing.assert_allclose(found["away"], shipped().chances(looked.filter(team="away")))

    def test_no_moments(self):
        """No moments have no values."""
        assert Values.validate(values(Moments.empty(), shipped())).is_empty()
