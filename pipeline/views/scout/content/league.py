"""The first page: the teams of a league with what they won, and its matches."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from pitchlore.pipeline.views.scout.content.flaws import WORDS
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch, TeamName, sides_played
from pitchlore.schemas import SIDES

TITLE = "The league"


def league_facts(
    league: Sequence[LeagueMatch], teams: Sequence[TeamName], lines: Mapping[str, dict[str, Any]], every: int
) -> dict[str, Any]:
    """Content of the first page; ``lines`` are the league's, by match, ``every`` counts all its matches."""
    rows = [_row(match, lines[match.name]) for match in league]
    common = sorted(set.intersection(*(_kinds(row["flaws"]) for row in rows))) if len(rows) > 1 else []
    for row in rows:
        row["more_flaws"] = "; ".join(
            flaw for flaw in row["flaws"].split("; ") if flaw and not _kinds(flaw) & {*common})
    times = Counter(match.inputs["matches"][0].details.get("started_at", "") for match in league)
    rows.reverse()  # a league's matches are oldest first
    standings = [standing_of(team, league, lines) for team in teams]
    standings.sort(key=lambda it: (-it["won"], it["lost"], it["against"] - it["goals"]))
    kinds = Counter(row["kind"] for row in rows)
    untold = WORDS["home inferred"][0]
    return {"title": TITLE, "every": every, "rows": rows, "standings": standings, "common_flaws": common,
            "home_told": not all(untold in row["flaws"] for row in rows),
            "at_once": any(count > 1 for started, count in times.items() if started), "leagues": [
        (kind, [it for it in standings if it["team"].kind == kind]) for kind, _ in kinds.most_common()]}


def _kinds(flaws: str) -> set[str]:
    """Kinds of flaws in words, without their counts."""
    return {re.sub(r": [\d,]+( of [\d,]+)?( [a-z ]+)?$", "", flaw) for flaw in flaws.split("; ") if flaw}


def standing_of(
    team: TeamName, league: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> dict[str, Any]:
    """A team's wins, draws and losses in matches whose score is known; those against itself are left out."""
    own = [(match, sides[0]) for match in league if len(sides := sides_played(team, match)) == 1]
    scores = [[lines[match.name]["numbers"][it]["goals"] for it in (side, SIDES[1 - SIDES.index(side)])]
              for match, side in own]
    known = [(ours, theirs) for ours, theirs in scores if ours is not None and theirs is not None]
    return {
        "team": team, "played": len(own), "unknown": len(own) - len(known),
        "won": sum(ours > theirs for ours, theirs in known),
        "drawn": sum(ours == theirs for ours, theirs in known),
        "lost": sum(ours < theirs for ours, theirs in known),
        "goals": sum(ours for ours, _ in known), "against": sum(theirs for _, theirs in known),
    }


def _row(match: LeagueMatch, line: Mapping[str, Any]) -> dict[str, Any]:
    """A match as the page shows it."""
    numbers = line["numbers"]
    return {
        "id": match.name, "home": match.home, "away": match.away,
        "territory": Markup(line["picture"]),  # noqa: S704 (pipeline.views.scout.pictures made it)
        "possession": numbers["home"]["possession"],
        "shots": [numbers[side]["shots"] for side in SIDES],
        **{name: line[name] for name in ("score", "counted", "seconds", "kind", "date", "flaws")},
    }
