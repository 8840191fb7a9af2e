"""Writes the reference from the code: every table, every settings model, every command.

    python docs/reference.py FOLDER

``make docs`` calls it for a copy of ``docs/``, from which the site is built. The pages that are committed in
``docs/reference/`` only say how to make these, so they cannot be stale.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
from collections.abc import Iterable, Iterator
from enum import Enum
from inspect import cleandoc
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from docstring_parser import Docstring, parse
from pydantic import BaseModel
from pydantic.fields import FieldInfo

import pitchlore
from pitchlore.flows.cli import COMMANDS, command_line
from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.engine.tables import TableOf
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.settings import RunSettings
from pitchlore.pipeline.stages.seasons.settings import SeasonSettings
from pitchlore.schemas import PUBLIC, Table

#: What a user writes in TOML: the option that takes the file, and the model that it fills.
FILES: dict[str, type[BaseModel]] = {
    "run --settings FILE": RunSettings,
    "record --settings FILE": MatchSettings,
    "season --settings FILE": SeasonSettings,
    "import --map FILE": TrackingMap,
}
_ALSO = {
    "run --settings FILE": (
        "`train` and `serve` take the same file. `paper` and `paper-literal` are named settings."
    ),
    "record --settings FILE": "`play` and `evaluate` take the same file.",
    "season --settings FILE": (
        "The key `base` names settings that come along (`best`, `paper`). The file says what differs."
    ),
    "import --map FILE": "The file may also lie beside the recording: `NAME.csv.toml`, or `map.toml`.",
}
_ON_TABLES = """Every table is a view of `data/catalog.duckdb`.
`pitchlore sql --tables` prints the same columns. A column is null only where its type says so."""
_ON_SETTINGS = """Settings are TOML. A file says what differs from the defaults. An unknown key is an error.
The end of a name is its unit: `_s` seconds, `_ns` nanoseconds, `_m` metres. Other units stand in the meaning.
A number without a unit is a count or a ratio."""
_ON_API = """All that `import pitchlore` shows. Nothing else is public: what lies in `pitchlore.pipeline` may
change in any version. A name is loaded when it is first asked for, so that the import takes milliseconds."""
#: Names that are listed without their members: settings have a page of their own.
_NAMED_ONLY = ("MatchSettings", "Settings", "Pitch", "PitchloreError")
_BOUNDS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤", "min_length": "length ≥", "max_length": "length ≤"}


def tables() -> str:
    """The page of all public tables: every column with its type, unit, bounds and meaning."""
    parts = ["# Tables", _ON_TABLES]
    for name, schema in PUBLIC.items():
        rows = [(f"`{column}`", *_column(schema, column), meaning)
                for column, meaning in _descriptions(schema).items()]
        parts += [f"## {name}", _prose(schema.__doc__), f"Version {schema.VERSION} of the schema.",
                  _table(("column", "type", "unit", "bounds", "meaning"), rows)]
    return "\n\n".join(parts) + "\n"


def settings() -> str:
    """The page of all settings that a file may hold: every key with its type, default, bounds and meaning."""
    parts = ["# Settings", _ON_SETTINGS]
    said: dict[type[BaseModel], list[tuple[str, ...]]] = {}
    for option, root in FILES.items():
        parts += [f"## {option}", _ALSO[option]]
        for path, model, defaults in models(root):
            keys = _keys(model, defaults)
            heading = f"### {path or 'Top level'}"
            if said.get(model) == keys:
                parts += [heading, f"The keys and defaults of [{model.__name__}](#{_anchor(model)})."]
                continue
            if model not in said:
                said[model] = keys
                heading += f" {{ #{_anchor(model)} }}"
            parts += [heading, _prose(_doc(model).description)]
            if keys:
                parts.append(_table(("key", "type", "default", "bounds", "meaning"), keys))
    return "\n\n".join(parts) + "\n"


def commands() -> str:
    """The page of all commands: arguments, options, defaults and an example of each."""
    text = command_line().generate_docs(output_format="markdown")
    text = text.replace("# pitchlore\n", "# Commands\n", 1)
    text = re.sub(r"## Table of Contents\n.*?(?=\*\*Start\*\*)", "", text, count=1, flags=re.DOTALL)
    for command in COMMANDS:
        heading = f"# pitchlore {command.name}\n"
        text = text.replace(heading, f"{heading}\nExample: `{command.example}`\n", 1)
    return text


def api() -> str:
    """The page of all that ``import pitchlore`` shows, from the docstrings."""
    parts = ["# Python", _ON_API]
    for name in sorted(set(pitchlore.__all__) - {"__version__"}, key=str.lower):
        thing = getattr(pitchlore, name)
        parts += [f"## {name}", *_documented(f"pitchlore.{name}", thing)]
        members = [] if name in _NAMED_ONLY or not inspect.isclass(thing) else inspect.getmembers(thing)
        tables = [own for own, member in members if isinstance(member, TableOf)]
        if tables:
            parts.append("Tables: " + ", ".join(f"[`{own}`](tables.md#{own})" if own in PUBLIC else f"`{own}`"
                                                for own in tables) + ".")
        for own, member in members:
            if not own.startswith("_") and own not in tables and _is_ours(member):
                parts += [f"### {name}.{own}", *_documented(f"{name.lower()}.{own}", member)]
    return "\n\n".join(parts) + "\n"


def _is_ours(member: object) -> bool:
    """False for what a class inherits from Python's own."""
    own = member.fget if isinstance(member, property) else member
    return getattr(own, "__module__", "").startswith("pitchlore.")


