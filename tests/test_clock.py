"""When robots of a learned team decide: least times, events that interrupt, and what is not begun."""

import numpy as np
import polars as pl
import pytest
from harness import settings_of
from support.openings import CODES, M, openings, perform, splitmix, view_of
from support.played import logged, policy, starting

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.controllers import LearnedController, PolicyTables, controller_of
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.clock import PAPER, ClockSettings
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.ball import NOBODY, OTHER, OWN, holder
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.events.control import ball_control
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Appraisals

#: 0.4 s are 24 frames.
LEAST = ClockSettings(least_s=0.4)
EVENTS = ClockSettings(interrupts=True)
NOT_BEGUN = ClockSettings(begin_ended=False)
ALL = ClockSettings(least_s=0.4, interrupts=True, begin_ended=False)


def recipe(clock=PAPER, seconds=20.0, seed=1, **more):
    home = TeamSettings(kind="learned", clock=clock, **more)
    return Recipe(home=home, away=TeamSettings(kind="static"), seed=seed, referee=RefereeSettings(duration_s=seconds))


class Team:
    """A learned team of which robot 1 alone has something to decide; a frame is 1/60 s."""

    def __init__(self, clock, *values, explore=0.0, lead=0):
        known = policy(*((role, 0, codes, q) for role in ROLES for codes, q in values))
        of = recipe(clock, explore=explore)
        self.team = LearnedController(known, of.home, of, np.random.default_rng(1))
        self.frame, self.wheels = 0, np.zeros((3, 2))
        self.team.restarted(0, lead)

    def see(self, view, frames=1):
        for _ in range(frames):
            self.team.think(self.frame, view, self.wheels)
            self.frame += 1
        return self

    def made(self, robot=1):
        """Frame, role and codes of each decision of a robot."""
        self.team.stopped(self.frame, 0.0)
        return [(each.frame, ROLES[each.role], each.behaviour_id.partition("-")[2] if each.behaviour_id else "194")
                for each in self.team.decided() if each.robot == robot]


#: Robot 1 looks along +x at the adversary's goal, far from a ball that lies still at (0.3, 0.2).
FACING = view_of((-0.6, 0.0, 0.0), (-0.3, 0.3, 1.0), (0.2, -0.3, 1.0), ball=(0.3, 0.2, 0.0, 0.0))
#: It looks away from it.
TURNED = view_of((-0.6, 0.0, 3.0), (-0.3, 0.3, 1.0), (0.2, -0.3, 1.0), ball=(0.3, 0.2, 0.0, 0.0))


@pytest.mark.parametrize(("clock", "codes", "frames", "begun"), [
    (PAPER, "108", 5, [0, 1, 2, 3, 4]),  # without a clock a behaviour whose end holds lasts one frame
    (LEAST, "108", 60, [0, 24, 48]),  # over at once, it lasts 0.4 s, 24 frames, and no longer
    (LEAST, "044", 130, [0, 60, 120]),  # one that takes longer is not cut off: far from the ball it ends after its second
])
def test_least_time(clock, codes, frames, begun):
    """A behaviour lasts for its least time at least."""
    assert [frame for frame, _, _ in Team(clock, (codes, 0.5)).see(FACING, frames).made()] == begun


def test_over_once_is_over():
    """An action that was over before its time and is begun anew ends with the time, also if its end no longer holds."""
    did = Team(LEAST, ("108", 0.5)).see(FACING, 3).see(TURNED, 40).made()
    assert [frame for frame, _, _ in did] == [0, 24]  # its end holds at no frame after 2; it goes on from 24


def test_last_code_goes_on():
    """The last of several codes goes on; the first is not begun again before the behaviour is."""
    team = Team(LEAST, ("108-184", 0.5)).see(FACING, 1)
    assert team.team._robots["place"][0] == 1
    team.see(FACING, 22)
    assert team.team._robots["place"][0] == 1
    assert team.team._robots["action"]["code"][0] in (0, 184)


