"""Imitations: teams rebuilt from recordings. Each has a data folder of its own, in ``imitations/``.

There the matches of the team are imported once more, from their logs, and all stages run with the settings
of an imitation. So an imitation changes no table of the folder around it, and is looked at as any folder is.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.settings import HabitSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt

if TYPE_CHECKING:
    from pitchlore.pipeline.engine.recordings import Recording

FOLDER = "imitations"
#: Most windows that an imitation is learned from; a run takes fewer (``HabitSettings``), and ends sooner.
_WINDOWS = 300_000
#: Word before a team's name that names its imitation.
PREFIX = "imitated:"

Chosen = TypeVar("Chosen", bound=Settings)


class Rebuilding(NamedTuple):
    """The work by which an imitation is made: a run of these recordings.

    Attributes:
        store: the imitation's own data folder.
        recordings: the logs of the team's matches.
    """

    store: Store
    recordings: list[Recording]


def name_of_words(text: str, longest: int) -> str:
    """A text as part of a name: lower case letters, digits and hyphens; a digest ends it where it is cut."""
    words = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
    short = f"{words[:longest - 9].rstrip('-')}-{digest(words.encode())[:8]}"
    return words if len(words) <= longest else short


def imitation_of(store: Store, team: str) -> Store:
    """The data folder of a team's imitation, which may be new."""
    # names of different teams may differ in signs alone
    return Store(store.root / FOLDER / f"{name_of_words(team, 40)}-{digest(team.encode())[:8]}".lstrip("-"))


def settings_of(settings: Chosen, team: str) -> Chosen:
    """Settings by which a run imitates a team, whatever they say of learners, options and teams."""
    said = settings.knowledge.habits.model_dump(exclude_unset=True)  # a run's own are for fewer windows
    habits = HabitSettings.model_validate({"windows_at_most": _WINDOWS, **said})
    changed: dict[str, Any] = {
        "options": settings.options.model_copy(update={"recover": True}),
        "policies": settings.policies.model_copy(update={"learner": "imitation"}),
        "grams": settings.grams.model_copy(update={"of": "options"}),
        "knowledge": settings.knowledge.model_copy(update={
            "imitate": team, "habits": habits, "recover": None}),
        "sides": settings.sides.model_copy(update={"teams": (team,), "kind": Kind.VSSS, "pools": {}}),
    }
    return settings.model_copy(update=changed)


def work_of(store: Store, team: str) -> Rebuilding:
    """The work by which a team is imitated.

    Args:
        store: holds the matches of the team.
        team: its name in them.

    Raises:
        NotFound: if no match is of that team; names those that there are.
        BadSettings: if its matches are of other leagues than VSSS, whose options are not recovered.
    """
    from pitchlore.pipeline.engine.recordings import Recording  # noqa: PLC0415 (it loads numba)

    matches = list(store.receipts("matches"))
    mine = [receipt for receipt in matches if team in _teams(receipt)]
    if not mine:
        there = ", ".join(sorted({name for receipt in matches for name in _teams(receipt)})) or "none"
        raise NotFound(f"no match is of a team {team!r} (there are: {there})", where=store.where,
                       next_step="Import its matches first")
    small = [receipt for receipt in mine if receipt.details["pitch"]["kind"] == Kind.VSSS]
    if not small:
        raise BadSettings(f"the matches of {team!r} are of a league whose options are not recovered",
                          where=store.where, next_step="Name a team of the league vsss")
    store.bring(small, {"log"})
    return Rebuilding(imitation_of(store, team), [
        Recording(file=store.folder(receipt) / receipt.files["log"].path) for receipt in small])


def _teams(receipt: Receipt) -> tuple[str, str]:
    """The names of a match's teams."""
    return receipt.details["home"], receipt.details["away"]
