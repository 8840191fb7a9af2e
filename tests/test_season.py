"""Seasons: played game by game, learned from game by game, and gone on with after anything."""

import shutil
from itertools import pairwise

import polars as pl
import pytest

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.base.digests import canonical, digest
from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.engine import games as loop
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.engine.teams import entrant, load_rival, rivals
from pitchlore.pipeline.stages.seasons import settings
from pitchlore.pipeline.stages.seasons.settings import (
    ITSELF,
    Season,
    SeasonSettings,
    named_settings,
    names,
    parse_season,
)
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Games, Growth, Matches, Occasions, Policies

pytestmark = pytest.mark.slow


def season(base="paper", seed=1, opponent="static", **more):
    said = "\n".join([f'base = "{base}"', "games = 3", "lead_from = 3", *more.get("lines", ()),
                      "[referee]", "duration_s = 20"])
    return Season(name="short", opponent=opponent, seed=seed, settings=parse_season(said, where="here"))


def play(data, own, games):
    for game in games:
        loop.learn_from_game(data, own, game, loop.play_game(data, own, game), discard=False)


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """A data folder with the first of a season's three games of 20 seconds."""
    data = tmp_path_factory.mktemp("begun")
    play(data, season(), (1,))
    return data


@pytest.fixture(scope="module")
def played(tmp_path_factory, begun):
    """A data folder with the whole season."""
    data = shutil.copytree(begun, tmp_path_factory.mktemp("season") / "data")
    play(data, season(), (2, 3))
    return data


def rows(data, own=None, table="games"):
    store = Store(data)
    receipt = store.receipt("seasons", (own or season()).id)
    return store.read_table(receipt, table, Games if table == "games" else Growth)


def test_rows(played):
    """Each game has a row and one of growth a role, which only grows; the first knows nothing, and the lead comes in its time."""
    games, growth = rows(played), rows(played, table="growth").sort("role", "game")
    assert games["game"].to_list() == [1, 2, 3]
    assert games["lead"].to_list() == [0, 0, 100]
    assert games["policy_version"][0] is None
    assert games["other_actions"][0] == 0 < games["actions"][0]
    assert growth.height == 9
    for _, role in growth.group_by("role"):
        for column in ("states", "behaviours", "pairs"):
            assert role[column].is_sorted()


def test_apprentice(tmp_path):
    """The apprentice plays the last policy as in the counted match, but tries nothing."""
    own = season(lines=("lcb_weight = 0.5", "min_visits = 2", "posterior_std = 0.1"))
    (tmp_path / "seasons" / own.id).mkdir(parents=True)
    with pytest.raises(NotFound, match="short-static-1: has no policy yet: none of its games is done"):
        entrant(Store(tmp_path), own.id, {})
    play(tmp_path, own, (1, 2))
    known = {}
    team = entrant(Store(tmp_path), own.id, known)
    manifest = loop.store_of(tmp_path, own).latest("policies")
    assert (team.name, team.policy_version) == (own.id, manifest.version)
    assert team.knowledge_version == rows(tmp_path, own)["knowledge_version"][-1]
    (label,) = known
    assert label == team.settings.policy == f"v{manifest.version} {manifest.files['policies'].sha256}"
    (counted, *_) = own.recipes(3, label)
    assert counted.home.explore > 0 < counted.home.posterior_std
    assert team.settings == counted.home.model_copy(update={"explore": 0.0, "posterior_std": 0.0})
    otherwise = entrant(Store(tmp_path), own.id, {}, explore=0.25, lcb_weight=0.0, min_visits=0)
    assert otherwise.settings == counted.home.model_copy(update={"explore": 0.25, "posterior_std": 0.0, "lcb_weight": 0.0, "min_visits": 0})
    # whose store is another's: its rows are found by the label when it plays
    recipe = Recipe(home=team.settings, away=counted.away, seed=1, referee=own.settings.referee)
    receipt, new = record(Store(tmp_path), recipe, known)
    assert new
    assert receipt.settings["home"]["policy"] == label


