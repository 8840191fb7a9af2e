"""Providers of football's tracking data that kloppy reads from local files: one table, ``PROVIDERS``."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from importlib import import_module
from typing import TYPE_CHECKING, Any

from pitchlore.pipeline.base.errors import BadRecording, NotFound, in_one_line
from pitchlore.pipeline.base.text import NAME_CHARACTERS, printable
from pitchlore.pipeline.importers.football.markup import safe_epts, safe_xml, safe_xml_or_json
from pitchlore.pipeline.importers.packing import Octets
from pitchlore.pipeline.importers.source import SourceFile, inflate, slug
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.schemas import SIDES

if TYPE_CHECKING:
    from kloppy.domain import TrackingDataset

#: The word before the provider in ``--from kloppy:PROVIDER``, and the format of such matches.
KLOPPY = "kloppy"


@dataclass(frozen=True, slots=True)
class Provider:
    """A provider's files, and the function of kloppy that reads them.

    Attributes:
        title: name for users.
        module: module of kloppy.
        function: its function.
        files: names of the function's arguments, in the order in which the files are given.
        many: name of an argument that takes all further files, else None.
        more: name of an argument that takes one further file, if it is given, else None.
        options: further arguments.
        markup: by the name of each argument that kloppy may read as XML, the function that makes its bytes
            safe, or refuses them.
    """

    title: str
    module: str
    function: str
    files: tuple[str, ...]
    many: str | None = None
    more: str | None = None
    options: Mapping[str, str] = field(default_factory=dict)
    markup: Mapping[str, Callable[[bytes, str], bytes]] = field(default_factory=dict)

    def usage(self) -> str:
        """Files to give, as in a usage line."""
        words = [name.upper() for name in self.files] + ([f"{self.many.upper()}…"] if self.many else [])
        return " ".join([*words, f"[{self.more.upper()}]"] if self.more else words)


#: All providers, by the word that names them. HawkEye is not here: kloppy's loader takes its files by their
#: names on the disk, and not by their content.
PROVIDERS: dict[str, Provider] = {
    "skillcorner": Provider("SkillCorner", "kloppy.skillcorner", "load", ("meta_data", "raw_data")),
    "secondspectrum": Provider(
        "Second Spectrum", "kloppy.secondspectrum", "load", ("meta_data", "raw_data"),
        more="additional_meta_data", markup={"meta_data": safe_xml_or_json}),
    "tracab": Provider("TRACAB", "kloppy.tracab", "load", ("meta_data", "raw_data"),
                       markup={"meta_data": safe_xml_or_json}),
    "metrica-csv": Provider(
        "Metrica, CSV", "kloppy.metrica", "load_tracking_csv", ("home_data", "away_data")),
    "metrica-epts": Provider(
        "Metrica, EPTS", "kloppy.metrica", "load_tracking_epts", ("meta_data", "raw_data"),
        markup={"meta_data": safe_epts}),
    "sportec": Provider("Sportec (DFL)", "kloppy.sportec", "load_tracking", ("meta_data", "raw_data"),
                        markup={"meta_data": safe_xml, "raw_data": safe_xml}),
    "statsperform": Provider(
        "Stats Perform", "kloppy.statsperform", "load_tracking", ("ma1_data", "ma25_data"),
        markup={"ma1_data": safe_xml_or_json}),
    "signality": Provider(
        "Signality", "kloppy.signality", "load", ("meta_data", "venue_information"), "raw_data_feeds"),
    # kloppy turns extra time about the origin, which is the pitch's centre in PFF's own system alone
    "pff": Provider("PFF", "kloppy.pff", "load_tracking", ("meta_data", "roster_meta_data", "raw_data"),
                    options={"coordinates": "pff"}),
}


def provider_of(origin: str) -> str:
    """The provider that ``kloppy:PROVIDER`` names.

    Raises:
        NotFound: if it names none.
    """
    library, _, word = origin.partition(":")
    if library != KLOPPY or word not in PROVIDERS:
        raise NotFound(
            f"--from {origin} names no source",
            next_step=f"Name one of {', '.join(f'{KLOPPY}:{known}' for known in PROVIDERS)}",
        )
    return word


def open_files(
    parts: Sequence[tuple[str, Octets]], word: str, limits: ImportSettings = ImportSettings()
) -> SourceFile:
    """A provider's files as one recording: inflated and hashed together.

    Args:
        parts: name and bytes of each file, in the order of the provider's ``files``; gzipped or not.
        word: the provider, a key of ``PROVIDERS``.
        limits: bounds of reading's cost; ``megabytes`` is for all files together.

    Returns:
        The recording. Its hash is that of the provider's word and the files' own hashes, and its name that of
        the last file of the provider's ``files``.

    Raises:
        BadRecording: if the files are not as many as the provider has, if one is damaged, too large, or XML
            that could read other files (:mod:`pipeline.importers.football.markup`).
    """
    provider, names = PROVIDERS[word], [printable(name, NAME_CHARACTERS) for name, _ in parts]
    least = len(provider.files) + (provider.many is not None)
    if len(parts) < least or (len(parts) > least + (provider.more is not None) and provider.many is None):
        raise BadRecording(
            f"{len(parts)} files are not a recording of {provider.title}", where=", ".join(names),
            next_step=f"Give its files in this order: {provider.usage()}",
        )
    contents, digest = [], sha256(word.encode())
    further = provider.many or provider.more or ""
    arguments = (*provider.files, *[further] * (len(parts) - len(provider.files)))
    for name, argument, (_, data) in zip(names, arguments, parts, strict=True):
        content, damage = inflate(data[:], name, limits.megabytes)
        if damage is not None:
            raise BadRecording(damage, where=name, next_step="Copy or record it again")
        digest.update(sha256(content).digest())
        made_safe = provider.markup.get(argument)
        contents.append(content if made_safe is None else made_safe(content, name))
    named = len(provider.files) - 1
    whole = SourceFile(
        names[named], b"", None, KLOPPY, digest.hexdigest(),
        f"{slug(parts[named][0])}-{digest.hexdigest()[:12]}", limits, parts=tuple(contents), provider=word,
    )
    if sum(map(len, contents)) > limits.megabytes << 20:
        raise whole.too_much(f"{sum(map(len, contents)) >> 20} MiB", "megabytes")
    return whole


def dataset_of(source: SourceFile) -> TrackingDataset:
    """Kloppy's dataset of a provider's files.

    Raises:
        NotFound: if kloppy is not installed.
        BadRecording: if kloppy cannot read them, finds no sample in them, or goes on without the last one.
    """
    assert source.provider is not None
    provider = PROVIDERS[source.provider]
    try:
        load = getattr(import_module(provider.module), provider.function)
    except ImportError as error:
        raise NotFound(
            f"kloppy, which reads {provider.title}, cannot be loaded ({in_one_line(error)})",
            next_step="Install the extra pitchlore[kloppy]",
        ) from error
    count = len(provider.files)
    files: dict[str, Any] = dict(zip(provider.files, source.parts[:count], strict=True))
    if provider.many is not None:
        files[provider.many] = list(source.parts[count:])
    elif provider.more is not None and len(source.parts) > count:
        files[provider.more] = source.parts[count]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a frame's direction, or of a default that it takes
            dataset: TrackingDataset = load(**files, **provider.options)
    except Exception as error:  # whatever its parsers raise
        raise BadRecording(
            f"is not read by kloppy as {provider.title} ({in_one_line(error)})", where=source.name,
            next_step=f"Give its files in this order: {provider.usage()}",
        ) from error
    if not dataset.records:
        raise BadRecording("has no sample", where=source.name, next_step="Give the files of a played match")
    # kloppy goes on without further metadata that it cannot read, and the teams keep the names of their sides
    if len(source.parts) > count and provider.more and dataset.metadata.teams[0].team_id == SIDES[0]:
        raise BadRecording(
            f"the {provider.more} beside it is not {provider.title}'s, or has no teams", where=source.name,
            next_step=f"Give its files in this order, or leave the last one out: {provider.usage()}",
        )
    return dataset
