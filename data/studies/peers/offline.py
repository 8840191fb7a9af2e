"""Training of a peer of d3rlpy on logged decisions. Imports nothing of this project but arrays.

``PYTHONPATH=data/studies .venv-d3rlpy/bin/python -m peers.offline LEARNER SEED DECISIONS OUT`` reads the .npz
file that :mod:`peers.logged` wrote, and writes the network to ``OUT``.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import d3rlpy
import numpy as np
import torch
from d3rlpy.dataset import TransitionMiniBatch
from peers.network import of_modules

#: Discount of a decision, as that of the other peers.
DISCOUNT = 0.99
#: Steps of gradient descent, and decisions in each.
STEPS, BATCH = 15_000, 256
#: Number of behaviours.
ACTIONS = 32
_LAYERS = d3rlpy.models.VectorEncoderFactory(hidden_units=[64, 64])


def learner_of(name: str) -> Any:
    """The learner of a name: ``bc``; ``cql`` for goals; ``cql-v`` for V's change alone, without a future."""
    common: dict[str, Any] = {"batch_size": BATCH, "encoder_factory": _LAYERS}
    if name == "bc":
        return d3rlpy.algos.DiscreteBCConfig(learning_rate=5e-4, beta=0.0, **common).create(device="cpu:0")
    discount = DISCOUNT if name == "cql" else 0.0
    return d3rlpy.algos.DiscreteCQLConfig(
        learning_rate=3e-4, gamma=discount, target_update_interval=2_000, alpha=1.0, **common,
    ).create(device="cpu:0")


def train(name: str, seed: int, decisions: Path, out: Path, steps: int) -> None:
    """Train a learner, and keep its network.

    The library's own replay buffer gathers a batch decision by decision, which takes ten times as long as the
    step of gradient descent, so batches are cut out of the arrays.
    """
    torch.set_num_threads(1)
    d3rlpy.seed(seed)
    rng = np.random.default_rng(seed)
    with np.load(decisions) as arrays:
        seen, actions = arrays["observations"], arrays["actions"].astype(np.float32)[:, None]
        rewards = arrays["changes" if name == "cql-v" else "rewards"][:, None]
        over = arrays["terminals"].astype(np.float32)[:, None]
        known = np.flatnonzero(~arrays["timeouts"])  # what came after the others is not known
    learner = learner_of(name)
    learner.create_impl(seen.shape[1:], ACTIONS)
    ones = np.ones((BATCH, 1), dtype=np.float32)
    for _ in range(steps):
        rows = rng.choice(known, BATCH)
        after = np.minimum(rows + 1, len(seen) - 1)
        learner.update(TransitionMiniBatch(
            observations=seen[rows], actions=actions[rows], rewards=rewards[rows],
            next_observations=seen[after], next_actions=actions[after], terminals=over[rows], intervals=ones,
            transitions=[]))
    of_modules(_layers(learner.impl.modules, name)).save(out)


def _layers(modules: Any, name: str) -> list[Any]:
    """The layers that choose an action, in order."""
    whole = modules.imitator if name == "bc" else modules.q_funcs[0]
    kinds = (torch.nn.Linear, torch.nn.ReLU, torch.nn.Tanh)
    return [each for each in whole.modules() if isinstance(each, kinds)]


def main() -> None:
    """Read the command, and train."""
    said = argparse.ArgumentParser(description=__doc__)
    said.add_argument("learner", choices=("bc", "cql", "cql-v"))
    said.add_argument("seed", type=int)
    said.add_argument("decisions", type=Path)
    said.add_argument("out", type=Path)
    said.add_argument("--steps", type=int, default=STEPS)
    given = said.parse_args()
    train(given.learner, given.seed, given.decisions, given.out, given.steps)


if __name__ == "__main__":
    main()