def test_knowledge(played):
    """Each game is played with what was learned from the one before: the adversary's behaviours, and the states of both teams."""
    own, games = loop.store_of(played, season()), rows(played)
    for before, after in pairwise(games.rows(named=True)):
        policy = own.manifest("policies", after["policy_version"])
        assert policy.details["knowledge_version"] == before["knowledge_version"]
    known = own.read_table(own.latest("knowledge"), "occasions", Occasions)
    at_random = pl.col("behaviour_id").str.contains(r"^\w+-194$")
    assert known.filter(~at_random).height > 0
    assert known.filter(at_random).height > 0  # states that the apprentice was in
    learned = own.read_table(own.latest("policies"), "policies", Policies)
    assert learned.height == known.height


@pytest.mark.parametrize("stop_before", ["_commit", "knowledge", "policies"])
def test_stopped_game(begun, played, tmp_path, monkeypatch, stop_before):
    """A game that was stopped anywhere is gone on with, to the same tables."""
    shutil.copytree(begun, tmp_path, dirs_exist_ok=True)
    matches = loop.play_game(tmp_path, season(), 2)
    emit = loop.emit

    def killed(*_, **__):
        raise KeyboardInterrupt

    def emit_or_killed(store, stage, *more):
        return killed() if stage.noun == stop_before else emit(store, stage, *more)

    with monkeypatch.context() as patch:
        patch.setattr(loop, *("_commit", killed) if stop_before == "_commit" else ("emit", emit_or_killed))
        with pytest.raises(KeyboardInterrupt):
            loop.learn_from_game(tmp_path, season(), 2, matches, discard=False)
    assert loop.done(Store(tmp_path), season()).details["games"] == 1
    play(tmp_path, season(), (2,))
    assert rows(tmp_path).equals(rows(played).filter(pl.col("game") <= 2))


def test_other_settings(played):
    """A season cannot be gone on with by other settings."""
    other = season()
    other = other.model_copy(update={"settings": other.settings.model_copy(update={"explore": 0.9})})
    with pytest.raises(BadSettings, match="other settings"):
        loop.done(Store(played), other)


@pytest.mark.parametrize(("was", "now", "same"), [
    ("explore = 0.1 ", "explore = 0.2 ", False),
    ("explore = 0.1 ", "explore = 0.1 # said otherwise\n", True),
])
def test_changed_base(played, monkeypatch, was, now, same):
    """A season goes on only while the file it is based on says the same; comments may change."""
    text = settings._text("paper")
    assert text.count(was) == 1
    monkeypatch.setattr(settings, "_text", {"paper": text.replace(was, now)}.__getitem__)
    if same:
        assert loop.done(Store(played), season()).details["games"] == 3
    else:
        with pytest.raises(BadSettings, match=r"short-static-1: was begun with other settings.*Take another seed"):
            loop.done(Store(played), season())


def longer(own, games):
    return own.model_copy(update={"settings": own.settings.model_copy(update={"games": games, "opponents": ("random",)})})


def test_more_games(played, tmp_path):
    """A season that is over goes on when more games are asked for."""
    own = season()
    play(tmp_path, longer(own, 2), (1, 2))
    assert loop.done(Store(tmp_path), own).details["games"] == 2
    play(tmp_path, own, (3,))
    receipt, whole = (Store(data).receipt("seasons", own.id) for data in (tmp_path, played))
    assert receipt == whole  # with the SHA-256 of all tables
    assert loop.done(Store(tmp_path), longer(own, 2)).details["games"] == 3


def test_no_more_games(tmp_path):
    """A season whose exploration changes up to its last game cannot have more games."""
    own = season(lines=("explore_last = 0.0",))
    play(tmp_path, own, (1,))
    with pytest.raises(BadSettings, match=r"it was begun with 3 games and cannot have 4, because its exploration"):
        loop.done(Store(tmp_path), longer(own, 4))


