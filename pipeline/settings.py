"""Settings of the stages: one frozen model for each stage, and one that holds them all.

A stage's settings are written into its receipts. The same settings, seed and inputs give the same bytes.
Units are in the names (``_s`` seconds, ``_ns`` nanoseconds, ``_m`` metres).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, PlainSerializer, field_validator, model_validator

from pitchlore.pipeline.base.bounds import MANY, Amount, Count, Pause, Positive, Seconds
from pitchlore.pipeline.base.toml import Frozen, fitted, toml_tables
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.schemas.table import KEYS, Key, Side


def none_twice(teams: tuple[str, ...]) -> tuple[str, ...]:
    """The same teams.

    Raises:
        ValueError: if one is named twice.
    """
    if len(set(teams)) < len(teams):
        raise ValueError(f"a team is named twice (it is: {', '.join(teams)})")
    return teams


#: One team or both, none twice.
Teams = Annotated[tuple[Side, ...], Field(min_length=1), AfterValidator(none_twice)]


class TrajectorySettings(Frozen):
    """How bodies are cleaned and velocities estimated.

    Attributes:
        gap_s: longest time between samples of one segment.
        window_s: full width of the centred least-squares window for velocities.
        window_samples: least number of samples in that window, at any sampling rate.
        hole_s: longest absence of a body over which its velocity estimate continues.
        jump_accept_s: time after which a body that stays at its new place counts as put there.
        reorder_s: greatest delay of a sample that is sorted back; a later sample means that the clock
            jumped back.
    """

    gap_s: Seconds = 0.5
    window_s: Seconds = 0.1
    window_samples: int = Field(default=3, ge=3, le=1_000_000)
    hole_s: Seconds = 0.2
    jump_accept_s: Seconds = 0.25
    reorder_s: Pause = 0.5


class GoalSettings(Frozen):
    """How goals are attributed (``pipeline.stages.goals.attribute``). The paper gives no times.

    Attributes:
        before_s: time before the goal whose contacts are considered first, and the longest time from a
            shot to the adversary's touch that deflects it.
        beside: how many times as wide as the goal the mark of such a shot is.
        line_s: time after a contact from which the ball's straight line is taken.
    """

    before_s: Seconds = 2.0
    beside: float = Field(default=2.0, ge=1, le=1000)
    line_s: Seconds = 0.1


class EventSettings(Frozen):
    """How events are found (``pipeline.stages.events``).

    Attributes:
        line_s: time after a touch from which the ball's straight line is taken.
        deflected_s: time from a shot to a goal that makes it that goal's shot, if only adversaries touch
            the ball between them.
        wide: greatest distance from the goal's middle at which a wide shot passes the goal line, in goal
            widths.
        wide_speed: least speed of a wide shot, m/s on the scale of VSSS (``Scales.speed``).
        wide_s: time within which a wide shot would reach the goal line at constant speed.
        join_s: longest time without contact that does not end a robot's pressure.
        won_s: time after a robot's pressure within which its team may win the ball by it.
    """

    line_s: Seconds = 0.1
    deflected_s: Seconds = 2.0
    wide: float = Field(default=1.0, ge=0.5, le=1000)
    wide_speed: Positive = 0.4
    wide_s: Seconds = 1.0
    join_s: Pause = 0.25
    won_s: Pause = 1.0


class AnalysisSettings(Frozen):
    """How analysts' tables are made (``pipeline.stages.analysis``).

    Leagues differ in pace. So some times are in *crossings*: one is the time of a run along the pitch at the
    league's top cruising speed, 22 s of people, 11 s in 2D, 4 s in SSL, 1.25 s in VSSS.

    Attributes:
        transition: time after a ball was won that is a transition, crossings.
        regain: time after a lost ball within which it counts as regained, crossings.
        sprint: least duration of a sprint, crossings.
        reaction: time for which each robot goes on as it moves before it runs to a place, crossings.
        hole_s: longest time between samples of a robot over which it covers a distance.
        space_each_s: time between the instants at which space is sampled.
    """

    transition: Amount = 0.25
    regain: Amount = 0.25
    sprint: Amount = 0.045
    reaction: Amount = 0.03
    hole_s: Seconds = 0.2
    space_each_s: Seconds = 1.0


class SituationSettings(Frozen):
    """How situations are recognised (docs/decisions/situations.md).

    Attributes:
        fire_at: a fuzzy condition holds from this degree on.
        flicker_s: longest failure of a lasting condition (with the ball, standing), or absence of the
            robot, that does not end it. Neighbouring samples are connected at any sampling rate.
        lull_s: the same for the motion that leads up to a situation.
        longest_s: longest duration of a situation.
        least_share: least share of an occurrence that occurrences of higher priority must leave free.
        random_least_s: least gap between situations that becomes 194; a shorter gap stays empty.
        random_longest_s: longest duration of one 194; a longer gap becomes several.
    """

    fire_at: float = Field(default=0.5, gt=0, le=1)
    flicker_s: Pause = 0.10
    lull_s: Pause = 0.134
    longest_s: Seconds = 2.0
    least_share: float = Field(default=0.3, ge=0, le=1)
    random_least_s: Pause = 0.2
    random_longest_s: Seconds = 1.0


#: Trees that weigh clues of measured robots: the beginning of their file's SHA-256. Receipts and keys say it,
#: so that other trees make options anew.
MEASURED_TREES = "6a231a10"
Robots = Annotated[
    Literal["arena", "measured"],
    BeforeValidator(lambda said: str(said).partition(", trees ")[0]),  # as a receipt says it, of any trees
    PlainSerializer(lambda robots: f"{robots}, trees {MEASURED_TREES}", return_type=str, when_used="json")]


class OptionSettings(Frozen):
    """How options are recovered from motion (``pipeline.stages.options``).

    Attributes:
        recover: whether they are recovered of all matches, for the table options; it costs twice as much as
            all other stages of a match together.
        window_s: length of a window: the time between two decisions of a team that thinks fast.
        sample_s: time between the samples that are looked at; of a quicker recording some are passed over.
        wheel_speed, wheel_acceleration, axle: limits of robots, m/s, m/s² and metres; by default as in the
            arena.
        robots: "measured": motors and bodies are as each recording shows them, not as in the arena.
        logged: whether what a team logged counts; otherwise motion alone tells.
        rounds: rounds in which habits are learned from the match; 0: all options stay equally probable.
        evidence: windows that the habits of a robot's role count for in each cell of what it sees.
    """

    recover: bool = False
    window_s: Seconds = 0.2
    sample_s: Seconds = 1 / 30
    wheel_speed: Positive = 1.2
    wheel_acceleration: Positive = 6.0
    axle: Positive = 0.071
    robots: Robots = Field(default="arena", exclude_if=lambda robots: robots == "arena")
    logged: bool = Field(default=True, exclude_if=lambda logged: logged)
    rounds: int = Field(default=10, ge=0, le=MANY)
    evidence: Positive = 20.0


class MomentSettings(Frozen):
    """Moments of play that are looked at, and how far ahead.

    Attributes:
        step_s: time between moments.
        horizon_s: time within which a team scores "soon".
    """

    step_s: Seconds = 0.2
    horizon_s: Seconds = 5.0


class ModelSettings(Frozen):
    """How the models of scoring soon, and of shots, are fitted.

    Attributes:
        matches_at_most: greatest number of matches of a league that models are fitted to.
        folds: models that are fitted, each without one part of the matches.
        block_s: with fewer matches than folds, parts are such stretches of time instead.
        moments_apart_s: time between moments that models are fitted to.
        goals_at_least: with fewer goals no model is fitted; the one that is shipped gives the values, at the
            level of these goals.
        boosting_goals: with fewer goals only the logistic models are fitted.
        evidence: weight of one moment, because the moments before a goal share it.
        penalty: standard deviation of the logistic coefficients before any match was seen, for features of
            standard deviation 1; those of shots, too.
        trees, learning_rate, leaves, leaf_samples, tree_penalty: scikit-learn's max_iter, learning_rate,
            max_leaf_nodes, min_samples_leaf and l2_regularization of histogram boosting.
        seed: seed of the boosting.
    """

    matches_at_most: Count = 64
    folds: int = Field(default=5, ge=2, le=MANY)
    block_s: Seconds = 60.0
    moments_apart_s: Seconds = 1.0
    goals_at_least: int = Field(default=10, ge=2, le=1 << 30)
    boosting_goals: int = Field(default=100, ge=2, le=1 << 30)
    evidence: float = Field(default=0.1, gt=0, le=1)
    penalty: Positive = 1.0
    trees: Count = 200
    learning_rate: float = Field(default=0.05, gt=0, le=1)
    leaves: int = Field(default=8, ge=2, le=MANY)
    leaf_samples: Count = 100
    tree_penalty: Amount = 5.0
    seed: int = Field(default=0, ge=0, lt=1 << 32)


class ValueSettings(Frozen):
    """How situations are valued by V.

    Attributes:
        goal_s: a robot's last situation before a goal ends with the goal if it ends so near to the end of
            play.
    """

    goal_s: Pause = 1.0


class ChanceSettings(Frozen):
    """When shots have expected goals.

    Attributes:
        goals_at_least: least number of goals among the shots of a league's other matches; with fewer a shot
            has no expected goals.
    """

    goals_at_least: Count = 30


class ActSettings(Frozen):
    """How V and the score go on after an act.

    Attributes:
        before_s: V before an act is that so long before it: at the act itself it is done.
        after_s: V after it is that so long after it.
        soon_s: a goal is said to follow it if it falls within this time.
    """

    before_s: Pause = 0.5
    after_s: Seconds = 2.0
    soon_s: Seconds = 8.0


class SideSettings(Frozen):
    """The sides of the matches that count, and for whom. By default each team makes knowledge of its own.

    Attributes:
        watch: sides that count.
        teams: names of teams or pools that count; not given: all.
        kind: league that counts; not given: all, each by itself.
        pools: teams that count as one, by the name of the pool; "*" stands for all other teams.
    """

    watch: Teams = ("home", "away")
    teams: tuple[str, ...] | None = Field(default=None, min_length=1)
    kind: Kind | None = None
    pools: dict[str, tuple[str, ...]] = Field(default={})

    @model_validator(mode="after")
    def _in_one_pool(self) -> Self:
        none_twice(tuple(name for names in self.pools.values() for name in names))
        return self


class GramSettings(Frozen):
    """How situations are valued and windowed (paper section 3.2.2).

    Attributes:
        of: table of which sequences are made: situations, as in the paper, or options (``options.recover``).
        outcome: value of a situation. "change": what it changes of V, goals included; a group's value is
            the sum of its situations'. "paper": alpha^t if the next goal is for the robot's team, -alpha^t
            if it is against; a group's value is the mean of its situations'.
        alpha: value of a situation that starts one tick before a goal.
        tick_s: the discrete time of the paper's exponent.
        gap_s: situations this far apart, or further, are not consecutive. Shorter holes are gaps that the
            recogniser leaves empty.
        ahead_s: time after a player's decision at which V is looked at again (table sights).
        watched_s: time between the moments at which robots of teams that log no decisions are watched (table
            sights); not given: they are not.
    """

    of: Literal["situations", "options"] = Field(
        default="situations", exclude_if=lambda of: of == "situations")
    outcome: Literal["change", "paper"] = "change"
    alpha: float = Field(default=0.998, gt=0, lt=1)
    tick_s: Seconds = 1 / 30
    gap_s: Seconds = 0.2
    ahead_s: Seconds = 1.0
    watched_s: Seconds | None = None


class RoundSettings(Frozen):
    """One round of the selection of behaviours.

    Attributes:
        n: length of the grams.
        rows, columns: size of the map, neurons.
        activation: least activations of a kept neuron, as a share of ``BehaviourSettings.share_of``.
    """

    n: int = Field(ge=1, le=4)
    rows: Count
    columns: Count
    activation: float = Field(gt=0, le=1)


class BehaviourSettings(Frozen):
    """How behaviours are selected (paper section 3.2.2).

    Attributes:
        rounds: rounds of the selection, the longest grams first, no length twice. A later round counts
            only the situations that earlier rounds leave. With "groups" and at most 1 / activation
            neurons, a map always keeps its busiest neuron.
        share_of: base of ``activation``. "groups": all groups of the round; each situation starts one,
            except the last few of a run. "situations": all situations recognised, also those that
            longer behaviours have used up.
        select_by: value that must exceed ``value_over``: "low", the lower end of the 95 % interval of the
            value, or "value" itself, which keeps the lucky ones.
        value_over: the limit of ``select_by``.
        usual: whether a role without any behaviour above the limit keeps what it usually does: the groups
            of the last round that lie on kept neurons, whatever they are worth.
        shrink: whether values are shrunk towards their families.
        support_at_least: least number of times that a behaviour was seen. The paper sets no limit, but
            the value of a group that was seen once depends on the next goal alone.
        keep_random: whether a group of nothing but "moves randomly" may become a behaviour; every state
            offers that action anyway.
        epochs: passes of the map's training over the distinct grams.
        sigma_end: spread of the map's last neighbourhood, neurons.
        seed: seed of the map.
    """

    rounds: tuple[RoundSettings, ...] = (
        RoundSettings(n=4, rows=3, columns=3, activation=0.10),
        RoundSettings(n=3, rows=3, columns=4, activation=0.08),
        RoundSettings(n=2, rows=4, columns=4, activation=0.06),
        RoundSettings(n=1, rows=5, columns=5, activation=0.04),
    )
    share_of: Literal["groups", "situations"] = "groups"
    select_by: Literal["low", "value"] = "low"
    value_over: float = Field(default=0.0, ge=-1e6, le=1e6)
    usual: bool = Field(default=False, exclude_if=lambda usual: not usual)
    shrink: bool = True
    support_at_least: Count = 3
    keep_random: bool = False
    epochs: Count = 20
    sigma_end: Positive = 0.5
    seed: int = Field(default=0, ge=0, lt=1 << 32)

    @field_validator("rounds")
    @classmethod
    def _longest_first(cls, rounds: tuple[RoundSettings, ...]) -> tuple[RoundSettings, ...]:
        lengths = [round_.n for round_ in rounds]
        if not lengths or lengths != sorted(set(lengths), reverse=True):
            found = ", ".join(map(str, lengths)) or "none"
            raise ValueError(f"there must be a round, and n must fall from each to the next (it is: {found})")
        return rounds


#: Keys by which a state is looked up where finer ones do not know it.
_BACKOFF: tuple[Key, ...] = ("self6", "role0")


def _coarser(key: Key) -> tuple[Key, ...]:
    """The usual keys of back-off behind a key."""
    return tuple(each for each in _BACKOFF if KEYS.index(each) > KEYS.index(key))


class HabitSettings(Frozen):
    """How habits of a team are learned from clues to its options (``pipeline.stages.options.of_team``).

    Attributes:
        rounds: rounds in which options and habits are learned from each other.
        windows_at_most: number of windows that are learned from: of the newest matches, or, where the options
            of all are recovered, every so manyth of each. Five matches of eight minutes have about so many.
        least_share: an option is a habit of a role that takes it in so great a share of its windows.
        doubt: probability that an option is none of the team's habits.
        trees, learning_rate, leaves, leaf_samples, tree_penalty: scikit-learn's max_iter, learning_rate,
            max_leaf_nodes, min_samples_leaf and l2_regularization of histogram boosting, for each option.
        round_trees, round_rate: trees and learning_rate in the rounds, before the habits that are kept; not
            given: as those.
        seed: decides which of several options a window is learned as.
    """

    rounds: Count = 3
    windows_at_most: Count = 36_000
    least_share: float = Field(default=0.005, ge=0, lt=1)
    doubt: float = Field(default=0.02, gt=0, le=1)
    trees: Count = 60
    learning_rate: float = Field(default=0.15, gt=0, le=1)
    leaves: int = Field(default=16, ge=2, le=MANY)
    leaf_samples: Count = 60
    tree_penalty: Amount = 2.0
    round_trees: Count | None = Field(default=None, exclude_if=lambda trees: trees is None)
    round_rate: float | None = Field(default=None, gt=0, le=1, exclude_if=lambda rate: rate is None)
    seed: int = Field(default=0, ge=0, lt=1 << 32)

    @property
    def of_rounds(self) -> Self:
        """The settings of the rounds."""
        return self.model_copy(update={"trees": self.round_trees or self.trees,
                                       "learning_rate": self.round_rate or self.learning_rate})


#: Settings of habits in a run that ends with a copy, unless it is told others: half of the time.
QUICK_ROUNDS: Mapping[str, float] = MappingProxyType({"round_trees": 20, "round_rate": 0.3})


class KnowledgeSettings(Frozen):
    """How occasions become knowledge.

    Attributes:
        state_key: elements of the state that are kept (docs/decisions/paper.md).
        backoff: further keys by which occasions are kept, each coarser than the one before, the first
            coarser than ``state_key``. A player uses them where it does not know the finer state. By default
            those of self6 and role0 that are coarser; the paper has none.
        optimistic: least initial action value of a behaviour in a state.
        imitate: team or pool whose behaviours policies choose from; not given: that of most matches, see
            ``pipeline.stages.sides.teams.imitated``. Its occasions hold the states of decisions, too.
        own: actions that a state gets because a player decided in it. "nothing": none. "moves randomly":
            that action (paper section 4: "all the new states have the action moving randomly"; there,
            states grow while playing and training, actions in training only). "chosen": also the chosen
            behaviour, if the knowledge holds it.
        accumulate: whether a version adds to the version before; otherwise it holds its matches alone. Habits
            are those of its own matches, or else of the version before.
        habits: how habits of the imitated team are learned.
        recover: how its options are recovered for them, of the newest matches alone; not given: habits are
            learned where the options of all matches are recovered. A policy that imitates sets it.
    """

    state_key: Key = "full36"
    backoff: tuple[Key, ...] = Field(default_factory=lambda said: _coarser(said.get("state_key", KEYS[0])))
    optimistic: float = Field(default=0.0, ge=-1e6, le=1e6)
    imitate: str | None = None
    own: Literal["nothing", "moves randomly", "chosen"] = "moves randomly"
    accumulate: bool = False
    habits: HabitSettings = Field(
        default=HabitSettings(), exclude_if=lambda habits: habits == HabitSettings())
    recover: OptionSettings | None = Field(default=None, exclude_if=lambda recover: recover is None)

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
        """All keys, from fine to coarse. A model with ``keys`` would look like a mapping, hence the name."""
        return (self.state_key, *self.backoff)


class AppraisalSettings(Frozen):
    """How actions are appraised by what a robot sees (``pipeline.stages.policies.appraise``).

    Attributes:
        codes: actions to choose from. "watched": those of the behaviours that the imitated team showed, by
            role. "all": every one that robots can do.
        watched: whether an action that was chosen too seldom for trees is appraised by what V did while the
            imitated team was seen doing it (``grams.watched_s``), if that was often enough.
        habits: V that an action is worth more where the imitated team takes it e times as probably, if the
            knowledge has its habits. An apprentice that has tried nothing yet plays as that team does.
        least_share: an action of a role is offered if it is the best at so great a share of the role's logged
            sights, or was never tried.
        trees, learning_rate, leaves, leaf_samples, tree_penalty, bins: scikit-learn's max_iter,
            learning_rate, max_leaf_nodes, min_samples_leaf, l2_regularization and max_bins of histogram
            boosting, for each action.
        expected_trees, expected_leaves: the same of what is expected of all actions together.
        seed: seed of its bins.
    """

    codes: Literal["watched", "all"] = "watched"
    watched: bool = False
    habits: Amount = Field(default=0.02, exclude_if=lambda habits: habits == 0.02)
    least_share: float = Field(default=0.03, ge=0, lt=1)
    trees: Count = 60
    learning_rate: float = Field(default=0.08, gt=0, le=1)
    leaves: int = Field(default=8, ge=2, le=MANY)
    leaf_samples: Count = 150
    expected_trees: Count = 120
    expected_leaves: int = Field(default=16, ge=2, le=MANY)
    tree_penalty: Amount = 20.0
    bins: int = Field(default=64, ge=2, le=255)
    seed: int = Field(default=0, ge=0, lt=1 << 32)


class PolicySettings(Frozen):
    """Batch Sarsa(lambda): the decisions of a batch, its start values, and the rule.

    Source: paper section 4. The values are ours, because the paper gives none.

    Attributes:
        learner: "imitation": a team takes the option that the imitated team most probably takes at what it
            sees, by the habits that the knowledge has of it (``knowledge.habits``); Sarsa(lambda) gives each
            a value. Where options of that team cannot be recovered, the learner is "sarsa". "sarsa": it looks
            up the behaviour of the greatest value in its state, and values come from Sarsa(lambda). "sight":
            it takes the action that trees, fitted to what V did after each action of the logged decisions,
            appraise highest at what it sees; again Sarsa(lambda) gives each its mean value in a role. In
            seasons the default is "sarsa".
        appraisals: settings of "sight".
        learn_from: decisions to learn from. "chosen": logged by a player. "seen": read from the situations
            of a match. "both": all.
        last_matches: number of the newest matches of the knowledge to learn from; not given: all.
        parent: whether values start from the newest policy; otherwise from the knowledge.
        new_pairs: start of a pair that the parent does not have. "optimistic": the greatest value known in
            its state (paper section 3.2.2). "outcome": the mean value of its own outcomes.
        rule: "sarsa": Sarsa(lambda) alone. "influence": the influence values of the robot's team-mates
            (paper section 2.3.4) are added to its TD error.
        influence: beta of equation 4, the same between all team-mates, inside the learning rate's bracket
            as equation 7 is printed. The paper's own is 0.1. "sarsa" does not read it.
        steps: "constant", or "average": one over the number of episodes in which the pair was seen, so
            that a value is the mean of its outcomes (Sutton and Barto, 2nd edition, section 2.4).
        step_size: alpha. With "average" it is the least step: 0.01 follows the last 100 episodes.
        start_evidence: number of episodes that a pair's start value counts for, with "average".
        discount: gamma per second of elapsed time (semi-Markov). 0.95 is 0.98 per decision of 0.4 s, and
            close to the value of situations (0.998 per tick of 1/30 s is 0.942 per second).
        trace_decay: lambda per decision.
        traces: replacing or accumulating.
        sweeps: passes over the batch.
    """

    learner: Literal["imitation", "sarsa", "sight"] = "imitation"
    appraisals: AppraisalSettings = AppraisalSettings()
    learn_from: Literal["chosen", "seen", "both"] = "both"
    last_matches: Count | None = None
    parent: bool = True
    new_pairs: Literal["optimistic", "outcome"] = "optimistic"
    rule: Literal["sarsa", "influence"] = "sarsa"
    influence: Amount = 0.1
    steps: Literal["constant", "average"] = "constant"
    step_size: float = Field(default=0.1, gt=0, le=1)
    start_evidence: Amount = 0.0
    discount: float = Field(default=0.95, gt=0, le=1)
    trace_decay: float = Field(default=0.9, ge=0, le=1)
    traces: Literal["replacing", "accumulating"] = "replacing"
    sweeps: Count = 5


class Settings(Frozen):
    """All settings of a run. A TOML file has one table for each stage."""

    trajectories: TrajectorySettings = TrajectorySettings()
    goals: GoalSettings = GoalSettings()
    situations: SituationSettings = SituationSettings()
    options: OptionSettings = Field(
        default=OptionSettings(), exclude_if=lambda options: options == OptionSettings())
    events: EventSettings = EventSettings()
    analysis: AnalysisSettings = Field(
        default=AnalysisSettings(), exclude_if=lambda analysis: analysis == AnalysisSettings())
    moments: MomentSettings = MomentSettings()
    models: ModelSettings = ModelSettings()
    chances: ChanceSettings = ChanceSettings()
    values: ValueSettings = ValueSettings()
    acts: ActSettings = Field(default=ActSettings(), exclude_if=lambda acts: acts == ActSettings())
    sides: SideSettings = SideSettings()
    grams: GramSettings = GramSettings()
    behaviours: BehaviourSettings = BehaviourSettings()
    knowledge: KnowledgeSettings = KnowledgeSettings()
    policies: PolicySettings = PolicySettings()

    @model_validator(mode="after")
    def _options_are_recovered(self) -> Self:
        if not self.options.recover and self.grams.of == "options":
            raise ValueError("grams of options need recover = true in the table options")
        return self

    @model_validator(mode="after")
    def _habits_are_learned(self) -> Self:
        if self.policies.learner == "imitation":
            stage, known, said = self.options, self.knowledge, self.knowledge.habits
            own = dict(QUICK_ROUNDS) if {"trees", *QUICK_ROUNDS}.isdisjoint(said.model_fields_set) else {}
            changed: dict[str, Frozen] = {"habits": HabitSettings.model_construct(
                said.model_fields_set, **{**dict(said), **own})}
            if not stage.recover and known.recover is None:
                changed["recover"] = stage.model_copy(update={"recover": True})
            # a frozen model sets what follows from its other settings
            object.__setattr__(self, "knowledge", known.model_copy(update=changed))
        return self

    @property
    def sequences(self) -> GramSettings:
        """The settings that sequences of situations depend on."""
        return self.grams

    @property
    def decisions(self) -> Frozen:
        """Decisions depend on no settings but those of what they are made from."""
        return Frozen()


#: The greatest limit on a size, in its own unit; a larger number of bytes could overflow.
_LARGEST = 1 << 20


class ImportSettings(Frozen):
    """Limits on the cost of reading one recording. A recording that needs more is refused.

    Attributes:
        megabytes: size of the file, and of its content when it is unpacked.
        rows: rows of a table, or lines of a text.
        line_kilobytes: length of a line of a text.
        robots: robots of a team.
        goals: goals of a match, those that were taken back counted twice.
        isolate: whether each recording is read in a process of its own, so that one that brings its reader
            down stops nothing. None: only under ``pitchlore serve``. Football always is.
        seconds: how long that process may take; football's four times as long.
        memory_megabytes: how much memory that process may take; football's four times as much.
    """

    megabytes: int = Field(default=1024, ge=1, le=_LARGEST)
    rows: int = Field(default=4_000_000, ge=1, le=1 << 30)
    line_kilobytes: int = Field(default=1024, ge=1, le=_LARGEST)
    robots: Count = 128
    goals: Count = 1000
    isolate: bool | None = None
    seconds: float = Field(default=120.0, gt=0, le=86_400)
    memory_megabytes: int = Field(default=4096, ge=256, le=_LARGEST)

    def isolated(self) -> ImportSettings:
        """The same limits, with each recording read in a process of its own."""
        return self.model_copy(update={"isolate": True})


#: Words for a place where work is done.
PLACE = re.compile(
    r"(?P<kind>threads|processes|dask:local)(:(?P<width>[1-9]\d{0,2}))?|dask://(?P<address>[\w.\[\]:-]+:\d+)")


class PlacementSettings(Frozen):
    """Where pieces of work are done: matches read and played, outputs of stages, games, pairs, sweeps.

    Attributes:
        on: threads:N of the command's process; processes:N; dask:local:N, a Dask cluster of N processes for
            this command; or dask://HOST:PORT, a cluster's scheduler. Without ``:N`` there are as many as the
            machine has cores. None: what PITCHLORE_ON says in the environment, else processes.
    """

    on: str | None = Field(default=None, pattern=f"^({PLACE.pattern})$")


class HistorySettings(Frozen):
    """How much of past runs is remembered.

    Attributes:
        runs: runs in the data folder's log, which `pitchlore runs` lists; 0 keeps none.
        days: days after which our own flow runs are removed from Prefect's database; 0 removes none.
    """

    runs: int = Field(default=100, ge=0, le=10_000)
    days: int = Field(default=28, ge=0, le=36_500)


class ScoutSettings(Frozen):
    """The scout's pages.

    Attributes:
        refresh: whether each run writes the pages whose matches are new.
        mine: name of the team that a run and the first page tell of; empty: both teams of the newest match.
    """

    refresh: bool = False
    mine: str = ""


class RunSettings(Settings):
    """All settings of a run, and those on which no outcome depends: imports, placement, history, scout."""

    imports: ImportSettings = ImportSettings()
    placement: PlacementSettings = PlacementSettings()
    history: HistorySettings = HistorySettings()
    scout: ScoutSettings = ScoutSettings()


def parse_settings(data: bytes, where: str) -> RunSettings:
    """The defaults, overridden by a TOML file.

    Args:
        data: the file's bytes.
        where: its name, for errors.

    Raises:
        BadSettings: if it is not TOML, or has a key or value that does not fit; names the first.
    """
    keys = "Mend it; docs/how-to/settings.md says where all keys are"
    return fitted(RunSettings, toml_tables(data, where), where, keys)
