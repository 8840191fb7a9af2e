"""Matches of constant teams, from the simulator to pages: each is a team of its own name."""

import json

import pytest

from pitchlore.pipeline.arena.teams.constant import best_constant

pytestmark = pytest.mark.slow


def test_constant_teams_keep_their_names(call, tmp_path):
    """Their matches, knowledge and pages have the words that people call them; half a minute without goals is enough."""
    data = ("--data", tmp_path)
    _, out, _ = call("record", "--home", "constant:044", "--away", "best-constant", "--minutes", "0.5", "--json", *data)
    best = best_constant().word
    assert "constant-044-" + best.translate(str.maketrans(":/", "--")) in out
    assert call("run", *data)[0] == 0
    _, out, _ = call("sql", "select side, team, counts_as from sides order by side desc", "--json", *data)
    assert [[*row.values()] for row in json.loads(out)] == [["home", "constant:044", "constant:044"], ["away", best, best]]
    code, _, err = call("scout", *data)
    assert code == 0, err
    assert {path.stem.rsplit("-", 2)[0] for path in (tmp_path / "scout" / "teams").iterdir()} == {
        "constant-044", best.translate(str.maketrans(":/", "--"))}
