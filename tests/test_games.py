"""The games: what they pay, where they lead, their equilibria and the best that can be done in them."""

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

from pitchlore.pipeline.base.errors import BadSettings, NotFound, SchemaMismatch
from pitchlore.pipeline.paradigms.games.game import Game
from pitchlore.pipeline.paradigms.games.grid import grid_world
from pitchlore.pipeline.paradigms.games.matrix import (
    climbing,
    fully_stochastic_climbing,
    matrix_game,
    optimal,
    partially_stochastic_climbing,
    penalty,
    pure_equilibria,
)


def named(game, chosen):
    """The joint actions of a bool [J], as tuples of the agents' actions."""
    return {tuple(int(a) for a in choices(game)[:, j]) for j in np.flatnonzero(chosen)}


def literal_equilibria(table):
    """Inequality 8 word for word: no agent i receives more by any other action of its own.

    ``table`` is [A] * N + [N].
    """
    shape = table.shape[:-1]
    return {
        joint
        for joint in np.ndindex(*shape)
        if all(
            table[(*joint[:i], action, *joint[i + 1:], i)] <= table[(*joint, i)]
            for i in range(len(shape))
            for action in range(shape[i])
        )
    }


@st.composite
def tables(draw):
    """Rewards of one to three agents, [A] * N + [N], with many ties."""
    agents = draw(st.integers(1, 3))
    shape = (draw(st.integers(1, 3)),) * agents + (agents,)
    rewards = draw(st.lists(st.integers(-3, 3), min_size=math.prod(shape), max_size=math.prod(shape)))
    return np.array(rewards, dtype=np.float64).reshape(shape)


def three_agent_climbing():
    """Climbing for three: 11, 7 and 5 for agreeing on 0, 1 and 2; -30 where 0 meets 1; where 1 meets 2
    it is 6 if the first agent plays 1; else nothing."""
    payoff = np.zeros((3, 3, 3))
    for joint in np.ndindex(3, 3, 3):
        played = set(joint)
        if len(played) == 1:
            payoff[joint] = (11, 7, 5)[joint[0]]
        elif {0, 1} <= played:
            payoff[joint] = -30
        elif played == {1, 2} and joint[0] == 1:
            payoff[joint] = 6
    return matrix_game("three-agent climbing", payoff)


