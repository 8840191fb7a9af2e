"""A team's card: what went with winning and with losing, and what changed, in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import BadQuery, CorruptFile, NotFound
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.base.text import did_you_mean, number_of
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.catalog import catalog_path, refresh
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.catalog import is_there
from pitchlore.pipeline.store.query import ask, ask_each
from pitchlore.pipeline.store.sealed import read_cache, sealed, stamp_of
from pitchlore.pipeline.views.few_goals import few_goals
from pitchlore.pipeline.views.scout.changes import Change, change_of_count
from pitchlore.pipeline.views.scout.words import TOO_FEW
from pitchlore.schemas.acts import LEAST

#: Sentences of each kind, by effect.
SENTENCES = 3
#: The lost ball that most goals against followed is told from so many goals, and such a share of all, on.
LOST_GOALS, LOST_SHARE = 3, 0.2
#: What tells a team's acts apart.
_KEY = ("role", "act", "place")
#: The act that goals against are looked for behind.
_LOST = "loses the ball"
#: The answer that was printed last, in a data folder.
NAME = ".answer.json"
#: Other teams that are named.
_NAMED = 6
#: Seconds that a clip shows before and after its act.
BEFORE_S, AFTER_S = 2.5, 3.0
_NEWEST = """
    select home, away, kind from matches where kind is not null
    order by started_at desc nulls last, match_id desc limit 1"""
_TEAMS = "select distinct team, kind from sides order by all"
#: The queries of cards, of the teams whose names are in a list; each has columns team and kind.
_ANSWERS = "from answers where team in (select unnest(?))"
_EACH = """
    select s.team, s.kind, m.match_id, m.duration_s, m.started_at, a.act, count(a.act) as n
    from matches m join sides s using (match_id)
    left join acts a on a.match_id = s.match_id and a.team = s.side
    where s.team in (select unnest(?)) group by all order by m.started_at nulls first, m.match_id"""
_GOALS = """
    select s.team, s.kind, count(*) filter (g.team = s.side) as scored,
      count(*) filter (g.team <> s.side) as conceded
    from goals g join sides s using (match_id) where s.team in (select unnest(?)) group by all"""
#: By role, act and place of a team, the act after which V fell most and that after which it rose most.
_SHOWN = """
    with each as (
      select s.team, s.kind, a.role, a.act, a.place, a.match_id, a.team as side, a.robot, a.t_ns,
        (a."after" - a."before" - a.usual)::decimal(12, 9) as worth
      from acts a join sides s on s.match_id = a.match_id and s.side = a.team
      where s.team in (select unnest(?))
    )
    select * from each where worth is not null
    qualify 1 in (
      row_number() over (partition by team, kind, role, act, place order by worth, match_id, t_ns),
      row_number() over (partition by team, kind, role, act, place order by worth desc, match_id, t_ns))
    order by worth"""


class Sentence(NamedTuple):
    """A sentence of what robots do, and what it went with.

    Attributes:
        says: the sentence.
        often: how often, in words.
        goals: goals that followed, in words; empty without any.
        sure: sure, likely or too few (schema Answers).
        effect: change of V a match that went with it.
        match, team, robot, start_s, end_s, at_s: a clip of it: the act after which V changed most, and when.
    """

    says: str
    often: str
    goals: str
    sure: str
    effect: float
    match: str
    team: str
    robot: int
    start_s: float
    end_s: float
    at_s: float


class Card(NamedTuple):
    """The first that a coach is told of a team.

    Attributes:
        team: its name.
        kind: its league.
        wins, loses: sentences of acts that went with winning and with losing, the most weighty first. The
            last of those that lose may be the lost ball that the most goals against followed.
        changed: sentences of acts that the newest match has more or less of than those before.
        few: sentence on the few goals that all this rests on; empty where they are enough.
        newest: id of the newest match.
    """

    team: str
    kind: str
    wins: list[Sentence]
    loses: list[Sentence]
    changed: list[str]
    few: str = ""
    newest: str = ""


class Answer(Frozen):
    """The end of a run: cards, and who else there is.

    Attributes:
        source: the software, the catalogue and the team that it was made from.
        cards: the cards.
        others: teams that no card tells of; the first few, and the number of the rest.
        new: whether it was made now.
    """

    source: str
    cards: list[Card]
    others: tuple[list[str], int]
    new: bool = False


def answer(store: Store, mine: str = "", *, refreshed: bool = False) -> Answer:
    """The end of a run; one that was made from the same catalogue is read from the data folder.

    Args:
        store: the data folder.
        mine: the team's name; empty: the teams of the newest match.
        refreshed: whether its catalogue has just been brought up to date.

    Raises:
        NotFound: if no team has that name.
    """
    path = catalog_path(store)
    if not (refreshed and is_there(path)):
        refresh(store)
    catalogue = stamp_of(str(path)) if path.exists() else "in memory"
    source = f"{RELEASE} {digest(Path(__file__).read_bytes())} {mine!r} {catalogue}"
    kept = read_cache(store.root / NAME, Answer)
    if kept is not None and kept.source == source and path.exists():
        return kept
    told, teams = _cards(store, path, mine)
    others = [team for team in dict.fromkeys(team for team, _ in teams)
              if team not in {card.team for card in told}]
    made = Answer(source=source, cards=told, others=(others[:_NAMED], len(others[_NAMED:])))
    if not store.closed:
        store.keep(store.root / NAME, sealed(made))
    return made.model_copy(update={"new": True})


def cards(store: Store, mine: str = "") -> list[Card]:
    """The cards of a team, or of both teams of the newest match.

    Args:
        store: the data folder; its catalogue is brought up to date.
        mine: the team's name; empty: the teams of the newest match.

    Raises:
        NotFound: if no team has that name.
    """
    catalogue, _ = refresh(store)
    return _cards(store, catalogue, mine)[0]


def cards_of(store: Store, names: Sequence[str]) -> dict[tuple[str, str], Card]:
    """The cards of all teams of some names, by name and league.

    Args:
        store: the data folder; its catalogue is brought up to date.
        names: the teams' names; one may be that of teams of several leagues.
    """
    catalogue, _ = refresh(store)
    teams = [(name, kind) for name, kind in ask(catalogue, _TEAMS).iter_rows() if name in names]
    return dict(zip(teams, _of_teams(store, catalogue, teams), strict=True))


def _cards(store: Store, catalogue: Path, mine: str) -> tuple[list[Card], list[tuple[str, str]]]:
    """The cards, and names and leagues of all teams, sorted."""
    try:
        return _told(store, catalogue, mine)
    except (BadQuery, CorruptFile):  # another command has taken a closed part apart meanwhile
        return _told(store, refresh(store)[0], mine)


def _told(store: Store, catalogue: Path, mine: str) -> tuple[list[Card], list[tuple[str, str]]]:
    newest, every = ask_each(catalogue, [_NEWEST, _TEAMS])
    known: list[tuple[str, str]] = every.rows()
    if mine:
        teams = [team for team in known if team[0] == mine]
        if not teams:
            names = list(dict.fromkeys(name for name, _ in known))
            there = did_you_mean(mine, names) or f" (there are: {', '.join(names[:8])})"
            raise NotFound(f"no team of the league has this name{there}", where=mine, next_step=(
                "`pitchlore sql \"select distinct team from sides\"` lists them"))
    else:
        rows = newest.rows(named=True)
        teams = list(dict.fromkeys((row[side], row["kind"]) for row in rows for side in ("home", "away")))
    return _of_teams(store, catalogue, teams), known


def _of_teams(store: Store, catalogue: Path, teams: Sequence[tuple[str, str]]) -> list[Card]:
    """The cards of some teams, each a name and a league."""
    names = list(dict.fromkeys(name for name, _ in teams))
    tables = ask_each(catalogue, [_ANSWERS, _GOALS, _SHOWN, _EACH], [names]) if teams else []
    cards = [_card(team, kind, *(table.filter(team=team, kind=kind) for table in tables))
             for team, kind in teams]
    few = few_goals(store, {kind: made for kind, match in {it.kind: it.newest for it in cards}.items()
                            if (made := store.receipt("values", match)) is not None})
    return [card._replace(few=few.get(card.kind, "")) for card in cards]


def _card(
    team: str, kind: str, answers: pl.DataFrame, goals: pl.DataFrame, clips: pl.DataFrame,
    counts: pl.DataFrame,
) -> Card:
    """The card of a team, by its own rows of the queries."""
    found = answers.filter(pl.col("says") != TOO_FEW).sort(
        pl.col("effect").abs(), "role", "act", "place", descending=[True, False, False, False])
    ((scored, conceded),) = goals.select("scored", "conceded").rows() or [(0, 0)]
    best, worst = (found.filter(sign * pl.col("effect") > 0).head(SENTENCES) for sign in (1, -1))
    worst = pl.concat([worst, lost_most(answers, conceded)]).unique(_KEY, maintain_order=True)
    wins = [_sentence(row, clips, scored, "for") for row in best.iter_rows(named=True)]
    loses = [_sentence(row, clips, conceded, "against") for row in worst.iter_rows(named=True)]
    return Card(team, kind, wins, loses, _changed(counts), newest=str(counts["match_id"][-1]))


def lost_most(answers: pl.DataFrame, conceded: int) -> pl.DataFrame:
    """The lost ball that the most goals against followed, as a row of schema Answers; no row of few goals.

    V may have changed by no more than is usual with the ball there: near a team's own goal that is much. The
    goals are a count, so that they are told, unless V surely rose.

    Args:
        answers: rows of schema Answers of one team.
        conceded: goals against the team.
    """
    return answers.filter(
        pl.col("act") == _LOST, pl.col("n") >= LEAST, pl.col("effect").is_not_null(),
        (pl.col("says") == TOO_FEW) | (pl.col("effect") < 0),
        pl.col("goals_against") >= max(LOST_GOALS, LOST_SHARE * conceded),
    ).sort("goals_against", "role", "place", descending=[True, False, False]).head(1)


def _sentence(row: dict[str, Any], clips: pl.DataFrame, of: int, which: str) -> Sentence:
    """A sentence of a row of schema Answers, with the clip after which V changed most in its way."""
    goals, place = row[f"goals_{which}"], -1 if which == "for" else 0
    own = clips.filter(**{name: row[name] for name in _KEY})
    match, side, robot, t_ns = own.select("match_id", "side", "robot", "t_ns").row(place)
    followed = f"{goals} of {number_of(of, 'goal')} {which} it followed" if goals else ""
    return Sentence(
        f"{row['role']} {row['act']} {row['place']}".capitalize(), often(row["each_match"]), followed,
        row["says"], row["effect"], match, side, robot, round(max(t_ns / 1e9 - BEFORE_S, 0.0), 2),
        round(t_ns / 1e9 + AFTER_S, 2), round(t_ns / 1e9, 2))


def often(each_match: float) -> str:
    """How often something happens, in words."""
    if each_match >= 1.5:
        return f"{each_match:.0f} times a match"
    return f"{each_match:.2g} times a match"


def _changed(counts: pl.DataFrame) -> list[str]:
    """Acts that the newest match has more or less of than chance gives after the matches before it."""
    lasts = dict(counts.select("match_id", "duration_s").iter_rows())
    if len(lasts) < 2:
        return []
    newest = counts["match_id"][-1]
    seconds = sum(lasts.values()) - lasts[newest], lasts[newest]
    changes: list[tuple[str, Change, Sequence[int]]] = []
    for (act,), rows in sorted(counts.drop_nulls("act").group_by("act")):
        since = int(rows.filter(match_id=newest)["n"].sum())
        before = int(rows["n"].sum()) - since
        change = change_of_count(before, since, seconds)
        if change is not None and change.beyond:
            changes.append((str(act), change, (before, since)))
    changes.sort(key=lambda it: -abs(it[1].size))
    return [f"{act} {'more' if change.size > 0 else 'less'} often: {since} times, "
            f"where {before * seconds[1] / seconds[0]:.0f} were usual in that time".capitalize()
            for act, change, (before, since) in changes[:SENTENCES]]
