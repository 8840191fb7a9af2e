"""Commands on the knowledge base: kb list, show, diff, verify."""

from __future__ import annotations

import polars as pl

from pitchlore.flows.commands.common import DEFAULTS, Common, Json, UserPath
from pitchlore.flows.commands.printing import (
    LEAST_SUPPORT,
    by_effect,
    console,
    print_frame,
    print_json,
    print_known,
    print_lack,
    spelt,
)
from pitchlore.flows.commands.verify import verify_versions
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.face.versions import Knowledge


def list_versions(*, json: Json = False, common: Common = DEFAULTS) -> None:
    """List the versions of the knowledge.

    Args:
        json: Print JSON.
        common: Options of every command.
    """
    store = common.existing
    rows = [
        {"version": known.version, "parent": known.parent, "matches": known.details["matches"],
         "teams": len(known.details.get("teams", ())), "behaviours": known.details["behaviours"],
         "occasions": known.details["occasions"], "imitates": known.imitates,
         "made_without": ", ".join(known.made_without), "key": known.key}
        for known in (Knowledge(store, each) for each in store.manifests("knowledge"))
    ]
    if json:
        print_json(rows)
    elif rows:
        frame = pl.DataFrame(rows)
        print_frame(frame if any(frame["made_without"]) else frame.drop("made_without"))
    elif not store.versions("knowledge"):
        console().print("no knowledge yet: run `pitchlore run`")


def show(
    version: int | None = None, *, team: str | None = None, kind: str | None = None, role: str | None = None,
    support: int = LEAST_SUPPORT, json: Json = False, common: Common = DEFAULTS,
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
    known = common.league.knowledge(version)
    rows = _asked(known.behaviours, team=team, kind=kind, role=role).filter(pl.col("support") >= support)
    if json:
        print_json({"manifest": known.manifest, "behaviours": rows.to_dicts()})
        return
    habits = f", by its habits of {known.habits_of}" if known.habits_of else ", by its habits"
    by = habits if known.habits.height else ", by behaviours in states"
    console().print(f"knowledge version {known.version}, parent {known.parent}; "
                    f"policies imitate: {f'{known.imitates}{by}' if known.imitates else 'nobody'}")
    print_lack(known)
    print_known(known)
    for (of, league), own in rows.group_by("team", "kind", maintain_order=True):
        print_frame(
            by_effect(own).select(
                "behaviour_id", "n", "support", "value", "low", "high", "pays", "effect", "family", "x", "y",
                "paper", spelt("codes"),
            ),
            title=f"{'all teams' if of is None else of} ({league or 'all'}), by effect: value times support, "
                  "what V changed with them in all; those that went with a rise first",
        )
    if known.habits.height:
        often = known.habits.sort("role", "share", descending=[False, True])
        print_frame(
            often.with_columns(codes=pl.concat_list("option")).select(
                "role", "option", "share", "windows", spelt("codes")),
            title=f"habits of {known.imitates}: how often each role takes an option",
        )
    if teams := known.details.get("teams"):
        print_frame(pl.DataFrame(teams), title="teams that count")
    print_frame(pl.DataFrame([{"role": r} | c for r, c in known.details["roles"].items()]))


def diff(before: int, after: int | None = None, *, json: Json = False, common: Common = DEFAULTS) -> None:
    """Show what changed from one version to another, the newest by default.

    Args:
        before: Number of the earlier version.
        after: Number of the later version (default: the newest).
        json: Print JSON.
        common: Options of every command.
    """
    earlier = common.league.knowledge(before)
    later = common.league.knowledge(after)
    found = later.since(earlier)
    if json:
        print_json({"behaviours": found.behaviours.to_dicts(), "roles": found.roles.to_dicts()})
        return
    print_frame(found.roles, title=f"knowledge {earlier.version} -> {later.version}")
    if found.behaviours.height:
        print_frame(found.behaviours)
    else:
        console().print("the same behaviours")


def verify(
    version: int | None = None, *, restore_from: UserPath | None = None, json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Check the files of every version of the knowledge, or of one.

    Args:
        version: Check only this version.
        restore_from: A copy of the data folder. Files that are damaged here and whole there are restored.
        json: Print JSON.
        common: Options of every command.
    """
    verify_versions(version, restore_from, json=json, common=common)


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
