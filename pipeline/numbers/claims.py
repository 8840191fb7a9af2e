"""Claims about a study, and verdicts on them.

A claim states that a quantity lies in a range. A study gives evidence: the quantity's estimate with its 95 %
interval. One rule gives all verdicts; the first line that applies counts:

1. *contradictory*: the paper's own table has a value outside the range, whatever the study measured.
2. *not judged*: the study has too few independent observations.
3. *reproduced*: the interval lies wholly inside the range; *contradicted*: wholly outside; *not reproduced*:
   neither, or there is no interval. A quantity too noisy to tell is so never counted as reproduced.

A claim that every run of the system must fulfil is *by construction* instead of reproduced: it is no
evidence.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from operator import ge, gt
from typing import Generic, NamedTuple, TypeVar

from pitchlore.pipeline.numbers.statistics import Estimate

Study = TypeVar("Study")


@dataclass(frozen=True, slots=True)
class Range:
    """Values that a claim allows its quantity.

    Attributes:
        text: the range in words.
        low: lower end, included unless ``strict``.
        high: upper end, likewise.
        strict: both ends are excluded. An interval that reaches an end from within is then not inside, and
            one that reaches it from without is outside.
    """

    text: str
    low: float = -math.inf
    high: float = math.inf
    strict: bool = False

    def verdict(self, estimate: Estimate) -> str:
        """``reproduced``, ``contradicted`` or ``not reproduced``; the last if there is no interval."""
        _, low, high = estimate
        within, beyond = (gt, ge) if self.strict else (ge, gt)
        if beyond(low, self.high) or beyond(self.low, high):
            return "contradicted"
        return "reproduced" if within(low, self.low) and within(self.high, high) else "not reproduced"


ABOVE = Range("above 0", low=0.0, strict=True)
BELOW = Range("below 0", high=0.0, strict=True)


class Evidence(NamedTuple):
    """One estimate of a claim's quantity.

    Attributes:
        estimate: value and 95 % interval; NaN if the study does not define them.
        observations: independent observations behind it: trainings, or seasons.
        about: public columns that say what it was measured on, by name.
        printed: the quantity in the paper's own table; None if the table does not have it.
    """

    estimate: Estimate
    observations: int
    about: Mapping[str, object]
    printed: float | None = None


@dataclass(frozen=True, slots=True)
class Claim(Generic[Study]):
    """A statement that a quantity lies in a range.

    Attributes:
        item: figure or table of the paper that it belongs to, or a word for claims of ours.
        text: the statement in words.
        quantity: the quantity in words, with its unit.
        stated: range that the statement gives the quantity.
        evidence: function from a study to the quantity's estimates, in the order of the verdicts' table.
        by_construction: every run of the system fulfils the claim, whatever is learned.
    """

    item: str
    text: str
    quantity: str
    stated: Range
    evidence: Callable[[Study], Iterable[Evidence]]
    by_construction: bool = False

    def verdict(self, evidence: Evidence, least: int) -> str:
        """Verdict by the module's rule; ``least`` observations are enough to judge."""
        paper = evidence.printed
        if paper is not None and self.stated.verdict(Estimate(paper, paper, paper)) != "reproduced":
            return "contradictory"
        if evidence.observations < least:
            return "not judged"
        verdict = self.stated.verdict(evidence.estimate)
        return "by construction" if self.by_construction and verdict == "reproduced" else verdict


def findings(
    claims: Iterable[Claim[Study]], study: Study, least: int = 1
) -> Iterator[dict[str, object]]:
    """Rows of a table of verdicts, claim by claim, one for each piece of evidence.

    Columns: item, claim, quantity, stated (the range in words), those that the evidence is about, measured,
    low, high (None if undefined) and verdict. ``least`` independent observations are enough to judge.
    """
    for claim in claims:
        for evidence in claim.evidence(study):
            value, low, high = (None if math.isnan(end) else end for end in evidence.estimate)
            yield {
                "item": claim.item, "claim": claim.text, "quantity": claim.quantity,
                "stated": claim.stated.text, **evidence.about,
                "measured": value, "low": low, "high": high, "verdict": claim.verdict(evidence, least),
            }


def counted(verdicts: Iterable[str]) -> str:
    """Counts of the verdicts in words, the most frequent first: ``9 claims: 8 reached, 1 not reached``."""
    counts = Counter(verdicts)
    ranked = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    return f"{counts.total()} claims: " + ", ".join(f"{count} {verdict}" for verdict, count in ranked)
