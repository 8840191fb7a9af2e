"""The grid world: moves, walls, rewards, and plans from brute force."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.grid import DOWN, LEFT, RIGHT, STAY, UP, positions, state_of
from support.planning import (
    best_response,
    choices,
    evaluate,
    gains,
    index_of,
    is_equilibrium,
    path_length,
    value_iteration,
)
from support.small_games import named, tables

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.stages.paradigms.games.game import Game
from pitchlore.pipeline.stages.paradigms.games.grid import grid_world
from pitchlore.pipeline.stages.paradigms.games.matrix import (
    climbing,
    matrix_game,
    pure_equilibria,
)

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

    def test_moves_and_walls(self):
        """A move goes to the next cell, a wall stops it, and agents may share a cell."""
        game = grid_world(1, stay=True)
        nothing = [0, 0], False, False
        assert step(game, (5, 1), (5, 5), UP, LEFT) == (((4, 1), (5, 4)), *nothing)
        assert step(game, (5, 1), (5, 5), DOWN, RIGHT) == (((5, 1), (5, 5)), *nothing)
        assert step(game, (5, 1), (1, 5), LEFT, UP) == (((5, 1), (1, 5)), *nothing)
        assert step(game, (2, 2), (2, 4), RIGHT, LEFT) == (((2, 3), (2, 3)), *nothing)  # they may share a cell
        assert step(game, (2, 2), (4, 4), DOWN, STAY) == (((3, 2), (4, 4)), *nothing)

    def test_rewards(self):
        """Meeting at (3, 3) pays 10 and at (1, 3) 5, and being alone at (3, 3) costs k."""
        both, alone = grid_world(7, stay=True), grid_world(7, punished="alone", stay=True)
        for game in (both, alone):
            assert step(game, (3, 2), (4, 3), RIGHT, UP) == (((3, 3), (3, 3)), [10, 10], True, True)
            assert step(game, (1, 2), (2, 3), RIGHT, UP) == (((1, 3), (1, 3)), [5, 5], True, False)
            assert step(game, (1, 2), (1, 5), RIGHT, LEFT) == (((1, 3), (1, 4)), [0, 0], False, False)
        # one there alone, and the same still alone there a step later
        for place, move in (((3, 2), RIGHT), ((3, 3), STAY)):
            assert step(both, place, (5, 5), move, UP) == (((3, 3), (4, 5)), [-7, -7], False, False)
            assert step(alone, place, (5, 5), move, UP) == (((3, 3), (4, 5)), [-7, 0], False, False)
            assert step(alone, (5, 5), place, UP, move) == (((4, 5), (3, 3)), [0, -7], False, False)
        # one alone on each of the two
        assert step(both, (3, 2), (1, 2), RIGHT, RIGHT) == (((3, 3), (1, 3)), [-7, -7], False, False)

    @pytest.mark.slow
    @pytest.mark.parametrize(("punished", "stay"), READINGS)
    def test_every_step(self, punished, stay):
        """Every step of the grid leads and pays as the game is reported."""
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

    def test_positions_and_states(self):
        """Positions and states are each other's inverse."""
        assert [state_of(*positions(state)) for state in range(625)] == list(range(625))
        game = grid_world(0)
        for state in (0, 31, 624):
            (row, column), (other_row, other_column) = positions(state)
            assert game.own[:, state].tolist() == [5 * row + column - 6, 5 * other_row + other_column - 6]

    @pytest.mark.parametrize("wrong", [{"k": -1}, {"k": math.nan}, {"k": math.inf}, {"k": 1, "punished": "none"}])
    def test_bad_settings(self, wrong):
        """Settings out of bounds are refused."""
        with pytest.raises(BadSettings, match=r"(k|punished) cannot be"):
            grid_world(**wrong)


@st.composite
def small_games(draw):
    """One or two agents with two actions in up to three states, with ends and rewards of their own."""
    agents, states = draw(st.integers(1, 2)), draw(st.integers(1, 3))
    joint = 2**agents
    cells = states * joint

    def numbers(low, high, count):
        return np.array(draw(st.lists(st.integers(low, high), min_size=count, max_size=count)))

    ends = numbers(0, 1, cells).astype(bool).reshape(states, joint)
    return Game(
        name="small", actions=2, following=numbers(0, states - 1, cells).reshape(states, joint),
        rewards=numbers(-4, 4, cells * 2 * agents).astype(np.float64).reshape(states, joint, 2, agents),
        ends=ends, success=ends.copy(), own=np.zeros((agents, states), np.int64),
        start=draw(st.integers(0, states - 1)),
    )


def worth(game, policy, discount):
    """Value of a policy to each agent, [N, S], by solving Bellman's linear equations."""
    rows = np.arange(game.states)
    goes = np.zeros((game.states, game.states))
    goes[rows, game.following[rows, policy]] = ~game.ends[rows, policy]
    paid = game.rewards.mean(axis=2)[rows, policy]
    return np.linalg.solve(np.eye(game.states) - discount * goes, paid).T


def policies(game):
    return (np.array(policy) for policy in itertools.product(range(game.following.shape[1]), repeat=game.states))


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


