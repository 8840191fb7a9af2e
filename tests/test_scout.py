"""The scout's pages: what they say, that they stand, and that they work in a browser."""

import json
import re
import shlex
import shutil
from html import unescape
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from conftest import clip
from support.handmade import derived, handmade
from support.league import HOSTILE, bring, gallery
from support.recordings import RSIM, imported
from test_unreadable import DAMAGED

from pitchlore.pipeline.engine.catalog import forget_match, refresh
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.views.scout.content.folder import Folder
from pitchlore.pipeline.views.scout.content.keeper import Faced, sums, verdict
from pitchlore.pipeline.views.scout.content.matches import _swing, menu, newest_first
from pitchlore.pipeline.views.scout.content.sources import played, team_name
from pitchlore.pipeline.views.scout.content.teams import better
from pitchlore.pipeline.views.scout.content.write import WrittenPages, write_pages
from pitchlore.pipeline.views.scout.facts import LEAST_MATCHES, Numbers, by_lead, over_matches, trend
from pitchlore.pipeline.views.scout.gallery import clips
from pitchlore.pipeline.views.scout.pictures import Mark, heat, on_pitch
from pitchlore.pipeline.views.scout.restarts import Share
from pitchlore.pipeline.views.scout.scored import GoalGroup
from pitchlore.pipeline.views.scout.swings import (
    Swing,
    deciding,
    drawn_lines,
    lead_words,
    on_top_words,
    stretches,
    swings,
)
from pitchlore.pipeline.views.scout.timeline import GoalLine, on_top
from pitchlore.schemas import Passes, Possession, Shots, Trajectories, Values
from pitchlore.schemas.behaviours import for_people

VSSS = PITCHES[Kind.VSSS]


def text_of(pages: WrittenPages, name: str) -> str:
    return (pages.first.parent / name).read_text()


# ---- what is computed


def test_heat():
    """A heat map has shares of the samples, left to right and bottom to top."""
    cells = heat(np.array([-0.74, 0.74, 0.74]), np.array([-0.64, 0.64, 0.64]), VSSS)
    assert cells.sum() == pytest.approx(1)
    assert (cells[0, 0], cells[-1, -1]) == (pytest.approx(1 / 3), pytest.approx(2 / 3))


def test_cells_are_drawn():
    """Cells of a heat map with samples are drawn, the fuller the stronger, with marks over them; alike ones as one."""
    cells = np.zeros((16, 24))
    cells[0, 0], cells[15, 21:24] = 0.1, 0.3
    drawn = on_pitch(VSSS, "here", cells=cells, marks=[Mark(0, 0, "mark", "there")])
    assert 'class="heat" transform="matrix(0.0625 0 0 -0.08125 -0.75 0.6094)"' in drawn  # y points down in SVG; lines run along the cells
    found = re.findall(r'opacity="(.*?)" d="(.*?)"', drawn)
    assert [place for _, place in found] == ["M0 0h1", "M21 15h3"]
    assert float(found[0][0]) < float(found[1][0]) == 1.0
    assert drawn.count('class="goal"') == 2
    assert drawn.endswith('<g class="mark"><g><title>there</title><circle cx="0" cy="0" r=".017"/></g></g></svg>')


def test_marks_are_text():
    """The words and the link of a mark are text, whatever they hold."""
    drawn = on_pitch(VSSS, HOSTILE, marks=[Mark(0, 0, "mark", HOSTILE, link=f"x#{HOSTILE}")])
    assert "<script" not in drawn


def occurrences(changes):
    rows = [("striker-044", f"m-{n % 3}", "home", 1, n * 10**9, n * 10**9 + 5 * 10**8, change)
            for n, change in enumerate(changes)]
    names = ["behaviour_id", "match_id", "team", "robot", "t_ns", "done_ns", "change"]
    return pl.DataFrame(rows, orient="row", schema=names)


def test_clips():
    """The best, the typical and the worst occurrences, each once, at most twelve."""
    changes = np.random.default_rng(0).permutation(np.arange(31) / 10)
    found = clips(occurrences(changes))["striker-044"]
    values = [float(re.search(r"[-+][\d.]+", each.says)[0]) for each in found]
    assert [each.says.split(",")[0] for each in found] == ["best"] * 4 + ["typical"] * 4 + ["worst"] * 4
    assert values[:4] == [3.0, 2.9, 2.8, 2.7]
    assert sorted(values[8:]) == [0.0, 0.1, 0.2, 0.3]
    assert all(1.2 <= value <= 1.8 for value in values[4:8])


