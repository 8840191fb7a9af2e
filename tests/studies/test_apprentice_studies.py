"""Every study of apprentices runs, on a tiny setting, and its controls do what they say."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import best_constant.study
import harness
import imitation.study
import looking.decisions
import looking.learners
import looking.measuring
import looking.seconds
import looking.study
import looking.trial
import numpy as np
import peers.playing
import peers.results
import peers.study
import peers.teams
import polars as pl
import pytest
from conftest import ROOT
from looking import lots, penalties, tried
from looking.learners import ALL, HELD, STATIC, USUAL, WATCHED
from looking.measuring import blind_pair, played_blind
from looking.pairs import kept, of_pairs
from looking.permuted import actions_dealt, sights_dealt
from peers.network import Network

from pitchlore.pipeline.arena.env import parallel_env
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.constant import Constant
from pitchlore.pipeline.engine.games import next_of, take_game
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.stages.evaluations import Evaluation, Pair, results_of_pair
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store

pytestmark = pytest.mark.slow

STUDIES = ROOT / "data" / "studies"
#: Seasons of two games of two matches, in which robots try actions.
TINY = """
base = "looking"
games = 2
practice = 1
explore = 1.0
explore_last = 1.0
[referee]
duration_s = 8
[pipeline.policies.appraisals]
codes = "all"
leaf_samples = 5
trees = 5
expected_trees = 5
"""
SHORT = RefereeSettings(duration_s=4.0)
#: Two apprentices of one learner; one more has a late camera.
LEARNER = HELD._replace(seasons=HELD.seasons[:2], seeds=range(1, 3), late_seasons=HELD.late_seasons[:1], late_seeds=range(3, 5))


def settings_of(_):
    """Tiny settings, whatever their name."""
    return parse_season(TINY, where="tiny.toml")


def seasons(settings, seeds, data, *_):
    """Play the seasons that are missing, in this process; all but a learner's first have one game."""
    for seed in seeds:
        own = settings_of(settings).model_copy(update={"games": 2 if seed == HELD.seasons[0] else 1})
        turn = next_of(Store(data), Season(name=settings, opponent=STATIC, seed=seed, settings=own))
        while turn is not None:
            take_game(data, turn, discard=True)
            turn = turn.following()


def pitch_of(opponent, side):
    """A short match, as peers play it."""
    return parallel_env(opponent, side=side, actions="behaviours", observations="sights", step_s=0.2, minutes=0.1)


def short(arm):
    """An arm with short matches."""
    return arm._replace(how=arm.how.model_copy(update={"referee": SHORT}))


