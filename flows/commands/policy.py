"""Commands on policies: policy show."""

from __future__ import annotations

import polars as pl

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json
from pitchlore.flows.commands.printing import (
    console,
    in_words,
    print_frame,
    print_json,
    print_known,
    print_lack,
)
from pitchlore.pipeline.base.errors import NotFound


def show(
    version: int | None = None, *, role: str | None = None, key: str | None = None, state: int | None = None,
    unsure: Flag = False, most: int = 10, json: Json = False, common: Common = DEFAULTS,
) -> None:
    """Show the states of a policy in words, the most visited first, and how sure it is in each.

    Args:
        version: Number of the version (default: the newest).
        role: Only those of this role: goalkeeper, midfield or striker.
        key: Only those by this key, such as self6.
        state: Only this state, by its number.
        unsure: Only those in which the policy is unsure: too few episodes, or too close to tell.
        most: Number of states that are printed; --json prints all.
        json: Print JSON.
        common: Options of every command.
    """
    policy = common.league.policy(version)
    states = policy.states
    for name, asked in (("role", role), ("key", key)):
        dtype = states.schema[name]
        there = dtype.categories.to_list() if isinstance(dtype, pl.Enum) else []
        if asked is not None and asked not in there:
            raise NotFound(f"no {name} {asked!r} (there are: {', '.join(there)})", where=f"--{name}",
                           next_step="Name one of these, or leave it out")
        states = states if asked is None else states.filter(pl.col(name) == asked)
    states = states if state is None else states.filter(pl.col("state") == state)
    if unsure:
        states = states.filter(pl.col("verdict").is_in(["few", "close"]))
    states = states.sort("visits", "role", "key", "state", descending=[True, False, False, False])
    if json:
        print_json(states.to_dicts())
        return
    console().print(f"policy version {policy.version} (few: too few episodes; close: too close to tell; "
                    "alone: one behaviour)", soft_wrap=True)
    beside = " These states decide nothing; see `pitchlore scout`." if policy.looks else ""
    console().print(f"{policy.plays}{beside}", soft_wrap=True)
    print_lack(policy)
    print_known(policy)
    counts = states.group_by("key", "role", "verdict").agg(states=pl.len(), visits=pl.col("visits").sum())
    print_frame(counts.sort("key", "role", "verdict"))
    for row in states.head(max(most, 0)).iter_rows(named=True):
        rival = "" if row["second"] is None else (
            f"; next: {in_words(row['second'])} (episodes: {row['second_episodes']})")
        console().print()
        console().print(
            f"{row['role']}, key {row['key']}, state {row['state']}: {row['verdict']}"
            f" (visits: {row['visits']}). Best: {in_words(row['best'])}"
            f" (episodes: {row['best_episodes']}){rival}", soft_wrap=True)
        console().print(f"  {'; '.join(row['elements']) or 'any state'}", soft_wrap=True)
