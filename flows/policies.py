"""The noun policies: decisions, parent and training of its versions."""

from __future__ import annotations

import json
from dataclasses import asdict

import polars as pl

from flows.knowledge import imitates, lineage, matches_of, of_imitated
from flows.outputs import digests, need
from flows.stage import Inputs, Plan, Scope, Stage
from pipeline.errors import NotFound
from pipeline.settings import PolicySettings
from pipeline.store import Store
from pipeline.store.receipts import Manifest, Receipt, digest
from pipeline.store.work import Made
from pipeline.teams import Team, sides_of
from schemas import Decisions, Occasions, Policies, Sides

_DECISIONS = "decisions/"


def plan(store: Store, _: Scope, settings: PolicySettings, __: Stage) -> Plan:
    """The inputs of the next policy: the newest knowledge, its decisions, and the policy before.

    A line of policies learns from each match once: training from the parent takes only matches that no
    policy of the line has learned from. If there are none, if a match of the line was made anew since, or if
    the parent imitates another team, training begins anew from the knowledge, on all matches.

    Raises:
        NotFound: if there is no knowledge yet, or if it is out of date.
    """
    knowledge = store.latest("knowledge")
    if knowledge is None:
        raise NotFound("there is no knowledge to train on", where=str(store.root),
                       next_step="Import recordings and run `pitchlore run` first")
    decisions = batch(store, knowledge, settings.last_matches)
    inputs = {f"knowledge/{role}": record.sha256 for role, record in sorted(knowledge.files.items())}
    inputs["knowledge/imitates"] = digest(json.dumps(knowledge.details.get("imitates")).encode())
    sides = [need(store, "sides", receipt.name) for receipt in decisions]
    inputs |= digests({"sides": sides, "decisions": decisions})
    parent = _parent(store, knowledge) if settings.parent else None
    fresh = decisions if parent is None else _unlearned(store, parent, decisions)
    if parent is not None and fresh:
        new = {receipt.name for receipt in fresh}
        receipts: dict[str, list[Receipt]] = {
            "knowledge": [knowledge], "sides": [receipt for receipt in sides if receipt.name in new],
            "decisions": fresh, "parent": [parent],
        }
        return Plan(receipts, inputs, parent.version)
    return Plan({"knowledge": [knowledge], "sides": sides, "decisions": decisions}, inputs)


def compute(inputs: Inputs, settings: PolicySettings) -> Made:
    """The action values of a policy: of what the knowledge has of the team that it imitates.

    Decisions are those of that team, and those that players chose.
    """
    from pipeline.policies.train import train  # noqa: PLC0415 (see flows.stages)

    (knowledge,) = inputs["knowledge"]
    assert isinstance(knowledge, Manifest)
    team, seen = imitates(knowledge), of_imitated(knowledge, inputs.table("knowledge", Occasions))
    tables = zip(inputs.tables("decisions", Decisions), inputs.tables("sides", Sides), strict=True)
    policy, report = train(
        (table.filter(pl.col("chosen") | pl.col("team").is_in(sides_of(team, own))) for table, own in tables),
        seen,
        inputs.table("parent", Policies) if "parent" in inputs else None,
        settings, inputs.version, knowledge.version,
    )
    return Made([(policy, Policies)], details={
        "knowledge_version": knowledge.version, "imitates": knowledge.details.get("imitates"),
        **asdict(report),
    })


def _parent(store: Store, knowledge: Manifest) -> Manifest | None:
    """The newest policy, if it imitates the same team."""
    newest = store.latest("policies")
    same = newest is not None and newest.details.get("imitates") == knowledge.details.get("imitates")
    return newest if same else None


def batch(store: Store, knowledge: Manifest, last_matches: int | None = None) -> list[Receipt]:
    """The receipts of the decisions that policies of a version of the knowledge learn from, oldest first.

    These are the matches of the version in which the imitated team was watched, or in whose league a player
    decided. A version that accumulates names only the matches that it added to its parent's. They count as
    newer than those of the parent. Within one version the order is that of the ids.

    Args:
        store: holds the versions and the decisions.
        knowledge: the version.
        last_matches: number of newest matches to take; None: all.

    Raises:
        NotFound: if decisions were made anew since, so that the knowledge is out of date, or if a version
            that the knowledge builds on is missing.
    """
    team, newest_first = imitates(knowledge), dict[str, Receipt]()
    for version in lineage(store, knowledge):
        for match in reversed(matches_of(version)):
            if len(newest_first) == last_matches:
                return list(newest_first.values())[::-1]
            if match not in newest_first:
                held = _held(store, version, match)
                if team is None or _tells(store, held, team):
                    newest_first[match] = held
    return list(newest_first.values())[::-1]


def _tells(store: Store, decisions: Receipt, team: Team) -> bool:
    """Whether some decisions of a match are of a team, or were chosen in its league."""
    sides = need(store, "sides", decisions.name).details
    watched = team.team in sides["counts_as"] or bool(decisions.details["choosing"])
    return bool(sides["kind"] == team.kind and watched)


def _held(store: Store, knowledge: Manifest, match: str) -> Receipt:
    """The receipt of a match's decisions, if they are those that the knowledge was made from."""
    receipt = need(store, "decisions", match)
    if any(knowledge.inputs.get(label) != sha for label, sha in receipt.digests().items()):
        raise NotFound(f"the decisions of {match} are newer than knowledge {knowledge.version}",
                       where=str(store.root), next_step="Run `pitchlore run` to emit knowledge first")
    return receipt


def _unlearned(store: Store, parent: Manifest, decisions: list[Receipt]) -> list[Receipt]:
    """The decisions that no policy of a line has learned from.

    None of them, if a policy learned from other decisions of one of the matches.
    """
    learned: dict[str, str] = {}
    policy: Manifest | None = parent
    while policy is not None:
        learned |= {label: sha for label, sha in policy.inputs.items() if label.startswith(_DECISIONS)}
        policy = None if policy.parent is None else store.manifest("policies", policy.parent)
    fresh = [receipt for receipt in decisions if not receipt.digests().keys() & learned.keys()]
    changed = any(learned.get(label, sha) != sha for r in decisions for label, sha in r.digests().items())
    return [] if changed else fresh


def describe(store: Store, manifest: Manifest) -> str:
    """The training of a version as Markdown."""
    details = manifest.details
    lines = [f"# Policy version {manifest.version} on knowledge version {details['knowledge_version']}", "",
             "| key | role | pairs | new | decisions | transitions | mean error, first and last sweep |",
             "|---|---|---|---|---|---|---|"]
    lines += [f"| {key} | {role} | {c['pairs']} | {c['new_pairs']} | {c['decisions']} | {c['transitions']} "
              f"| {c['first_error']} {c['last_error']} |"
              for key, roles in details["tables"].items() for role, c in roles.items()]
    return "\n".join(lines)
