"""The table of teams: laws that every entry keeps, and the lists that are made of it."""

import re

import numpy as np
import pytest
from support.openings import view_of
from support.watched import Watched

from pitchlore.pipeline.arena.match.controllers import controller_of, controllers_of
from pitchlore.pipeline.arena.match.human import DriveCommand, HumanController
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import SCRIPTED, TEAMS
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.teams import entrant, learned_team
from pitchlore.pipeline.live.encoding import Wheels
from pitchlore.pipeline.live.remote import RemoteController
from pitchlore.pipeline.stages.seasons.settings import ITSELF
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES
from pitchlore.schemas.seasons import PERSON
from pitchlore.schemas.table import STAND_INS

every_team = pytest.mark.parametrize("name", TEAMS)


def recipe(name, seed=1, robots=3):
    return Recipe(home=TeamSettings(kind=name), away=TeamSettings(kind="static"), seed=seed, robots=robots,
                  referee=RefereeSettings(duration_s=6.0))


def controller(of):
    """The controller of home; a person, or another program, at full speed to the left if these have to play."""
    if of.home.kind == "remote":
        program = RemoteController(of.robots, of.physics.wheel_speed)
        for number in range(of.robots):
            program.ask(Wheels(yellow=False, number=number, left=0.5, right=9.0))
        return program
    if of.home.kind != "human":
        return controller_of(of.home, of, 0)
    person = HumanController(of, np.random.default_rng([of.seed, 1]))
    person.command(DriveCommand(forward=1.0, turn=0.5, boost=True))
    return person


def played(of):
    """Wheels of home, float64 [frames in play, N, 2], and the bodies at the end."""
    home = Watched(controller(of))
    match = MatchInPlay(of, (home, controller_of(of.away, of, 1)), logged=False)
    match.advance(100_000)
    return np.array(home.wheels), match.bodies


@every_team
@pytest.mark.parametrize("robots", [1, 3])
def test_plays_within_its_limits(name, robots):
    """Wheels are finite and no faster than they can be, in a match of any size, and the team moves."""
    of = recipe(name, robots=robots)
    wheels, _ = played(of)
    assert wheels.shape[1:] == (robots, 2)
    assert np.abs(wheels).max() <= of.physics.wheel_speed + 1e-12  # false of a NaN as well
    assert len(np.unique(wheels)) > 1


@every_team
def test_same_seed_same_bytes(name):
    """A seed decides all wheels and all bodies, another seed leads to others."""
    (wheels, bodies), (same, places), (_, elsewhere) = (played(recipe(name, seed)) for seed in (1, 1, 2))
    assert (wheels.tobytes(), bodies.tobytes()) == (same.tobytes(), places.tobytes())
    assert bodies.tobytes() != elsewhere.tobytes()


def filmed(name, seed, *, beside):
    """The wheels that a team wants in a film of its own, while another one of its kind sees another film."""
    of = recipe(name, seed)
    one, other = controller(of), controller(recipe(name, seed + 1))
    for team in (one, other):
        team.restarted(0, 0)
    wheels, ignored, kept = np.zeros((3, 2)), np.zeros((3, 2)), []
    for frame in range(90):
        x = 0.3 * np.sin(frame / 20)
        if beside:
            other.think(frame, view_of((-0.1, x, 1.0), (0.2, -x, 2.0), (0.5, 0.3, 3.0), ball=(-x, 0.4, 1, 0)), ignored)
        one.think(frame, view_of((-0.7, 0.0, 0.0), (-0.2, x, 1.0), (-0.3, -x, 2.0), ball=(x, 0.1, 0, 0)), wheels)
        kept.append(wheels.copy())
    return np.array(kept)


@every_team
def test_no_shared_memory(name):
    """Two teams of one kind share no memory and no chances."""
    assert filmed(name, 3, beside=True).tobytes() == filmed(name, 3, beside=False).tobytes()


