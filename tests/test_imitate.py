"""Imitation: a team's habits, learned from the motion of its robots."""

import re

import numpy as np
import polars as pl
import pytest
from support.played import whole
from test_scout import test_links_lead_somewhere as leads_somewhere

from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.appraising import action_values_at, appraiser_of
from pitchlore.pipeline.engine.habits import Poses, habitual, newer_matches
from pitchlore.pipeline.engine.imitations import imitation_of
from pitchlore.pipeline.engine.inputs import StoreInputs
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.policies import way_of_play
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.numbers.trees import logits, trees_of
from pitchlore.pipeline.settings import (
    AppraisalSettings,
    HabitSettings,
    KnowledgeSettings,
    OptionSettings,
    PolicySettings,
    Settings,
)
from pitchlore.pipeline.stages.options import of_team
from pitchlore.pipeline.stages.options.of_team import habits, team_habits
from pitchlore.pipeline.stages.options.runs import as_done, as_logged
from pitchlore.pipeline.stages.policies.appraise import fit_action_values
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.store.work import Made
from pitchlore.pipeline.views.scout.alike import described, likeness, spectrum
from pitchlore.pipeline.views.scout.content.write import write_pages
from pitchlore.schemas import (
    ROLES,
    Appraisals,
    Behaviours,
    Clues,
    Decisions,
    Games,
    Habits,
    HabitTrees,
    Options,
    Policies,
    Sights,
)
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.sights import SIGHT

SETTINGS = HabitSettings(rounds=2, trees=20, leaf_samples=20)
#: Places of three options that the robots of these tests know.
NEAR, FAR, NEVER = OPTIONS.index(44), OPTIONS.index(88), OPTIONS.index(184)


def watched(windows: int = 600, told: float = 0.5, seed: int = 0) -> tuple[pl.DataFrame, np.ndarray]:
    """A robot that takes NEAR where the ball is on its left half, else FAR; some windows tell nothing of it."""
    rng = np.random.default_rng(seed)
    sight = np.zeros((windows, len(SIGHT)), dtype=np.float32)
    sight[:, 0] = rng.uniform(-1, 1, windows)
    done = np.where(sight[:, 0] < 0, NEAR, FAR)
    ratios = np.zeros((windows, len(OPTIONS)), dtype=np.float32)
    clear = rng.random(windows) < told
    ratios[np.flatnonzero(clear), done[clear]] = 6.0
    at = np.arange(windows) * 200_000_000
    table = pl.DataFrame({
        "match_id": [f"match-{w % 2}" for w in range(windows)], "team": "home", "robot": 1, "role": "striker",
        "start_ns": at, "end_ns": at + 200_000_000, "segment": 0, "sight": pl.Series(sight),
        "ratios": pl.Series(ratios)})
    return table.cast(pl.Schema(Clues.dtypes())), done


def imitate(clues: pl.DataFrame, version: int = 1) -> tuple[pl.DataFrame, pl.DataFrame]:
    """A policy that does as a team does."""
    return habitual(*team_habits(clues, Team("blue", "vsss"), SETTINGS, 3), version)


def test_windows_that_do_not_tell():
    """A window whose motion tells nothing gets the option that the team has at such an observation."""
    table, done = watched()
    sight, ratios = (table[name].to_numpy() for name in ("sight", "ratios"))
    _, posterior = habits(ratios, sight, np.full(len(done), 2), np.arange(len(done)) % 2, SETTINGS)
    silent = (ratios == 0).all(axis=1)
    assert silent.mean() > 0.4
    assert (posterior.argmax(axis=1)[silent] == done[silent]).mean() > 0.9


def test_policy():
    """The policy offers what the team did, and prefers it where the team did it."""
    pairs, appraisals = imitate(watched()[0], 7)
    assert set(pairs["behaviour_id"]) == {"striker-044", "striker-088"}
    assert pairs["value"].sum() == pytest.approx(1.0, abs=0.05)
    assert appraisals["version"].unique().to_list() == [7]
    rows = pairs.select(
        pl.lit(7).alias("version"), pl.lit(1).alias("knowledge_version"), "role", "key", "state", "behaviour_id",
        q="initial", visits=pl.lit(0), evidence=pl.lit(0.0)).select(list(Policies.dtypes()))
    values, _ = appraiser_of(rows.cast(pl.Schema(Policies.dtypes())), appraisals)
    sight = np.zeros((2, len(SIGHT)), dtype=np.float32)
    sight[:, 0] = -0.5, 0.5
    worth = action_values_at(values, sight)
    near, far = (values.codes.tolist().index(code) for code in (44, 88))
    assert worth[near, 0] > worth[far, 0]
    assert worth[near, 1] < worth[far, 1]


