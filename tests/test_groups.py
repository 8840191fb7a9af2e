"""Learning match by match: behaviours of one match alone, players that log, knowledge that adds up."""

import dataclasses
import io
import json
import shutil

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal
from support.mcap_logs import written

from pitchlore.pipeline import matches as log_format
from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.engine.catalog import catalog_path, refresh
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.engine.versions import emit as emit_version
from pitchlore.pipeline.settings import (
    BehaviourSettings,
    GramSettings,
    KnowledgeSettings,
    PolicySettings,
    Settings,
    SideSettings,
)
from pitchlore.pipeline.stages.decisions import decision_digests
from pitchlore.pipeline.stages.knowledge import merge_behaviours, merge_occasions, occasions
from pitchlore.pipeline.stages.sequences.windows import windows
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.pipeline.state.table import LEVELS
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.schemas import (
    Behaviours,
    Decisions,
    Goals,
    Grams,
    Occasions,
    Patterns,
    Policies,
    Sequences,
    Sides,
    Situations,
)

S = 1_000_000_000
#: A clip has too few goals for a model of V, so groups are selected as the paper does.
SETTINGS = Settings(
    sides=SideSettings(pools={"both": ("*",)}), grams=GramSettings(outcome="paper"),
    behaviours=BehaviourSettings(select_by="value", shrink=False))
PLAYED = "played-0123456789ab"
ADDS_UP = KnowledgeSettings(accumulate=True, backoff=("self9", "role0"), own="chosen")


def chosen_by_home() -> pl.DataFrame:
    """Log of the home team of the played match: robot 1 decides every five seconds."""
    rows = [
        (PLAYED, "home", 1, "striker", k * 5 * S, (k + 1) * 5 * S, (k * 7**17) % int(LEVELS.prod()),
         (None, "striker-001-011", "striker-099-099-099")[k % 3], True, k % 3 == 0, 0.0, 0, None, 0.0)
        for k in range(10)
    ]
    return Decisions.validate(pl.DataFrame(rows, schema=Decisions.dtypes(), orient="row"))


@pytest.fixture(scope="module")
def played(tmp_path_factory, clips) -> Store:
    """A store of a recording and of the same match as if we had played it, up to the goals."""
    store = Store(tmp_path_factory.mktemp("played"))
    recorded, *_ = take_in(store, Recording(file=clips / "early.parquet"))
    log = log_format.read(store.read(recorded, "log"), where="log")
    named = pl.lit(PLAYED).alias("match_id")
    ours = dataclasses.replace(
        log, info=log.info.model_copy(update={"match_id": PLAYED, "source": "played", "recording": None}),
        referee=log.referee.with_columns(named), quality=log.quality.with_columns(named), decisions=chosen_by_home())
    (store.root / "played.mcap").write_bytes(written(ours))
    take_in(store, Recording(file=store.root / "played.mcap"))
    STAGES.make(store, SETTINGS, scope_of(store), ("trajectories", "situations", "goals"))
    return store


@pytest.fixture
def store(played, tmp_path) -> Store:
    return Store(shutil.copytree(played.root, tmp_path / "data"))


def group(match: str) -> Scope:
    return Scope(matches=(match,), group=match)


def learn(store: Store, scope: Scope, settings: Settings = SETTINGS) -> None:
    """All rounds and the decisions of a scope."""
    STAGES.make(store, settings, scope)


def emit(store: Store, settings: KnowledgeSettings, scope: Scope):
    return emit_version(store, STAGES["knowledge"], settings, scope)


def recording_of(store: Store) -> str:
    return next(receipt.name for receipt in store.receipts("matches") if receipt.name != PLAYED)


def table(store, noun, name, role, schema) -> pl.DataFrame:
    return store.read_table(store.receipt(noun, name), role, schema)


def version(store, manifest) -> tuple[pl.DataFrame, pl.DataFrame]:
    return tuple(store.read_table(manifest, *of) for of in (("behaviours", Behaviours), ("occasions", Occasions)))


