"""Flow of the noun policies: batch Sarsa(lambda) from one policy version to the next."""

from dataclasses import asdict
from pathlib import Path

from prefect.artifacts import create_markdown_artifact

from flows.catalog import refresh
from flows.lineage import lineage, matches_of
from flows.stage import data_folder, need, our_flow, run_one, stage_task
from pipeline.errors import NotFound
from pipeline.policies.train import train
from pipeline.settings import PolicySettings, Settings
from pipeline.store import Store
from pipeline.store.receipts import Manifest, Receipt, key_of
from schemas import Decisions, Occasions, Policies


def batch(store: Store, knowledge: Manifest, last_matches: int | None = None) -> list[Receipt]:
    """The receipts of the decisions that a version of the knowledge was made from, oldest first.

    A version that accumulates names only what it added to its parent: its matches are newer than
    the parent's. Those of one version are as old as the order of their ids says.

    Args:
        store: where the versions and the decisions are.
        knowledge: the version.
        last_matches: only so many of the newest; None: all.

    Raises:
        NotFound: if they have been made anew since (then the knowledge is out of date), or a
            version that the knowledge builds on is gone.
    """
    newest_first: dict[str, Receipt] = {}
    for version in lineage(store, knowledge):
        for match in reversed(matches_of(version)):
            if len(newest_first) == last_matches:
                return list(newest_first.values())[::-1]
            if match not in newest_first:
                newest_first[match] = _held(store, version, match)
    return list(newest_first.values())[::-1]


def _held(store: Store, knowledge: Manifest, match: str) -> Receipt:
    """The receipt of a match's decisions, if they are those that the knowledge was made from."""
    receipt = need(store, "decisions", match)
    if any(knowledge.inputs.get(label) != sha for label, sha in receipt.digests().items()):
        raise NotFound(f"the decisions of {match} are newer than knowledge {knowledge.version}",
                       where=str(store.root), next_step="Run `pitchlore run` to emit knowledge first")
    return receipt


def learn(store: Store, settings: PolicySettings) -> tuple[Manifest, bool]:
    """Train the next policy on the newest knowledge, unless that has been done; and whether it is new.

    Raises:
        NotFound: if there is no knowledge yet.
    """
    knowledge = store.latest("knowledge")
    if knowledge is None:
        raise NotFound("there is no knowledge to train on", where=str(store.root),
                       next_step="Import recordings and run `pitchlore run` first")
    receipts = batch(store, knowledge, settings.last_matches)
    inputs = {f"knowledge/{role}": record.sha256 for role, record in sorted(knowledge.files.items())}
    for receipt in receipts:
        inputs |= receipt.digests()
    dumped = settings.model_dump(mode="json")
    key = key_of("policies", "policy", inputs=inputs, settings=dumped, tables=(Policies,))
    newest = store.latest("policies")
    if newest is not None and newest.key == key:
        return newest, False
    with store.claim("policies") as version:
        parent = store.latest("policies") if settings.parent else None
        policy, report = train(
            (store.read_table(receipt, "decisions", Decisions) for receipt in receipts),
            store.read_version_table(knowledge, "occasions", Occasions),
            store.read_version_table(parent, "policies", Policies) if parent else None,
            settings, version, knowledge.version,
        )
        if parent is not None:
            inputs["parent"] = parent.files["policies"].sha256
        manifest = store.commit_version(
            "policies", version, parent=parent.version if parent else None, key=key, inputs=inputs,
            settings=dumped, tables={"policies": (policy, Policies)},
            counts={"knowledge_version": knowledge.version, **asdict(report)},
        )
        return manifest, True


@stage_task(name="train")
def make_policy(data: Path, name: str, settings: PolicySettings) -> tuple[int, bool]:
    """Train; the policy version that stands now, and whether it is new."""
    manifest, new = learn(Store(data), settings)
    return manifest.version, new


def publish(store: Store, version: int) -> None:
    """Show a version's training as an artifact of the flow run."""
    counts = store.manifest("policies", version).counts
    lines = [f"# Policy version {version} on knowledge version {counts['knowledge_version']}", "",
             "| key | role | pairs | new | decisions | transitions | mean error, first and last sweep |",
             "|---|---|---|---|---|---|---|"]
    lines += [f"| {key} | {role} | {c['pairs']} | {c['new_pairs']} | {c['decisions']} | {c['transitions']} "
              f"| {c['first_error']} {c['last_error']} |"
              for key, roles in counts["tables"].items() for role, c in roles.items()]
    create_markdown_artifact("\n".join(lines), key="policy", description="the newest policy")


@our_flow(name="policies")
def policies_flow(data: Path, settings: Settings = Settings()) -> dict[str, object]:
    """Train the next policy if the knowledge or the settings are new."""
    store = data_folder(data)
    version, new = run_one(make_policy, "policies", store.root, "policy", settings.policies)
    refresh(store)
    publish(store, version)
    return {"version": version, "new": new}