@pytest.mark.parametrize("count", range(1, 14))
def test_few_clips(count):
    """Where there are few occurrences, each is shown once."""
    found = clips(occurrences(range(count)))["striker-044"]
    assert len({(each.match, each.start_s) for each in found}) == len(found) == min(count, 12)


def test_order():
    """Better chances come first, then worse; of each those with or against the ball, and the greatest effect in all."""
    table = pl.DataFrame({"behaviour_id": list("abcdef"), "value": [0.9, 0.4, 0.9, -0.1, -0.9, -0.2], "support": [5, 50, 500, 9, 9, 9],
                          "codes": [[21], [184, 46], [184], [44], [184], [88]]})
    assert for_people(table)["behaviour_id"].to_list() == ["b", "a", "c", "f", "d", "e"]


def test_intervals_of_few_matches():
    """Below four matches there is no interval; one from 0 to twice the mean is marked; a share ends at 1."""
    one = Numbers(0.5, 0.5, 30, 0, 2, 0, 1, 4, 5, 6)
    found = over_matches([(one, 1.0)])
    assert (found["passes"].mean, found["passes"].low) == (300.0, None)
    other = (one._replace(passes=31, shots=0, possession=None), 1.0)
    three, four = over_matches([(one, 1.0), other, other]), over_matches([(one, 1.0), (one, 1.0), other, other])
    assert LEAST_MATCHES == 4
    assert (three["passes"].low, three["passes"].n) == (None, 3), "three and three can be dealt out in 20 ways only"
    assert four["passes"].low < 305.0 < four["passes"].high
    assert four["shots"][:5] == (10.0, 0.0, pytest.approx(28.4, abs=0.1), 4, True), "from 0 to 28 says nothing"
    assert not four["passes"].varies
    assert (four["wide"][:4], four["possession"][:4]) == ((0.0, 0.0, 0.0, 4), (0.5, None, None, 2)), "two that are alike tell of no spread"
    far = over_matches([(one._replace(possession=share), 1.0) for share in (0.99, 0.99, 0.9, 0.1)])
    assert (far["possession"].low, far["possession"].high) == (pytest.approx(0.057, abs=0.001), 1)


def test_trend():
    """Halves are compared from eight matches on; what differs beyond chance is marked, what is level is not."""
    assert trend([1.0, 2.0, None]) == ([1.0, 2.0, None], None, None, False)
    assert trend([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])[1:] == (2.5, 6.5, True)
    assert trend([1.0, 8.0, 2.0, 7.0, 3.0, 6.0, 4.0, 5.0])[1:] == (4.5, 4.5, False)
    assert not trend([0.0] * 8).beyond


def test_by_lead():
    """Time, possession, shots and losses belong to the score at their beginning, for each side."""
    reported = handmade(**derived(imported(RSIM)))
    both = by_lead(reported)
    assert sum(it.seconds for it in both["home"].values()) == pytest.approx(reported.matches["duration_s"][0], abs=0.01)
    for name, other in (("leads", "trails"), ("level", "level"), ("trails", "leads")):
        assert both["home"][name].seconds == both["away"][other].seconds
        assert both["home"][name].owned_s == pytest.approx(
            both["home"][name].held_s + both["away"][other].held_s)
    on_target = reported.shots.filter(pl.col("outcome") != "wide")
    assert sum(it.shots for side in both.values() for it in side.values()) == on_target.height
    first = reported.goals["t_ns"][0]
    assert both["home"]["level"].seconds >= first / 1e9
    assert both["home"]["leads"].seconds > 500
    assert both["away"]["leads"].seconds == 0, "21 : 4, home led all along"


def test_teams_are_told_apart():
    """Teams of one name in two leagues, or of names that look alike in an address, have their own files."""
    names = [team_name(*each).slug for each in (("Blue", "vsss"), ("Blue", "ssl"), ("blue", "vsss"), ("", "2d"), ("東", "2d"))]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z0-9-]+", name) for name in names)


# ---- the pages


