"""The command scout: pages about the league, its matches, teams and behaviours."""

from __future__ import annotations

import webbrowser
from typing import Annotated

from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, On, UserPath
from pitchlore.flows.commands.printing import console
from pitchlore.flows.commands.waiting import bars


def scout(
    *names: str, output: Annotated[UserPath | None, Parameter(name=("--out", "-o"))] = None,
    mine: str = "",
    show: Annotated[Flag, Parameter(name="--open")] = False, on: On = None, common: Common = DEFAULTS,
) -> None:
    """Write pages about the league, its matches, teams and behaviours, with clips; they open from disk.

    Pages that stand are kept.

    Args:
        names: Teams or matches (ids, or their beginnings) that the pages are of (default: all).
        output: Folder to write into (default: scout in the data folder, or scout-… for the named ones).
        mine: Team that the first page tells of (default: both teams of the newest match).
        show: Open the first page in the browser.
        on: Where pages are made.
        common: Options of every command.
    """
    league = common.league
    with bars():
        found = league.scout(*names, folder=output, mine=mine, on=on)
    console().print(f"{found.first}: {found.new} pages written, {found.kept} kept, {found.size / 1e6:.1f} MB",
                    soft_wrap=True)
    if show:
        webbrowser.open(found.first.resolve().as_uri())