@pytest.fixture(scope="module")
def tiny():
    """All studies have tiny seasons, short matches, and threads in place of processes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(harness, "ProcessPoolExecutor", lambda number, _context: ThreadPoolExecutor(number))
        patch.setattr(harness, "settings_of", settings_of)
        patch.setattr(harness, "seasons", seasons)
        patch.setattr(looking.measuring, "DEALT", {
            "looking-shuffled": (HELD.season, actions_dealt), "looking-drawn": (HELD.season, sights_dealt)})
        usual = USUAL.model_copy(update={"referee": SHORT})
        for module in (looking.decisions, peers.teams):
            patch.setattr(module, "USUAL", usual)
        for module in (looking.seconds, peers.playing):
            patch.setattr(module, "pitch_of", pitch_of)
        yield patch


@pytest.fixture(scope="module")
def data(tiny, tmp_path_factory):
    """A data folder with the seasons of a learner, and of both controls of learning."""
    folder = tmp_path_factory.mktemp("data")
    dealt = [LEARNER.panel._replace(trained=name, seasons=HELD.seasons[:1]) for name in looking.measuring.DEALT]
    looking.measuring.seasons([LEARNER.panel, LEARNER.late, *dealt], folder)
    return folder


def test_season_dealt(data):
    """A season whose log is dealt out anew plays the same games, from which it learns other appraisals."""
    learned = [Store(data / "seasons" / f"{name}-static-{HELD.seasons[0]}").manifest("policies", 2)
               for name in (HELD.season, "looking-shuffled", "looking-drawn")]
    assert len({manifest.files["appraisals"].sha256 for manifest in learned}) == 3
    assert len({tuple(sorted(manifest.inputs.items())) for manifest in learned}) == 1


def test_blind_pairs(data):
    """Matches of a blind team are not those of the team that sees; they are the same when they are played again."""
    policies = {}
    team, opponent = (entrant(Store(data), word, policies) for word in (LEARNER.panel.words[0], STATIC))
    how = Evaluation(team=team, opponent=opponent, referee=RefereeSettings(duration_s=20.0))
    seeds = [3, 4]
    found = played_blind(how, policies, None, seeds)
    assert found.equals(pl.concat([blind_pair(policies, None, Pair(evaluation=how, seed=seed)) for seed in seeds]))
    assert found["seed"].to_list() == seeds
    assert not found.equals(of_pairs(pl.concat([results_of_pair(Pair(evaluation=how, seed=seed), policies) for seed in seeds])))


def test_pairs_are_kept(tmp_path):
    """Pairs that were played are not played again; other teams have other files."""
    played = []

    def playing(seeds):
        played.append(list(seeds))
        return pl.DataFrame({"seed": list(seeds), "difference": [float(seed) for seed in seeds]})

    assert kept(tmp_path, "one", [3, 1], playing)["seed"].to_list() == [1, 3]
    assert kept(tmp_path, "one", range(1, 4), playing)["difference"].to_list() == [1.0, 2.0, 3.0]
    assert kept(tmp_path, "one", [1, 4], None)["seed"].to_list() == [1]
    assert kept(tmp_path, "other", [1], playing).height == 1
    assert played == [[3, 1], [2], [1]]


def same_columns(made, study, *names):
    """Tables that were made have the columns of those that are kept."""
    for name in names:
        assert pl.read_csv(made / name).columns == pl.read_csv(STUDIES / study / name).columns


def test_looking(data, tmp_path, monkeypatch):
    """Every arm and control of a learner is played, and each aim is judged."""
    monkeypatch.setattr(looking.learners, "LEARNERS", (LEARNER,))
    blinds = LEARNER.blind._replace(name=LEARNER.named("blind, sees what was 30 s ago"), late_s=30.0)
    arms = [short(arm) for arm in (*LEARNER.arms, blinds)]
    monkeypatch.setitem(looking.learners.ARMS, HELD.season, arms)
    monkeypatch.setitem(looking.learners.CONTROLS, HELD.season, [(word, short(arm)) for word, arm in LEARNER.controls("constant:044")])
    monkeypatch.setattr(looking.decisions, "LOGGED", range(1, 2))
    for name in ("results", "controls", "aims", "decisions"):
        whole = pl.read_csv(STUDIES / "looking" / f"{name}.csv")
        whole.filter(pl.col("season") != HELD.season).write_csv(tmp_path / f"{name}.csv")
    looking.study.main(tmp_path, data, [HELD.season])
    same_columns(tmp_path, "looking", "results.csv", "controls.csv", "aims.csv", "decisions.csv", "together.csv")
    found = pl.read_csv(tmp_path / "results.csv")
    ours = found.filter(season=HELD.season)
    assert ours.height == sum(len(arm.words) * len(arm.opponents) for arm in arms)
    assert set(ours["matches"]) == {4}
    assert set(found["season"]) == {WATCHED.season, ALL.season, HELD.season}
    assert pl.read_csv(tmp_path / "together.csv").equals(pl.read_csv(STUDIES / "looking" / "together.csv"))
    with pytest.raises(SystemExit, match="no learner is called nobody"):
        looking.study.main(tmp_path, data, ["nobody"])


def test_penalties(data, tmp_path, monkeypatch):
    """Each law is played by each team; a recording without restarts of its own is judged as a match is."""
    monkeypatch.setattr(penalties, "SEASONS", ((HELD.season, HELD.seasons[:1]),))
    monkeypatch.setattr(penalties, "TEAMS", (LEARNER.panel.words[0], "random"))
    monkeypatch.setattr(penalties, "SEEDS", range(7, 9))
    monkeypatch.setattr(penalties, "USUAL", USUAL.model_copy(update={"referee": RefereeSettings(duration_s=60.0)}))
    penalties.main(tmp_path, data)
    same_columns(tmp_path, "looking", "penalties.csv", "judged.csv")
    table = pl.read_csv(tmp_path / "penalties.csv")
    assert table["laws"].to_list() == [*penalties.LAWS] * 2
    assert table.filter(laws="none")[["penalties_for", "penalties_against"]].to_numpy().tolist() == [[0, 0], [0, 0]]
    assert table.filter(laws=penalties.USUALLY)["penalties_against"].max() > 0
    played = harness.matches.read(harness.logged(Recipe(
        home=TeamSettings(kind="random"), away=TeamSettings(kind="static"), seed=1, referee=USUAL.referee)), where="played")
    called = played.referee.filter(pl.col("event") == "stop")["note"].str.starts_with("penalty").sum()
    assert penalties.judged(played, RefereeSettings()) == called > 3
    assert penalties.judged(played, RefereeSettings(penalty=False)) == 0


def test_trial(data, tmp_path, monkeypatch):
    """The search, and both trials by lot."""
    monkeypatch.setattr(looking.learners, "LEARNERS", (LEARNER,))
    monkeypatch.setattr(looking.trial, "HELD", LEARNER)
    few = range(1, 3)
    monkeypatch.setitem(lots.FIRST, HELD.season, lots.FIRST[HELD.season]._replace(seeds=few))
    words = [Constant(code, code, code).word for code in (21, 44)]
    monkeypatch.setattr(looking.trial, "SEARCH", lots.Trial(("looks", "looks", *words), few))
    monkeypatch.setattr(looking.trial, "final", lambda teams: lots.final(teams)._replace(seeds=few))
    monkeypatch.setattr(looking.trial, "against", lambda best: lots.against(best)._replace(seeds=few))
    for _ in range(2):  # the second time it finds everything in the data folder
        looking.trial.main(tmp_path, data, [HELD.season])
        monkeypatch.setattr(looking.trial, "seconds", lambda *_: pytest.fail("it was played before"))
    same_columns(tmp_path, "looking", "trial.csv", "earned.csv", "constants.csv")
    assert set(pl.read_csv(tmp_path / "constants.csv")["code"]) == {21, 44}


def test_tried(tmp_path):
    """The curves of the kept results are those that are kept."""
    tried.main(tmp_path)
    for name in ("tried.csv", "tried.png"):
        assert (tmp_path / name).read_bytes() == (STUDIES / "looking" / name).read_bytes()


def test_imitation(tiny, tmp_path, monkeypatch):
    """Both ways to watch beside none."""
    monkeypatch.setattr(imitation.study, "seasons", seasons)
    monkeypatch.setattr(imitation.study, "SEEDS", range(1, 2))
    monkeypatch.setattr(imitation.study, "PARTS", {"all games": (1, 1)})
    imitation.study.main(tmp_path, tmp_path / "data")
    same_columns(tmp_path, "imitation", "games.csv", "gain.csv")
    assert pl.read_csv(tmp_path / "games.csv").height == 3
    assert pl.read_csv(tmp_path / "gain.csv")["gain"].to_list() == [0.0, 0.0], "of the same settings"


def test_best_constant(tiny, tmp_path, monkeypatch):
    """Two searches among two codes, and the final; a search that was stopped goes on."""
    monkeypatch.setattr(best_constant.study, "SEARCHES", {100: "paper", 200: "looks"})
    monkeypatch.setattr(best_constant.study, "_MINUTE", 5.0)
    monkeypatch.setattr(best_constant.study, "_WHOLE", 5.0)
    run = partial(best_constant.study.main, tmp_path, tmp_path / "best-constant.json", codes=(21, 44), budget=16, final_seeds=range(2))
    played, made = best_constant.study.difference, []

    def stopping(job):
        if len(made) == 7:
            raise KeyboardInterrupt
        made.append(job)
        return played(job)

    monkeypatch.setattr(best_constant.study, "difference", stopping)
    with pytest.raises(KeyboardInterrupt):
        run()
    monkeypatch.setattr(best_constant.study, "difference", lambda job: made.append(job) or played(job))
    run()
    assert len(made) - len({*made}) <= 1, "nothing is played twice but what was under way"
    same_columns(tmp_path, "best_constant", "searches.csv", "final.csv")
    assert pl.read_csv(tmp_path / "searches.csv").height == 2 * 4 * 2
    assert '"clock"' in (tmp_path / "best-constant.json").read_text()


def test_peers(data, tmp_path, monkeypatch):
    """Apprentices, a kept network and controls meet the panel; the tables come from what was played."""
    for module in (peers.teams, peers.results, peers.study):
        for name, value in (("GAME", 2), ("ONCE", 2), ("WHOLE", (0, 2)), ("KEPT", (2, 4)), ("TRAININGS", 2)):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, value)
    rng = np.random.default_rng(0)
    for seed in (2021, 2022):
        network = Network((rng.normal(size=(33, 32)).astype(np.float32),), (np.zeros(32, dtype=np.float32),), "tanh")
        network.save(peers.teams.networks(data) / f"ppo-{seed}-4.npz")
    run = partial(peers.study.main, tmp_path, data, minutes=0.0, pairs=2)
    run(only="matches")
    same_columns(tmp_path, "peers", "results.csv", "learners.csv", "ahead.csv")
    assert (tmp_path / "peers.png").exists()
    tables = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    run(only="tables")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == tables
    learners = pl.read_csv(tmp_path / "learners.csv")
    assert set(learners["learner"]) == {
        STATIC, "best-constant", peers.playing.ANY, peers.teams.OURS, peers.teams.GOING_ON, "ppo"}
    commands = list(peers.study.trainings(data, 1.0))
    assert len(commands) == 2 * len(peers.teams.OFFLINE) + sum(map(len, peers.teams.ONLINE.values()))
