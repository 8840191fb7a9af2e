"""The page of a team's maps, and of what follows what."""

from __future__ import annotations

from typing import Any

from pitchlore.pipeline.views.scout.content.learned import Learned
from pitchlore.pipeline.views.scout.content.sources import Known, TeamName, matches_in_words
from pitchlore.pipeline.views.scout.content.teams import on_page
from pitchlore.pipeline.views.scout.maps import lying, maps
from pitchlore.pipeline.views.scout.ring import Edge, Node, ring
from pitchlore.pipeline.views.scout.transitions import Successions, transitions
from pitchlore.pipeline.views.scout.words import of_behaviour
from pitchlore.schemas.behaviours import for_people

#: Behaviours on the ring: those that were begun most often. Arrows from each: its commonest next ones.
_NODES, _ARROWS = 16, 4
#: Least share that an arrow is drawn for. Lines of a panel's lists.
_LEAST, _SHOWN = 0.04, 6


def maps_facts(team: TeamName, known: Known | None, learned: Learned) -> dict[str, Any]:
    """Content of the page of a team's maps."""
    own = for_people(known.of(team)) if known is not None else None
    shown = on_page(team, known, learned)["behaviour_id"].to_list() if known is not None else []
    grams, decisions = learned.grams(team), learned.decisions(team)
    on = lying(own, grams) if own is not None else None
    total, mapped = (0, 0) if on is None else (on.height, on.height - on["neuron"].null_count())
    played = decisions.unique(["match_id", "team"]).height
    matches = decisions["match_id"].n_unique()
    return {
        "total": total, "lying": mapped, "counted": matches_in_words(matches, played - matches),
        "team": team, "version": None if known is None else known.manifest.version, "mapped": learned.mapped,
        "maps": maps(learned.neurons(team), grams, on, shown) if on is not None else [],
        "off": 0 if on is None else on["neuron"].null_count(),
        "graph": _graph(transitions(decisions), shown),
    }


def _graph(found: Successions, shown: list[str]) -> dict[str, Any] | None:
    """The ring of the behaviours that a team began most often; None if it began none."""
    if found.begun.is_empty():
        return None
    most = found.begun.head(_NODES).sort("role", "n", "behaviour_id", descending=[False, True, False])
    nodes = [row | {"words": of_behaviour(row["behaviour_id"]), "key": f"b-{row['behaviour_id']}",
                    "label": f"{row['role'][0].upper()}{place}", "shown": row["behaviour_id"] in shown}
             for place, row in enumerate(most.iter_rows(named=True), 1)]
    at = {node["behaviour_id"]: place for place, node in enumerate(nodes)}
    begun = dict(found.begun.select("behaviour_id", "n").iter_rows())
    steps = [{"from": at.get(before), "to": at.get(after), "times": times, "of": begun[before],
             "before": before, "after": after} for before, after, times in found.counts.iter_rows()]
    inner = [each for each in steps if each["from"] is not None and each["to"] is not None]
    for node in nodes:
        name = node["behaviour_id"]
        node["next"] = [_named(each, "after", nodes, at) for each in steps if each["before"] == name][:_SHOWN]
        node["last"] = [_named(each, "before", nodes, at) for each in steps if each["after"] == name][:_SHOWN]
    arrows = [(place, each["to"], each["times"], each["of"]) for place in range(len(nodes))
              for each in [each for each in inner if each["from"] == place][:_ARROWS]
              if each["times"] >= _LEAST * each["of"]]
    return {
        "nodes": nodes,
        "total": int(found.begun["n"].sum()), "distinct": found.begun.height,
        "rows": [each | {"from": nodes[each["from"]], "to": nodes[each["to"]]} for each in inner],
        "picture": ring(
            [Node(node["key"], node["label"], node["role"],
                  f"{node['label']}: {node['words']}, begun {node['n']} times") for node in nodes],
            [Edge(start, end, times / of,
                  f"{nodes[start]['label']} to {nodes[end]['label']}: {times} of {of}")
             for start, end, times, of in arrows],
            "what follows what: behaviours on a ring, arrows to the ones that followed"),
        "arrows": _ARROWS, "least": _LEAST,
    }


def _named(
    step: dict[str, Any], other: str, nodes: list[dict[str, Any]], at: dict[str, int]
) -> dict[str, Any]:
    """A behaviour that follows or comes before, in words."""
    name = step[other]
    return {"words": of_behaviour(name), "role": name.split("-")[0], "times": step["times"],
            "key": nodes[at[name]]["key"] if name in at else None,
            "label": nodes[at[name]]["label"] if name in at else None}
