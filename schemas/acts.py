"""Acts of a match with what followed, and what each team's acts went with."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit

#: What a robot does with the ball or against the one that has it.
ACTS = (
    "loses the ball", "wins the ball", "passes forward", "passes sideways", "passes back", "presses", "shoots",
)
#: Where it does so, as its team sees the pitch: thirds along it, and in each the middle half and the rest.
PLACES = (
    "in front of its own goal", "in its own corner", "in midfield", "on the wing", "in front of their goal",
    "in their corner",
)
#: Least number of acts of which anything is said.
LEAST = 5


class Acts(Table):
    """One act of a robot, and how V and the score went on. Sorted by t_ns, team, robot, act.

    Acts are the rows of possession (lost and won), passes, pressure and shots, seen as football's event data
    see them. V here is the chance of the robot's team to score soon less that of the adversary (table values).
    What follows an act is measured as by VAEP (Decroos and others, KDD 2019): V some seconds later less V just
    before.
    """

    NAME: ClassVar[str] = "acts"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="number of the robot")
    role = dy.Enum(ROLES, nullable=True, description="its role then; null where it is not seen")
    t_ns = dy.Int64(description="time of the act", metadata=unit("ns"))
    act = dy.Enum(ACTS, description="what it does")
    place = dy.Enum(PLACES, description=(
        "where the ball is: own third, middle third or adversary's third of the length; corner and wing are more "
        "than a quarter of the width from the middle"
    ))
    before = dy.Float64(nullable=True, min=-1, max=1, description="V before_s earlier (settings); null where V is not known")
    after = dy.Float64(nullable=True, min=-1, max=1, description=(
        "V after_s later; 1 or -1 if a goal falls until then, and the last V if play stops"
    ))
    usual = dy.Float64(nullable=True, min=-2, max=2, description=(
        "the mean change of V, in the same way, from all moments of the match with the ball in that place"
    ))
    goal = dy.Enum(("for", "against"), nullable=True, description=(
        "the first goal within soon_s after it, if there is one: for the robot's team or against it"
    ))
    goal_ns = dy.Int64(nullable=True, description="time of that goal", metadata=unit("ns"))


class Answers(Table):
    """Acts of a team in a place, and what they went with, over all its matches.

    It is made of acts and sides when it is asked for. Sums are of decimals: they do not depend on the order of
    files. That an act went with winning does not say that more of it would win.
    """

    NAME: ClassVar[str] = "answers"
    VERSION: ClassVar[int] = 1
    LOOKS_INTO: ClassVar[tuple[str, ...]] = ("acts", "sides")
    VIEW: ClassVar[str] = f"""
        with each as (
          select s.team, s.kind, a.role, a.act, a.place, a.goal, a.match_id || a.goal_ns as goal_id,
            (a."after" - a."before" - a.usual)::decimal(12, 9) as worth
          from acts a join sides s on s.match_id = a.match_id and s.side = a.team where a.role is not null
        ), each_team as (select team, kind, count(distinct match_id) as played from sides group by all
        ), summed as (
          select team, kind, role, act, place, count(*) as n,
            count(worth) as known, sum(worth)::double as total, sum(worth * worth)::double as squares,
            count(distinct goal_id) filter (goal = 'for') as goals_for,
            count(distinct goal_id) filter (goal = 'against') as goals_against
          from each group by all
        ), meant as (
          select *, case when known > 0 then total / known end as "value",
            case when known > 1 then 1.96 * sqrt(greatest(squares - total * total / known, 0) / (known - 1) / known) end as half
          from summed
        )
        select team, kind, role, act, place, n, played, n / played as each_match, "value",
          "value" - half as low, "value" + half as high, n * "value" / played as effect, goals_for, goals_against,
          case when n < {LEAST} or "value" is null or half is null then 'too few'
            when abs("value") > 1.68 * half then 'sure' when abs("value") > half then 'likely' else 'too few' end as says
        from meant join each_team using (team, kind) order by team, kind, effect desc, role, act, place"""  # noqa: S608 (of constants)

    team = dy.String(description="name of the team")
    kind = dy.String(description="its league")
    role = dy.String(description="role of the robots")
    act = dy.String(description="what they do (table acts)")
    place = dy.String(description="where (table acts)")
    n = dy.Int64(description="number of these acts")
    played = dy.Int64(description="number of the team's matches")
    each_match = dy.Float64(description="these acts a match")
    value = dy.Float64(nullable=True, description="mean of after - before - usual over these acts")
    low = dy.Float64(nullable=True, description="low end of its 95 % interval, as if acts were independent; null below two")
    high = dy.Float64(nullable=True, description="high end")
    effect = dy.Float64(nullable=True, description="value times acts a match: by it the most weighty come first and last")
    goals_for = dy.Int64(description="goals of the team that were the next after such an act, within soon_s")
    goals_against = dy.Int64(description="goals of the adversary that were")
    says = dy.String(description=(
        f"sure: the 99.9 % interval leaves out 0, so that of a hundred such rows that mean nothing one in ten "
        f"tables has one; likely: the 95 % interval does; too few: neither, or fewer than {LEAST} acts"
    ))
