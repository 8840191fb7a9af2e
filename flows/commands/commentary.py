"""The command commentary: tell a match in words."""

from __future__ import annotations

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json
from pitchlore.flows.commands.match_id import chain_of
from pitchlore.flows.commands.printing import console, print_json
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.commentary import Commentary
from pitchlore.pipeline.views.commentary import commentary as tell
from pitchlore.pipeline.views.commentary.summary import heading, numbers
from pitchlore.schemas import Goals, Matches, Passes, Possession, Referee, Shots, Situations, Trajectories


def commentary(
    match: str, *, goals: Flag = False, json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Tell a match in words: goals and how they came about, chances, restarts, possession, numbers.

    Args:
        match: Id of the match, or its beginning.
        goals: Tell only the goals.
        json: Print what is told and the summary as JSON.
        common: Options of every command.
    """
    told = told_of(common.existing, match)
    moments = [moment for moment in told.moments if moment.kind == "goal" or not goals]
    if json:
        print_json({"moments": [moment.facts() for moment in moments],
                    "summary": told.summary.model_dump(mode="json")})
        return
    out = console()
    for line in heading(told.summary):
        out.print(line, style="bold", soft_wrap=True)
    for moment in moments:
        style = "bold" if moment.kind == "goal" else None
        out.print(moment.line(), style=style, highlight=False, soft_wrap=True)
    out.print()
    for line in numbers(told.summary):
        out.print(line, highlight=False, soft_wrap=True)


def told_of(store: Store, match: str) -> Commentary:
    """The commentary of the match with this id or beginning of an id.

    Raises:
        NotFound: if the id fits no match or several, or if the match's stages have not run.
    """
    log, made = chain_of(store, match, "trajectories", "situations", "goals", "events")
    return tell(
        store.read_table(log, "matches", Matches),
        store.read_table(log, "referee", Referee),
        store.read_table(made["goals"], "goals", Goals),
        store.read_table(made["situations"], "situations", Situations),
        store.read_table(made["trajectories"], "trajectories", Trajectories),
        store.read_table(made["events"], "possession", Possession),
        store.read_table(made["events"], "passes", Passes),
        store.read_table(made["events"], "shots", Shots),
        Pitch.model_validate(log.details["pitch"]),
    )