def ball_at(x):
    """A view in which robot 1 stands at x = -0.6, an opponent at x = -0.5, and the ball lies on their line."""
    view = FACING.copy()
    view[4, :2], view[0, :2] = (-0.5, 0.0), (x, 0.0)
    return view


#: A touch is nearer than 7.75 cm: the ball lies far from both, behind one, behind the other, between them.
NOBODYS, OURS, THEIRS, BOTH = ball_at(0.3), ball_at(-0.65), ball_at(-0.45), ball_at(-0.55)


def test_holder():
    """The team that touched alone last has the ball; a ball behind the goal line is nobody's touch."""
    has, said = NOBODY, []
    for view in (NOBODYS, THEIRS, NOBODYS, BOTH, OURS, NOBODYS, BOTH, THEIRS):
        has = holder(view, has, M)
        said.append(has)
    assert said == [NOBODY, OTHER, OTHER, OTHER, OWN, OWN, OWN, OTHER]
    behind = OURS.copy()
    behind[:, 0] -= 0.15
    assert holder(behind, OTHER, M) == OTHER


def test_holder_is_possession():
    """Where a team alone has the ball by the stage events, and without contact there, it is the holder here."""
    read = log.read(logged(Recipe(home=TeamSettings(kind="static"), away=TeamSettings(kind="pressing"), seed=4,
                                  referee=RefereeSettings(duration_s=60.0))), where="here")
    bodies, _ = trajectories(read, TrajectorySettings())
    found = ball_control(bodies, read.info.pitch)
    rows = {t: i for i, t in enumerate(read.frames.t_ns.tolist())}
    robots = read.frames.robots.reshape(len(read.frames), -1)
    team_of = np.where(robots["team"][0] == 0, OWN, OTHER)
    has, agree, before = NOBODY, [], None
    for t_ns, segment, team in zip(found.ball.t_ns.tolist(), found.ball.segment.tolist(), found.team.tolist(), strict=True):
        ball, own = read.frames.ball[rows[t_ns]], robots[rows[t_ns]]
        order = np.argsort(team_of, kind="stable")
        view = np.zeros((7, 6))
        view[0, :2] = ball["x"], ball["y"]
        view[1:, 0], view[1:, 1] = own["x"][order], own["y"][order]
        has = holder(view, NOBODY if segment != before else has, M)
        before = segment
        if team != -1:
            agree.append(has == (OWN, OTHER)[team])
    assert len(agree) > 2000
    assert np.mean(agree) > 0.97


@pytest.mark.parametrize(("then", "interrupts"), [
    (((NOBODYS, 3), (OURS, 3)), [3]),                    # the ball is won
    (((THEIRS, 3), (OURS, 3)), [3]),                     # … from the others
    (((OURS, 3), (THEIRS, 3)), [0, 3]),                  # lost; the first frame's event is part of the restart
    (((OURS, 3), (NOBODYS, 3), (OURS, 3)), [0]),         # kept: a ball that rolls free is still theirs who had it
    (((OURS, 3), (BOTH, 3), (OURS, 3)), [0]),            # contested, and kept
    (((OURS, 3), (BOTH, 3), (THEIRS, 3)), [0, 6]),       # contested, and lost
    (((NOBODYS, 3), (THEIRS, 3)), []),                   # they take a ball that was never ours: nothing lost
])
def test_ball_interrupts(then, interrupts):
    """Winning and losing the ball interrupt all robots, and nothing else of the ball does."""
    for clock in (EVENTS, PAPER):
        team = Team(clock, ("184", 0.5))  # it lasts half a second at least
        for view, frames in then:
            team.see(view, frames)
        own = team.made(robot=2)
        wanted = sorted({0, *interrupts}) if clock is EVENTS else [0]
        assert [frame for frame, _, _ in own] == wanted


