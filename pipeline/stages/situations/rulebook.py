"""The rules compiled for a kind of match, and as tables for people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Kind
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations import fuzzy, signals
from pitchlore.pipeline.stages.situations.conditions import Program, compile_conditions
from pitchlore.pipeline.stages.situations.fuzzy import Variable
from pitchlore.pipeline.stages.situations.occurrences import RULE, Rows
from pitchlore.pipeline.stages.situations.rules import MACROS, RULES, TABLE_1, Start, Target
from pitchlore.schemas.situations import MOVES_RANDOMLY


@dataclass(frozen=True, slots=True)
class RuleSet:
    """V rules that read the same signals, compiled.

    Attributes:
        places: int64 [V], which rules of RULES they are.
        program: their conditions.
        records: RULE [V], their registers, starts and times; ``hold_ns`` and ``lull_ns`` come from the
            settings.
    """

    places: I64
    program: Program
    records: Rows


def variable_of(signal: str) -> Variable:
    """The fuzzy variable of a signal, by the signal's name."""
    if signal.endswith("_distance"):
        return Variable.DISTANCE
    if signal == "course_off_ball_course":
        return Variable.ORIENTATION
    return Variable.BEARING if "_off_" in signal else Variable.VELOCITY


@cache
def compiled(kind: Kind) -> dict[str, RuleSet]:
    """The rules in three groups: about the robot itself ('own'), about each opponent, about each teammate."""
    terms = fuzzy.terms(SCALES[kind])

    def lines(signal: str, term: str) -> fuzzy.Lines:
        return fuzzy.lines(terms[variable_of(signal)][term])

    def rule_set(places: Sequence[int], names: tuple[str, ...]) -> RuleSet:
        rules = [RULES[place] for place in places]
        # a rule without a final condition gets its initial one's register, which is never read
        texts = [text for rule in rules for text in (rule.initial, rule.final or rule.initial)]
        program = compile_conditions(texts, MACROS, names, lines)
        records = np.zeros(len(rules), dtype=RULE)
        records["initial"], records["final"] = program.outputs[0::2], program.outputs[1::2]
        records["start"] = [list(Start).index(rule.start) for rule in rules]
        records["limit_ns"] = [round(rule.limit_s * 1e9) for rule in rules]
        for record, rule in zip(records, rules, strict=True):
            if rule.lasts:
                edge = fuzzy.lines(fuzzy.PLAYING_TIMES[rule.lasts])
                record["rise"], record["up"] = edge.rise, edge.up
        records["once"] = [rule.once for rule in rules]
        return RuleSet(np.array(places, dtype=np.int64), program, records)

    others = (Target.OPPONENT, Target.TEAMMATE)
    own = [place for place, rule in enumerate(RULES) if rule.target not in others]
    sets = {"own": rule_set(own, signals.OWN)}
    for about in others:
        sets[about] = rule_set([p for p, rule in enumerate(RULES) if rule.target == about], signals.OTHER)
    return sets


@lru_cache(maxsize=8)  # scikit-fuzzy's cuts, made for each robot, take a quarter of the recogniser's time
def holds_ns(fire_at: float) -> I64:
    """Playing time after which each rule of WHILE counts, int64 [rules] nanoseconds; 0 for the others."""
    terms = [fuzzy.PLAYING_TIMES[rule.lasts] if rule.lasts else None for rule in RULES]
    rises = [fuzzy.crossings(term, fire_at)[0] if term else None for term in terms]
    found = np.array([round((at or 0.0) * 1e9) for at in rises])
    found.flags.writeable = False
    return found