@pytest.mark.parametrize("windows", [0, 1, 30])
def test_little_to_learn_from(windows):
    """A team that was hardly seen gives a policy of what there is."""
    pairs, appraisals = imitate(watched(windows)[0])
    assert pairs.height <= 2 * len(ROLES)
    assert appraisals["code"].n_unique() == pairs["behaviour_id"].n_unique()


@pytest.mark.slow
def test_run_copies(copied, monkeypatch):
    """A run copies the imitated team, by the clues that all matches would give; the same clues are not learned from twice.

    Without habits it is the paper's learner, whose tables are the same as if that had been asked for.
    """
    store, habits = Store(copied), HabitSettings(rounds=1, trees=5)
    newest = Settings(knowledge=KnowledgeSettings(habits=habits))
    every = Settings(knowledge=KnowledgeSettings(habits=habits), options=OptionSettings(recover=True))
    assert newest.knowledge.recover == every.options
    assert every.knowledge.recover is None
    scope, stage = scope_of(store), STAGES["knowledge"]

    def made(settings: Settings) -> tuple[Manifest, Manifest]:
        known, policy = (emit(store, STAGES[noun], STAGES[noun].settings(settings), scope)[0] for noun in ("knowledge", "policies"))
        assert policy.details["knowledge_version"] == known.version
        return known, policy

    def tables(*versions: Manifest) -> list[pl.DataFrame]:
        return [table_of(store, held, schema).drop("version", "knowledge_version", strict=False)
                for held in versions for schema in STAGES[held.noun].schemas if schema.NAME in held.files]

    known, policy = made(newest)
    assert table_of(store, policy, Appraisals).height
    assert "copies blue (vsss)" in way_of_play(policy)
    assert known.details["habits"]["matches"] == 2
    monkeypatch.setattr(of_team, "team_habits", None)
    again = stage.compute(StoreInputs(store, stage.plan(store, scope, newest.knowledge, stage).receipts, version=9), newest.knowledge)
    assert [table.drop("version").equals(before) for (table, _), before in zip(again.tables[2:], tables(known)[2:], strict=True)] == [True] * 2
    monkeypatch.undo()
    monkeypatch.setattr("pitchlore.pipeline.engine.habits.MANY", 1)
    with placed("processes:2", copied):
        anew = StoreInputs(store, stage.plan(store, scope, newest.knowledge, stage).receipts | {"before": []}, version=9)
        spread = stage.compute(anew, newest.knowledge)
    assert [table.drop("version").equals(before) for (table, _), before in zip(spread.tables, tables(known), strict=True)] == [True] * 4
    monkeypatch.undo()
    short = newest.knowledge.model_copy(update={"habits": habits.model_copy(update={"windows_at_most": 500})})
    few = stage.compute(StoreInputs(store, stage.plan(store, scope, short, stage).receipts, version=9), short)
    assert few.details["habits"]["matches"] == len(few.details["habits"]["of"]) == 1
    assert few.details["habits"]["windows"] <= 500
    later = policy.model_copy(update={"details": policy.details | {"copy_of": {"matches": 2, "newest": "m", "newer": 1}}})
    assert "Its habits are those of 2 matches, up to m; 1 match is newer, and waits" in way_of_play(later)
    assert re.search(r"Its habits are those of 2 matches, up to \S+\.$", way_of_play(policy))

    paper = Settings(policies=PolicySettings(learner="sarsa"))
    known_states, by_states = made(paper)
    none = made(paper.model_copy(update={"policies": PolicySettings(sweeps=6)}))
    assert none[0] == known_states
    assert none[1] != by_states
    assert made(paper.model_copy(update={"policies": PolicySettings(sweeps=6, learner="sarsa")})) == none, "it holds the same"
    assert "no copy" not in way_of_play(by_states)
    assert "It is no copy: options are recovered where `recover` is on" in way_of_play(none[1])
    elsewhere = none[1].model_copy(update={"details": none[1].details | {"imitates": {"team": "Carrossel", "kind": "2d"}}})
    assert "in the league vsss alone, and none of Carrossel (2d) were" in way_of_play(elsewhere)

    STAGES.make(store, every, scope, {"options"})
    assert [one.equals(other) for one, other in zip(tables(*made(every)), tables(known, policy), strict=True)] == [True] * 8