def test_role_interrupts():
    """A robot whose role changes decides anew for it; the third, whose role stays, does not."""
    swapped = FACING.copy()
    swapped[[1, 2]] = swapped[[2, 1]]
    team = Team(EVENTS, ("184", 0.5)).see(FACING, 4).see(swapped, 4)
    team.team.stopped(8, 0.0)
    made = [(each.robot, each.frame, ROLES[each.role]) for each in team.team.decided()]
    assert made == [(1, 0, "goalkeeper"), (2, 0, "midfield"), (3, 0, "striker"), (1, 4, "midfield"), (2, 4, "goalkeeper")]
    alone = Team(PAPER, ("184", 0.5)).see(FACING, 4).see(swapped, 4).made()
    assert alone == [(0, "goalkeeper", "184")]


def test_kick_off_interrupts():
    """At a kick-off all robots decide anew, whatever the clock, and go on with nothing."""
    for clock in (PAPER, LEAST, ALL):
        team = Team(clock, ("184", 0.5)).see(FACING, 5)
        team.team.restarted(5, 0)
        team.see(FACING, 1)
        assert team.team._robots["action"]["frames"].tolist() == [1, 1, 1]
        assert [frame for frame, _, _ in team.made()] == [0, 5]


def test_interrupted_goes_on():
    """A robot that chooses again what it is doing goes on: its half second of standing is not begun anew."""
    team = Team(EVENTS, ("184", 0.5)).see(NOBODYS, 20).see(OURS, 20)
    assert [frame for frame, _, _ in team.made(robot=2)] == [0, 20, 31]  # half a second from frame 0, not from 20


def test_not_begun():
    """The best behaviour is passed over where its end holds, and taken where it does not, or where the ends of all hold."""
    for view, first in ((FACING, "184"), (TURNED, "108")):
        assert Team(NOT_BEGUN, ("108", 0.5), ("184", 0.1), ("194", -0.5)).see(view).made() == [(0, "goalkeeper", first)]
    assert Team(PAPER, ("108", 0.5), ("184", 0.1)).see(FACING).made() == [(0, "goalkeeper", "108")]
    assert Team(NOT_BEGUN, ("108", 0.5), ("108-108", 0.1)).see(FACING).made() == [(0, "goalkeeper", "108")]


def test_codes_left_out():
    """Codes of a behaviour whose end holds are left out: at its beginning, and further on."""
    for codes, place in (("108-184", 1), ("184-108", 0), ("108-108-184-044", 2)):
        team = Team(NOT_BEGUN, (codes, 0.5)).see(FACING)
        assert team.team._robots["place"][0] == place
    team = Team(NOT_BEGUN, ("184-108-184", 0.5)).see(FACING, 31)  # it has stood for half a second
    assert team.team._robots["place"][0] == 2


def test_explores_what_can_begin():
    """An explorer takes each behaviour that can be begun as often, and none that cannot."""
    did = [Team(NOT_BEGUN, ("108", 0.5), ("184", 0.1), ("044", 0.1), explore=1.0).see(FACING).made() for _ in range(3)]
    assert {codes for ((_, _, codes),) in did} <= {"184", "044"}
    team = Team(ClockSettings(begin_ended=False), ("108", 0.5), ("057", 0.1), ("194", 0.1), explore=1.0)
    counts = pl.Series([codes for _, _, codes in team.see(TURNED, 3000).made()]).value_counts(normalize=True)
    assert counts.height == 3


@pytest.fixture(scope="module")
def begun():
    """For each code, scenes in which it may begin."""
    return openings(seed=3, each=6)


@pytest.mark.parametrize("code", CODES)
def test_ended_is_one_frame(code, begun):
    """An action has ended before it begins if and only if it would be over at its first frame."""
    scenes = [*begun[code], *(scene for other in (1, 46, 57, 108) for scene in begun[other])]
    for scene, roles, seed in scenes:
        own = np.zeros(1, dtype=ACTION)[0]
        said = executors.has_ended(code, 1, scene, roles, M, own)
        executors.start(code, 1, scene, roles, M, splitmix(seed), own)
        assert said == executors.act(1, scene, M, own, np.zeros((3, 2)))
    assert any(len(perform(scene, roles, code, seed)[0]) > 1 for scene, roles, seed in begun[code])


