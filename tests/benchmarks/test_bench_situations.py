"""Situations: fuzzy conditions against scikit-fuzzy's two ways, and the whole recogniser.

The rows are the signals of one robot in the recorded match; the conditions are those of all rules about
the robot itself. scikit-fuzzy's control simulation gets them as its own rules, one consequent for all
(it has no ``very``: such a condition goes without); its arithmetic way is `trapmf` and numpy's minimum.
"""

import ast
from collections.abc import Callable
from functools import reduce
from operator import and_, or_
from typing import Any, NamedTuple

import numpy as np
import pytest
import skfuzzy
from skfuzzy import control
from support.recordings import RSIM, bodies_of, imported

from pitchlore.pipeline.game.pitch import SCALES, Kind
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations import conditions, fuzzy, signals
from pitchlore.pipeline.stages.situations.conditions import execute
from pitchlore.pipeline.stages.situations.dense import dense_match
from pitchlore.pipeline.stages.situations.recognise import recognise
from pitchlore.pipeline.stages.situations.rulebook import compiled, variable_of
from pitchlore.pipeline.stages.situations.rules import MACROS, RULES, Start

TERMS = fuzzy.terms(SCALES[Kind.VSSS])
OWN = compiled(Kind.VSSS)["own"]
TEXTS = [
    text for place in OWN.places for rule in [RULES[place]]
    for text in ([rule.initial] if rule.start == Start.WHILE else [rule.initial, rule.final])
]
BLOCK = 512


@pytest.fixture(scope="module")
def rows():
    """Signals OWN of one robot, float64 [len(OWN), N]; no NaN, which the control simulation refuses."""
    scene = dense_match(bodies_of(RSIM), SCALES[Kind.VSSS])
    distances = signals.ball_distances(scene.poses, scene.ball)
    near = signals.nearest_to_ball(distances, scene.team == 1, scene.ball)
    n = len(scene.t_ns)
    out = np.empty((len(signals.OWN), n))
    signals.fill_own(np.ascontiguousarray(scene.poses[:, 0]), scene.ball, near, near, 0, n, -0.75, 2, out)
    return np.ascontiguousarray(out[:, ~np.isnan(out).any(axis=0)])


@pytest.mark.benchmark(group=f"{len(TEXTS)} fuzzy conditions")
def test_ours(timed, rows):
    n = rows.shape[1] // BLOCK * BLOCK
    registers = np.empty((OWN.program.registers, BLOCK))

    def run():
        for at in range(0, n, BLOCK):
            registers[: len(rows)] = rows[:, at:at + BLOCK]
            execute(OWN.program.steps, OWN.program.lines, registers, BLOCK)

    timed(n, "rows", run, rounds=20, warmup_rounds=1)


def built(text: str, leaf: Callable, very: Callable) -> Any:
    """A condition from what ``leaf`` makes of a signal and a term, by the operators &, | and ~."""

    def joined(op: ast.boolop, parts: list) -> Any:
        return reduce(and_ if isinstance(op, ast.And) else or_, parts)

    def of(node: ast.expr) -> Any:
        match node:
            case ast.Name(id=macro):
                return built(MACROS[macro], leaf, very)
            case ast.Compare(left=ast.Name(id=signal), comparators=[ast.Name(id=term)]):
                return leaf(signal, term)
            case ast.Compare(left=ast.Name(id=signal), comparators=[ast.BoolOp(op=op, values=terms)]):
                return joined(op, [leaf(signal, term.id) for term in terms])
            case ast.BoolOp(op=op, values=values):
                return joined(op, [of(value) for value in values])
            case ast.UnaryOp(operand=operand):
                return ~of(operand)
            case ast.Call(args=[operand]):
                return very(of(operand))

    return of(ast.parse(text, mode="eval").body)


class Degree(NamedTuple):
    """Degrees by numpy, with no sharing."""

    x: np.ndarray

    def __and__(self, other):
        return Degree(np.minimum(self.x, other.x))

    def __or__(self, other):
        return Degree(np.maximum(self.x, other.x))

    def __invert__(self):
        return Degree(1 - self.x)


def degree(text: str, rows: np.ndarray) -> np.ndarray:
    """The same by scikit-fuzzy's memberships and numpy."""

    def leaf(signal, term):
        return Degree(fuzzy.membership(TERMS[variable_of(signal)][term], rows[signals.OWN.index(signal)]))

    return built(text, leaf, lambda found: Degree(found.x ** 2)).x


@pytest.mark.benchmark(group=f"{len(TEXTS)} fuzzy conditions")
def test_skfuzzy_trapmf_and_numpy(timed, rows):
    some = rows[:, :2_000]
    found = timed(some.shape[1], "rows", lambda: [degree(text, some) for text in TEXTS], rounds=20)
    code = conditions.compile_conditions(
        TEXTS, MACROS, signals.OWN, lambda signal, term: fuzzy.lines(TERMS[variable_of(signal)][term])
    )
    registers = np.empty((code.registers, some.shape[1]))
    registers[: len(some)] = some
    execute(code.steps, code.lines, registers, some.shape[1])
    np.testing.assert_allclose(registers[code.outputs], found, atol=1e-9)


def simulation() -> control.ControlSystemSimulation:
    """Our conditions as scikit-fuzzy control rules."""
    antecedents: dict[str, control.Antecedent] = {}
    for signal in signals.OWN:
        terms = TERMS[variable_of(signal)]
        ends = [corner for term in terms.values() for corner in term if abs(corner) < fuzzy.FAR_OFF]
        variable = control.Antecedent(np.linspace(min(ends) - 1, max(ends) + 1, 101), signal)
        for name, term in terms.items():
            variable[name] = skfuzzy.trapmf(variable.universe, term)
        antecedents[signal] = variable
    situation = control.Consequent(np.arange(len(TEXTS) + 2), "situation")

    rules = []
    for place, text in enumerate(TEXTS):
        situation[str(place)] = skfuzzy.trimf(situation.universe, [place, place + 1, place + 2])
        condition = built(text, lambda signal, term: antecedents[signal][term], lambda found: found)
        rules.append(control.Rule(condition, situation[str(place)]))
    return control.ControlSystemSimulation(control.ControlSystem(rules))


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # scikit-fuzzy's use of this numpy
@pytest.mark.benchmark(group=f"{len(TEXTS)} fuzzy conditions")
def test_skfuzzy_control_with_arrays(timed, rows):
    some = rows[:, 2_000:4_000]
    asks = simulation()
    used = {variable.label for variable in asks.ctrl.antecedents}

    def run():
        asks.reset()
        asks.inputs({signal: row for signal, row in zip(signals.OWN, some, strict=True) if signal in used})
        asks.compute()

    timed(some.shape[1], "rows", run, rounds=3, warmup_rounds=1)


@pytest.mark.benchmark(group="whole recogniser")
def test_ours_whole(timed):
    table, pitch, options = bodies_of(RSIM), imported(RSIM).info.pitch, SituationSettings()
    recognise(table, pitch, options)
    timed(table.filter(table["team"] != "ball").height, "robot-samples", recognise, (table, pitch, options), rounds=20)
