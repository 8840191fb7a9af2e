"""Teams by the words that people call them, and the policies of learned teams."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import NamedTuple, TypedDict, Unpack

from pitchlore.pipeline.arena.match.controllers import LearnedTeam, PolicyTables, constant_team
from pitchlore.pipeline.arena.match.recipe import TeamSettings
from pitchlore.pipeline.arena.teams.clock import ClockSettings
from pitchlore.pipeline.arena.teams.constant import BEST
from pitchlore.pipeline.arena.teams.table import SCRIPTED
from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import BadSettings, NotFound, PitchloreError
from pitchlore.pipeline.base.toml import fitted
from pitchlore.pipeline.engine.imitations import PREFIX, imitation_of, name_of_words
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.policies import looks
from pitchlore.pipeline.stages.evaluations import Entrant
from pitchlore.pipeline.stages.seasons.settings import ITSELF, Rival, Season
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import SAFE_NAME
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.schemas import Appraisals, Policies
from pitchlore.schemas.seasons import PERSON

_SEASONS = "seasons"
#: Word of a team that another program drives.
REMOTE = "remote"
#: Most characters of the name of a season's opponent.
_LONGEST = 32


class TeamOptions(TypedDict, total=False):
    """How a learned team is to play. What is left out, or None, is as when the team learned, or was found.

    Attributes:
        explore, lcb_weight, min_visits, predict_s, clock_s: see ``TeamSettings``.
        least_s, interrupts, begin_ended: see ``ClockSettings``.
    """

    explore: float | None
    lcb_weight: float | None
    min_visits: int | None
    predict_s: float | None
    clock_s: float | None
    least_s: float | None
    interrupts: bool | None
    begin_ended: bool | None


def entrant(
    store: Store, word: str, policies: dict[str, PolicyTables], **options: Unpack[TeamOptions]
) -> Entrant:
    """The team that a word names; its policy, if it has one, is added to ``policies``.

    Args:
        store: holds policies and seasons.
        word: the name of a scripted team; learned for the newest policy, learned:3 or just 3 for a
            version; best-constant or constant:044 for a constant team, see
            :func:`pipeline.arena.teams.constant.constant`; imitated:NAME for the imitation of a team; the id
            of a season for its apprentice, see :func:`apprentice`.
        policies: policies by label; the team's is added.
        options: how it plays; a scripted team has none.

    Raises:
        BadSettings: if the word names no team, or a constant team of unknown codes.
        NotFound: if the policy does not exist, or if the season or the imitation has none yet.
    """
    if word in SCRIPTED or word == REMOTE:
        return Entrant(name=word, settings=TeamSettings.model_validate({"kind": word}))
    always = constant_team(word)
    version = word.removeprefix("learned:")
    if always is not None:
        named, tables = str(always.settings.policy), always.tables
        team = Entrant(name=word if word == BEST else named, settings=always.settings)
    else:
        if word == "learned" or version.isdecimal():
            manifest = policy(store, None if word == "learned" else int(version))
            player = _player(store, manifest, f"v{manifest.version}", _plays(manifest))
        elif word.startswith(PREFIX):
            player = imitation(store, word.removeprefix(PREFIX))
        else:
            player = apprentice(store, word)
        named, tables = labelled(player.store, player.manifest)
        team = player.team
    policies[named] = tables
    return playing(team, **options)


def playing(team: Entrant, **options: Unpack[TeamOptions]) -> Entrant:
    """A learned team that plays by options.

    Raises:
        BadSettings: if an option does not exist, or its value does not fit.
    """
    given = {name: value for name, value in options.items() if value is not None}
    clock = {name: given.pop(name) for name in ClockSettings.model_fields if name in given}
    settings = team.settings.model_dump() | given
    settings["clock"] = team.settings.clock.model_dump() | clock
    plays = fitted(TeamSettings, settings, where=team.name, keys="See pipeline.engine.teams.TeamOptions")
    return team.model_copy(update={"settings": plays})


def rivals(store: Store, words: Sequence[str]) -> tuple[str, tuple[Rival, ...]]:
    """The opponents of a season, by their words.

    Args:
        store: the data folder.
        words: the word of an opponent, or of several that take turns: as for :func:`entrant`, or itself.

    Returns:
        Name and rivals for :class:`pipeline.stages.seasons.settings.Season`. A script alone, or a person, has
        a name and no rivals.

    Raises:
        BadSettings: if a word names no team that can be played against.
        NotFound: if a policy does not exist.
    """
    if len(words) == 1 and (words[0] in SCRIPTED or words[0] == PERSON):
        return words[0], ()
    found = []
    for word in words:
        if word in (REMOTE, PERSON):
            raise BadSettings(f"{word!r} takes no turns with others, and learns nothing", where="--opponent",
                              next_step="Name it alone, or leave it out")
        if word == ITSELF:
            found.append(Rival(word=word, team=TeamSettings(kind="learned")))
            continue
        player = entrant(store, word, {})
        fixed = f"learned:{player.policy_version}" if word == "learned" or word.isdecimal() else word
        found.append(Rival(word=fixed, team=player.settings))
    return name_of_words("-".join(rival.word for rival in found), _LONGEST), tuple(found)


def load_rival(store: Store, rival: Rival, policies: dict[str, PolicyTables]) -> None:
    """Add an opponent's policy, if it has one, to ``policies``.

    Raises:
        BadSettings: if its policy is another by now.
        NotFound: if its policy is gone.
    """
    if rival.word != ITSELF and rival.team.policy is not None:
        entrant(store, rival.word, policies)
        if rival.team.policy not in policies:
            raise BadSettings("has learned since the season began", where=rival.word,
                              next_step="Play a season of another seed")


def learned_team(store: Store, word: str, **options: Unpack[TeamOptions]) -> LearnedTeam:
    """A learned team of a data folder, as an opponent in the environments of ``pipeline.arena.env``.

    Args:
        store: the data folder.
        word: names a policy, a season's apprentice or a constant team, see :func:`entrant`.
        options: how it plays.

    Raises:
        BadSettings: if the word names no such team, or an option does not fit.
        NotFound: if the policy does not exist, or if the season has none yet.
    """
    policies: dict[str, PolicyTables] = {}
    team = entrant(store, word, policies, **options)
    if team.settings.policy is None:
        raise BadSettings(f"{word!r} has learned nothing", next_step="Give the environment its name alone")
    return LearnedTeam(team.settings, policies[team.settings.policy])


class Player(NamedTuple):
    """A learned team, and its policy.

    Attributes:
        team: the team as it enters.
        store: holds the policy.
        manifest: manifest of the policy.
    """

    team: Entrant
    store: Store
    manifest: Manifest


def apprentice(store: Store, season: str) -> Player:
    """The newest policy of a season as a team. It plays as in the counted matches, without exploration.

    Args:
        store: store that the season belongs to.
        season: id of the season, which is the team's name.

    Raises:
        BadSettings: if there is no such season, or if this version cannot read its settings.
        NotFound: if none of its games is done, or if its own store is missing.
    """
    receipt = store.receipt(_SEASONS, season) if SAFE_NAME.match(season) else None
    if receipt is None:
        raise _no_season(store, season)
    own = fitted(Season, receipt.settings, where=season, keys="Play the season anew")
    home = Store(store.root / receipt.details["store"])
    # of the last game that is done: while the next is played, there may be a newer one that is not counted
    manifest = home.manifest("policies", receipt.details["policy"])
    counted = own.recipes(receipt.details["games"], policy=None)[0].home
    return _player(home, manifest, season, counted.model_copy(update={"explore": 0.0, "posterior_std": 0.0}))


def imitation(store: Store, team: str) -> Player:
    """The newest imitation of a team.

    Args:
        store: holds the imitation.
        team: the team's name in its matches.

    Raises:
        NotFound: if there is none yet.
    """
    own = imitation_of(store, team)
    manifest = own.latest("policies")
    if manifest is None:
        raise NotFound(f"nothing imitates {team!r} yet", where=store.where,
                       next_step=f"Make it with `pitchlore imitate {shlex.quote(team)}`")
    return _player(own, manifest, f"{PREFIX}{team}", _plays(manifest))


def _plays(manifest: Manifest) -> TeamSettings:
    """A learned team with the settings that its policy needs."""
    return TeamSettings.model_validate({"kind": "learned"} | manifest.details.get("plays", {}))


def _player(store: Store, manifest: Manifest, name: str, settings: TeamSettings) -> Player:
    """A policy as a team."""
    return Player(Entrant(
        name=name,
        settings=settings.model_copy(update={"policy": label(manifest)}),
        policy_version=manifest.version, knowledge_version=manifest.details["knowledge_version"],
    ), store, manifest)


def _no_season(store: Store, word: str) -> PitchloreError:
    """The error of a word that names no team and no season's apprentice."""
    if SAFE_NAME.match(word) and (store.root / _SEASONS / word).is_dir():
        return NotFound("has no policy yet: none of its games is done", where=word,
                        next_step="Play the season with `pitchlore season`")
    there = ", ".join(receipt.name for receipt in store.receipts(_SEASONS)) or "none yet"
    return BadSettings(f"{word!r} is no team, nor a season (there are: {there})", next_step=(
        f"Name {', '.join(SCRIPTED)}, learned, learned:VERSION, {BEST}, "
        f"constant:CODE, constant:CODE/CODE/CODE, {PREFIX}TEAM or a season's id"))


def policy(store: Store, version: int | None = None) -> Manifest:
    """A version of the policy; the newest by default.

    Raises:
        NotFound: if the store has no such policy.
    """
    manifest = store.latest("policies") if version is None else store.manifest("policies", version)
    if manifest is None:
        raise NotFound("there is no policy to play", where=store.where,
                       next_step="Import or record matches, then `pitchlore run`")
    return manifest


def label(manifest: Manifest) -> str:
    """The name of a policy in recipes: its version and the SHA-256 of its bytes, the same in every store."""
    sha256 = manifest.files["policies"].sha256
    if _looks(manifest):
        sha256 = digest(f"{sha256} {manifest.files['appraisals'].sha256}".encode())
    return f"v{manifest.version} {sha256}"


def labelled(store: Store, manifest: Manifest) -> tuple[str, PolicyTables]:
    """A policy's label for recipes, and its tables."""
    appraisals = table_of(store, manifest, Appraisals) if _looks(manifest) else None
    return label(manifest), PolicyTables(table_of(store, manifest, Policies), appraisals)


def _looks(manifest: Manifest) -> bool:
    """True if a policy appraises what robots see."""
    return manifest.settings.get("learner") == "sight" or looks(manifest)
