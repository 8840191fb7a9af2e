"""A policy plays as the team did whose decisions it learned from, in a recorded match and in an environment."""

import numpy as np
import pytest
from support.watched import Replayed

from pitchlore.flows.commands.playing import Learners
from pitchlore.pipeline.arena.env import env
from pitchlore.pipeline.arena.match.controllers import controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import TeamSettings
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.games import Turn, store_of, take_game
from pitchlore.pipeline.engine.teams import apprentice, entrant, learned_team
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store

_SHORT = "games = 1\npractice = 1\n[referee]\nduration_s = 20"
_LOOKS = f'base = "looking"\nclock_s = 0.3\npredict_s = 0.1\n{_SHORT}'
_STATES = f'base = "best-in-games"\n{_SHORT.replace("practice = 1", "practice = 0")}'


def played_season(data, text):
    """A season after its only game."""
    season = Season(name="short", opponent="static", seed=1, settings=parse_season(text, where="short.toml"))
    take_game(data, Turn(season, 1), discard=True)
    return season


@pytest.mark.slow
@pytest.mark.parametrize(("text", "kept"), [
    (_LOOKS, {"clock_s": 0.3, "predict_s": 0.1}), (_STATES, {"clock": {"least_s": 0.4, "interrupts": True, "begin_ended": False}}),
], ids=["looks", "looks up states"])
def test_a_policy_keeps_its_clock(tmp_path, text, kept):
    """``learned`` and ``learned:1`` play as the season's apprentice does; an option says otherwise."""
    season = played_season(tmp_path, text)
    store, own = Store(tmp_path), store_of(tmp_path, season)
    expected = TeamSettings.model_validate({"kind": "learned"} | kept)
    counted = apprentice(store, season.id).team.settings
    for word in ("learned", "learned:1", "1"):
        team = entrant(own, word, {}).settings
        for name in ("clock", "clock_s", "predict_s"):
            assert getattr(team, name) == getattr(expected, name) == getattr(counted, name)
    assert entrant(own, "learned", {}, clock_s=0.7, predict_s=0.0).settings.clock_s == 0.7
    assert entrant(own, "learned", {}, clock_s=0.7, predict_s=0.0).settings.predict_s == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("text", [_LOOKS, _STATES], ids=["looks", "looks up states"])
def test_an_opponent_in_an_environment(tmp_path, text):
    """An apprentice plays in an environment, byte for byte, as in a recorded match: by its clock, and predicting."""
    season = played_season(tmp_path, text)
    one = env(learned_team(Store(tmp_path), season.id), minutes=0.2)
    one.reset(seed=3)
    policies = {}
    team = entrant(Store(tmp_path), season.id, policies)
    assert one.match.recipe.away == team.settings
    recipe = one.match.recipe
    recorded = MatchInPlay(recipe, controllers_of(recipe, policies, live=(Replayed(np.zeros((600, 3, 2))), None)), logged=False)
    recorded.advance(600)
    for _ in range(600):
        one.step(np.zeros(6, np.float32))
    assert one.match.bodies.tobytes() == recorded.bodies.tobytes()
    slower = env(learned_team(Store(tmp_path), season.id, predict_s=0.2), minutes=0.2)
    slower.reset(seed=3)
    for _ in range(600):
        slower.step(np.zeros(6, np.float32))
    assert slower.match.bodies.tobytes() != recorded.bodies.tobytes()
    with pytest.raises(BadSettings, match="'static' has learned nothing"):
        learned_team(Store(tmp_path), "static")


def test_options_of_the_other_kind(tmp_path, call):
    """An option that no team of a match has is refused before a match is played, in a line that says whose it is."""
    for option, whose in (("--clock-s=0.3", "only a team that looks (its policy's learner is \"sight\") has this option"),
                          ("--lcb-weight=0.7", "only a team that looks behaviours up in states has this option")):
        code, _, err = call("evaluate", "--policy", "constant:044", option, "--matches", "2", "--data", tmp_path)
        assert (code, f"{option.split('=')[0]}: {whose}" in err) == (1, True)
    season = played_season(tmp_path, _LOOKS)
    _, _, err = call("evaluate", "--policy", season.id, "--min-visits", "3", "--matches", "2", "--data", tmp_path)
    assert "--min-visits: only a team that looks behaviours up in states has this option" in err
    (looks, stays), _ = Learners(clock_s=0.3, predict_s=0.1).entrants(Store(tmp_path), season.id, "constant:044")
    assert (looks.settings.clock_s, stays.settings.clock_s) == (0.3, 0.5), "each has what its kind has"
    assert (looks.settings.predict_s, stays.settings.predict_s) == (0.1, 0.1)
    assert not (tmp_path / "evaluations").exists()
