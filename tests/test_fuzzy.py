"""The fuzzy language: its terms are scikit-fuzzy's, its conditions mean what they say."""

import ast
from math import isnan, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.pitch import SCALES, Kind
from pitchlore.pipeline.stages.situations import fuzzy, signals
from pitchlore.pipeline.stages.situations.conditions import compile_conditions, execute
from pitchlore.pipeline.stages.situations.fuzzy import Trapezoid, Variable
from pitchlore.pipeline.stages.situations.matching import ROUNDING
from pitchlore.pipeline.stages.situations.rulebook import variable_of
from pitchlore.pipeline.stages.situations.rules import MACROS, RULES

ALL_TERMS = [
    pytest.param(term, domain, id=f"{kind} {variable} {name}")
    for kind in Kind
    for variable, terms in fuzzy.terms(SCALES[kind]).items()
    for domain in [{
        Variable.DISTANCE: (0, 200), Variable.ORIENTATION: (0, pi), Variable.BEARING: (0, pi),
        Variable.PLAYING_TIME: (0, 600), Variable.VELOCITY: (-40, 40),
    }[variable]]
    for name, term in terms.items()
]
#: Values that signals have on a small pitch.
DOMAINS = {
    Variable.DISTANCE: (0, 1.2), Variable.ORIENTATION: (0, pi), Variable.BEARING: (0, pi), Variable.VELOCITY: (-1, 1)}


def run(text: str, values: dict[str, list[float]], terms: dict[str, Trapezoid], macros=None) -> np.ndarray:
    """Degrees of one condition by the compiled code."""
    code = compile_conditions([text], macros or {}, list(values), lambda _, term: fuzzy.lines(terms[term]))
    n = len(next(iter(values.values())))
    registers = np.empty((code.registers, n))
    registers[: len(values)] = list(values.values())
    execute(code.steps, code.lines, registers, n)
    return registers[code.outputs[0]]


LOW, HIGH = Trapezoid(0, 0, 1, 3), Trapezoid(1, 3, fuzzy.FAR_OFF, fuzzy.FAR_OFF)


class TestTerms:
    @pytest.mark.parametrize(("term", "domain"), ALL_TERMS)
    def test_fast_is_scikit_fuzzys(self, term, domain):
        """The compiled membership equals scikit-fuzzy's."""
        rng = np.random.default_rng(0)
        corners = np.array([c for c in term if abs(c) < fuzzy.FAR_OFF])
        near = (corners[:, None] + np.array([-1e-3, -1e-9, 0, 1e-9, 1e-3])).ravel()
        x = np.concatenate([rng.uniform(*domain, 2_000), np.clip(near, *domain), domain])
        fast = run("x is T", {"x": list(x)}, {"T": term})
        np.testing.assert_allclose(fast, fuzzy.membership(term, x), rtol=0, atol=1e-9)

    @pytest.mark.parametrize("kind", list(Kind))
    def test_neighbours_sum_to_one(self, kind):
        """The terms of each division of a variable sum up to one everywhere."""
        of = fuzzy.terms(SCALES[kind])
        distances, bearings = of[Variable.DISTANCE], of[Variable.BEARING]
        coarse = {name: bearings.pop(name) for name in ("TOWARDS", "ACROSS", "AWAY")}
        del distances["BODY"]  # a part of CONTACT
        for terms in (*of.values(), coarse):
            corners = np.unique([c for term in terms.values() for c in term if abs(c) < fuzzy.FAR_OFF])
            x = np.linspace(corners[0], corners[-1], 5_001)
            np.testing.assert_allclose(sum(fuzzy.membership(term, x) for term in terms.values()), 1, atol=1e-9)

    def test_small_leagues_numbers(self):
        """The small league's terms have the corners listed here."""
        terms = fuzzy.terms(SCALES[Kind.VSSS])
        expected = {
            "CONTACT": (0, 0, 0.070, 0.085), "CLOSE": (0.070, 0.085, 0.15, 0.25), "NEAR": (0.15, 0.25, 0.35, 0.55),
            "FAR": (0.35, 0.55, 0.75, 0.95), "VERY_FAR": (0.75, 0.95, fuzzy.FAR_OFF, fuzzy.FAR_OFF),
        }
        for name, corners in expected.items():
            assert terms[Variable.DISTANCE][name] == pytest.approx(corners)
        assert terms[Variable.VELOCITY]["FASTER"] == pytest.approx((0.05, 0.10, 0.40, 0.60))
        assert terms[Variable.VELOCITY]["SLOWER"] == pytest.approx((-0.60, -0.40, -0.10, -0.05))

    @pytest.mark.parametrize("kind", list(Kind))
    def test_crossings_are_the_scales(self, kind):
        """Terms of distance cross at the league's scales."""
        scales, terms = SCALES[kind], fuzzy.terms(SCALES[kind])[Variable.DISTANCE]
        assert fuzzy.crossings(terms.pop("BODY")) == (None, pytest.approx(scales.body))
        crossings = [fuzzy.crossings(term) for term in terms.values()]
        ends = [scales.contact, scales.close, scales.near, scales.far]
        assert [falls for _, falls in crossings] == pytest.approx([*ends, None])
        assert [rises for rises, _ in crossings] == pytest.approx([None, *ends])

    def test_unknown_stays_unknown(self):
        """The membership of an unknown value is unknown."""
        assert isnan(fuzzy.membership(LOW, np.nan)[()])
        np.testing.assert_array_equal(fuzzy.membership(LOW, [[0.5, np.nan]]), [[1.0, np.nan]])


