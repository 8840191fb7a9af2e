"""The pages of a league, written into a folder; what stands is kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.base.digests import canonical, digest
from pitchlore.pipeline.base.errors import BadSettings, NotFound, PitchloreError
from pitchlore.pipeline.base.software import RELEASE, source_hash
from pitchlore.pipeline.engine.placement.executors import executors
from pitchlore.pipeline.engine.progress import RunReport, StageReport, listener
from pitchlore.pipeline.engine.tasks import spread
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.card import cards, cards_of
from pitchlore.pipeline.views.commentary.words import side_names
from pitchlore.pipeline.views.few_goals import few_goals
from pitchlore.pipeline.views.replay import linked
from pitchlore.pipeline.views.scout.content import compare, copies, danger, replays
from pitchlore.pipeline.views.scout.content import matches as match_pages
from pitchlore.pipeline.views.scout.content import policies as policy_pages
from pitchlore.pipeline.views.scout.content import situations as situation_pages
from pitchlore.pipeline.views.scout.content.folder import Folder
from pitchlore.pipeline.views.scout.content.keeper import others
from pitchlore.pipeline.views.scout.content.league import league_facts
from pitchlore.pipeline.views.scout.content.learned import Learned
from pitchlore.pipeline.views.scout.content.pieces import MatchTodo, TeamTodo, of_matches, pages_of_team
from pitchlore.pipeline.views.scout.content.sources import (
    LeagueMatch,
    TeamName,
    chosen_matches,
    newest,
    played,
    readable,
    side_of,
    sides_played,
    team_name,
)
from pitchlore.pipeline.views.scout.content.teams import FROM, on_page
from pitchlore.pipeline.views.scout.pages import page_files, rendered
from pitchlore.schemas import Behaviours

#: Teams that menus begin with: mine, and those of the newest match.
_FIRST = 3
#: Matches of a piece of work: a process takes as long to start as to make the pages of a few.
_AT_ONCE = 4


class WrittenPages(NamedTuple):
    """Outcome of a call that writes pages.

    Attributes:
        first: the page to begin with.
        new: pages that were written.
        kept: pages that stood.
        size: bytes of the whole folder.
    """

    first: Path
    new: int
    kept: int
    size: int


def write_pages(
    store: Store, out: Path | None = None, names: Sequence[str] = (), mine: str = ""
) -> WrittenPages:
    """Write the pages of matches that have run; those that stand are kept.

    Args:
        store: the data folder.
        out: folder to write into; None: ``scout`` in the data folder, and one of its own for each choice.
        names: teams and matches (ids, or their beginnings) that the pages are of; without any all matches.
        mine: the team that the first page tells of; empty: both teams of the newest match.

    Raises:
        NotFound: if no match has run, or a name fits none.
        BadSettings: if the data folder is in a bucket, and no folder is named.
        CorruptFile: if a file of the store is damaged.
    """
    if out is None and store.mirror is not None:
        raise BadSettings("is in a bucket, and pages are files for a browser", where=store.where,
                          next_step="Name a folder with --out")
    league = list(played(store))
    if not league:
        raise NotFound("no match has run", where=store.where,
                       next_step="Import recordings and run: `pitchlore run`")
    whole, league = league, chosen_matches(league, names)
    every = len(whole)
    folder = Folder(store, out or store.root / _folder(names))
    known, teams, code = newest(store), match_pages.menu(league, mine), f"{RELEASE}+{_made_by()}"
    first = match_pages.newest_first(league, teams, mine)
    version = None if known is None else known.manifest.version
    behind, few = Learned(store, known, league), few_goals(
        store, {match.home.kind: match.inputs["values"][0] for match in league})
    around: dict[str, Any] = {"menu": teams, "made": code, "few_goals_in": few, "names_of": {
        match.name: side_names(match.home.name, match.away.name) for match in league}}
    lines = _matches(store, folder, league, around)
    policies = policy_pages.newest_policies(store, league)
    learned_of = danger.matches_learned(store, known, whole)
    copied = copies.copied_teams(store, teams, whole)
    shown, told = cards(store, mine), cards_of(store, [team.name for team in teams])
    by_team = [TeamTodo(
        team, own := [match for match in league if team in (match.home, match.away)],
        {match.name: lines[match.name] for match in own}, known, league,
        sum(len(sides_played(team, match)) for match in learned_of),
        any(policy.team == team for policy in policies), copied.get(team),
        others(team, league, lines), told.get((team.name, team.kind)), mine) for team in teams]
    keys = {it.team: digest(canonical([
        code, teams, few.get(it.team.kind), [match.key(match.sequences_digests) for match in it.matches],
        version, known and known.manifest.key, behind.key, it.imitated, it.sides,
        it.copied and it.copied.key, it.keepers, it.card, mine])) for it in by_team}
    _teams(store, folder, by_team, keys, around | {
        "made": f"{code}; knowledge {'none' if version is None else f'version {version}'}"})
    _policies(store, folder, policies, {team: (key, partial(on_page, team, known, behind))
                                        for team, key in keys.items() if known is not None}, around)
    everything = digest(canonical([code, teams, few, every, [match.key() for match in league]]))
    folder.put("index.html", digest(canonical([everything, shown, mine])), lambda: rendered(
        "league", **around, **league_facts(league, teams, lines, every), mine=mine, cards=shown,
        views=[side_of(team_name(card.team, card.kind), league) for card in shown]))
    folder.put("situations.html", everything, lambda: rendered(
        "situations", **around, **situation_pages.situation_facts(league)))
    versions = compare.versions(store)
    folder.put("words.html", digest(canonical([code, teams])), lambda: rendered("words", **around))
    folder.put("compare.html", digest(canonical([code, teams, few])), lambda: rendered("compare", **around))
    numbered = digest(canonical([everything, mine, [it.key for it in versions]]))
    folder.put("compare/numbers.js", numbered, lambda: (
        compare.numbers_script(league, first, lines, versions)))
    for manifest in versions:
        folder.put(f"compare/v{manifest.version}.js", digest(canonical([everything, manifest.key])), partial(
            compare.knowledge, store, manifest, league, lines))
    files = page_files([team.slug for team in first[:_FIRST]])
    for name, content in (files | replays.replay_files(teams, known, behind)).items():
        folder.put(name, digest(content), lambda content=content: content)  # type: ignore[misc]
    folder.close()
    size = sum(path.stat().st_size for path in folder.path.rglob("*") if path.is_file())
    return WrittenPages(folder.path / "index.html", folder.new, folder.kept, size)


@cache
def _made_by() -> str:
    """Hash of the code and the templates that make the pages."""
    return source_hash(("flows", "pipeline", "schemas"), (".py", ".html", ".css", ".js"))


def _folder(names: Sequence[str]) -> str:
    """The folder for a choice, in the data folder."""
    if not names:
        return "scout"
    return f"scout-{readable('-'.join(names))}-{digest(canonical(sorted(names)))[:6]}"


def write_after(store: Store, report: RunReport, mine: str = "") -> None:
    """Write the pages after a run that has matches. If that fails, it is one more failure of the run.

    Notes of the run say which damaged files the pages are made without.
    """
    store.leave_out = lambda error: report.notes.append(f"The scout's pages are made without {error}")
    try:
        if any(played(store)):
            write_pages(store, mine=mine)
    except PitchloreError as error:
        report.stages.append(StageReport(noun="scout", failed={"pages": str(error)}))


def _matches(
    store: Store, folder: Folder, league: Sequence[LeagueMatch], around: dict[str, Any]
) -> dict[str, dict[str, Any]]:
    """Write the pages and the data of the matches. Returns their lines in the league, by their ids."""
    lines: dict[str, dict[str, Any]] = {}
    keys: dict[str, dict[str, str]] = {}
    todo = []
    for match in league:
        replay = linked(match.name, match.home.name, match.away.name).encode()
        folder.put(f"replays/{match.name}.html", digest(replay), lambda replay=replay: replay)  # type: ignore[misc]
        key = match.key(around["made"], match.gap_s)
        keys[match.name] = own = {
            f"data/{match.name}.js": key,
            f"matches/{match.name}.html": match.key(
                around["made"], around["menu"], around["few_goals_in"].get(match.home.kind),
                match.goals_at_least)}
        line, pages = folder.known(match.name, key), folder.missing(own)
        if line is not None:
            lines[match.name] = line
        if line is None or pages:
            todo.append(MatchTodo(match, pages, line is None))
    data = executors.get().path(store.root)
    pieces = [(f"matches {begin}", {"data": data, "todo": todo[begin:begin + _AT_ONCE], "around": around})
              for begin in range(0, len(todo), _AT_ONCE)]
    listener.get().begin("match pages", len(pieces))
    for label, made in spread(executors.get(), of_matches, pieces, len(pieces)):
        listener.get().advance("match pages", label)
        for match_id, done in made.items():
            for name, content in done.pages.items():
                folder.write(name, keys[match_id][name], content)
            if done.line is not None:
                lines[match_id] = folder.remember(match_id, keys[match_id][f"data/{match_id}.js"], done.line)
    return lines


def _teams(
    store: Store, folder: Folder, teams: Sequence[TeamTodo], keys: Mapping[TeamName, str],
    around: dict[str, Any],
) -> None:
    """Write the pages of the teams."""
    data, pieces, matches = executors.get().path(store.root), [], 0
    for team in sorted(teams, key=lambda it: -len(it.matches)):  # the longest work first
        pages = folder.missing({f"{kind}/{team.team.slug}.html": keys[team.team]
                                for kind in team.kinds})
        if pages:
            pieces.append((team.team.slug, {"data": data, "team": team, "pages": pages, "around": around}))
            matches += min(len(team.matches), FROM)
    workers = executors.get() if matches > _AT_ONCE else executors.get().for_pieces(1)
    key_of = {team.slug: key for team, key in keys.items()}
    listener.get().begin("team pages", len(pieces))
    for slug, made in spread(workers, pages_of_team, pieces, len(pieces)):
        listener.get().advance("team pages", slug)
        for name, content in made.items():
            folder.write(name, key_of[slug], content)


def _policies(
    store: Store, folder: Folder, policies: list[policy_pages.Newest],
    galleries: Mapping[TeamName, tuple[str, Callable[[], pl.DataFrame]]], around: dict[str, Any],
) -> None:
    """The list of policies, and a page for each; behaviours lead to their cards in the team's gallery."""
    made_from = [around["made"], around["menu"], around["few_goals_in"]]
    known = [it.key for it in policies]
    folder.put("policies.html", digest(canonical([*made_from, known])), lambda: rendered(
        "policies", **around, rows=policy_pages.policy_lines(store, policies)))
    for policy, own in zip(policies, known, strict=True):
        key, shown = ("", Behaviours.empty) if policy.team is None else galleries.get(
            policy.team, ("", Behaviours.empty))

        def made(policy: policy_pages.Newest = policy,
                 shown: Callable[[], pl.DataFrame] = shown) -> bytes:
            cards = {name: f"../behaviours/{policy.slug}.html#{name}" for name in shown()["behaviour_id"]}
            return rendered("policy", up="../", **around, **policy_pages.policy_facts(store, policy, cards))

        folder.put(f"policies/{policy.slug}.html", digest(canonical([*made_from, own, key])), made)
