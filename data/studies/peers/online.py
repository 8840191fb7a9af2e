"""Training of a peer of stable-baselines3 by playing; its network is kept at several numbers of matches.

``PYTHONPATH=data/studies .venv-sb3/bin/python -m peers.online LEARNER SEED FOLDER --matches 1400`` writes
``FOLDER/LEARNER-SEED-MATCHES.npz``. With ``--minutes`` it stops instead when it has had so many minutes of
one core, at the next number of matches at which its whole state is kept. A training that was stopped goes on
from its last whole state, with the same result as one that was not.
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import torch
from peers.network import Network, of_modules
from peers.pitch import Pitches
from peers.playing import KEPT
from peers.worth import Worth
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from pitchlore.pipeline.arena.teams.panel import PANEL

#: The opponent of all trainings.
OPPONENT = PANEL[0]
#: Matches at once; transitions of a match: a step each 0.2 s of 8 minutes, of three robots.
AT_ONCE, TRANSITIONS = 20, 2400 * 3
#: The whole state is kept each so many matches. No match, and no batch of PPO, is then under way.
SAVED_EACH = 200
#: Discount of a step: a goal in 20 s counts e times less.
DISCOUNT = 0.99
#: Matches in which DQN goes from random actions to its last share of them.
EXPLORED = 40
#: Matches of the longest training: no training is as long, and no schedule depends on how long it is.
MOST = 100_000
#: Matches of a learner and seed have seeds from here on, far from all that are evaluated.
FIRST_SEED, APART = 3_000_000_000, 1_000_000


def learner_of(name: str, pitches: Pitches, seed: int) -> BaseAlgorithm:
    """The learner of a name: ``ppo`` or ``dqn``, with ``-v`` if V is in its reward."""
    common: dict[str, Any] = {"seed": seed, "device": "cpu", "gamma": DISCOUNT}
    if name.startswith("ppo"):
        return PPO("MlpPolicy", pitches, n_steps=64, batch_size=960, n_epochs=6, learning_rate=5e-4,
                   ent_coef=0.01, **common)
    return DQN("MlpPolicy", pitches, learning_rate=2.5e-4, buffer_size=500_000, batch_size=256, train_freq=1,
               gradient_steps=3, learning_starts=20_000, target_update_interval=10_000,
               exploration_fraction=EXPLORED / MOST, **common)


def network_of(model: BaseAlgorithm) -> Network:
    """The network that chooses the actions of a learner."""
    policy: Any = model.policy
    if isinstance(model, PPO):
        return of_modules([*policy.mlp_extractor.policy_net, policy.action_net])
    return of_modules(list(policy.q_net.q_net))


class Training(BaseCallback):  # type: ignore[misc]  # not in this environment
    """Keeps the network at numbers of matches, the whole state each ``SAVED_EACH`` matches, and stops.

    Args:
        pitches: the matches.
        stem: path of the files, without the number of matches.
        seed: seed of the training.
        matches: after which it stops, None: no limit.
        minutes: minutes of one core after which it stops, at the next whole state; None: no limit.
    """

    def __init__(
        self, pitches: Pitches, stem: Path, seed: int, matches: int | None, minutes: float | None
    ) -> None:
        super().__init__()
        self._pitches, self._stem, self._seed = pitches, stem, seed
        self._matches = matches
        self._end = None if minutes is None else 60 * minutes
        self._spent, self._saved = -time.process_time(), 0

    @property
    def _over(self) -> int:
        """Matches that are over."""
        return len(self._pitches.differences)

    def _folder(self, which: str) -> Path:
        """The folder of the whole state; one that is there is whole, but for a ``part``."""
        return self._stem.with_name(f"{self._stem.name}-{which}")

    def begun(self, name: str) -> BaseAlgorithm:
        """The learner as it was kept last, or a new one."""
        state = next((each for each in map(self._folder, ("state", "before")) if each.exists()), None)
        if state is None:
            return learner_of(name, self._pitches, self._seed)
        kept = json.loads((state / "kept.json").read_text())
        self._spent += kept["cpu_seconds"]
        self._pitches.resume(kept["differences"])
        kind = PPO if name.startswith("ppo") else DQN
        model = kind.load(state / "model.zip", env=self._pitches, device="cpu")
        if isinstance(model, DQN):
            model.load_replay_buffer(state / "replay.pkl")
        self._saved = self._over
        model.set_random_seed(self._seed + self._over)
        return model

    def _on_rollout_start(self) -> None:
        if self._over != self._saved and not self._over % SAVED_EACH:
            self._save()
            self.model.set_random_seed(self._seed + self._over)  # as a training that goes on from here

    def _save(self) -> None:
        """Keep the whole state; at each moment one that was kept is there."""
        aside, state, before = map(self._folder, ("part", "state", "before"))
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir()
        self.model.save(aside / "model.zip")
        if isinstance(self.model, DQN):
            self.model.save_replay_buffer(aside / "replay.pkl")
        said = {"cpu_seconds": self._spent + time.process_time(), "differences": self._pitches.differences}
        (aside / "kept.json").write_text(json.dumps(said), encoding="utf-8")
        if state.exists():
            shutil.rmtree(before, ignore_errors=True)
            state.rename(before)
        aside.rename(state)
        shutil.rmtree(before, ignore_errors=True)
        self._saved = self._over

    def _on_step(self) -> bool:
        if self._over in KEPT:
            self.keep()
        return not self.done

    @property
    def done(self) -> bool:
        """True if it has played, or worked, as long as it was to, and has kept its state if one is due."""
        kept = self._saved == self._over
        late = self._end is not None and self._spent + time.process_time() >= self._end
        played = self._matches is not None and self._over >= self._matches
        return (late and kept) or (played and (kept or bool(self._over % SAVED_EACH)))

    def keep(self) -> None:
        """Keep the network as it is, unless that of so many matches is there."""
        path = self._stem.with_name(f"{self._stem.name}-{self._over}.npz")
        if path.exists():
            return
        network_of(self.model).save(path)
        last = self._pitches.differences[-AT_ONCE:]
        said = {"learner": self._stem.name, "matches": self._over,
                "cpu_seconds": round(self._spent + time.process_time()),
                "difference": float(np.mean(last)) if last else None}
        with self._stem.with_name("training.jsonl").open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(said) + "\n")


def train(name: str, seed: int, folder: Path, matches: int | None, minutes: float | None) -> None:
    """Train a learner, and keep its networks."""
    if matches is not None and (folder / f"{name}-{seed}-{matches}.npz").exists():
        return
    torch.set_num_threads(1)
    folder.mkdir(parents=True, exist_ok=True)
    worth = Worth(DISCOUNT) if name.endswith("-v") else None
    pitches = Pitches(AT_ONCE, count(FIRST_SEED + seed * APART), OPPONENT, worth)
    training = Training(pitches, folder / f"{name}-{seed}", seed, matches, minutes)
    model = training.begun(name)
    training.init_callback(model)
    if not training.done:
        if not pitches.differences:
            training.keep()
        model.learn(MOST * TRANSITIONS - model.num_timesteps, callback=training, reset_num_timesteps=False)
        training.keep()
    pitches.close()


def main() -> None:
    """Read the command, and train."""
    said = argparse.ArgumentParser(description=__doc__)
    said.add_argument("learner", choices=("ppo", "ppo-v", "dqn", "dqn-v"))
    said.add_argument("seed", type=int)
    said.add_argument("folder", type=Path)
    said.add_argument("--matches", type=int)
    said.add_argument("--minutes", type=float)
    given = said.parse_args()
    train(given.learner, given.seed, given.folder, given.matches, given.minutes)


if __name__ == "__main__":
    main()