def _documented(name: str, thing: Any) -> list[str]:
    """Signature, prose, arguments, returned value, errors and examples of a function or a class."""
    doc, parts = parse(inspect.getdoc(thing) or ""), list[str]()
    if inspect.isroutine(thing):
        parts.append(f"```python\n{name}{_signature(thing)}\n```")
    parts.append(_prose("\n\n".join(filter(None, (doc.short_description, doc.long_description)))))
    reported = [(f"`{it.arg_name}`", _code(it.description or "")) for it in doc.params]
    if reported and inspect.isroutine(thing):
        parts.append(_table(("argument", "meaning"), reported))
    if doc.returns:
        parts.append(f"**Returns** {_code(' '.join((doc.returns.description or '').split()))}")
    if doc.raises:
        reported = [(f"`{it.type_name}`", _code(it.description or "")) for it in doc.raises]
        parts.append(_table(("error", "when"), reported))
    examples = [part for it in doc.examples for part in (it.snippet, it.description) if part]
    if examples:
        parts.append("```pycon\n" + "\n".join(examples) + "\n```")
    return parts


def _signature(function: Any) -> str:
    """The signature as one writes it; a default that is a model is its class, without its fields."""
    signature = inspect.signature(function)
    own = [it.replace(default=_Shown(it.default)) if it.default is not it.empty else it
           for it in signature.parameters.values() if it.name != "self"]
    return str(signature.replace(parameters=own)).replace("'", "").replace(_QUOTE, '"')


#: Stands for a quotation mark of a default, while those around annotations are removed.
_QUOTE = "\0"


class _Shown:
    """A default as one writes it."""

    def __init__(self, value: object) -> None:
        self._value = value

    def __repr__(self) -> str:
        if isinstance(self._value, BaseModel):
            return f"{type(self._value).__name__}()"
        return repr(self._value).replace("'", _QUOTE)


def models(
    model: type[BaseModel], path: str = "", defaults: BaseModel | None = None,
) -> Iterator[tuple[str, type[BaseModel], BaseModel | None]]:
    """A model and those inside it, each with its TOML table and its defaults, None where it has none.

    A table is written ``[a.b]``, a list of tables ``[[a.b]]``, and the top level as the empty string.
    """
    yield path, model, defaults
    inside = path.strip("[]")
    for name, field in model.model_fields.items():
        table = f"{inside}.{name}" if inside else name
        value = getattr(defaults, name) if defaults is not None else _given(field)
        if _is_model(field.annotation):
            yield from models(field.annotation, f"[{table}]", value)  # type: ignore[arg-type]
        elif get_origin(field.annotation) is tuple and _is_model(get_args(field.annotation)[0]):
            yield from models(get_args(field.annotation)[0], f"[[{table}]]")


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _given(field: FieldInfo) -> Any:
    """A field's default, None if it has none."""
    return None if field.is_required() else field.get_default(call_default_factory=True)


