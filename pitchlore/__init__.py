"""Recorded robot-soccer matches in; situations, behaviours, knowledge and a trained policy out."""

from pitchlore.pipeline import __version__ as __version__
