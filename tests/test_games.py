"""Games: payoffs, equilibria, the checks of a game; moves, walls and rewards of the grid world."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.grid import DOWN, LEFT, RIGHT, STAY, UP, positions, state_of
from support.planning import choices, index_of, named

from pitchlore.pipeline.base.errors import BadSettings, SchemaMismatch
from pitchlore.pipeline.stages.paradigms.games.game import Game
from pitchlore.pipeline.stages.paradigms.games.grid import grid_world
from pitchlore.pipeline.stages.paradigms.games.matrix import (
    climbing,
    fully_stochastic_climbing,
    matrix_game,
    optimal,
    partially_stochastic_climbing,
    penalty,
    pure_equilibria,
)


@st.composite
def tables(draw):
    """Rewards of one to three agents, [A] * N + [N], with many ties."""
    agents = draw(st.integers(1, 3))
    shape = (draw(st.integers(1, 3)),) * agents + (agents,)
    rewards = draw(st.lists(st.integers(-3, 3), min_size=math.prod(shape), max_size=math.prod(shape)))
    return np.array(rewards, dtype=np.float64).reshape(shape)


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

    def test_rounding(self):
        """Means that differ by rounding only are equal."""
        # added in another order, .1, .2 and .3 have another sum; without tolerance one of the two would win
        payoff = [[0.1, 0.2, 0.3], [0.3, 0.2, 0.1]]
        assert np.mean(payoff[0]) != np.mean(payoff[1])
        game = matrix_game("rounding", payoff, outcomes=True)
        assert game.success.tolist() == [[True, True]]

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
    @given(tables())
    def test_common_payoff(self, table):
        """Where all agents receive the same, the greatest rewards are optimal."""
        payoff = table[..., 0]
        game = matrix_game("common", payoff)
        assert game.success[0].tolist() == (payoff == payoff.max()).ravel().tolist()


class TestGame:
    def test_joint_digits(self):
        """The first agent's action is the most significant digit of a joint action."""
        game = matrix_game("three agents", np.zeros((3, 3, 3)))
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
