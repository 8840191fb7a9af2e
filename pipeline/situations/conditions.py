"""Fuzzy conditions: text, expression tree, and a compiled program that evaluates many over many samples.

The text is Python's expression grammar cut down to what a fuzzy rule says::

    ball_distance is CONTACT and not (ball_speed is (EQUAL or FASTER) or very(touching))

A lower-case name before ``is`` is a signal, the upper-case names after it are terms of its variable, a
bare name is a macro. ``and`` is the minimum, ``or`` the maximum, ``not`` 1 - x, ``very`` the square (Zadeh).
NaN means unknown. A condition on an unknown signal is unknown, also under ``not``.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt

from pipeline.errors import BadSettings

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Is:
    """Degree to which a signal belongs to a term."""

    signal: str
    term: str


@dataclass(frozen=True, slots=True)
class Not:
    """1 - x."""

    operand: Expression


@dataclass(frozen=True, slots=True)
class Very:
    """x squared."""

    operand: Expression


@dataclass(frozen=True, slots=True)
class And:
    """The lesser of two."""

    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Or:
    """The greater of two."""

    left: Expression
    right: Expression


Expression = Is | Not | Very | And | Or


def parse(text: str, macros: Mapping[str, str]) -> Expression:
    """Parse a condition into its expression tree.

    Args:
        text: the condition.
        macros: name to text. Macros may use each other, but not in a circle.

    Raises:
        BadSettings: if the text is not of the grammar above, or names an unknown macro.
    """

    def refuse(what: str) -> BadSettings:
        return BadSettings(
            what, where=f"condition {text!r}",
            next_step="Use and, or, not, very(…), macros and 'signal is TERM'",
        )

    def joined(kind: type[And] | type[Or], parts: Sequence[Expression]) -> Expression:
        tree = parts[0]
        for part in parts[1:]:
            tree = kind(tree, part)
        return tree

    def belongs(signal: str, node: ast.expr) -> Expression:
        match node:
            case ast.Name(id=term):
                return Is(signal, term)
            case ast.BoolOp(op=ast.Or(), values=values):
                return joined(Or, [belongs(signal, value) for value in values])
        raise refuse(f"{ast.unparse(node)} is neither a term nor terms joined by or")

    def tree(node: ast.expr, open_macros: tuple[str, ...]) -> Expression:
        match node:
            case ast.BoolOp(op=op, values=values):
                return joined(
                    And if isinstance(op, ast.And) else Or, [tree(value, open_macros) for value in values]
                )
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return Not(tree(operand, open_macros))
            case ast.Call(func=ast.Name(id="very"), args=[operand], keywords=[]):
                return Very(tree(operand, open_macros))
            case ast.Compare(left=ast.Name(id=signal), ops=[ast.Is()], comparators=[terms]):
                return belongs(signal, terms)
            case ast.Name(id=name) if name in open_macros:
                raise refuse(f"macro {name} is made of itself")
            case ast.Name(id=name) if name in macros:
                return tree(expression(macros[name]), (*open_macros, name))
            case ast.Name(id=name):
                raise refuse(f"{name} is not a macro")
        raise refuse(f"{ast.unparse(node)!r} is not part of the grammar")

    def expression(source: str) -> ast.expr:
        try:
            return ast.parse(source, mode="eval").body
        except SyntaxError as error:
            raise refuse(f"cannot be read ({error.msg})") from error

    return tree(expression(text), ())


#: Operations of the register code: out = op(a, b).
IS, NOT, VERY, AND, OR = range(5)


@dataclass(frozen=True, slots=True)
class Program:
    """Conditions compiled to register code; each distinct sub-expression is evaluated once.

    Attributes:
        steps: int32 [S, 4], rows (operation, out, a, b); a and b are registers, b of IS a row of ``lines``.
        lines: float64 [L, 4], terms as (rise, up, fall, down).
        registers: number of registers; the signals are the first, in the order given.
        outputs: int32 [E], the register of each condition.
    """

    steps: I32
    lines: F64
    registers: int
    outputs: I32


def compile_conditions(
    expressions: Sequence[Expression],
    signals: Sequence[str],
    lines: Callable[[str, str], tuple[float, float, float, float]],
) -> Program:
    """Register code for many conditions over the same signals.

    Args:
        expressions: the conditions, [E].
        signals: names of the signals in the order of their registers.
        lines: function from (signal, term) to the term's two lines.

    Raises:
        BadSettings: if a condition names an unknown signal.
    """
    place = {name: register for register, name in enumerate(signals)}
    steps: list[tuple[int, int, int, int]] = []
    rows: dict[tuple[float, float, float, float], int] = {}
    known: dict[Expression, int] = {}

    def register(expression: Expression) -> int:
        if expression in known:
            return known[expression]
        match expression:
            case Is(signal, term):
                if signal not in place:
                    raise BadSettings(
                        f"{signal} is not a signal", next_step=f"Use one of {', '.join(signals)}"
                    )
                row = lines(signal, term)
                step = (IS, place[signal], rows.setdefault(row, len(rows)))
            case Not(operand):
                step = (NOT, register(operand), 0)
            case Very(operand):
                step = (VERY, register(operand), 0)
            case And(left, right):
                step = (AND, register(left), register(right))
            case Or(left, right):
                step = (OR, register(left), register(right))
        out = len(signals) + len(steps)
        steps.append((step[0], out, step[1], step[2]))
        known[expression] = out
        return out

    outputs = [register(expression) for expression in expressions]
    return Program(
        steps=np.array(steps, dtype=np.int32).reshape(-1, 4),
        lines=np.array(list(rows), dtype=np.float64).reshape(-1, 4),
        registers=len(signals) + len(steps),
        outputs=np.array(outputs, dtype=np.int32),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def execute(steps: I32, lines: F64, registers: F64, n: int) -> None:
    """Run register code over a block of samples, in place.

    Each step is one loop without branches over contiguous memory, which LLVM turns into SIMD. The
    comparisons let NaN through: ``x < 0`` and ``x > 1`` are false for NaN.

    Args:
        steps: int32 [S, 4], see :class:`Program`.
        lines: float64 [L, 4].
        registers: float64 [R, at least n]; the signals are filled in, the rest is overwritten.
        n: number of samples.
    """
    for s in range(steps.shape[0]):
        op = steps[s, 0]
        out = registers[steps[s, 1], :n]
        a = registers[steps[s, 2], :n]
        if op == IS:
            rise, up, fall, down = lines[steps[s, 3]]
            for j in range(n):
                left = rise * a[j] + up
                right = fall * a[j] + down
                degree = left if left < right else right
                degree = 0.0 if degree < 0.0 else degree
                out[j] = 1.0 if degree > 1.0 else degree
        elif op == NOT:
            for j in range(n):
                out[j] = 1.0 - a[j]
        elif op == VERY:
            for j in range(n):
                out[j] = a[j] * a[j]
        elif op == AND:
            b = registers[steps[s, 3], :n]
            for j in range(n):
                out[j] = a[j] if (a[j] < b[j]) | (a[j] != a[j]) else b[j]
        else:
            b = registers[steps[s, 3], :n]
            for j in range(n):
                out[j] = a[j] if (a[j] > b[j]) | (a[j] != a[j]) else b[j]
