"""All that numba compiles, once: `make test` does it while the lint leaves a core idle.

What the tests need is then found compiled. A test that needs more compiles it, as before.

    PYTHONPATH=tests python -m support.compiled
"""

import os
from itertools import pairwise, product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import get_args

from golden.cases import CASES
from support.played import logged

import pitchlore
from pitchlore.pipeline.arena.env import parallel_env
from pitchlore.pipeline.arena.match.environment import Actions, Observations
from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.table import SCRIPTED

#: What says that all was compiled. The folder is named for the code of all that is compiled.
MADE = Path(os.environ["NUMBA_CACHE_DIR"]) / "compiled"
#: A camera with errors, which takes its time.
LATE = CameraSettings(position_noise=0.003, latency_s=0.1)


def main() -> None:
    """Make the goldens, and play each scripted team; nothing is kept but what was compiled."""
    if MADE.exists():
        return
    for make in CASES.values():
        make()
    for home, away in pairwise(SCRIPTED):
        pitchlore.play(home, away, minutes=0.1, arena=MatchSettings(camera=LATE))
    with TemporaryDirectory() as folder:
        pitchlore.play(minutes=0.1).replay(Path(folder) / "page.html")
    kinds = product((None, "static"), get_args(Actions), get_args(Observations))
    for opponent, actions, observations in kinds:
        env = parallel_env(opponent, actions=actions, observations=observations)
        env.reset(seed=0)
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    ahead, usual = TeamSettings(kind="static", predict_s=0.1), TeamSettings(kind="static")
    logged(Recipe(home=ahead, away=usual, seed=1, camera=LATE, referee=RefereeSettings(duration_s=6)))
    MADE.touch()


if __name__ == "__main__":
    main()
