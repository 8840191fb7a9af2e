"""The command train: the next policy version."""

from __future__ import annotations

from pitchlore.flows.commands.common import DEFAULTS, Common, Json, RunFile
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.printing import console, print_json, print_training
from pitchlore.pipeline.engine.catalog import renew
from pitchlore.pipeline.engine.run import VersionReport, train_policy


def train(*, settings: RunFile = None, json: Json = False, common: Common = DEFAULTS) -> None:
    """Train the next policy version on the newest knowledge.

    Args:
        settings: Named settings or a TOML file.
        json: Print the report as JSON.
        common: Options of every command.
    """
    store, chosen = common.store, common.settings(settings)
    done = perform(store, "training_flow", VersionReport, train_policy)(
        store.root, chosen, history=chosen.history)
    if json:
        print_json(done.model_dump())
    elif done.new:
        console().print(f"policy version {done.version} trained")
        print_training(store)
    else:
        console().print(f"nothing to learn that policy version {done.version} has not learned")
    renew(store)
