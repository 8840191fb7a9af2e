"""Hand-made seasons for tests: rows of schemas Games and Growth from one function a column."""

import polars as pl

from pitchlore.pipeline.arena.match.recipe import team_slug
from pitchlore.schemas import ROLES, Evaluations, Games, Growth


def season(settings="paper", opponent="static", seed=0, *, last=35, other=lambda g: 0.0, goals=lambda g: (1, 0),
           states=lambda g: 100 * g, behaviours=lambda g: 5 * g, lead=lambda g: 0, actions=1000, name=None,
           knowledge=lambda g: g, without=(), left=None):
    """(games, growth) of one season; ``other(game)`` is per cent, ``goals(game)`` those for and against."""
    name = name or f"{settings}-{opponent}-s{seed}"
    who = {"season": name, "settings": settings, "opponent": opponent, "seed": seed}
    games, growth = [], []
    for g in range(1, last + 1):
        if g in without:
            continue
        others = round(actions * other(g) / 100)
        scored, against = goals(g)
        games.append(who | {
            "game": g, "match_id": f"{name}-g{g}-0123456789ab"[-60:].lstrip("-"), "lead": lead(g), "goals_for": scored,
            "goals_against": against, "actions": actions, "random_actions": actions - others,
            "other_actions": others, "known_states": other(g) / 100, "direct": scored // 2,
            "indirect": scored - scored // 2, "error": 0, "direct_against": against, "indirect_against": 0,
            "error_against": 0, "situations": 4000, "duration_s": 480.0,
            "policy_version": g - 1 if g > 1 else None, "knowledge_version": knowledge(g), "left": left,
            "played_s": 1300.0, "other_s": 1300.0 * others / actions, "first_actions": actions // 5,
            "first_other_actions": min(others, actions // 5), "other_states": min(others, 6), "brief_actions": actions // 10,
        })
        growth += [who | {
            "game": g, "role": role, "states": states(g), "behaviours": behaviours(g), "pairs": 2 * behaviours(g),
            "states_seen": states(g) // 2, "states_played": states(g) - states(g) // 2, "actions": actions // 3,
            "other_actions": others // 3,
        } for role in ROLES]
    return pl.DataFrame(games, schema=Games.dtypes()), pl.DataFrame(growth, schema=Growth.dtypes())


def evaluation(team, against="static", pairs=10, *, goals=lambda i: (1, 0), learned=95, first=0, minutes=8.0):
    """Evaluations of an apprentice; ``goals(match)`` those for and against, ``learned`` per cent."""
    rows = [{
        "evaluation": team_slug(team, against)[:51] + "-0123456789ab", "team": team, "policy_version": 35, "knowledge_version": 35,
        "opponent": against, "seed": first + i // 2, "match": 1 + i % 2, "side": ("home", "away")[i % 2],
        "match_seed": 2_000_000_000 + 2 * (first + i // 2), "duration_s": 60 * minutes, "goals_for": goals(i)[0],
        "goals_against": goals(i)[1], "actions": 200, "other_actions": 2 * learned,
        "played_s": 1300.0, "other_s": 13.0 * learned, "brief_actions": 20,
    } for i in range(2 * pairs)]
    return Evaluations.validate(pl.DataFrame(rows, schema=Evaluations.dtypes()))


def apprentices(seeds=5, late=lambda s: 1):
    """Evaluations of best's apprentices; ``late(season)`` is how many of 20 matches against random it does not win."""
    return pl.concat(rows for s in range(seeds) for rows in (
        evaluation(f"best-static-s{s}", goals=lambda i, s=s: (3 + s % 2, 1)),
        evaluation(f"best-static-s{s}", "random", goals=lambda i, s=s: (0, 0) if i < late(s) else (4, 0)),
    ))


def tables(*seasons):
    """(games, growth) of all, validated."""
    games = pl.concat([Games.empty(), *(games for games, _ in seasons)]).sort("season", "game")
    growth = pl.concat([Growth.empty(), *(growth for _, growth in seasons)]).sort("season", "game", "role")
    return Games.validate(games), Growth.validate(growth)


def rising(seed, start=0.0, slope=0.1):
    """Per cent of other actions: none in game 1, then a line, a little other for each seed."""
    return lambda g: 0.0 if g == 1 else start + slope * g + 0.1 * (seed % 3)


def evolving(seed, after=3.0):
    """Per cent of other actions: none before game 11, then ``after``, a little other for each seed."""
    return lambda g: 0.0 if g < 11 else after + 0.1 * (seed % 3)


def world(seeds=5):
    """Seasons in which most of what the paper says holds: paper's and best's, without the ablations."""
    every = []
    for s in range(seeds):
        every += [
            season("paper", "human-like", s, other=rising(s), goals=lambda g, s=s: (2 + (g + s) % 2, 1), lead=lambda g: 0),
            season("paper", "static", s, other=evolving(s), goals=lambda g, s=s: ((g + s) % 2, 2), states=lambda g, s=s: 150 * g + s,
                   behaviours=lambda g: 6 * g, lead=lambda g: 5 if g >= 11 else 0),
            season("best", "static", s, other=lambda g: min(95.0, 5.0 * g), goals=lambda g, s=s: (min(g // 3, 6) + s % 2, 2)),
            season("best", "random", s, other=lambda g: min(95.0, 6.0 * g), goals=lambda g, s=s: (5 + s % 2, 0)),
        ]
    return tables(*every)


def ablations(seeds=5):
    """Seasons without the score in the key, and without its change."""
    early = [season("paper-full35", "static", s, other=rising(s, 1.0)) for s in range(seeds)]
    people = [season("paper-full35", "human-like", s, other=rising(s, 1.0)) for s in range(seeds)]
    level = [season("paper-level", "static", s) for s in range(seeds)]
    return [*early, *people, *level]