class TestConditions:
    TERMS = {"LOW": LOW, "HIGH": HIGH}

    def degrees(self, text: str, **values: float) -> float:
        return float(run(text, {name: [x] for name, x in values.items()}, self.TERMS, {"both": "x is LOW and y is LOW"})[0])

    def test_operators_are_zadehs(self):
        """Conditions combine degrees by Zadeh's operators."""
        # x = 2.5 is LOW to 1/4 and HIGH to 3/4, y = 1.5 is LOW to 3/4 and HIGH to 1/4
        assert self.degrees("x is LOW and y is LOW", x=2.5, y=1.5) == 0.25
        assert self.degrees("x is LOW or y is LOW", x=2.5, y=1.5) == 0.75
        assert self.degrees("not x is LOW", x=2.5) == 0.75
        assert self.degrees("very(y is LOW)", y=1.5) == 0.5625
        assert self.degrees("x is (LOW or HIGH)", x=2.5) == 0.75
        assert self.degrees("both", x=2.5, y=1.5) == 0.25
        assert self.degrees("not both or y is HIGH and x is LOW", x=2.5, y=1.5) == 0.75

    @pytest.mark.parametrize("text", [
        "x is LOW", "not x is LOW", "very(x is LOW)", "x is LOW and y is LOW", "y is LOW and x is LOW",
        "x is LOW or y is LOW", "y is LOW or x is LOW", "not (x is LOW and y is HIGH) or y is LOW",
    ])
    def test_unknown_is_infectious(self, text):
        """A condition with an unknown part is unknown."""
        assert isnan(self.degrees(text, x=np.nan, y=0.0))
        assert isnan(self.degrees(text, x=np.nan, y=9.0))

    @pytest.mark.parametrize(("text", "complaint"), [
        ("x is", "cannot be read"), ("nobody", "not a macro"), ("x == LOW", "grammar"), ("x is not LOW", "grammar"),
        ("x is LOW if y else z", "grammar"), ("__import__('os')", "grammar"), ("very(x is LOW, 2)", "grammar"),
        ("x is (LOW and HIGH)", "neither a term nor"), ("x is 3", "neither a term nor"), ("loop", "made of itself"),
        ("x.y is LOW", "grammar"),
    ])
    def test_only_the_grammar(self, text, complaint):
        """A text outside the grammar is refused with the reason."""
        with pytest.raises(BadSettings, match=complaint):
            compile_conditions([text], {"loop": "x is LOW or loop"}, ["x", "y", "z"], lambda *_: fuzzy.lines(LOW))

    def test_unknown_signal(self):
        """A condition on an unknown signal is refused."""
        with pytest.raises(BadSettings, match="ball_speeed is not a signal"):
            compile_conditions(["ball_speeed is LOW"], {}, ["ball_speed"], lambda *_: fuzzy.lines(LOW))

    @pytest.mark.parametrize("rule", [rule for rule in RULES if rule.initial], ids=lambda rule: f"{rule.code} {rule.variant}")
    def test_degrees_place_edges_alone(self, rule):
        """A condition holds to the half exactly where tests of intervals do: degrees say where their edges lie, and no more."""
        terms, rng = fuzzy.terms(SCALES[Kind.VSSS]), np.random.default_rng(0)
        names = list(dict.fromkeys(signals.OWN + signals.OTHER))
        values = {name: rng.uniform(*DOMAINS[variable_of(name)], 2_000) for name in names}

        def holds(node: ast.expr, level: float, inside: bool = True) -> np.ndarray:
            """Where the degree of a part is at least a level, or, outside, at most."""
            match node:
                case ast.BoolOp(op=op, values=parts):
                    both = np.logical_and if isinstance(op, ast.And) == inside else np.logical_or
                    return both.reduce([holds(part, level, inside) for part in parts])
                case ast.UnaryOp(operand=part):
                    return holds(part, 1 - level, not inside)
                case ast.Call(args=[part]):
                    return holds(part, sqrt(level), inside)
                case ast.Compare(left=ast.Name(id=name), comparators=[of]):
                    each = [part.id for part in getattr(of, "values", [of])]
                    found = np.logical_or.reduce([between(values[name], terms[variable_of(name)][term], level) for term in each])
                    return found if inside else ~found
            return holds(ast.parse(MACROS[node.id], mode="eval").body, level, inside)

        for text in filter(None, (rule.initial, rule.final)):
            code = compile_conditions([text], MACROS, names, lambda s, t: fuzzy.lines(terms[variable_of(s)][t]))
            registers = np.empty((code.registers, 2_000))
            registers[: len(names)] = list(values.values())
            execute(code.steps, code.lines, registers, 2_000)
            assert np.array_equal(registers[code.outputs[0]] >= 0.5, holds(ast.parse(text, mode="eval").body, 0.5))


