"""Rounds: one columnar pass over all matches gives what each match by itself does."""

import shutil
import weakref
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from conftest import clip
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from support.rows import changed, consecutive, goals, sequences_of, situations

from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.settings import BehaviourSettings, ModelSettings, RoundSettings, Settings
from pitchlore.pipeline.stages.behaviours.grams import cover, grams, merge, spelt
from pitchlore.pipeline.stages.behaviours.rounds import learn
from pitchlore.pipeline.stages.behaviours.select import select
from pitchlore.pipeline.stages.decisions import all_decisions, decision_digests, observed_decisions
from pitchlore.pipeline.stages.sequences import league
from pitchlore.pipeline.stages.sides.teams import Team, as_of
from pitchlore.pipeline.store import Store
from pitchlore.schemas import SIDES, Choices, Decisions, Grams, Patterns

#: Nearly everything that recurs becomes a behaviour.
ANY = BehaviourSettings(
    select_by="value", value_over=-9.0, shrink=False, support_at_least=2, keep_random=True, epochs=3,
    rounds=tuple(RoundSettings(n=n, rows=1, columns=2, activation=0.3) for n in (4, 3, 1)))
ONE, TWO = Team("one", "vsss"), Team("two", "vsss")

codes = st.lists(st.one_of(st.sampled_from([1, 11, 21, 46]), st.none()), min_size=0, max_size=20)
leagues = st.lists(st.tuples(codes, codes, st.sampled_from([(ONE, TWO), (TWO, ONE), (ONE, ONE), (ONE, None)])), min_size=1, max_size=5)


def league_of(found):
    """Sequences and sides of matches: what home and away did, and whom they count for."""
    tables, sides = {}, {}
    for number, (home, away, teams) in enumerate(found):
        name = f"match-{number:012d}"
        table = situations(consecutive(home), consecutive(away, team="away", role="s")).with_columns(match_id=pl.lit(name))
        worths = changed(table, *(0.125 * (i % 5 - 2) for i in range(table.height)))
        tables[name] = sequences_of(table, goals((3.0, "home")), worths)
        sides[name] = {side: team for side, team in zip(SIDES, teams, strict=True) if team is not None}
    return tables, sides


def one_by_one(tables, sides):
    """The same, each match by itself and each team by itself, as the paper says it."""
    known, counted = [Patterns.empty()], []
    for round_ in ANY.rounds:
        before = pl.concat(known)
        for team in sorted({team for own in sides.values() for team in own.values()}):
            parts, recognised = [], 0
            for name, table in tables.items():
                for side in (side for side, of in sides[name].items() if of == team):
                    own = table.filter(pl.col("team") == side)
                    recognised += own.height
                    parts.append((name, own))
            mine = before.filter(pl.col("team") == team.team)
            of_match = {name: pl.concat(own for match, own in parts if match == name) for name, _ in parts}
            merged = merge([grams(table.clear(), round_.n), *(
                grams(own, round_.n, cover(own, mine)) for own in of_match.values())])
            own = spelt(merged, round_.n).drop("who")
            chosen = select(own, recognised, ANY, round_)
            known.append(as_of(chosen.patterns, team))
            lies = own.with_columns(pl.Series("neuron", chosen.neuron, dtype=pl.Int16))
            counted.append(as_of(lies.filter(pl.col("count") >= 2), team).select(list(Grams.dtypes())))
    return pl.concat(known), pl.concat(counted)


@pytest.mark.slow
@given(leagues)
@settings(max_examples=8)
def test_all_at_once(found):
    """All matches at once give the patterns and grams of each match and team by itself."""
    tables, sides = league_of(found)
    learned = learn(tables.values, sides, ANY)
    patterns, counted = one_by_one(tables, sides)
    assert_frame_equal(learned.patterns, patterns, check_exact=True)
    assert_frame_equal(learned.grams, counted, check_exact=True)
    assert Patterns.is_valid(learned.patterns)
    assert Grams.is_valid(learned.grams)


@pytest.mark.slow
@given(leagues, st.randoms(use_true_random=False))
@settings(max_examples=10)
def test_any_order_and_chunks(found, random):
    """Neither order, nor chunks, nor reading again make a difference; decisions are those of each match by itself."""
    tables, sides = league_of(found)
    whole = learn(tables.values, sides, ANY)
    shuffled = list(tables.values())
    random.shuffle(shuffled)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(league, "_CHUNK", 10)
        patch.setattr(league, "_KEPT", 15)
        again = learn(lambda: shuffled, sides, ANY)
        together = all_decisions(lambda: shuffled, sides, whole.patterns, Choices.empty())
    assert_frame_equal(again.patterns, whole.patterns, check_exact=True)
    assert_frame_equal(again.grams, whole.grams, check_exact=True)
    assert again.reports == whole.reports
    for n, maps in whole.maps.items():
        for team, som in maps.items():
            assert np.array_equal(som.weights, again.maps[n][team].weights)
    alone = []
    for name, table in tables.items():
        known = pl.concat([whole.patterns.filter(**team._asdict()).with_columns(who=pl.lit(SIDES.index(side), pl.Int64)) for side, team in sides[name].items()])
        alone.append(observed_decisions(table.with_columns(who=pl.col("team").to_physical().cast(pl.Int64)), known))
    assert_frame_equal(together, pl.concat([Decisions.empty(), *(part.cast(pl.Schema(Decisions.dtypes())) for part in alone)]), check_exact=True)


