"""The grid world: moves, walls and rewards."""

import itertools
import math

import pytest
from support.grid import DOWN, LEFT, RIGHT, STAY, UP, positions, state_of
from support.planning import index_of

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
