"""Decisions: a recorded match read as if its robots had chosen the behaviours that they show."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.rows import MATCH, S, bodies, consecutive, patterns, referee, situations

from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.stages.behaviours.grams import cover
from pitchlore.pipeline.stages.decisions import complete, disjoint_instances, observed_decisions
from pitchlore.pipeline.stages.sequences.derive import choices, sequences
from pitchlore.pipeline.stages.sequences.follows import followed
from pitchlore.pipeline.state import elements, encode
from pitchlore.schemas import Decisions, Goals, Sequences

VSSS = PITCHES[Kind.VSSS]
GRAMS = GramSettings(alpha=0.5, tick_s=1.0)
SIX = {
    "home_1": (-0.3, 0.1, 0.0, "m"), "away_1": (0.4, -0.2, 3.0, "s"), "away_2": (0.7, 0.0, 3.0, "g"),
}
KNOWN = patterns(("m", [1, 11]), ("m", [46]), ("s", [46]))


def goals_of(events):
    found = events.filter(pl.col("event") == "goal").select("match_id", "t_ns", "team")
    return found.with_columns(robot=pl.lit(None, dtype=pl.Int16), kind=pl.lit(None), origin=pl.lit("referee"), confidence=pl.lit(None)).select(list(Goals.dtypes()))


def tracks(until=10.0, **segments):
    """Two samples a second; segment n from its first to its last second, nothing between."""
    table = bodies(np.arange(0, until, 0.5), ball=(0.0, 0.0), **SIX)
    if not segments:
        return table
    index = pl.lit(None, dtype=pl.Int32)
    for name, (lo, hi) in segments.items():
        index = pl.when(pl.col("t_ns").is_between(round(lo * S), round(hi * S))).then(
            pl.lit(int(name[1:]), dtype=pl.Int32)).otherwise(index)
    return table.with_columns(segment=index)


def seen(table, trajectories, events, known=KNOWN):
    worths = table.select("match_id", "team", "robot", "start_ns", change=pl.lit(0.0), x=pl.lit(0.0), y=pl.lit(0.0))
    sequence = Sequences.validate(sequences(table, goals_of(events), worths, trajectories, events, VSSS, GRAMS), cast=True)
    return Decisions.validate(observed_decisions(sequence, known))


def test_goal_reward():
    """A goal rewards the last decision of each robot of both teams."""
    table = situations(consecutive([1, 11, 194, 46]), consecutive([46], team="away", role="s", start=0.5))
    found = seen(table, tracks(s0=(0, 2), s1=(3, 9)), referee((2.5, "goal", "home")))
    assert found.select("team", "role", "t_ns", "end_ns", "behaviour_id", "reward", "episode", "ends").rows() == [
        ("home", "midfield", 0, 3 * S // 2, "midfield-001-011", 0.0, 0, None),
        ("home", "midfield", 3 * S // 2, 5 * S // 2, "midfield-046", 1.0, 0, "terminal"),
        ("away", "striker", S // 2, 5 * S // 2, "striker-046", -1.0, 0, "terminal"),
    ]
    # values at 0 and 0.5 s of a goal at 2.5 s, a tick a second
    assert found["value"].to_list() == pytest.approx([(0.5**2.5 + 0.5**2) / 2, 0.5, -(0.5**2)], abs=1e-8)
    assert not found["random"].any()


@pytest.mark.parametrize(("events", "reward", "ends", "over"), [
    ([(2.5, "fault", "home")], 0.0, "terminal", 2.5),
    ([(2.5, "half", None)], 0.0, "terminal", 2.5),
    ([(2.5, "end", None)], 0.0, "terminal", 2.5),
    ([(2.2, "stop", None), (2.5, "goal", "away")], -1.0, "terminal", 2.5),
    ([(3.0, "goal", "away"), (3.0, "kick-off", "home")], -1.0, "terminal", 3.0),
    ([(3.0, "kick-off", "home")], 0.0, "truncated", 2.0),
    ([(2.5, "goal", None)], 0.0, "truncated", 2.0),
    ([(2.5, "play", None)], 0.0, "truncated", 2.0),
    ([(3.5, "goal", "home")], 0.0, "truncated", 2.0),
    ([(0.0, "goal", "home"), (0.0, "kick-off", "away")], 0.0, "truncated", 2.0),
    ([], 0.0, "truncated", 2.0),
])
def test_segment_end(events, reward, ends, over):
    """How the segment ended decides the reward and whether the episode is cut off."""
    table = situations(consecutive([1, 11], start=1.0, each=0.5))
    found = seen(table, tracks(s0=(0, 2), s1=(3, 9)), referee(*events))
    assert found.select("reward", "ends", "end_ns").rows() == [(reward, ends, round(over * S))]


def test_goal_of_unknown_team():
    """A goal of unknown team ends an episode without reward, and the next goal is not its."""
    table = situations(consecutive([1, 11, 46], each=0.5), consecutive([46], start=3.0, segment=1))
    events = referee((2.5, "goal", None), (9.5, "goal", "home"))
    found = seen(table, tracks(s0=(0, 2), s1=(3, 9)), events)
    assert found.select("behaviour_id", "reward", "ends", "end_ns").rows() == [
        ("midfield-001-011", 0.0, None, S), ("midfield-046", 0.0, "truncated", 2 * S),
        ("midfield-046", 1.0, "terminal", 19 * S // 2),
    ]
    assert found["value"].to_list() == pytest.approx([0.0, 0.0, 0.5**6.5], abs=1e-8)


def test_final_whistle():
    """The last segment ends with the final whistle, however late it comes."""
    found = seen(situations(consecutive([46])), tracks(until=3.0), referee((60.0, "end", None)))
    assert found.select("ends", "end_ns").rows() == [("terminal", 60 * S)]


def test_segments():
    """Each segment is an episode of its own."""
    table = situations(consecutive([46, 46]), consecutive([46], start=3.0, segment=1))
    found = seen(table, tracks(s0=(0, 2), s1=(3, 9)), referee((2.5, "goal", "away"), (9.5, "goal", "home")))
    assert found.select("episode", "reward", "ends").rows() == [
        (0, 0.0, None), (0, -1.0, "terminal"), (1, 1.0, "terminal")]


def test_state_at_start():
    """A decision's state is what the robot's own team sees when it starts."""
    table = situations(consecutive([46], start=1.0), consecutive([46], team="away", role="s", start=1.0))
    path = tracks()
    look, _ = elements(path, referee(), VSSS, np.array([0, 1]), np.array([S, S]))
    assert seen(table, path, referee())["state"].to_list() == encode(look, "full36").tolist()


def test_unknown_states():
    """Decisions in unknown states are left out."""
    blind = tracks().filter((pl.col("team") != "ball") | (pl.col("t_ns") != S // 2))
    found = seen(situations(consecutive([46, 46, 46])), blind, referee((20.0, "goal", "home")))
    assert found.select("t_ns", "end_ns", "reward").rows() == [(0, S, 0.0), (S, 20 * S, 1.0)]


def test_nothing_seen():
    """Where no known behaviour is seen there is no decision."""
    assert seen(situations(consecutive([194, 184])), tracks(), referee()).is_empty()
    assert seen(situations(), tracks(), referee()).is_empty()
    assert seen(situations(consecutive([46])), tracks(), referee(), known=patterns()).is_empty()


class TestComplete:
    """Logged decisions of a team take the place of those seen."""

    @staticmethod
    def logged(*rows):
        """(team, seconds, behaviour) each, of robot 1, as they are while the match is played."""
        return Decisions.validate(pl.DataFrame(
            [(MATCH, team, 1, "striker", round(t * S), round((t + 1) * S), 7, name, True, name is None, 0.0, 0, None, 0.0)
             for team, t, name in rows],
            schema=Decisions.dtypes(), orient="row",
        ))

    def test_logged_team(self):
        """If a team logged its decisions, nothing but the log is read."""
        table = situations(consecutive([46, 46]), consecutive([46], team="away", role="s", start=0.5))
        events = referee((2.5, "goal", "home"))
        shown = seen(table, tracks(s0=(0, 2), s1=(3, 9)), events)
        log = self.logged(("away", 0, None), ("away", 1, "striker-099"))
        found = complete(shown, choices(log, goals_of(events), GRAMS))
        Decisions.validate(found)
        assert found.select("team", "t_ns", "behaviour_id", "chosen", "random").rows() == [
            ("home", 0, "midfield-046", False, False), ("home", S // 2, "midfield-046", False, False),
            ("away", 0, None, True, True), ("away", S, "striker-099", True, False),
        ]

    def test_value_of_log(self):
        """A logged decision is valued by the next goal."""
        log = self.logged(("home", 0, None), ("home", 2, None), ("home", 4, None), ("home", 5, None))
        goals = goals_of(referee((2.0, "goal", "away"), (4.5, "goal", "home")))
        found = complete(Decisions.empty(), choices(log, goals, GRAMS))
        # a tick a second, alpha one half; a decision at the very time of a goal is after it
        assert found["value"].to_list() == pytest.approx([-(0.5**2), 0.5**2.5, 0.5**0.5, 0.0], abs=1e-8)

    def test_no_log(self):
        """If a team logged nothing, its decisions are those seen."""
        shown = seen(situations(consecutive([46])), tracks(), referee())
        assert complete(shown, choices(Decisions.empty(), goals_of(referee()), GRAMS)).equals(shown)


class TestResolve:
    def test_long_then_early(self):
        """Long instances are taken before short ones, and early ones before late ones."""
        known = patterns(("m", [1, 11, 21, 46]), ("m", [1, 11, 1]), ("m", [1]))
        table = situations(consecutive([1, 11, 1, 11, 21, 46, 1, 11, 1, 11, 1]))
        first, last, pattern = disjoint_instances(followed(table, 0.2), known)
        spans = list(zip(first.tolist(), last.tolist(), strict=True))
        # 0-1 is left over as [1, 11]: 0 alone; of the two [1, 11, 1] at 6 and 8 the earlier is taken
        assert spans == [(0, 0), (2, 5), (6, 8)]
        assert [known["n"][i] for i in pattern.tolist()] == [1, 4, 3]

    @given(
        st.lists(st.one_of(st.sampled_from([1, 11, 46]), st.none()), max_size=25),
        st.lists(st.lists(st.sampled_from([1, 11, 46]), min_size=1, max_size=4), max_size=6, unique_by=tuple),
    )
    @settings(max_examples=60)
    def test_instances(self, codes, known):
        """Instances never share a situation and lie in what the rounds cover."""
        table = situations(consecutive(codes))
        shapes = patterns(*(("m", gram) for gram in known))
        found = disjoint_instances(followed(table, 0.2), shapes)
        used = np.zeros(table.height, dtype=int)
        for first, last, pattern in zip(*found, strict=True):
            used[first : last + 1] += 1
            assert table["code"][int(first) : int(last) + 1].to_list() == shapes["codes"][int(pattern)].to_list()
        assert used.max(initial=0) <= 1
        assert not (used.astype(bool) & ~cover(followed(table, 0.2), shapes)).any()


def test_goal_after_stop():
    """An episode ends with its goal even if play was stopped before."""
    found = episodes(tracks(s0=(0, 2), s1=(3, 9)), referee((2.2, "stop", None), (2.5, "goal", "away"),
                                                          (9.5, "end", None)))
    assert found.rows() == [(0, 2 * S, 5 * S // 2, "goal", "away"), (1, 9 * S, 19 * S // 2, "end", None)]


def test_no_scorer_of_a_fault():
    """A fault names the team that brings the ball back into play; nobody has scored."""
    found = episodes(tracks(s0=(0, 2), s1=(3, 9)), referee((3, "fault", "home"), (9.5, "end", None)))
    assert found.rows() == [(0, 2 * S, 3 * S, "fault", None), (1, 9 * S, 19 * S // 2, "end", None)]
