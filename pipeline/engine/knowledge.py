"""The noun knowledge: inputs, computation and lineage of its versions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.base.digests import canonical, digest
from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.engine.habits import of_version
from pitchlore.pipeline.engine.inputs import Held, Inputs
from pitchlore.pipeline.engine.outputs import digests, need, table_of
from pitchlore.pipeline.engine.stage import Plan, Scope, Stage
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.settings import KnowledgeSettings
from pitchlore.pipeline.stages.sides.teams import Team, TeamRecord, imitated, teams
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.store.work import Made
from pitchlore.schemas import ROLES, Behaviours, Decisions, Habits, Occasions, Patterns, Sides
from pitchlore.schemas.behaviours import SHOWN_FROM, for_people, moves_randomly

#: First part of the labels of a parent's tables, among the inputs of a version that accumulates.
_PARENT = "parent"
#: The version before, if it was made by the same settings; its habits may be those of this one, too.
_BEFORE = "before"
#: Decisions whose occasions are counted at once: this bounds memory.
_AT_ONCE = 1 << 17


def plan(store: Store, scope: Scope, settings: KnowledgeSettings, stage: Stage) -> Plan:
    """The inputs of the next version: behaviours, decisions, and the parent if versions accumulate.

    A version that accumulates is also made from the version before it, so its key covers the tables of
    that version. Work that any version has added is not added again.

    Raises:
        NotFound: if there is no match to learn from.
        BadSettings: if an earlier version already holds one of the matches, made from other files or with
            other settings.
    """
    if not scope.matches:
        raise NotFound("there is no match to learn from", where=store.where,
                       next_step="Import recordings and run the stages first")
    receipts: dict[str, list[Receipt]] = {
        "behaviours": [need(store, "behaviours", scope.name)],
        "sides": [need(store, "sides", match) for match in scope.matches],
        "decisions": [need(store, "decisions", scope.name)],
    }
    (decisions,) = receipts["decisions"]
    recovered = (store.receipt("options", match) for match in scope.matches)
    receipts["options"] = [held for held in recovered if held is not None and held.details["options"]]
    inputs = digests({noun: receipts[noun] for noun in ("behaviours", "sides", "options")}) | {
        label_of(decisions, match): sha256_of(decisions, match) for match in scope.matches}
    parent = store.newest_whole("knowledge")
    if settings.recover is not None and not receipts["options"]:
        bodies = _of_bodies(store, receipts["sides"])
        inputs |= {f"{noun}/all": digest(canonical(digests({noun: of}))) for noun, of in bodies.items() if of}
        same = parent is not None and parent.settings == settings.model_dump(mode="json") and (
            parent.versions.get(stage.noun) == stage.version)
        receipts |= bodies | {_BEFORE: [parent] if parent is not None and same else []}
    follows = None if parent is None else parent.version
    seed = receipts["behaviours"][0].settings["seed"]
    if not settings.accumulate:
        return Plan(receipts, inputs, follows, seed=seed)
    standing = _added(store, inputs, settings, stage, seed)
    if standing is None and parent is not None:
        _refuse_twice(store, parent, scope)
    receipts[_PARENT] = [parent] if parent is not None else []
    return Plan(receipts, inputs | _of_parent(parent), follows, standing, seed)


def compute(inputs: Inputs, settings: KnowledgeSettings) -> Made:
    """The behaviours and occasions of a version, and the maps that selected the behaviours.

    Policies of a version that accumulates imitate the team that those of its parent do, unless the settings
    name another.

    Raises:
        NotFound: if the settings name a team that does not count.
    """
    from pitchlore.pipeline.stages.knowledge import (  # noqa: PLC0415 (see pipeline.engine.stages)
        behaviours,
        merge_behaviours,
        merge_occasions,
        occasions,
    )

    before = next(iter(inputs[_PARENT]), None)
    version = inputs.version
    sides = pl.concat(inputs.batches("sides", Sides))
    choosing = {match: facts["choosing"] for match, facts in inputs.details("decisions")["matches"].items()}
    records = _added_up(before, teams(sides, choosing))
    learner = imitated(records, settings.imitate, imitates(before) if before is not None else None)
    known = behaviours(inputs.tables("behaviours", Patterns), version)
    if before is not None:
        known = merge_behaviours([inputs.table(_PARENT, Behaviours), known], version)
    decisions = ((part, sides) for piece in inputs.pieces("decisions", Decisions)
                 for part in piece.iter_slices(_AT_ONCE))
    can = known.filter("kept", **learner._asdict())["behaviour_id"] if learner is not None else None
    occurred = occasions(decisions, learner, version, settings, can)
    matches = len(inputs["sides"])
    if before is not None:
        occurred = merge_occasions([inputs.table(_PARENT, Occasions), occurred], version, settings)
        matches += before.details["matches"]
    (selected,) = inputs["behaviours"]
    maps = {role: inputs.blob("behaviours", role) for role in selected.files if role.startswith("maps-")}
    habits = of_version(inputs, settings, learner, sides, _PARENT, _BEFORE)
    return Made(
        [(known, Behaviours), (occurred, Occasions), *habits.tables],
        blobs={role: ("npz", data) for role, data in maps.items() if data is not None},
        details=_counts(known, occurred, matches=matches) | {
            "imitates": learner._asdict() if learner is not None else None,
            "teams": [team._asdict() | record._asdict() for team, record in records.items()],
        } | habits.details,
    )


def _of_bodies(store: Store, sides: Sequence[Receipt]) -> dict[str, list[Receipt]]:
    """Matches and trajectories of the league whose options can be recovered, in the order of their sides."""
    small = [side.name for side in sides if side.details["kind"] == Kind.VSSS]
    found = [(store.receipt("matches", match), store.receipt("trajectories", match)) for match in small]
    whole = [(log, bodies) for log, bodies in found if log is not None and bodies is not None]
    return {"matches": [log for log, _ in whole], "trajectories": [bodies for _, bodies in whole]}


def _added_up(before: Held | None, records: dict[Team, TeamRecord]) -> dict[Team, TeamRecord]:
    """The records of teams, with those of the version before."""
    total = dict(records)
    for row in before.details.get("teams", ()) if before is not None else ():
        team = Team(row["team"], row["kind"])
        new = total.get(team, TeamRecord(0, 0, 0))
        total[team] = TeamRecord(*(row[name] + value for name, value in new._asdict().items()))
    return dict(sorted(total.items()))


def imitates(knowledge: Held) -> Team | None:
    """The team that policies of a version imitate; None without any, or before teams were distinguished."""
    found = knowledge.details.get("imitates")
    return None if found is None else Team(**found)


def of_imitated(knowledge: Held, rows: pl.DataFrame) -> pl.DataFrame:
    """Rows with columns team and kind: those of the team that policies of a version imitate, else all."""
    team = imitates(knowledge)
    return rows if team is None else rows.filter(**team._asdict())


def known_shares(seen: pl.DataFrame) -> dict[str, float]:
    """The share of a team's decisions whose state is known, by each key, from fine to coarse.

    Each decision is left out in turn: its state is known if in another one there the role chose a behaviour
    other than moves randomly. So a state that was seen once is not known.

    Args:
        seen: rows of schema Occasions, of one team.
    """
    learned = pl.col("count").filter(pl.col("behaviour_id") != moves_randomly()).sum()
    states = seen.group_by("key", "role", "state").agg(pl.col("count").sum(), learned=learned)
    known = pl.col("count") - (pl.col("learned") == 1)
    known = pl.when(pl.col("learned") > 0).then(known)
    shares = states.group_by("key").agg(known.sum() / pl.col("count").sum()).sort("key")
    return dict(shares.drop_nulls().iter_rows())


def lineage(store: Store, knowledge: Manifest | None) -> Iterator[Manifest]:
    """A version of the knowledge and those that it adds to, the newest first.

    Raises:
        NotFound: if one of these versions is missing.
    """
    while knowledge is not None:
        yield knowledge
        adds_to = knowledge.parent if knowledge.settings.get("accumulate", False) else None
        knowledge = None if adds_to is None else store.manifest("knowledge", adds_to)


def label_of(decisions: Receipt, match: str) -> str:
    """The label of a match's decisions among the inputs of versions; the receipt is that of its group."""
    return f"decisions/{decisions.name}/{match}"


