"""Worth of each rule of the static team under the league's laws.

``make rules`` (a quarter of an hour on 2 cores; what was stopped goes on) writes ``rules.csv``. A team with
all rules plays a team without one of them, and one without any. The teams with all rules and without any also
play the human-like team. Matches come in pairs with one seed and sides swapped.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from harness import going_on, workers

from pitchlore.pipeline.arena.match.controllers import ScriptedController
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams import static
from pitchlore.pipeline.arena.teams.table import TEAMS, Script, TeamKind, TeamMemory
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.schemas import SIDES

#: Seeds of the reported matches. The rules and their numbers were chosen on seeds 1000 to 2329 and 5001 to
#: 5100.
SEEDS, SECONDS = range(6001, 6101), 480.0
RULES = tuple(static.RULES.names or ())
#: Sets of rules that are left out, by the names of the study.
LEFT_OUT: dict[str, tuple[str, ...]] = {**{rule: (rule,) for rule in RULES}, "all": RULES}
#: Seeds of the matches that are one part of the study.
_PART = 10


class Side(NamedTuple):
    """A team of the study: its kind, and the static team's rules that it leaves out."""

    kind: TeamKind
    without: tuple[str, ...] = ()

    def script(self) -> Script:
        """The team's script, which remembers that these rules are off."""
        script = TEAMS[self.kind].script
        assert script is not None
        return script._replace(new_memory=partial(_memory, self.without)) if self.without else script


def _memory(without: tuple[str, ...], *said: object) -> TeamMemory:
    robots, rules = static.new_memory(*said)  # type: ignore[arg-type]
    for rule in without:
        rules[rule] = False
    return robots, rules


class Played(NamedTuple):
    """A match as the first team saw it.

    Attributes:
        lead: its goals minus the other's.
        fouls: its fouls for which the other team got a penalty or a goal kick.
        others: the other team's.
        minutes: duration.
    """

    lead: int
    fouls: int
    others: int
    minutes: float


def play(one: Side, other: Side, seed: int, away: bool) -> Played:
    """Play a match; the first team is away or at home."""
    sides = (other, one) if away else (one, other)
    recipe = Recipe(home=TeamSettings(kind=sides[0].kind), away=TeamSettings(kind=sides[1].kind), seed=seed,
                    referee=RefereeSettings(duration_s=SECONDS))
    home, guests = (
        ScriptedController(settings, recipe, np.random.default_rng([seed, 1 + team]), side.script())
        for team, (settings, side) in enumerate(zip((recipe.home, recipe.away), sides, strict=True)))
    match = MatchInPlay(recipe, (home, guests))
    while match.advance(1024):
        pass
    gained = (
        match.take().referee.filter(pl.col("event") == "fault", pl.col("team").is_not_null())["team"]
        .cast(str))
    own = SIDES[int(away)]
    return Played(
        match.score[int(away)] - match.score[1 - int(away)], int((gained != own).sum()),
        int((gained == own).sum()), recipe.referee.duration_s / 60)


def pairs(part: tuple[Side, Side, Sequence[int]]) -> list[list[float]]:
    """Means over both matches of some seeds, [seeds, 3]: lead, fouls a minute, the other's fouls a minute."""
    one, other, seeds = part
    rows = [(match.lead, match.fouls / match.minutes, match.others / match.minutes)
            for seed in seeds for away in (False, True) for match in [play(one, other, seed, away)]]
    means: list[list[float]] = np.array(rows).reshape(len(seeds), 2, 3).mean(axis=1).tolist()
    return means


def _row(
    left_out: str, opponent: str, seeds: Sequence[int], worth: np.ndarray, fouls: float, without: float
) -> dict[str, object]:
    low, high = mean_interval(worth) or (np.nan, np.nan)
    return {
        "left_out": left_out, "opponent": opponent, "matches": 2 * len(seeds),
        "seeds": f"{seeds[0]} to {seeds[-1]}", "worth": round(float(worth.mean()), 2),
        "low": round(float(low), 2), "high": round(float(high), 2), "fouls": round(float(fouls), 3),
        "fouls_without": round(float(without), 3)}


def main(out: Path, seeds: Sequence[int] = SEEDS) -> None:
    """Write the table into a folder; a row for each set of rules that is left out, and each opponent."""
    whole, people, rows = Side("static"), Side("human-like"), []
    with workers() as pool, going_on(out, __file__) as parts:
        def played(one: Side, other: Side) -> np.ndarray:
            every = [(one, other, list(seeds[at:at + _PART])) for at in range(0, len(seeds), _PART)]
            return np.concatenate(parts(every, pairs, pool))

        for name, rules in LEFT_OUT.items():
            direct = played(whole, Side("static", rules))
            rows.append(
                _row(name, "static without it", seeds, direct[:, 0], direct[:, 1].mean(), direct[:, 2].mean())
            )
            print(rows[-1], flush=True)
        best, without = (played(team, people) for team in (whole, Side("static", RULES)))
        worth = best[:, 0] - without[:, 0]
        rows.append(_row("all", "human-like", seeds, worth, best[:, 1].mean(), without[:, 1].mean()))
        print(rows[-1])
    pl.DataFrame(rows).write_csv(out / "rules.csv")


if __name__ == "__main__":
    main(Path(__file__).parent)