class TestMatrixGames:
    @pytest.mark.parametrize("k", [0, -1, -100])
    def test_penalty(self, k):
        """The penalty game has three equilibria, of which two are optimal."""
        # The diagonal holds 10, 2, 10, each the only greatest number of its row and column, whatever
        # k <= 0. Off it an agent gains at once: from (0, 1), (1, 0), (1, 2), (2, 1), which pay 0, one
        # agent's step leads to 10 or 2; from (0, 2) and (2, 0), which pay k <= 0, to 10. With k = 0, too,
        # nobody is content off the diagonal: there is no weak equilibrium.
        game = penalty(k)
        assert game.expected[0, :, 0].reshape(3, 3).tolist() == [[10, 0, k], [0, 2, 0], [k, 0, 10]]
        assert named(game, pure_equilibria(game)) == {(0, 0), (1, 1), (2, 2)}
        assert named(game, optimal(game)) == {(0, 0), (2, 2)}
        assert named(game, game.success[0]) == {(0, 0), (2, 2)}

    @pytest.mark.parametrize("k", [1e-6, 11, math.nan, -math.inf])
    def test_bad_penalty(self, k):
        """A k above 0 or not finite is refused."""
        with pytest.raises(BadSettings, match="k cannot be"):
            penalty(k)

    @pytest.mark.parametrize(
        "game", [climbing(), partially_stochastic_climbing(), fully_stochastic_climbing()], ids=lambda g: g.name
    )
    def test_climbing(self, game):
        """Climbing and its stochastic variants are one game in the mean."""
        # (0, 0) = 11 and (1, 1) = 7 are the greatest of their row and column. (2, 2) = 5 is not: the
        # first agent climbs to (1, 2) = 6, from there the second to (1, 1).
        assert game.expected[0, :, 0].reshape(3, 3).tolist() == [[11, -30, 0], [-30, 7, 6], [0, 0, 5]]
        assert (game.expected[0, :, 0] == game.expected[0, :, 1]).all()
        assert named(game, pure_equilibria(game)) == {(0, 0), (1, 1)}
        assert named(game, game.success[0]) == {(0, 0)}
        assert not game.ends.any()
        assert game.following.tolist() == [[0] * 9]
        assert game.own.tolist() == [[0], [0]]

    def test_stochastic_rewards(self):
        """A stochastic variant pays both agents the same one of two rewards."""
        partly = partially_stochastic_climbing()
        paid = {j: set(partly.rewards[0, j, :, 0]) for j in range(9)}
        assert paid.pop(index_of(partly, (1, 1))) == {14, 0}
        assert all(len(rewards) == 1 for rewards in paid.values())
        fully = fully_stochastic_climbing()
        assert [sorted(fully.rewards[0, j, :, 0]) for j in range(9)] == [
            [10, 12], [-65, 5], [-8, 8], [-65, 5], [0, 14], [0, 12], [-5, 5], [-5, 5], [3, 7],
        ]
        for game in (partly, fully):  # both agents always see the same outcome
            assert (game.rewards[..., 0] == game.rewards[..., 1]).all()

    def test_total_rewards(self):
        """The paper's total rewards in climbing are true of the first agent only."""
        # "action a2 has the maximum total reward for agent A and action b1 for agent B" (section 5).
        # Rows (a): 11-30+0 = -19, -30+7+6 = -17, 0+0+5 = 5. Columns (b): 11-30+0 = -19, -30+7+0 = -23,
        # 0+6+5 = 11. So a2 has the greatest total and so has b2; b1 has the smallest of B's.
        # Read with rows and columns exchanged, B's totals are -19, -17, 5: not b1 either.
        table = climbing().expected[0, :, 0].reshape(3, 3)
        assert table.sum(axis=1).tolist() == [-19, -17, 5]
        assert table.sum(axis=0).tolist() == [-19, -23, 11]

    def test_three_agents_climb(self):
        """Climbing for three agents has three equilibria, of which one is optimal."""
        # (0, 0, 0) = 11 is the greatest of all. From (1, 1, 1) = 7 an agent's step leads to -30, 6 or 0.
        # From (2, 2, 2) = 5 the first agent steps to (1, 2, 2) = 6; there it would lose (0 and 5), and
        # the second and the third find -30, or 6 again at (1, 1, 2) and (1, 2, 1): a weak equilibrium.
        # From (1, 1, 2) and (1, 2, 1) one agent steps to 7. All others pay 0 or -30 and one step pays more.
        game = three_agent_climbing()
        assert game.agents == 3
        assert game.rewards.shape == (1, 27, 1, 3)
        assert named(game, pure_equilibria(game)) == {(0, 0, 0), (1, 1, 1), (1, 2, 2)}
        assert named(game, game.success[0]) == {(0, 0, 0)}

    @pytest.mark.parametrize(
        ("payoff", "stable", "best"),
        [
            pytest.param([[(3, 3), (0, 5)], [(5, 0), (1, 1)]], {(1, 1)}, {(1, 1)}, id="prisoners' dilemma"),
            pytest.param([[(4, 4), (1, 3)], [(3, 1), (2, 2)]], {(0, 0), (1, 1)}, {(0, 0)}, id="stag hunt"),
            # each prefers another equilibrium: none is best for both
            pytest.param([[(2, 1), (0, 0)], [(0, 0), (1, 2)]], {(0, 0), (1, 1)}, set(), id="battle of the sexes"),
            pytest.param([[(1, -1), (-1, 1)], [(-1, 1), (1, -1)]], set(), set(), id="matching pennies"),
            # (0, 1): the first agent gains nothing by leaving for 1, the second nothing by leaving for 1
            pytest.param([[(1, 1), (1, 1)], [(0, 0), (1, 1)]], {(0, 0), (0, 1), (1, 1)},
                         {(0, 0), (0, 1), (1, 1)}, id="weak equilibria"),
        ],
    )
    def test_equilibria_of_textbook_games(self, payoff, stable, best):
        """Textbook games have their known equilibria."""
        game = matrix_game("textbook", payoff, individual=True)
        assert named(game, pure_equilibria(game)) == stable
        assert named(game, game.success[0]) == best

    def test_rounding(self):
        """Means that differ by rounding only are equal."""
        # added in another order, .1, .2 and .3 have another sum; without tolerance one of the two would win
        payoff = [[0.1, 0.2, 0.3], [0.3, 0.2, 0.1]]
        assert np.mean(payoff[0]) != np.mean(payoff[1])
        game = matrix_game("rounding", payoff, outcomes=True)
        assert game.success.tolist() == [[True, True]]
        assert value_iteration(game, 0.5).best.tolist() == [[True, True]]

    def test_last_axes(self):
        """The last axes of a payoff are what the caller says: agents, outcomes or both."""
        cube = np.arange(8.0).reshape(2, 2, 2)
        assert matrix_game("three agents", cube).rewards.shape == (1, 8, 1, 3)
        drawn = matrix_game("two outcomes", cube, outcomes=True)
        assert drawn.rewards[0, index_of(drawn, (1, 0))].tolist() == [[4, 4], [5, 5]]
        shared = matrix_game("two agents", cube, individual=True)
        assert shared.rewards[0, index_of(shared, (1, 0))].tolist() == [[4, 5]]
        both = matrix_game("all", np.arange(24.0).reshape(2, 2, 3, 2), outcomes=True, individual=True)
        assert both.rewards[0, index_of(both, (0, 1))].tolist() == [[6, 7], [8, 9], [10, 11]]

    @pytest.mark.parametrize(
        ("payoff", "axes"),
        [
            (1.0, {}),
            ([[1, 2, 3], [4, 5, 6]], {}),
            (np.zeros((0, 0)), {}),
            (np.zeros((2, 2, 3)), {"individual": True}),
            (np.zeros((2, 2, 0)), {"outcomes": True}),
            (np.zeros(2), {"outcomes": True}),
        ],
    )
    def test_payoff_shape(self, payoff, axes):
        """Payoffs of another shape are refused."""
        with pytest.raises(SchemaMismatch, match=r"payoff of shape .* is not \[.*\]\. Give every agent"):
            matrix_game("misshapen", payoff, **axes)

    def test_infinite_payoff(self):
        """Payoffs that are not finite are refused."""
        with pytest.raises(SchemaMismatch, match="rewards is not float64 or not finite"):
            matrix_game("infinite", [[1, math.inf], [0, 0]])

    def test_own_payoffs(self):
        """A game does not change with the array that it was made from."""
        payoff = np.ones((2, 2, 2))
        game = matrix_game("copied", payoff, individual=True)
        payoff[...] = -1
        assert (game.rewards == 1).all()

    @settings(max_examples=100)
    @given(tables())
    def test_equilibria(self, table):
        """Equilibria are those of the inequality, and the optimal ones are best for every agent."""
        game = matrix_game("any", table, individual=True)
        stable = literal_equilibria(table)
        assert named(game, pure_equilibria(game)) == stable
        dominant = {
            joint for joint in stable if all((table[joint] >= table[other]).all() for other in stable)
        }
        assert named(game, game.success[0]) == dominant

    @settings(max_examples=100)
    @given(tables(), st.data())
    def test_renaming(self, table, data):
        """Other names for agents and actions are other names for equilibria."""
        agents, actions = table.shape[-1], table.shape[0]
        order = data.draw(st.permutations(range(agents)))
        renamed = np.transpose(table, (*order, agents))[..., list(order)]
        names = [data.draw(st.permutations(range(actions))) for _ in range(agents)]  # old action of each new one
        for agent, old in enumerate(names):
            renamed = np.take(renamed, old, axis=agent)
        before, after = matrix_game("old", table, individual=True), matrix_game("new", renamed, individual=True)
        for rule in (pure_equilibria, optimal):
            back = set()
            for joint in named(after, rule(after)):
                old = [0] * agents
                for agent, action in enumerate(joint):
                    old[order[agent]] = names[agent][action]
                back.add(tuple(old))
            assert back == named(before, rule(before))

    @settings(max_examples=100)
    @given(tables())
    def test_common_payoff(self, table):
        """Where all agents receive the same, the greatest rewards are optimal."""
        payoff = table[..., 0]
        game = matrix_game("common", payoff)
        assert game.success[0].tolist() == (payoff == payoff.max()).ravel().tolist()


