"""Settings of an environment for learners."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.base.toml import Frozen

Actions = Literal["wheels", "behaviours"]
RenderMode = Literal["human", "rgb_array"]
Observations = Literal["bodies", "sights"]

#: Default length of a step by the kind of actions, seconds; None is one frame.
_STEP_S: dict[Actions, float | None] = {"wheels": None, "behaviours": 0.4}
_MODES = ("human", "rgb_array")


class EnvSettings(Frozen):
    """Settings of an environment.

    Attributes:
        actions: ``wheels`` or ``behaviours``.
        step_s: seconds that a step lasts, rounded to whole frames, at least one. None: a frame for wheels,
            0.4 s for behaviours.
        observations: ``bodies`` or ``sights``.
        goal_ends: whether a goal ends the episode.
        render_mode: ``rgb_array``: ``render`` returns a picture; ``human``: a window shows each frame in real
            time (extra ``play``); closing it interrupts, as Ctrl-C does. None: neither.
        matches: how matches are played: robots a side, pitch, physics, laws with the duration, camera.
    """

    actions: Actions = "wheels"
    step_s: float | None = Field(default=None, gt=0)
    observations: Observations = "bodies"
    goal_ends: bool = False
    render_mode: RenderMode | None = None
    matches: MatchSettings = MatchSettings()

    @property
    def frames(self) -> int:
        """Frames of a step."""
        seconds = _STEP_S[self.actions] if self.step_s is None else self.step_s
        return 1 if seconds is None else max(1, round(seconds * self.matches.physics.hz))

    @property
    def metadata(self) -> dict[str, Any]:
        """The metadata that both libraries ask for."""
        return {"name": "pitchlore", "render_modes": list(_MODES), "is_parallelizable": True,
                "render_fps": max(1, round(self.matches.physics.hz / self.frames))}
