"""Section 5 of the paper once more, literally: dicts, lists and the printed equations, and no haste.

A rule is a class, an agent an object, and what it knows its own dicts, by what it saw and did. Random numbers are drawn in the order that :func:`pipeline.stages.paradigms.runner.play_runs` documents.
"""

import math
from collections import defaultdict
from dataclasses import dataclass, field
from itertools import product
from types import SimpleNamespace
from typing import Any, NamedTuple

#: Changes of a value beyond this many times the learning rate are a run that diverged.
BOUND = 1e9


# -- the games --------------------------------------------------------------------------------------------


class Step(NamedTuple):
    """Outcome of a joint action: a state, equally likely rewards (one an agent), two facts."""

    after: Any
    outcomes: list
    ended: bool
    success: bool


class MatrixGame:
    """A payoff that is played again and again; a cell is a number, or several that are equally likely."""

    start = "again"

    def __init__(self, payoff, agents):
        self.payoff, self.agents, self.actions = payoff, agents, len(payoff)
        means = {}
        for joint in product(range(self.actions), repeat=agents):
            cell = self.cell(joint)
            means[joint] = sum(cell) / len(cell)
        self.best = {joint for joint, mean in means.items() if mean == max(means.values())}

    def cell(self, joint):
        cell = self.payoff
        for action in joint:
            cell = cell[action]
        return cell if isinstance(cell, (tuple, list)) else [cell]

    def step(self, state, joint):
        outcomes = [[float(reward)] * self.agents for reward in self.cell(joint)]
        return Step(state, outcomes, ended=False, success=tuple(joint) in self.best)

    def sees(self, agent, state, observes):
        return state


class GridWorld:
    """Section 5: from (5, 1) and (5, 5) to (3, 3) or (1, 3) at the same time, rows and columns from 1."""

    agents, actions = 2, 4
    start = ((5, 1), (5, 5))

    def __init__(self, k):
        self.k = k

    def step(self, state, joint):
        after = []
        for (row, column), action in zip(state, joint, strict=True):
            down, right = [(-1, 0), (1, 0), (0, -1), (0, 1)][action]
            after.append((min(5, max(1, row + down)), min(5, max(1, column + right))))
        after = tuple(after)
        if after == ((3, 3), (3, 3)):
            return Step(after, [[10.0, 10.0]], ended=True, success=True)
        if after == ((1, 3), (1, 3)):
            return Step(after, [[5.0, 5.0]], ended=True, success=False)
        reward = -self.k if (3, 3) in after else 0.0
        return Step(after, [[reward, reward]], ended=False, success=False)

    def sees(self, agent, state, observes):
        return state if observes == "joint" else state[agent]


# -- choosing ---------------------------------------------------------------------------------------------


def boltzmann(values, temperature):
    best = max(values)
    if temperature == 0:
        return [1.0 if value == best else 0.0 for value in values]
    return [math.exp((value - best) / temperature) for value in values]


def epsilon_greedy(values, epsilon):
    greedy = [a for a, value in enumerate(values) if value == max(values)]
    return [(1 - epsilon) * (a in greedy) / len(greedy) + epsilon / len(values) for a in range(len(values))]


def mixed(policy, epsilon):
    return [(1 - epsilon) * p + epsilon / len(policy) for p in policy]


#: By the number of a ActionSelection.
SELECTIONS = [boltzmann, epsilon_greedy, mixed]


def pick(weights, u):
    target, reached = u * sum(weights), 0.0
    for a, weight in enumerate(weights):
        reached += weight
        if target < reached:
            return a
    return max(a for a, weight in enumerate(weights) if weight > 0)


# -- the rules --------------------------------------------------------------------------------------------


class Moment(NamedTuple):
    """One step, of every agent: what it saw, did, got, and sees now; and whether the episode ended."""

    saw: list
    did: list
    got: list
    sees: list
    ended: bool


@dataclass
class IQ:
    """Equation 1."""

    settings: Any
    me: int
    actions: range
    agents: int
    q: dict = field(default_factory=dict)

    def __post_init__(self):
        self.prepare()

    def prepare(self):
        pass

    def key(self, m):
        return m.saw[self.me], m.did[self.me]

    def value(self, s, a):
        return self.q.get((s, a), self.settings.initial)

    def options(self):
        return self.actions

    def best(self, s):
        return max(self.value(s, a) for a in self.options())

    def surprise(self, m):
        """The bracket of equations 1, 2 and (but for the influence value) 7."""
        coming = 0.0 if m.ended else self.settings.discount * self.best(m.sees[self.me])
        return m.got[self.me] + coming - self.value(*self.key(m))

    def change(self, team, m, coin):
        return self.settings.step_size * self.surprise(m)

    def move(self, m, change):
        self.q[self.key(m)] = self.value(*self.key(m)) + change

    def note(self, m):
        pass

    def worth(self, sees):
        return [self.value(sees[self.me], a) for a in self.actions]

    def weights(self, sees, selection, temperature):
        return SELECTIONS[selection](self.worth(sees), temperature)


