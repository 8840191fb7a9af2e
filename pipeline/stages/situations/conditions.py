"""Fuzzy conditions: text, and a compiled program that evaluates many of them over many samples.

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
from functools import partial, reduce

import numpy as np

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.numbers.arrays import F64, I32
from pitchlore.pipeline.numbers.kernels import njit

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
    texts: Sequence[str],
    macros: Mapping[str, str],
    signals: Sequence[str],
    lines: Callable[[str, str], tuple[float, float, float, float]],
) -> Program:
    """Register code for many conditions over the same signals.

    Args:
        texts: the conditions, [E].
        macros: name to text. Macros may use each other, but not in a circle.
        signals: names of the signals in the order of their registers.
        lines: function from (signal, term) to the term's two lines.

    Raises:
        BadSettings: if a text is not of the grammar above, or names an unknown macro or signal.
    """
    place = {name: register for register, name in enumerate(signals)}
    registers: dict[tuple[int, int, int], int] = {}
    rows: dict[tuple[float, float, float, float], int] = {}

    def step(operation: int, a: int, b: int = 0) -> int:
        """Register of a step's result; a step that is there already is not done again."""
        return registers.setdefault((operation, a, b), len(signals) + len(registers))

    def belongs(signal: str, node: ast.expr, text: str) -> int:
        match node:
            case ast.Name(id=term):
                if signal not in place:
                    raise BadSettings(
                        f"{signal} is not a signal", next_step=f"Use one of {', '.join(signals)}"
                    )
                return step(IS, place[signal], rows.setdefault(lines(signal, term), len(rows)))
            case ast.BoolOp(op=ast.Or(), values=values):
                return reduce(partial(step, OR), [belongs(signal, value, text) for value in values])
        raise _refused(text, f"{ast.unparse(node)} is neither a term nor terms joined by or")

    def condition(node: ast.expr, text: str, open_macros: tuple[str, ...] = ()) -> int:
        match node:
            case ast.BoolOp(op=op, values=values):
                kind = AND if isinstance(op, ast.And) else OR
                return reduce(partial(step, kind), [condition(value, text, open_macros) for value in values])
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return step(NOT, condition(operand, text, open_macros))
            case ast.Call(func=ast.Name(id="very"), args=[operand], keywords=[]):
                return step(VERY, condition(operand, text, open_macros))
            case ast.Compare(left=ast.Name(id=signal), ops=[ast.Is()], comparators=[terms]):
                return belongs(signal, terms, text)
            case ast.Name(id=name) if name in open_macros:
                raise _refused(text, f"macro {name} is made of itself")
            case ast.Name(id=name) if name in macros:
                return condition(_syntax_tree(macros[name], text), text, (*open_macros, name))
            case ast.Name(id=name):
                raise _refused(text, f"{name} is not a macro")
        raise _refused(text, f"{ast.unparse(node)!r} is not part of the grammar")

    outputs = [condition(_syntax_tree(text, text), text) for text in texts]
    steps = [(operation, out, a, b) for (operation, a, b), out in registers.items()]
    return Program(
        steps=np.array(steps, dtype=np.int32).reshape(-1, 4),
        lines=np.array(list(rows), dtype=np.float64).reshape(-1, 4),
        registers=len(signals) + len(steps),
        outputs=np.array(outputs, dtype=np.int32),
    )


def _syntax_tree(source: str, text: str) -> ast.expr:
    """Python's syntax tree of a condition, or of a macro in the condition ``text``."""
    try:
        return ast.parse(source, mode="eval").body
    except SyntaxError as error:
        raise _refused(text, f"cannot be read ({error.msg})") from error


def _refused(text: str, what: str) -> BadSettings:
    return BadSettings(
        what, where=f"condition {text!r}",
        next_step="Use and, or, not, very(…), macros and 'signal is TERM'",
    )


@njit(cache=True, nogil=True, error_model="numpy")
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
