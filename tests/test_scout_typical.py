"""Typical grams of a team, sequels of its behaviours, and the ones that its page shows."""

import math

import polars as pl
import pytest

from pitchlore.pipeline.views.scout.following import FOLLOWS_S, Following, followed_by, following
from pitchlore.pipeline.views.scout.gallery import AT_FIRST, SHOWN, SHOWN_OF_ORDER, Clip, at_first, leading
from pitchlore.pipeline.views.scout.typical import typical


def grams(*rows: tuple[str, tuple[int, ...], int]) -> pl.DataFrame:
    return pl.DataFrame(
        [{"team": team, "role": "striker", "n": len(codes), "codes": list(codes), "count": count}
         for team, codes, count in rows],
        schema={"team": pl.String, "role": pl.String, "n": pl.Int8, "codes": pl.List(pl.Int16), "count": pl.Int64})


def found(table: pl.DataFrame) -> dict[tuple[int, ...], tuple[float, float]]:
    return {tuple(codes): (times, low) for codes, times, low in table.select("codes", "times", "at_least").iter_rows()}


def test_times_as_often():
    """A gram of 30 in 100 is three times as often as one of 20 in 200; the interval is that of two counts."""
    own = grams(("a", (44, 21), 30), ("a", (44, 1), 70))
    others = grams(("b", (44, 21), 20), ("b", (44, 1), 180))
    times, low = found(typical(own, others, 3))[44, 21]
    assert times == pytest.approx(3)
    assert low == pytest.approx(3 * math.exp(-1.96 * math.sqrt(1 / 30 + 1 / 20)), rel=1e-4)


def test_unlisted_elsewhere():
    """A gram that other teams do not list counts as often as it may have been there, two a team at most."""
    own = grams(("a", (44, 21), 30), ("a", (44, 1), 70))
    others = grams(("b", (44, 1), 100), ("c", (44, 1), 100))
    assert found(typical(own, others, 3))[44, 21][0] == pytest.approx(0.3 * 200 / 4)
    assert found(typical(own, others, 1))[44, 21][0] == pytest.approx(0.3 * 200), "at least one, so that it is finite"


def test_lengths_and_roles_are_apart():
    """Shares are those of one role and length: another's counts change nothing."""
    own, others = grams(("a", (44, 21), 30), ("a", (44, 1), 70)), grams(("b", (44, 21), 20), ("b", (44, 1), 180))
    more = pl.concat([own, grams(("a", (44,), 1_000)), own.with_columns(role=pl.lit("midfield"), count=pl.col("count") * 9)])
    assert typical(more, others, 3).filter(role="striker").filter(pl.col("codes").list.len() == 2).equals(typical(own, others, 3))


def test_alone_in_the_league():
    """Without other teams nothing is said."""
    own = grams(("a", (44, 21), 30))
    assert typical(own, own.clear(), 3).is_empty()


def test_the_first_of_each_order():
    """The page has the first, those of one situation, and the first by support, by value and its lower end, of what is new, of what is typical, and of what went with worse chances."""
    size = 200
    table = pl.DataFrame({
        "behaviour_id": [f"b{i}" for i in range(size)], "codes": [[44] if i == 90 else [44, 21] for i in range(size)], "support": range(size), "value": [abs(i - 100) for i in range(size)],
        "low": [9.0 if i == 160 else -1.0 for i in range(size)], "effect": [-9.0 if i == 155 else 1.0 for i in range(size)], "new": [i in (120, 150) for i in range(size)], "at_least": [float(i == 70) or None for i in range(size)]})
    shown = leading(table)["behaviour_id"].to_list()
    assert shown[:SHOWN] == [f"b{i}" for i in range(SHOWN)], "the order it has"
    assert {f"b{i}" for i in range(size - SHOWN_OF_ORDER, size)} <= set(shown), "by support"
    assert {"b120", "b150", "b70", "b160", "b155", "b90"} <= set(shown)
    assert len(shown) <= SHOWN + 1 + 6 * SHOWN_OF_ORDER
    assert leading(table.head(3)).equals(table.head(3))


S = 10**9


def led(*occurrences, shots=(), goals=()):
    """Sequels of occurrences (start, end in s, segment) of home, in segments of 20 s; shots and goals (s, team)."""
    found = pl.DataFrame([("striker-044", "home", round(a * S), round(b * S), episode) for a, b, episode in occurrences],
                         schema=["behaviour_id", "team", "t_ns", "done_ns", "episode"], orient="row")
    frames = pl.DataFrame([(t * S, t // 20) for t in range(60)], schema={"t_ns": pl.Int64, "segment": pl.Int64}, orient="row")
    tables = [pl.DataFrame([(team, round(t * S), int(t // 20)) for t, team in rows],
                           schema={"team": pl.String, "t_ns": pl.Int64, "segment": pl.Int64}, orient="row")
              for rows in (shots, goals)]
    return following(followed_by(found.cast({"episode": pl.Int64}), *tables, frames))["striker-044"]


def test_followed():
    """A shot within an occurrence or up to some seconds after its end followed it, once however many there are."""
    assert led((1, 2, 0), (5, 6, 0), shots=[(1.5, "home"), (1.8, "home")]) == Following(2, 1, 0, 0, 0)
    assert led((1, 2, 0), shots=[(2 + FOLLOWS_S, "home")]).shot == 1
    assert led((1, 2, 0), shots=[(2.01 + FOLLOWS_S, "home")]).shot == 0
    assert led((1, 2, 0), shots=[(0.9, "home")]).shot == 0, "it came before"
    assert led((1, 2, 0), (21, 22, 1), shots=[(3, "away")]) == Following(2, 0, 0, 1, 0)


def test_followed_before_play_stops():
    """A goal after the next restart is no sequel; a goal that is logged with the restart is one."""
    assert led((18, 19, 0), shots=[(21, "home")], goals=[(20, "home")]) == Following(1, 0, 1, 0, 0)
    assert led((18, 19, 0), goals=[(20.5, "away")]) == Following(1, 0, 0, 0, 0)
    assert led((18, 19, 0), goals=[(19.5, "away")]) == Following(1, 0, 0, 0, 1)


@pytest.mark.parametrize("kinds", [(4, 4, 4), (1, 2, 1), (1, 1, 1), (0, 2, 0), (2, 2, 2)])
def test_clips_at_first(kinds):
    """Up to four clips are shown at first, one of each kind among them; none is lost."""
    found = [Clip("m", "home", 1, float(i), i + 1.0, f"{kind}, {i}", float(i))
             for kind, count in zip(("best", "typical", "worst"), kinds, strict=True) for i in range(count)]
    first, rest = at_first(found)
    assert len(first) == min(AT_FIRST, len(found))
    assert {clip.says.split(",")[0] for clip in first} == {clip.says.split(",")[0] for clip in found}
    assert sorted(first + rest) == sorted(found)
