"""Played matches beside recorded ones: the same situations, about as often."""

import json
from functools import cache

import polars as pl
import pytest
from support.played import read
from support.recordings import INSPER, RCSS, RSIM, SSL, imported

from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.constant import best_constant
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.trajectories.derive import trajectories

pytestmark = pytest.mark.slow

#: A situation is common if it is so large a part of all that began.
COMMON = 0.005
#: Total variation distance of two mixes. The recordings beside the checkout, of three leagues, are 0.21 to
#: 0.47 from each other; a team that moves randomly makes matches that are 0.30 from the sample.
FAR = 0.2
#: A common situation is at most so many times as frequent on one side as on the other.
FACTOR = 5.0

LIKE_SOCCER = (("static", "static", 1), ("static", "static", 2), ("static", "human-like", 1))


def mix(log):
    """The share of each code in all situations that began."""
    settings = Settings()
    bodies, _ = trajectories(log, settings.trajectories)
    found = recognise(bodies, log.info.pitch, settings.situations)
    return dict(found["code"].value_counts(normalize=True).iter_rows())


@cache
def played(home, away, seed):
    """The mix of eight minutes."""
    return mix(read(Recipe(home=TeamSettings(kind=home), away=TeamSettings(kind=away), seed=seed,
                             referee=RefereeSettings(duration_s=480.0))))


@pytest.fixture(scope="module")
def sample():
    return mix(imported(RSIM))


def distance(one, other):
    """Total variation: the part of one mix that would have to be something else to make it the other."""
    return sum(abs(one.get(code, 0.0) - other.get(code, 0.0)) for code in {*one, *other}) / 2


def beside(one, other):
    """Both mixes of the common situations, for whom a test fails."""
    rows = [(code, one.get(code, 0.0), other.get(code, 0.0)) for code in sorted({*one, *other})]
    return pl.DataFrame(rows, schema=("code", "played", "recorded"), orient="row")


@pytest.mark.parametrize("teams", LIKE_SOCCER, ids=lambda teams: "-".join(map(str, teams)))
def test_mix(sample, teams):
    """Played matches have about the mix of situations of the sample, which others played."""
    mixed = played(*teams)
    both = beside(mixed, sample)
    assert distance(mixed, sample) < FAR, both
    common = both.filter(pl.max_horizontal("played", "recorded") >= COMMON)
    odd = common.filter(~(pl.col("played") / pl.col("recorded")).is_between(1 / FACTOR, FACTOR))
    assert odd.is_empty(), odd


def test_random_team(sample):
    """The mix tells soccer from moving about."""
    assert distance(played("static", "random", 1), sample) > FAR


@pytest.mark.parametrize("name", [SSL, RCSS, INSPER])
def test_other_leagues(name):
    """Situations that are common in other leagues happen in played matches, too."""
    common = {code for code, share in mix(imported(name)).items() if share >= COMMON}
    assert common <= set().union(*(played(*teams) for teams in LIKE_SOCCER))


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