def test_links_lead_somewhere(pages):
    """Each address on each page is a file that is there; between maps, galleries, graphs and policies, a place that is there."""
    texts = {path: path.read_text() for path in pages.first.parent.rglob("*.html") if path.parent.name != "replays"}
    ids = {path: set(re.findall(r'\bid="([^"]+)"', text)) for path, text in texts.items()
           if path.parent.name in ("maps", "behaviours", "policies") or path.stem == "policies"}
    places = 0
    for page, text in texts.items():
        for link in re.findall(r'(?:href|src)="([^"]*)"', text):
            name, _, place = link.partition("#")
            target = (page.parent / name).resolve() if name else page
            assert target.exists(), f"{page}: {link}"
            if place and page in ids and target in ids:
                assert unescape(place) in ids[target], f"{page}: {link}"
                places += 1
    assert places > 50


def test_nothing_but_text(pages):
    """No page shows an object of Python's in place of a text; a team's name is text on every page."""
    for found in pages.first.parent.rglob("*.html"):
        text = found.read_text()
        assert not re.search(r"object at 0x|\bnan\b|>None<", text), found
        assert HOSTILE not in text
    assert "&lt;script&gt;" in pages.first.read_text()


def test_numbers_are_those_of_the_tables(store, pages):
    """A match's page says what the public tables say."""
    match = next(iter(store.receipts("matches"))).name
    events = store.receipt("events", match)
    shown = text_of(pages, f"matches/{match}.html")
    for label, schema in (("shots on target", Shots), ("passes that arrive", Passes)):
        rows = store.read_table(events, schema.NAME, schema)
        if schema is Shots:
            rows = rows.filter(pl.col("outcome") != "wide")
        counts = rows["team"].cast(pl.String).to_list()
        row = re.search(rf'<th scope="row">{label}<td>(.*?)(?:<tr>|</tbody>)', shown, re.DOTALL)[1]
        assert row.split("<td>")[:2] == [str(counts.count(side)) for side in ("home", "away")]


def test_first_page(store, pages):
    """Each team's row counts its matches as their scores do, and the page says how one of them becomes the first."""
    shown = text_of(pages, "index.html")
    won = [[int(cell) for cell in re.findall(r'<td class="n[ a-z]*">(\d+)</td>', row)] for row in re.findall(
        r"<tr><td><a href=\"teams/.*?</tr>", shown, re.DOTALL)]
    assert len(won) > 1
    assert all(row[0] == sum(row[1:]) for row in won)
    assert sum(row[1] for row in won) == sum(row[3] for row in won), "each match has a winner and a loser, or neither"
    newest = [*played(store)][-1]
    once, (rows,) = re.search(r"Flaws of all these recordings: (.*?)\.</p>", shown)[1].split("; "), re.findall(
        r'<table id="matches".*?</table>', shown, re.DOTALL)
    assert not any(flaw in rows for flaw in once), "what is so in all matches is said once"
    assert ("<th>Home</th>" in rows) == ("nothing tells which team is home" not in once)
    said = [unescape(name) for name in re.findall(r"scout --mine (.*?)</code>", shown)]
    assert said == [shlex.quote(team.name) for team in (newest.home, newest.away)]
    assert [team.name for team in newest_first([*played(store)], menu([*played(store)]), "yellow")][:2] == ["yellow", newest.home.name]


def moments_of(*played):
    """Rows of schema Values: (segment, times in s, values)."""
    return pl.DataFrame([{"match_id": "m", "segment": segment, "t_ns": round(t * 1e9), "value": v}
                         for segment, times, values in played for t, v in zip(times, values, strict=True)], schema=Values.dtypes())


