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


#: Files of kloppy's own tests, each kind that it has: provider, files, teams, score, samples, and where home attacks by
#: the provider's word in the first and second half (0 where it has none).
KINDS = [
    *(("tracab", (f"tracab_meta{kind}", f"tracab_raw.{raw}"), teams, None, 7, attacks) for kind, teams, attacks in (
        (".json", "Short Name Home - Short Name Away", (-1, 1)), (".xml", "Short Name Home - Short Name Away", (0, 0)),
        ("_2.xml", "home - away", (0, 0)), ("_3.xml", "home - away", (0, 0)),
        ("_4.xml", "Widzew Łódź - Short Name Away", (-1, 1))) for raw in ("dat", "json")
      if raw == "dat" or "home" not in teams),  # these two name no players, whom the JSON form needs
    *(("metrica-epts", (f"epts_metrica_metadata{meta}.xml", f"epts_metrica_tracking{raw}.txt"), "Team A - Team B", None, 100, (1, -1))
      for meta in ("", "_without_score", "_unused_sensor") for raw in ("", "_with_empty_values")),
    ("metrica-csv", ("metrica_home.csv", "metrica_away.csv"), "Home - Away", None, 6, (0, 0)),
    *(("secondspectrum", ("second_spectrum_fake_metadata.xml", raw, *more), teams, score, samples, (0, 0))
      for raw, samples in (("second_spectrum_fake_data.jsonl", 376), ("second_spectrum_fake_data_utf8sig.jsonl", 13))
      for more, teams, score in (((), "home - away", None), (("second_spectrum_fake_metadata.json",), "FK1 - FK2", (2, 1)))),
    *(("sportec", ("sportec_meta.xml", f"sportec_positional{raw}.xml"), "Sport-Club Freiburg - Borussia Mönchengladbach", (1, 0), 202, (0, 0))
      for raw in ("", "_w_referee")),
    *(("statsperform", (f"statsperform_tracking_ma1.{meta}", "statsperform_tracking_ma25.txt"), "Monaco - Reims", (2, 2), 92, (0, 0))
      for meta in ("json", "xml")),
    ("signality", RECORDINGS["signality"], "Home Team - Away Team", None, 10, (0, 0)),
    ("skillcorner", RECORDINGS["skillcorner"], "Team Name - Team Name", (1, 0), 6, (-1, 1)),
    ("pff", RECORDINGS["pff"], "Argentina - France", None, 200, (1, -1)),
    ("pff", ("pff_metadata_3812.json", "pff_rosters_3812.json", "pff_3812.jsonl"), "Senegal - Netherlands", None, 100, (-1, 1)),
]


@cache
def shipped(provider: str) -> MatchLog:
    """The match of a provider's shortest recording."""
    source = source_of(provider, RECORDINGS[provider])
    return match_of_dataset(dataset_of(source), source)
