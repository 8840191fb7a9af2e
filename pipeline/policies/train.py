"""Policies: what each behaviour is worth in each state, learned after the match from its decisions.

The learner tests by experience what the knowledge got by imitation (paper section 4): batch
Sarsa(lambda) acts only on the pairs of state and behaviour that the knowledge holds. A policy holds
one table a key, which is what the state is abstracted to (``pipeline.state``), and in it one a role.
The tables of each key are a learning problem of their own, over all decisions, so that a player can
turn to a coarser key where a finer one knows nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline.errors import SchemaMismatch
from pipeline.policies.influence import Influence
from pipeline.policies.sarsa import (
    CONTINUES,
    TERMINAL,
    TRUNCATED,
    UNKNOWN,
    LearnedValues,
    Transitions,
    sarsa_lambda,
)
from pipeline.settings import PolicySettings
from pipeline.state import project
from schemas import Decisions, Policies
from schemas.behaviours import moves_randomly
from schemas.table import ROLES, Key

I64 = npt.NDArray[np.int64]

_PAIR = ["role", "key", "state", "behaviour_id"]


@dataclass(frozen=True, slots=True)
class TableTraining:
    """What the training did to the table of one role in one key.

    Attributes:
        pairs: state-behaviour pairs in the table.
        new_pairs: how many of them the parent did not have.
        decisions: decisions made in the role.
        transitions: how many of them updated the table in each sweep: those whose pair the
            knowledge holds and whose outcome was recorded.
        first_error: mean absolute TD error of the transitions in the first sweep; None without any.
        last_error: the same in the last sweep.
    """

    pairs: int
    new_pairs: int
    decisions: int
    transitions: int
    first_error: float | None
    last_error: float | None


@dataclass(frozen=True, slots=True)
class TrainingReport:
    """What the training did.

    Attributes:
        matches: number of tables of decisions that it learned from.
        decisions: decisions in them that it was to learn from.
        tables: by key, fine to coarse, then by role in the order of ROLES.
    """

    matches: int
    decisions: int
    tables: dict[str, dict[str, TableTraining]]

    @property
    def pairs(self) -> int:
        """State-behaviour pairs of all tables."""
        return sum(table.pairs for roles in self.tables.values() for table in roles.values())

    @property
    def new_pairs(self) -> int:
        """Pairs that the parent did not have, of all tables."""
        return sum(table.new_pairs for roles in self.tables.values() for table in roles.values())

    @property
    def transitions(self) -> int:
        """Updates of a sweep, of all tables: a decision makes one in each key that holds its pair."""
        return sum(table.transitions for roles in self.tables.values() for table in roles.values())


def train(
    decisions: Iterable[pl.DataFrame],
    occasions: pl.DataFrame,
    parent: pl.DataFrame | None,
    settings: PolicySettings,
    version: int,
    knowledge_version: int,
) -> tuple[pl.DataFrame, TrainingReport]:
    """The next version of the policy.

    A robot's decisions are one sequence: when its role changes, the next pair is in the other
    role's table and the value flows across, for a goal rewards all who led to it. What it chose and
    what it was seen to do are two sequences. A decision with no behaviour is the behaviour 194,
    moves randomly, of its role. How decisions that a key's table does not hold are passed over is
    said at :func:`pipeline.policies.sarsa.sarsa_lambda`.

    Args:
        decisions: tables of schema Decisions, one match each, of the robots that learn; consumed
            one at a time and learned from in this order, in every key. About 30 bytes a decision
            are kept (48 with influence values); while a key is trained it takes some 150 more,
            however many keys there are.
        occasions: schema Occasions, of one version of the knowledge: the pairs to value.
        parent: schema Policies, the version before, or None; None also if ``settings.parent`` is
            not set. A pair that it has starts from its value; where a new one starts,
            ``settings.new_pairs`` says: "optimistic" from the greatest value that the parent gives
            to a behaviour usable in that state by the role, where it gives none from the occasion's
            ``initial``; "outcome" from the occasion's ``value``, if it has one, else the same.
        settings: which decisions to learn from, the start and the learning rule.
        version: of the new policy.
        knowledge_version: of ``occasions``.

    Returns:
        A table of schema Policies whose pairs are exactly those of ``occasions``; to the parent's
        ``visits`` those of this batch are added, once however many sweeps. And what was done.

    Raises:
        SchemaMismatch: if a table names a pair twice, or a time or reward is not usable.
        BadSettings: if the values grow beyond all bounds.
    """
    pairs = _initial(occasions, parent, settings)
    known = pl.Enum(pairs["behaviour_id"].unique().sort())
    matches = [_slim(match, number, known, settings) for number, match in enumerate(decisions)]
    rows = pl.concat([_slim(Decisions.empty(), 0, known, settings), *matches])
    q, visits, evidence = (pairs[name].to_numpy().copy() for name in ("q", "visits", "evidence"))
    tables = {}
    for key in pairs["key"].unique().sort():
        own = pairs.filter(pl.col("key") == key)
        at, pair = own["row"].to_numpy(), _pairs(rows, own, key)
        visits[at] += np.bincount(pair[pair != UNKNOWN], minlength=len(own))
        learned = _learn(rows, pair, own.with_columns(visits=visits[at]), settings)
        q[at], evidence[at] = learned.q, np.minimum(learned.seen, 1 / settings.step_size)
        tables[key] = _training(own, rows["role"], learned)
    policy = pairs.select(
        pl.lit(version, pl.Int32).alias("version"),
        pl.lit(knowledge_version, pl.Int32).alias("knowledge_version"),
        *_PAIR,
        pl.Series("q", q, dtype=pl.Float64),
        pl.Series("visits", visits, dtype=pl.Int64),
        pl.Series("evidence", evidence, dtype=pl.Float64),
    )
    return policy, TrainingReport(len(matches), len(rows), tables)


def _initial(occasions: pl.DataFrame, parent: pl.DataFrame | None, settings: PolicySettings) -> pl.DataFrame:
    """The pairs in order, with ``row`` and ``new``, and where ``q``, ``visits`` and ``evidence`` start."""
    known = Policies.empty() if parent is None or not settings.parent else parent
    for name, frame in (("occasions", occasions), ("parent", known)):
        if frame.select(_PAIR).is_duplicated().any():
            raise SchemaMismatch(
                "names a pair of state and behaviour twice", where=name,
                next_step="Pass the rows of one version only",
            )
    best = pl.col("q").max().over("role", "key", "state")
    start = pl.coalesce(best if settings.new_pairs == "optimistic" else "value", "initial")
    return (
        occasions.select(*_PAIR, "initial", "value")
        .sort(_PAIR)
        .join(known.select(*_PAIR, "q", "visits", "evidence"), on=_PAIR, how="left", maintain_order="left")
        .with_columns(
            pl.coalesce("q", start).alias("q"),
            pl.col("q").is_null().alias("new"),
            pl.col("visits").fill_null(0),
            pl.col("evidence").fill_null(settings.start_evidence),
        )
        .with_row_index("row")
    )


def _slim(match: pl.DataFrame, number: int, known: pl.Enum, settings: PolicySettings) -> pl.DataFrame:
    """What is learned from of one match, in order and in few bytes a decision.

    Columns role, state, behaviour_id (null if not ``known``), elapsed, reward and ends; for influence
    values also robot, t_ns and company, the ``number`` of the match, team and episode in one.
    """
    if settings.learn_from != "both":
        match = match.filter(pl.col("chosen") == (settings.learn_from == "chosen"))
    sequence = ("team", "robot", "chosen")
    episode = pl.struct(*sequence, "episode").rle_id()
    team, kind = pl.col("team").to_physical().cast(pl.Int64), pl.col("chosen").cast(pl.Int64)
    company = [
        "robot",
        "t_ns",
        ((pl.lit(number, pl.Int64) * 2**31 + pl.col("episode")) * 4 + team * 2 + kind).alias("company"),
    ]
    return (
        match.sort(*sequence, "t_ns")
        .with_columns(last=(episode != episode.shift(-1)).fill_null(value=True))
        .select(
            "role",
            "state",
            pl.col("behaviour_id").fill_null(moves_randomly()).cast(known, strict=False),
            ((pl.col("end_ns") - pl.col("t_ns")) / 1e9).alias("elapsed"),
            "reward",
            # an episode whose last decision does not say how it ended was cut there
            pl.when(pl.col("ends") == "terminal").then(TERMINAL)
            .when(pl.col("ends").is_not_null() | pl.col("last")).then(TRUNCATED)
            .otherwise(CONTINUES).cast(pl.Int8).alias("ends"),
            *(company if settings.rule == "influence" else ()),
        )
    )


def _pairs(rows: pl.DataFrame, own: pl.DataFrame, key: Key) -> I64:
    """The index of each decision's pair in ``own``, the pairs of one key; UNKNOWN where it is none."""
    known = rows["behaviour_id"].dtype
    index = own.select(
        "role",
        "state",
        pl.col("behaviour_id").cast(known),
        pl.int_range(pl.len(), dtype=pl.Int64).alias("pair"),
    )
    states = project(rows["state"].to_numpy(), key, rows["role"].to_physical().to_numpy())
    return (
        rows.select("role", pl.Series("state", states), "behaviour_id")
        .join(index, on=["role", "state", "behaviour_id"], how="left", maintain_order="left")["pair"]
        .fill_null(UNKNOWN)
        .to_numpy()
    )


