"""Commands on the knowledge base: kb list, show, diff, verify."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.printing import console, print_frame, print_json, spelt
from pitchlore.flows.commands.verify import conclude
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.knowledge import imitates
from pitchlore.pipeline.engine.verify import verify_knowledge
from pitchlore.pipeline.numbers.estimates import BY_EVIDENCE
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.schemas import Behaviours, Occasions


def list_versions(*, json: Json = False, common: Common = DEFAULTS) -> None:
    """List the versions of the knowledge.

    Args:
        json: Print JSON.
        common: Options of every command.
    """
    store = common.existing
    rows = [
        {"version": m.version, "parent": m.parent, "matches": m.details["matches"],
         "teams": len(m.details.get("teams", ())), "behaviours": m.details["behaviours"],
         "occasions": m.details["occasions"], "imitates": _imitated(m), "key": m.key}
        for m in (store.manifest("knowledge", v) for v in store.versions("knowledge"))
    ]
    if json:
        print_json(rows)
    elif rows:
        print_frame(pl.DataFrame(rows))
    else:
        console().print("no knowledge yet: run `pitchlore run`")


def show(
    version: int | None = None, *, team: str | None = None, kind: str | None = None, role: str | None = None,
    support: int = 1, json: Json = False, common: Common = DEFAULTS,
) -> None:
    """Show the behaviours of a version, the newest by default, each team's by itself.

    Args:
        version: Number of the version (default: the newest).
        team: Only those of this team or pool.
        kind: Only those of this league: vsss, ssl, 2d or human.
        role: Only those of this role: goalkeeper, midfield or striker.
        support: Only those that were seen so many times or more.
        json: Print JSON, with the manifest.
        common: Options of every command.
    """
    store = common.existing
    manifest = store.manifest("knowledge", _newest(store) if version is None else version)
    known = _asked(store.read_table(manifest, "behaviours", Behaviours), team=team, kind=kind, role=role)
    known = known.filter(pl.col("support") >= support)
    if json:
        print_json({"manifest": manifest.model_dump(mode="json"), "behaviours": known.to_dicts()})
        return
    console().print(f"knowledge version {manifest.version}, parent {manifest.parent}; "
                    f"policies imitate: {_imitated(manifest) or 'nobody'}")
    for (of, league), rows in known.group_by("team", "kind", maintain_order=True):
        print_frame(
            rows.sort(*BY_EVIDENCE, descending=True).select(
                "behaviour_id", "n", "support", "value", "low", "high", "family", "x", "y", "paper",
                spelt("codes"),
            ),
            title=f"{'all teams' if of is None else of} ({league or 'all'}), by the lower end of value",
        )
    if teams := manifest.details.get("teams"):
        print_frame(pl.DataFrame(teams), title="teams that count")
    print_frame(pl.DataFrame([{"role": r} | c for r, c in manifest.details["roles"].items()]))


def diff(before: int, after: int | None = None, *, json: Json = False, common: Common = DEFAULTS) -> None:
    """Show what changed from one version to another, the newest by default.

    Args:
        before: Number of the earlier version.
        after: Number of the later version (default: the newest).
        json: Print JSON.
        common: Options of every command.
    """
    from pitchlore.pipeline.knowledge import diff as difference  # noqa: PLC0415 (it loads numba, which no other kb needs)

    store = common.existing
    manifests = [store.manifest("knowledge", v) for v in (before, _newest(store) if after is None else after)]
    known = [store.read_table(m, "behaviours", Behaviours) for m in manifests]
    seen = [store.read_table(m, "occasions", Occasions) for m in manifests]
    found = difference(known[0], known[1], seen[0], seen[1])
    if json:
        print_json({"behaviours": found.behaviours.to_dicts(), "roles": found.roles.to_dicts()})
        return
    print_frame(found.roles, title=f"knowledge {manifests[0].version} -> {manifests[1].version}")
    if found.behaviours.height:
        print_frame(found.behaviours)
    else:
        console().print("the same behaviours")


def verify(
    version: int | None = None, *, restore_from: Path | None = None, json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Check the files of every version of the knowledge, or of one.

    Args:
        version: Check only this version.
        restore_from: A copy of the data folder. Files that are damaged here and whole there are restored.
        json: Print JSON.
        common: Options of every command.
    """
    conclude(lambda store: verify_knowledge(store, version), restore_from, json=json, common=common)


def _asked(known: pl.DataFrame, **asked_for: str | None) -> pl.DataFrame:
    """The behaviours of a team, a league and a role.

    Raises:
        NotFound: if there are none of that name.
    """
    for name, asked in asked_for.items():
        there = known[name].drop_nulls().cast(pl.String).unique().sort()
        if asked is not None and asked not in there:
            raise NotFound(f"no behaviour of {name} {asked!r} (there are: {', '.join(there) or 'none'})",
                           where=f"--{name}", next_step="Name one of these, or leave it out")
        known = known if asked is None else known.filter(pl.col(name) == asked)
    return known


def _imitated(knowledge: Manifest) -> str | None:
    """The team that policies of a version imitate, in words."""
    team = imitates(knowledge)
    return None if team is None else f"{team.team} ({team.kind})"


def _newest(store: Store) -> int:
    versions = store.versions("knowledge")
    if not versions:
        raise NotFound("there is no knowledge yet", where=store.where,
                       next_step="Run `pitchlore run` first")
    return versions[-1]