def test_pitch_and_camera(tmp_path):
    """A season can be played on another pitch and through a camera."""
    own = season(lines=("robots = 2", "[pitch]", 'kind = "ssl"', "length = 9.0", "[camera]", "robot_unseen = 0.2"))
    play(tmp_path, own, (1, 2))
    here = loop.store_of(tmp_path, own)
    for match_id in rows(tmp_path, own)["match_id"]:
        receipt = here.receipt("matches", match_id)
        row = here.read_table(receipt, "matches", Matches).row(0, named=True)
        assert (row["kind"], row["pitch_length"], row["pitch_width"], row["robots_per_team"]) == ("ssl", 9.0, 9.0, 2)
        seen = log.read(here.read(receipt, "log"), where=match_id).frames
        assert len(seen.robots) / len(seen) == pytest.approx(0.8 * 4, abs=0.1)


def test_discarding(tmp_path):
    """Matches not needed any more can be forgotten, and the season goes on."""
    loop.learn_from_game(tmp_path, season(), 1, loop.play_game(tmp_path, season(), 1), discard=True)
    own = loop.store_of(tmp_path, season())
    assert not list(own.receipts("matches"))
    assert not list(own.receipts("behaviours"))
    assert len(list(own.receipts("decisions"))) == 1
    loop.learn_from_game(tmp_path, season(), 2, loop.play_game(tmp_path, season(), 2), discard=True)
    assert rows(tmp_path).height == 2


def test_discarding_and_learning_from_all(tmp_path):
    """Matches that later games learn from are kept, however many they are."""
    own = season(lines=["[pipeline.policies]", "last_matches = 8"])
    for game in (1, 2):
        loop.learn_from_game(tmp_path, own, game, loop.play_game(tmp_path, own, game), discard=True)
    assert loop.store_of(tmp_path, own).latest("policies").details["matches"] >= 1
    assert rows(tmp_path, own).height == 2


def test_practice(tmp_path):
    """Practice is learned from and not counted."""
    own = season(lines=["practice = 1"])
    matches = loop.play_game(tmp_path, own, 1)
    loop.learn_from_game(tmp_path, own, 1, matches, discard=False)
    assert len(matches) == 2
    assert rows(tmp_path, own).height == 1
    assert rows(tmp_path, own)["match_id"].item() == matches[0]
    store = loop.store_of(tmp_path, own)
    assert store.latest("knowledge").details["matches"] == 2


# --- settings --------------------------------------------------------------------------------------


def test_settings_keep_their_keys():
    """A season is known by its settings as JSON: those that come along are what they were, whatever a run's are."""
    said = {name: Season(name=name, opponent="static", seed=1, settings=named_settings(name)).of_each_game() for name in names()}
    assert {name: digest(canonical(settings))[:8] for name, settings in said.items()} == {
        "best": "5571af64", "best-in-games": "ee856f29", "looking": "58437679", "looking-held": "34cd9d17",
        "paper": "6d32b1b2", "paper-literal": "b0661532"}
    again = SeasonSettings.model_validate(named_settings("paper").model_dump())
    assert (again, again.pipeline.policies.learner, again.pipeline.knowledge.recover) == (named_settings("paper"), "sarsa", None)
    assert SeasonSettings().pipeline.policies.learner == "sarsa"


def test_paper_settings():
    """The paper's settings say what the paper says."""
    paper = named_settings("paper")
    assert paper.games == 35
    assert paper.opponents == ("static", "human-like")
    assert paper.referee.duration_s == 480
    assert paper.pipeline.knowledge.state_key == "full36"
    for opponent, lead in (("static", 100), ("human-like", 0)):
        own = Season(name="paper", opponent=opponent, seed=1, settings=paper)
        assert [own.lead(game) for game in (10, 11, 35)] == [0, lead, lead]


def test_exploration():
    """Exploration changes evenly from the first game to the last."""
    own = parse_season("games = 5\nexplore = 0.4\nexplore_last = 0.0", where="here")
    of = Season(name="x", opponent="static", seed=0, settings=own)
    assert [of.recipes(game, None)[0].home.explore for game in (1, 3, 5)] == pytest.approx([0.4, 0.2, 0.0])


