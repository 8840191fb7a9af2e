"""The base of all public tables: a dataframely schema with a name, a version, and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, ClassVar, Literal, get_args

import dataframely as dy
import polars as pl

#: The teams of a match.
Side = Literal["home", "away"]
SIDES: tuple[Side, Side] = get_args(Side)
#: Their indices.
HOME, AWAY = 0, 1
BODIES = ("ball", *SIDES)
ROLES = ("goalkeeper", "midfield", "striker")

#: Teams that are named after people and are scripts.
STAND_INS = ("human-like",)
#: The note beside every result of one of them.
STAND_IN = "Human-like is a second script, after static: no person plays it, and it is no model of anyone"

#: Which elements of the state are kept (``pipeline.state.keys.columns``).
Key = Literal["full36", "full35", "ego19", "team19", "self9", "self6", "role0"]
#: From fine to coarse.
KEYS: tuple[Key, ...] = get_args(Key)


def called(team: str) -> str:
    """The name of a team, or of several that make a difference, in reports: a second script is called so."""
    parts = (f"{name} (a second script)" if name in STAND_INS else name for name in team.split(" less "))
    return " less ".join(parts)


def note_on(*teams: str) -> str | None:
    """The note that belongs beside a result of these teams, None if there is none."""
    return STAND_IN if set(teams) & set(STAND_INS) else None


class Table(dy.Schema):
    """Base of all schemas.

    A subclass names its table. Its version rises whenever its columns change in any way. Columns are only
    added, and those that are added may be null, so that files of earlier versions can be read. One that says
    what others say may go. The words of an enumeration are only added, too.
    """

    NAME: ClassVar[str]
    VERSION: ClassVar[int]
    #: Whether the table is a view of the catalogue; an abstract table has no name.
    PUBLIC: ClassVar[bool] = True
    #: The first version to which the present one has only added columns, and words to enumerations.
    SINCE: ClassVar[int] = 0
    #: Values of columns that earlier files lack; the others that they lack are null.
    FORMER: ClassVar[Mapping[str, Any]] = {}
    #: Of a table that no file holds: the query that makes it of others, and the tables that it looks into.
    VIEW: ClassVar[str] = ""
    LOOKS_INTO: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def readable(cls) -> tuple[str, ...]:
        """Tags of the files that it can read."""
        return tuple(f"{cls.NAME}/{version}" for version in range(cls.SINCE or cls.VERSION, cls.VERSION + 1))

    @classmethod
    def tag(cls) -> str:
        """``name/version``, written into every file of the table."""
        return f"{cls.NAME}/{cls.VERSION}"

    @classmethod
    def empty(cls) -> pl.DataFrame:
        """No rows, all columns."""
        return _empty(cls).clone()  # many times cheaper than a new one

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, Any]]) -> pl.DataFrame:
        """Rows, by column name, as a table.

        Raises:
            ValidationError: if they break a rule of the schema (dataframely's).
        """
        frame = pl.DataFrame(rows, schema=cls.dtypes())
        return frame if cls.holds(frame) else cls.validate(frame)

    @classmethod
    def dtypes(cls) -> dict[str, pl.DataType]:
        """Column name to polars dtype, in order."""
        return dict(_dtypes(cls))

    @classmethod
    def holds(cls, frame: pl.DataFrame) -> bool:
        """True if a table with these columns breaks none of the schema's rules.

        The answer is that of :meth:`dataframely.Schema.is_valid`, which plans all rules anew for each table:
        2 ms, several times what most tables take to check.
        """
        return all(frame.select(_rules(cls)).row(0))

    @classmethod
    def meanings(cls) -> dict[str, str]:
        """Column name to its meaning with its unit in brackets."""
        out = {}
        for name, column in cls.columns().items():
            unit = (column.metadata or {}).get("unit")
            out[name] = f"{column.description} [{unit}]" if unit else str(column.description)
        return out


#: Names that other names are made of: of matches, seasons and their settings.
SLUG = r"^[a-z0-9][a-z0-9-]{0,63}$"


def unit(name: str) -> dict[str, Any]:
    """Column metadata that names the unit."""
    return {"unit": name}


def named(codes: pl.Series, dtype: pl.DataType) -> pl.Series:
    """The names of codes, as a column of names has them.

    Args:
        codes: places in the names; null becomes null.
        dtype: dtype of the column, an Enum.
    """
    assert isinstance(dtype, pl.Enum)
    return dtype.categories.gather(codes).cast(dtype)  # polars 2 alone makes names of codes in one step


def match_id() -> dy.String:
    """The identity of a match: ``<slug>-<12 hex digits>``."""
    return dy.String(
        regex=SLUG,
        description="match the row belongs to: slug of its source and a hash of its bytes",
    )


@cache
def _dtypes(schema: type[Table]) -> dict[str, pl.DataType]:
    return {name: column.dtype for name, column in schema.columns().items()}


@cache
def _rules(schema: type[Table]) -> list[pl.Expr]:
    """For each rule of a schema whether it holds in all rows; a rule that gives null holds."""
    rules = {name: rule.expr for name, rule in schema._validation_rules(with_cast=False).items()}
    for name, column in schema.columns().items():
        if isinstance(column, dy.String) and column.regex is not None:
            # once for each run of equal texts: most tables are of one match
            texts = pl.col(name).rle().struct.field("value")
            rules[f"{name}|regex"] = column.validation_rules(texts)["regex"]
    return [rule.all(ignore_nulls=True).alias(name) for name, rule in rules.items()]


@cache
def _empty(schema: type[Table]) -> pl.DataFrame:
    return pl.DataFrame(schema=schema.dtypes())
