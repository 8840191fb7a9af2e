"""Teams by the words that people name them with, and the policies that learned ones play."""

from __future__ import annotations

import polars as pl

from pipeline.errors import BadSettings, NotFound
from pipeline.evaluations import Entrant
from pipeline.play.minds import SCRIPTED
from pipeline.play.recipe import TeamSettings
from pipeline.receipts import Manifest
from pipeline.store import Store
from schemas import Policies


def entrant(
    store: Store, word: str, policies: dict[str, pl.DataFrame], *, explore: float = 0.0,
    caution: float = 0.0, trust: int = 0,
) -> Entrant:
    """The team that a word names; a policy that it plays is put into ``policies``.

    Args:
        store: where policies are.
        word: random, static or human-like; learned for the newest policy, learned:3 or just 3 for a
            version.
        policies: rows of schema Policies by label.
        explore: of a learned team, see ``TeamSettings``.
        caution: likewise.
        trust: likewise.

    Raises:
        BadSettings: if no team is called so.
        NotFound: if there is no such policy.
    """
    if word in SCRIPTED:
        return Entrant(name=word, settings=TeamSettings.model_validate({"kind": word}))
    version = word.removeprefix("learned:")
    if word != "learned" and not version.isdecimal():
        raise BadSettings(f"{word!r} is no team", next_step=(
            "Name random, static, human-like, learned or learned:VERSION"))
    manifest = policy(store, None if word == "learned" else int(version))
    label, rows = labelled(store, manifest)
    policies[label] = rows
    return Entrant(
        name=f"v{manifest.version}",
        settings=TeamSettings(kind="learned", policy=label, explore=explore, caution=caution, trust=trust),
        policy_version=manifest.version, knowledge_version=manifest.counts["knowledge_version"],
    )


def policy(store: Store, version: int | None = None) -> Manifest:
    """A version of the policy; the newest by default.

    Raises:
        NotFound: if there is none.
    """
    manifest = store.latest("policies") if version is None else store.manifest("policies", version)
    if manifest is None:
        raise NotFound("there is no policy to play", where=str(store.root),
                       next_step="Import or record matches, then `pitchlore run`")
    return manifest


def labelled(store: Store, manifest: Manifest) -> tuple[str, pl.DataFrame]:
    """A policy's label for recipes, and its rows."""
    label = f"v{manifest.version} {manifest.files['policies'].sha256}"
    return label, store.read_version_table(manifest, "policies", Policies)
