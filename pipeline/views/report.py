"""The report on all seasons: claims with verdicts, plots, and one page."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import polars as pl
from pydantic import ValidationError

from pitchlore.pipeline import arena
from pitchlore.pipeline.base.errors import NotFound, PitchloreError
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine.catalog import check_files
from pitchlore.pipeline.engine.look import Vouched
from pitchlore.pipeline.engine.outputs import refusing, table_of
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.teams import Player, apprentice, entrant, labelled
from pitchlore.pipeline.stages.evaluations import Entrant, Evaluation
from pitchlore.pipeline.stages.report.claims import BEST, IN_GAMES, STATIC, season_verdicts
from pitchlore.pipeline.stages.report.document import web_page
from pitchlore.pipeline.stages.report.measures import CONTROLS, seasons_of
from pitchlore.pipeline.stages.report.preferences import NO_PREFERENCES, preferred_by_role
from pitchlore.pipeline.stages.report.report import COLOURS, markdown
from pitchlore.pipeline.stages.seasons.settings import Season
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Made
from pitchlore.pipeline.views.glossary import explained
from pitchlore.pipeline.views.plots.report import plots_of_seasons
from pitchlore.schemas import Claims, Evaluations, Games, Growth

#: Name of the noun's only output.
NAME = "seasons"
TITLE = "Pitchlore: seasons"

#: The report is made of all seasons; it has no settings.
NO_SETTINGS = Frozen()


def damaged(store: Store) -> list[Vouched]:
    """Damaged files of seasons and evaluations. What they are of is left out of the report."""
    return [file for file in check_files(store) if file.receipt.noun in ("seasons", "evaluations")]


def _whole(store: Store, noun: str, without: Sequence[Vouched]) -> list[Receipt]:
    """Receipts of a noun, by name, but damaged ones and those of damaged files, which the command names."""
    names = {file.receipt.name for file in without if file.receipt.noun == noun}
    return [found for name, found in store.tried(noun) if isinstance(found, Receipt) and name not in names]


class Measurements(NamedTuple):
    """Pairs of matches that measure the seasons' apprentices and the controls.

    Attributes:
        counted: receipts of the pairs that count.
        left_out: number of the other pairs.
    """

    counted: list[Receipt]
    left_out: int


def measurements(store: Store, seasons: Sequence[Receipt], evaluations: Sequence[Receipt]) -> Measurements:
    """Pairs of matches that measure the seasons' apprentices, and the controls beside them.

    A pair counts under three conditions. The team plays the policy that the season's last game left (by its
    SHA-256). It plays with the defaults of `pitchlore evaluate`. The matches have the settings of the
    season's games. All pairs of an apprentice are of one version of the arena: that of the season's games,
    or the present one if that version has no pairs. The pairs of a control count like those of an
    apprentice of the first season that it has such pairs for; those of `best` against static come first.
    """
    names = (*(season.name for season in seasons), *CONTROLS)
    played: dict[str, list[Receipt]] = {name: [] for name in names}
    for receipt in evaluations:
        played.get(receipt.settings["evaluation"]["team"]["name"], []).append(receipt)
    counted = []
    for season in seasons:
        if played[season.name]:
            with suppress(PitchloreError):  # without the season's store its last policy is unknown
                counted += _measuring(season, apprentice(store, season.name).team, played[season.name])
    best_first = sorted(seasons, key=lambda season: (
        season.settings.get("name") != BEST, season.settings.get("opponent") != STATIC))
    for control in filter(played.get, CONTROLS):
        team = entrant(store, control, {})
        beside = (_measuring(season, team, played[control]) for season in best_first)
        counted += next(filter(None, beside), [])
    return Measurements(counted, sum(map(len, played.values())) - len(counted))


def _measuring(season: Receipt, team: Entrant, played: Sequence[Receipt]) -> list[Receipt]:
    """The pairs among ``played`` that measure a team in matches like those of a season."""
    try:
        matches = Season.model_validate(season.settings).settings.of_match()
    except ValidationError:
        return []  # this version cannot read the season's settings
    usual = Evaluation(**matches, team=team, opponent=team)
    same = [receipt for receipt in played if _against(receipt, team) == usual]
    of_one_arena = ([receipt for receipt in same if receipt.versions["arena"] == version]
                    for version in (season.versions["arena"], arena.VERSION))
    return next(filter(None, of_one_arena), [])


def _against(receipt: Receipt, opponent: Entrant) -> Evaluation | None:
    """Evaluation of a pair with another opponent; None if this version cannot read its settings."""
    try:
        own = Evaluation.model_validate(receipt.settings["evaluation"])
    except ValidationError:
        return None
    return own.model_copy(update={"opponent": opponent})


class Apprentice(NamedTuple):
    """Apprentice of a season with the best settings.

    Attributes:
        season: the season.
        player: the team, and the place of its policy.
    """

    season: Season
    player: Player


def apprentices(store: Store, seasons: Sequence[Receipt]) -> list[Apprentice]:
    """Apprentices of the best settings, without those whose season's own store is gone.

    Args:
        store: store of the seasons.
        seasons: receipts of the seasons.
    """
    found = []
    for receipt in seasons:
        if receipt.settings.get("name") not in (BEST, IN_GAMES):
            continue
        try:
            player = apprentice(store, receipt.name)
        except PitchloreError:
            continue  # the report names it
        found.append(Apprentice(Season.model_validate(receipt.settings), player))
    return found


class Sources(NamedTuple):
    """Inputs of the report.

    Attributes:
        seasons: receipts of all seasons.
        measurements: measurements of their apprentices.
        apprentices: apprentices of the best settings.
    """

    seasons: list[Receipt]
    measurements: Measurements
    apprentices: list[Apprentice]

    def digests(self) -> dict[str, str]:
        """SHA-256 of all inputs of the report, by label."""
        found: dict[str, str] = {}
        for receipt in (*self.seasons, *self.measurements.counted):
            found |= receipt.digests()
        return found


def sources(store: Store) -> Sources:
    """Inputs that a store has for the report.

    Raises:
        NotFound: if no season has been played.
    """
    without = damaged(store)
    receipts = [receipt for receipt in _whole(store, "seasons", without)
                if {"games", "growth"} <= receipt.files.keys()]
    if not receipts:
        raise NotFound("no season has been played", where=store.where,
                       next_step="Play one with `pitchlore season`")
    played = _whole(store, "evaluations", without)
    return Sources(receipts, measurements(store, receipts, played), apprentices(store, receipts))


class ReportTables(NamedTuple):
    """Tables that the report is made from.

    Attributes:
        games: schema Games.
        growth: schema Growth.
        evaluations: schema Evaluations, of the pairs that count.
        left_out: number of the other pairs.
        preferences: preferred behaviours of the best apprentices.
    """

    games: pl.DataFrame
    growth: pl.DataFrame
    evaluations: pl.DataFrame
    left_out: int
    preferences: pl.DataFrame


def tables(store: Store, of: Sources) -> ReportTables:
    """Tables of the report.

    Args:
        store: store of the inputs.
        of: inputs, see :func:`sources`.

    Raises:
        CorruptFile: if a file is gone or its bytes have changed.
    """
    games = pl.concat(table_of(store, receipt, Games) for receipt in of.seasons)
    growth = pl.concat(table_of(store, receipt, Growth) for receipt in of.seasons)
    evaluations = pl.concat([Evaluations.empty(), *(
        table_of(store, receipt, Evaluations) for receipt in of.measurements.counted)])
    return ReportTables(games.sort("season", "game"), growth.sort("season", "game", "role"),
                        evaluations.sort("evaluation", "seed", "match"), of.measurements.left_out,
                        _preferences(of.apprentices))


def _preferences(of: Sequence[Apprentice]) -> pl.DataFrame:
    """Preferred behaviours: settings, opponent, season, and the columns of ``preferred``."""
    found = [NO_PREFERENCES]
    for season, player in of:
        policy = labelled(player.store, player.manifest)[1].values
        does = preferred_by_role(policy, player.team.settings.lcb_weight).with_columns(
            settings=pl.lit(season.name), opponent=pl.lit(season.opponent), season=pl.lit(season.id))
        found.append(does.select(found[0].columns))
    return pl.concat(found)


def _made(found: ReportTables) -> Made:
    """Claims, plots, and the report as Markdown and as a web page."""
    games, growth, evaluations, left_out, _ = found
    claims, drawn = season_verdicts(seasons_of(games, growth)), plots_of_seasons(games, growth)
    text = markdown(games, evaluations, left_out, claims, list(drawn), RELEASE)
    page = web_page(TITLE, text, drawn, COLOURS)
    return Made(
        tables=[(claims, Claims)],
        blobs={"page": ("html", page), "text": ("md", text.encode())}
        | {name: ("png", data) for name, data in drawn.items()},
    )


class Written(NamedTuple):
    """A written report.

    Attributes:
        receipt: receipt of its files: claims, page, text, plots.
        page: path of the web page.
        tables: tables that it is made from.
    """

    receipt: Receipt
    page: Path
    tables: ReportTables


def write_report(store: Store) -> Written:
    """Report on the present seasons, evaluations and policies, unless none of them has changed.

    Raises:
        NotFound: if no season has been played.
        CorruptFile: if a file of a policy is gone or its bytes have changed.
    """
    of = sources(store)  # looked up once, so that the key is that of what was read
    found = tables(store, of)  # before the stage: what is missing is said, and puts nothing in quarantine
    work = STAGES["report"].work(NAME, NO_SETTINGS, of.digests())
    receipt = store.holding(work)
    if receipt is None:
        with refusing(store, work.noun, work.name):
            receipt = store.commit(work, _made(found))
    path = store.root / "report" / "index.html"
    store.keep(path, explained(store.read(receipt, "page")))
    return Written(receipt, path, found)
