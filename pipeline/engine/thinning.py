"""Thinning: which old versions of the knowledge and of policies may go, because nothing names them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from pitchlore.pipeline.base.errors import CorruptFile
from pitchlore.pipeline.engine.knowledge import lineage
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.store.thinning import remove_versions

#: How recipes name a policy (:func:`pipeline.engine.teams.label`).
_LABEL = re.compile(r"v(\d+) [0-9a-f]{64}")
#: Nouns whose outputs name versions in their settings: recipes of matches, and teams that were measured.
_NAMING = ("matches", "evaluations")


def thin(store: Store, newest: int, one_in: int | None = None) -> dict[str, list[int]]:
    """Remove old versions of the knowledge and of policies. Returns the removed numbers, by noun.

    These are kept:

    - the newest of each noun, and of the older ones those whose number is a multiple of ``one_in``;
    - the newest policy of each team that policies imitate;
    - policies that a match was played with, or that were measured, and knowledge that was measured with them;
    - the policies that a kept one goes on from, and the knowledge that each kept policy was trained on;
    - the knowledge that the newest follows, and all that a kept version adds to, if versions accumulate.

    Versions of seasons and of imitations stay: each season names its own.

    Args:
        store: the data folder.
        newest: number of the newest versions to keep, at least 1.
        one_in: keep one in so many of the older ones, too; None: none.

    Raises:
        CorruptFile: if a manifest or a receipt that may name versions is damaged; nothing is removed then.
        StorageFailed: if the disk refuses, or the bucket cannot be reached.
    """
    with store.locked("knowledge"), store.locked("policies"), store.removing():
        store.catch_up()
        knowledge, policies = (_whole(store, noun) for noun in ("knowledge", "policies"))
        named = {"knowledge": _spared(knowledge, newest, one_in),
                 "policies": _spared(policies, newest, one_in)}
        for noun in _NAMING:
            for _, receipt in store.tried(noun):
                if isinstance(receipt, CorruptFile):
                    raise receipt
                for of, version in _named(receipt.settings):
                    named[of].add(version)
        newest_of = {repr(policy.details.get("imitates")): number for number, policy in policies.items()}
        kept = _with_ancestors(policies, named["policies"] | {*newest_of.values()})
        known = named["knowledge"] | {policies[number].details["knowledge_version"] for number in kept}
        known |= {version.version for number in known & knowledge.keys()
                  for version in lineage(store, knowledge[number])}
        gone = {"knowledge": sorted(knowledge.keys() - known), "policies": sorted(policies.keys() - kept)}
        for noun in ("policies", "knowledge"):  # a policy never stands without its knowledge
            remove_versions(store, noun, gone[noun])
    return gone


def _whole(store: Store, noun: str) -> dict[int, Manifest]:
    """The manifests of a noun, by number, ascending."""
    found = dict[int, Manifest]()
    for number, manifest in store.tried_versions(noun):
        if isinstance(manifest, CorruptFile):
            raise manifest
        found[number] = manifest
    return found


def _spared(versions: Mapping[int, Manifest], newest: int, one_in: int | None) -> set[int]:
    """The numbers that are kept by their place alone, and the one that the newest follows."""
    numbers = list(versions)
    kept = {*numbers[-newest:], *(number for number in numbers if one_in and number % one_in == 0)}
    parent = versions[numbers[-1]].parent if numbers else None
    return kept if parent is None else kept | {parent}


def _with_ancestors(policies: Mapping[int, Manifest], named: set[int]) -> set[int]:
    """Policies with those that they go on from."""
    kept = set[int]()
    for number in named & policies.keys():
        following: int | None = number
        while following is not None and following in policies and following not in kept:
            kept.add(following)
            following = policies[following].parent
    return kept


def _named(settings: Any) -> Iterator[tuple[str, int]]:
    """Nouns and numbers of the versions that the settings of an output name, at any depth."""
    if isinstance(settings, Mapping):
        for name, value in settings.items():
            if name == "policy" and isinstance(value, str) and (label := _LABEL.fullmatch(value)):
                yield "policies", int(label[1])
            elif name in ("policy_version", "knowledge_version") and isinstance(value, int):
                yield ("policies" if name == "policy_version" else "knowledge"), value
            else:
                yield from _named(value)
    elif isinstance(settings, (list, tuple)):
        for each in settings:
            yield from _named(each)
