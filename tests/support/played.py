"""A match and a season that are played here, as settings and tables that a person can compare.

Lengths are rounded to millimetres and angles to degrees: what another machine's sine gives differs later.
"""

import io
from pathlib import Path
from typing import Any

import polars as pl

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.controllers import PolicyTables, controller_of
from pitchlore.pipeline.arena.match.match import PART, MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine import games as loop
from pitchlore.pipeline.matches.frame import Frames, MatchLog
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store
from pitchlore.schemas import ROLES, Appraisals, Behaviours, Games, Growth, Occasions, Policies, Sights

#: What the learned team knows: values of behaviours in any state, the same for each role.
KNOWN = {"046-044-021": 0.5, "184": 0.5, "194": 0.1}
#: The paper's loop, small: coarse keys, so that the second game meets states of the first.
SEASON = """
base = "paper"
games = 2
lead_from = 2
practice = 1

[referee]
duration_s = 30

[pipeline.knowledge]
state_key = "self6"
backoff = ["role0"]
"""

#: The team that looks, small: few actions, short trees.
LOOKING = """
base = "looking"
games = 2
practice = 1

[referee]
duration_s = 90

[pipeline.policies.appraisals]
trees = 3
leaves = 4
leaf_samples = 20
"""

Shown = tuple[dict[str, object], list[pl.DataFrame]]


def starting(recipe: Recipe, policy: pl.DataFrame | None = None, *, logged: bool = True) -> MatchInPlay:
    """A match that has not begun; learned teams play the policy."""
    known = None if policy is None else PolicyTables(policy)
    controllers = (controller_of(recipe.home, recipe, 0, known), controller_of(recipe.away, recipe, 1, known))
    return MatchInPlay(recipe, controllers, logged=logged)


def logged(recipe: Recipe, policy: pl.DataFrame | None = None, part: int = PART) -> bytes:
    """The log of a match, written in parts of so many frames."""
    played, stream = starting(recipe, policy), io.BytesIO()
    recorder = matches.Recorder(stream, played.info)
    goes_on = True
    while goes_on:
        goes_on = played.advance(part)
        taken = played.take()
        recorder.frames(taken.frames)
        recorder.referee(taken.referee)
        recorder.decisions(taken.decisions)
    recorder.close()
    return stream.getvalue()


def whole(match: MatchInPlay) -> MatchLog:
    """The log of a match that is played to its end here."""
    match.advance(1_000_000)
    taken = match.take()
    return MatchLog(match.info, taken.frames, taken.referee, taken.decisions)


def read(recipe: Recipe, policy: pl.DataFrame | None = None) -> MatchLog:
    """A match as it is read from its log."""
    return matches.read(logged(recipe, policy), where="played")


def policy(*rows: tuple[Any, ...], key: str = "role0", evidence: float = 1.0) -> pl.DataFrame:
    """Rows of schema Policies: role, state, behaviour without its role, value, and its evidence if not all's."""
    return pl.DataFrame(
        [
            {"version": 1, "knowledge_version": 1, "role": role, "key": key, "state": state,
             "behaviour_id": f"{role}-{codes}", "q": q, "visits": 1, "evidence": (*own, evidence)[0]}
            for role, state, codes, q, *own in rows
        ],
        schema=Policies.dtypes(),
    )


def match() -> Shown:
    """20 s of a learned team against a static one: the referee's rows, the decisions, a line a second."""
    known = policy(*((role, 0, codes, q) for role in ROLES for codes, q in KNOWN.items()))
    recipe = Recipe(
        home=TeamSettings(kind="learned", explore=0.2), away=TeamSettings(kind="static"), seed=1,
        referee=RefereeSettings(duration_s=20.0),
    )
    log = read(recipe, known)
    decisions = log.decisions.drop("match_id", "team", "value", "chosen")
    return (
        {"recipe": recipe.model_dump(mode="json"), "known": KNOWN},
        [log.referee.drop("match_id"), _places(log.frames, every=60), decisions],
    )


def _two_games(data: Path, name: str, settings: str) -> Season:
    """A season after two games."""
    own = Season(name=name, opponent="static", seed=1, settings=parse_season(settings, where="here"))
    for game in (1, 2):
        loop.learn_from_game(data, own, game, loop.play_game(data, own, game), discard=False)
    return own


def season(data: Path) -> Shown:
    """Two games: their rows, what was known after each, the action values that were learned most from."""
    own = _two_games(data, "golden", SEASON)
    store, inner = Store(data), loop.store_of(data, own)
    receipt = store.receipt(loop.NOUN, own.id)
    assert receipt is not None
    games = store.read_table(receipt, "games", Games)
    growth = store.read_table(receipt, "growth", Growth)
    behaviours, occasions = (
        pl.concat(
            inner.read_table(manifest, table, schema)
            for manifest in sorted(inner.manifests("knowledge"), key=lambda m: m.version)
        )
        for table, schema in (("behaviours", Behaviours), ("occasions", Occasions))
    )
    newest = inner.latest("policies")
    assert newest is not None
    policy = inner.read_table(newest, "policies", Policies)
    most = policy.drop("version", "knowledge_version").sort(
        "key", "visits", "q", "role", "state", "behaviour_id", descending=[False, True, True, False, False, False])
    same = ("season", "settings", "opponent", "seed")
    lengths = behaviours.sort("n").pivot("n", index=("version", "role"), values="behaviour_id", aggregate_function="len")
    return own.model_dump(mode="json"), [
        games.drop(*same, "match_id").cast(pl.String).transpose(include_header=True, header_name="game", column_names="game"),
        growth.drop(same),
        lengths.rename({str(n): f"behaviours of {n}" for n in range(1, 5)}).sort("version", "role"),
        occasions.group_by("version", "key", "role").agg(
            occasions=pl.len(), states=pl.col("state").n_unique()).sort("version", "key", "role"),
        most.group_by("key", maintain_order=True).head(15),
    ]


def looking(data: Path) -> Shown:
    """Two games of a team that looks: sights at its first decisions, and the trees that were grown of all."""
    own = _two_games(data, "golden-looking", LOOKING)
    inner = loop.store_of(data, own)
    sights = pl.concat(inner.read_table(receipt, "sights", Sights) for receipt in inner.receipts("sequences"))
    newest = inner.latest("policies")
    assert newest is not None
    trees = inner.read_table(newest, "appraisals", Appraisals).drop("version")
    counts = trees.group_by("code", maintain_order=True).agg(
        trees=pl.col("tree").n_unique(), leaves=pl.col("feature").is_null().sum(), sum=pl.col("value").sum())
    first = sights.sort("match_id", "team", "t_ns", "robot").drop("match_id").head(6)
    return own.model_dump(mode="json"), [counts, trees.head(40), first]


def _places(frames: Frames, every: int) -> pl.DataFrame:
    """Where the bodies are each so many frames: "x y" in millimetres, and the heading in degrees."""
    robots = frames.robots.reshape(len(frames), -1)
    names = [f"{'home' if team == 0 else 'away'} {number}" for team, number in robots[["team", "id"]][0].tolist()]
    rows = []
    for index in range(0, len(frames), every):
        ball = frames.ball[index]
        row = {"t_s": f"{frames.t_ns[index] / 1e9:.0f}", "ball": _whole(1000 * ball["x"], 1000 * ball["y"])}
        for name, robot in zip(names, robots[index], strict=True):
            row[name] = _whole(1000 * robot["x"], 1000 * robot["y"], 57.29578 * robot["theta"])
        rows.append(row)
    return pl.DataFrame(rows)


def _whole(*numbers: float) -> str:
    return " ".join(str(round(float(number))) for number in numbers)
