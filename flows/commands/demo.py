"""The command demo: take matches through every stage, and show the results."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from rich.console import Console
from rich.text import Text

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, UserPath
from pitchlore.flows.commands.import_ import bring_in
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.printing import console, print_cards, print_frame, print_known
from pitchlore.flows.commands.run import bring_up_to_date
from pitchlore.flows.reporting import Reported
from pitchlore.flows.reporting import report as make_report
from pitchlore.flows.server import Keeper
from pitchlore.pipeline.arena.match.controllers import PolicyTables
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.arena.teams.constant import BEST, best_constant
from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.engine.imitations import PREFIX, settings_of, work_of
from pitchlore.pipeline.engine.knowledge import imitates
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.record import record
from pitchlore.pipeline.engine.recordings import Recording, with_map
from pitchlore.pipeline.engine.season import play_seasons
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.face.versions import Knowledge
from pitchlore.pipeline.settings import OptionSettings, Settings
from pitchlore.pipeline.stages.seasons.settings import Season, named_settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.buckets import check_local
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.views.card import cards
from pitchlore.pipeline.views.scout.content.write import write_pages as scouted

SAMPLE = Path("data/samples/rsim-vss-3v3.parquet")
_MINUTES = 4.0
#: A season that is short enough to be watched: three games of a minute.
_GAMES, _GAME_S = 3, 60.0
_GOALS_SHOWN = 8
#: The strength of the copy of three such matches, docs/decisions/options.md, "The demo's copy".
_EXPECTED = ("in twenty other pairs of matches of eight minutes it was ahead of static by 3.7 goals a match "
             "(2.3 to 5.0), the team itself by 2.6 (1.0 to 4.2)")
_QUESTION = """select s.name as situation, count(*) as seen,
       round(100 * avg((exists (from goals g where g.match_id = s.match_id and g.team = s.team
                        and g.t_ns - s.start_ns between 0 and 5e9))::int), 1) as goal_within_5s_pct
