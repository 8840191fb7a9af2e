"""Addresses of moments: where in which replay."""

from __future__ import annotations


def moment(
    match: str, at: float, team: str = "", robot: int | None = None, behaviour: str = "", *,
    up: str = "../", of: str | None = None, ours: str = "",
) -> str:
    """The address of a moment in the replay of a match.

    Args:
        match: id of the match.
        at: when, seconds since the first sample.
        team: home or away, the side of the robot.
        robot: robot to watch; nobody if it is None or negative.
        behaviour: a behaviour's id or a code, which the replay looks for.
        up: leads from the page to the scout's folder.
        ours: side of the team that the page is of; the replay draws it blue. Empty: home is blue.
        of: id of the match whose replay the page's addresses begin at; its moments need no file.
    """
    file = "" if match == of else f"{up}replays/{match}.html"
    watched = "" if robot is None or robot < 0 else f"&robot={team}-{robot}"
    turned = "&ours=away" if ours == "away" else ""
    return f"{file}#t={at}{watched}{f'&behaviour={behaviour}' if behaviour else ''}{turned}"
