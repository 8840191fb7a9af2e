"""Scripts that the page that compares loads: matches and teams in numbers, versions of the knowledge."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from pitchlore.pipeline.engine.knowledge import learned_from, lineage
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.views.scout.content.league import standing_of
from pitchlore.pipeline.views.scout.content.matches import MEASURES
from pitchlore.pipeline.views.scout.content.sources import (
    LeagueMatch,
    TeamName,
    against_itself,
    matches_in_words,
    sides_played,
)
from pitchlore.pipeline.views.scout.content.teams import over
from pitchlore.pipeline.views.scout.words import TITLES
from pitchlore.schemas import SIDES, Behaviours
from pitchlore.schemas.behaviours import for_people

#: Versions of the knowledge that can be compared: the newest.
VERSIONS = 4
#: Sets of a team's matches that can be compared.
SETS = 40


def numbers_script(
    league: Sequence[LeagueMatch], teams: Sequence[TeamName], lines: Mapping[str, dict[str, Any]],
    versions: Sequence[Manifest],
) -> bytes:
    """A script that has the numbers of all matches and teams, and says which versions there are.

    Args:
        league: the matches.
        teams: theirs.
        lines: the league's, by match.
        versions: versions of the knowledge.
    """
    return _script("scoutNumbers", {
        "measures": MEASURES,
        "codes": TITLES,
        "matches": [{
            "id": match.name, "names": [match.home.name, match.away.name], "kind": match.pitch.kind.value,
            "score": lines[match.name]["score"],
            "numbers": [lines[match.name]["numbers"][side] for side in SIDES],
        } for match in league],
        "teams": [{
            **team._asdict(), "matches": len(own := [it for it in league if team in (it.home, it.away)]),
            "counted": matches_in_words(len(own), against_itself(team, own)),
            **_both(team, own, lines),
        } for team in teams],
        "sets": [{
            "says": f"{team.name} ({team.kind}), {says}", "team": team.slug,
            "matches": [it.name for it in own], **_both(team, own, lines),
            "under": {name: {"matches": [it.name for it in some], **_both(team, some, lines)}
                      for name, some in under(team, own)} if _dated(says) else {},
        } for team in teams for says, own in sets_of(team, league, lines)],
        "versions": [{"version": manifest.version, "matches": manifest.details["matches"]}
                     for manifest in versions],
    })


def _both(
    team: TeamName, own: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> dict[str, Any]:
    """A team's numbers in some of its matches, those of its adversaries, and what it won there."""
    numbers, against = over(team, own, lines)
    won = standing_of(team, own, lines)
    known = won.pop("played") > won.pop("unknown")
    return {"numbers": numbers, "against": against, "standing": {
        name: won[name] for name in ("won", "drawn", "lost", "goals", "against")} if known else None}


def sets_of(
    team: TeamName, league: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> list[tuple[str, list[LeagueMatch]]]:
    """Sets of a team's matches with their names: by adversary, by date, and with and without each robot.

    None is empty or has all matches; of many the first :data:`SETS`.
    """
    own = [match for match in league if team in (match.home, match.away)]
    robots = {match.name: {int(robot) for side in sides_played(team, match)
                           for robot in lines[match.name].get("robots", {}).get(side, ())} for match in own}
    dates = {match.name: lines[match.name].get("date", "") for match in own}
    others = sorted({side.name for match in own for side in (match.home, match.away)} - {team.name})
    found = [(f"against {name}", [match for match in own if name in (match.home.name, match.away.name)])
             for name in others]
    for date in sorted(set(dates.values()) - {""}):
        found += [(f"before {date}", [match for match in own if "" < dates[match.name] < date]),
                  (f"from {date} on", [match for match in own if dates[match.name] >= date])]
    for robot in sorted(set().union(*robots.values())):
        found += [(f"{word} robot {robot}",
                   [match for match in own if (robot in robots[match.name]) is there])
                  for word, there in (("with", True), ("without", False))]
    return [(says, some) for says, some in found if 0 < len(some) < len(own)][:SETS]


def under(team: TeamName, own: Sequence[LeagueMatch]) -> list[tuple[str, list[LeagueMatch]]]:
    """Each adversary with those of a team's matches that are against it; none where there is one."""
    others = sorted({side.name for match in own for side in (match.home, match.away)} - {team.name})
    return [(name, [match for match in own if name in (match.home.name, match.away.name)])
            for name in others] if len(others) > 1 else []


def _dated(says: str) -> bool:
    return says.startswith(("before ", "from "))


def versions(store: Store) -> list[Manifest]:
    """The newest versions of the knowledge, the newest first."""
    return store.manifests("knowledge")[-VERSIONS:][::-1]


def knowledge(
    store: Store, manifest: Manifest, league: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> bytes:
    """A script that has the behaviours of a version, each team's by itself, in their order for people.

    Of each its id, support, value, and the ends of the value's 95 % interval; of each team its minutes of
    play in the matches that the version was learned from, null where one of these is unknown.

    Args:
        store: the data folder.
        manifest: manifest of the version.
        league: the matches.
        lines: the league's, by match.
    """
    minutes = _minutes(store, manifest, league, lines)
    known = table_of(store, manifest, Behaviours).drop_nulls("team")
    return _script("scoutKnowledge", {"version": manifest.version, "teams": [{
        "name": name, "kind": kind, "minutes": None if minutes is None else minutes.get((name, kind)),
        "behaviours": for_people(rows).select(
            "behaviour_id", "support", pl.col("value", "low", "high").round(4)).rows(),
    } for (name, kind), rows in known.group_by("team", "kind", maintain_order=True)]})


def _minutes(
    store: Store, manifest: Manifest, league: Sequence[LeagueMatch], lines: Mapping[str, dict[str, Any]]
) -> dict[tuple[str, str], float] | None:
    """Minutes of play of each team (name and kind of pitch) over its sides; None where a match is unknown."""
    learned = {match for version in lineage(store, manifest) for match in learned_from(version)}
    own = [match for match in league if match.name in learned]
    if len(own) < len(learned):
        return None
    found = dict[tuple[str, str], float]()
    for match in own:
        for team in (match.home, match.away):
            key = team.name, team.kind
            found[key] = found.get(key, 0.0) + lines[match.name]["played_s"] / 60
    return found


def _script(function: str, facts: object) -> bytes:
    return f"{function}({json.dumps(facts, separators=(',', ':'))});\n".encode()
