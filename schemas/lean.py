"""dataframely, loaded without sqlalchemy, which takes a third of the time in which `pitchlore sql` starts.

dataframely can turn a schema into sqlalchemy's columns, and does without where sqlalchemy is not installed.
None of our schemas is used so. Who needs sqlalchemy, as Prefect's server does, imports it as ever.
"""

from __future__ import annotations

import sys

_NAME = "sqlalchemy"

_loaded = sys.modules.get(_NAME)
sys.modules[_NAME] = _loaded  # type: ignore[assignment]  # None: it cannot be imported
try:
    import dataframely  # noqa: F401
finally:
    if _loaded is None:
        del sys.modules[_NAME]
