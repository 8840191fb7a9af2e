"""The arena for learners; needs the extra ``rl``."""

from __future__ import annotations

from pitchlore.pipeline.base.errors import NotFound

try:
    from pitchlore.pipeline.arena.env import env, parallel_env
except ModuleNotFoundError as missing:
    if missing.name not in ("gymnasium", "pettingzoo"):
        raise
    raise NotFound(f"needs {missing.name}, which is not installed", where="pitchlore.env",
                   next_step="Install the extra pitchlore[rl]") from missing

__all__ = ["env", "parallel_env"]
