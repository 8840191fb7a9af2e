"""dataframely, loaded without sqlalchemy, which would take a third of the start of `pitchlore sql`.

dataframely imports sqlalchemy, if it is installed, to turn schemas into sqlalchemy's columns. Our schemas
do not use that. Code that needs sqlalchemy, such as Prefect's server, imports it as usual.
"""

from __future__ import annotations

import sys

_NAME = "sqlalchemy"

_is_loaded = _NAME in sys.modules
if not _is_loaded:
    sys.modules[_NAME] = None  # type: ignore[assignment]  # it cannot be imported
try:
    import dataframely  # noqa: F401
finally:
    if not _is_loaded:
        del sys.modules[_NAME]