class TestGame:
    def test_joint_digits(self):
        """The first agent's action is the most significant digit of a joint action."""
        game = three_agent_climbing()
        assert index_of(game, (1, 2, 0)) == 1 * 9 + 2 * 3 + 0
        assert choices(game)[:, 15].tolist() == [1, 2, 0]
        assert [index_of(game, choice) for choice in choices(game).T] == list(range(27))

    @pytest.mark.parametrize("game", [climbing(), grid_world(1)], ids=lambda g: g.name)
    def test_read_only(self, game):
        """Nobody can change a game."""
        for array in (game.following, game.rewards, game.ends, game.success, game.own):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
        with pytest.raises(AttributeError):
            game.start = 1

    @pytest.mark.parametrize(
        ("wrong", "says"),
        [
            ({"rewards": np.zeros((1, 2, 1))}, "rewards is not \\[S, J, V, N\\]"),
            ({"rewards": np.zeros((1, 2, 0, 1))}, "rewards is not \\[S, J, V, N\\]"),
            ({"rewards": np.zeros((1, 3, 1, 1))}, "rewards does not have J"),
            ({"rewards": np.full((1, 2, 1, 1), np.nan)}, "rewards is not float64 or not finite"),
            ({"following": np.zeros((1, 2), np.int32)}, "following is not int64"),
            ({"following": np.ones((1, 2), np.int64)}, "following names a state that is not there"),
            ({"ends": np.zeros((1, 3), np.bool_)}, "ends is not bool"),
            ({"success": np.zeros((1, 2))}, "success is not bool"),
            ({"own": np.zeros((2, 1), np.int64)}, "own is not int64"),
            ({"own": np.full((1, 1), -1)}, "own is negative"),
            ({"start": 1}, "start is no state"),
        ],
    )
    def test_bad_arrays(self, wrong, says):
        """Arrays that are no game are refused."""
        good = {
            "name": "coin", "actions": 2, "following": np.zeros((1, 2), np.int64), "rewards": np.zeros((1, 2, 1, 1)),
            "ends": np.zeros((1, 2), np.bool_), "success": np.zeros((1, 2), np.bool_),
            "own": np.zeros((1, 1), np.int64),
        }
        assert Game(**good).agents == 1
        with pytest.raises(SchemaMismatch, match=says):
            Game(**good | wrong)


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
        """Every step of the grid leads and pays as the game is told."""
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

    @pytest.mark.parametrize(
        "wrong",
        [{"discount": -0.1}, {"discount": 1.1}, {"discount": math.nan}, {"tolerance": 0.0}, {"tolerance": math.inf},
         {"tolerance": math.nan}],
    )
    def test_bad_settings(self, wrong):
        """A discount or tolerance out of bounds is refused."""
        with pytest.raises(BadSettings, match=next(iter(wrong))):
            value_iteration(climbing(), **{"discount": 0.5} | wrong)

    @pytest.mark.parametrize("policy", [np.array([9]), np.array([-1]), np.array([0.0]), np.array([0, 0])])
    def test_bad_policies(self, policy):
        """A policy of another shape or type, or of unknown actions, is refused."""
        with pytest.raises(SchemaMismatch, match="policy is not int64"):
            evaluate(climbing(), policy, 0.5)

    def test_unknown_agent(self):
        """An agent that is not there is refused."""
        with pytest.raises(NotFound, match="no agent 2"):
            best_response(climbing(), np.array([0]), 2, 0.5)

    def test_allowed_type(self):
        """Allowed actions of another type are refused."""
        with pytest.raises(SchemaMismatch, match="allowed is not bool"):
            path_length(climbing(), np.ones((1, 9)))