class TestGroups:
    def test_match_alone(self, store):
        """A group makes behaviours of its match alone."""
        name = recording_of(store)
        learn(store, group(name))
        assert [r.name for r in store.receipts("behaviours")] == [name]
        found = table(store, "behaviours", name, "patterns", Patterns)
        learn(store, Scope(matches=(name,)))
        whole = table(store, "behaviours", "all", "patterns", Patterns)
        assert found.height > 0
        assert_frame_equal(found, whole)

    def test_refused_group(self, store):
        """A group that is refused leaves out its match only; behaviours of the whole store, none."""
        name = recording_of(store)
        for match in (name, PLAYED):
            learn(store, group(match))
        store.quarantine("behaviours", "all", ValueError("no"))
        assert len(scope_of(store).matches) == 2
        refresh(store)
        rows = "select distinct match_id from decisions order by match_id"
        assert set(ask(catalog_path(store), rows)["match_id"]) == {name, PLAYED}
        store.quarantine("behaviours", name, ValueError("no"))
        assert scope_of(store).matches == (PLAYED,)
        refresh(store)
        assert ask(catalog_path(store), rows)["match_id"].to_list() == [PLAYED]
        assert set(ask(catalog_path(store), "select distinct match_id from values")["match_id"]) == {name, PLAYED}


@pytest.mark.parametrize("share_of", ["groups", "situations"])
def test_learned_teams(store, share_of):
    """Behaviours are of the teams that are learned from."""
    any_of = SETTINGS.behaviours.model_copy(update={"share_of": share_of, "value_over": -1.0})
    scope = group(recording_of(store))
    (name,) = scope.matches
    away = SideSettings(watch=("away",))
    learn(store, scope, SETTINGS.model_copy(update={"behaviours": any_of, "sides": away}))
    theirs = table(store, "behaviours", name, "grams", Grams).filter(n=4)
    found = table(store, "behaviours", name, "patterns", Patterns).filter(n=4)
    assert found.height > 0
    joined = found.join(theirs, on=("role", "codes"), how="left", maintain_order="left")
    assert joined["support"].to_list() == joined["count"].to_list()
    seen = table(store, "situations", name, "situations", Situations)
    own = table(store, "sequences", name, "sequences", Sequences).filter(pl.col("team") == "away")
    whole = {"groups": len(windows(own, 4).first), "situations": seen.filter(pl.col("team") == "away").height}[share_of]
    (report, *_) = store.receipt("behaviours", name).details["reports"]
    assert report["threshold"] == pytest.approx(0.1 * whole)
    assert found["team"].unique().to_list() == [report["team"]] == [store.receipt("matches", name).details["away"]]


