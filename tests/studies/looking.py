"""Does a team that looks win? Apprentices of fresh seeds, the panel, and what they are without looking.

``PYTHONPATH=tests python -m studies.looking data/studies/looking DATA`` (six hours on 2 cores; what is in the data
folder is not played again). Settings of learners may follow: then these are played, and the rows of others stay.

The aims were written down before any of these seeds was played. Apprentices train against the static team alone,
in seasons of 140 matches of eight minutes, own exploration included. Each plays 100 matches, in pairs with one
seed and sides swapped, in each arm. The independent observation is the apprentice: intervals are Student's over
the five. The settings were chosen on seasons of seeds 901 to 914 and matches of seeds 740,000 to 880,019. That the
team with the late camera predicts was chosen after its first five seasons, which did not and missed their aim; so it
has seasons and matches of fresh seeds. So have the apprentices of ``looking-all``, which are offered all 31 actions
and not only those that they watched: ten seasons of each (``studies.imitation``) showed that they play better. Their
matches with cameras that disturb, and their seasons with the late one, were added when their other matches were known.
Apprentices of ``looking`` have watched 21 to 31 of the 31 actions in a role after the first game, and nearly all
after the third: the two learners hardly differ. So ``together.csv`` has the ten apprentices of both.

``looking-held`` holds what it tries for a second. It was chosen on development seeds (seasons 915 to 924;
docs/decisions/players.md, ``explore_s``), after the other two were known, and has seasons and matches of fresh seeds.

Who is blind acts each time on another sight, so that it also changes its mind more often. So apprentices of
``looking-held`` are blind in another way, too: they see what was 30 s ago. This arm, and the matches with what each role does best
for a second, were added when the others were known.

Controls of the learner (:mod:`studies.permuted`): ``looking-shuffled`` learns from actions, and ``looking-drawn`` from
sights, that were dealt out anew. Blind teams are in :mod:`studies.blind`.

``results.csv`` has a row for each apprentice, arm and opponent, ``controls.csv`` the same of teams that learn
nothing, on the same seeds. ``aims.csv`` says what was reached. ``decisions.csv`` describes the decisions of four
logged matches of each apprentice.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import seasons as play_seasons
from harness import settings_of
from scipy import stats
from studies.blind import blind
from studies.pairs import kept, of_pairs
from studies.permuted import Deal, actions_dealt, sights_dealt, stages

from pitchlore.pipeline import arena
from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.camera import CameraSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.physics.settings import PhysicsSettings
from pitchlore.pipeline.arena.teams.appraising import appraised, appraiser_of
from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.engine.evaluations import evaluate
from pitchlore.pipeline.engine.games import next_of, take
from pitchlore.pipeline.engine.placement.crew import Crew
from pitchlore.pipeline.engine.placement.places import crew_at
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.engine.teams import apprentice, entrant, labelled
from pitchlore.pipeline.evaluations import Evaluation, Pair, play
from pitchlore.pipeline.numbers.statistics import mean_interval, welch
from pitchlore.pipeline.policies.appraise import appraise
from pitchlore.pipeline.seasons.settings import Season
from pitchlore.pipeline.sequences.sights import sights
from pitchlore.pipeline.settings import AppraisalSettings, GramSettings
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Decisions, Sights, Values
from pitchlore.schemas.decisions import BRIEF_FRAMES
from pitchlore.schemas.sights import SIGHT

#: Seeds of the logged matches.
LOGGED = range(2_100_000, 2_100_004)
STATIC, CONSTANT = "static", "best-constant"
#: Column of decisions.csv: share of time that is earned (:func:`earned`).
EARNED = "earned share"
#: What each role does best for a second among robots that look: ``make trial`` searched for it.
FOR_A_SECOND = "constant:044/011/044"
USUAL = MatchSettings(referee=RefereeSettings(duration_s=480.0))
_LATE = USUAL.model_copy(update={"camera": CameraSettings(latency_s=0.1, position_noise=0.01)})
_TYPICAL = CameraSettings(position_noise=0.003, heading_noise=np.radians(2.0))
_ROLLING = PhysicsSettings().rolling


class Arm(NamedTuple):
    """Matches of one kind.

    Attributes:
        name: of the arm.
        opponents: words of the opponents.
        trained: settings of the apprentices' seasons.
        seasons: seeds of the seasons.
        seeds: of the pairs of matches.
        how: the matches.
        blind: whether the apprentice is blind.
        blind_s: how long ago its role saw what it then acts on, seconds; None: at any earlier moment.
        predict_s: how far ahead the team predicts; None: as its season says, or not at all.
    """

    name: str
    opponents: Sequence[str]
    trained: str
    seasons: range
    seeds: range
    how: MatchSettings = USUAL
    blind: bool | None = None
    blind_s: float | None = None
    predict_s: float | None = None

    @property
    def words(self) -> list[str]:
        """The apprentices: the ids of their seasons."""
        return [f"{self.trained}-static-{seed}" for seed in self.seasons]


class Learner(NamedTuple):
    """Five apprentices, five more whose camera is late, and their matches. Nobody was chosen on these seeds.

    Attributes:
        season: settings of the seasons; those with the late camera are called ``season``-late.
        said: what the names of its arms begin with.
        seasons, seeds: of the seasons, and of the pairs of matches.
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
        """Those in which a camera's usual noise disturbs it, on three kinds of ground."""
        rolling = {"": 1.0, ", rolling -50%": 0.5, ", rolling +50%": 1.5}
        return [self.panel._replace(name=self.named(f"camera noise{said}"), opponents=(STATIC,), how=USUAL.model_copy(
            update={"camera": _TYPICAL, "physics": PhysicsSettings(rolling=share * _ROLLING)}))
            for said, share in rolling.items()]

    @property
    def late(self) -> Arm:
        """Those of the apprentices whose camera is late."""
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
        """Teams that learn nothing, in its arms: best-constant in all but the blind one, others against the panel."""
        against = [(word, self.panel._replace(opponents=[opponent for opponent in PANEL if opponent != word]))
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
        WATCHED.panel._replace(name="actions shuffled in training", opponents=(STATIC,), trained="looking-shuffled")],
    ALL.season: [
        *ALL.arms,
        ALL.panel._replace(name="all actions offered, sights drawn in training", opponents=(STATIC,),
                           trained="looking-drawn", seasons=range(2041, 2046))],
    HELD.season: [
        *HELD.arms,
        HELD.blind._replace(name=HELD.named("blind, sees what was 30 s ago"), blind_s=30.0),
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
#: Seasons whose apprentices learn from a log that was dealt out anew: their settings, and how it is dealt out.
DEALT: dict[str, tuple[str, Deal]] = {
    "looking-shuffled": (WATCHED.season, actions_dealt), "looking-drawn": (ALL.season, sights_dealt)}
#: Arms that differ only in whether all actions were offered.
_ALIKE = tuple(zip(WATCHED.arms, ALL.arms, strict=True))


def seasons(arms: Sequence[Arm], data: Path) -> None:
    """Play the seasons that are missing."""
    for settings, seeds in dict.fromkeys((arm.trained, arm.seasons) for arm in arms):
        if settings in DEALT:
            with ProcessPoolExecutor(2, get_context("spawn")) as pool:
                list(pool.map(partial(season_dealt, data, settings), seeds))
            continue
        play_seasons(settings, seeds, data)


def season_dealt(data: Path, name: str, seed: int) -> None:
    """Play the missing games of a season whose apprentice learns from a log that was dealt out anew."""
    settings, deal = DEALT[name]
    own = Season(name=name, opponent=STATIC, seed=seed, settings=settings_of(settings))
    turn = next_of(Store(data), own)
    while turn is not None:
        take(data, turn, discard=True, stages=stages(deal))
        turn = turn.following()


def measured(store: Store, word: str, arm: Arm, opponent: str, crew: Crew) -> pl.DataFrame:
    """Goal differences of a team in an arm, a row a pair of matches: seed, difference."""
    policies: dict[str, PolicyTables] = {}
    team = entrant(store, word, policies, predict_s=arm.predict_s)
    other = entrant(store, opponent, policies)
    how = Evaluation(**arm.how.of_match(), team=team, opponent=other)
    if arm.blind:
        said = f"blind {arm.blind_s} {how.id} {arena.VERSION}"
        return kept(store.root / "looking", said, arm.seeds, partial(played_blind, how, policies, arm.blind_s))
    return of_pairs(evaluate(store, how, arm.seeds, policies, crew)[0])


def played_blind(
    how: Evaluation, policies: Mapping[str, PolicyTables], late_s: float | None, seeds: Sequence[int]
) -> pl.DataFrame:
    """Goal differences of an evaluation whose team is blind (:mod:`studies.blind`): seed, difference."""
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        pairs = [Pair(evaluation=how, seed=seed) for seed in seeds]
        return pl.concat(pool.map(partial(blind_pair, policies, late_s), pairs))


def blind_pair(policies: Mapping[str, PolicyTables], late_s: float | None, pair: Pair) -> pl.DataFrame:
    """Goal difference of a pair of matches whose measured team is blind: seed, difference."""
    label = pair.evaluation.team.settings.policy
    assert label is not None
    return of_pairs(play(pair, policies, blind(policies[label], late_s)))


def row(word: str, arm: str, opponent: str, pairs: pl.DataFrame) -> dict[str, object]:
    """A team in an arm, with the interval over its pairs."""
    low, high = mean_interval(pairs["difference"].to_numpy()) or (None, None)
    return {"team": word, "arm": arm, "opponent": opponent, "matches": 2 * pairs.height,
            "difference": pairs["difference"].mean(), "low": low, "high": high}


def together(found: pl.DataFrame) -> pl.DataFrame:
    """The apprentices of both settings in arms that differ in nothing else: arm, opponent, apprentices, mean, low, high.

    Args:
        found: results.csv.
    """
    rows = []
    for alike in _ALIKE:
        for opponent in alike[0].opponents:
            values = found.filter(pl.col("arm").is_in([arm.name for arm in alike]), opponent=opponent)["difference"]
            low, high = mean_interval(values.to_numpy()) or (None, None)
            rows.append({"arm": alike[0].name, "opponent": opponent, "apprentices": len(values),
                         "difference": values.mean(), "low": low, "high": high})
    return pl.DataFrame(rows)


class Aim(NamedTuple):
    """An aim: a mean over apprentices, at least ``least``, whose lower bound has to be above ``needed``."""

    aim: str
    needed: float
    mean: float
    low: float
    high: float
    least: float = -np.inf

    @property
    def reached(self) -> bool:
        """Whether the lower bound is above what is needed, and the mean is as great as it has to be."""
        return self.low > self.needed and self.mean >= self.least


def _aim(name: str, needed: float, values: Sequence[float], least: float = -np.inf) -> Aim:
    low, high = mean_interval(values) or (float("nan"), float("nan"))
    return Aim(name, needed, float(np.mean(values)), low, high, least)


def aims(found: pl.DataFrame, learner: Learner, control: pl.DataFrame, decided: pl.DataFrame) -> Iterator[Aim]:
    """The aims of a learner's apprentices.

    Args:
        found: results.csv.
        learner: theirs.
        control: pairs of the best constant team against static, on the same seeds.
        decided: decisions.csv.
    """

    def means(arm: Arm, opponent: str = STATIC) -> list[float]:
        return found.filter(arm=arm.name, opponent=opponent)["difference"].to_list()

    yield _aim("1. ahead of best-constant, head to head", 2.0, means(learner.panel, CONSTANT))
    ours, theirs = means(learner.panel), control["difference"].to_numpy()
    low, high = welch(ours, theirs) or (float("nan"), float("nan"))
    yield Aim("2. ahead of static by more than best-constant (Welch)", 1.0, float(np.mean(ours) - theirs.mean()),
              low, high)
    for opponent in PANEL:
        yield _aim(f"3. not beaten by {opponent}", -1.0, means(learner.panel, opponent))
    lost = [a - b for a, b in zip(ours, means(learner.blind), strict=True)]
    yield _aim("4. loses when it is blind", 0.0, lost, least=3.0)
    for arm in (*learner.noisy, learner.late):
        yield _aim(f"5. beats static, {arm.name}", 0.0, means(arm))
    yield _aim("6. earns half of its time, by its own log (a share)", 0.5, decided[EARNED].to_list())


def described(store: Store, word: str) -> dict[str, object]:
    """The decisions of an apprentice in a few logged matches against static."""
    player = apprentice(store, word)
    label, tables = labelled(player.store, player.manifest)
    made, seen = [], []
    for seed in LOGGED:
        recipe = Recipe(**USUAL.of_match(), home=player.team.settings, away=TeamSettings(kind="static"), seed=seed)
        receipt, _ = record(store, recipe, {label: tables})
        whole = log.read(store.read(receipt, "log"), where=receipt.name)
        made.append(whole.decisions.drop_nulls("behaviour_id"))
        seen.append(sights(whole, Values.empty(), GramSettings()))
    decided = pl.concat(made).join(pl.concat(seen), on=("match_id", "team", "robot", "t_ns"), maintain_order="left")
    return {
        "team": word, "decisions": decided.height, "two frames or fewer": _brief(decided),
        "bits of sight in the action": information(decided), EARNED: earned(player.store, decided)}


def _brief(decided: pl.DataFrame) -> float:
    """Share of decisions that last two frames or fewer."""
    return float((decided["end_ns"] - decided["t_ns"] <= (BRIEF_FRAMES + 0.5) * 1e9 / USUAL.physics.hz).mean())  # type: ignore[arg-type]


def information(decided: pl.DataFrame) -> float:
    """Mutual information of what is seen and the action, given the role, in bits, less that of shuffles.

    What is seen is in :func:`cells`.
    """
    seen = cells(decided["sight"].to_numpy())
    rng, action = np.random.default_rng(0), decided["behaviour_id"].to_numpy()
    roles = decided["role"].cast(pl.String).to_numpy()
    total = 0.0
    for role in ROLES:
        own = roles == role
        true = _bits(seen[own], action[own])
        chance = np.mean([_bits(rng.permutation(seen[own]), action[own]) for _ in range(20)])
        total += own.mean() * (true - chance)
    return float(total)


def cells(sights: np.ndarray) -> np.ndarray:
    """Sights, [n, 30], in 36 cells: the ball's third, how near the robot is to it, and whether it is behind it."""
    of = {name: sights[:, place] for place, name in enumerate(SIGHT)}
    found: np.ndarray = (np.digitize(of["ball_x"], [-0.25, 0.25]) * 12
                         + np.digitize(of["ball_distance"], [0.1, 0.25, 0.5]) * 3
                         + np.digitize(of["behind"], [-0.3, 0.6]))
    return found


def _bits(one: np.ndarray, other: np.ndarray) -> float:
    """Mutual information of two discrete variables, bits, by their counts."""
    _, first = np.unique(one, return_inverse=True)
    _, second = np.unique(other, return_inverse=True)
    joint = np.zeros((first.max() + 1, second.max() + 1))
    np.add.at(joint, (first, second), 1 / len(first))
    outer = joint.sum(1, keepdims=True) * joint.sum(0, keepdims=True)
    there = joint > 0
    return float((joint[there] * np.log2(joint[there] / outer[there])).sum())


def earned(store: Store, decided: pl.DataFrame, parts: int = 5) -> float:
    """Share of time in actions that are surely worth more where they were chosen than the role's best constant.

    The appraisals are fitted anew to the season's log without each fifth of its matches. The lower bound is
    that of the jackknife (Student). Constants, the first second of an episode and decisions at random do not
    count.
    """
    made, seen = (pl.concat([store.read_table(receipt, name, schema) for receipt in store.receipts(noun)])
                  for noun, name, schema in (("decisions", "decisions", Decisions), ("sequences", "sights", Sights)))
    matches = made["match_id"].unique().sort()
    pairs = decided.select("role", "behaviour_id").unique().sort("role", "behaviour_id")
    settings = AppraisalSettings(least_share=0.0)
    lasts = (decided["end_ns"] - decided["t_ns"]).to_numpy()
    start = pl.col("t_ns").min().over("match_id", "episode")
    since = decided.select(pl.col("t_ns") - start).to_series().to_numpy()
    gains = []
    for part in range(parts):
        left = matches.gather_every(parts, part)
        kept = ~pl.col("match_id").is_in(left.implode())
        found, _ = appraise(made.filter(kept), seen.filter(kept), pairs, settings, 1)
        gains.append(_gains(found, decided))
    gain = np.array(gains)
    mean = gain.mean(0)
    error = np.sqrt((parts - 1) / parts * ((gain - mean) ** 2).sum(0))
    sure = (mean - stats.t.ppf(0.975, parts - 1) * error > 0) & (since >= 1e9) & ~decided["random"].to_numpy()
    return float((lasts * sure).sum() / lasts.sum())


def _gains(appraisals: pl.DataFrame, decided: pl.DataFrame) -> np.ndarray:
    """How much more the chosen actions are worth than the action of the role that is worth most on average."""
    appraiser, _ = appraiser_of(decided.select("role", "behaviour_id").unique(), appraisals)
    sight = np.ascontiguousarray(decided["sight"].to_numpy(), dtype=np.float32)
    value = appraised(appraiser, sight)
    code = decided["behaviour_id"].str.split("-").list.last().cast(pl.Int64).to_numpy()
    chosen = value[np.searchsorted(appraiser.codes[1:], code) + 1, np.arange(len(code))]
    best = np.zeros(len(code))
    for number, role in enumerate(ROLES):
        own = (decided["role"].cast(pl.String) == role).to_numpy()
        offered = np.flatnonzero(appraiser.allowed[number])
        best[own] = value[offered[value[np.ix_(offered, own)].mean(1).argmax()], own]
    gain: np.ndarray = chosen - best
    return gain


def played(store: Store, learner: Learner, crew: Crew) -> dict[str, pl.DataFrame]:
    """The tables of a learner by name; what is missing is played."""
    results = pl.DataFrame([
        row(word, arm.name, opponent, measured(store, word, arm, opponent, crew))
        for arm in ARMS[learner.season] for word in arm.words for opponent in arm.opponents])
    controls = {(word, arm.name, opponent): measured(store, word, arm, opponent, crew)
                for word, arm in CONTROLS[learner.season] for opponent in arm.opponents}
    decided = pl.DataFrame([described(store, word) for word in learner.panel.words])
    reached = aims(results, learner, controls[CONSTANT, learner.panel.name, STATIC], decided)
    return {
        "results": results,
        "controls": pl.DataFrame([row(*who, pairs) for who, pairs in controls.items()]),
        "aims": pl.DataFrame([aim._asdict() | {"reached": aim.reached} for aim in reached]),
        "decisions": decided,
    }


def replaced(path: Path, tables: Mapping[str, pl.DataFrame], digits: int) -> None:
    """Write the tables of learners into one, with their settings in column season; rows of other learners stay.

    Args:
        path: of the table.
        tables: by the settings of the seasons.
        digits: of its numbers.
    """
    there = pl.read_csv(path).partition_by("season", as_dict=True) if path.exists() else {}
    rows = there | {(season,): own.select(pl.lit(season).alias("season"), pl.all()) for season, own in tables.items()}
    pl.concat([own for season in ARMS if (own := rows.get((season,))) is not None], how="vertical_relaxed").write_csv(
        path, float_precision=digits)


def learners_of(chosen: Sequence[str], among: Collection[str]) -> list[Learner]:
    """The learners that are chosen by their settings; all, if none is.

    Args:
        chosen: settings.
        among: those that there are.

    Raises:
        SystemExit: if there are no such settings.
    """
    if unknown := set(chosen) - set(among):
        sys.exit(f"no learner is called {', '.join(sorted(unknown))}. There are {', '.join(among)}.")
    return [learner for learner in LEARNERS if learner.season in (chosen or among)]


def main(out: Path, data: Path, chosen: Sequence[str] = ()) -> None:
    """Play what is missing, and write the tables."""
    learners = learners_of(chosen, ARMS)
    out.mkdir(parents=True, exist_ok=True)
    seasons([arm for learner in learners for arm in ARMS[learner.season]], data)
    store = Store(data)
    with crew_at(None, store.root) as crew:
        tables = {learner.season: played(store, learner, crew) for learner in learners}
    for name, digits in (("results", 2), ("controls", 2), ("aims", 2), ("decisions", 3)):
        replaced(out / f"{name}.csv", {season: own[name] for season, own in tables.items()}, digits)
    together(pl.read_csv(out / "results.csv")).write_csv(out / "together.csv", float_precision=2)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
