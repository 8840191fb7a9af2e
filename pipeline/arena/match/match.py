"""The loop of two controllers, physics and the referee; the match is handed out in parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.arena.match.controllers import Controller, Decided
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.arena.physics.camera import Camera
from pitchlore.pipeline.arena.physics.laws import END, GOAL, HALF, KICK_OFF, PLAY_ON
from pitchlore.pipeline.arena.physics.referee import (
    Laws,
    RefereeEvent,
    attack_direction,
    begin,
    call_events,
    event_rows,
    referee_call,
)
from pitchlore.pipeline.arena.physics.restarts import restart
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y, see_both
from pitchlore.pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames, MatchInfo
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.schemas import AWAY, HOME, ROLES, SIDES, Decisions
from pitchlore.schemas.decisions import ENDS

#: Frames that a log gets at once.
PART = 1024


class LogPart(NamedTuple):
    """Frames, events and decisions since the last part, as a recorder takes them.

    Attributes:
        frames: the samples.
        referee: rows of schema Referee.
        decisions: rows of schema Decisions of the episodes that have ended.
    """

    frames: Frames
    referee: pl.DataFrame
    decisions: pl.DataFrame


class MatchInPlay:
    """A match that is played frame by frame.

    :meth:`advance` plays whole frames. An environment decides between the referee's call and the next motion:
    it calls :meth:`call` and :meth:`move` in turn, a call first.

    Args:
        recipe: recipe of the match.
        controllers: controllers of home and away.
        logged: whether frames are kept for :meth:`take`; without, memory does not grow.

    Attributes:
        bodies: float64 [1 + 2 N, 6], as they are at the frame that is next.
        views: float64 [2, 1 + 2 N, 6], of home and of away: see :func:`pipeline.game.bodies.see`. They are
            the bodies as the camera saw them at the last call, whether play was on or not.
        over: whether the final whistle has been.
        in_play: whether play is on; while it is not, all wheels stand still and nobody is asked.
        attacks: +1 if home attacks +x, else -1.
        score: goals of home and away, those of the start included.
        events: the referee's events since the last :meth:`take`, in order.

    Raises:
        BadSettings: if nothing can be played by this recipe.
    """

    def __init__(
        self, recipe: Recipe, controllers: tuple[Controller, Controller], *, logged: bool = True
    ) -> None:
        self.recipe = recipe
        self.controllers = controllers
        self.over = False
        self.score = recipe.score
        physics = recipe.physics
        self.laws = Laws.of(recipe.pitch, recipe.referee, physics.hz)
        self._arena = Arena(recipe.pitch, recipe.robots, physics)
        self.bodies = self._arena.bodies
        self._state = begin(HOME, recipe.score)
        self._rng = np.random.default_rng([recipe.seed, 0])
        self._camera = Camera(
            recipe.camera, recipe.pitch, recipe.robots, physics.hz, np.random.default_rng([recipe.seed, 3])
        )
        self._wheels = np.zeros((2 * recipe.robots, 2))
        self._hands = (self._wheels[: recipe.robots], self._wheels[recipe.robots :])
        self.views: F64 = np.zeros((2, *self.bodies.shape))
        self._of_teams = tuple(self.views)
        self.attacks = 1.0
        self.in_play = False
        self._logged = logged
        self._samples: list[F64] = []
        self._first = 0
        self.events: list[RefereeEvent] = []

    @property
    def frame(self) -> int:
        """Number of the frame that is next."""
        return int(self._state["frame"])

    @property
    def info(self) -> MatchInfo:
        """Description of the match for its log; a match that was left is not complete."""
        recipe = self.recipe
        left = self.over and self._state["due"] != END
        why = f"left after {self.frame / self.laws.hz:.1f} of {recipe.referee.duration_s:.1f} s"
        return MatchInfo(
            match_id=recipe.match_id, source=f"{recipe.match_id}.mcap", format="world",
            home=recipe.home.name, away=recipe.away.name, pitch=recipe.pitch, periods=self.laws.periods(),
            seed=recipe.seed, settings=recipe.model_dump(mode="json"), software=RELEASE,
            complete=not left, incomplete_reason=why if left else None,
        )  # fmt: skip

    def advance(self, frames: int = 1) -> bool:
        """Play some frames, fewer if the match ends. Returns whether the match goes on."""
        for _ in range(frames):
            if self.over:
                break
            self.call()
            self.move()
        return not self.over

    def call(self) -> None:
        """The first half of a frame: the referee's call, new places at a restart, the look, the log."""
        call = referee_call(self.bodies, self._state, self.laws.limits)
        if call != PLAY_ON:
            self._called(call, self.frame - 1)
        see_both(self._look(), self.attacks, self.views)

    def move(self) -> None:
        """The second half of a frame, unless the match is over: controllers think, bodies move."""
        if self.over:
            return
        if self.in_play:
            frame = self.frame - 1
            for controller, view, wheels in zip(self.controllers, self._of_teams, self._hands, strict=True):
                controller.think(frame, view, wheels)
        self._arena.frame(self._wheels)

    def leave(self) -> None:
        """End the match early, at the next frame."""
        if self.over:
            return
        frame = self.frame
        self._stop(frame, None)
        self.events.append(RefereeEvent(self.laws.t_ns(frame), "end", None, *self.score, "left early"))
        self._look()
        self.over = True

    def take(self) -> LogPart:
        """The part since the last call."""
        match_id = self.recipe.match_id
        events, self.events = self.events, []
        samples, self._samples = self._samples, []
        first, self._first = self._first, self._first + len(samples)
        made = [
            decisions_of(controller.decided(), team, match_id, self.laws.hz)
            for team, controller in zip(SIDES, self.controllers, strict=True)
        ]
        return LogPart(
            logged_frames(np.array(samples).reshape(-1, *self.bodies.shape), first, self.laws.hz),
            event_rows(match_id, events),
            pl.concat(made).sort("end_ns", "team", "robot", "t_ns"),
        )

    def _look(self) -> F64:
        """The bodies as the camera sees them; unseen bodies are NaN in the logged sample."""
        seen, visible = self._camera.see(self.bodies)
        if self._logged:
            sample = seen.copy()
            if not self._camera.off:
                sample[~visible] = np.nan
            self._samples.append(sample)
        return seen

    def _called(self, call: int, frame: int) -> None:
        """Tell the log, the controllers and the arena what the referee has called."""
        self.score = int(self._state["home_goals"]), int(self._state["away_goals"])
        events = call_events(call, self._state, self.laws)
        self.events += events
        if not KICK_OFF <= call <= HALF:
            self._stop(frame, events[0].team if call == GOAL else None)
            self.over = call == END
            return
        if call == HALF:
            self._stop(frame, None)
        self.attacks = float(attack_direction(int(self._state["halves_over"])))
        restart(self.bodies, call, self._state, self.laws, self._rng)
        self._arena.place(self.bodies)
        self.in_play = True
        home, away = self.score
        for controller, lead in zip(self.controllers, (home - away, away - home), strict=True):
            controller.restarted(frame, lead)

    def _stop(self, frame: int, scorer: str | None) -> None:
        """Play stops, if it was on: robots stand, episodes are over."""
        self._wheels[:] = 0.0
        if self.in_play:
            for team, controller in zip(SIDES, self.controllers, strict=True):
                controller.stopped(frame, 0.0 if scorer is None else (1.0 if scorer == team else -1.0))
        self.in_play = False


