"""Facts that a provider's files tell and kloppy does not pass on: who attacks where, and the final score."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from pitchlore.pipeline.importers.directions import Sign
from pitchlore.pipeline.importers.source import SourceFile

if TYPE_CHECKING:
    from kloppy.domain import TrackingDataset

#: Orientations of kloppy in which home attacks one way in every period.
_STATIC: dict[str, Sign] = {"fixed-home-away": 1, "fixed-away-home": -1}
#: Orientations in which the axes turn with who has the ball.
TURNING = ("ball-owning-team", "action-executing-team")
_KEEPER_LEFT = re.compile(rb"<Phase(\d)HomeGKLeft>\s*(true|false)\s*<", re.IGNORECASE)
_TOTAL = re.compile(rb"<total\s+home=\"(\d+)\"\s+away=\"(\d+)\"")


def attacks_told(dataset: TrackingDataset, source: SourceFile | None) -> dict[int, Sign]:
    """Direction in which home attacks in each period, by its id, as the provider or the dataset says.

    TRACAB tells at which end home's goalkeeper stands in each phase, SkillCorner and Metrica's EPTS where
    home attacks, PFF where it begins; kloppy turns PFF's extra time as if home began it at the same end.
    What kloppy itself finds from the first frame is not told, and left to the bodies of all frames.
    """
    orientation = orientation_of(dataset)
    if orientation in _STATIC:
        return dict.fromkeys((period.id for period in dataset.metadata.periods), _STATIC[orientation])
    if source is None or source.provider is None:
        return {}
    meta = source.parts[0]
    if source.provider == "metrica-epts" and orientation in ("home-away", "away-home"):
        return _alternating(orientation == "home-away")
    if source.provider == "tracab" and (found := _KEEPER_LEFT.findall(meta)):
        return {int(phase): 1 if left.lower() == b"true" else -1 for phase, left in found}
    facts = _json(meta)
    if source.provider == "tracab":
        lefts = {phase: facts.get(f"Phase{phase}HomeGKLeft") for phase in range(1, 6)}
        return {phase: 1 if left else -1 for phase, left in lefts.items() if isinstance(left, bool)}
    if source.provider == "pff" and isinstance(facts.get("homeTeamStartLeft"), bool):
        return _alternating(facts["homeTeamStartLeft"])
    if source.provider == "skillcorner" and isinstance(facts.get("home_team_side"), list):
        signs: dict[str, Sign] = {"left_to_right": 1, "right_to_left": -1}
        sides = enumerate(facts["home_team_side"], 1)
        return {period: signs[side] for period, side in sides if side in signs}
    return {}


def score_told(dataset: TrackingDataset, source: SourceFile | None) -> tuple[int, int] | None:
    """The final score, home and away, as the provider says; None if it does not.

    Kloppy reads none in Stats Perform's XML, and gives 0 : 0, two of Python's own numbers, where Metrica's
    EPTS has no score.
    """
    if source is not None and source.provider == "statsperform":
        total = _TOTAL.search(source.parts[0])
        if total is not None:
            return int(total[1]), int(total[2])
    score = dataset.metadata.score
    if score is None or not (str(score.home).isdigit() and str(score.away).isdigit()):
        return None
    home, away = int(str(score.home)), int(str(score.away))
    if home == away == 0 and type(score.home) is int and _word(dataset.metadata.provider) == "metrica":
        return None
    return home, away


def orientation_of(dataset: TrackingDataset) -> str:
    """Kloppy's word for the orientation of a dataset."""
    return _word(dataset.metadata.orientation)


def _word(value: Any) -> str:
    """The word of one of kloppy's enumerations."""
    return str(getattr(value, "value", value))


def _alternating(right: bool) -> dict[int, Sign]:
    """Home attacks the other way in each next period."""
    first: Sign = 1 if right else -1
    second: Sign = -1 if right else 1
    return {1: first, 2: second, 3: first, 4: second}


def _json(content: bytes) -> dict[str, Any]:
    """An object in JSON, or the first one of a list; empty if it is anything else."""
    try:
        found = json.loads(content)
    except (ValueError, RecursionError):
        return {}
    if isinstance(found, list):
        found = found[0] if found else {}
    return found if isinstance(found, dict) else {}