class TestTeams:
    """Each team has knowledge of its own, unless the settings pool it or leave it out."""

    APART = SETTINGS.model_copy(update={
        "sides": SideSettings(), "behaviours": SETTINGS.behaviours.model_copy(update={"value_over": -1.0})})

    def learned(self, store, settings, **knowledge):
        scope = group(recording_of(store))
        learn(store, scope, settings)
        manifest, _ = emit(store, KnowledgeSettings(**knowledge), scope)
        return manifest, *version(store, manifest)

    def test_apart(self, store):
        """A behaviour's support is that of its team alone, and so are its occasions; each team has its maps."""
        manifest, known, seen = self.learned(store, self.APART)
        match = store.receipt("matches", recording_of(store)).details
        names = {"home": match["home"], "away": match["away"]}
        assert set(known["team"]) == set(names.values())
        for side, name in names.items():
            counted = table(store, "behaviours", recording_of(store), "grams", Grams).filter(team=name)
            own = known.filter(team=name)
            assert own.join(counted.select("role", "codes", "count"), on=("role", "codes"), how="left", maintain_order="left")["count"].equals(
                own["support"], check_names=False)
            decided = table(store, "decisions", recording_of(store), "decisions", Decisions).filter(pl.col("team") == side)
            assert set(decided["behaviour_id"]) <= set(own["behaviour_id"])
            assert seen.filter(team=name).group_by("key").agg(pl.col("count").sum())["count"].to_list() == [decided.height] * 3
        labels = json.loads(np.load(io.BytesIO(store.read(manifest, "maps-n1")))["labels"].tobytes())
        assert labels == [[name, "vsss"] for name in sorted(names.values())]
        assert [team["team"] for team in manifest.details["teams"]] == sorted(names.values())
        assert manifest.details["imitates"] == {"team": match["home"], "kind": "vsss"}, "it scored more"

    def test_left_out(self, store):
        """A team that is left out has neither behaviours nor occasions; the other's are what they were."""
        _, whole, occurred = self.learned(store, self.APART)
        away = store.receipt("matches", recording_of(store)).details["away"]
        alone = self.APART.model_copy(update={"sides": SideSettings(teams=(away,))})
        manifest, known, seen = self.learned(store, alone)
        assert_frame_equal(known.drop("version"), whole.filter(team=away).drop("version"))
        assert_frame_equal(seen.drop("version"), occurred.filter(team=away).drop("version"))
        assert manifest.details["imitates"]["team"] == away

    def test_imitated(self, store):
        """A policy values what the knowledge has of the team that it imitates, and nothing else."""
        home = store.receipt("matches", recording_of(store)).details["home"]
        manifest, _, seen = self.learned(store, self.APART, imitate=home)
        assert manifest.details["imitates"]["team"] == home
        policy, _ = emit_version(store, STAGES["policies"], PolicySettings(), group(recording_of(store)))
        rows = store.read_table(policy, "policies", Policies)
        pair = ["role", "key", "state", "behaviour_id"]
        assert_frame_equal(rows.select(pair), seen.filter(team=home).select(pair))
        assert policy.details["imitates"]["team"] == home
        away, _, seen = self.learned(store, self.APART, imitate=store.receipt("matches", recording_of(store)).details["away"])
        assert away.version == manifest.version + 1, "the tables are the same, the team is not"
        other, new = emit_version(store, STAGES["policies"], PolicySettings(), group(recording_of(store)))
        assert (new, other.details["imitates"], other.parent) == (True, away.details["imitates"], None)
        with pytest.raises(NotFound, match=r"no team 'nobody' counts"):
            self.learned(store, self.APART, imitate="nobody")

    def test_nobody(self, store):
        """If no side counts there is knowledge of nothing, and a policy of nothing."""
        manifest, known, seen = self.learned(store, SETTINGS.model_copy(update={"sides": SideSettings(kind="ssl")}))
        assert (known.height, seen.height, manifest.details["imitates"]) == (0, 0, None)
        policy, _ = emit_version(store, STAGES["policies"], PolicySettings(), group(recording_of(store)))
        assert store.read_table(policy, "policies", Policies).is_empty()


class TestDecisions:
    def test_logged_decisions(self, store):
        """A team's decisions are those that it logged, with values computed anew."""
        learn(store, group(PLAYED))
        found = table(store, "decisions", PLAYED, "decisions", Decisions)
        own, others = found.filter("chosen"), found.filter(~pl.col("chosen"))
        assert_frame_equal(own.drop("value"), chosen_by_home().drop("value"))
        scored = table(store, "goals", PLAYED, "goals", Goals)
        for t_ns, worth in own.select("t_ns", "value").rows():
            follows = [goal for goal in scored.select("t_ns", "team").rows() if goal[0] > t_ns][:1]
            expected = sum((1 if team == "home" else -1) * 0.998 ** ((at - t_ns) / S * 30) for at, team in follows)
            assert worth == pytest.approx(expected, abs=1e-8)
        assert own["value"].abs().max() > 0
        assert others["team"].unique().to_list() == ["away"]
        assert store.receipt("decisions", PLAYED).details == {
            "decisions": found.height, "chosen": own.height,
            "matches": {PLAYED: {"sha256": decision_digests(found)[PLAYED], "choosing": ["home"]}}}

    def test_other_team(self, store):
        """The other team's decisions are what they are without a log."""
        name = recording_of(store)
        for match in (name, PLAYED):
            learn(store, group(match))
        seen, ours = (table(store, "decisions", match, "decisions", Decisions).filter(pl.col("team") == "away")
                      for match in (name, PLAYED))
        assert not seen["chosen"].any()
        assert_frame_equal(seen.drop("match_id"), ours.drop("match_id"))


