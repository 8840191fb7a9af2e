"""Constant teams: the control of every learned team. Each robot does the same again and again."""

from __future__ import annotations

import re

import numpy as np
import polars as pl

from pipeline.arena.teams.executors.actions import VERB
from pipeline.errors import BadSettings
from schemas import ROLES, Policies

_WORD = re.compile(r"always-([0-9]{3})(?:-([0-9]{3})-([0-9]{3}))?")
_KNOWN = np.flatnonzero(VERB >= 0).tolist()


def constant(word: str) -> pl.DataFrame | None:
    """The policy of a constant team, None if the word names none.

    Args:
        word: ``always-044``: every robot; ``always-044-021-021``: goalkeeper, midfield, striker.

    Returns:
        Rows of schema Policies: one behaviour of one code in the only state of each role.

    Raises:
        BadSettings: if robots have no action for a code.
    """
    said = _WORD.fullmatch(word)
    if said is None:
        return None
    codes = [code for code in said.groups() if code] * (1 if said[2] else len(ROLES))
    unknown = [code for code in codes if int(code) not in _KNOWN]
    if unknown:
        raise BadSettings(f"there is no action {unknown[0]}", where=word, next_step=(
            f"Name some of {', '.join(f'{code:03d}' for code in _KNOWN)}"))
    return Policies.validate(pl.DataFrame(
        [
            {"version": 1, "knowledge_version": 1, "role": role, "key": "role0", "state": 0,
             "behaviour_id": f"{role}-{code}", "q": 0.0, "visits": 0, "evidence": 0.0}
            for role, code in zip(ROLES, codes, strict=True)
        ],
        schema=Policies.dtypes(),
    ))