def _descriptions(schema: type[Table]) -> dict[str, str]:
    return {name: str(column.description) for name, column in schema.columns().items()}


def _column(schema: type[Table], name: str) -> tuple[str, str, str]:
    """Type, unit and bounds of a column."""
    column = schema.columns()[name]
    categories = getattr(column.dtype, "categories", None)
    kind = " or ".join(f"`{c}`" for c in categories) if categories is not None else f"`{column.dtype}`"
    if column.nullable:
        kind += ", or null"
    limits = [f"{sign} {limit}" for attribute, sign in
              (("min", "≥"), ("max", "≤"), ("min_exclusive", ">"), ("max_exclusive", "<"))
              if (limit := getattr(column, attribute, None)) is not None]
    return kind, str((column.metadata or {}).get("unit", "")), ", ".join(limits)


def _keys(model: type[BaseModel], defaults: BaseModel | None) -> list[tuple[str, ...]]:
    """A row for each key of a model that is not a table of its own."""
    said = {name: meaning for base in reversed(model.__mro__) if issubclass(base, BaseModel)
            for name, meaning in _meanings(_doc(base)).items()}
    return [
        (f"`{name}`", _type(field.annotation), _default(field, defaults, name), _bounds(field),
         said.get(name, ""))
        for name, field in model.model_fields.items() if not _is_model(field.annotation)
    ]


def _doc(model: type[BaseModel]) -> Docstring:
    return parse(model.__doc__ or "")


def _meanings(doc: Docstring) -> dict[str, str]:
    return {name.strip(): _code(param.description or "")
            for param in doc.params for name in param.arg_name.split(",")}


def _type(annotation: Any) -> str:
    """A type in words: the values of a choice, else the name."""
    arguments = get_args(annotation)
    origin = get_origin(annotation)
    if origin is Annotated:
        return _type(arguments[0])
    if origin is Literal:
        return " or ".join(f'`"{value}"`' for value in arguments)
    if origin in (Union, UnionType):
        return " or ".join(_type(a) for a in arguments if a is not NoneType)
    if origin is tuple:
        return f"list of {_type(arguments[0])}"
    if origin is dict:
        return f"table of {_type(arguments[1])}"
    if issubclass(annotation, Enum):
        return " or ".join(f'`"{member.value}"`' for member in annotation)
    return f"`{annotation.__name__}`"


def _default(field: FieldInfo, defaults: BaseModel | None, name: str) -> str:
    if defaults is None and field.is_required():
        return "none: must be given"
    value = _given(field) if defaults is None else getattr(defaults, name)
    if value is None:
        return "not given"
    if isinstance(value, tuple) and any(isinstance(item, BaseModel) for item in value):
        return f"{len(value)} tables"
    return f"`{json.dumps(value)}`"


def _bounds(field: FieldInfo) -> str:
    return ", ".join(f"{sign} {getattr(limit, name)}" for limit in field.metadata
                     for name, sign in _BOUNDS.items() if hasattr(limit, name))


def _anchor(model: type[BaseModel]) -> str:
    return model.__name__.lower()


def _prose(text: str | None) -> str:
    """A docstring as Markdown, a paragraph a line."""
    return _code("\n\n".join(" ".join(part.split()) for part in cleandoc(text or "").split("\n\n")))


def _code(text: str) -> str:
    """One line of a docstring, its literals as Markdown's."""
    return re.sub(r":\w+:`~?\.?([^`]+)`", r"`\1`", text).replace("``", "`")


def _table(names: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [names, tuple("---" for _ in names), *rows]
    return "\n".join("| " + " | ".join(" ".join(cell.split()).replace("|", r"\|") for cell in line) + " |"
                     for line in lines)


PAGES = {"tables.md": tables, "settings.md": settings, "commands.md": commands, "api.md": api}


def write(folder: Path) -> None:
    """Write all pages into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, page in PAGES.items():
        (folder / name).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