from situations s where s.code in (21, 44, 47) group by all order by seen desc"""


def demo(*recordings: UserPath, flow: Flag = False, common: Common = DEFAULTS) -> None:
    """Take a recording and three played matches through every stage, and show the results.

    Outputs that exist are not made again, so a second demo takes seconds.

    Args:
        recordings: Recordings to import (default the sample of a checkout).
        flow: Run the stages as Prefect flows, under a server of the data folder that ends with the demo.
        common: Options of every command.
    """
    store, out = common.store, console()
    with Keeper(store.root).running() if flow else nullcontext():
        played, season = _work(store, recordings)
        page = perform(store, "report_flow", Reported, make_report)(store.root).page
    catalogue, _ = refresh(store)
    _scores(catalogue, played, out)
    _goals(store, played[0], out)
    _card(store, out)
    _question(catalogue, out)
    _paths(store, played, season, page, common, out, flow=flow)


def _work(store: Store, recordings: Sequence[Path]) -> tuple[list[str], Season]:
    """Import, play, run the stages, learn. Returns the matches that were played, and the season."""
    for file in recordings:
        check_local(file)  # a URL may hold a password, which the log of runs would keep
    imported = bring_in(store, [with_map(file) for file in recordings or (SAMPLE,)])
    for why in imported.failed.values():
        raise PitchloreError(why.rstrip("."), next_step="Name a recording: pitchlore demo FILE")
    played = [_play(store, BEST, seed) for seed in (1, 2, 3)]
    team = best_constant().word
    _imitate(store, team)
    played.append(_play(store, f"{PREFIX}{team}", 1))
    _learn(store, Settings())
    return played, _season(store)


def _imitate(store: Store, team: str) -> None:
    """Rebuild a team from the poses of its matches."""
    work = work_of(store, team)
    motion_alone = Settings(options=OptionSettings(logged=False))
    _learn(work.store, settings_of(motion_alone, team), work.recordings)


def _learn(store: Store, settings: Settings, recordings: list[Recording] | None = None) -> None:
    """Run all stages.

    Raises:
        PitchloreError: if one of them fails.
    """
    for what, why in bring_up_to_date(store, settings, recordings=recordings).failures.items():
        raise PitchloreError(why.rstrip("."), where=what)


def _play(store: Store, home: str, seed: int) -> str:
    """Play a match against the static team, unless it exists. Returns its id."""
    policies: dict[str, PolicyTables] = {}
    recipe = Recipe(
        home=entrant(store, home, policies).settings, away=TeamSettings(kind="static"), seed=seed,
        referee=RefereeSettings(duration_s=60 * _MINUTES),
    )
    return record(store, recipe, policies)[0].name


def _season(store: Store) -> Season:
    """Play the remaining games of a short season."""
    usual = named_settings("best-in-games")
    settings = usual.model_copy(update={
        "games": _GAMES, "referee": usual.referee.model_copy(update={"duration_s": _GAME_S})})
    season = Season(name="best-in-games", opponent="static", seed=1, settings=settings)
    report = perform(store, "season_flow", StageReport, play_seasons)(store.root, [season])
    for what, why in report.failed.items():
        raise PitchloreError(why.rstrip("."), where=what)
    return season


def _scores(catalogue: Path, played: list[str], out: Console) -> None:
    rows = ask(catalogue, """
        select match_id as match, home, away, score_home || ' : ' || score_away as score,
               round(duration_s / 60, 1) as minutes
        from matches order by list_position(?, match_id) nulls first, match_id""", [played])
    out.print()
    print_frame(rows, title="The matches")
    out.print(f"The team learned is {BEST}, rebuilt from the poses of its three matches: {_EXPECTED}.",
              highlight=False, soft_wrap=True)


def _goals(store: Store, match: str, out: Console) -> None:
    goals = [moment for moment in League(store).match(match).commentary().moments if moment.kind == "goal"]
    out.print()
    out.print(f"How the goals of {match} came about", style="bold", highlight=False)
    for moment in goals[:_GOALS_SHOWN]:
        out.print(moment.line(), highlight=False, soft_wrap=True)
    if len(goals) > _GOALS_SHOWN:
        out.print(f"... and {len(goals) - _GOALS_SHOWN} more", highlight=False)


def _card(store: Store, out: Console) -> None:
    newest = store.latest("knowledge")
    assert newest is not None
    learner = imitates(newest)
    assert learner is not None
    out.print()
    print_cards(cards(store, learner.team))
    print_known(Knowledge(store, newest))


def _question(catalogue: Path, out: Console) -> None:
    out.print()
    out.print("How often does a goal follow within five seconds?", style="bold", highlight=False)
    out.print(Text(_QUESTION))
    print_frame(ask(catalogue, _QUESTION))


def _paths(
    store: Store, played: list[str], season: Season, page: Path, common: Common, out: Console, *, flow: bool
) -> None:
    replay, scout = League(store).match(played[-1]).replay(), scouted(store).first
    where = "" if common.data == DEFAULTS.data else f" --data {store.where}"
    lines = [
        ("Open", ""),
        (str(replay), "the match of the team that was rebuilt from three others, to watch"),
        (str(scout), "the scout: the league, its teams, and their behaviours in clips"),
        (str(page), f"the report on {season.id}, an apprentice's first {_GAMES} games"),
        ("Next", ""),
        (f"pitchlore import YOUR-MATCH.csv{where}", "your own recording; then pitchlore run"),
        (f"pitchlore sql --tables{where}", "every table, column and unit that you can ask"),
        (f"pitchlore play --against static{where}", "drive a robot yourself"),
        (f"pitchlore season --settings looking-held{where}",
         "an apprentice that looks learns from 140 matches: three minutes on 2 cores"),
    ]
    if flow:
        lines.append((f"pitchlore server start{where}", "Prefect's pages, with these runs"))
    out.print()
    for what, why in lines:
        if why:
            out.print(f"  {what}", highlight=False, soft_wrap=True)
            out.print(f"      {why}", highlight=False, soft_wrap=True)
        else:
            out.print(what, style="bold", highlight=False)