@every_team
def test_is_described_and_drawn(name):
    """Each has a sentence, and a colour that no other team has."""
    team = TEAMS[name]
    assert team.name == name
    assert re.fullmatch(r"[A-Z].{10,100}\.", team.description)
    assert re.fullmatch(r"#[0-9A-F]{6}", team.colour)
    assert [other.name for other in TEAMS.values() if other.colour == team.colour] == [name]


def test_names_of_the_schemas():
    """The names that the schemas fix are teams, but for a person."""
    assert PERSON not in TEAMS  # it is no team for `record`
    assert set(STAND_INS) <= set(TEAMS)


@pytest.mark.parametrize("command", ["record", "play", "evaluate", "season"])
def test_help_names_the_teams(command, call):
    """The help of a command that takes a team names those that it takes."""
    said = re.sub(r"[^\w-]+", " ", call(command, "--help")[1]).split()
    assert {*SCRIPTED, *([PERSON, ITSELF] if command == "season" else [])} <= set(said)


def test_unknown_team(tmp_path):
    """An unknown team is refused with the names of the teams that there are."""
    with pytest.raises(BadSettings, match=f"Name {', '.join(SCRIPTED)}, learned"):
        entrant(Store(tmp_path), "nobody", {})
    with pytest.raises(ValueError, match=", ".join(f"'{name}'" for name in list(TEAMS)[:-1])):
        TeamSettings(kind="nobody")


def test_constant_team(tmp_path):
    """Every decision of a constant team is for its code, by role."""
    for word, name, codes in (
        ("constant:044", "constant:044", "044 044 044"), ("constant:184/21/150", "constant:184/021/150", "184 021 150"),
        ("constant:44/44/044", "constant:044", "044 044 044"),
    ):
        policies = {}
        team = entrant(Store(tmp_path), word, policies)
        assert (team.name, team.settings.policy, team.policy_version) == (name, name, None)
        of = recipe("static").model_copy(update={"home": team.settings})
        players = controllers_of(of, policies)
        MatchInPlay(of, players, logged=False).advance(100_000)
        did = {(ROLES[each.role], each.behaviour_id, each.random) for each in players[0].decided()}
        assert did == {(role, f"{role}-{code}", False) for role, code in zip(ROLES, codes.split(), strict=True)}
    with pytest.raises(BadSettings, match=r"there is no action 999\. Name some of 001, .* 184, 194"):
        entrant(Store(tmp_path), "constant:044/999/021", {})
    for word in ("constant:", "constant:044/021", "constant:0044", "constant:\u0660\u0664\u0664", "constant:044-021-021"):
        with pytest.raises(BadSettings, match="one code, or three"):
            entrant(Store(tmp_path), word, {})


@pytest.mark.parametrize(("options", "said"), [({"explore": 2.0}, "explore"), ({"explor": 0.1}, "explor"), ({"least_s": -1.0}, "least_s")])
def test_options_that_do_not_fit(options, said, tmp_path):
    """An option of a learned team that does not exist, or does not fit, is named in one line."""
    with pytest.raises(BadSettings, match=f"best-constant.*{said}"):
        learned_team(Store(tmp_path), "best-constant", **options)


@pytest.mark.parametrize(("home", "away", "match_id"), [
    ({"kind": "static"}, "random", "static-random-1-7a3d0a9ab403"),
    ({"kind": "human-like"}, "human", "human-like-human-1-6be863793949"),
    ({"kind": "learned"}, "static", "learned-static-1-6bc2f8b22e0d"),
    ({"kind": "learned", "policy": "v1 x", "explore": 0.1, "posterior_std": 1.0, "lcb_weight": 0.7, "min_visits": 3},
     "static", "learned-static-1-980e5af04e99"),
])
def test_ids(home, away, match_id):
    """Match ids are made of the recipe with its laws; doubt, caution and trust keep their first names in them."""
    of = Recipe(home=TeamSettings(**home), away=TeamSettings(kind=away), seed=1)
    assert of.match_id == match_id
