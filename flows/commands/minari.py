"""The command minari: decisions of matches as a Minari dataset."""

from __future__ import annotations

from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.printing import console, print_json


def minari(dataset: str, *matches: str, json: Json = False, common: Common = DEFAULTS) -> None:
    """Write the decisions of matches as a Minari dataset, where Minari keeps its own.

    That is the folder that MINARI_DATASETS_PATH names, else ~/.minari/datasets.

    Args:
        dataset: Id of the dataset: NAME-v0 or NAMESPACE/NAME-v0.
        matches: Ids of matches, or their beginnings (default: all matches that have decisions).
        json: Print JSON.
        common: Options of every command.
    """
    written = common.league.minari(dataset, *matches)
    if json:
        print_json({"dataset": dataset, "path": written.path, "episodes": written.episodes,
                    "steps": written.steps, "behaviours": len(written.behaviours),
                    "matches": list(written.matches)})
    else:
        console().print(
            f"{written.path}: {written.steps} decisions in {written.episodes} episodes of "
            f"{len(written.matches)} matches. Load it with `minari.load_dataset(\"{dataset}\")`.",
            soft_wrap=True)
