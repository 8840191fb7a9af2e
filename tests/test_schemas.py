"""Schemas: our check of a table's rules says what dataframely's says."""

import dataframely as dy
import polars as pl
import pytest

from pitchlore.schemas import PUBLIC

#: Its rules add up columns: no table drawn at random keeps them.
NOT_DRAWN = "games"


@pytest.mark.parametrize("name", sorted(PUBLIC.keys() - {NOT_DRAWN}))
def test_rules(name):
    """A table that breaks a rule in any column is found, and a table that breaks none is not."""
    schema = PUBLIC[name]
    good = schema.sample(6, generator=dy.random.Generator(1))
    assert schema.holds(good)
    found = 0
    for column, dtype in good.schema.items():
        nothing = pl.lit(None).cast(dtype)
        harmed = [nothing, pl.when(pl.int_range(pl.len()) != 3).then(column)]
        if dtype.is_numeric():
            harmed += [pl.lit(-999).cast(dtype, strict=False)] if dtype.is_signed_integer() or dtype.is_float() else []
        if dtype == pl.String:
            harmed += [pl.when(pl.int_range(pl.len()) != at).then(column).otherwise(pl.lit("Ä b")) for at in (0, 3, 5)]
        if dtype.is_float():
            harmed += [pl.lit(float("nan")).cast(dtype), pl.lit(float("inf")).cast(dtype)]
        for values in harmed:
            table = good.with_columns(values.alias(column))
            assert schema.holds(table) == schema.is_valid(table)
            found += not schema.holds(table)
    assert found