class TestAddingUp:
    def test_new_match(self, store):
        """A version is the knowledge before and what is new, if that is asked for; a pool is one team."""
        name = recording_of(store)
        learn(store, group(name))
        first, new = emit(store, ADDS_UP, group(name))
        assert (first.version, first.parent, new, first.details["matches"]) == (1, None, True, 1)
        learn(store, group(PLAYED))
        second, new = emit(store, ADDS_UP, group(PLAYED))
        assert (second.version, second.parent, new, second.details["matches"]) == (2, 1, True, 2)
        known, seen = version(store, first)
        assert set(known["team"]) == set(seen["team"]) == {"both"}
        patterns = table(store, "behaviours", PLAYED, "patterns", Patterns)
        alone = patterns.with_columns(version=pl.lit(2, pl.Int32)).select(list(Behaviours.dtypes()))
        both = merge_behaviours([known, alone], 2)
        known, _ = version(store, second)
        assert_frame_equal(known, both)
        decided = table(store, "decisions", PLAYED, "decisions", Decisions), table(store, "sides", PLAYED, "sides", Sides)
        later = occasions([decided], Team("both", "vsss"), 2, ADDS_UP, known.filter("kept")["behaviour_id"])
        assert_frame_equal(version(store, second)[1], merge_occasions([seen, later], 2, ADDS_UP))
        assert "striker-099-099-099" not in later["behaviour_id"].to_list(), "no version of ours knows it"
        by_the_state_key = version(store, second)[1].filter(pl.col("key") == "full36")
        assert second.details["occasions"] == by_the_state_key.height
        alone, _ = emit(store, KnowledgeSettings(), group(PLAYED))
        assert alone.details["matches"] == 1
        assert not any(label.startswith("parent/") for label in alone.inputs)

    def test_same_team(self, store):
        """Later versions imitate the team that the first does, whoever played since; matches add up by team."""
        name, apart = recording_of(store), SETTINGS.model_copy(update={"sides": SideSettings()})
        match = store.receipt("matches", name).details
        learn(store, group(name), apart)
        first, _ = emit(store, ADDS_UP.model_copy(update={"imitate": match["away"]}), group(name))
        home = SETTINGS.model_copy(update={"sides": SideSettings(watch=("home",))})
        learn(store, group(PLAYED), home)
        second, _ = emit(store, ADDS_UP, group(PLAYED))
        for version_ in (first, second):
            assert version_.details["imitates"] == {"team": match["away"], "kind": "vsss"}
        assert {team["team"]: team["matches"] for team in second.details["teams"]} == {match["home"]: 2, match["away"]: 1}

    def test_same_match(self, store):
        """The same match is never added again, and is refused under other settings."""
        scopes = [group(recording_of(store)), group(PLAYED)]
        for scope in scopes:
            learn(store, scope)
            assert emit(store, ADDS_UP, scope)[1]
        for number, scope in enumerate(scopes, start=1):
            assert emit(store, ADDS_UP, scope) == (store.manifest("knowledge", number), False)
        other = ADDS_UP.model_copy(update={"optimistic": 0.5})
        with pytest.raises(BadSettings, match=f"knowledge version 2 holds {scopes[0].group} already"):
            emit(store, other, scopes[0])
        assert store.versions("knowledge") == [1, 2]