class Share:
    """How often an agent that is somewhere does something: of all times, or by recency."""

    def __init__(self, recency, actions):
        self.recency, self.actions = recency, actions
        self.times, self.been = defaultdict(int), defaultdict(int)
        self.recent = defaultdict(lambda: 1 / len(actions))

    def count(self, s, a):
        self.been[s] += 1
        self.times[s, a] += 1
        for other in self.actions:
            if other == a:
                self.recent[s, other] += self.recency * (1 - self.recent[s, other])
            else:
                self.recent[s, other] -= self.recency * self.recent[s, other]

    def __call__(self, s, a, unseen):
        if s not in self.been:
            return unseen
        return self.recent[s, a] if self.recency else self.times[s, a] / self.been[s]


class JAQ(IQ):
    """Equations 2 and 3; an agent counts for itself what it sees the others do."""

    def prepare(self):
        others = [j for j in range(self.agents) if j != self.me]
        self.beliefs = {j: Share(self.settings.recency, self.actions) for j in others}
        self.joint = list(product(self.actions, repeat=self.agents))

    def key(self, m):
        return m.saw[self.me], tuple(m.did)

    def options(self):
        return self.joint

    def note(self, m):
        for j, belief in self.beliefs.items():
            belief.count(m.saw[j], m.did[j])

    def worth(self, sees):
        expected = []
        for own in self.actions:
            total = 0.0
            for joint in self.joint:
                if joint[self.me] == own:
                    chance = 1.0
                    for j, belief in self.beliefs.items():
                        chance *= belief(sees[j], joint[j], unseen=1 / len(self.actions))
                    total += self.value(sees[self.me], joint) * chance
            expected.append(total)
        return expected


class IVQ(IQ):
    """Equations 4 to 7 and their readings."""

    def prepare(self):
        self.occurrence = Share(self.settings.recency, self.actions)

    def note(self, m):
        self.occurrence.count(*self.key(m))

    def pe(self, m):
        """Pe of what this agent did, as others see it who judge the moment before it is noted."""
        s, a = self.key(m)
        if not self.settings.present:
            return self.occurrence(s, a, unseen=0.0)
        if self.settings.recency:
            share = self.occurrence(s, a, unseen=1 / len(self.actions))
            return share + self.settings.recency * (1 - share)
        return (self.occurrence.times[s, a] + 1) / (self.occurrence.been[s] + 1)

    def rv(self, m):
        discount = self.settings.opinion_discount
        if discount is None:
            discount = self.settings.discount
        coming = 0.0 if m.ended else discount * self.best(m.sees[self.me])
        return m.got[self.me] + coming - self.value(*self.key(m))

    def op(self, other, m):
        """The opinion of this agent about what another did."""
        rv, pe = self.rv(m), other.pe(m)
        return rv * pe if rv <= 0 else rv * (1 - pe)

    def change(self, team, m, coin):
        iv = sum(self.settings.influence * other.op(self, m) for other in team if other is not self)
        if self.settings.bracket == "inside":
            return self.settings.step_size * (self.surprise(m) + iv)
        return self.settings.step_size * self.surprise(m) + iv


class TeamQ(IQ):
    """Section 2.3.1: equation 1 in a game of one agent, who orders all and gets the mean of what they get."""

    @staticmethod
    def alone(game):
        def step(state, joint):
            after, outcomes, *facts = game.step(state, orders[joint[0]])
            return Step(after, [[sum(got) / len(got)] for got in outcomes], *facts)

        orders = list(product(range(game.actions), repeat=game.agents))
        return SimpleNamespace(agents=1, actions=len(orders), start=game.start, step=step, sees=game.sees)


class Hysteretic(IQ):
    """Matignon, Laurent and Le Fort-Piat 2007."""

    def change(self, team, m, coin):
        surprise = self.surprise(m)
        return (self.settings.step_size if surprise >= 0 else self.settings.decrease) * surprise


class FMQ(IQ):
    """Kapetanakis and Kudenko 2002; all rewards are remembered."""

    def prepare(self):
        self.rewards = defaultdict(list)

    def note(self, m):
        self.rewards[self.key(m)].append(m.got[self.me])

    def worth(self, sees):
        expected = []
        for a in self.actions:
            heuristic = 0.0
            if seen := self.rewards.get((sees[self.me], a)):
                heuristic = self.settings.weight * (seen.count(max(seen)) / len(seen)) * max(seen)
            expected.append(self.value(sees[self.me], a) + heuristic)
        return expected


class Lenient(IQ):
    """Panait, Sullivan and Luke 2006."""

    def prepare(self):
        self.taken = defaultdict(int)

    def change(self, team, m, coin):
        surprise = self.surprise(m)
        temperature = self.settings.temperature * self.settings.cooling ** self.taken[self.key(m)]
        if surprise < 0 and coin < 1 - math.exp(-self.settings.leniency * temperature):
            return 0.0
        return self.settings.step_size * surprise

    def note(self, m):
        self.taken[self.key(m)] += 1


