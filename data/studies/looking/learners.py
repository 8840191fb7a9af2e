"""Learners of the study, their apprentices, and the arms in which these are measured."""

from __future__ import annotations

import sys
from collections.abc import Collection, Sequence
from typing import Final, NamedTuple

import numpy as np

from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.physics.settings import PhysicsSettings
from pitchlore.pipeline.arena.teams.panel import PANEL

STATIC: Final = "static"
CONSTANT = "best-constant"
#: Each role's best action for a second among robots that look, which ``make trial`` searched for.
FOR_A_SECOND = "constant:044/011/044"
USUAL = MatchSettings(referee=RefereeSettings(duration_s=480.0))
_LATE = USUAL.model_copy(update={"camera": CameraSettings(latency_s=0.1, position_noise=0.01)})
_TYPICAL = CameraSettings(position_noise=0.003, heading_noise=np.radians(2.0))
_ROLLING = PhysicsSettings().rolling


class Arm(NamedTuple):
    """Matches of one kind.

    Attributes:
        name: name of the arm.
        opponents: words of the opponents.
        trained: settings of the apprentices' seasons.
        seasons: seeds of the seasons.
        seeds: seeds of the pairs of matches.
        how: settings of the matches.
        blind: whether the apprentice is blind (:mod:`looking.blind`).
        late_s: age of the sights on which a blind team acts, seconds; None: any, drawn anew each time.
        predict_s: how far ahead the team predicts; None: as its season says, or not at all.
    """

    name: str
    opponents: Sequence[str]
    trained: str
    seasons: range
    seeds: range
    how: MatchSettings = USUAL
    blind: bool = False
    late_s: float | None = None
    predict_s: float | None = None

    @property
    def words(self) -> list[str]:
        """The apprentices: the ids of their seasons."""
        return [f"{self.trained}-static-{seed}" for seed in self.seasons]


class Learner(NamedTuple):
    """Five apprentices, five more whose camera is late, and their matches.

    Nobody was chosen on these seeds.

    Attributes:
        season: settings of the seasons; those with the late camera are called ``season``-late.
        said: how the names of its arms begin.
        seasons: seeds of the seasons.
        seeds: seeds of the pairs of matches.
        late_seasons, late_seeds: the same of the late camera.
    """

    season: str
    said: str
    seasons: range
    seeds: range
    late_seasons: range
    late_seeds: range

    @property
    def panel(self) -> Arm:
        """Its matches against the panel."""
        return Arm(self.said or "panel", PANEL, self.season, self.seasons, self.seeds)

    @property
    def blind(self) -> Arm:
        """Its matches against static, blind."""
        return self.panel._replace(name=self.named("blind"), opponents=(STATIC,), blind=True)

    @property
    def noisy(self) -> list[Arm]:
        """Its matches in which a camera's usual noise disturbs it, on three kinds of ground."""
        rolling = {"": 1.0, ", rolling -50%": 0.5, ", rolling +50%": 1.5}
        return [
            self.panel._replace(
                name=self.named(f"camera noise{said}"), opponents=(STATIC,),
                how=USUAL.model_copy(update={
                    "camera": _TYPICAL, "physics": PhysicsSettings(rolling=share * _ROLLING)}))
            for said, share in rolling.items()
        ]

    @property
    def late(self) -> Arm:
        """Matches of the apprentices whose camera is late."""
        return Arm(self.named("late camera, trained under it"), (STATIC,), f"{self.season}-late",
                   self.late_seasons, self.late_seeds, _LATE)

    @property
    def arms(self) -> list[Arm]:
        """All of these."""
        return [self.panel, self.blind, *self.noisy, self.late]

    def named(self, kind: str) -> str:
        """The name of an arm."""
        return f"{self.said}, {kind}" if self.said else kind

    def controls(self, *others: str) -> list[tuple[str, Arm]]:
        """Teams that learn nothing, in its arms.

        best-constant plays in all but the blind one, ``others`` against the panel.
        """
        against = [(word, self.panel._replace(opponents=[each for each in PANEL if each != word]))
                   for word in (CONSTANT, *others)]
        predicts = self.late._replace(name=self.named("late camera, predicts"), predict_s=0.1)
        return [*against, *((CONSTANT, arm) for arm in (*self.noisy, predicts))]


WATCHED = Learner("looking", "", range(2001, 2006), range(2_000_000, 2_000_050),
                  range(2011, 2016), range(2_200_000, 2_200_050))
ALL = Learner("looking-all", "all actions offered", range(2021, 2026), range(2_300_000, 2_300_050),
              range(2031, 2036), range(2_400_000, 2_400_050))
HELD = Learner("looking-held", "tries held", range(2051, 2056), range(2_600_000, 2_600_050),
               range(2061, 2066), range(2_650_000, 2_650_050))
LEARNERS = (WATCHED, ALL, HELD)
#: The arms, by the learner that they belong to.
ARMS: dict[str, list[Arm]] = {
    WATCHED.season: [
        *WATCHED.arms,
        WATCHED.late._replace(name="late camera, trained under it, does not predict", predict_s=0.0),
        WATCHED.panel._replace(
            name="actions shuffled in training", opponents=(STATIC,), trained="looking-shuffled")],
    ALL.season: [
        *ALL.arms,
        ALL.panel._replace(name="all actions offered, sights drawn in training", opponents=(STATIC,),
                           trained="looking-drawn", seasons=range(2041, 2046))],
    HELD.season: [
        *HELD.arms,
        HELD.blind._replace(name=HELD.named("blind, sees what was 30 s ago"), late_s=30.0),
        HELD.panel._replace(name=HELD.named("each role's best for a second"), opponents=(FOR_A_SECOND,))],
}
#: Teams that learn nothing, in the same matches.
CONTROLS: dict[str, list[tuple[str, Arm]]] = {
    WATCHED.season: [
        *WATCHED.controls("constant:044", "pressing"),
        (CONSTANT, WATCHED.late._replace(name="late camera", predict_s=0.0))],
    ALL.season: ALL.controls(),
    HELD.season: HELD.controls("constant:044", FOR_A_SECOND),
}
#: Arms that differ only in whether all actions were offered.
ALIKE = tuple(zip(WATCHED.arms, ALL.arms, strict=True))


def learners_of(chosen: Sequence[str], among: Collection[str]) -> list[Learner]:
    """The learners that are chosen by their settings; all, if none is.

    Args:
        chosen: settings.
        among: settings that there are.

    Raises:
        SystemExit: if there are no such settings.
    """
    if unknown := set(chosen) - set(among):
        sys.exit(f"no learner is called {', '.join(sorted(unknown))}. There are {', '.join(among)}.")
    return [learner for learner in LEARNERS if learner.season in (chosen or among)]