def sha256_of(decisions: Receipt, match: str) -> str:
    """SHA-256 of a match's rows among the decisions of its group.

    Raises:
        NotFound: if the decisions were made without the match.
    """
    reported = decisions.details.get("matches", {})
    if match not in reported:
        raise NotFound(f"decisions {decisions.name} have been made without {match}", where="decisions",
                       next_step="Run the stages again")
    return str(reported[match]["sha256"])


class LearnedMatch(NamedTuple):
    """A match that a version learned from.

    Attributes:
        group: name of the output of its decisions.
        sha256: SHA-256 of its decisions.
    """

    group: str
    sha256: str


def learned_from(version: Manifest) -> dict[str, LearnedMatch]:
    """The matches whose decisions a version names itself, by id, in order."""
    found = {}
    for label, sha256 in sorted(version.inputs.items()):
        noun, group, *rest = label.split("/")
        if noun == "decisions" and rest:
            # each match had an output of its own once: decisions/MATCH/decisions
            match = group if rest == ["decisions"] else rest[0]
            found[match] = LearnedMatch(group, sha256)
    return dict(sorted(found.items()))


def _of_parent(before: Manifest | None) -> dict[str, str]:
    """The tables of the version before, among the inputs of a version that accumulates."""
    if before is None:
        return {}
    return {f"{_PARENT}/{role}": before.files[role].sha256
            for role in ("behaviours", "occasions", Habits.NAME) if role in before.files}


