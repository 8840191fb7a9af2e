"""The provider's files that kloppy's wheel ships, read where they are installed and never copied."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest

from pitchlore.pipeline.importers.football.dataset import match_of
from pitchlore.pipeline.importers.football.providers import dataset_of, open_files
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.matches.frame import MatchLog

_SPEC = find_spec("kloppy")
#: The folder of kloppy's own test files.
FILES = Path() if _SPEC is None or _SPEC.origin is None else Path(_SPEC.origin).parent / "tests" / "files"

#: Skips where kloppy, or its files, are not there.
NEEDS_KLOPPY = pytest.mark.skipif(
    not (FILES / "skillcorner_match_data.json").is_file(), reason="needs the extra kloppy with its test files")

#: A recording of each provider: its files in the provider's order.
RECORDINGS = {
    "skillcorner": ("skillcorner_meta_data.json", "skillcorner_v3_raw_data.jsonl"),
    "secondspectrum": ("second_spectrum_fake_metadata.xml", "second_spectrum_fake_data.jsonl"),
    "tracab": ("tracab_meta.json", "tracab_raw.json"),
    "metrica-csv": ("metrica_home.csv", "metrica_away.csv"),
    "metrica-epts": ("epts_metrica_metadata.xml", "epts_metrica_tracking.txt"),
    "sportec": ("sportec_meta.xml", "sportec_positional.xml"),
    "statsperform": ("statsperform_tracking_ma1.json", "statsperform_tracking_ma25.txt"),
    "signality": (
        "signality_meta_data.json", "signality_venue_information.json", "signality_p1_raw_data_subset.json",
        "signality_p2_raw_data_subset.json"),
    "pff": ("pff_metadata_10517.json", "pff_rosters_10517.json", "pff_10517.jsonl"),
}

#: SkillCorner's whole match: Bayern - Dortmund 4 : 0 of 2019-11-09, by a broadcast's camera.
MATCH = ("skillcorner_match_data.json", "skillcorner_structured_data.json")


def source_of(provider: str, names: tuple[str, ...]) -> SourceFile:
    """A recording of kloppy's files, opened."""
    return open_files([(name, (FILES / name).read_bytes()) for name in names], provider)


@cache
def shipped(provider: str) -> MatchLog:
    """The match of a provider's shortest recording."""
    source = source_of(provider, RECORDINGS[provider])
    return match_of(dataset_of(source), source)


@cache
def whole_match() -> MatchLog:
    """SkillCorner's whole match (a quarter of a minute)."""
    source = source_of("skillcorner", MATCH)
    return match_of(dataset_of(source), source)
