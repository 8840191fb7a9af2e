"""Is what robots that look choose worth more than their role's best constant, where they choose it? Trials by lot.

``PYTHONPATH=tests python -m studies.trial data/studies/looking DATA`` (half an hour on 2 cores; what is in the data
folder is not played again) plays the apprentices of ``looking-all`` and ``looking-held`` of that data folder against the
static team; if one of them is named after DATA, that one, and the rows of the other stay as they are.
For each robot and second of a match the lot decides between ways to act: it looks (its policy, each 0.2 s, and it
begins its action anew, as in its own matches); it does what the constant team 001/088/044 does in its role, which
goes on; or it is blind, and its policy looks at what a robot of its role saw at another moment of play. What is measured is V a second later, 1 or -1 after a goal and 0 where play has stopped, less V
at the start. All else is alike: the ways of one match differ by nothing but the lot. So the differences of their means
are what a second of looking is worth. A log cannot say this: there an action was chosen where it seemed good.

That team was the best found in whole matches when this was written, where three robots do it at once. For a second,
among robots that look, a role may have a better constant. So for ``looking-held`` there is a search first: half of the
seconds have a behaviour by lot, the same for all, and each role's best six are played again. The best of these stands
beside looking and that team in a trial of its own. Search and trial have seeds of their own.

V is the model that the package ships; it has not seen these matches. Seconds are the independent observation, because
each has a lot of its own; intervals are Welch's.

``trial.csv`` has the differences for all seconds and for each role, and for each state: role, the ball's third, how
near the robot is to it and whether it is behind it (36 cells, :func:`studies.looking.cells`). ``earned.csv`` says in
what share of time a state's lower bound is above 0, outside the first second of play. ``constants.csv`` has the search.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl
from studies.looking import ALL, HELD, STATIC, Learner, cells, learners_of, replaced
from studies.peers.playing import STEP_S, Observed, pitch_of
from studies.peers.worth import Worth

from pitchlore.pipeline import arena
from pitchlore.pipeline.arena.env import BEHAVIOURS, ParallelMatch
from pitchlore.pipeline.arena.teams.appraising import Appraiser, appraised, appraiser_of
from pitchlore.pipeline.arena.teams.clock import PAPER
from pitchlore.pipeline.arena.teams.constant import Constant, clock_of, constant
from pitchlore.pipeline.engine.teams import apprentice, labelled
from pitchlore.pipeline.numbers.statistics import mean_interval, welch
from pitchlore.pipeline.state.sight import see_from
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import digest
from pitchlore.schemas import ROLES, SIDES
from pitchlore.schemas.sights import SIGHT

LOOKS, BLIND = "looks", "blind"
#: The constant team that was the best in whole matches when the trials were written.
WHOLE = "constant:001/088/044"


class Trial(NamedTuple):
    """Matches in which the lot decides how a robot acts in a second.

    Attributes:
        tickets: what the lot draws from, all with the same chance: LOOKS, BLIND, or the word of a constant team.
        seeds: of the pairs of matches; nothing else was ever played with them.
        compared: pairs of ways to act: what one is worth more than the other.
    """

    tickets: Sequence[str]
    seeds: range
    compared: Sequence[tuple[str, str]] = ()

    @property
    def ways(self) -> list[str]:
        """The ways to act; rows of seconds have their numbers."""
        return list(dict.fromkeys(self.tickets))


def _blinded(first_seed: int) -> Trial:
    return Trial((LOOKS, WHOLE, BLIND), range(first_seed, first_seed + 100),
                 ((LOOKS, WHOLE), (LOOKS, BLIND), (BLIND, WHOLE)))


def against(best: Constant) -> Trial:
    """The trial beside each role's best constant for a second."""
    return Trial((LOOKS, best.word, WHOLE), range(2_750_000, 2_750_100), ((LOOKS, best.word), (best.word, WHOLE)))