def logged_frames(samples: F64, first: int, hz: float) -> Frames:
    """Samples [F, 1 + 2 N, 6] as a log holds them; the first has number ``first``.

    A ball that was not seen is NaN, a robot is left out.
    """
    count, robots = len(samples), samples.shape[1] - 1
    number = np.arange(first, first + count, dtype=np.uint32)
    ball = np.zeros(count, dtype=BALL_DTYPE)
    for name, column in (("x", X), ("y", Y), ("vx", VX), ("vy", VY)):
        ball[name] = samples[:, BALL, column]
    rows = np.zeros((count, robots), dtype=ROBOT_DTYPE)
    rows["team"] = np.repeat((HOME, AWAY), robots // 2)
    rows["id"] = np.tile(np.arange(1, robots // 2 + 1), 2)
    for name, column in (("x", X), ("y", Y), ("theta", THETA), ("vx", VX), ("vy", VY), ("omega", OMEGA)):
        rows[name] = samples[:, 1:, column]
    t_ns = np.rint(number * 1e9 / hz).astype(np.int64)
    there = ~np.isnan(samples[:, 1:, X])
    offsets = np.concatenate(([0], there.sum(axis=1).cumsum())).astype(np.int64)
    whole = rows.view(f"V{ROBOT_DTYPE.itemsize}")  # with its padding, which is 0; a record's copy has any
    return Frames(number, t_ns, ball, offsets, whole[there].view(ROBOT_DTYPE))


def decisions_of(decided: Sequence[Decided], team: str, match_id: str, hz: float) -> pl.DataFrame:
    """Decisions of a team as rows of schema Decisions; the stage decisions adds their values."""
    rows = [
        {
            "match_id": match_id, "team": team, "robot": d.robot, "role": ROLES[d.role],
            "t_ns": round(d.frame * 1e9 / hz), "end_ns": round(d.end * 1e9 / hz), "state": d.state,
            "behaviour_id": d.behaviour_id, "random": d.random, "reward": d.reward, "episode": d.episode,
            "ends": ENDS[0] if d.last else None, "value": 0.0, "chosen": True,
        }
        for d in decided
    ]  # fmt: skip
    schema = Decisions.dtypes()
    return pl.DataFrame([{name: row[name] for name in schema} for row in rows], schema=schema)
