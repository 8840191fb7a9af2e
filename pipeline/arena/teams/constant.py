"""Constant teams: the control of every learned team. Each robot does the same again and again."""

from __future__ import annotations

import json
import re
from importlib import resources
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.arena.teams.clock import PAPER, ClockSettings
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.tactics.executors.actions import CODES
from pitchlore.schemas import ROLES, Policies

#: Name of the constant team that a search found best, and the file that the search wrote beside this module.
BEST, BEST_FILE = "best-constant", "best-constant.json"

#: What the words of constant teams begin with.
PREFIX = "constant:"
_CODE = re.compile(r"[0-9]{1,3}")


class Constant(NamedTuple):
    """A constant team: the code that each role takes."""

    goalkeeper: int
    midfield: int
    striker: int

    @property
    def word(self) -> str:
        """Name of the team: ``constant:044``, or ``constant:044/021/021`` if roles differ."""
        said = [f"{code:03d}" for code in self]
        return PREFIX + (said[0] if len(set(said)) == 1 else "/".join(said))

    def policy(self) -> pl.DataFrame:
        """Rows of schema Policies: one behaviour of one code in the only state of each role."""
        return Policies.validate(pl.DataFrame(
            [
                {"version": 1, "knowledge_version": 1, "role": role, "key": "role0", "state": 0,
                 "behaviour_id": f"{role}-{code:03d}", "q": 0.0, "visits": 0, "evidence": 0.0}
                for role, code in zip(ROLES, self, strict=True)
            ],
            schema=Policies.dtypes(),
        ))


def best_constant() -> Constant:
    """The constant team that searches by successive halving found best against the static team.

    ``make best-constant`` searches; docs/decisions/players.md, "The best constant team", says how.
    """
    return Constant(**_best()["codes"])


def clock_of(word: str) -> ClockSettings:
    """The clock of a constant team: best-constant has that with which it was found, others the paper's."""
    return ClockSettings.model_validate(_best()["clock"]) if word == BEST else PAPER


def _best() -> dict[str, Any]:
    """The file of the search, as JSON says it."""
    text = resources.files("pitchlore.pipeline.arena.teams").joinpath(BEST_FILE).read_text(encoding="utf-8")
    said: dict[str, Any] = json.loads(text)
    return said


def constant(word: str) -> Constant | None:
    """The constant team that a word names; None if the word names none.

    Args:
        word: ``constant:044``: every robot; ``constant:44/21/21``: goalkeeper, midfield, striker; leading
            zeros may be left out. ``best-constant``: see :func:`best_constant`.

    Raises:
        BadSettings: if there are not one or three codes, or if robots have no action for a code.
    """
    if word == BEST:
        return best_constant()
    if not word.startswith(PREFIX):
        return None
    codes = word.removeprefix(PREFIX).split("/")
    if len(codes) not in (1, len(ROLES)) or not all(_CODE.fullmatch(code) for code in codes):
        raise BadSettings("a constant team has one code, or three", where=repr(word), next_step=(
            "Name it like constant:044, or constant:044/021/021 for goalkeeper, midfield and striker"))
    unknown = [code for code in codes if int(code) not in CODES]
    if unknown:
        raise BadSettings(f"there is no action {unknown[0]}", where=word, next_step=(
            f"Name some of {', '.join(f'{code:03d}' for code in CODES)}"))
    return Constant(*map(int, codes * (1 if len(codes) > 1 else len(ROLES))))
