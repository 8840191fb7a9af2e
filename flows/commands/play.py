"""Commands that play matches: record."""

from __future__ import annotations

import polars as pl
from cyclopts.types import NonNegativeInt

from flows.catalog import refresh
from flows.commands.common import DEFAULTS, Common, Json, bars, print_frame, print_json, print_stand_in
from flows.record import record
from flows.teams import entrant
from pipeline.play.recipe import Recipe
from pipeline.world.laws import RefereeSettings
from schemas import Matches


def record_matches(
    *,
    home: str = "static",
    away: str = "static",
    seed: int = 1,
    matches: int = 1,
    minutes: float = 8.0,
    robots: int = 3,
    explore: float | None = None,
    caution: float | None = None,
    trust: NonNegativeInt | None = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Play matches and log them.

    Args:
        home: Who plays: random, static, human-like; learned (the newest policy), learned:3 or just 3; the
            id of a season, as best-static-1, for its apprentice.
        away: Likewise.
        seed: Decides all that is left to chance; the same seed plays the same match.
        matches: How many; each has the next seed.
        minutes: Of a match.
        robots: A side.
        explore: Chance that a learned team's robot tries any behaviour instead of the best; by default 0.
        caution: By how much it takes a value known from one episode to be worse than the policy says; by
            default as in its season, else 0.
        trust: Visits that a state needs to be looked up by a finer key; likewise.
        json: Print JSON.
        common: Options of every command.
    """
    store = common.store
    policies: dict[str, pl.DataFrame] = {}
    teams = [entrant(store, word, policies, explore=explore, caution=caution, trust=trust).settings
             for word in (home, away)]
    referee = RefereeSettings(duration_s=60 * minutes)
    rows = []
    with bars() as progress:
        progress.begin("matches", matches)
        for number in range(seed, seed + matches):
            recipe = Recipe(home=teams[0], away=teams[1], seed=number, robots=robots, referee=referee)
            receipt, new = record(store, recipe, policies)
            row = store.read_table(receipt, "matches", Matches)
            rows.append({**row.select("match_id", "home", "away", "score_home", "score_away", "duration_s")
                         .row(0, named=True), "new": new})
            progress.advance("matches", recipe.match_id)
    refresh(store)
    if json:
        print_json(rows)
    else:
        print_frame(pl.DataFrame(rows))
        print_stand_in(home, away)
