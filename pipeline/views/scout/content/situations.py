"""The page of situations: rules, membership curves, shares and an example, by kind of pitch."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
    rules, used = rule_table(), terms_used()
    # in the order of the terms, from little to much
    terms = {kind: term_table(Kind(kind)).join(used, on=["variable", "term"], maintain_order="left")
             for kind in _KINDS}
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
            "curves": list(_curves({kind: table.filter(pl.col("code") == code)
                                    for kind, table in terms.items()}, name)),
        } for code, name in NAMES.items()],
    }


def _curves(terms: dict[str, pl.DataFrame], name: str) -> Iterable[dict[str, Any]]:
    """A chart for each variable of a situation's rules; kinds of pitch with the same terms share one."""
    first = next(iter(terms.values()))
    for variable in first["variable"].unique(maintain_order=True):
        charts: dict[tuple[tuple[Any, ...], ...], list[str]] = {}
        own = {kind: table.filter(pl.col("variable") == variable) for kind, table in terms.items()}
        for kind, table in own.items():
            rows = tuple(table.select("term", *_CORNERS).unique(maintain_order=True).rows())
            charts.setdefault(rows, []).append(kind)
        any_kind = own[_KINDS[0]]
        unit, of_term = any_kind["unit"][0], dict(any_kind.group_by("term").agg(
            pl.col("signal").unique(maintain_order=True)).iter_rows())
        for rows, kinds in charts.items():
            lines = [TermCurve(*row) for row in rows]
            where = "all kinds of pitch" if len(kinds) == len(_KINDS) else ", ".join(kinds)
            yield {
                "variable": variable, "unit": unit, "kinds": " ".join(kinds), "where": where,
                "picture": term_chart(lines, f"membership of {variable} in the terms of {name}, {where}"),
                "terms": [line._asdict() | {"swatch": swatch(place), "signals": ", ".join(of_term[line.term])}
                          for place, line in enumerate(lines)],
            }
