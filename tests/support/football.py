"""The provider's files that kloppy's wheel ships, read where they are installed and never copied."""

from functools import cache

import pytest
from football.skillcorner import THERE, source_of

from pitchlore.pipeline.importers.football.dataset import match_of_dataset
from pitchlore.pipeline.importers.football.providers import dataset_of
from pitchlore.pipeline.matches.frame import MatchLog

#: Skips where kloppy, or its files, are not there.
NEEDS_KLOPPY = pytest.mark.skipif(not THERE, reason="needs the extra kloppy with its test files")

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


@cache
def shipped(provider: str) -> MatchLog:
    """The match of a provider's shortest recording."""
    source = source_of(provider, RECORDINGS[provider])
    return match_of_dataset(dataset_of(source), source)
