"""Every knob of every stage: one frozen model a stage, and one that holds them all.

A stage's settings are written into its receipts; the same settings, seed and inputs give the
same bytes. Units are in the names (``_s`` seconds, ``_ns`` nanoseconds, ``_m`` metres).
"""

from __future__ import annotations

import tomllib
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from pipeline.errors import BadSettings
from schemas.table import KEYS, Key

M = TypeVar("M", bound=BaseModel)


class Frozen(BaseModel):
    """A frozen model of settings: no unknown keys, no infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def none_twice(teams: tuple[str, ...]) -> tuple[str, ...]:
    """The same teams.

    Raises:
        ValueError: if one is named twice.
    """
    if len(set(teams)) < len(teams):
        raise ValueError(f"a team is named twice (it is: {', '.join(teams)})")
    return teams


Team = Literal["home", "away"]
#: One team or both, none twice.
Teams = Annotated[tuple[Team, ...], Field(min_length=1), AfterValidator(none_twice)]


class TrajectorySettings(Frozen):
    """How bodies are cleaned and velocities estimated.

    Attributes:
        gap_s: a longer time between samples cuts the segment.
        window_s: full width of the centred least-squares window for velocities.
        window_samples: samples the window holds at least, however slow the sampling.
        hole_s: a body missing for longer starts its velocity estimate anew.
        jump_accept_s: a body that keeps to its new place for so long has been put there.
        reorder_s: a sample that is late by more is a clock that jumped back.
    """

    gap_s: float = Field(default=0.5, gt=0)
    window_s: float = Field(default=0.1, gt=0)
    window_samples: int = Field(default=3, ge=3)
    hole_s: float = Field(default=0.2, gt=0)
    jump_accept_s: float = Field(default=0.25, gt=0)
    reorder_s: float = Field(default=0.5, ge=0)


class GoalSettings(Frozen):
    """How goals are attributed (``pipeline.goals.attribute``); the paper gives no times, these are ours.

    Attributes:
        before_s: contacts so long before the goal are looked at first.
        deflect_s: a shot is deflected by an adversary's touch at most so long after it.
        line_s: the ball's straight line after a contact is taken from so long a stretch.
    """

    before_s: float = Field(default=2.0, gt=0)
    deflect_s: float = Field(default=1.0, gt=0)
    line_s: float = Field(default=0.1, gt=0)


class SituationSettings(Frozen):
    """How situations are recognised (DECISIONS.md, "Situations").

    Attributes:
        fire_at: a fuzzy condition holds from this degree on.
        flicker_s: for so long may a lasting condition (with the ball, standing) fail, and a robot be
            missing, without ending it. Neighbouring samples are connected however slow the sampling.
        lull_s: the same for the motion that leads up to a situation.
        longest_s: no situation lasts longer.
        least_share: least part of an occurrence that those of higher priority must have left free.
        random_least_s: a shorter gap between situations stays empty, a longer one is 194.
        random_longest_s: a longer gap is more than one 194.
    """

    fire_at: float = Field(default=0.5, gt=0, le=1)
    flicker_s: float = Field(default=0.10, ge=0)
    lull_s: float = Field(default=0.134, ge=0)
    longest_s: float = Field(default=2.0, gt=0)
    least_share: float = Field(default=0.3, ge=0, le=1)
    random_least_s: float = Field(default=0.2, ge=0)
    random_longest_s: float = Field(default=1.0, gt=0)


class GramSettings(Frozen):
    """How situations are valued and windowed (paper section 3.2.2).

    Attributes:
        alpha: value of a situation that starts one tick before a goal.
        tick_s: the discrete time of the paper's exponent.
        gap_s: situations that lie as far apart, or further, are not consecutive; shorter holes
            are those that the recogniser drops.
    """

    alpha: float = Field(default=0.998, gt=0, lt=1)
    tick_s: float = Field(default=1 / 30, gt=0)
    gap_s: float = Field(default=0.2, gt=0)


class RoundSettings(Frozen):
    """One round of the selection of behaviours.

    Attributes:
        n: length of the grams.
        rows, columns: of the map.
        activation: least share of ``BehaviourSettings.share_of`` that a neuron must be activated by.
    """

    n: int = Field(ge=1, le=4)
    rows: int = Field(ge=1)
    columns: int = Field(ge=1)
    activation: float = Field(gt=0, le=1)


class BehaviourSettings(Frozen):
    """How behaviours are selected (paper section 3.2.2).

    Attributes:
        rounds: longest first, none twice, for a later round counts only what the earlier ones leave.
            A map of at most 1 / activation neurons always has one that passes if the share is of the
            groups: the busiest.
        share_of: what a neuron's activations are a share of: the groups that the round is over
            (each of its situations starts one, but the last few of a run), or all situations
            recognised, those used up by longer behaviours included.
        value_over: a group must be worth more than this.
        support_at_least: a group must have been seen this often; the paper asks for no more than 1,
            but what was seen once is worth only what the next goal happened to be.
        keep_random: whether a group of nothing but "moves randomly" may become a behaviour;
            every state offers that action anyway.
        teams: whose grams and situations are counted.
        epochs: passes of the map's training over the distinct grams.
        sigma_end: spread of the map's last neighbourhood, neurons.
        seed: of the map.
    """

    rounds: tuple[RoundSettings, ...] = (
        RoundSettings(n=4, rows=3, columns=3, activation=0.10),
        RoundSettings(n=3, rows=3, columns=4, activation=0.08),
        RoundSettings(n=2, rows=4, columns=4, activation=0.06),
        RoundSettings(n=1, rows=5, columns=5, activation=0.04),
    )
    share_of: Literal["groups", "situations"] = "groups"
    value_over: float = 0.0
    support_at_least: int = Field(default=3, ge=1)
    keep_random: bool = False
    teams: Teams = ("home", "away")
    epochs: int = Field(default=20, ge=1)
    sigma_end: float = Field(default=0.5, gt=0)
    seed: int = 0

    @field_validator("rounds")
    @classmethod
    def _longest_first(cls, rounds: tuple[RoundSettings, ...]) -> tuple[RoundSettings, ...]:
        lengths = [round_.n for round_ in rounds]
        if not lengths or lengths != sorted(set(lengths), reverse=True):
            found = ", ".join(map(str, lengths)) or "none"
            raise ValueError(f"there must be a round, and n must fall from each to the next (it is: {found})")
        return rounds


class KnowledgeSettings(Frozen):
    """How occasions become knowledge.

    Attributes:
        state_key: which elements of the state are kept (DECISIONS.md, "The paper contradicts itself").
        backoff: keys by which the occasions are kept too, each coarser than the one before and than
            ``state_key``: what a player may look at where it does not know the finer state.
        optimistic: least initial action value of a behaviour in a state.
        teams: whose behaviours and occasions are learned by imitation, where they did not log what
            they chose.
        own: what a state adds in which a player decided: nothing; "moves randomly" (paper section 4:
            "all the new states have the action moving randomly", and states grow while playing and
            training, actions in training only); or the behaviour it "chose" too, if the knowledge holds it.
        accumulate: whether a version adds to the one before, instead of being of its matches alone.
    """

    state_key: Key = "full36"
    backoff: tuple[Key, ...] = ()
    optimistic: float = 0.0
    teams: Teams = ("home", "away")
    own: Literal["nothing", "moves randomly", "chosen"] = "moves randomly"
    accumulate: bool = False

    @model_validator(mode="after")
    def _ever_coarser(self) -> Self:
        ranks = [KEYS.index(key) for key in self.state_keys]
        if ranks != sorted(set(ranks)):
            raise ValueError(
                f"each key of backoff must be coarser than the one before, {self.state_key} the first "
                f"(from fine to coarse: {', '.join(KEYS)}; it is: {', '.join(self.backoff)})"
            )
        return self

    @property
    def state_keys(self) -> tuple[Key, ...]:
        """All keys, from fine to coarse (a model may have no ``keys``: it would look like a mapping)."""
        return (self.state_key, *self.backoff)


class PolicySettings(Frozen):
    """Batch Sarsa(lambda) (paper section 4; values are ours, the paper gives none).

    Which decisions make a batch, what values it starts from, and the rule.

    Attributes:
        learn_from: decisions that a player of ours chose, those that were seen in recordings, or both.
        last_matches: of how many matches at most, the newest of the knowledge; None: of all.
        parent: whether to start from the values of the newest policy, or anew from what the
            knowledge says of each pair.
        new_pairs: where a pair starts that the parent does not have: at the greatest value known
            in its state (paper section 3.2.2), or at the mean value of its own outcomes.
        rule: Sarsa(lambda) alone, or with the influence values of the robot's team-mates (paper
            section 2.3.4) added to its TD error.
        influence: beta of equation 4, of every team-mate over every other, inside the learning
            rate's bracket as equation 7 is printed; the paper's own is 0.1. Not read by "sarsa".
        steps: "constant", or "average": one over the episodes that a pair was seen in, so that a value is
            the mean of what came of it (Sutton and Barto, 2nd edition, section 2.4).
        step_size: alpha; of averages the least that it becomes: 0.01 follows the last 100 episodes.
        start_evidence: how many episodes the value that a pair starts from is worth in averages.
        discount: gamma a second of elapsed time (semi-Markov); 0.95 is 0.98 a decision of 0.4 s,
            and close to the value of situations (0.998 a tick of 1/30 s is 0.942 a second).
        trace_decay: lambda a decision.
        traces: replacing or accumulating.
        sweeps: passes over the batch.
    """

    learn_from: Literal["chosen", "seen", "both"] = "both"
    last_matches: int | None = Field(default=None, ge=1)
    parent: bool = True
    new_pairs: Literal["optimistic", "outcome"] = "optimistic"
    rule: Literal["sarsa", "influence"] = "sarsa"
    influence: float = Field(default=0.1, ge=0)
    steps: Literal["constant", "average"] = "constant"
    step_size: float = Field(default=0.1, gt=0, le=1)
    start_evidence: float = Field(default=0.0, ge=0)
    discount: float = Field(default=0.95, gt=0, le=1)
    trace_decay: float = Field(default=0.9, ge=0, le=1)
    traces: Literal["replacing", "accumulating"] = "replacing"
    sweeps: int = Field(default=5, ge=1)


class Settings(Frozen):
    """All settings of a run; a TOML file has one table a stage."""

    trajectories: TrajectorySettings = TrajectorySettings()
    goals: GoalSettings = GoalSettings()
    situations: SituationSettings = SituationSettings()
    grams: GramSettings = GramSettings()
    behaviours: BehaviourSettings = BehaviourSettings()
    knowledge: KnowledgeSettings = KnowledgeSettings()
    policies: PolicySettings = PolicySettings()

    @property
    def decisions(self) -> GramSettings:
        """What the decisions depend on: how situations are valued and follow each other."""
        return self.grams


def parse_settings(data: bytes, where: str) -> Settings:
    """The defaults, with what a TOML file says on top.

    Args:
        data: the file's bytes.
        where: its name, for errors.

    Raises:
        BadSettings: if it is not TOML, or has a key or value that does not fit; names the first.
    """
    return from_toml(Settings, data, where, "See pipeline/settings.py for all keys and their bounds")


def from_toml(model: type[M], data: bytes | str, where: str, keys: str) -> M:
    """A model from TOML; ``keys`` is the step that tells which keys and values there are.

    Raises:
        BadSettings: if it is not TOML, or has a key or value that does not fit; names the first.
    """
    return fitted(model, tables(data, where), where, keys)


def tables(data: bytes | str, where: str) -> dict[str, Any]:
    """What a TOML file says.

    Raises:
        BadSettings: if it is not TOML.
    """
    try:
        return tomllib.loads(data if isinstance(data, str) else data.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise BadSettings(
            f"is not TOML ({error})", where=where, next_step="Mend the line it names"
        ) from error


def fitted(model: type[M], values: dict[str, Any], where: str, keys: str) -> M:
    """A model from what a file says; see :func:`from_toml`."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise unfit(error, where, keys) from error


def unfit(error: ValidationError, where: str, next_step: str) -> BadSettings:
    """The first thing that keeps values from being settings, as an error of ours."""
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"]) or "it"
    return BadSettings(
        f"{key}: {first['msg'].removeprefix('Value error, ').lower()}", where=where, next_step=next_step
    )


def over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Tables of which the one above hides what it says itself of the one below."""
    out = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(out.get(key), dict)
        out[key] = over(out[key], value) if both else value
    return out
