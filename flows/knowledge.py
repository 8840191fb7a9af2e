"""Flow of the noun knowledge: one immutable version for all that is known now."""

from collections.abc import Mapping
from pathlib import Path

import polars as pl
from prefect.artifacts import create_markdown_artifact

from flows.catalog import refresh
from flows.lineage import lineage, matches_of
from flows.stage import Scope, data_folder, need, our_flow, run_one, scope_of, stage_task
from pipeline.errors import BadSettings, NotFound
from pipeline.knowledge import behaviours, finest, merge_behaviours, merge_occasions, occasions
from pipeline.settings import KnowledgeSettings, Settings
from pipeline.store import Store
from pipeline.store.receipts import Manifest, key_of
from schemas import ROLES, Behaviours, Decisions, Occasions, Patterns

#: What labels of a parent's tables begin with, among the inputs of a version that accumulates.
_PARENT = "parent/"


def emit(store: Store, settings: KnowledgeSettings, scope: Scope) -> tuple[Manifest, bool]:
    """Emit the next version, unless one stands that was made from the same; and whether it is new.

    A version that accumulates is made from the one before, too: its key is over that one's tables, and
    work that was added once, by whatever version, is not added again. The noun is locked meanwhile, for
    nothing may come between a version and its parent.

    Raises:
        NotFound: if there is no match to know anything from.
        BadSettings: if a match would be added that an earlier version holds, made from other files or
            by other settings.
    """
    if not scope.matches:
        raise NotFound("there is no match to know anything from", where=str(store.root),
                       next_step="Import recordings and run the stages first")
    rounds = [need(store, "behaviours", scope.round(n)) for n in scope.lengths]
    seen = [need(store, "decisions", match) for match in scope.matches]
    inputs: dict[str, str] = {}
    for receipt in (*rounds, *seen):
        inputs |= receipt.digests()
    with store.locked("knowledge"):
        standing = _standing(store, inputs, settings)
        if standing is not None:
            return standing, False
        parent = store.latest("knowledge")
        before = parent if settings.accumulate else None
        held = {match for version in lineage(store, before) for match in matches_of(version)}
        _refuse_twice(store, before, held.intersection(scope.matches))
        inputs |= _of_parent(before)
        with store.claim("knowledge") as version:
            known = behaviours((store.read_table(r, "patterns", Patterns) for r in rounds), version)
            if before is not None:
                earlier = store.read_version_table(before, "behaviours", Behaviours)
                known = merge_behaviours([earlier, known], version)
            occurred = occasions((store.read_table(r, "decisions", Decisions) for r in seen), version,
                                 settings, known["behaviour_id"])
            if before is not None:
                earlier = store.read_version_table(before, "occasions", Occasions)
                occurred = merge_occasions([earlier, occurred], version, settings)
            manifest = store.commit_version(
                "knowledge", version, parent=parent.version if parent else None,
                key=_key(inputs, settings), inputs=inputs,
                settings=settings.model_dump(mode="json"), seed=rounds[0].settings["seed"],
                tables={"behaviours": (known, Behaviours), "occasions": (occurred, Occasions)},
                blobs={f"map-n{n}": ("npz", store.read(receipt, "map"))
                       for n, receipt in zip(scope.lengths, rounds, strict=True) if "map" in receipt.files},
                counts=_counts(known, occurred, matches=len(held) + len(seen)),
            )
            return manifest, True


def _key(inputs: Mapping[str, str], settings: KnowledgeSettings) -> str:
    return key_of("knowledge", "knowledge", inputs=inputs, settings=settings.model_dump(mode="json"),
                  tables=(Behaviours, Occasions))


def _of_parent(before: Manifest | None) -> dict[str, str]:
    """The tables of the version before among the inputs of one that accumulates."""
    if before is None:
        return {}
    return {f"{_PARENT}{role}": before.files[role].sha256 for role in ("behaviours", "occasions")}


def _standing(store: Store, inputs: dict[str, str], settings: KnowledgeSettings) -> Manifest | None:
    """The version that need not be made again: the newest; if versions accumulate, any of them."""
    if not settings.accumulate:
        newest = store.latest("knowledge")
        return newest if newest is not None and newest.key == _key(inputs, settings) else None
    for manifest in reversed(store.manifests("knowledge")):
        parent = {label: sha for label, sha in manifest.inputs.items() if label.startswith(_PARENT)}
        if manifest.key == _key(inputs | parent, settings):
            return manifest
    return None


def _refuse_twice(store: Store, before: Manifest | None, twice: set[str]) -> None:
    if before is not None and twice:
        raise BadSettings(
            f"knowledge version {before.version} holds {min(twice)} already, made from other files, by "
            "other code or by other settings, and would count it twice", where=str(store.root),
            next_step="Begin again in another data folder, or say accumulate = false",
        )


def _counts(known: pl.DataFrame, occurred: pl.DataFrame, *, matches: int) -> dict[str, object]:
    """What a person wants to know at a glance; states and occasions are those of the state key."""
    occurred = finest(occurred)
    roles = {
        role: {
            "behaviours": known.filter(pl.col("role") == role).height,
            "states": occurred.filter(pl.col("role") == role)["state"].n_unique(),
            "occasions": occurred.filter(pl.col("role") == role).height,
        }
        for role in ROLES
    }
    return {"matches": matches, "behaviours": known.height, "occasions": occurred.height, "roles": roles}


def describe(manifest: Manifest, known: pl.DataFrame) -> str:
    """A version of the knowledge as Markdown: counts and its best and worst behaviours."""
    lines = [f"# Knowledge version {manifest.version}", "", "| role | behaviours | states | occasions |",
             "|---|---|---|---|"]
    lines += [f"| {role} | {c['behaviours']} | {c['states']} | {c['occasions']} |"
              for role, c in manifest.counts["roles"].items()]
    lines += ["", "| behaviour | support | value | spread |", "|---|---|---|---|"]
    lines += [f"| {b['behaviour_id']} | {b['support']} | {b['value']:+.3f} | {b['spread']:.3f} |"
              for b in known.sort("value", descending=True).head(30).iter_rows(named=True)]
    return "\n".join(lines)


@stage_task(name="knowledge")
def make_knowledge(data: Path, name: str, settings: KnowledgeSettings, scope: Scope) -> tuple[int, bool]:
    """Emit knowledge; the version that stands now, and whether it is new."""
    manifest, new = emit(Store(data), settings, scope)
    return manifest.version, new


def publish(store: Store, version: int) -> None:
    """Show a version as an artifact of the flow run."""
    manifest = store.manifest("knowledge", version)
    known = store.read_version_table(manifest, "behaviours", Behaviours)
    create_markdown_artifact(describe(manifest, known), key="knowledge", description="the newest knowledge")


@our_flow(name="knowledge")
def knowledge_flow(data: Path, settings: Settings = Settings()) -> dict[str, object]:
    """Emit a version of the knowledge if there is anything new to know."""
    store = data_folder(data)
    scope = scope_of(store, settings)
    version, new = run_one(
        make_knowledge, "knowledge", store.root, "knowledge", settings.knowledge, scope)
    refresh(store)
    publish(store, version)
    return {"version": version, "new": new}