#: The first trial, by the settings of the seasons.
FIRST = {ALL.season: _blinded(2_500_000), HELD.season: _blinded(2_700_000)}
#: The search of each role's best constant for a second: all behaviours, then the best of each role.
_ALL_CODES = [Constant(code, code, code).word for code in BEHAVIOURS]
_SEARCH = Trial((*[LOOKS] * len(_ALL_CODES), *_ALL_CODES), range(2_720_000, 2_720_100))
_FINALISTS, _FINAL_SEEDS = 6, range(2_730_000, 2_730_100)
#: Steps of a second; matches that are played side by side; sights that a blind robot draws from.
_SECOND, _PAIRS, _KEPT = round(1 / STEP_S), 10, 4096

I64 = npt.NDArray[np.int64]
F32 = npt.NDArray[np.float32]


class Chooser:
    """Chooses actions by what robots see.

    Args:
        appraiser: of an apprentice.
        ways: the ways to act.
        rng: draws what blind robots look at.
    """

    def __init__(self, appraiser: Appraiser, ways: Sequence[str], rng: np.random.Generator) -> None:
        self._appraiser, self._ways, self._rng = appraiser, ways, rng
        self._actions = np.array([BEHAVIOURS.index(code) for code in appraiser.codes])
        teams = [constant(way) for way in ways]
        assert all(clock_of(way) == PAPER for way in ways), "a behaviour goes on until it is over"
        self._constant = np.array([team is not None for team in teams])
        self._codes = np.array([[BEHAVIOURS.index(code) for code in team or [BEHAVIOURS[0]] * len(ROLES)] for team in teams])
        self._seen = [np.empty((0, len(SIGHT)), np.float32) for _ in ROLES]

    def keep(self, sights: F32, roles: I64) -> None:
        """Keep what robots saw in play, float32 [n, 30], of roles, int64 [n], for blind ones to look at."""
        if BLIND in self._ways:
            for role, kept in enumerate(self._seen):
                self._seen[role] = np.concatenate([kept, sights[roles == role]])[-_KEPT:]

    def anew(self, ways: I64) -> npt.NDArray[np.bool_]:
        """Whether robots begin what they choose anew at each step, bool [n]: constants go on."""
        return ~self._constant[ways]

    def __call__(self, sights: F32, roles: I64, ways: I64) -> I64:
        """Actions of robots, as indices in BEHAVIOURS, int64 [n].

        Args:
            sights: float32 [n, 30].
            roles: int64 [n], by index in ROLES.
            ways: int64 [n], by index in the ways.
        """
        looked_at = sights.copy()
        if BLIND in self._ways:
            for role, kept in enumerate(self._seen):
                blind = np.flatnonzero((roles == role) & (ways == self._ways.index(BLIND)))
                if len(blind) and len(kept):
                    looked_at[blind] = kept[self._rng.integers(len(kept), size=len(blind))]
        worth = np.where(self._appraiser.allowed[roles].T, appraised(self._appraiser, looked_at), -np.inf)
        return np.where(self._constant[ways], self._codes[ways, roles], self._actions[worth.argmax(axis=0)])


class Seen(NamedTuple):
    """What the robots of some matches see.

    Attributes:
        sights: float32 [matches, N, 30].
        roles: int64 [matches, N], by index in ROLES.
    """

    sights: F32
    roles: I64

    @classmethod
    def of(cls, pitches: Sequence[ParallelMatch], observed: Sequence[Observed]) -> Seen:
        """What is seen in matches whose environments observed this."""
        vectors = np.array([list(each.values()) for each in observed])
        sights = np.empty((*vectors.shape[:2], len(SIGHT)), np.float32)
        for place, pitch in enumerate(pitches):
            view = pitch.match.views[pitch.driven[0]]
            for robot in range(vectors.shape[1]):
                see_from(view, robot + 1, pitch.settings.matches.pitch.goal_x, sights[place, robot])
        return cls(sights, vectors[:, :, len(SIGHT):].argmax(axis=2))


