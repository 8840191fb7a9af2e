"""dataframely, loaded without sqlalchemy, which takes a third of the time in which `pitchlore sql` starts.

dataframely can turn a schema into sqlalchemy's columns, and does without where sqlalchemy is not installed.
None of our schemas is used so. Who needs sqlalchemy, as Prefect's server does, imports it as ever.
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