@given(leagues, st.data())
@settings(max_examples=10)
def test_digests(found, data):
    """A match has the same digest exactly if it has the same rows, whatever the other matches have."""
    tables, sides = league_of(found)
    patterns = learn(tables.values, sides, ANY).patterns
    rows = all_decisions(tables.values, sides, patterns, Choices.empty())
    said = decision_digests(rows)
    assert said.keys() == set(rows["match_id"])
    for name, part in rows.group_by("match_id"):
        assert decision_digests(part) == {name[0]: said[name[0]]}
        at = data.draw(st.integers(0, part.height - 1))
        for column in ("t_ns", "state", "reward", "value"):
            other = part.with_columns(pl.when(pl.int_range(pl.len()) == at).then(pl.col(column) + 1).otherwise(column))
            assert decision_digests(other)[name[0]] != said[name[0]]
        other = part.with_columns(pl.when(pl.int_range(pl.len()) != at).then("behaviour_id"))
        assert decision_digests(other)[name[0]] != said[name[0]]


def test_one_pass():
    """A single pass keeps no chunk: it holds the rows of one in memory, however many matches there are."""
    tables, sides = league_of([([1, 11], [1], (ONE, TWO))] * 5)
    seen: list[weakref.ref[pl.DataFrame]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(league, "_CHUNK", 1)
        chunks = league.LeagueSequences(tables.values, sides)
        for chunk in chunks.once():
            seen.append(weakref.ref(chunk))
        del chunk
        assert len(seen) > 5
        assert [found() for found in seen] == [None] * len(seen)
        assert pl.concat(chunks).equals(pl.concat(chunks.once()))


def test_nobody():
    """If no side counts there is nothing to learn."""
    tables, _ = league_of([([1, 11], [1], (ONE, TWO))])
    learned = learn(tables.values, {name: {} for name in tables}, ANY)
    assert (learned.patterns.height, learned.grams.height, learned.maps, learned.reports) == (0, 0, {}, [])


#: Values are known of these minutes, and groups are selected that are not surely good.
SETTINGS = Settings(
    models=ModelSettings(goals_at_least=2, block_s=5), behaviours=BehaviourSettings(select_by="value", shrink=False))


def brought(folder: Path, matches: int) -> Store:
    """A data folder with so many stretches of the sample as matches of their own."""
    store = Store(folder)
    for number in range(matches):
        file = folder / f"part-{number}.csv"
        folder.mkdir(exist_ok=True)
        clip(60.0 * number, 60.0 * number + 40.0).write_csv(file)
        take_in(store, Recording(file=file))
        file.unlink()
    return store


def contents(store: Store) -> dict[str, str]:
    """SHA-256 of all files of the outputs."""
    return {label: sha256 for noun in STAGES.of_matches for receipt in store.receipts(noun)
            for label, sha256 in receipt.digests().items()}


@pytest.mark.slow
def test_one_more_match(tmp_path):
    """One more match gives the bytes of doing all of it again, and no output of another match is made anew."""
    store = brought(tmp_path / "grown", 3)
    STAGES.make(store, SETTINGS, scope_of(store))
    before = {(noun, receipt.name): receipt.key for noun in STAGES.nouns(Per.MATCH) for receipt in store.receipts(noun)}
    brought(tmp_path / "grown", 4)
    STAGES.make(store, SETTINGS, scope_of(store))
    after = {(noun, receipt.name): receipt.key for noun in STAGES.nouns(Per.MATCH) for receipt in store.receipts(noun)}
    assert before.items() <= after.items()
    again = brought(tmp_path / "again", 4)
    shutil.copytree(store.root / "models", again.root / "models")  # they stand until there are twice as many matches
    STAGES.make(again, SETTINGS, scope_of(again))
    assert contents(again) == contents(store)


def test_usual():
    """Where nothing pays a team keeps single situations, if so set; a longer behaviour that pays is enough of a role."""
    tables, sides = league_of([([1, 11, 21, 46] * 3, [1, 11, 46] * 3, (ONE, ONE))])
    dear = {"value_over": 9.0, "shrink": True}
    found = {usual: learn(tables.values, sides, ANY.model_copy(update=dear | {"usual": usual})).patterns for usual in (False, True)}
    assert found[False].is_empty()
    assert set(found[True].select("role", "n").iter_rows()) == {("midfield", 1), ("striker", 1)}
    both = [learn(tables.values, sides, ANY.model_copy(update={"usual": usual})).patterns for usual in (False, True)]
    assert both[0].equals(both[1])
    assert both[0].filter(pl.col("n") > 1)["role"].n_unique() == 2