def seconds(appraiser: Appraiser, trial: Trial, seeds: Sequence[int]) -> pl.DataFrame:
    """Play pairs of matches by lot, side by side; a row a robot and second that began in play.

    Returns:
        Columns seed, role, cell (:func:`studies.looking.cells`), way (its number), first (whether the second before was no
        play), and change: V at the end less V at the start, for the robot's team.
    """
    rng = np.random.default_rng(seeds[0])
    choose, worth = Chooser(appraiser, trial.ways, rng), Worth(1.0)
    tickets = np.array([trial.ways.index(ticket) for ticket in trial.tickets])
    pitches = [pitch_of(STATIC, side) for _ in seeds for side in SIDES]
    each = np.repeat(seeds, len(SIDES))
    seen = Seen.of(pitches, [pitch.reset(seed=int(seed))[0] for pitch, seed in zip(pitches, each, strict=True)])
    robots, found = seen.roles.shape[1], list[pl.DataFrame]()
    before = np.zeros(len(pitches), dtype=bool)
    while pitches[0].agents:  # all last as long
        on, value, start = np.array([pitch.match.in_play for pitch in pitches]), worth.of(pitches), seen
        ways = tickets[rng.integers(len(tickets), size=seen.roles.shape)]
        goals = np.zeros(len(pitches))
        for _ in range(_SECOND):
            if not pitches[0].agents:
                break
            playing = np.array([pitch.match.in_play for pitch in pitches])
            choose.keep(seen.sights[playing].reshape(-1, len(SIGHT)), seen.roles[playing].ravel())
            actions = choose(seen.sights.reshape(-1, len(SIGHT)), seen.roles.ravel(), ways.ravel()).reshape(-1, robots)
            observed = []
            for place, pitch in enumerate(pitches):
                pitch.begin_anew([agent for agent, own in zip(pitch.agents, choose.anew(ways[place]), strict=True) if own])
                sees, rewards, *_ = pitch.step(dict(zip(pitch.agents, actions[place], strict=True)))
                observed.append(sees)
                goals[place] += rewards[pitch.possible_agents[0]]
            seen = Seen.of(pitches, observed)
        change = np.where(goals != 0, np.sign(goals), worth.of(pitches)) - value
        found.append(pl.DataFrame({
            "seed": np.repeat(each, robots), "role": start.roles.ravel(),
            "cell": cells(start.sights.reshape(-1, len(SIGHT))), "way": ways.ravel(),
            "first": np.repeat(~before, robots), "change": np.repeat(change, robots),
        }).filter(np.repeat(on, robots)))
        before = on
    return pl.concat(found)


def played(data: Path, trial: Trial, word: str) -> pl.DataFrame:
    """The seconds of an apprentice; they are kept in the data folder."""
    player = apprentice(Store(data), word)
    policy, tables = labelled(player.store, player.manifest)
    said = digest(json.dumps([policy, arena.VERSION, trial.tickets, *map(constant, trial.ways)]).encode())[:12]
    kept = data / "trial" / f"{word}-{trial.seeds.start}-{said}.parquet"
    if not kept.exists():
        assert tables.appraisals is not None, "it looks"
        appraiser, _ = appraiser_of(tables.values, tables.appraisals)
        parts = [seconds(appraiser, trial, trial.seeds[at : at + _PAIRS]) for at in range(0, len(trial.seeds), _PAIRS)]
        kept.parent.mkdir(parents=True, exist_ok=True)
        aside = kept.with_suffix(".part")
        pl.concat(parts).with_columns(team=pl.lit(word)).write_parquet(aside)
        aside.rename(kept)
    return pl.read_parquet(kept)


def differences(rows: pl.DataFrame, trial: Trial, by: Sequence[str]) -> pl.DataFrame:
    """What a second of one way to act is worth more than of another, with Welch's intervals.

    Returns:
        A row a pair of ways and group: way, less, the columns of ``by``, seconds (of all ways), difference, low
        and high; null where there are fewer than two seconds of a way.
    """
    found = []
    for key, own in rows.group_by(by, maintain_order=True) if by else [((), rows)]:
        for pair in trial.compared:
            ours, theirs = (own.filter(way=trial.ways.index(way))["change"] for way in pair)
            ends = welch(ours, theirs)
            found.append({
                "way": pair[0], "less": pair[1], **dict(zip(by, key, strict=True)), "seconds": own.height,
                "difference": None if ends is None else ours.mean() - theirs.mean(),  # type: ignore[operator]
                "low": ends and ends[0], "high": ends and ends[1]})
    return pl.DataFrame(found, infer_schema_length=None).sort("way", "less", *by)