def test_no_such_robot():
    """An action towards a robot that does not exist has ended."""
    alone = np.zeros((3, 6))
    alone[1, 0], alone[2, 0] = -0.3, 0.3
    own = np.zeros(1, dtype=ACTION)[0]
    assert executors.has_ended(162, 1, alone, np.array([0, 0]), M, own)
    assert not executors.has_ended(138, 1, alone, np.array([0, 0]), M, own)  # an opponent is there


# --- whole matches ------------------------------------------------------------------------------------


def played(of, known):
    """The bytes of a match but for its recipe, and home's decisions."""
    match = starting(of, known)
    match.advance(100_000)
    part = match.take()
    return part.frames.ball.tobytes() + part.frames.robots.tobytes(), part.decisions.filter(team="home")


def lasted(decisions):
    """Frames that decisions lasted, but for those that the end of an episode cut off."""
    whole = decisions.filter(pl.col("ends").is_null())
    return ((whole["end_ns"] - whole["t_ns"]) * 60 / 1e9).round().to_numpy()


VALUES = (("108", 0.5), ("046-044-021", 0.4), ("057", 0.3), ("194", 0.1))
KNOWN = policy(*((role, 0, codes, q) for role in ROLES for codes, q in VALUES))


def test_decisions_last():
    """In a match without events all decisions last 24 frames; with events a few are shorter, and many were before."""
    of = {clock: lasted(played(recipe(clock, seconds=60.0), KNOWN)[1]) for clock in (PAPER, LEAST, ALL)}
    assert np.mean(of[PAPER] <= 2) > 0.5
    assert of[LEAST].min() >= 24
    assert np.mean(of[ALL] <= 2) < 0.1


@pytest.mark.parametrize("code", ["044", "021", "184", "138"])
def test_constant_team(code):
    """A team that does one thing plays the same match by any clock, byte for byte: a clock is no advantage to it."""
    known = policy(*((role, 0, code, 0.0) for role in ROLES))
    same = {played(recipe(clock, seconds=40.0, seed=3), known)[0] for clock in (PAPER, LEAST, EVENTS, NOT_BEGUN, ALL)}
    assert len(same) == 1


def test_settings_of_seasons():
    """The paper's seasons keep the paper's clock, ids of matches included; best has ours, each ablation lacks one."""
    for name in ("paper", "paper-full35", "paper-level", "paper-literal"):
        assert settings_of(name).clock == PAPER
    assert "clock" not in TeamSettings(kind="learned").model_dump()
    assert "clock" not in settings_of("paper").model_dump()
    assert settings_of("best").clock == ALL
    assert settings_of("best-no-least-time").clock == ALL.model_copy(update={"least_s": 0.0})
    assert settings_of("best-no-interrupts").clock == ALL.model_copy(update={"interrupts": False})
    assert settings_of("best-begin-all").clock == ALL.model_copy(update={"begin_ended": True})
    assert settings_of("best-paper-clock").clock == PAPER


def test_clock_of_a_word(tmp_path):
    """A constant team can be given a clock, and is distinguished by it; one that appraises what it sees is refused it."""
    team = entrant(Store(tmp_path), "constant:044", {}, least_s=0.4, begin_ended=False)
    assert team.settings.clock == ClockSettings(least_s=0.4, begin_ended=False)
    assert team.settings != entrant(Store(tmp_path), "constant:044", {}).settings
    of = recipe(LEAST)
    with pytest.raises(BadSettings, match="only a team that looks behaviours up in states has this clock"):
        controller_of(of.home, of, 0, PolicyTables(KNOWN, Appraisals.empty()))


def test_rounding():
    """Times are rounded to frames, at any rate of frames."""
    of = recipe(ClockSettings(least_s=0.4))
    slow = of.model_copy(update={"physics": of.physics.model_copy(update={"hz": 30.0})})
    for own, least in ((of, 24), (slow, 12)):
        assert LearnedController(KNOWN, own.home, own, np.random.default_rng(1))._policy.clock.least == least