def test_swings():
    """V is a line a stretch of play, cut by restarts and holes; its largest changes are between points of it; a goal leads to its clip."""
    found = stretches(moments_of((0, (0, 1, 2, 10, 11), (0.0, 0.5, -0.1, 0.2, 0.2)), (1, (11.2, 12, 20), (-0.3, 0.0, 0.1))))
    assert [list(it.t_ns / 1e9) for it in found] == [[0, 1, 2], [10, 11], [11.2, 12], [20]]
    one, two = swings(found)
    assert (one.start_ns, one.end_ns, one.side, one.before, one.after) == (10**9, 2 * 10**9, "away", 0.5, pytest.approx(-0.1))
    assert (two.side, two.before, two.after) == ("home", -0.3, 0.0)
    (dense,) = drawn_lines(stretches(moments_of((0, np.arange(0, 20, 0.01), [0.1] * 1003 + [-0.9] + [0.1] * 996))), 480.0)
    assert len(dense.v) < 60
    assert [(it.side, it.before, it.after) for it in swings([dense])] == [("away", 0.1, -0.9)], "a peak is drawn as it is"
    drawn = str(on_top(found, [GoalLine(0.5, "away", "goal <x>", "m.html#goal-1")], "top", 20.0, 0.25, [one, two]))
    assert re.findall(r'class="swung (.*?)" d="M(.*?) .*?M(.*?) ', drawn) == [("away", "5", "10"), ("home", "56", "60")]
    line = re.search(r'class="swing" d="(.*?)"', drawn)[1]
    assert line.count("M") == 4, "no line leads over a restart or a hole"
    assert re.search(r'<a href="m.html#goal-1" aria-label="goal &lt;x&gt;">.*?class="goal-at away" d="M50 20V40"', drawn)
    assert re.findall(r"<span>([−+.\d]+)</span>", drawn) == ["+0.6", "+0.3", "0", "−0.3", "−0.6"]
    close = [two._replace(end_ns=two.end_ns + step * 10**8) for step in range(5)]
    numbers = [(float(x), float(y)) for x, y in re.findall(r'class="nth" style="left:(.*?)%;top:(.*?)px"', str(on_top(found, [], "top", 20.0, None, close)))]
    assert len(numbers) == 5
    assert all(abs(a - b) >= 16 for at, (_, a) in enumerate(numbers) for _, b in numbers[:at]), "numbers of close swings stand above each other"
    assert "half-time" in drawn
    assert on_top_words(found, {"home": "A", "away": "B"}) == "A had the better chance for 50 % of the time in play."
    goals = pl.DataFrame({"t_ns": [t * 10**9 for t in (5, 61, 62)], "team": ["home", "away", "away"]})
    assert lead_words(goals, {"home": "A", "away": "B"}) == "A led from 0:05 to 1:01 and B led from 1:02 to the end."
    assert lead_words(goals.clear(), {}) == on_top_words([], {}) == ""
    assert (deciding(goals), deciding(goals.head(2)), deciding(goals.clear())) == ((3, 62.0, "away"), None, None)


def test_a_missed_chance_is_no_swing_of_others():
    """V that falls after a shot which was no goal ends the shooter's chance; a goal and a rise are of the team they help."""
    match = SimpleNamespace(possession=Possession.empty(), trajectories=Trajectories.empty())
    names = {"home": "A", "away": "B"}
    falls, rises = Swing(10**9, 3 * 10**9, "away", 0.7, 0.0), Swing(10**9, 3 * 10**9, "home", 0.0, 0.7)

    def told(swing, kind, actor):
        said = [{"kind": kind, "actor": actor, "seconds": 2.0, "says": "It shoots."}]
        found = _swing(swing, match, said, names)
        return found["way"], found["side"]

    for kind in ("save", "shot"):
        assert told(falls, kind, "home") == ("A: a chance ends", "home")
        assert told(rises, kind, "home") == ("to A", "home")
        assert told(falls, kind, "away") == ("to B", "away")
    assert told(falls, "goal", "away") == told(falls, "restart", "home") == ("to B", "away")


@pytest.mark.slow
def test_matches_come_and_go(store, tmp_path):
    """A match of teams that are known leaves the pages of the other matches, whatever was learned from it; one that is forgotten takes its own along."""
    own = Store(shutil.copytree(store.root, tmp_path / "data"))
    pages = own.root / "scout"
    before = {path: path.stat().st_mtime_ns for folder in ("matches", "data", "replays") for path in (pages / folder).iterdir()}
    clip(290.0, 350.0).write_parquet(tmp_path / "three.parquet")
    take_in(own, Recording(file=tmp_path / "three.parquet"))
    bring(own)
    write_pages(own)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert len(list((pages / "matches").iterdir())) == 3
    assert "knowledge version 2" in next((pages / "behaviours").iterdir()).read_text()
    match = next(iter(own.receipts("matches"))).name
    forget_match(own, match)
    write_pages(own)
    assert not list(pages.rglob(f"{match}*"))


@pytest.mark.parametrize("said", ["{", "[]", "3", '{"facts": 3, "index.html": "k"}', '{"facts": {"index.html": 3}}'])
def test_list_of_pages_is_broken(store, tmp_path, said):
    """Where the list of pages cannot be read, all are written again."""
    (tmp_path / "index.html").touch()
    (tmp_path / ".pages.json").write_text(said)
    folder = Folder(store, tmp_path)
    assert folder.missing({"index.html": "k"}) == ["index.html"]
    assert folder.known("index.html", "k") is None


