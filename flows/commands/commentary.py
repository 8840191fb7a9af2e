"""The command commentary: tell a match in words."""

from __future__ import annotations

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json
from pitchlore.flows.commands.printing import console, print_json


def commentary(
    match: str, *, goals: Flag = False, json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Tell a match in words: goals and how they came about, chances, restarts, possession, numbers.

    Args:
        match: Id of the match, or its beginning.
        goals: Tell only the goals.
        json: Print what is reported and the summary as JSON.
        common: Options of every command.
    """
    reported = common.league.match(match).commentary()
    moments = [moment for moment in reported.moments if moment.kind == "goal" or not goals]
    if json:
        print_json({"moments": [moment.facts() for moment in moments],
                    "summary": reported.summary.model_dump(mode="json")})
        return
    out = console()
    for line in reported.heading():
        out.print(line, style="bold", soft_wrap=True)
    for moment in moments:
        style = "bold" if moment.kind == "goal" else None
        out.print(moment.line(), style=style, highlight=False, soft_wrap=True)
    out.print()
    for line in reported.numbers():
        out.print(line, highlight=False, soft_wrap=True)
