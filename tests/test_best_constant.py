"""The best constant team: its file is what its name plays."""

import json
from importlib import resources

from pitchlore.pipeline.arena.match.environment import EnvSettings
from pitchlore.pipeline.arena.match.sides import MatchSides
from pitchlore.pipeline.arena.teams import constant as constants
from pitchlore.pipeline.arena.teams.clock import PAPER, ClockSettings
from pitchlore.pipeline.arena.teams.constant import BEST_FILE, Constant, best_constant
from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.store import Store


def file():
    """The file of the best constant team."""
    return json.loads(resources.files("pitchlore.pipeline.arena.teams").joinpath(BEST_FILE).read_text(encoding="utf-8"))


def test_plays_its_file(tmp_path):
    """The name plays the codes of the file, and its policy has the name of the codes."""
    policies = {}
    team = entrant(Store(tmp_path), "best-constant", policies)
    codes = file()["codes"]
    assert best_constant() == Constant(**codes)
    assert (team.name, team.settings.policy) == ("best-constant", Constant(**codes).word)
    rows = policies[team.settings.policy].values
    assert dict(rows.select("role", "behaviour_id").rows()) == {
        role: f"{role}-{code:03d}" for role, code in codes.items()}


def test_plays_by_its_clock(tmp_path, monkeypatch):
    """It plays by the clock of the file, in matches and as the opponent of an environment. Others play by the paper's."""
    own = ClockSettings(least_s=0.7, interrupts=True)
    monkeypatch.setattr(constants, "_best", lambda: {**file(), "clock": own.model_dump()})
    assert entrant(Store(tmp_path), "best-constant", {}).settings.clock == own
    assert entrant(Store(tmp_path), "best-constant", {}, least_s=0.3).settings.clock == ClockSettings(
        least_s=0.3, interrupts=True)
    assert MatchSides(EnvSettings(), "best-constant", "home").begin(1).match.recipe.away.clock == own
    assert entrant(Store(tmp_path), "constant:044", {}).settings.clock == PAPER


def test_panel(tmp_path):
    """The panel's words are teams, each once."""
    names = [entrant(Store(tmp_path), word, {}).name for word in PANEL]
    assert names == list(PANEL)
    assert len(set(names)) == 7
