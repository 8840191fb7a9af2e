"""Policies: what each behaviour is worth in each state, learned after the match from its decisions.

The learner tests by experience what the knowledge got by imitation (paper section 4): batch
Sarsa(lambda) acts only on the pairs of state and behaviour that the knowledge holds, in one table
a role, and a pair that is new starts optimistically (section 3.2.2, last sentence).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import polars as pl

from pipeline.errors import SchemaMismatch
from pipeline.learning.sarsa import CONTINUES, TERMINAL, TRUNCATED, UNKNOWN, Batch, Learned, sarsa_lambda
from pipeline.settings import PolicySettings
from pipeline.state import project
from schemas import Decisions, Policies
from schemas.behaviours import moves_randomly
from schemas.table import KEYS, ROLES

_PAIR = ["role", "key", "state", "behaviour_id"]


@dataclass(frozen=True, slots=True)
class RoleTraining:
    """What the training did to the table of one role.

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
        roles: each role's part, in the order of ROLES.
    """

    matches: int
    roles: dict[str, RoleTraining]

    @property
    def pairs(self) -> int:
        """State-behaviour pairs of all roles."""
        return sum(role.pairs for role in self.roles.values())

    @property
    def new_pairs(self) -> int:
        """Pairs that the parent did not have, of all roles."""
        return sum(role.new_pairs for role in self.roles.values())

    @property
    def decisions(self) -> int:
        """Decisions of all roles."""
        return sum(role.decisions for role in self.roles.values())

    @property
    def transitions(self) -> int:
        """Updates of a sweep, of all roles."""
        return sum(role.transitions for role in self.roles.values())


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
    role's table and the value flows across, for a goal rewards all who led to it. A decision with
    no behaviour is the behaviour 194, moves randomly, of its role. How decisions that the
    knowledge does not hold are passed over is said at :func:`pipeline.learning.sarsa.sarsa_lambda`.

    Args:
        decisions: tables of schema Decisions, one match each, of the robots that learn; consumed
            one at a time and learned from in this order. About 30 bytes a decision are kept.
        occasions: schema Occasions, of one version of the knowledge: the pairs to value.
        parent: schema Policies, the version before, or None. A pair that it has starts from its
            value; a new one from the greatest value that it gives to a behaviour usable in that
            state and role; where it gives none, from the occasion's ``initial``.
        settings: of the learning rule.
        version: of the new policy.
        knowledge_version: of ``occasions``.

    Returns:
        A table of schema Policies whose pairs are exactly those of ``occasions``; ``visits`` counts
        the decisions of this batch, once however many sweeps. And what was done.

    Raises:
        SchemaMismatch: if a table names a pair twice, or a time or reward is not usable.
        BadSettings: if the values grow beyond all bounds.
    """
    pairs = _initial(occasions, parent)
    known = pl.Enum(pairs["behaviour_id"].unique().sort())
    matches = [_slim(match, known) for match in decisions]
    rows = _with_pairs(pl.concat([_slim(Decisions.empty(), known), *matches]), pairs, known)
    batch = Batch(**{name: rows[name].to_numpy() for name in ("pair", "elapsed", "reward", "ends")})

    learned = sarsa_lambda(
        pairs["q"].to_numpy(),
        batch,
        step_size=settings.step_size,
        discount=settings.discount,
        trace_decay=settings.trace_decay,
        traces=settings.traces,
        sweeps=settings.sweeps,
    )
    visits = np.bincount(batch.pair[batch.pair != UNKNOWN], minlength=len(pairs))
    policy = pairs.select(
        pl.lit(version, pl.Int32).alias("version"),
        pl.lit(knowledge_version, pl.Int32).alias("knowledge_version"),
        *_PAIR,
        pl.Series("q", learned.q, dtype=pl.Float64),
        pl.Series("visits", visits, dtype=pl.Int64),
    )
    return policy, TrainingReport(len(matches), _training(pairs, rows["role"], learned))


def _initial(occasions: pl.DataFrame, parent: pl.DataFrame | None) -> pl.DataFrame:
    """The pairs in order, with the ``q`` they start from and whether they are ``new``."""
    known = Policies.empty() if parent is None else parent
    for name, frame in (("occasions", occasions), ("parent", known)):
        if frame.select(_PAIR).is_duplicated().any():
            raise SchemaMismatch(
                "names a pair of state and behaviour twice", where=name,
                next_step="Pass the rows of one version only",
            )
    best = pl.col("q").max().over("role", "key", "state")
    return (
        occasions.select(*_PAIR, "initial")
        .sort(_PAIR)
        .join(known.select(*_PAIR, "q"), on=_PAIR, how="left", maintain_order="left")
        .with_columns(
            pl.coalesce("q", best, "initial").alias("q"),
            pl.col("q").is_null().alias("new"),
        )
    )


def _slim(match: pl.DataFrame, known: pl.Enum) -> pl.DataFrame:
    """One match's decisions in order, in few bytes each: their pair's key, elapsed, reward, ends.

    A behaviour that is not ``known`` is null.
    """
    episode = pl.struct("team", "robot", "episode").rle_id()
    return (
        match.sort("team", "robot", "t_ns")
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
        )
    )


def _with_pairs(rows: pl.DataFrame, pairs: pl.DataFrame, known: pl.Enum) -> pl.DataFrame:
    """The decisions with the index of their ``pair``: of the finest key that holds it, else UNKNOWN."""
    index = pairs.select(
        *_PAIR[:-1],
        pl.col("behaviour_id").cast(known),
        pl.int_range(pl.len(), dtype=pl.Int64).alias("pair"),
    )
    slot = rows["role"].to_physical().to_numpy()
    rows = rows.with_columns(pl.lit(UNKNOWN, pl.Int64).alias("pair"))
    for key in index["key"].unique().sort(descending=True):  # the finest has the last word
        projected = rows.select(
            "role", pl.lit(key, pl.Enum(KEYS)).alias("key"),
            pl.Series("state", project(rows["state"].to_numpy(), key, slot)), "behaviour_id")
        found = projected.join(index, on=_PAIR, how="left", maintain_order="left")["pair"]
        rows = rows.with_columns(pl.coalesce(found, "pair").alias("pair"))
    return rows


def _training(pairs: pl.DataFrame, roles: pl.Series, learned: Learned) -> dict[str, RoleTraining]:
    """Each role's part in the training, from its pairs and from its decisions' roles and errors [T]."""
    out = {}
    for role in ROLES:
        own = pairs.filter(pl.col("role") == role)
        made = (roles == role).to_numpy()
        first, last = (np.abs(errors[made & ~np.isnan(errors)]) for errors in learned[1:])
        out[role] = RoleTraining(
            pairs=len(own),
            new_pairs=int(own["new"].sum()),
            decisions=int(made.sum()),
            transitions=len(first),
            first_error=float(first.mean()) if len(first) else None,
            last_error=float(last.mean()) if len(last) else None,
        )
    return out
