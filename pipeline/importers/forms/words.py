"""Words for the columns of tables, in several languages (``words.toml``): what a user may have meant."""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from pathlib import Path

_TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
#: Our columns and other words for them, bare. No word is one of two columns.
WORDS_OF: dict[str, str] = _TABLES["columns"]
WORDS = {word: column for column, words in WORDS_OF.items() for word in words.split()}
#: Words for the ball, for the home team and for the away team.
BALLS, HOMES, AWAYS = ({*_TABLES["bodies"][body].split()} for body in ("ball", "home", "away"))

#: Columns of a file that are looked at.
_AT_MOST = 1000


def bare(name: str) -> str:
    """A name in lower-case letters and digits, without accents, blanks and signs."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]", "", plain)


def parts_of(name: str) -> set[str]:
    """A name, bare, and its parts of more than a letter, as those of ``Lions (home)``."""
    parts = {bare(part) for part in re.split(r"[^0-9A-Za-zÀ-ÿ]+", name)}
    return {bare(name), *(part for part in parts if len(part) > 1)}


def meant(column: str, wanted: str, found: Sequence[str], taken: Collection[str] = ()) -> str | None:
    """The file's column that a user may have meant by one that is missing; None if nothing is near.

    Args:
        column: ours.
        wanted: its name in the map.
        found: the file's columns.
        taken: names among them that are read as other columns.
    """
    some = found[:_AT_MOST]
    free = {bare(name): name for name in reversed(some) if name not in taken and bare(name)}
    named = [word for word in WORDS_OF.get(column, "").split() if word in free]
    if named:
        return free[named[0]]
    for name in free.values():  # team_name, robot id, x [m]
        parts = [bare(part) for part in re.split(r"[^0-9A-Za-zÀ-ÿ]+", name)]
        words = {part for part in parts if part in WORDS}  # player_vx is no player
        if {WORDS[word] for word in words} == {column} and max(map(len, words)) > 1:
            return name
    near = [name for name in free if WORDS.get(name, column) == column]
    close = get_close_matches(bare(wanted), near, 1, 0.75)
    return free[close[0]] if close else None