def test_damaged_pages(store, tmp_path):
    """A page whose bytes are no more those that were written does not stand."""
    names = ["whole.html", *(f"{kind}.html" for kind in DAMAGED)]
    folder = Folder(store, tmp_path)
    for name in names:
        folder.write(name, "k", b"page of " + name.encode())
    folder.close()
    for kind, damage in DAMAGED.items():
        damage(tmp_path / f"{kind}.html")
    folder = Folder(store, tmp_path)
    assert folder.missing(dict.fromkeys(names, "k")) == names[1:]
    assert folder.kept == 1


def test_list_of_pages_is_hostile(store, tmp_path):
    """A list of pages that comes from elsewhere has nothing removed but pages."""
    (tmp_path / "pages" / "matches").mkdir(parents=True)
    mine, gone = tmp_path / "mine.html", tmp_path / "pages" / "matches" / "gone.html"
    for path in (mine, gone):
        path.touch()
    (tmp_path / "pages" / ".pages.json").write_text(json.dumps({
        "facts": {}, "../mine.html": "x", str(mine): "x", "matches/../../mine.html": "x", "matches/gone.html": "x"}))
    Folder(store, tmp_path / "pages").close()
    assert mine.exists()
    assert not gone.exists()


@pytest.mark.slow
def test_command(store, tmp_path, call):
    """The command writes where it is told to, and says what it wrote; without a match there is one line."""
    (tmp_path / "inbox").mkdir()
    assert "no match has run" in call("scout", "--data", tmp_path)[2]
    code, out, _ = call("scout", "--data", store.root, "--out", tmp_path / "pages")
    assert code == 0
    assert re.search(r"pages/index\.html: \d+ pages written, 0 kept", out.replace("\n", ""))


@pytest.mark.slow
def test_after_a_run(tmp_path, call):
    """Where the settings say so, a run brings the pages up to date; a page that cannot be written is one failure."""
    data, settings = tmp_path / "data", tmp_path / "settings.toml"
    (data / "inbox").mkdir(parents=True)
    clip(0.0, 20.0).write_csv(data / "inbox" / "derby.csv")
    settings.write_text("[scout]\nrefresh = true\n")
    words = ["run", "--data", data, "--settings", settings]
    for _ in range(2):
        assert call(*words)[0] == 0
        assert len(list((data / "scout" / "matches").iterdir())) == 1
        shutil.rmtree(data / "scout")
    (data / "scout").touch()
    code, out, err = call(*words)
    assert code == 1
    assert "scout pages" in " ".join((out + err).split())


def test_analysis_is_that_of_sql(store, pages):
    """Passing, running, pressing and space on a team's page are what the tables give in SQL, over both its matches."""
    asked = ask(refresh(store)[0], """
        with own as (select match_id, side as team from sides where team = 'blue')
        select (select count(*) from pass_attempts semi join own using (match_id, team)),
               (select round(100 * avg((came = 'arrives')::int)) from pass_attempts semi join own using (match_id, team)),
               (select round(60 * sum(distance) / sum(seconds), 1) from efforts semi join own using (match_id, team)),
               (select round(sum(distance) / count(distinct match_id)) from efforts semi join own using (match_id, team)),
               (select round(sum(distance) / (select sum(duration_s) / 60 from matches semi join own using (match_id)), 1) from efforts semi join own using (match_id, team)),
               (select round(sum(passes) / sum(actions), 2) from pressing semi join own using (match_id, team)),
               (select round(100 * avg(share)) from space semi join own using (match_id, team))""").row(0)
    page = text_of(pages, f"teams/{team_name('blue', 'vsss').slug}.html")
    shown = dict(re.findall(r'<th scope="row">([^<]*)</th><td>([\d.]+)', page))
    labels = ("passes tried", "of these arrive", "distance of a robot, m a minute",
              "distance of all, m a match", "distance of all, m a minute",
              "passes allowed for each ball won or duel (PPDA)", "pitch that it reaches first")
    assert [float(shown[label]) for label in labels] == pytest.approx(asked, abs=0.011)  # SQL rounds a half up
    assert "Who passes to whom" in page


