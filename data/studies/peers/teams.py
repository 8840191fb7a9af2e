"""The teams of the study: peers, our apprentices and controls, each after a number of matches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl
from looking.choosing import Chooser, Seen
from looking.learners import HELD, STATIC, USUAL
from looking.lots import LOOKS
from looking.pairs import of_pairs
from peers.playing import ANY, KEPT, Choose, Observed, by_chance, by_network, played

from pitchlore.pipeline.arena.env import ParallelMatch
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.teams.appraising import appraiser_of
from pitchlore.pipeline.arena.teams.constant import BEST
from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.engine.evaluations import evaluate, stored
from pitchlore.pipeline.engine.teams import Player, apprentice, entrant, labelled
from pitchlore.pipeline.stages.evaluations import Entrant, Evaluation, Pair
from pitchlore.pipeline.stages.seasons.settings import named_settings
from pitchlore.pipeline.store import Store

#: Matches of a game of our apprentices' seasons, and of a season.
GAME = named_settings(HELD.season).matches_a_game
ONCE = named_settings(HELD.season).games * GAME
#: Learners that play, and the matches of each of their trainings; None: as many as some minutes of a core
#: allow. PPO has as many trainings of a season's matches as there are apprentices.
ONLINE: dict[str, tuple[int | None, ...]] = {
    "ppo": (None, 10 * ONCE, 10 * ONCE, ONCE, ONCE), "dqn": (None, 10 * ONCE, 10 * ONCE),
    "ppo-v": (ONCE, ONCE, ONCE), "dqn-v": (ONCE, ONCE, ONCE)}
#: Learners that learn from what our apprentice's season logged, and from the logs of how many seasons, one by
#: one.
OFFLINE, TRAININGS = ("bc", "cql", "cql-v"), 3
#: Rows of our apprentices, of the same ones where an action that is chosen again goes on, of untrained
#: networks.
OURS, GOING_ON, UNTRAINED = "apprentice that looks", "apprentice whose actions go on", "ppo untrained"
#: Matches after which teams meet the whole panel, as after the last; after the others they meet the static
#: team.
WHOLE = (0, ONCE, 10 * ONCE)
#: Those that meet the static team only.
ALONE = (GOING_ON, UNTRAINED)


class Team(NamedTuple):
    """A team after a number of matches.

    Attributes:
        learner: the learner in the table's row.
        seed: seed of its training; None for a control.
        matches: number of matches from which it learned.
        player: path of a network, ANY, a word, or a season.
        version: version of a season's policy.
    """

    learner: str
    seed: int | None
    matches: int
    player: str
    version: int | None = None


def seeds_of(learner: str) -> range:
    """Seeds of a peer's trainings; where it learns from our apprentices' logs, those of the seasons."""
    return HELD.seasons[:TRAININGS] if learner in OFFLINE else range(2021, 2021 + len(ONLINE[learner]))


def networks(data: Path) -> Path:
    """The folder of the peers' networks."""
    return data / "peers" / "networks"


def teams(data: Path) -> Iterator[Team]:
    """The teams that are in the data folder: controls, our apprentices, peers."""
    for word in (STATIC, BEST):
        yield Team(word, None, 0, word)
    yield Team(ANY, None, 0, ANY)
    store = Store(data)
    for seed, season in zip(HELD.seasons, HELD.panel.words, strict=True):
        if store.receipt("seasons", season) is not None:
            for matches in KEPT:
                if matches <= ONCE:
                    yield Team(OURS, seed, matches, season, matches // GAME)
            yield Team(GOING_ON, seed, ONCE, season)
    for learner in (*OFFLINE, *ONLINE):
        for seed in seeds_of(learner):
            found = networks(data).glob(f"{learner}-{seed}-*.npz")
            there = {int(path.stem.rsplit("-", 1)[1]): path for path in found}
            for matches, path in sorted(there.items()):
                if matches > 0 and (matches in KEPT or matches == max(there)):
                    yield Team(learner, seed, matches, str(path))
                elif matches == 0 and learner == "ppo":
                    yield Team(UNTRAINED, seed, 0, str(path))


def measured(
    data: Path, team: Team, opponent: str, seeds: Sequence[int], there: bool = False
) -> pl.DataFrame:
    """Goal differences of a team against an opponent, a row a pair of matches: seed, difference.

    Pairs that were not played before are played, unless ``there``: then they have no row.
    """
    if team.player == ANY:
        return played(ANY, by_chance(seeds[0]), opponent, seeds, data, there)
    if team.player.endswith(".npz"):
        path = Path(team.player)
        return played(digest(path.read_bytes()), by_network(path), opponent, seeds, data, there)
    if team.learner == GOING_ON:
        return played(*going_on(data, team.player), opponent, seeds, data, there)
    store, policies = Store(data), dict[str, PolicyTables]()
    ours = (entrant(store, team.player, policies) if team.version is None
            else _at(apprentice(store, team.player), team.version, policies))
    how = Evaluation(**USUAL.of_match(), team=ours, opponent=entrant(store, opponent, policies))
    if there:
        seeds = [seed for seed in seeds if stored(store, Pair(evaluation=how, seed=seed)) is not None]
        if not seeds:
            return pl.DataFrame(schema={"seed": pl.Int64, "difference": pl.Float64})
    return of_pairs(evaluate(store, how, seeds, policies)[0])


def going_on(data: Path, season: str) -> tuple[str, Choose]:
    """The label of an apprentice's policy, and who chooses by it as peers do: what is chosen again goes on.

    In its own matches, and those that it learned from, a robot begins its action anew at each decision.
    """
    player = apprentice(Store(data), season)
    label, tables = labelled(player.store, player.manifest)
    assert tables.appraisals is not None, "it looks"
    appraiser, _ = appraiser_of(tables.values, tables.appraisals)
    looks = Chooser(appraiser, (LOOKS,), np.random.default_rng(0))

    def choose(pitches: Sequence[ParallelMatch], observed: Sequence[Observed]) -> npt.NDArray[np.int64]:
        seen = Seen.of(pitches, observed)
        roles = seen.roles.ravel()
        return looks(seen.sights.reshape(len(roles), -1), roles, np.zeros_like(roles))

    return label, choose


def _at(player: Player, version: int, policies: dict[str, PolicyTables]) -> Entrant:
    """A season's apprentice as it was after so many games; its policy is added to ``policies``."""
    manifest = player.store.manifest("policies", version)
    named, tables = labelled(player.store, manifest)
    policies[named] = tables
    return player.team.model_copy(update={
        "policy_version": version, "knowledge_version": manifest.details["knowledge_version"],
        "settings": player.team.settings.model_copy(update={"policy": named})})