def between(values: np.ndarray, term: Trapezoid, level: float) -> np.ndarray:
    """Where values lie between the places at which a term rises and falls through a level."""
    rises, falls = fuzzy.crossings(term, level)
    return (values >= (-np.inf if rises is None else rises)) & (values <= (np.inf if falls is None else falls))


class TestAngles:
    DIRECTION = st.floats(-1e3, 1e3).filter(lambda x: x == 0 or abs(x) > 1e-6)

    @given(DIRECTION, DIRECTION, DIRECTION, DIRECTION)
    def test_between(self, ax, ay, bx, by):
        """The angle between two directions has no sign, and is unknown if one of them is zero."""
        found = signals.between(ax, ay, bx, by)
        if (ax == ay == 0) or (bx == by == 0):
            assert isnan(found)
        else:
            assert found == pytest.approx(np.arctan2(abs(ax * by - ay * bx), ax * bx + ay * by), abs=1e-15)
            assert 0 <= found <= pi

    @given(st.floats(1e-3, 1e3))
    def test_diagonal(self, along):
        """A diagonal is parallel to exactly one half."""
        # 45 degrees is where PARALLEL ends: rounding must not decide whether it holds
        parallel = fuzzy.terms(SCALES[Kind.VSSS])[Variable.ORIENTATION]["PARALLEL"]
        turn = signals.between(1.0, 0.0, along, -along)
        assert abs(run("x is T", {"x": [turn]}, {"T": parallel})[0] - 0.5) < ROUNDING