@pytest.mark.slow
def test_rebuilt_team(copied, call, tmp_path):
    """A team is rebuilt beside the folder's tables; it plays, and decides in each window; again, nothing is new.

    A page says how much of its robots' time is known, and, once the copy has played, how like the team it plays.
    """
    before = {path: path.read_bytes() for path in copied.rglob("*.receipt.json")}
    (tmp_path / "small.toml").write_text("[knowledge.habits]\nrounds = 1\ntrees = 5\nwindows_at_most = 1000\n")
    words = ("imitate", "blue", "--settings", tmp_path / "small.toml", "--data", copied)
    code, said, _ = call(*words)
    assert (code, "imitated:blue is rebuilt from 2 of its matches (policy version 1, new)" in said) == (0, True)
    assert {path: path.read_bytes() for path in before} == before
    policies: dict[str, PolicyTables] = {}
    team = entrant(Store(copied), "imitated:blue", policies).settings
    assert team.clock_s == 0.2
    recipe = Recipe(home=team, away=TeamSettings(kind="static"), seed=1, referee=RefereeSettings(duration_s=10.0))
    decided = whole(MatchInPlay(recipe, controllers_of(recipe, policies))).decisions
    assert decided.height > 100
    assert decided["random"].mean() < 0.1
    assert "(policy version 1, unchanged)" in call(*words)[1]
    own = imitation_of(Store(copied), "blue")
    assert verify_all(Store(copied)).files > verify_all(own).files > 0
    # what is known is what was done: behaviours are of its options, and the policy offers its habits
    known = own.manifest("knowledge", 1)
    codes = set(table_of(own, known, Behaviours)["codes"].explode()) | set(table_of(own, known, Habits)["option"])
    assert codes <= {*OPTIONS}
    assert set(table_of(own, known, Behaviours)["team"]) <= {"blue"}
    offered = table_of(own, known, Habits).select(pl.format("{}-{}", "role", pl.col("option").cast(pl.String).str.zfill(3)))
    assert set(policies[team.policy].values["behaviour_id"]) == set(offered.to_series())
    pages = write_pages(Store(copied))
    (page,) = pages.first.parent.glob("copies/blue-*.html")
    shown = page.read_text()
    # of more windows than the settings allow, every so manyth of each match is learned from
    windows = 0
    for path in own.root.glob("options/*.clues.parquet"):
        clues = pl.read_parquet(path).filter(pl.col("team") == "home")
        windows += clues.gather_every(-(-clues.height // 500)).drop_nulls("role").height
    assert f"in 2 matches, in {windows} windows" in shown
    assert "<code>pitchlore record --home imitated:blue --away static --matches 10</code>" in shown
    recovered = League(imitation_of(Store(copied), "blue")).ask("""
        select role, avg(exists(select 1 from options o where o.match_id = t.match_id and o.team = t.team
            and o.robot = t.robot and o.start_ns <= t.t_ns and t.t_ns < o.end_ns)::int)
        from trajectories t join matches m using (match_id)
        where segment is not null and role is not null and t.team = if(m.home = 'blue', 'home', 'away') group by 1""")
    assert recovered.height == len(ROLES)
    for role, share in recovered.iter_rows():
        assert re.search(rf"<td>{role}</td><td[^>]*>[^<]*</td><td[^>]*>([^<]*)<", shown)[1] in (
            f"{share:.0%}".replace("%", "\xa0%"), f"{share:.1%}".replace("%", "\xa0%"))
    assert "logged" not in shown
    logs_its_options(copied, own, page)
    assert call("record", "--home", "imitated:blue", "--minutes", "0.5", "--data", copied)[0] == 0
    assert call("run", "--no-train", "--on", "threads:1", "--data", copied)[0] == 0
    again = write_pages(Store(copied))
    shown = page.read_text()
    assert "1 match of the copy, against static; 2 of the original, against yellow." in shown
    assert "In its own matches it drew 0\xa0% of its decisions at random" in shown
    assert re.findall(r"<tr><td>(its[^<]*)</td>", shown) == ["its own other matches", "its copy", "its adversaries"]
    leads_somewhere(again)
    begins_as_it(copied, known, call, tmp_path)


def logs_its_options(data, own, page):
    """The page says for how much of the time the team told its options: here in one of two matches, always 088."""
    first, second = own.receipts("options")
    table = table_of(own, first, Options).with_columns(logged=pl.lit(88, pl.Int16))
    work = STAGES["options"].work(first.name, OptionSettings(recover=True), first.inputs)
    own.commit(work, Made([(table, Options), (table_of(own, first, Clues), Clues)], details=first.details))
    page.unlink()
    write_pages(Store(data))
    seconds = dict(League(own).ask("""
        select match_id, count(*) from trajectories t join matches m using (match_id)
        where segment is not null and role is not null and t.team = if(m.home = 'blue', 'home', 'away')
            and exists(select 1 from options o where o.match_id = t.match_id and o.team = t.team
            and o.robot = t.robot and o.start_ns <= t.t_ns and t.t_ns < o.end_ns) group by 1""").iter_rows())
    share = seconds[first.name] / (seconds[first.name] + seconds[second.name])
    assert f"It logged {100 * share:.0f}\xa0% of what its robots did" in page.read_text()


def begins_as_it(data, known, call, tmp_path):
    """An apprentice begins a season as the imitation, and its policies keep the habits beside what it tries."""
    (tmp_path / "short.toml").write_text(
        'base = "looking-held"\ngames = 2\npractice = 0\nexplore_counted = true\n[referee]\nduration_s = 20\n')
    words = ("season", "--settings", tmp_path / "short.toml", "--opponent", "static", "--on", "threads:1", "--data", data)
    assert call(*words, "--start", "imitated:blue")[0] == 0
    (receipt,) = Store(data).receipts("seasons")
    assert receipt.name == "short-as-imitated-blue-static-1"
    own = Store(data / receipt.details["store"])
    games = Store(data).read_table(receipt, "games", Games)
    assert games["policy_version"].to_list() == [1, 2]
    habits = [table_of(own, own.manifest("knowledge", version), HabitTrees).drop("version") for version in (1, 2, 3)]
    assert habits[0].equals(habits[1])
    assert habits[1].equals(habits[2])
    appraised = table_of(own, own.manifest("policies", 3), Appraisals)
    assert set(appraised["code"]) == {*OPTIONS}, "those that it did not try have habits alone"
    untried = appraised.filter(pl.col("tree").max().over("code") == 0)["code"][0]
    assert appraised.filter(code=untried)["value"].to_list() == pytest.approx(
        (0.02 * habits[0].filter(code=untried)["value"]).to_list())
    assert call(*words, "--start", "blue")[2] == (
        "pitchlore: --start: 'blue' is no imitation. Name imitated:TEAM.\n")
    assert "does not decide by what it sees" in call("season", "--settings", "best", "--start", "imitated:blue", "--data", data)[2]


#: Matches of a team, the newest first, with the rows of its poses; and how many wait, where habits were learned from c and b.
NEWER = {
    "cba": ({"c": 10, "b": 10, "a": 10}, 0), "one older": ({"c": 10, "b": 10, "aa": 50}, 0),
    "a short one": ({"d": 6, "c": 10, "b": 10}, 1), "two short ones": ({"e": 3, "d": 3, "c": 10, "b": 10}, 2),
    "a third": ({"d": 7, "c": 10, "b": 10}, None), "one is gone": ({"c": 10, "a": 10}, None), "none": ({}, None),
}


@pytest.mark.parametrize(("there", "expected"), NEWER.values(), ids=NEWER)
def test_habits_stand(there, expected):
    """Habits stand until a third of the newest poses is new, one of their matches is gone or is another, or the team is."""
    blue, poses = Team("blue", "vsss"), {match: Poses(f"of {match}", rows) for match, rows in there.items()}
    version = Manifest.model_construct(details={
        "imitates": blue._asdict(), "habits": {"of": {"c": "of c", "b": "of b"}}})
    assert newer_matches(version, blue, poses) == expected
    assert newer_matches(version, Team("blue", "2d"), poses) is None
    assert newer_matches(version, blue, poses | {"b": Poses("mended", 10)}) is None
    before = Manifest.model_construct(details={"imitates": blue._asdict(), "habits": {"windows": 9}})
    assert newer_matches(before, blue, poses) is None


def test_runs_of_options():
    """Neighbours that are the same option, but for target or what was logged, are one row of a sequence."""
    rows = [{"match_id": "m", "team": "home", "robot": 1, "role": role, "start_ns": start, "end_ns": start + 2,
             "option": option, "probability": 0.9, "target": target, "logged": None, "segment": segment}
            for start, option, target, segment, role in (
                (0, 44, "ball", 0, "striker"), (2, 44, None, 0, "midfield"), (4, 88, None, 0, "midfield"),
                (6, 88, None, 1, "midfield"), (9, 88, None, 1, "midfield"), (11, 88, None, 1, None))]
    done = as_done(Options.of(rows))
    assert done.select("code", "start_ns", "end_ns", "segment").rows() == [(44, 0, 4, 0), (88, 4, 6, 0), (88, 6, 8, 1), (88, 9, 11, 1)]
    assert done["role"][0] == "striker"


def test_what_is_logged_is_known():
    """An option that the team logged is beyond doubt, whatever the motion says; other codes and windows are not."""
    table, _ = watched(4)
    rows = [{"match_id": "match-0", "team": "home", "robot": 1, "role": "striker", "start_ns": start, "end_ns": end,
             "option": 44, "probability": 0.5, "target": "ball", "logged": logged, "segment": 0}
            for start, end, logged in ((0, 300_000_000, 88), (300_000_000, 500_000_000, 194), (600_000_000, 700_000_000, None))]
    options = Options.of(rows)
    known = as_logged(table, options)["ratios"].to_numpy()
    assert known[:2].argmax(axis=1).tolist() == [OPTIONS.index(88)] * 2
    assert (known[2:] == table["ratios"].to_numpy()[2:]).all()
    assert as_done(options)["code"].to_list() == [88, 44, 44]


def test_habits_count():
    """An action is worth its appraisal, and its habit times their weight."""
    observation, actions = np.zeros((1, len(SIGHT)), dtype=np.float32), pl.DataFrame({"behaviour_id": ["striker-044"], "role": ["striker"]})
    _, trees = team_habits(watched()[0], Team("blue", "vsss"), SETTINGS, 3)
    for weight in (0.0, 0.05):
        found, _ = fit_action_values(
            Decisions.empty(), Sights.empty(), actions, AppraisalSettings(habits=weight), 1, habits=trees)
        alone = logits(trees_of(trees.filter(code=44)), observation)[0] * weight
        assert (logits(trees_of(found.filter(code=44)), observation)[0] if weight else 0.0) == pytest.approx(alone)


def test_alike():
    """A team is as near to a copy that does the same as to its own other matches, and told from one that does not."""
    rng = np.random.default_rng(0)
    shares = {role: rng.dirichlet(np.ones(3)) for role in ROLES}

    def played(codes: list[int]) -> np.ndarray:
        return described(pl.DataFrame([
            {"role": role, "code": code} for role in ROLES for code in rng.choice(codes, 40, p=shares[role])]))

    teams = {name: np.array([played(codes) for _ in range(count)]) for name, codes, count in (
        ("own", [1, 11, 21], 12), ("same", [1, 11, 21], 9), ("other", [44, 46, 47], 7), ("nobody", [], 0))}
    assert np.square(teams["own"]).sum(axis=1) == pytest.approx(1)
    assert sum(spectrum(list(teams["own"])).values()) == pytest.approx(1)
    itself, same, other = likeness(teams.pop("own"), teams)
    assert (itself.matches, itself.rival, same.rival, other.rival) == (6, "its own other matches", "same", "other")
    assert same.distance < 1.5 * itself.distance < 0.5 * other.distance
    assert itself.auc == pytest.approx(0.5, abs=0.1)
    assert other.auc == 1.0 > itself.most[1] > 0.5
    few = likeness(teams["same"][:3], {"other": teams["other"]})
    assert [(each.matches, each.auc) for each in few] == [(1, None), (1, None)]
    assert likeness(teams["same"][:1], {"other": teams["other"]}) == []


def test_nobody_to_rebuild(finished, call):
    """A name that no match has is refused with those that there are; a team that nobody rebuilt does not play."""
    assert call("imitate", "red", "--data", finished)[2] == (
        f"pitchlore: {finished}: no match is of a team 'red' (there are: blue, yellow). Import its matches first.\n")
    assert call("evaluate", "--policy", "imitated:the reds", "--against", "static", "--data", finished)[2] == (
        f"pitchlore: {finished}: nothing imitates 'the reds' yet. Make it with `pitchlore imitate 'the reds'`.\n")
