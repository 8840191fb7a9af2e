"""SkillCorner's match, read where kloppy's wheel has installed it, and never copied."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from pitchlore.pipeline.importers.football.dataset import match_of_dataset
from pitchlore.pipeline.importers.football.providers import open_files
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.matches.frame import MatchLog

_SPEC = find_spec("kloppy")
#: The folder of kloppy's own test files.
FILES = Path() if _SPEC is None or _SPEC.origin is None else Path(_SPEC.origin).parent / "tests" / "files"
#: The whole match: Bayern - Dortmund 4 : 0 of 2019-11-09, by a broadcast's camera.
MATCH = ("skillcorner_match_data.json", "skillcorner_structured_data.json")
#: Whether it is there.
THERE = all((FILES / name).is_file() for name in MATCH)


def source_of(provider: str, names: tuple[str, ...]) -> SourceFile:
    """A recording of kloppy's files, opened."""
    return open_files([(name, (FILES / name).read_bytes()) for name in names], provider)


@cache
def whole_match() -> MatchLog:
    """SkillCorner's whole match (some seconds).

    Kloppy leaves it in the provider's coordinates: to turn these into its own takes three times as long, and
    a match has the places of the pitch whatever the dataset has.
    """
    source = source_of("skillcorner", MATCH)
    load = import_module("kloppy.skillcorner").load
    return match_of_dataset(load(*source.parts, coordinates="skillcorner"), source)
