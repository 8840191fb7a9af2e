"""Numbers of settings: bounds keep sums of them finite, and loops over them short of endless."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

#: The greatest number of times that settings may ask for.
MANY = 1_000_000
Count = Annotated[int, Field(ge=1, le=MANY)]
#: A time, from a millisecond to a day, seconds.
Seconds = Annotated[float, Field(ge=1e-3, le=86_400)]
#: A time that may be nothing, seconds.
Pause = Annotated[float, Field(ge=0, le=86_400)]
Positive = Annotated[float, Field(ge=1e-9, le=1e6)]
#: A number that may be nothing.
Amount = Annotated[float, Field(ge=0, le=1e6)]
