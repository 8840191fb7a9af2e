"""Maps that are known already, by name: tables as programs and data sets write them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.base.toml import toml_tables

FILE = Path(__file__).with_suffix(".toml")


@cache
def presets() -> dict[str, dict[str, Any]]:
    """The tables of each map that has a name, with its ``title``."""
    return toml_tables(FILE.read_bytes(), str(FILE))


def titles() -> dict[str, str]:
    """The names of the maps, and what each reads."""
    return {name: preset["title"] for name, preset in presets().items()}


def with_form(tables: dict[str, Any], where: str) -> dict[str, Any]:
    """The tables of a map, with those of the map that its key ``form`` names; its own keys go before.

    Raises:
        BadSettings: if there is no map of that name.
    """
    if "form" not in tables:
        return tables
    own = {key: value for key, value in tables.items() if key != "form"}
    named = presets().get(str(tables["form"]))
    if named is None:
        raise BadSettings(f"form: there is none called {tables['form']!r}, only {', '.join(presets())}",
                          where=where, next_step="Mend the map, or leave the key out")
    base = {key: value for key, value in named.items() if key != "title"}
    return _merged(base, own)


def text_of(name: str) -> str:
    """The map of a name, as TOML.

    Raises:
        NotFound: if there is no map of that name.
    """
    if name not in presets():
        raise NotFound(f"there is no form {name!r}", next_step=f"Say one of {', '.join(presets())}")
    return f'form = "{name}"\n'


def _merged(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Tables with those of another laid over them, table by table; lists are replaced."""
    both = {**base, **own}
    for key in base.keys() & own.keys():
        if isinstance(base[key], dict) and isinstance(own[key], dict):
            both[key] = _merged(base[key], own[key])
    return both
