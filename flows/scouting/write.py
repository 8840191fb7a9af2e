"""The pages of a league, written into a folder; what stands is kept."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from markupsafe import Markup

from flows.progress import RunReport, StageReport
from flows.scouting import answers, compare, danger, maps, opponent, replays
from flows.scouting import matches as match_pages
from flows.scouting import policies as policy_pages
from flows.scouting import situations as situation_pages
from flows.scouting import teams as team_pages
from flows.scouting.learned import Learned
from flows.scouting.sources import Known, Match, TeamName, chosen, newest, played, readable, sides_of
from pipeline.errors import BadSettings, NotFound, PitchloreError
from pipeline.store import Store
from pipeline.store.receipts import RELEASE, canonical, digest, source_hash
from pipeline.views.commentary.words import called
from pipeline.views.replay import linked
from pipeline.views.scout.pages import files, page
from schemas import SIDES

#: What each page was made from, by its name.
_KEYS = ".pages.json"
#: Names of pages and of their data.
_PAGE = re.compile(r"(?:[a-z]+/)?[a-z0-9][a-z0-9-]*\.(?:html|js|css)")
TITLE = "The league"


class Written(NamedTuple):
    """What a call wrote.

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


class _Folder:
    """A folder of pages, each written only if what it is made from has changed."""

    def __init__(self, store: Store, path: Path) -> None:
        self._store, self.path = store, path
        self._before = self._read()
        self._now: dict[str, str] = {}
        self.facts: dict[str, Any] = {}
        self.new = self.kept = 0

    def _read(self) -> dict[str, Any]:
        try:
            found = json.loads((self.path / _KEYS).read_bytes())
        except (OSError, ValueError):
            return {}
        known = isinstance(found, dict) and isinstance(found.get("facts"), dict)
        return found if known else {}

    def put(self, name: str, key: str, make: Callable[[], bytes]) -> None:
        """Write a page unless it stands."""
        self._now[name] = key
        target = self.path / name
        if self._before.get(name) == key and target.exists():
            self.kept += 1
            return
        self._store.write_bytes(target, make())
        self.new += 1

    def remember(self, name: str, key: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Facts that several pages need, from the last time if nothing has changed."""
        before = self._before.get("facts", {}).get(name)
        stands = isinstance(before, dict) and before.get("key") == key
        kept = before["facts"] if stands and isinstance(before.get("facts"), dict) else make()
        self.facts[name] = {"key": key, "facts": kept}
        return dict(kept)

    def close(self) -> None:
        """Remove the pages of what is gone, and keep what each page was made from."""
        for name in self._before.keys() - self._now.keys() - {"facts"}:
            if _PAGE.fullmatch(name):  # nobody's list of pages may have files elsewhere removed
                (self.path / name).unlink(missing_ok=True)
        said = json.dumps(self._now | {"facts": self.facts}, separators=(",", ":"))
        self._store.write_bytes(self.path / _KEYS, said.encode())


def write(store: Store, out: Path | None = None, names: Sequence[str] = ()) -> Written:
    """Write the pages of matches that have run; those that stand are kept.

    Args:
        store: the data folder.
        out: folder to write into; None: ``scout`` in the data folder, and one of its own for each choice.
        names: teams and matches (ids, or their beginnings) that the pages are of; without any all matches.

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
    whole, league = league, chosen(league, names)
    every = len(whole)
    folder = _Folder(store, out or store.root / _folder(names))
    known, teams, code = newest(store), match_pages.menu(league), f"{RELEASE}+{_made_by()}"
    version = None if known is None else known.manifest.version
    behind = Learned(store, known, league)
    around: dict[str, Any] = {"menu": teams, "made": code, "names_of": {
        match.name: called(match.home.name, match.away.name) for match in league}}
    learned = around | {"made": f"{code}; knowledge {'none' if version is None else f'version {version}'}"}
    lines = {match.name: _match(store, match, folder, around) for match in league}
    learned_of = danger.matches_learned(store, known, whole)
    policies = policy_pages.newest_policies(store, league)
    galleries: dict[TeamName, tuple[str, Callable[[], dict[str, Any]]]] = {}
    for team in teams:
        own = [match for match in league if team in (match.home, match.away)]
        learned_from = [match.key(match.made["sequences"].digests()) for match in own]
        imitated = any(policy.team == team for policy in policies)
        sides = sum(len(sides_of(team, match)) for match in learned_of)
        key = digest(canonical([code, teams, learned_from, version, known and known.manifest.key,
                                behind.key, imitated, sides]))
        folder.put(f"teams/{team.slug}.html", key, partial(
            _page, "team", learned | {"imitated": imitated},
            partial(team_pages.facts, store, team, own, lines)))
        shown = cache(partial(_gallery, store, team, own, known, behind, sides))
        galleries[team] = key, shown
        folder.put(f"behaviours/{team.slug}.html", key, partial(_page, "behaviours", learned, shown))
        folder.put(f"maps/{team.slug}.html", key, partial(
            _page, "map", learned, partial(maps.facts, team, known, behind)))
        folder.put(f"against/{team.slug}.html", key, partial(
            _page, "opponent", learned, partial(_opponent, store, team, own, lines, shown)))
    _policies(store, folder, policies, galleries, around)
    everything = digest(canonical([code, teams, every, [match.key() for match in league]]))
    folder.put("index.html", everything, lambda: page("league", **around, title=TITLE, every=every, rows=[
        _row(match, lines[match.name]) for match in league]))
    folder.put("situations.html", everything, lambda: page(
        "situations", **around, **situation_pages.facts(store, league)))
    versions = compare.versions(store)
    folder.put("words.html", digest(canonical([code, teams])), lambda: page("words", **around))
    folder.put("compare.html", digest(canonical([code, teams])), lambda: page("compare", **around))
    folder.put("compare/numbers.js", digest(canonical([everything, [it.key for it in versions]])), lambda: (
        compare.numbers(league, teams, lines, versions)))
    for manifest in versions:
        folder.put(f"compare/v{manifest.version}.js", digest(canonical([everything, manifest.key])), partial(
            compare.knowledge, store, manifest, league, lines))
    for name, content in (files() | replays.files(teams, known, behind)).items():
        folder.put(name, digest(content), lambda content=content: content)  # type: ignore[misc]
    folder.close()
    size = sum(path.stat().st_size for path in folder.path.rglob("*") if path.is_file())
    return Written(folder.path / "index.html", folder.new, folder.kept, size)


def _made_by() -> str:
    """Hash of the code and the templates that make the pages."""
    return source_hash(("flows", "pipeline", "schemas"), (".py", ".html", ".css", ".js"))


def _folder(names: Sequence[str]) -> str:
    """The folder for a choice, in the data folder."""
    if not names:
        return "scout"
    return f"scout-{readable('-'.join(names))}-{digest(canonical(sorted(names)))[:6]}"


def write_after(store: Store, report: RunReport) -> None:
    """Write the pages after a run that has matches. If that fails, it is one more failure of the run."""
    try:
        write(store)
    except NotFound:
        pass
    except PitchloreError as error:
        report.stages.append(StageReport(noun="scout", failed={"pages": str(error)}))


def _policies(
    store: Store, folder: _Folder, policies: list[policy_pages.Newest],
    galleries: dict[TeamName, tuple[str, Callable[[], dict[str, Any]]]], around: dict[str, Any],
) -> None:
    """The list of policies, and a page for each; behaviours lead to their cards in the team's gallery."""
    made_from = [around["made"], around["menu"]]
    known = [[it.manifest.key, it.manifest.version, it.slug, it.pitch.model_dump(mode="json")]
             for it in policies]
    folder.put("policies.html", digest(canonical([*made_from, known])), lambda: page(
        "policies", **around, rows=policy_pages.summary(store, policies)))
    for policy, own in zip(policies, known, strict=True):
        gallery = None if policy.team is None else galleries.get(policy.team)
        key, shown = gallery or ("", None)

        def facts(policy: policy_pages.Newest = policy, shown: Any = shown) -> dict[str, Any]:
            cards = {} if shown is None else {
                card["id"]: f"../behaviours/{policy.slug}.html#{card['id']}" for card in shown()["cards"]}
            return policy_pages.facts(store, policy, cards)

        folder.put(f"policies/{policy.slug}.html", digest(canonical([*made_from, own, key])), partial(
            _page, "policy", around, facts))


def _match(
    store: Store, match: Match, folder: _Folder, around: dict[str, Any]
) -> dict[str, Any]:
    """The pages and the data of one match; its line in the league. No knowledge is in them."""
    tables = cache(lambda: match.tables(store))
    told = cache(lambda: match_pages.told_of(match, tables()))
    kept = cache(lambda: answers.kept(match, tables()))
    key = match.key(around["made"], replays.gap_of(match))
    folder.put(f"data/{match.name}.js", key, lambda: replays.data(match, tables(), told()))
    replay = linked(match.name, match.home.name, match.away.name).encode()
    folder.put(f"replays/{match.name}.html", digest(replay), lambda: replay)
    folder.put(f"matches/{match.name}.html", match.key(
        around["made"], around["menu"], match.goals_at_least), lambda: page(
        "match", up="../", **around, **match_pages.facts(match, tables(), told(), kept())))
    return folder.remember(match.name, key, lambda: match_pages.line(match, tables(), kept()))


def _row(match: Match, line: dict[str, Any]) -> dict[str, Any]:
    """A match as the league's page shows it."""
    numbers = line["numbers"]
    return {
        "id": match.name, "home": match.home, "away": match.away,
        "territory": Markup(line["picture"]),  # noqa: S704 (pipeline.views.scout.pictures made it)
        "possession": numbers["home"]["possession"],
        "shots": [numbers[side]["shots"] for side in SIDES],
        **{name: line[name] for name in ("score", "seconds", "kind", "date", "flaws")},
    }


def _page(name: str, around: dict[str, Any], facts: Callable[[], dict[str, Any]]) -> bytes:
    return page(name, up="../", **around, **facts())


def _gallery(
    store: Store, team: TeamName, own: list[Match], known: Known | None, behind: Learned, sides: int
) -> dict[str, Any]:
    found = None if known is None else team_pages.gallery(store, team, own, known, behind)
    none = {"team": team, "version": "none", "total": 0, "roles": [], "cards": [], "every": [],
            "phrases": []}
    return (found or none) | {"sides": sides}


def _opponent(
    store: Store, team: TeamName, own: list[Match], lines: dict[str, dict[str, Any]],
    shown: Callable[[], dict[str, Any]],
) -> dict[str, Any]:
    return opponent.facts(store, team, own, lines, shown())
