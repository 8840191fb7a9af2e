"""Flow of the noun knowledge: one immutable version for all that is known now."""

from pathlib import Path

import polars as pl
from prefect.artifacts import create_markdown_artifact

from flows.catalog import refresh
from flows.stage import Scope, data_folder, need, our_flow, run_one, scope_of, stage_task
from pipeline.errors import NotFound
from pipeline.knowledge import behaviours, occasions
from pipeline.receipts import Manifest, key_of
from pipeline.settings import KnowledgeSettings, Settings
from pipeline.store import Store
from schemas import ROLES, Behaviours, Decisions, Occasions, Patterns


def emit(store: Store, settings: KnowledgeSettings, scope: Scope) -> tuple[Manifest, bool]:
    """Emit the next version, unless the newest one was made from the same; and whether it is new.

    Raises:
        NotFound: if there is no match to know anything from.
    """
    if not scope.matches:
        raise NotFound("there is no match to know anything from", where=str(store.root),
                       next_step="Import recordings and run the stages first")
    rounds = [need(store, "behaviours", f"n{n}") for n in scope.lengths]
    seen = [need(store, "decisions", match) for match in scope.matches]
    inputs: dict[str, str] = {}
    for receipt in (*rounds, *seen):
        inputs |= receipt.digests()
    dumped = settings.model_dump(mode="json")
    key = key_of("knowledge", "knowledge", inputs=inputs, settings=dumped, tables=(Behaviours, Occasions))
    newest = store.latest("knowledge")
    if newest is not None and newest.key == key:
        return newest, False
    with store.claim("knowledge") as version:
        patterns = (store.read_table(receipt, "patterns", Patterns) for receipt in rounds)
        known = behaviours(patterns, version)
        occurred = occasions((store.read_table(r, "decisions", Decisions) for r in seen), version, settings)
        parent = store.latest("knowledge")
        manifest = store.commit_version(
            "knowledge", version, parent=parent.version if parent else None, key=key, inputs=inputs,
            settings=dumped, seed=rounds[0].settings["seed"],
            tables={"behaviours": (known, Behaviours), "occasions": (occurred, Occasions)},
            blobs={f"map-{receipt.name}": ("npz", store.read(receipt, "map"))
                   for receipt in rounds if "map" in receipt.files},
            counts=_counts(known, occurred, matches=len(seen)),
        )
        return manifest, True


def _counts(known: pl.DataFrame, occurred: pl.DataFrame, *, matches: int) -> dict[str, object]:
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
