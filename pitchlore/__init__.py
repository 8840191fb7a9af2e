"""Pitchlore reads recorded robot-soccer matches, shows what went with winning and losing, and trains a team.

A match of a recording, and all that is made from it::

    import pitchlore

    m = pitchlore.read("derby.csv")
    m.situations, m.goals, m.passes, m.values  # polars frames
    m.replay("derby.html")

A league in a data folder::

    league = pitchlore.open("data")
    league.matches, league.sql("from goals"), league.knowledge().behaviours
"""

from importlib import import_module
from pathlib import Path as _Path
from typing import TYPE_CHECKING

# A checkout without links, as Git for Windows makes it, has files in their place: then the folders beside it.
if not _Path(__file__).with_name("pipeline").is_dir():
    __path__.append(str(_Path(__file__).parents[1]))

from pitchlore.pipeline.base.software import __version__

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.match.recipe import MatchSettings
    from pitchlore.pipeline.base.errors import PitchloreError
    from pitchlore.pipeline.face.environments import env, parallel_env
    from pitchlore.pipeline.face.league import League, open  # noqa: A004 (as one says it)
    from pitchlore.pipeline.face.match import Match
    from pitchlore.pipeline.face.reading import play, read
    from pitchlore.pipeline.face.shipped import studies
    from pitchlore.pipeline.face.versions import Knowledge, Policy
    from pitchlore.pipeline.game.pitch import Pitch
    from pitchlore.pipeline.settings import Settings

__all__ = [
    "Knowledge", "League", "Match", "MatchSettings", "Pitch", "PitchloreError", "Policy", "Settings",
    "__version__", "env", "open", "parallel_env", "play", "read", "studies",
]

#: The module of each name; it is loaded when the name is first asked for, so that commands start at once.
_MODULES = {
    "Knowledge": "face.versions", "League": "face.league", "Match": "face.match",
    "MatchSettings": "arena.match.recipe", "Pitch": "game.pitch", "PitchloreError": "base.errors",
    "Policy": "face.versions", "Settings": "settings", "env": "face.environments", "open": "face.league",
    "parallel_env": "face.environments", "play": "face.reading", "read": "face.reading",
    "studies": "face.shipped",
}


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(import_module(f"pitchlore.pipeline.{_MODULES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
