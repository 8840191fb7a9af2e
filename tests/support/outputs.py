"""Outputs made by hand, and tables as earlier versions wrote them."""

import io
from pathlib import Path

import polars as pl

from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.tables import SCHEMA_KEY
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Goals


def put_goal(store: Store, match: str, robot: int) -> Path:
    """Commit a match with one goal. Returns the file of its goals."""
    frame = pl.DataFrame(
        {"match_id": [match], "t_ns": [5], "team": ["away"], "robot": [robot], "kind": ["error"],
         "origin": ["referee"], "confidence": [None]},
        schema=Goals.dtypes(),
    )
    store.commit(Work("matches", match, {}, version=1), Made())
    receipt = store.commit(Work("goals", match, {"robot": robot}, version=1), Made([(frame, Goals)]))
    return store.root / receipt.files["goals"].path


def written(rows, tag):
    """A table as the version of its schema with a tag wrote it."""
    rows.write_parquet(data := io.BytesIO(), metadata={SCHEMA_KEY: tag})
    return data.getvalue()