def test_clips_against_the_reader(store, pages, tmp_path):
    """A report shows clips of matches against the team that reads first; without one, of all matches."""
    one = next(match for match in played(store) if "yellow" in (match.home.name, match.away.name))
    name = f"against/{team_name('blue', 'vsss').slug}.html"
    write_pages(store, tmp_path / "out", mine="yellow")
    found = [set(re.findall(r'data-match="(.*?)"', (root / name).read_text().partition("Where it loses")[2].partition("Under pressure")[0]))
             for root in (pages.first.parent, tmp_path / "out")]
    assert len(found[0]) == 2
    assert found[1] == {one.name}


def test_striker_is_that_of_sql(store, pages):
    """The report says which robot is its striker, and what was done by the striker of the moment, as SQL counts it."""
    asked = ask(refresh(store)[0], """
        with own as (select match_id, side as team from sides where team = 'blue'),
             seen as (select * from trajectories semi join own using (match_id, team)),
             first as (select robot, round(100 * avg((role = 'striker')::int)) as share from seen
                       where role is not null and segment is not null group by all order by avg((role = 'striker')::int) desc, robot limit 1),
             did as (select match_id, team, robot, t_ns, 'goal' as what from goals where kind is null or kind <> 'error' union all
                     select match_id, team, robot, t_ns, 'pass' from passes union all
                     select match_id, team, last_robot, end_ns, 'lost' from possession where ended = 'lost'),
             by_striker as (select what, count(*) as n from (select * from did semi join own using (match_id, team)) d
                            asof join seen s on d.match_id = s.match_id and d.team = s.team and d.robot = s.robot and d.t_ns >= s.t_ns
                            where s.role = 'striker' group by all)
        select robot, share, (select n from by_striker where what = 'goal'),
               (select count(*) from shots semi join own using (match_id, team) where role = 'striker'),
               (select n from by_striker where what = 'pass'), (select n from by_striker where what = 'lost')
        from first""").row(0)
    page = text_of(pages, f"against/{team_name('blue', 'vsss').slug}.html").partition("Its striker")[2]
    said = re.search(r"Robot (\d+) plays striker for (\d+).*?at the time made (\d+) goals?, shot (\d+) times?.*?made (\d+) passes .*?lost the ball (\d+) time", page)
    assert said is not None
    assert tuple(map(int, said.groups())) == asked
    assert 'aria-label="shots of its striker' in page


def test_keeper_is_that_of_sql(store, pages):
    """A team's page and the report on it have one number of saves, that of SQL, beside the league's other keepers."""
    own, reached, saved, others, kept = ask(refresh(store)[0], """
        with faced as (select f.team = 'blue' as own, outcome from shots s join sides f on f.match_id = s.match_id and f.side <> s.team
                       where f.kind = 'vsss')
        select count(*) filter (own and outcome <> 'wide'), count(*) filter (own and outcome in ('saved', 'goal')),
               count(*) filter (own and outcome = 'saved'), count(*) filter (not own and outcome in ('saved', 'goal')),
               count(*) filter (not own and outcome = 'saved') from faced""").row(0)
    slug = team_name("blue", "vsss").slug
    shown = text_of(pages, f"teams/{slug}.html").partition('id="keeper"')[2]
    rows = re.findall(r'<th scope="row">[^<]*</th><td>(\d+)<td>(\d*)', shown)[:3]
    assert rows == [(str(own), ""), (str(reached), str(saved)), (str(others), str(kept))]
    said = re.search(r"Of (\d+) shots? on target.*?Of (\d+) that reached it, it saved (\d+)", text_of(pages, f"against/{slug}.html"))
    assert tuple(map(int, said.groups())) == (own, reached, saved)


def test_goals_against_add_up():
    """Shots on target at a goal, and goals against its team, each in numbers that add up to all of them."""
    def kinds(*rows):
        return [GoalGroup(says, n, shots, None, []) for says, n, shots in rows]

    assert sums(Faced(67, 8, 2, 0, 31, 26), kinds(("direct", 20, 18), ("indirect", 11, 8), ("error", 3, 0))) == (
        "Of 67 shots on target at its goal it saved 31, other robots of its team blocked 8, the attackers kept 2 and 26 went in. Of 34 goals against its team "
        "26 came from a shot that was seen, and 8 did not: 3 by errors of its own team and 5 pushed over the line, or by a shot that was not seen.")
    assert sums(Faced(3, 0, 0, 1, 1, 1), kinds(("error", 1, 1))) == (
        "Of 3 shots on target at its goal it saved 1, 1 reached nobody and 1 went in. No other goal against its team is known.")
    assert sums(Faced(2, 0, 0, 0, 0, 2), kinds(("direct", 1, 1))).endswith("2 went in. 1 of those that went in are counted for no team. No other goal against its team is known.")


