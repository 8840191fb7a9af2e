"""What a run says of its knowledge: why there is none, and whether it is of two leagues."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from flows.stage import Scope
from pipeline.store import Store
from pipeline.store.receipts import Manifest, Receipt
from schemas import SIDES, Quality

#: Flaws of matches that say why no goal of a team is known.
_FLAWS = ("goals unknown", "scorer unknown")
#: Matches and teams that are named.
_NAMED, _TEAMS = 5, 12


def lacking(store: Store, scope: Scope) -> list[str]:
    """Why there is nothing to know of the matches of a scope, a line each; empty if there is something.

    There is nothing if no behaviour was selected and no player logged a decision.
    """
    sides = [receipt for receipt in store.receipts("sides") if receipt.name in scope.matches]
    if sides and not any(team for receipt in sides for team in receipt.details["counts_as"]):
        return [_nobody_counts(store, scope)]
    selected, decided = (store.readable(noun, scope.name) for noun in ("behaviours", "decisions"))
    if selected is None or decided is None:
        return []
    if selected.files["patterns"].rows or decided.details.get("decisions", 0):
        return []
    matches = [receipt for receipt in store.receipts("matches") if receipt.name in scope.matches]
    goals = sum(receipt.details.get("goals", 0) for receipt in store.receipts("goals")
                if receipt.name in scope.matches)
    said = unscored(store, matches)
    many = f"{len(matches)} match{'es' if len(matches) > 1 else ''}"
    if len(said) == len(matches):
        head = f"no goal of a team is known in {many}, so that nothing tells which behaviours pay"
        return [f"No knowledge and no policy were made: {head}.", *_first(said)]
    head = f"no behaviour surely pays in {many} with {goals} goal{'s' if goals != 1 else ''}"
    following = 'Import more matches, or say select_by = "value" in the [behaviours] settings'
    return [f"No knowledge and no policy were made: {head}. {following}.", *_first(said)]


def _nobody_counts(store: Store, scope: Scope) -> str:
    """That the settings leave no team, and which there are."""
    matches = [receipt for receipt in store.receipts("matches") if receipt.name in scope.matches]
    there = sorted({(receipt.details[side], receipt.details["pitch"]["kind"])
                    for receipt in matches for side in SIDES})
    named = ", ".join(f"{team} ({kind})" for team, kind in there[:_TEAMS])
    return (f"No knowledge and no policy were made: --kind, --team or the [sides] settings leave no team. "
            f"There are {named}.")


def leagues(knowledge: Manifest | None) -> list[str]:
    """A line that warns of several leagues in one version of the knowledge; none if it has one."""
    teams = knowledge.details.get("teams", ()) if knowledge is not None else ()
    kinds = sorted({team["kind"] for team in teams})
    if len(kinds) < 2:
        return []
    of = (f"{kind}: {', '.join(team['team'] for team in teams if team['kind'] == kind)}" for kind in kinds)
    told = "; ".join(of)
    return [(f"The knowledge is of {len(kinds)} leagues ({told}). Each team has behaviours of its own, and "
             "policies imitate one team. Say --kind or --team for the knowledge of one league or team.")]


def unscored(store: Store, matches: Sequence[Receipt]) -> list[str]:
    """A line for each of these matches in which no goal of a team is known, with what to do."""
    lines = []
    for receipt in matches:
        known = receipt.details.get("flaws", {})
        if not any(flaw in known for flaw in _FLAWS):
            continue
        quality = store.read_table(receipt, "quality", Quality)
        notes = quality.filter(pl.col("flaw").cast(pl.String).is_in(_FLAWS))["note"].drop_nulls()
        lines.append(f"{receipt.name}: {notes[0] if len(notes) else 'no goal is known'}.")
    return lines


def _first(lines: list[str]) -> list[str]:
    more = len(lines) - _NAMED
    return [*lines[:_NAMED], *([f"… and {more} more matches (table quality)."] if more > 0 else [])]
