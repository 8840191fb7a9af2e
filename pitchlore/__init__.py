"""Recorded robot-soccer matches in; situations, behaviours, knowledge and a trained policy out."""

from pathlib import Path as _Path

# A checkout without links, as Git for Windows makes it, has files in their place: then the folders beside it.
if not _Path(__file__).with_name("pipeline").is_dir():
    __path__.append(str(_Path(__file__).parents[1]))

from pitchlore.pipeline import __version__ as __version__
