"""The team that looks: each robot takes the action that trees appraise highest at what it sees.

All robots decide when play starts and each ``clock_s`` of play. A robot chooses among the actions of its
role; of equal ones it takes any. With probability ``explore`` it takes any of them. An action whose end holds
before the next decision is begun anew: a goalkeeper that goes to its goal, and is there, stays. A robot that
can choose none moves randomly.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.arena.teams.learned import observe_levels
from pitchlore.pipeline.game.bodies import Records
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.executors.actions import VERB
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, uniform
from pitchlore.pipeline.numbers.arrays import F32, F64, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.numbers.trees import Trees, leaf, logits, trees_of
from pitchlore.pipeline.state import BinEdges, Radix, encode_one
from pitchlore.pipeline.state.observation import see_from
from pitchlore.pipeline.state.table import ELEMENTS
from pitchlore.schemas import ROLES
from pitchlore.schemas.sights import SIGHT
from pitchlore.schemas.situations import MOVES_RANDOMLY

#: Numbers of an observation.
NUMBERS = len(SIGHT)


class ActionValues(NamedTuple):
    """Appraisals as :func:`decide` looks them up.

    Attributes:
        codes: int64 [C], the actions; the first is moves randomly, which is never appraised.
        allowed: bool [3, C], those of each role, by index in ROLES.
        first: int64 [C + 1]; the trees of action i are ``first[i]`` to ``first[i + 1]``, exclusive.
        trees: trees of all actions, one action's after the other's; their base is 0.
    """

    codes: I64
    allowed: Bools
    first: I64
    trees: Trees


class ActionPolicy(NamedTuple):
    """A team's policy, as :func:`decide` takes it.

    Attributes:
        appraiser: the appraisals.
        whole: digits of the key that keeps all elements; decisions are logged with it.
        edges: edges of the pitch.
        explore: chance that a robot takes any action instead of the best, in [0, 1].
        hold: number of decisions for which it then stays with this action, at least 1.
    """

    appraiser: ActionValues
    whole: Radix
    edges: BinEdges
    explore: float
    hold: int


def appraiser_of(values: pl.DataFrame, appraisals: pl.DataFrame) -> tuple[ActionValues, list[str | None]]:
    """Appraisals as arrays, and the names of what is chosen.

    Args:
        values: rows of schema Policies of one version; the actions of each role are its behaviours, which
            have one code each.
        appraisals: rows of schema Appraisals of the same version; an action without any is worth 0.

    Returns:
        The arrays; and behaviour ids by role (ROLES) and action, role first, None for moves randomly.
    """
    pairs = values.select(
        pl.col("role").cast(pl.String), code=pl.col("behaviour_id").str.split("-").list.last().cast(pl.Int64))
    codes = [MOVES_RANDOMLY, *(
        code for code in pairs["code"].unique().sort() if VERB[code] >= 0 and code != MOVES_RANDOMLY)]
    known = set(pairs.iter_rows())
    allowed = np.array([[(role, code) in known for code in codes] for role in ROLES])
    rows = appraisals.filter(pl.col("code").is_in(codes[1:])).select(
        pl.all(), place=pl.col("code").replace_strict(codes, range(len(codes)), return_dtype=pl.Int64),
    ).sort("place", "tree", "node")
    roots = rows.filter(node=0)["place"].to_numpy()
    appraiser = ActionValues(
        np.array(codes, dtype=np.int64), allowed,
        np.searchsorted(roots, np.arange(len(codes) + 1)).astype(np.int64), trees_of(rows),
    )
    names = [None if code == MOVES_RANDOMLY else f"{role}-{code:03d}" for role in ROLES for code in codes]
    return appraiser, names


@njit(cache=True, nogil=True, error_model="numpy")
def action_value(appraiser: ActionValues, action: int, observation: F32) -> float:
    """Worth of an action at an observation, float32 [30]; 0 without trees."""
    worth = 0.0
    for tree in range(appraiser.first[action], appraiser.first[action + 1]):
        worth += leaf(appraiser.trees, appraiser.trees.start[tree], observation)
    return worth


def action_values_at(appraiser: ActionValues, observations: F32) -> F64:
    """Worth of all actions at observations, float64 [C, N], from float32 [N, 30]; 0 without trees."""
    trees, first = appraiser.trees, appraiser.first
    return np.array([logits(trees._replace(start=trees.start[one:next_]), observations)
                     for one, next_ in pairwise(first)])


@njit(cache=True, nogil=True, error_model="numpy")
def decide(
    view: F64, direction: float, lead: int, robots: Records, policy: ActionPolicy, held: I64, packed: Records,
    splitmix: SplitMix, decisions: Records,
) -> None:  # fmt: skip
    """Decide for all robots, each by what it sees.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        direction: direction of the ball's last motion, radians; NaN if it never moved.
        lead: own goals minus the adversary's.
        robots: records of :data:`pipeline.arena.teams.learned.ROBOT`, [N]; written.
        policy: the team's.
        held: int64 [N], for how many more decisions each robot stays with what it tries; written. An action
            that a new role does not have ends.
        packed: measures, ``Measures.packed()``.
        splitmix: draws ties and exploration.
        decisions: records of :data:`pipeline.arena.teams.learned.DECISION`, [N], written; ``behaviour`` is
            role times C plus action.
    """
    roles = np.empty(2 * len(robots), dtype=np.int64)
    state = read_state(view, direction, lead, policy, packed, roles)
    observation = np.empty(NUMBERS, dtype=np.float32)
    for robot in range(1, len(robots) + 1):
        see_from(view, robot, packed[0].goal_x, observation)
        choose(robot, observation, view, roles, state, robots, policy, held, packed, splitmix, decisions)


@njit(cache=True, nogil=True, error_model="numpy")
def read_state(
    view: F64, direction: float, lead: int, policy: ActionPolicy, packed: Records, roles: I64
) -> np.int64:
    """State of the team by all elements; int64 [2 N] ``roles`` of all robots are written."""
    elements = np.zeros(ELEMENTS, dtype=np.uint8)
    assign(view, packed[0], roles)
    observe_levels(view, direction, lead, roles, policy.edges, elements)
    return encode_one(elements, policy.whole)


@njit(cache=True, nogil=True, error_model="numpy")
def choose(
    robot: int, observation: F32, view: F64, roles: I64, state: np.int64, robots: Records,
    policy: ActionPolicy, held: I64, packed: Records, splitmix: SplitMix, decisions: Records,
) -> None:  # fmt: skip
    """Decide for robot number ``robot``, from 1, by an observation, float32 [30].

    ``roles`` and ``state`` are those of :func:`read_state`; the rest is as for :func:`decide`.
    """
    appraiser, own, role = policy.appraiser, robots[robot - 1], roles[robot - 1]
    decision = decisions[robot - 1]
    decision["robot"], decision["role"], decision["state"] = robot, role, state
    if held[robot - 1] > 0 and appraiser.allowed[role, own["behaviour"]]:
        held[robot - 1] -= 1
        decision["behaviour"], decision["random"] = role * len(appraiser.codes) + own["behaviour"], True
        return
    tries = uniform(splitmix) < policy.explore
    held[robot - 1] = policy.hold - 1 if tries else 0
    best, most, ties = 0, 0.0, 0
    for action in range(1, len(appraiser.codes)):
        if not appraiser.allowed[role, action]:
            continue
        worth = 0.0 if tries else action_value(appraiser, action, observation)
        if ties == 0 or worth > most:
            best, most, ties = action, worth, 1
        elif worth == most:
            ties += 1
            if uniform(splitmix) * ties < 1.0:
                best = action
    own["behaviour"], own["place"] = best, 0
    executors.start(appraiser.codes[best], robot, view, roles, packed[0], splitmix, own["action"])
    decision["behaviour"], decision["random"] = role * len(appraiser.codes) + best, tries or best == 0


@njit(cache=True, nogil=True, error_model="numpy")
def carry_on(
    view: F64, robots: Records, appraiser: ActionValues, packed: Records, splitmix: SplitMix, wheels: F64
) -> None:
    """Carry on all actions for a frame; one whose end holds is begun anew.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        robots: after :func:`decide`.
        appraiser: owner of the actions.
        packed: measures, ``Measures.packed()``.
        splitmix: draws the wheels of random moves.
        wheels: float64 [N, 2], written.
    """
    m = packed[0]
    count = len(robots)
    for robot in range(1, count + 1):
        own = robots[robot - 1]
        if executors.act(robot, view, m, own["action"], wheels):
            roles = np.empty(2 * count, dtype=np.int64)
            assign(view, m, roles)
            executors.start(
                appraiser.codes[own["behaviour"]], robot, view, roles, m, splitmix, own["action"])
