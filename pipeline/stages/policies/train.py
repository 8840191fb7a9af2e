"""Policies: action values of behaviours in states, learned after the match from its decisions.

The knowledge comes from imitation; the learner tests it by experience (paper section 4). Batch
Sarsa(lambda) values only the pairs of state and behaviour that the knowledge holds. A policy has one
table for each key and role; a key is an abstraction of the state (``pipeline.state``). Each key is a
learning problem of its own over all decisions, so that a player can turn to a coarser key where a finer
one knows nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies.batch import PAIR, DecisionBatch
from pitchlore.pipeline.stages.policies.influence import Influence
from pitchlore.pipeline.stages.policies.sarsa import UNKNOWN, LearnedValues, Transitions, sarsa_lambda
from pitchlore.schemas import Policies
from pitchlore.schemas.table import ROLES


@dataclass(frozen=True, slots=True)
class TableTraining:
    """Counts and errors of the training of one table: one role in one key.

    Attributes:
        pairs: state-behaviour pairs in the table.
        new_pairs: pairs that the parent did not have.
        decisions: decisions made in the role.
        transitions: decisions that updated the table in each sweep: the knowledge holds their pair,
            and their outcome was recorded.
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
    """Counts and errors of one training.

    Attributes:
        matches: tables of decisions in the batch.
        decisions: decisions in the batch, after ``learn_from`` of the settings.
        tables: by key, fine to coarse, then by role in the order of ROLES.
    """

    matches: int
    decisions: int
    tables: dict[str, dict[str, TableTraining]]


def train(
    batch: DecisionBatch,
    occasions: pl.DataFrame,
    parent: pl.DataFrame | None,
    settings: PolicySettings,
    version: int,
    knowledge_version: int,
) -> tuple[pl.DataFrame, TrainingReport]:
    """Train the next version of the policy.

    A robot's decisions are one sequence. When its role changes, the next pair is in the other role's
    table and value flows across, because a goal rewards all decisions that led to it. The robot's
    chosen decisions and its observed ones are two sequences. A decision with no behaviour counts as
    194, moves randomly, of its role. :func:`pipeline.stages.policies.sarsa.sarsa_lambda` describes how
    decisions outside a key's table are passed over.

    Args:
        batch: the decisions of the robots that learn, with the pairs of ``occasions``
            (:func:`pipeline.stages.policies.batch.batch_of`); matches are learned from in this order, in
            every key. Training takes some 150 bytes more a decision, for any number of keys.
        occasions: schema Occasions, of one version of the knowledge: the pairs to value.
        parent: schema Policies, the version before, or None. It is ignored if ``settings.parent`` is
            not set. A pair that it has starts from its value. A new pair starts by
            ``settings.new_pairs``. "optimistic": the greatest value that the parent gives to a
            behaviour usable in that state by the role, else the occasion's ``initial``. "outcome": the
            occasion's ``value``, else its ``initial``.
        settings: choice of the decisions to learn from, the start and the learning rule.
        version: version of the new policy.
        knowledge_version: knowledge version of ``occasions``.

    Returns:
        A table of schema Policies with exactly the pairs of ``occasions``, and the report. ``visits`` is
        the parent's plus this batch's, which count once for any number of sweeps.

    Raises:
        SchemaMismatch: if a table names a pair twice, or a time or reward is not usable.
        BadSettings: if the values grow beyond all bounds.
    """
    pairs = _initial(occasions, parent, settings)
    rows = batch.rows
    q, visits, evidence = (pairs[name].to_numpy().copy() for name in ("q", "visits", "evidence"))
    tables = {}
    for key in pairs["key"].unique().sort():
        own = pairs.filter(pl.col("key") == key)
        at, pair = own["row"].to_numpy(), batch.pairs[key]
        visits[at] += np.bincount(pair[pair != UNKNOWN], minlength=len(own))
        learned = _learn(rows, pair, own.with_columns(visits=visits[at]), settings)
        q[at], evidence[at] = learned.q, np.minimum(learned.seen, 1 / settings.step_size)
        tables[key] = _training(own, rows["role"], learned)
    policy = pairs.select(
        pl.lit(version, pl.Int32).alias("version"),
        pl.lit(knowledge_version, pl.Int32).alias("knowledge_version"),
        *PAIR,
        pl.Series("q", q, dtype=pl.Float64),
        pl.Series("visits", visits, dtype=pl.Int64),
        pl.Series("evidence", evidence, dtype=pl.Float64),
    )
    return policy, TrainingReport(batch.matches, len(rows), tables)


def _initial(occasions: pl.DataFrame, parent: pl.DataFrame | None, settings: PolicySettings) -> pl.DataFrame:
    """The pairs in order, with ``row``, ``new``, and the start of ``q``, ``visits`` and ``evidence``."""
    known = Policies.empty() if parent is None or not settings.parent else parent
    for name, frame in (("occasions", occasions), ("parent", known)):
        if frame.select(PAIR).is_duplicated().any():
            raise SchemaMismatch(
                "names a pair of state and behaviour twice", where=name,
                next_step="Pass the rows of one version only",
            )
    best = pl.col("q").max().over("role", "key", "state")
    start = pl.coalesce(best if settings.new_pairs == "optimistic" else "value", "initial")
    return (
        occasions.select(*PAIR, "initial", "value")
        .sort(PAIR)
        .join(known.select(*PAIR, "q", "visits", "evidence"), on=PAIR, how="left", maintain_order="left")
        .with_columns(
            pl.coalesce("q", start).alias("q"),
            pl.col("q").is_null().alias("new"),
            pl.col("visits").fill_null(0),
            pl.col("evidence").fill_null(settings.start_evidence),
        )
        .with_row_index("row")
    )


def _learn(rows: pl.DataFrame, pair: I64, own: pl.DataFrame, settings: PolicySettings) -> LearnedValues:
    """Train the pairs ``own`` of one key; their ``visits`` include this batch's, all else is their start."""
    batch = Transitions(pair, **{name: rows[name].to_numpy() for name in ("elapsed", "reward", "ends")})
    influence = None
    if settings.rule == "influence":
        of_state = pl.col("visits").sum().over("role", "state")
        influence = Influence(
            team_episode=rows["team_episode"].to_numpy(),
            robot=rows["robot"].rank("dense").cast(pl.Int64).to_numpy() - 1,
            t_ns=rows["t_ns"].to_numpy(),
            pair=pair,
            share=own.select(pl.col("visits") / pl.max_horizontal(of_state, 1))["visits"].to_numpy(),
            rate=settings.influence,
        )
    return sarsa_lambda(own["q"].to_numpy(), own["evidence"].to_numpy(), batch, settings, influence)


def _training(own: pl.DataFrame, roles: pl.Series, learned: LearnedValues) -> dict[str, TableTraining]:
    """Report of each role in one key, from the key's pairs and the decisions' roles and errors [T]."""
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
