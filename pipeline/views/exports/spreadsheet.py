"""CSV that a spreadsheet opens without taking a stranger's text for a formula."""

from __future__ import annotations

import polars as pl

#: Text that is a number, and stays one.
_NUMBER = r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$"
#: Beginnings of a formula, in a cell and after what some spreadsheets take for a cell's end.
_BEGINS, _GOES_ON = r"^([=+\-@＝＋－＠\t\r])", r"([;\t\r\n])([=+\-@＝＋－＠])"


def safe_csv(frame: pl.DataFrame) -> str:
    """A table as comma-separated values with a header; text that is a formula begins with an apostrophe.

    Numbers, and text that is a number, are as they are.
    """
    header = pl.DataFrame([frame.columns], orient="row", schema=[str(i) for i in range(frame.width)])
    texts = pl.selectors.by_dtype(pl.String, pl.Categorical, pl.Enum)
    text = texts.cast(pl.String)
    safe = pl.when(text.str.contains(_NUMBER)).then(text).otherwise(
        text.str.replace(_BEGINS, "'${1}").str.replace_all(_GOES_ON, "${1}'${2}"))
    return "".join(part.with_columns(safe).write_csv(include_header=False) for part in (header, frame))