def _learn(rows: pl.DataFrame, pair: I64, own: pl.DataFrame, settings: PolicySettings) -> LearnedValues:
    """Train one key's pairs ``own``: their ``visits`` have this batch's, all else is where they start."""
    batch = Transitions(pair, **{name: rows[name].to_numpy() for name in ("elapsed", "reward", "ends")})
    sway = None
    if settings.rule == "influence":
        of_state = pl.col("visits").sum().over("role", "state")
        sway = Influence(
            company=rows["company"].to_numpy(),
            robot=rows["robot"].rank("dense").cast(pl.Int64).to_numpy() - 1,
            t_ns=rows["t_ns"].to_numpy(),
            pair=pair,
            share=own.select(pl.col("visits") / pl.max_horizontal(of_state, 1))["visits"].to_numpy(),
            rate=settings.influence,
        )
    return sarsa_lambda(
        own["q"].to_numpy(),
        batch,
        step_size=settings.step_size,
        discount=settings.discount,
        trace_decay=settings.trace_decay,
        traces=settings.traces,
        sweeps=settings.sweeps,
        steps=settings.steps,
        seen=own["evidence"].to_numpy(),
        sway=sway,
    )


def _training(own: pl.DataFrame, roles: pl.Series, learned: LearnedValues) -> dict[str, TableTraining]:
    """Each role's part in the training of a key, from its pairs and the decisions' roles and errors [T]."""
    out = {}
    for role in ROLES:
        pairs = own.filter(pl.col("role") == role)
        made = (roles == role).to_numpy()
        first, last = (np.abs(errors[made & ~np.isnan(errors)])
                       for errors in (learned.first_errors, learned.last_errors))
        out[role] = TableTraining(
            pairs=len(pairs),
            new_pairs=int(pairs["new"].sum()),
            decisions=int(made.sum()),
            transitions=len(first),
            first_error=float(first.mean()) if len(first) else None,
            last_error=float(last.mean()) if len(last) else None,
        )
    return out
