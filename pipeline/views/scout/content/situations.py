"""The page of situations: rules, membership curves, shares and an example, by kind of pitch."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import polars as pl

from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.stages.situations.rulebook import rule_table, term_table, terms_used
from pitchlore.pipeline.stages.situations.rules import MACROS
from pitchlore.pipeline.views.scout.content.sources import LeagueMatch
from pitchlore.pipeline.views.scout.curves import TermCurve, swatch, term_chart
from pitchlore.pipeline.views.scout.gallery import Clip
from pitchlore.pipeline.views.scout.words import NAMES
from pitchlore.schemas import Situations

#: Matches of each kind of pitch that shares and examples are taken from: the newest.
FROM = 30
_KINDS = tuple(kind.value for kind in Kind)
_CORNERS = ("a", "b", "c", "d", "rises_at", "falls_at")


def situation_facts(league: Sequence[LeagueMatch]) -> dict[str, Any]:
    """Content of the page."""
    each = {kind: [match for match in league if match.pitch.kind.value == kind] for kind in _KINDS}
    rows = pl.concat([Situations.empty().with_columns(kind=pl.lit("")), *(
        match.situations.with_columns(kind=pl.lit(kind))
        for kind, matches in each.items() for match in matches[-FROM:])])
    counts = rows.group_by("kind", "code").len()
    share = counts.with_columns(share=pl.col("len") / pl.col("len").sum().over("kind")).sort("kind")
    clearest = rows.sort("strength", "start_ns", descending=[True, False], nulls_last=True).group_by(
        "kind", "code", maintain_order=True).first().sort("kind")
    rules = rule_table()
    return {
        "kinds": _KINDS, "most": max(_KINDS, key=lambda kind: len(each[kind])),
        "macros": sorted(MACROS.items()), "cards": [{
            "code": code, "name": name,
            "clips": [(row["kind"], [Clip.about(
                row, row["start_ns"], row["end_ns"], f"an example, {row['kind']}", before_s=1, after_s=1)])
                      for row in clearest.filter(pl.col("code") == code).iter_rows(named=True)],
            "shares": share.filter(pl.col("code") == code).select("kind", "share", "len").rows(),
            "rules": [f"{row['initial']} → {row['final']}" for row in rules.filter(
                pl.col("code") == code, pl.col("initial").is_not_null()).iter_rows(named=True)],
            "curves": _curves(code, name),
        } for code, name in NAMES.items()],
    }


@cache
def _terms() -> dict[str, dict[int, list[dict[str, Any]]]]:
    """Terms of the rules by kind of pitch and code of the situation, in their order, from little to much."""
    used, found = terms_used(), {}
    for kind in _KINDS:
        table = term_table(Kind(kind)).join(used, on=["variable", "term"], maintain_order="left")
        found[kind] = table.rows_by_key("code", named=True, include_key=True)
    return found


@cache
def _curves(code: int, name: str) -> tuple[dict[str, Any], ...]:
    """A chart for each variable of a situation's rules; kinds of pitch with the same terms share one."""
    found = []
    terms = {kind: of_code.get(code, []) for kind, of_code in _terms().items()}
    any_kind = terms[_KINDS[0]]
    for variable, unit in dict.fromkeys((row["variable"], row["unit"]) for row in any_kind):
        charts: dict[tuple[TermCurve, ...], list[str]] = {}
        for kind, rows in terms.items():
            lines = dict.fromkeys(TermCurve(row["term"], *(row[corner] for corner in _CORNERS))
                                  for row in rows if row["variable"] == variable)
            charts.setdefault(tuple(lines), []).append(kind)
        signals: dict[str, dict[str, None]] = {}
        for row in any_kind:
            if row["variable"] == variable:
                signals.setdefault(row["term"], {})[row["signal"]] = None
        for curves, kinds in charts.items():
            where = "all kinds of pitch" if len(kinds) == len(_KINDS) else ", ".join(kinds)
            found.append({
                "variable": variable, "unit": unit, "kinds": " ".join(kinds), "where": where,
                "picture": term_chart(curves, f"membership of {variable} in the terms of {name}, {where}"),
                "terms": [curve._asdict() | {
                    "swatch": swatch(place), "signals": ", ".join(signals[curve.term])}
                    for place, curve in enumerate(curves)],
            })
    return tuple(found)
