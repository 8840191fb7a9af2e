"""Train a peer of stable-baselines3 by playing, and keep its network at several numbers of matches.

``PYTHONPATH=tests .venv-sb3/bin/python -m studies.peers.online LEARNER SEED FOLDER --matches 1400`` writes
``FOLDER/LEARNER-SEED-MATCHES.npz``. With ``--minutes`` it stops after so many minutes instead.
"""

from __future__ import annotations

import argparse
import json
import time
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from studies.peers.network import Network, of_modules
from studies.peers.pitch import Pitches
from studies.peers.worth import Worth

from pipeline.arena.teams.panel import PANEL

#: Against whom all train.
OPPONENT = PANEL[0]
#: Matches at once; transitions of a match: a step each 0.2 s of 8 minutes, of three robots.
AT_ONCE, TRANSITIONS = 20, 2400 * 3
#: Matches after which the network is kept.
KEPT = (20, 40, 80, 140, 280, 560, 1_000, 1_400, 2_800, 5_600, 11_200)
#: Discount of a step: a goal in 20 s counts e times less.
DISCOUNT = 0.99
#: Matches in which DQN goes from random actions to its last share of them.
EXPLORED = 40
#: Matches of a learner and seed have seeds from here on, far from all that are evaluated.
FIRST_SEED, APART = 3_000_000_000, 1_000_000


def learner_of(name: str, pitches: Pitches, seed: int, matches: int) -> BaseAlgorithm:
    """The learner of a name: ``ppo`` or ``dqn``, with ``-v`` if V is in its reward."""
    torch.set_num_threads(1)
    common: dict[str, Any] = {"seed": seed, "device": "cpu", "gamma": DISCOUNT}
    if name.startswith("ppo"):
        return PPO("MlpPolicy", pitches, n_steps=64, batch_size=960, n_epochs=6, learning_rate=5e-4,
                   ent_coef=0.01, **common)
    return DQN("MlpPolicy", pitches, learning_rate=2.5e-4, buffer_size=500_000, batch_size=256, train_freq=1,
               gradient_steps=3, learning_starts=20_000, target_update_interval=10_000,
               exploration_fraction=min(1.0, EXPLORED / matches), **common)


def network_of(model: BaseAlgorithm) -> Network:
    """What chooses the actions of a learner."""
    policy: Any = model.policy
    if isinstance(model, PPO):
        return of_modules([*policy.mlp_extractor.policy_net, policy.action_net])
    return of_modules(list(policy.q_net.q_net))


class Keeping(BaseCallback):
    """Keeps the network each time enough matches are over, and stops after a time.

    Args:
        pitches: the matches.
        stem: path of the files, without the number of matches.
        kept: numbers of matches.
        minutes: time to train, None: no limit.
    """

    def __init__(self, pitches: Pitches, stem: Path, kept: list[int], minutes: float | None) -> None:
        super().__init__()
        self._pitches, self._stem, self._left = pitches, stem, kept
        self._end = None if minutes is None else time.monotonic() + 60 * minutes
        self._begun, self._cpu = time.monotonic(), time.process_time()

    def _on_step(self) -> bool:
        if self._left and len(self._pitches.differences) >= self._left[0]:
            self.keep(self._left.pop(0))
        return self._end is None or time.monotonic() < self._end

    def keep(self, matches: int) -> None:
        """Keep the network of so many matches."""
        network_of(self.model).save(self._stem.with_name(f"{self._stem.name}-{matches}.npz"))
        said = {"learner": self._stem.name, "matches": matches, "seconds": round(time.monotonic() - self._begun),
                "cpu_seconds": round(time.process_time() - self._cpu),
                "difference": float(np.mean(last)) if (last := self._pitches.differences[-AT_ONCE:]) else None}
        with self._stem.with_name("training.jsonl").open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(said) + "\n")


def train(name: str, seed: int, folder: Path, matches: int, minutes: float | None) -> None:
    """Train a learner, and keep its networks."""
    folder.mkdir(parents=True, exist_ok=True)
    worth = Worth(DISCOUNT) if name.endswith("-v") else None
    pitches = Pitches(AT_ONCE, count(FIRST_SEED + seed * APART), OPPONENT, worth)
    model = learner_of(name, pitches, seed, matches)
    stem = folder / f"{name}-{seed}"
    kept = [each for each in KEPT if minutes is not None or each < matches]
    keeping = Keeping(pitches, stem, kept, minutes)
    keeping.init_callback(model)
    keeping.keep(0)
    model.learn(matches * TRANSITIONS, callback=keeping)
    keeping.keep(len(pitches.differences))
    pitches.close()


def main() -> None:
    """Read the command, and train."""
    said = argparse.ArgumentParser(description=__doc__)
    said.add_argument("learner", choices=("ppo", "ppo-v", "dqn", "dqn-v"))
    said.add_argument("seed", type=int)
    said.add_argument("folder", type=Path)
    said.add_argument("--matches", type=int, default=1_400)
    said.add_argument("--minutes", type=float)
    given = said.parse_args()
    train(given.learner, given.seed, given.folder, given.matches, given.minutes)


if __name__ == "__main__":
    main()
