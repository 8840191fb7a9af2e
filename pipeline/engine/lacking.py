"""Remarks on matches and knowledge: what was assumed, why there is none, whether it mixes leagues."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import polars as pl

from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.stage import Scope
from pitchlore.pipeline.stages.sides import UNUSABLE
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.schemas import SIDES, Goals, Quality

#: Flaws that say why no goal of a team is known, ...
UNSCORED = ("goals unknown", "scorer unknown")
#: ... and those that an import tells with their notes, as what a map would settle, the weightiest first.
REMARKABLE = (
    "implausible", "ball lost", *UNSCORED, "poor recognition", "unmatched map", "off the pitch",
    "unit of angle", "home inferred", "goals inferred", "slow sampling", "assumed", "several matches",
    "colours switched", "score corrected", "text encoding",
)
#: Remarks of an import that are reported.
_REMARKS = 12
#: Matches and teams that are named.
_NAMED, _TEAMS = 5, 12


def remarks(
    store: Store, matches: Iterable[Receipt], flaws: Collection[str] = REMARKABLE, *, most: int = _REMARKS
) -> list[str]:
    """A line for each of these flaws of each match, as its table quality notes it.

    Args:
        store: has the matches.
        matches: their receipts.
        flaws: the flaws that are reported.
        most: number of lines from which on the less weighty ones are only counted.
    """
    found: list[tuple[int, str]] = []
    for receipt in matches:
        if not receipt.details.get("flaws", {}).keys() & {*flaws}:
            continue
        quality = table_of(store, receipt, Quality)
        shown = quality.filter(pl.col("flaw").cast(pl.String).is_in(flaws)).select("flaw", "note", "count")
        found += [(REMARKABLE.index(flaw), f"{receipt.name}: {note or f'{flaw} {count}'}.")
                  for flaw, note, count in shown.iter_rows()]
    kept = sorted(enumerate(found), key=lambda it: it[1][0])[:most]
    more = [f"… and {number_of(len(found) - most, 'remark')} of less weight (table quality)."]
    return [*(line for _, (_, line) in sorted(kept)), *(more if len(found) > most else ())]


def lacking(store: Store, scope: Scope) -> list[str]:
    """Why there is nothing to know of the matches of a scope, a line each; empty if there is something.

    There is nothing if no behaviour was selected, no player logged a decision, and no option was recovered of
    a match that counts, from which habits could be learned.
    """
    selected, decided = (store.receipt(noun, scope.name) for noun in ("behaviours", "decisions"))
    if selected is None or decided is None or decided.details.get("decisions", 0) or any(
            report["groups_kept"] for report in selected.details["reports"]):
        return []
    sides = _of(store, "sides", scope)
    count = {receipt.name for receipt in sides if any(receipt.details["counts_as"])}
    options = (store.receipt("options", match) for match in scope.matches if match in count)
    if any(held and held.details["options"] for held in options):
        return []
    every = _of(store, "matches", scope)
    matches = [receipt for receipt in every if receipt.name in count]
    useless = [receipt for receipt in every if UNUSABLE & receipt.details.get("flaws", {}).keys()]
    if not matches and useless:
        return ["No knowledge and no policy were made: no match shows a course of play with a ball.",
                *remarks(store, useless, (*UNSCORED, *UNUSABLE), most=_NAMED)]
    if not matches:
        there = sorted({(it.details[side], it.details["pitch"]["kind"]) for it in every for side in SIDES})
        named = ", ".join(f"{team} ({kind})" for team, kind in there[:_TEAMS])
        return [("No knowledge and no policy were made: --kind, --team or the [sides] settings leave no "
                 f"team. There are {named}.")]
    goals = {receipt.name: receipt for receipt in _of(store, "goals", scope)}
    counted = sum(goals[match.name].details["goals"] for match in matches if match.name in goals)
    silent = [match for match in matches if _unscored(store, match, goals.get(match.name))]
    said = remarks(store, silent, UNSCORED, most=_NAMED)
    many = f"{len(matches)} match{'es' if len(matches) > 1 else ''}"
    if len(silent) == len(matches):
        why = f"no goal of a team is known in {many}, so that nothing tells which behaviours go with goals"
    else:
        scored = number_of(counted, "goal")
        why = (f"no behaviour went with better chances beyond chance in {many} with {scored}. "
               'Import more matches, or say select_by = "value" in the [behaviours] settings')
    return [f"No knowledge and no policy were made: {why}.", *said]


def _of(store: Store, noun: str, scope: Scope) -> list[Receipt]:
    """The outputs of a noun of the matches of a scope, as far as they have been made."""
    found = (store.receipt(noun, match) for match in scope.matches)
    return [receipt for receipt in found if receipt is not None]


def _unscored(store: Store, match: Receipt, goals: Receipt | None) -> bool:
    """True if flaws of a match say why no goal of a team is known in it."""
    flaws = match.details.get("flaws", {})
    return "goals unknown" in flaws or (goals is not None and "scorer unknown" in flaws and not (
        table_of(store, goals, Goals)["team"].count()))


def leagues(knowledge: Manifest | None) -> list[str]:
    """A line that warns of several leagues in one version of the knowledge; none if it has one."""
    teams = knowledge.details.get("teams", ()) if knowledge is not None else ()
    kinds = sorted({team["kind"] for team in teams})
    if len(kinds) < 2:
        return []
    named = "; ".join(
        f"{kind}: {', '.join(team['team'] for team in teams if team['kind'] == kind)}" for kind in kinds)
    return [(f"The knowledge is of {len(kinds)} leagues ({named}). Each team has behaviours of its own, and "
             "policies imitate one team. Say --kind or --team for the knowledge of one league or team.")]
