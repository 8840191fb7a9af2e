"""The start of a season: an apprentice that begins as the imitation of a team, and learns on by experience.

The season's own store begins with what the imitation knows: its version of the knowledge with the team's
habits, its policy, and what policies need of its matches. The first game is played by that policy. Later
ones are learned from the games, and the habits count on (``policies.appraisals.habits``).
"""

from __future__ import annotations

import shutil

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine.imitations import PREFIX, imitation_of
from pitchlore.pipeline.engine.teams import imitation
from pitchlore.pipeline.stages.seasons.settings import SeasonSettings, StartingTeam
from pitchlore.pipeline.store import Store

#: What policies need of matches, besides the versions.
OF_POLICIES = ("sides", "sequences", "decisions")


def start_of(store: Store, word: str, settings: SeasonSettings) -> StartingTeam:
    """The start that a word names.

    Args:
        store: the data folder.
        word: imitated:NAME.
        settings: settings of the season.

    Raises:
        BadSettings: if it is no imitation, or if an apprentice of these settings cannot start from one.
        NotFound: if nothing imitates the team yet.
    """
    if not word.startswith(PREFIX):
        raise BadSettings(f"{word!r} is no imitation", where="--start", next_step=f"Name {PREFIX}TEAM")
    learns = settings.pipeline
    if learns.policies.learner != "sight" or not learns.knowledge.accumulate:
        raise BadSettings("this apprentice does not decide by what it sees", where="--start",
                          next_step="Take the settings looking-held, or others that are based on looking")
    player = imitation(store, word.removeprefix(PREFIX))
    assert player.team.policy_version is not None
    assert player.team.knowledge_version is not None
    return StartingTeam(word=word, policy=player.team.policy_version, knowledge=player.team.knowledge_version,
                        label=str(player.team.settings.policy))


def begin_season(store: Store, own: Store, start: StartingTeam) -> None:
    """Copy what the imitation knows into a season's own store, unless that was done.

    Args:
        store: the data folder.
        own: the season's own store.
        start: the start.

    Raises:
        NotFound: if the imitation is there no more.
    """
    if start.policy in own.versions("policies"):
        return
    imitating = imitation_of(store, start.word.removeprefix(PREFIX))
    versions = {noun: imitating.version_folder(noun, imitating.manifest(noun, version).version)
                for noun, version in (("knowledge", start.knowledge), ("policies", start.policy))}
    for noun in OF_POLICIES:
        shutil.copytree(imitating.root / noun, own.root / noun, dirs_exist_ok=True)
    for noun, folder in versions.items():  # the policy is last: what was cut short is done anew
        (own.root / noun).mkdir(parents=True, exist_ok=True)
        half = own.root / noun / f".{folder.name}.begun"
        shutil.copytree(folder, half, dirs_exist_ok=True)
        shutil.rmtree(own.root / noun / folder.name, ignore_errors=True)
        half.rename(own.root / noun / folder.name)