def _added(
    store: Store, inputs: dict[str, str], settings: KnowledgeSettings, stage: Stage, seed: int
) -> Manifest | None:
    """The version that added exactly these inputs, None if there is none."""
    for manifest in reversed(store.whole_versions("knowledge")):
        parent = {label: sha for label, sha in manifest.inputs.items() if label.startswith(f"{_PARENT}/")}
        if manifest.key == stage.work(stage.noun, settings, inputs | parent, seed=seed).key:
            return manifest
    return None


def _refuse_twice(store: Store, before: Manifest, scope: Scope) -> None:
    held = {match for version in lineage(store, before) for match in learned_from(version)}
    twice = held.intersection(scope.matches)
    if twice:
        raise BadSettings(
            f"knowledge version {before.version} holds {min(twice)} already, made from other files, by "
            "another version of the stage or by other settings, and would count it twice",
            where=store.where,
            next_step="Begin again in another data folder, or say accumulate = false",
        )


def _counts(known: pl.DataFrame, occurred: pl.DataFrame, *, matches: int) -> dict[str, object]:
    """Counts for people, over all teams: behaviours that are kept, states and occasions of ``state_key``."""
    from pitchlore.pipeline.stages.knowledge import finest  # noqa: PLC0415 (see pipeline.engine.stages)

    occurred = finest(occurred)
    roles = {
        role: {
            "behaviours": known.filter("kept", role=role).height,
            "states": occurred.filter(pl.col("role") == role).select("team", "kind", "state").unique().height,
            "occasions": occurred.filter(pl.col("role") == role).height,
        }
        for role in ROLES
    }
    return {"matches": matches, "behaviours": int(known["kept"].sum()),
            "occasions": occurred.height, "roles": roles}


def describe(store: Store, manifest: Manifest) -> str:
    """A version of the knowledge as Markdown: counts, and what the team that policies imitate did."""
    known = of_imitated(manifest, table_of(store, manifest, Behaviours))
    lines = [f"# Knowledge version {manifest.version}", "", "| role | behaviours | states | occasions |",
             "|---|---|---|---|"]
    lines += [f"| {role} | {c['behaviours']} | {c['states']} | {c['occasions']} |"
              for role, c in manifest.details["roles"].items()]
    lines += ["", "| behaviour | support | value | 95 % interval |", "|---|---|---|---|"]
    shown = for_people(known.filter(pl.col("support") >= SHOWN_FROM))
    first = shown.group_by(better=pl.col("value") > 0, maintain_order=True).head(15)
    lines += [f"| {b['behaviour_id']} | {b['support']} | {b['value']:+.3f} | {_interval(b)} |"
              for b in first.iter_rows(named=True)]
    return "\n".join(lines)


def _interval(behaviour: dict[str, Any]) -> str:
    """The interval of a behaviour's value in words; versions from before there were intervals have none."""
    if behaviour["low"] is None:
        return "not known"
    return f"{behaviour['low']:+.3f} to {behaviour['high']:+.3f}"
