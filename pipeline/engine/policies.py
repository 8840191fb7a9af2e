"""The noun policies: decisions, parent and training of its versions."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from itertools import islice
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import CorruptFile, NotFound
from pitchlore.pipeline.engine.habits import copy_of, habitual, matches_of, watched_clock
from pitchlore.pipeline.engine.inputs import Held, Inputs
from pitchlore.pipeline.engine.knowledge import (
    imitates,
    known_shares,
    label_of,
    learned_from,
    lineage,
    of_imitated,
    sha256_of,
)
from pitchlore.pipeline.engine.outputs import digests, need, table_of
from pitchlore.pipeline.engine.stage import Plan, Scope, Stage
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.sides.teams import Team, sides_of
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.store.work import Made
from pitchlore.schemas import (
    Appraisals,
    Decisions,
    Habits,
    HabitTrees,
    Occasions,
    Policies,
    Returns,
    Sides,
    Sights,
    States,
)

#: Appraises as :func:`pipeline.stages.policies.appraise.fit_action_values`.
Fit = Callable[..., tuple[pl.DataFrame, pl.DataFrame]]
#: Settings of the team that chose that a policy keeps, so that it plays as what it learned from: a clock, and
#: how far ahead it predicts.
PLAYS = ("clock", "clock_s", "predict_s")


def looks(policy: Manifest) -> bool:
    """True if a version of the policies chooses by appraisals of what is seen, and not by states."""
    found = policy.files.get(Appraisals.NAME)
    return found is not None and bool(found.rows)


def copies(policy: Manifest) -> bool:
    """True if a version of the policies does what the imitated team does, by its habits."""
    return looks(policy) and policy.settings.get("learner") == "imitation"


def way_of_play(policy: Manifest) -> str:
    """How robots choose by a version of the policies, in a sentence; and why, where it is not as asked."""
    team, learner = imitates(policy), policy.settings.get("learner", "sarsa")
    whom = "the imitated team" if team is None else f"{team.team} ({team.kind})"
    if looks(policy):
        takes = (f"copies {whom}: a robot takes the option that this team most probably takes at what it sees"
                 if copies(policy) else "looks: a robot takes the action that is worth most at what it sees")
        of = matches_of(policy.details["copy_of"]) if "copy_of" in policy.details else ""
        return f"The policy {takes}." + (f" Its habits are those of {of}." if of else "")
    why, other = "", team is not None and team.kind != Kind.VSSS
    if other or learner == "imitation":
        alone = "in the league vsss alone" if other else "where `recover` is on and bodies are seen"
        why = f" It is no copy: options are recovered {alone}, and none of {whom} were."
    return f"The policy looks up behaviours in states, by values of Sarsa(λ).{why}"


def known_play(store: Store, policy: Manifest) -> dict[str, float]:
    """The shares of ``known_shares`` of the knowledge that a policy was trained on; none if that is gone."""
    knowledge = trained_on(store, policy)
    if knowledge is None:
        return {}
    return known_shares(of_imitated(knowledge, table_of(store, knowledge, Occasions)))


def trained_on(store: Store, policy: Manifest) -> Manifest | None:
    """The version of the knowledge that a policy was trained on; None if it is gone or left out."""
    number = policy.details["knowledge_version"]
    try:
        return store.manifest("knowledge", number) if number in store.versions("knowledge") else None
    except CorruptFile as error:
        store.go_on_without(error)
        return None


def plan(store: Store, _: Scope, settings: PolicySettings, __: Stage) -> Plan:
    """The inputs of the next policy: the newest knowledge, its decisions, and the policy before.

    A line of policies learns from each match once: training from the parent takes only matches that no
    policy of the line has learned from. If there are none, if a match of the line was made anew since, or if
    the parent imitates another team, training begins anew from the knowledge, on all matches.

    Raises:
        NotFound: if there is no knowledge yet, or if it is out of date.
        CorruptFile: if all of it is damaged.
    """
    knowledge = store.newest_whole("knowledge") or store.latest("knowledge")
    if knowledge is None:
        raise NotFound("there is no knowledge to train on", where=store.where,
                       next_step="Import recordings and run `pitchlore run` first")
    known, learner = batch(store, knowledge, settings.last_matches), _learner(settings, knowledge)
    inputs = {f"knowledge/{role}": record.sha256 for role, record in sorted(knowledge.files.items())}
    inputs["knowledge/imitates"] = digest(json.dumps(knowledge.details.get("imitates")).encode())
    sides = {each.match: need(store, "sides", each.match) for each in known}
    inputs |= digests({"sides": list(sides.values())})
    inputs |= {label_of(each.receipt, each.match): sha256_of(each.receipt, each.match) for each in known}
    parent = _parent(store, knowledge) if settings.parent else None
    fresh = known if parent is None else _unlearned(store, parent, known)
    goes_on = parent is not None and bool(fresh) and learner == "sarsa" and not looks(parent)
    taken = fresh if goes_on else known
    receipts: dict[str, list[Receipt]] = {
        "knowledge": [knowledge], "sides": [sides[each.match] for each in taken],
        "decisions": list({each.receipt.name: each.receipt for each in taken}.values()),
        "matches": _last_played(store, taken),
    }
    if learner == "sight":
        receipts["sequences"] = [need(store, "sequences", each.match) for each in taken]
        inputs |= digests({"sequences": receipts["sequences"]})
    if goes_on and parent is not None:
        return Plan(receipts | {"parent": [parent]}, inputs, parent.version)
    return Plan(receipts, inputs)


def compute(inputs: Inputs, settings: PolicySettings, fit: Fit | None = None) -> Made:
    """The action values of a policy: of what the knowledge has of the team that it imitates; and appraisals.

    Decisions are those of that team, and those that players chose.

    Args:
        inputs: inputs of the next version.
        settings: settings of the stage.
        fit: fits the appraisals; None: :func:`pipeline.stages.policies.appraise.fit_action_values`.
    """
    from pitchlore.pipeline.stages.policies.batch import batch_of  # noqa: PLC0415 (see pipeline.engine.stages)
    from pitchlore.pipeline.stages.policies.certainty import returns_of, states_of  # noqa: PLC0415 (see pipeline.engine.stages)
    from pitchlore.pipeline.stages.policies.train import train  # noqa: PLC0415 (see pipeline.engine.stages)

    (knowledge,) = inputs["knowledge"]
    assert isinstance(knowledge, Manifest)
    team, seen = imitates(knowledge), of_imitated(knowledge, inputs.table("knowledge", Occasions))
    order = pl.DataFrame({"match_id": [receipt.name for receipt in inputs["sides"]]}).with_row_index("place")
    mine = sides_of(team, pl.concat(inputs.batches("sides", Sides)))
    decisions = pl.concat([
        table.join(order, on="match_id").join(mine, on=("match_id", "team"), how="left")
        .filter(pl.col("chosen") | pl.col("own")).select("place", *Decisions.dtypes())
        for table in inputs.pieces("decisions", Decisions)])
    appraisals, learner = Appraisals.empty(), _learner(settings, knowledge)
    trees = HabitTrees.empty() if learner == "sarsa" else next(inputs.batches("knowledge", HabitTrees))
    if learner == "sight":
        from pitchlore.pipeline.stages.policies import appraise  # noqa: PLC0415 (it loads scikit-learn)
        from pitchlore.pipeline.stages.situations.rules import TABLE_1  # noqa: PLC0415 (see pipeline.engine.stages)

        seen = appraise.actions(seen, TABLE_1, settings.appraisals)
    if learner == "imitation":
        seen, appraisals = habitual(next(inputs.batches("knowledge", Habits)), trees, inputs.version)
    ordered = decisions.sort("place", maintain_order=True).drop("place")
    chosen = batch_of([ordered], seen, settings)
    policy, report = train(
        chosen, seen, inputs.table("parent", Policies) if inputs["parent"] else None,
        settings, inputs.version, knowledge.version,
    )
    returned = returns_of(
        policy, chosen, next(inputs.batches("parent", Returns)) if inputs["parent"] else None,
        settings.discount)
    if learner == "sight":
        sights = pl.concat(inputs.batches("sequences", Sights))
        watched = sights.drop_nulls("code").join(
            mine, on=("match_id", "team"), how="semi", maintain_order="left")
        appraisals, kept = (fit or appraise.fit_action_values)(
            ordered, sights, seen, settings.appraisals, inputs.version, watched, trees)
        policy, returned = (each.join(kept, on=["role", "behaviour_id"], how="semi", maintain_order="left")
                            for each in (policy, returned))
    tables = [(policy, Policies), (appraisals, Appraisals), (returned, Returns),
              (states_of(policy, returned), States)]
    return Made(tables, details={
        "knowledge_version": knowledge.version, "imitates": knowledge.details.get("imitates"),
        **asdict(report), "matches": len(inputs["sides"]), "plays": _plays(inputs, learner),
    } | ({"copy_of": of} if learner == "imitation" and (of := copy_of(knowledge.details)) else {}))


def _learner(settings: PolicySettings, knowledge: Manifest) -> str:
    """The learner; Sarsa(lambda) in place of imitation if the knowledge has no habits of the team."""
    habits = knowledge.files.get(Habits.NAME)
    no_copy = settings.learner == "imitation" and (habits is None or not habits.rows)
    return "sarsa" if no_copy else settings.learner


def _last_played(store: Store, matches: list[PolicyMatch]) -> list[Receipt]:
    """The newest of some matches in which a player chose; none if no player did, or it is there no more."""
    chosen = (each.match for each in reversed(matches) if _choosing(each.receipt, each.match))
    found = (store.receipt("matches", match) for match in islice(chosen, 1))
    return [receipt for receipt in found if receipt is not None]


def _plays(inputs: Inputs, learner: str) -> dict[str, Any]:
    """How the team played that chose last, by the recipe of its match: the settings that a policy needs.

    Empty if no player chose, or where the match has no recipe. A team that imitates decides as often as it
    was watched.
    """
    if learner == "imitation" or (learner == "sight" and not inputs["matches"]):
        return watched_clock(inputs)
    for match in inputs["matches"]:
        (side, *_), = filter(None, (_choosing(decided, match.name) for decided in inputs["decisions"]))
        team = match.settings.get(side, {})
        return {name: team[name] for name in PLAYS if name in team}
    return {}


def _choosing(decisions: Held, match: str) -> list[str]:
    """The sides of a match on which a player chose; none if the decisions are not of that match."""
    sides: list[str] = decisions.details["matches"].get(match, {}).get("choosing", [])
    return sides


def _parent(store: Store, knowledge: Manifest) -> Manifest | None:
    """The newest policy, if it imitates the same team."""
    newest = store.newest_whole("policies")
    same = newest is not None and newest.details.get("imitates") == knowledge.details.get("imitates")
    return newest if same else None


class PolicyMatch(NamedTuple):
    """A match that policies learn from.

    Attributes:
        match: its id.
        receipt: receipt of the decisions of its group.
    """

    match: str
    receipt: Receipt


def batch(store: Store, knowledge: Manifest, last_matches: int | None = None) -> list[PolicyMatch]:
    """The matches whose decisions policies of a version of the knowledge learn from, oldest first.

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
    team, newest_first = imitates(knowledge), dict[str, PolicyMatch]()
    held = cache(lambda group: need(store, "decisions", group))
    for version in lineage(store, knowledge):
        for match, learned in reversed(learned_from(version).items()):
            if len(newest_first) == last_matches:
                return list(newest_first.values())[::-1]
            if match not in newest_first:
                known = PolicyMatch(match, held(learned.group))
                if sha256_of(known.receipt, match) != learned.sha256:
                    raise NotFound(
                        f"the decisions of {match} are newer than knowledge {version.version}",
                        where=store.where, next_step="Run `pitchlore run` to emit knowledge first")
                if team is None or _tells(store, known, team):
                    newest_first[match] = known
    return list(newest_first.values())[::-1]


def _tells(store: Store, known: PolicyMatch, team: Team) -> bool:
    """True if some decisions of a match are of a team, or were chosen in its league."""
    sides = need(store, "sides", known.match).details
    chosen = _choosing(known.receipt, known.match)
    return bool(sides["kind"] == team.kind and (team.team in sides["counts_as"] or chosen))


def _unlearned(store: Store, parent: Manifest, known: list[PolicyMatch]) -> list[PolicyMatch]:
    """The matches that no policy of a line has learned from.

    None of them, if a policy learned from other decisions of one of the matches.
    """
    learned: dict[str, str] = {}
    policy: Manifest | None = parent
    while policy is not None:
        learned |= {match: of.sha256 for match, of in learned_from(policy).items()}
        policy = None if policy.parent is None else store.manifest("policies", policy.parent)
    now = {each.match: sha256_of(each.receipt, each.match) for each in known}
    if any(learned.get(match, sha256) != sha256 for match, sha256 in now.items()):
        return []
    return [each for each in known if each.match not in learned]


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