def test_keepers_differ():
    """Newcombe's interval of two shares' difference: his example (a) is told from chance, (d) is not."""
    assert verdict(Share(56, 70, 0, 1), Share(48, 80, 0, 1)) == "It saves more than the others: +20 percentage points [+5, +33]."
    assert verdict(Share(48, 80, 0, 1), Share(56, 70, 0, 1)).startswith("It saves less")
    assert verdict(Share(5, 56, 0, 1), Share(0, 29, 0, 1)) == "The difference, +9 percentage points [−4, +19], is not larger than chance gives."
    assert verdict(None, Share(5, 10, 0, 1)).startswith("Too few")


def test_is_it_better():
    """The newer half beside the older one begins with a sentence: what changed, and other adversaries."""
    bears, wolves = team_name("Bears", "vsss"), team_name("Wolves", "vsss")
    rows = [{"against": each} for each in (bears, wolves) * 2 + (bears, bears, wolves, wolves)]
    level, moved = {"label": "goals", "beyond": False}, {"label": "passes", "beyond": True}
    assert better(rows, {"a": level}) == ["No difference between the two halves is larger than chance gives (the older 4 matches against the newer 4).", "Both halves have the same adversaries, in the same shares."]
    said = better([*rows[:6], rows[0], rows[0]], {"a": level, "b": moved})
    assert said[0].startswith("Changed by more than chance gives: passes (")
    assert said[1] == "The adversaries differ, too: the older half has Bears twice and Wolves twice; the newer half has Bears 4 times and no Wolves."
    assert "cannot be told" in better(rows[:7], {})[0]
    assert better([*rows, *rows[:2], rows[0]][:9], {"a": level})[1].startswith("The shares of the adversaries differ, too: the older half has Bears twice and Wolves twice; ")
    assert better([rows[0]] * 9, {"a": level})[1] == "Both halves have the same adversaries.", "four matches against five are no other adversary"


def test_matches_without_analysis(store, tmp_path):
    """A match that ran before analysis was a stage has its pages, without that section."""
    shutil.copytree(store.root, tmp_path / "data")
    old = Store(tmp_path / "data")
    for path in (old.root / "analysis").iterdir():
        path.unlink()
    write_pages(old, tmp_path / "pages")
    assert "PPDA" not in "".join(path.read_text() for path in (tmp_path / "pages").glob("*/*.html"))


# ---- in a browser


def test_every_page_opens(pages, page):
    """Each page opens from disk without an error, and no name becomes markup."""
    for found in sorted(pages.first.parent.rglob("*.html")):
        page.goto(found.as_uri())
        assert page.title() != "taken"
        page.wait_for_timeout(50)


def test_clips_play(pages, page):
    """A clip that is seen plays, and stops when it is clicked; those that are not seen load when the page has rested."""
    page.goto(gallery(pages).as_uri())
    canvas = page.locator(".clip[data-ready] canvas").first
    canvas.wait_for(timeout=20_000)
    pixels = "canvas => canvas.toDataURL()"
    before = canvas.evaluate(pixels)
    page.wait_for_timeout(600)
    assert canvas.evaluate(pixels) != before
    canvas.click()
    page.wait_for_timeout(100)
    before = canvas.evaluate(pixels)
    page.wait_for_timeout(400)
    assert canvas.evaluate(pixels) == before
    sides = page.locator(".clip").evaluate_all("them => them.map((it) => [it.dataset.team, 'turned' in it.dataset])")
    assert sides
    assert all(turned == (team == "away") for team, turned in sides), "the page's own team is always drawn as home"
    assert page.evaluate("""(() => {
        const now = turned({ teams: { home: "A", away: "B" }, robots: [{ team: "home", id: 1 }], pose: () => ({ x: 1, y: -2, heading: 0 }),
                             goalAt: () => ({ goal: [5, "away", 3, "direct"], stopped: true }) }), at = now.pose();
        return [now.teams.home, now.robots[0].team, at.x, at.y, Math.cos(at.heading), now.goalAt(9).goal[1], now.worn ?? null];
    })()""") == ["B", "away", -1, 2, -1, "home", None]
    page.wait_for_function("!document.querySelector('.clip:not([data-ready])')")


