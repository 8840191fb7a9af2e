"""Knowledge: counts of behaviours in states add up in any order, and versions can be compared."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from support.rows import MATCH, patterns

from pitchlore.pipeline.engine.knowledge import known_shares
from pitchlore.pipeline.numbers.sums import exact
from pitchlore.pipeline.settings import KnowledgeSettings
from pitchlore.pipeline.stages import knowledge
from pitchlore.pipeline.stages.knowledge import (
    behaviours,
    diff,
    merge_behaviours,
    merge_occasions,
)
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.pipeline.state import encode
from pitchlore.schemas import ROLES, SIDES, Behaviours, Decisions, Occasions, Sides

NAMES = ["striker-001-011", "striker-046", None]


def decisions(*rows, team="home", role="striker", chosen=False):
    """(state, behaviour, value) each."""
    return pl.DataFrame(
        [(MATCH, team, 1, role, i, i + 1, state, name, chosen, False, 0.0, 0, None, value)
         for i, (state, name, value) in enumerate(rows)],
        schema=Decisions.dtypes(), orient="row",
    )


US, THEM = Team("us", "vsss"), Team("them", "vsss")
BOTH = pl.DataFrame([(MATCH, side, team, kind, team, 0, 0) for side, (team, kind) in zip(SIDES, (US, THEM), strict=True)],
                    schema=Sides.dtypes(), orient="row")


def alone(**chosen):
    """Settings with states by one key, unless others are named."""
    return KnowledgeSettings(**{"backoff": (), **chosen})


def occasions(tables, version, chosen=None, *, sides=BOTH, learner=US, **kwargs):
    """Occasions of matches in which home is us."""
    return knowledge.occasions(((table, sides) for table in tables), learner, version, chosen or alone(), **kwargs)


rows = st.lists(st.tuples(st.integers(0, 3), st.sampled_from(NAMES), st.floats(-0.99, 0.99)), max_size=30)


class TestOccasions:
    def test_counts_by_state(self):
        """Occasions count behaviours by state, and moving randomly as code 194."""
        found = occasions([
            decisions((5, "striker-046", 0.5), (5, None, 0.75), (2, "striker-046", -0.25)),
            decisions((5, "striker-046", 0.25), (5, "striker-001-011", 0.5)),
        ], version=3)
        Occasions.validate(found)
        assert found.select("version", "role", "state", "behaviour_id", "count", "value").rows() == [
            (3, "striker", 2, "striker-046", 1, -0.25),
            (3, "striker", 5, "striker-001-011", 1, 0.5),
            (3, "striker", 5, "striker-046", 2, 0.375),
            (3, "striker", 5, "striker-194", 1, 0.75),
        ]

    @given(rows, st.randoms(use_true_random=False))
    @settings(max_examples=40)
    def test_any_order(self, found, random):
        """Occasions are the same in any order and for any split."""
        whole = occasions([decisions(*found)], 1)
        random.shuffle(found)
        cut = random.randint(0, len(found))
        assert_frame_equal(occasions(iter([decisions(*found[:cut]), decisions(*found[cut:])]), 1), whole,
                           check_exact=True)

    def test_initial_values(self):
        """A pair begins with the greatest value of its state and role, or the optimistic one above it."""
        seen = decisions((5, "striker-046", 0.5), (5, "striker-001-011", -0.25), (2, "striker-046", -0.5))
        initial = ["state", "behaviour_id", "initial"]
        assert occasions([seen], 1).select(initial).rows() == [
            (2, "striker-046", 0.0), (5, "striker-001-011", 0.5), (5, "striker-046", 0.5)]
        hopeful = occasions([seen], 1, alone(optimistic=0.75))
        assert hopeful["initial"].to_list() == [0.75, 0.75, 0.75]

    def test_every_key(self):
        """Occasions are kept by every key, from fine to coarse."""
        near, far = np.zeros((2, 36), dtype=np.uint8)
        near[0] = far[0] = 1  # the own goalkeeper's distance to the ball: another robot's, for a striker
        far[2] = 1  # the own striker's
        states = encode(np.array([np.zeros(36, dtype=np.uint8), near, far]), "full36").tolist()
        table = decisions(*((state, "striker-046", v) for state, v in zip(states, (0.5, 0.25, -0.25), strict=True)))
        found = occasions([table], 1, alone(backoff=("self9", "role0")))
        Occasions.validate(found)
        own = encode(far[None], "self9", np.array([2])).item()
        assert found.select("key", "state", "count", "value").rows() == [
            ("full36", states[0], 1, 0.5), ("full36", states[1], 1, 0.25), ("full36", states[2], 1, -0.25),
            ("self9", 0, 2, 0.375), ("self9", own, 1, -0.25),
            ("role0", 0, 3, 0.5 / 3),
        ]
        goalkeeper = occasions([table.with_columns(role=pl.lit("goalkeeper", pl.Enum(ROLES)))], 1,
                               alone(state_key="self9"))
        assert goalkeeper["count"].to_list() == [1, 2], "the same states, seen from another slot"

    def test_known_shares(self):
        """Each decision is left out in turn; its state is known if another behaviour was chosen there, not at random."""
        rows = [(1, "striker-046"), (1, "striker-011"), (1, None), (2, "striker-046"), (2, None), (3, "striker-046"), (4, None)]
        found = occasions([decisions(*((*row, 0.5) for row in rows))], 1, alone(state_key="full36", backoff=("role0",)))
        assert known_shares(found) == {"full36": 4 / 7, "role0": 1.0}
        assert known_shares(Occasions.empty()) == {}

    def test_teams(self):
        """Each team has occasions of its own; a side that does not count has none."""
        both = [decisions((5, "striker-046", 0.5)), decisions((5, "striker-011", 0.25), team="away")]
        columns = ("team", "kind", "state", "behaviour_id", "count", "value", "initial")
        assert occasions(both, 1).select(columns).rows() == [
            ("them", "vsss", 5, "striker-011", 1, 0.25, 0.25), ("us", "vsss", 5, "striker-046", 1, 0.5, 0.5)]
        away = BOTH.with_columns(counts_as=pl.when(pl.col("side") == "away").then("counts_as"))
        assert occasions(both, 1, sides=away)["team"].to_list() == ["them"]
        pooled = BOTH.with_columns(counts_as=pl.lit("all"))
        assert occasions(both, 1, sides=pooled).select(columns).rows() == [
            ("all", "vsss", 5, "striker-011", 1, 0.25, 0.5), ("all", "vsss", 5, "striker-046", 1, 0.5, 0.5)]

    @pytest.mark.parametrize(("own", "expected"), [
        ("nothing", []),
        ("moves randomly", [(5, "striker-194", 1, 0.75), (6, "striker-194", 0, None)]),
        ("chosen", [(5, "striker-046", 1, 0.5), (5, "striker-194", 1, 0.75),
                    (6, "striker-046", 1, -0.25), (6, "striker-194", 0, None)]),
    ])
    def test_own_decisions(self, own, expected):
        """A state in which a player of ours decided adds what the settings say."""
        rows = [(5, "striker-046", 0.5), (5, None, 0.75), (6, "striker-046", -0.25), (6, "striker-011", 0.5)]
        found = occasions([decisions(*rows, chosen=True)], 1, alone(own=own), learner=THEM,
                          known=pl.Series(["striker-046"]))
        Occasions.validate(found)
        assert found["team"].unique().to_list() == (["them"] if expected else [])
        for nobody in (None, Team("us", "ssl")):
            assert occasions([decisions(*rows, chosen=True)], 1, alone(own=own), learner=nobody).is_empty()
        assert found.select("state", "behaviour_id", "count", "value").rows() == expected

    def test_unseen_behaviour(self):
        """A behaviour that nobody was seen to begin has no value and does not raise the others."""
        found = occasions([decisions((6, "striker-046", -0.25), chosen=True)], 1,
                          alone(own="chosen", optimistic=-1.0))
        assert found.select("behaviour_id", "value", "initial").rows() == [
            ("striker-046", -0.25, -0.25), ("striker-194", None, -0.25)]


MATCHES = st.lists(st.tuples(rows, st.booleans()), min_size=1, max_size=5)


class TestMerging:
    """Knowledge that adds up, version by version, is what it would be if it were made at once."""

    @given(MATCHES, st.sampled_from(["nothing", "moves randomly", "chosen"]), st.floats(-1.0, 1.0))
    @settings(max_examples=20)
    def test_occasions_in_steps(self, matches, own, optimistic):
        """Occasions merged match by match are those of all matches."""
        chosen = alone(own=own, optimistic=optimistic, backoff=("self6", "role0"))
        tables = [decisions(*found, chosen=by_player) for found, by_player in matches]
        whole = occasions(tables, 9, chosen)
        steps = occasions(tables[:1], 1, chosen)
        for version, table in enumerate(tables[1:], start=2):
            steps = merge_occasions([steps, occasions([table], version, chosen)], version, chosen)
        Occasions.validate(steps)
        assert_frame_equal(steps.drop("version"), whole.drop("version"), check_exact=True)
        assert_frame_equal(merge_occasions([whole], 9, chosen), whole, check_exact=True)

    @staticmethod
    def version(*found, neuron=0):
        """Behaviours by the values of their instances: (id, values) each, as the selection makes them."""
        rows = []
        for name, values in found:
            values = exact(np.array(values))
            codes = [int(code) for code in name.split("-")[1:]]
            mean = values.sum() / len(values)
            rows.append({"behaviour_id": name, "role": "striker", "codes": codes, "n": len(codes), "support": len(values),
                         "value": mean, "mean": mean, "spread": values.std(), "neuron": neuron, "version": 1})
        table = pl.DataFrame(rows, schema=Behaviours.dtypes())
        return Behaviours.validate(table.sort("n", "role", "codes", descending=[True, False, False]))

    def test_behaviours_are_pooled(self):
        """A behaviour of two versions has the support, mean and spread of both together."""
        before = self.version(("striker-046", [0.5, 0.5]), ("striker-001-011", [0.25]))
        after = self.version(("striker-046", [-0.25, 0.25]), ("striker-011", [0.75]), neuron=4)
        found = merge_behaviours([before, after], 2)
        Behaviours.validate(found)
        assert found.select("behaviour_id", "support", "value", "neuron", "version").rows() == [
            ("striker-001-011", 1, 0.25, 0, 2), ("striker-011", 1, 0.75, 4, 2), ("striker-046", 4, 0.25, 4, 2)]
        # of 1/2, 1/2, -1/4, 1/4: the mean of the squares is 10/64, the square of the mean 4/64
        assert found["spread"].to_list() == [0.0, 0.0, pytest.approx((6 / 64) ** 0.5)]

    def test_teams_apart(self):
        """The same behaviour of another team, or of a time when teams were not distinguished, stays apart."""
        ours, theirs, unknown = (
            behaviours([patterns(("s", [46], value), team=team, kind=team and "vsss")], 1)
            for team, value in (("us", 0.5), ("them", 0.25), (None, 0.75)))
        found = merge_behaviours([unknown, ours, merge_behaviours([ours, theirs], 2)], 3)
        assert found.select("team", "support", "value").rows() == [(None, 3, 0.75), ("them", 3, 0.25), ("us", 6, 0.5)]


class TestBehaviours:
    def test_longest_first(self):
        """Behaviours are the patterns of all rounds, the longest first."""
        found = behaviours([patterns(("m", [46]), ("g", [1])), patterns(("s", [1, 11]))], version=2)
        Behaviours.validate(found)
        assert found["behaviour_id"].to_list() == ["striker-001-011", "goalkeeper-001", "midfield-046"]
        assert found["version"].unique().to_list() == [2]

class TestDiff:
    BEFORE = behaviours([patterns(("s", [1, 11], 0.5), ("s", [46], 0.2), ("m", [46], 0.2), **US._asdict())], 1)
    AFTER = behaviours([patterns(("s", [1, 11], 0.6), ("m", [46], 0.2), ("g", [1], 0.3), low=0.25, high=0.75,
                                 **US._asdict())], 2)
    SEEN_BEFORE = occasions([decisions((1, "striker-046", 0.1), (1, "striker-001-011", 0.1))], 1)
    SEEN_AFTER = occasions([decisions((1, "striker-001-011", 0.1), (2, "striker-001-011", 0.1))], 2)

    def test_changes(self):
        """A diff tells what was added, removed and changed."""
        found = diff(self.BEFORE, self.AFTER, self.SEEN_BEFORE, self.SEEN_AFTER).behaviours
        assert found.select("team", "kind").unique().rows() == [("us", "vsss")]
        assert found.drop("team", "kind").rows() == [
            ("goalkeeper-001", "added", "goalkeeper", 1, None, 3, None, 0.3, None, 0.25, None, 0.75, None, 0),
            ("striker-001-011", "changed", "striker", 2, 3, 3, 0.5, 0.6, None, 0.25, None, 0.75, 1, 2),
            ("striker-046", "removed", "striker", 1, 3, None, 0.2, None, None, None, None, None, 1, None),
        ]

    def test_counts_by_role(self):
        """A diff counts behaviours, states and pairs of each role."""
        found = diff(self.BEFORE, self.AFTER, self.SEEN_BEFORE, self.SEEN_AFTER).roles
        assert found.drop("team", "kind").rows(named=True) == [
            {"role": role, "behaviours_before": b0, "states_before": s0, "pairs_before": p0,
             "behaviours_after": b1, "states_after": s1, "pairs_after": p1}
            for role, b0, s0, p0, b1, s1, p1 in [
                ("goalkeeper", 0, 0, 0, 1, 0, 0), ("midfield", 1, 0, 0, 1, 0, 0), ("striker", 2, 1, 2, 1, 2, 2)]
        ]

    def test_teams(self):
        """A diff tells teams apart, and versions from before they were."""
        theirs = self.AFTER.with_columns(team=pl.lit("them"))
        found = diff(self.AFTER, pl.concat([self.AFTER, theirs]), self.SEEN_AFTER, self.SEEN_AFTER)
        assert found.behaviours.select("team", "change").unique().rows() == [("them", "added")]
        assert found.roles.select("team", "role").rows() == [(team, role) for team in ("them", "us") for role in ROLES]
        unknown = self.AFTER.with_columns(pl.lit(None, pl.String).alias(name) for name in ("team", "kind"))
        seen = self.SEEN_AFTER.with_columns(pl.lit(None, pl.String).alias(name) for name in ("team", "kind"))
        assert diff(unknown, unknown, seen, seen).behaviours.is_empty()
        assert diff(unknown, unknown, seen, seen).roles["pairs_after"].to_list() == [0, 0, 2]

    def test_counts_once(self):
        """A diff counts an occasion once, by however many keys it is kept."""
        tables = [decisions((1, "striker-001-011", 0.1), (2, "striker-001-011", 0.1))]
        more = occasions(tables, 2, alone(backoff=("self9", "role0")))
        assert more.height > self.SEEN_AFTER.height
        found, plain = (diff(self.BEFORE, self.AFTER, self.SEEN_BEFORE, seen) for seen in (more, self.SEEN_AFTER))
        assert_frame_equal(found.behaviours, plain.behaviours)
        assert_frame_equal(found.roles, plain.roles)
