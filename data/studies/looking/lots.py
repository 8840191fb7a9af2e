"""Trials: the ways to act between which a lot decides, and their matches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from looking.learners import ALL, HELD

from pitchlore.pipeline.arena.env import BEHAVIOURS
from pitchlore.pipeline.arena.teams.constant import Constant

LOOKS, BLIND = "looks", "blind"
#: The constant team that was the best in whole matches when the trials were written.
WHOLE = "constant:001/088/044"


class Trial(NamedTuple):
    """Matches in which the lot decides how a robot acts in a second.

    Attributes:
        tickets: ways to act that the lot draws, all with the same chance: LOOKS, BLIND, or the word of a
            constant team.
        seeds: seeds of the pairs of matches; nothing else was ever played with them.
        compared: pairs of ways to act, of which the first is compared with the second.
    """

    tickets: Sequence[str]
    seeds: range
    compared: Sequence[tuple[str, str]] = ()

    @property
    def ways(self) -> list[str]:
        """The ways to act; rows of seconds have their numbers."""
        return list(dict.fromkeys(self.tickets))


def _blinded(first_seed: int) -> Trial:
    return Trial((LOOKS, WHOLE, BLIND), range(first_seed, first_seed + 100),
                 ((LOOKS, WHOLE), (LOOKS, BLIND), (BLIND, WHOLE)))


def against(best: Constant) -> Trial:
    """The trial beside each role's best constant for a second."""
    return Trial((LOOKS, best.word, WHOLE), range(2_750_000, 2_750_100),
                 ((LOOKS, best.word), (best.word, WHOLE)))


#: The first trial, by the settings of the seasons.
FIRST = {ALL.season: _blinded(2_500_000), HELD.season: _blinded(2_700_000)}
_ALL_CODES = [Constant(code, code, code).word for code in BEHAVIOURS]
#: The search of each role's best constant for a second: all behaviours.
SEARCH = Trial((*[LOOKS] * len(_ALL_CODES), *_ALL_CODES), range(2_720_000, 2_720_100))


def final(teams: Sequence[Constant]) -> Trial:
    """The end of the search: the best behaviours of each role."""
    words = [team.word for team in teams]
    return Trial((*[LOOKS] * len(words), *words), range(2_730_000, 2_730_100))