def test_goals_fold_and_print(pages, page):
    """Six goals are shown, a link shows its own, and on paper there are all, in light colours, each with a still."""
    found = next(it for it in (pages.first.parent / "matches").glob("*.html") if "goal-1" in it.read_text())
    page.emulate_media(color_scheme="dark")
    page.route(found.as_uri(), lambda route: route.fulfill(content_type="text/html", body=re.sub(
        r'<ol class="goals">\s*(<li id="goal-)(\d+)(">.*?</figure>)', lambda it: '<ol class="goals" data-few="6">' + "".join(
            f"{it[1]}{place}{it[3]}" for place in range(101, 110)), found.read_text(), count=1, flags=re.DOTALL)))
    page.goto(found.as_uri())
    assert page.locator("nav [aria-current]").inner_text() == "Matches"
    goals = page.locator("ol.goals").first.locator("li")
    every = goals.count()
    assert every > goals.locator("visible=true").count() == 6
    assert page.get_by_role("button", name=f"{every - 6} more goals").is_visible()
    page.wait_for_function("!document.querySelector('.clip:not([data-ready])')")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert goals.locator("visible=true").count() == every
    grass = goals.last.locator("canvas").evaluate("it => [...it.getContext('2d').getImageData(it.width * 0.3, it.height * 0.3, 1, 1).data]")
    assert min(grass) > 200, "a light pitch"
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert goals.locator("visible=true").count() == 6
    page.emulate_media(media="print", color_scheme="dark")
    assert goals.locator("visible=true").count() == every
    assert page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--grass')").strip() == "#e6ece4"
    page.emulate_media(media="screen")
    page.evaluate("location.hash = '#goal-109'")
    page.locator("#goal-109").wait_for(state="visible")


def test_tables_sort_and_filter(pages, page):
    """The league sorts by a column, both ways, and filters by words."""
    page.goto(pages.first.as_uri())
    rows = page.locator("#matches tbody tr:visible")
    head = page.locator("#matches th", has_text="Match")
    first = rows.first.inner_text()
    head.click()
    up = rows.first.inner_text()
    head.click()
    assert rows.first.inner_text() != up
    assert first in (up, rows.first.inner_text())
    page.fill("[data-filter]", "two")
    assert rows.count() == 1


def test_order_of_the_gallery(pages, page):
    """The gallery is by effect, and by what else is chosen."""
    page.goto(gallery(pages).as_uri())
    numbers = "(cards, by) => cards.map(card => Number(card.dataset[by]))"
    cards = page.locator(".card")
    assert cards.count() > 3
    for choice in ("support", "value", "new", "low", "worse"):
        page.select_option("[data-order]", choice)
        found = cards.evaluate_all(numbers, choice)
        assert found == sorted(found, reverse=True)
        assert len(set(found)) > 1 or choice == "new"


def test_jumps_in_a_replay(pages, page):
    """A replay jumps to the next and the previous kick, and an address rings a robot."""
    replay = next((pages.first.parent / "replays").iterdir())
    page.goto(f"{replay.as_uri()}#t=5&paused&robot=home-0")
    clock = page.locator("#clock")
    clock.wait_for()
    page.wait_for_function("document.getElementById('clock').textContent.startsWith('00:05')")
    assert page.locator("#situation").input_value() == "21"
    page.keyboard.press("n")
    page.wait_for_timeout(200)
    there = clock.inner_text()
    assert there > "00:05.0"
    page.keyboard.press("n")
    page.wait_for_timeout(200)
    assert clock.inner_text() > there
    page.keyboard.press("N")
    page.wait_for_timeout(200)
    assert clock.inner_text() == there


def test_report_prints(pages, page, tmp_path):
    """The scouting report is one printed page."""
    for found in (pages.first.parent / "against").glob("*.html"):
        page.goto(found.as_uri())
        page.emulate_media(media="print")
        page.pdf(path=tmp_path / "report.pdf", prefer_css_page_size=True)
        assert len(re.findall(rb"/Type\s*/Page\b", (tmp_path / "report.pdf").read_bytes())) == 1
        # sentences as long as the longest of leagues
        page.evaluate("document.querySelectorAll('.sheet section > p:not(.legend)').forEach((it) => { it.textContent = 'words of it '.repeat(15); })")
        page.pdf(path=tmp_path / "report.pdf", prefer_css_page_size=True)
        assert len(re.findall(rb"/Type\s*/Page\b", (tmp_path / "report.pdf").read_bytes())) == 1
