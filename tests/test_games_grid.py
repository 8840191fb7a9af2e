"""The grid world: moves, walls, rewards, and plans from brute force."""

import itertools
import math

import numpy as np
import pytest
from support.grid import DOWN, LEFT, RIGHT, STAY, UP, positions, state_of
from support.planning import (
    evaluate,
    index_of,
    is_equilibrium,
    named,
    path_length,
    value_iteration,
)

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.stages.paradigms.games.grid import grid_world

READINGS = [
    pytest.param(punished, stay, id=f"{punished} punished, {'five' if stay else 'four'} moves")
    for punished in ("both", "alone") for stay in (False, True)
]


def step(game, first, second, *moves):
    """Where a joint action leads from two positions, what it pays, whether it ends and succeeds."""
    state, joint = state_of(first, second), index_of(game, moves)
    return (
        positions(game.following[state, joint]), game.expected[state, joint].tolist(),
        bool(game.ends[state, joint]), bool(game.success[state, joint]),
    )


class TestGridWorld:
    def test_start(self):
        """Agents start in the corners of row five."""
        game = grid_world(1)
        assert (game.states, game.agents, game.actions) == (625, 2, 4)
        assert positions(game.start) == ((5, 1), (5, 5))
        assert game.own[:, game.start].tolist() == [20, 24]  # 5 * 4 + 0 and 5 * 4 + 4

    @pytest.mark.slow
    @pytest.mark.parametrize(("punished", "stay"), READINGS)
    def test_every_step(self, punished, stay):
        """Every step of the grid leads and pays as the game is described."""
        k = 2.5
        game = grid_world(k, punished=punished, stay=stay)
        moves = {UP: (-1, 0), DOWN: (1, 0), LEFT: (0, -1), RIGHT: (0, 1)} | ({STAY: (0, 0)} if stay else {})
        assert game.rewards.shape == (625, len(moves) ** 2, 1, 2)
        for state, pair in itertools.product(range(625), itertools.product(moves, repeat=2)):
            after = []
            for (row, column), move in zip(positions(state), pair, strict=True):
                to = (row + moves[move][0], column + moves[move][1])
                after.append(to if 1 <= to[0] <= 5 and 1 <= to[1] <= 5 else (row, column))
            at_top = [place == (3, 3) for place in after]
            paid = [0.0, 0.0]
            if all(at_top):
                paid = [10.0, 10.0]
            elif after == [(1, 3), (1, 3)]:
                paid = [5.0, 5.0]
            elif any(at_top):
                paid = [-k, -k] if punished == "both" else [-k * here for here in at_top]
            assert step(game, *positions(state), *pair) == (tuple(after), paid, max(paid) > 0, max(paid) == 10)

    @pytest.mark.parametrize("wrong", [{"k": -1}, {"k": math.nan}, {"k": math.inf}, {"k": 1, "punished": "none"}])
    def test_bad_settings(self, wrong):
        """Settings out of bounds are refused."""
        with pytest.raises(BadSettings, match=r"(k|punished) cannot be"):
            grid_world(**wrong)


def by_own_cell(game, *plans):
    """A policy of agents that look at their own position only; a plan is (row, column) -> move."""
    policy = np.empty(game.states, dtype=np.int64)
    for state in range(game.states):
        policy[state] = index_of(game, [plan(*place) for plan, place in zip(plans, positions(state), strict=True)])
    return policy


def to_refuge(row, column):
    """Up along the own column, then along row 1 to (1, 3), and wait there against the wall."""
    if row > 1 or column == 3:
        return UP
    return RIGHT if column < 3 else LEFT


def to_summit(row, column):
    """Along the own column to row 3, then along it to (3, 3)."""
    if row != 3:
        return UP if row > 3 else DOWN
    return RIGHT if column < 3 else LEFT


class TestPlanning:
    @pytest.mark.parametrize("k", [0, 1, 15])
    @pytest.mark.parametrize(("punished", "stay"), READINGS)
    def test_best_play(self, k, punished, stay):
        """The best play is ten points in four steps."""
        game = grid_world(k, punished=punished, stay=stay)
        plan = value_iteration(game, 0.9)
        # the fourth step is discounted three times
        assert plan.values[game.start] == pytest.approx(10 * 0.9**3, abs=1e-9)
        assert path_length(game, plan.best) == 4
        # (3, 3) is two rows up and two columns in from either corner: each begins with either
        assert named(game, plan.best[game.start]) == {(UP, UP), (UP, LEFT), (RIGHT, UP), (RIGHT, LEFT)}

    @pytest.mark.parametrize(("stay", "steps"), [(False, 3), (True, 2)])
    def test_wait_at_wall(self, stay, steps):
        """An agent that cannot stay must lose a step at a wall."""
        # From (3, 2) and (1, 3) the ways to (3, 3) are one and two steps: with STAY the first agent
        # waits once. Without, only a wall can change whether a way is odd or even: the second agent runs
        # against the upper one, the first goes aside and back, and both arrive in three.
        plan = value_iteration(grid_world(3, stay=stay), 0.9)
        assert plan.values[state_of((3, 2), (1, 3))] == pytest.approx(10 * 0.9 ** (steps - 1), abs=1e-9)

    @pytest.mark.parametrize("k", [0, 15])
    @pytest.mark.parametrize("discount", [0.9, 1.0])
    @pytest.mark.parametrize(("punished", "stay"), READINGS)
    def test_grid_equilibria(self, k, discount, punished, stay):
        """The grid has equilibria of ten points and of five."""
        # "This game has several Nash equilibrium solutions, the policies that lead agents to obtain 5
        # points and 10 points" (section 5). To (1, 3) it is four rows and two columns: six steps. Who
        # deviates alone finds the other on (1, 3) and nowhere else, and never sooner.
        game = grid_world(k, punished=punished, stay=stay)
        for plan, points, steps in ((to_summit, 10, 4), (to_refuge, 5, 6)):
            policy = by_own_cell(game, plan, plan)
            value = evaluate(game, policy, discount)
            assert value == pytest.approx([points * discount ** (steps - 1)] * 2, abs=1e-9)
            assert is_equilibrium(game, policy, discount)