def test_match_seeds():
    """No two matches share a seed, in one season or in two."""
    own = named_settings("paper").model_copy(update={"practice": 2})
    seeds = [recipe.seed for seed in (1, 2) for game in (1, 2, 35)
             for recipe in Season(name="x", opponent="static", seed=seed, settings=own).recipes(game, None)]
    assert len(set(seeds)) == len(seeds) == 18


@pytest.mark.parametrize(("text", "error", "words"), [
    ("games = 0", BadSettings, "games"),
    ("gaems = 3", BadSettings, "gaems"),
    ('opponents = ["static", "static"]', BadSettings, "a team is named twice"),
    ('[pitch]\nkind = "3d"', BadSettings, r"pitch\.kind"),
    ('base = "nobody"', NotFound, "nobody"),
    ("games = ", BadSettings, "TOML"),
])
def test_bad_settings(text, error, words):
    """Bad settings are refused, and the error says what is wrong."""
    with pytest.raises(error, match=words):
        parse_season(text, where="club.toml")


SHORT = 'base = "best-in-games"\ngames = 3\n[referee]\nduration_s = 10\n'
OWN = parse_season(SHORT, where="short.toml")


@pytest.mark.slow
def test_in_turn(call, tmp_path):
    """A script, a constant team and the apprentice itself take turns; what is there is not played again."""
    (tmp_path / "short.toml").write_text(SHORT)
    words = ("season", "--settings", tmp_path / "short.toml", "--in-turn", "--opponent", "pressing", "--opponent", "constant:044",
             "--opponent", ITSELF, "--on", "threads:1", "--data", tmp_path / "data")
    code, out, _ = call(*words)
    assert (code, "short-pressing-constant-044-itself-1" in out) == (0, True)
    store = Store(tmp_path / "data")
    (receipt,) = store.receipts("seasons")
    assert store.read_table(receipt, "games", Games)["opponent"].unique().to_list() == ["pressing-constant-044-itself"]
    season = Store(store.root / receipt.details["store"])
    aways = [match.settings["away"] for match in sorted(season.receipts("matches"), key=lambda match: match.settings["seed"])]
    assert [away["kind"] for away in aways] == ["pressing", "learned", "learned"]
    assert aways[1]["policy"].startswith("constant:044")
    second, last = season.manifests("policies")[1:]
    assert aways[2]["policy"].endswith(second.files["policies"].sha256)
    assert last.version == second.version + 1
    assert call(*words)[0] == 0
    assert len(list(season.receipts("matches"))) == 3
    # an apprentice is an opponent like any other, as long as it does not learn
    name, found = rivals(store, (receipt.name,))
    assert (name[:23], len(name), found[0].word) == ("short-pressing-constant", 32, receipt.name)
    load_rival(store, found[0], known := {})
    assert list(known) == [found[0].team.policy]
    changed = found[0].model_copy(update={"team": found[0].team.model_copy(update={"policy": "v1 0"})})
    with pytest.raises(BadSettings, match="has learned since the season began"):
        load_rival(store, changed, {})


def test_names(tmp_path):
    """A season is named for its opponents; a long name ends with a hash."""
    store = Store(tmp_path)
    assert [rivals(store, (word,)) for word in ("static", "person")] == [("static", ()), ("person", ())]
    assert rivals(store, ("constant:44/21/21",))[0] == "constant-44-21-21"
    name, found = rivals(store, ("static", "pressing", "counter", "constant:44/21/21"))
    assert len(name) == 32
    season = Season(name="x", opponent=name, rivals=found, seed=1, settings=OWN)
    assert [season.rival(game).word for game in (1, 2, 5)] == ["static", "pressing", "static"]


@pytest.mark.parametrize(("words", "why"), [
    (("nobody",), "'nobody' is no team"), (("remote",), "takes no turns"), (("static", "person"), "takes no turns")])
def test_refused(call, tmp_path, words, why):
    """A word that names no opponent is one line, before a game is played."""
    code, _, err = call("season", "--in-turn", "--data", tmp_path / "data", *(part for word in words for part in ("--opponent", word)))
    assert (code, why in err) == (1, True)
    assert not (tmp_path / "data" / "seasons").exists()