def earned(rows: pl.DataFrame, trial: Trial, by: Sequence[str]) -> pl.DataFrame:
    """Shares of time in groups where a way to act is surely worth more than another, and surely less.

    The first second of play counts as neither, in the share and in the evidence.
    """
    found = differences(rows.filter(~pl.col("first")), trial, by).with_columns(
        share=pl.col("seconds") / rows.height)
    return found.group_by("way", "less", maintain_order=True).agg(
        pl.lit(" ".join(by)).alias("states"), groups=pl.len(),
        surely_more=pl.col("share").filter(pl.col("low") > 0).sum(),
        surely_less=pl.col("share").filter(pl.col("high") < 0).sum())


def worth_of(rows: pl.DataFrame, trial: Trial) -> pl.DataFrame:
    """How V changes in a second of each role's constants, the best first.

    Returns:
        A row a role and way: role, code, seconds, change (mean), low, high.
    """
    found = []
    for (role, way), own in rows.group_by("role", "way", maintain_order=True):
        team = constant(trial.ways[int(str(way))])
        if team is not None:
            low, high = mean_interval(own["change"].to_numpy()) or (None, None)
            found.append({"role": role, "code": getattr(team, str(role)), "seconds": own.height,
                          "change": own["change"].mean(), "low": low, "high": high})
    return pl.DataFrame(found).sort(
        pl.col("role").cast(pl.Enum(ROLES)), -pl.col("change"), "code")


def searched(data: Path, words: Sequence[str]) -> tuple[Constant, pl.DataFrame]:
    """Each role's best constant for a second, and the table of the search."""
    first = worth_of(_rows(data, _SEARCH, words), _SEARCH)
    ranked = [first.filter(role=role)["code"].to_list() for role in ROLES]
    teams = [Constant(*codes).word for codes in list(zip(*ranked, strict=True))[:_FINALISTS]]
    final = Trial((*[LOOKS] * len(teams), *teams), _FINAL_SEEDS)
    second = worth_of(_rows(data, final, words), final)
    best_of_roles = Constant(*(second.filter(role=role)["code"][0] for role in ROLES))
    return best_of_roles, pl.concat(own.select(pl.lit(stage).alias("stage"), pl.all()) for stage, own in ((1, first), (2, second)))


def _rows(data: Path, trial: Trial, words: Sequence[str]) -> pl.DataFrame:
    """The seconds of some apprentices, with the names of their roles."""
    with ProcessPoolExecutor(2, get_context("spawn")) as players:
        rows = pl.concat(players.map(partial(played, data, trial), words))
    return rows.with_columns(pl.col("role").replace_strict(range(len(ROLES)), ROLES))


def found(learner: Learner, data: Path) -> dict[str, pl.DataFrame]:
    """The tables of a learner by name; what is missing is played."""
    tables, trials, words = dict[str, pl.DataFrame](), [FIRST[learner.season]], learner.panel.words
    if learner is HELD:
        best, tables["constants"] = searched(data, words)
        trials.append(against(best))
    played_by_lot = [(_rows(data, trial, words), trial) for trial in trials]
    groups: list[list[str]] = [[], ["team"], ["role"], ["role", "cell"]]
    return tables | {
        "trial": pl.concat([differences(rows, trial, by) for rows, trial in played_by_lot for by in groups],
                           how="diagonal").select("way", "less", "team", "role", "cell", "seconds", "difference", "low", "high"),
        "earned": pl.concat([earned(rows, trial, by) for rows, trial in played_by_lot
                             for by in (["role"], ["role", "cell"], ["team", "role", "cell"])]),
    }


def main(out: Path, data: Path, chosen: Sequence[str] = ()) -> None:
    """Play what is missing, and write the tables."""
    tables = {each.season: found(each, data) for each in learners_of(chosen, FIRST)}
    for name, digits in (("trial", 5), ("earned", 3), ("constants", 5)):
        if there := {season: own[name] for season, own in tables.items() if name in own}:
            replaced(out / f"{name}.csv", there, digits)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