class Distributed(IQ):
    """Lauer and Riedmiller 2000; values that differ by rounding alone are the same."""

    def prepare(self):
        self.policy = {}

    def change(self, team, m, coin):
        return max(0.0, self.settings.step_size * self.surprise(m))

    def move(self, m, change):
        s = m.saw[self.me]
        before = self.best(s)
        super().move(m, change)
        if self.best(s) > before + 1e-9 * abs(before):
            self.policy[s] = m.did[self.me]

    def weights(self, sees, selection, temperature):
        values, kept = self.worth(sees), self.policy.get(sees[self.me])
        settled = temperature == 0 or SELECTIONS[selection] is epsilon_greedy
        if settled and kept is not None:
            values = [1.0 if a == kept else 0.0 for a in self.actions]
        return SELECTIONS[selection](values, temperature)


class WoLFPHC(IQ):
    """Bowling and Veloso 2002, Table 4 of the publication, with constant steps."""

    def prepare(self):
        self.visits = defaultdict(int)
        self.policy = defaultdict(lambda: [1 / len(self.actions)] * len(self.actions))
        self.mean = defaultdict(lambda: [1 / len(self.actions)] * len(self.actions))

    def note(self, m):
        s = m.saw[self.me]
        values = [self.value(s, a) for a in self.actions]
        policy, mean = self.policy[s], self.mean[s]
        self.visits[s] += 1
        for a in self.actions:
            mean[a] += (policy[a] - mean[a]) / self.visits[s]
        wins = sum(map(math.prod, zip(policy, values, strict=True))) > sum(
            map(math.prod, zip(mean, values, strict=True)))
        delta = self.settings.winning if wins else self.settings.losing
        greedy = [a for a in self.actions if values[a] == max(values)]
        moved = 0.0
        for a in self.actions:
            if a not in greedy:
                share = min(policy[a], delta / (len(self.actions) - 1))
                policy[a] -= share
                moved += share
        for a in greedy:
            policy[a] += moved / len(greedy)

    def worth(self, sees):
        return self.policy[sees[self.me]]


#: All rules above, by the name of the settings' class.
KINDS = {kind.__name__: kind for kind in (IQ, *IQ.__subclasses__())}


# -- training and testing ---------------------------------------------------------------------------------


@dataclass
class Played:
    """Result of one run, and the team that played it."""

    team: list
    diverged: bool = False
    success: float = 0.0
    length: float = math.nan
    last: tuple | None = None


def train(rng, game, settings, training):
    """A team, and whether a change of a value was beyond all bounds."""
    kind = KINDS[type(settings).__name__]
    team = [kind(settings, me, range(game.actions), game.agents) for me in range(game.agents)]
    temperatures = [float(temperature) for temperature in training.temperatures]
    state, ticks, steps = game.start, 0, 0
    while ticks < len(temperatures):
        saw = [game.sees(i, state, settings.observes) for i in range(game.agents)]
        did = choose(rng, team, saw, int(training.selection), temperatures[ticks])
        step = game.step(state, did)
        got = step.outcomes[0]
        if len(step.outcomes) > 1:
            got = step.outcomes[int(rng.random() * len(step.outcomes))]
        sees = [game.sees(i, step.after, settings.observes) for i in range(game.agents)]
        moment = Moment(saw, did, got, sees, step.ended)
        if not update(rng, team, moment, settings):
            return team, True
        state = step.after
        steps += 1
        episode_over = step.ended or steps >= training.episode_steps
        if episode_over:
            state, steps = game.start, 0
        if episode_over or training.tick == "step":
            ticks += 1
    return team, False


def choose(rng, team, sees, selection, temperature):
    return [pick(agent.weights(sees, selection, temperature), rng.random()) for agent in team]


def update(rng, team, moment, settings):
    """True if all changes are within bounds."""
    changes = []
    for agent in team:
        coin = rng.random() if settings.TOSSES else None
        change = agent.change(team, moment, coin)
        if not abs(change) < BOUND * settings.step_size:
            return False
        if settings.order == "in turn":
            agent.move(moment, change)
        changes.append(change)
    if settings.order == "simultaneous":
        for agent, change in zip(team, changes, strict=True):
            agent.move(moment, change)
    for agent in team:
        agent.note(moment)
    return True


def play(rng, game, settings, training, testing):
    """One run: training, then the tests of what was learned."""
    game = TeamQ.alone(game) if type(settings).__name__ == "TeamQ" else game
    team, diverged = train(rng, game, settings, training)
    if diverged:
        return Played(team, diverged=True)
    lengths, last = [], None
    for _ in range(testing.tests):
        state = game.start
        for number in range(1, testing.steps + 1):
            sees = [game.sees(i, state, settings.observes) for i in range(game.agents)]
            last = choose(rng, team, sees, int(training.selection), testing.temperature)
            step = game.step(state, last)
            if step.success:
                lengths.append(number)
            if step.success or step.ended:
                break
            state = step.after
    return Played(
        team, success=len(lengths) / testing.tests, last=tuple(last),
        length=sum(lengths) / len(lengths) if lengths else math.nan,
    )
