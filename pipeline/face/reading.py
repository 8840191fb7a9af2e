"""Matches without a data folder: read from a recording, or played."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pitchlore.pipeline.arena.match.controllers import LearnedTeam
from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, varied
from pitchlore.pipeline.arena.match.sides import team_of
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.toml import fitted
from pitchlore.pipeline.engine.matches import read_dataset, read_recording
from pitchlore.pipeline.engine.memory import MemoryInputs
from pitchlore.pipeline.engine.record import in_memory
from pitchlore.pipeline.engine.recordings import Recording, with_map
from pitchlore.pipeline.face.match import Match
from pitchlore.pipeline.settings import ImportSettings, RunSettings, Settings
from pitchlore.pipeline.store.paths import named_path

if TYPE_CHECKING:
    from pitchlore.pipeline.importers.football.dataset import KloppyDataset


def read(
    path: str | Path | KloppyDataset, *more: str | Path,
    map: str | Path | None = None,  # noqa: A002 (the word of the command line)
    provider: str | None = None, settings: Settings = Settings(),
) -> Match:
    """A match of a recording of any format, in memory; no data folder is made or needed.

    The format is detected from the content. Nothing is computed before a table is asked for. What the reader
    assumed, and what looks wrong, stands in ``m.flaws`` and ``m.quality``. The recording is read in this
    process, a provider's in one of its own; its limits stand in ``RunSettings.imports``, if that is given.

    Args:
        path: the recording, plain or packed with gzip or Zstandard; or a kloppy dataset of positions.
        more: further files of one recording of football, in the provider's order.
        map: TOML file with a tracking table's columns, units, axes and teams. None: ``PATH.toml`` or
            ``map.toml`` beside the recording, else the plain form.
        provider: provider of a recording of football, such as ``kloppy:skillcorner``; None for all others.
        settings: settings of all stages.

    Returns:
        The match. Its tables are those of a data folder that holds this match alone.

    Raises:
        NotFound: if a file cannot be read, or if a provider's files need kloppy, which is not installed.
        BadRecording: if the file is of no known format, or gives no match.
        BadSettings: if the map or the provider cannot be used.

    Examples:
        >>> m = pitchlore.read("derby.csv")
        >>> m.trajectories.columns[:5]
        ['match_id', 'frame', 't_ns', 'team', 'robot']
    """
    if not isinstance(path, (str, Path)):
        return Match(MemoryInputs(read_dataset(path), settings))
    file = named_path(path)
    recording = with_map(file) if map is None else Recording(file=file, mapping=named_path(map))
    if provider is not None:
        from pitchlore.pipeline.importers.football.providers import provider_of  # noqa: PLC0415 (loaded when asked for)

        files = tuple(named_path(each) for each in more)
        recording = Recording(file=file, provider=provider_of(provider), more=files)
    elif more:
        raise BadSettings("several files are one recording only if a provider is named", where=str(path),
                          next_step="Read each file by itself, or say whose they are: provider=")
    limits = settings.imports if isinstance(settings, RunSettings) else ImportSettings()
    log, given = read_recording(recording, limits)
    return Match(MemoryInputs(log, settings, given))


def play(
    home: str | LearnedTeam = "static", away: str | LearnedTeam = "static", *, seed: int = 0,
    minutes: float | None = None, robots: int | None = None, arena: MatchSettings | None = None,
    settings: Settings = Settings(),
) -> Match:
    """A match that is played in the arena, in memory; the same arguments play the same match.

    Args:
        home: name of a scripted team (static, human-like, pressing, counter, random), ``best-constant`` or
            ``constant:044`` for a constant team, or the team of a policy (:meth:`pitchlore.Policy.team`).
        away: the other team, likewise.
        seed: seed of all random numbers, at least 0.
        minutes: length of the match; None: 8, or what ``arena`` says.
        robots: robots of each team; None: 3, or what ``arena`` says.
        arena: pitch, physics, laws and camera; None: those of VSSS.
        settings: settings of all stages.

    Returns:
        The match.

    Raises:
        BadSettings: if a team does not exist, or if a value does not fit.

    Examples:
        >>> pitchlore.play(home="static", away="random", seed=7, minutes=0.1).info["duration_s"]
        6.0
    """
    (own, first), (other, second) = team_of(home), team_of(away)
    recipe = fitted(
        Recipe, {**varied(arena, robots, minutes), "home": own, "away": other, "seed": seed}, "play",
        "help(pitchlore.MatchSettings) explains them")
    teams = ((own, first), (other, second))
    known = {str(team.policy): tables for team, tables in teams if tables is not None}
    return Match(MemoryInputs(in_memory(recipe, known), settings, recipe.model_dump(mode="json")))
