"""Frozen models, and how they are read from TOML: an error names the file, the key and the cure."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Sequence
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.text import did_you_mean

M = TypeVar("M", bound=BaseModel)
#: Most characters of a settings file, and of a line of it.
_CHARACTERS, _LINE = 1_000_000, 10_000


class Frozen(BaseModel):
    """A frozen model of settings: no unknown keys, no infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def toml_tables(data: bytes | str, where: str) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        BadSettings: if it is not TOML, or longer than any settings are.
    """
    try:
        text = data if isinstance(data, str) else data.decode("utf-8-sig")
        longest = max(map(len, text.split("\n")))
        if len(text) > _CHARACTERS or longest > _LINE:  # dotted keys of such lines would take minutes
            what = f"has a line of {longest} characters" if longest > _LINE else f"has {len(text)} characters"
            raise BadSettings(f"{what}, more than any settings need", where=where,
                              next_step=f"Keep to {_LINE} characters a line, and {_CHARACTERS} in all")
        return tomllib.loads(text)
    except RecursionError as error:
        raise BadSettings(
            "is nested too deeply", where=where, next_step="Write fewer tables in tables") from error
    except ValueError as error:  # no UTF-8, no TOML, or a number of too many digits
        raise BadSettings(
            f"is not TOML ({error})", where=where, next_step="Mend the line it names"
        ) from error


def fitted(model: type[M], values: dict[str, Any], where: str, keys: str) -> M:
    """A model from the tables of a file; ``keys`` is the next step of an error, which says where keys are.

    Raises:
        BadSettings: if a key or value does not fit; names the first.
    """
    for path, value in _leaves(values):  # pydantic would take true and "1" for 1
        field = _table(model, path[:-1]).model_fields.get(path[-1])
        if field is not None and type(value) not in (kinds := _kinds(field.annotation)) and (
                isinstance(value, bool) or {int, float} & kinds):
            raise BadSettings(f"{'.'.join(path)}: {json.dumps(value, ensure_ascii=False)} does not fit",
                              where=where, next_step=keys)
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise unfit(error, where, keys, model) from error


def _leaves(
    values: dict[str, Any], above: tuple[str, ...] = (),
) -> Iterator[tuple[tuple[str, ...], bool | str]]:
    """The keys of tables with true, false or text for a value."""
    for key, value in values.items():
        if isinstance(value, bool | str):
            yield (*above, key), value
        elif isinstance(value, dict):
            yield from _leaves(value, (*above, key))


def _kinds(annotation: Any) -> set[Any]:
    """The types that an annotation has or unites, without their bounds."""
    return {getattr(each, "__origin__", each) for each in (annotation, *get_args(annotation))}


def unfit(
    error: ValidationError, where: str, next_step: str, model: type[BaseModel] | None = None
) -> BadSettings:
    """The first problem of values that are no settings, as an error of ours.

    Args:
        error: error of the values.
        where: they come from.
        next_step: cure, for the user.
        model: model of the settings; for a key that it lacks, the error names those that it has there.
    """
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"]) or "it"
    said = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden" and model is not None:
        said = f"there is no such key{_instead(model, first['loc'])}"
    return BadSettings(f"{key}: {said[:1].lower()}{said[1:]}", where=where, next_step=next_step)


def _instead(model: type[BaseModel], path: Sequence[int | str]) -> str:
    """The key that was meant by an unknown one, in its table or another; else all keys of its table."""
    *table, word = map(str, path)
    own = list(_table(model, table).model_fields)
    others = [key for key in _paths(model) if key.rpartition(".")[2] == word]
    elsewhere = f" (did you mean {' or '.join(others)}?)" if others else f", only {', '.join(own)}"
    return did_you_mean(word, own) or elsewhere


def _paths(model: type[BaseModel], table: str = "") -> Iterator[str]:
    """All keys of a model, those of its tables with the table's name."""
    for name, field in model.model_fields.items():
        yield f"{table}{name}"
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from _paths(field.annotation, f"{table}{name}.")


def _table(model: type[BaseModel], path: Sequence[str]) -> type[BaseModel]:
    """The model of a table in the settings of a model; path is its place."""
    for part in path:
        kind = model.model_fields[part].annotation if part in model.model_fields else None
        inner = next((each for each in (kind, *get_args(kind))
                      if isinstance(each, type) and issubclass(each, BaseModel)), None)
        model = model if inner is None else inner  # a place in a list or a dictionary has the same model
    return model


def overlaid(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """The table ``below``, with the keys of ``above`` in place of its own, in all subtables."""
    out = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(out.get(key), dict)
        out[key] = overlaid(out[key], value) if both else value
    return out