def rule_table() -> pl.DataFrame:
    """Every rule as text, one row a code and variant, in order of code.

    Returns:
        Columns code, name, priority (null for 194), variant, initial, final, start, limit_s, target. The
        final condition of a situation that lasts is about the playing time since its initial condition set
        in; 194 has neither.
    """
    times = list(fuzzy.PLAYING_TIMES)
    rows: list[dict[str, object]] = []
    for rule in RULES:
        for code in rule.code if isinstance(rule.code, tuple) else (rule.code,):
            if code in TABLE_1:
                name, priority = TABLE_1[code]
                longer = " or ".join(times[times.index(rule.lasts):]) if rule.lasts else ""
                rows.append({
                    "code": code, "name": name, "priority": priority, "variant": rule.variant,
                    "initial": rule.initial, "final": rule.final or f"playing_time is ({longer})",
                    "start": str(rule.start), "limit_s": rule.limit_s, "target": str(rule.target),
                })
    rows.append({
        "code": MOVES_RANDOMLY, "name": TABLE_1[MOVES_RANDOMLY][0], "variant": "what the others leave",
        "start": str(Start.WHILE), "limit_s": SituationSettings().random_longest_s,
        "target": str(Target.NOTHING),
    })
    schema = {
        "code": pl.Int16, "name": pl.String, "priority": pl.Int8, "variant": pl.String, "initial": pl.String,
        "final": pl.String, "start": pl.String, "limit_s": pl.Float64, "target": pl.String,
    }
    return pl.DataFrame(rows, schema=schema).sort("code", maintain_order=True)


def terms_used() -> pl.DataFrame:
    """The terms that the rules of each situation use, those of the words that they are made of included.

    Returns:
        Columns code, signal (the rule's name of a value; playing_time is the time for which the initial
        condition has held), variable and term, each once, in order of code and of the rules' text.
    """
    rows: dict[tuple[int, str, str, str], None] = {}
    times = list(fuzzy.PLAYING_TIMES)
    flat = fuzzy.lines(fuzzy.PLAYING_TIMES[times[0]])  # of no account: only the names are asked for
    for rule in RULES:
        found: list[tuple[str, str]] = []

        def named(signal: str, term: str, found: list[tuple[str, str]] = found) -> fuzzy.Lines:
            found.append((signal, term))
            return flat

        names = signals.OTHER if rule.target in (Target.OPPONENT, Target.TEAMMATE) else signals.OWN
        compile_conditions([rule.initial, *([rule.final] if rule.final else [])], MACROS, names, named)
        said = [(signal, str(variable_of(signal)), term) for signal, term in found]
        if rule.lasts:
            longer = times[times.index(rule.lasts):]
            said += [("playing_time", str(Variable.PLAYING_TIME), term) for term in longer]
        for code in rule.code if isinstance(rule.code, tuple) else (rule.code,):
            if code in TABLE_1:
                rows.update(dict.fromkeys((code, *each) for each in said))
    return pl.DataFrame(list(rows), orient="row", schema={
        "code": pl.Int16, "signal": pl.String, "variable": pl.String, "term": pl.String,
    }).sort("code", maintain_order=True)


def term_table(kind: Kind) -> pl.DataFrame:
    """Every term of the five fuzzy variables for a kind of match (the paper's Figure 1).

    Returns:
        Columns variable, meaning, unit, term; the trapezoid's corners a, b, c, d (null at an open end);
        rises_at and falls_at, where its membership crosses 0.5 by scikit-fuzzy's lambda-cut (null on the
        side of a shoulder).
    """
    rows = []
    for variable, terms in fuzzy.terms(SCALES[kind]).items():
        meaning, unit = fuzzy.MEANINGS[variable]
        for term, trapezoid in terms.items():
            corners = (None if abs(corner) >= fuzzy.FAR_OFF else corner for corner in trapezoid)
            rows.append((str(variable), meaning, unit, term, *corners, *fuzzy.crossings(trapezoid)))
    columns = ("variable", "meaning", "unit", "term", "a", "b", "c", "d", "rises_at", "falls_at")
    return pl.DataFrame(rows, schema={
        name: pl.String if name in columns[:4] else pl.Float64 for name in columns
    }, orient="row")
