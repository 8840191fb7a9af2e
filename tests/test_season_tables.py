"""One game as rows of Games and Growth, counted by hand."""

import polars as pl
import pytest
from support.rows import MATCH

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.stages.report import table3
from pitchlore.pipeline.stages.seasons.settings import Season, SeasonSettings
from pitchlore.pipeline.stages.seasons.tables import game_row, growth_rows, states_played
from pitchlore.schemas import Behaviours, Decisions, Goals, Growth, Matches, Occasions, StatesPlayed

#: The season and the number of the game; the state key is full36.
GAME = Season(name="paper", opponent="static", seed=3, settings=SeasonSettings(lead=5, lead_from=2)), 2
KICK, RANDOM = "striker-021", "striker-194"


def decisions(*rows):
    """(team, role, state, behaviour, chosen) each."""
    table = [{"match_id": MATCH, "team": team, "robot": 1, "role": role, "t_ns": i, "end_ns": i + 1, "state": state,
              "behaviour_id": behaviour, "chosen": chosen, "random": False, "reward": 0.0, "episode": 0, "ends": None,
              "value": 0.0} for i, (team, role, state, behaviour, chosen) in enumerate(rows)]
    return pl.DataFrame(table, schema=Decisions.dtypes())


def occasions(*rows):
    """(role, key, state, behaviour, count) each."""
    table = [{"version": 1, "role": role, "key": key, "state": state, "behaviour_id": behaviour, "count": count,
              "value": 0.5 if count else None, "initial": 0.5} for role, key, state, behaviour, count in rows]
    return pl.DataFrame(table, schema=Occasions.dtypes())


def behaviours(*ids):
    table = [{"behaviour_id": each, "role": each.split("-")[0], "codes": [int(c) for c in each.split("-")[1:]],
              "n": each.count("-"), "support": 3, "value": 0.5, "spread": 0.1, "neuron": 0, "version": 1} for each in ids]
    return pl.DataFrame(table, schema=Behaviours.dtypes())


def goals(*rows):
    """(team, kind) each."""
    return pl.DataFrame([{"match_id": MATCH, "t_ns": i, "team": team, "robot": 1, "kind": kind}
                         for i, (team, kind) in enumerate(rows)], schema=Goals.dtypes())


def match(n=1):
    row = dict.fromkeys(Matches.dtypes()) | {"match_id": MATCH, "duration_s": 480.0, "hz": 60.0, "score_home": 7, "score_away": 1}
    return pl.DataFrame([row] * n, schema=Matches.dtypes())


PLAYED = decisions(
    ("home", "striker", 5, KICK, True), ("home", "striker", 5, None, True), ("home", "striker", 6, RANDOM, True),
    ("home", "midfield", 5, None, True),
    ("home", "striker", 7, KICK, False),  # seen in its situations, not chosen
    ("away", "striker", 8, KICK, True),  # the opponent's
)
KNOWN = occasions(("striker", "full36", 5, KICK, 2), ("striker", "full36", 6, RANDOM, 0), ("striker", "role0", 0, KICK, 2),
                  ("goalkeeper", "full36", 5, "goalkeeper-057", 1))


def row(**more):
    made = goals(("home", "direct"), ("home", "error"), ("home", None), ("away", "indirect"), (None, None))
    return game_row(*GAME, match(), PLAYED, made, situations=900, **more).row(0, named=True)


def test_actions():
    """Only what the apprentice chose counts, and 194 is random however it is written."""
    found = row()
    assert (found["actions"], found["random_actions"], found["other_actions"]) == (4, 3, 1)
    assert (found["season"], found["game"], found["opponent"], found["duration_s"]) == ("paper-static-3", 2, "static", 480.0)
    assert found["policy_version"] is None


def test_goals_by_kind():
    """Goals are counted by kind, and the lead at the start is not among them."""
    found = row()
    assert (found["lead"], found["goals_for"], found["goals_against"]) == (5, 3, 1)
    assert [found[kind] for kind in ("direct", "indirect", "error")] == [1, 0, 1]  # one of unknown kind
    assert [found[f"{kind}_against"] for kind in ("direct", "indirect", "error")] == [0, 1, 0]


def test_known_states():
    """A state is known if the own role knows more than 194 there by the finest key."""
    # state 5 of the striker (two decisions of four); 6 has 194 alone, the midfield knows nothing
    assert row(known=KNOWN)["known_states"] == 0.5
    assert row()["known_states"] == 0.0  # the first game


def test_no_decisions():
    """A game without decisions is a row of zeros."""
    empty = game_row(*GAME, match(), decisions(), goals(), situations=0, known=KNOWN)
    assert empty.select("actions", "known_states", "goals_for").row(0) == (0, 0.0, 0)


def test_two_matches_are_refused():
    with pytest.raises(SchemaMismatch, match="2 matches, not one"):
        game_row(*GAME, match(2), PLAYED, goals(), situations=0)


def test_growth():
    """Growth counts the states that were seen, those that were played, and both together."""
    earlier = decisions(("home", "striker", 5, None, True), ("home", "striker", 9, None, True))
    played = states_played(states_played(StatesPlayed.empty(), earlier), PLAYED)
    grown = growth_rows(*GAME, PLAYED, played, KNOWN, behaviours(KICK, RANDOM, "goalkeeper-057"))
    assert grown.columns == list(Growth.dtypes())
    by_role = {r["role"]: r for r in grown.iter_rows(named=True)}
    striker = by_role["striker"]
    assert striker["states_played"] == 3  # 5, 6 and 9
    assert striker["states_seen"] == 1  # 5; in 6 nobody was seen to begin anything
    assert striker["states"] == 3
    assert (striker["behaviours"], striker["pairs"]) == (1, 1)  # without 194, by the finest key alone
    assert (striker["actions"], striker["other_actions"]) == (3, 1)  # of the last game
    assert (by_role["goalkeeper"]["states"], by_role["goalkeeper"]["actions"]) == (1, 0)
    assert (by_role["midfield"]["states"], by_role["midfield"]["behaviours"]) == (1, 0)


def test_table_3():
    """The paper's Table 3 is whole, and its one slip is known."""
    printed = table3.printed()
    assert printed["game"].to_list() == list(range(1, 36))
    for column in ("humans", "static"):
        total, random, other, pct = (printed[f"{column}_{name}"] for name in ("total", "random", "other", "pct"))
        wrong = printed.filter(total != random + other)["game"].to_list()
        assert wrong == ([10] if column == "static" else [])
        assert ((100 * other / total - pct).abs() <= 0.0051).all()
    human, static = table3.games("humans"), table3.games("static")
    with pytest.raises(KeyError, match="human-like"):
        table3.games("human-like")
    assert (human["other_actions"].sum(), static["other_actions"].sum()) == (3327, 3306)
    assert (human["actions"].sum(), static["actions"].sum()) == (133124, 139147)