def idle(row, column):
    """Against the lower wall for ever."""
    return DOWN


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

    def test_no_discount(self):
        """Without discount the grid still has values."""
        game = grid_world(15)
        plan = value_iteration(game, 1.0)
        assert plan.values.tolist() == [10.0] * 625  # from everywhere, as time costs nothing
        assert path_length(game, plan.best) == 4
        assert plan.best[game.start, index_of(game, (DOWN, DOWN))]  # wasting time is no loss

    def test_repeated_climbing(self):
        """Repeated climbing is worth eleven for ever."""
        plan = value_iteration(climbing(), 0.9)
        assert plan.values == pytest.approx([11 / (1 - 0.9)], abs=1e-9)
        assert plan.best.tolist() == climbing().success.tolist()

    def test_a_defectors_best_response(self):
        """Defecting is the best response to one who cooperates for ever."""
        # the other cooperates for ever: defecting pays 5 + 5/2 + 5/4 + … = 10 instead of 6
        game = matrix_game("dilemma", [[(3, 3), (0, 5)], [(5, 0), (1, 1)]], individual=True)
        cooperating = np.array([index_of(game, (0, 0))])
        for agent in (0, 1):
            response = best_response(game, cooperating, agent, 0.5)
            assert response.values == pytest.approx([10], abs=1e-9)
            assert response.best.tolist() == [[False, True]]
        np.testing.assert_allclose(gains(game, cooperating, 0.5), [4, 4], atol=1e-9)

    @settings(max_examples=100)
    @given(small_games(), st.sampled_from([0.0, 0.3, 0.9]))
    def test_values(self, game, discount):
        """Values are those of the best of all policies."""
        every = [worth(game, policy, discount).mean(axis=0) for policy in policies(game)]
        plan = value_iteration(game, discount)
        np.testing.assert_allclose(plan.values, np.max(every, axis=0), rtol=0, atol=1e-8)
        # every best joint action, followed everywhere, is as good, and no other begins as well
        follow = np.where(game.ends, 0, discount) * plan.values[game.following]
        gap = plan.values[:, np.newaxis] - (game.expected.mean(axis=2) + follow)
        assert (plan.best == (gap < 1e-7)).all()

    @settings(max_examples=100)
    @given(small_games(), st.sampled_from([0.0, 0.3, 0.9]), st.data())
    def test_responses(self, game, discount, data):
        """A response is the best of all policies that differ in the agent only."""
        policy = data.draw(st.sampled_from(list(policies(game))))
        kept = evaluate(game, policy, discount)
        np.testing.assert_allclose(kept, worth(game, policy, discount)[:, game.start], rtol=0, atol=1e-8)
        gained = gains(game, policy, discount)
        for agent in range(game.agents):
            others = np.delete(choices(game), agent, axis=0)
            every = [
                worth(game, other, discount)[agent] for other in policies(game)
                if (others[:, other] == others[:, policy]).all()
            ]
            response = best_response(game, policy, agent, discount)
            np.testing.assert_allclose(response.values, np.max(every, axis=0), rtol=0, atol=1e-8)
            assert gained[agent] == pytest.approx(response.values[game.start] - kept[agent], abs=1e-8)

    @settings(max_examples=100)
    @given(tables(), st.sampled_from([0.0, 0.5]))
    def test_matrix_policies(self, table, discount):
        """In a matrix game policies are equilibria where joint actions are."""
        game = matrix_game("any", table, individual=True)
        found = [is_equilibrium(game, np.array([joint]), discount) for joint in range(game.following.shape[1])]
        assert found == pure_equilibria(game).tolist()

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

    def test_gain_by_coming(self):
        """An agent that is waited for gains by coming."""
        game = grid_world(5)
        policy = by_own_cell(game, idle, to_refuge)
        found = gains(game, policy, 0.9)
        assert found == pytest.approx([5 * 0.9**5, 0], abs=1e-9)
        assert not is_equilibrium(game, policy, 0.9)

    def test_never_meeting(self):
        """Never meeting is an equilibrium, too."""
        # the paper does not mention it: alone nobody can earn anything
        game = grid_world(5)
        policy = by_own_cell(game, idle, idle)
        assert evaluate(game, policy, 0.9).tolist() == [0, 0]
        assert is_equilibrium(game, policy, 0.9)

    def test_paths(self):
        """A path is the shortest to success among the allowed actions, or None."""
        game = grid_world(1)

        def only(policy):
            return np.arange(16) == policy[:, np.newaxis]

        assert path_length(game, only(by_own_cell(game, to_summit, to_summit))) == 4
        assert path_length(game, only(by_own_cell(game, idle, idle))) is None

        def past_refuge(row, column):  # the way to (3, 3) is over before it is gone
            return DOWN if column == 3 else to_refuge(row, column)

        def beside_summit(row, column):  # up and down in columns 2 and 4, one step away from it
            return DOWN if row == 3 and column in (2, 4) else to_summit(row, column)

        for plan in (past_refuge, beside_summit):
            assert path_length(game, only(by_own_cell(game, plan, plan))) is None
        assert path_length(game, np.ones((625, 16), np.bool_)) == 4
        assert path_length(climbing(), climbing().success) == 1

    def test_diverging_states(self):
        """Without discount only the states that a policy passes need a worth."""
        # from (3, 3) and (3, 2) these policies pass (3, 3) in turns and pay for ever; from the start never
        game = grid_world(15)
        policy = by_own_cell(game, to_summit, to_summit)
        assert evaluate(game, policy, 1.0).tolist() == [10, 10]
        with pytest.raises(BadSettings, match="do not converge"):
            evaluate(replace(game, start=state_of((3, 3), (3, 2))), policy, 1.0)

    def test_no_convergence(self):
        """Values that do not converge are refused."""
        with pytest.raises(BadSettings, match="do not converge within 100,000 sweeps at discount 1"):
            value_iteration(climbing(), 1.0)
