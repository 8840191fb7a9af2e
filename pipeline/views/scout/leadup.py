"""Play before a goal: where the ball was lost or play began, by whom, and how long before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.views.commentary.goals import HELD_S, roles_at_goals
from pitchlore.pipeline.views.commentary.words import restart_word, robot
from pitchlore.pipeline.views.scout.zones import third

#: Thirds of the pitch in words, in the order of THIRDS.
_PLACES = ("its own third", "the middle third", "its attacking third")


class LeadUp(NamedTuple):
    """Play before a goal.

    Attributes:
        says: it in a sentence; empty where nobody is known to have had the ball.
        lost_by: number of the conceding team's robot that lost the ball last; None if it did not lose it.
        third: index into THIRDS of where, as the conceding team sees it; None likewise.
        since_s: seconds from then to the goal; None likewise.
    """

    says: str = ""
    lost_by: int | None = None
    third: int | None = None
    since_s: float | None = None


def lead_ups(
    goals: pl.DataFrame, possession: pl.DataFrame, referee: pl.DataFrame, trajectories: pl.DataFrame,
    names: Mapping[str, str], length: float,
) -> list[LeadUp]:
    """Play before each goal of a match, in order of time; goals of nobody known are left out.

    A sentence begins with the last time that the conceding team held the ball in that stretch of play, and
    how it ended; where it never held it, with the restart. Who touches the ball last is the commentary's.

    Args:
        goals: rows of schema Goals.
        possession: rows of schema Possession.
        referee: rows of schema Referee.
        trajectories: rows of schema Trajectories.
        names: name of each side.
        length: length of the pitch, m.
    """
    rows = possession.sort("start_ns").with_columns(
        pl.col("team", "ended").cast(pl.String), at=third("end_x", pl.lit(length))).to_dicts()
    then = roles_at_goals(goals, trajectories)
    begun = [row for row in referee.sort("t_ns").iter_rows(named=True)
             if row["event"] in ("kick-off", "fault")]
    return [_lead_up(str(team), t_ns, rows, begun, names, then)
            for team, t_ns in goals.drop_nulls("team").sort("t_ns").select("team", "t_ns").iter_rows()]


def _lead_up(
    team: str, t_ns: int, held: Sequence[dict[str, Any]], begun: Sequence[dict[str, Any]],
    names: Mapping[str, str], roles: Mapping[tuple[int, str, int], str | None],
) -> LeadUp:
    def named(side: str, number: int) -> str:
        return robot(names[side], number, roles.get((t_ns, side, number)))

    seen = [row for row in held if row["start_ns"] < t_ns]
    own = [row for row in seen if row["segment"] == seen[-1]["segment"]]
    if not own:
        return LeadUp()
    at, lost = next(((at, row) for at, row in reversed([*enumerate(own)]) if row["team"] != team
                     and row["end_ns"] - row["start_ns"] >= HELD_S * 1e9), (-1, None))
    since = own[at + 1:]
    winner = next((row for row in since if row["team"] == team), None)
    parts = []
    if lost is not None:
        loser = named(lost["team"], lost["last_robot"])
        place = f"in {_PLACES[lost['at']]} {_ago(lost['end_ns'], t_ns)}"
        if winner is None:
            holder = loser if lost["robot"] == lost["last_robot"] else names[lost["team"]]
            return LeadUp(f"{holder} had the ball for {(lost['end_ns'] - lost['start_ns']) / 1e9:.1f} s in"
                          f" {_PLACES[lost['at']]}.")
        parts.append({"shot": f"{loser} shot, without a goal, {_ago(lost['end_ns'], t_ns)}",
                      "contested": f"{loser} lost a duel {place}"}.get(
                          lost["ended"], f"{loser} lost the ball {place}"))
        parts.append(f"{named(team, winner['robot'])} got it")
    else:
        first = named(own[0]["team"], own[0]["robot"])
        parts = [_began(own[0]["start_ns"], t_ns, begun, names),
                 f"{first} got the ball {_ago(own[0]['start_ns'], t_ns)}"]
    if passes := sum(row["passes"] for row in since if row["team"] == team):
        parts.append("it passed once" if passes == 1 else f"it passed {passes} times")
    says = f"{'; '.join(parts)}."
    if lost is None or lost["ended"] == "shot":
        return LeadUp(says)
    return LeadUp(says, lost["last_robot"], lost["at"], (t_ns - lost["end_ns"]) / 1e9)


def _ago(then_ns: int, t_ns: int) -> str:
    return f"{(t_ns - then_ns) / 1e9:.1f} s before"


def _began(
    start_ns: int, t_ns: int, begun: Sequence[dict[str, Any]], names: Mapping[str, str]
) -> str:
    """The last restart up to a moment, in words, and how long before the goal it was."""
    given = [row for row in begun if row["t_ns"] <= start_ns]
    if not given:
        return "No restart is known before"
    row = given[-1]
    what = "kick-off" if row["event"] == "kick-off" else restart_word(row["note"] or "restart")
    of = f" of {names[row['team']]}" if row["team"] else ""
    return f"{what[:1].upper()}{what[1:]}{of} {_ago(row['t_ns'], t_ns)}"
