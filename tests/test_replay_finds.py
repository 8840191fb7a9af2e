"""Search and lists of the replay page, and how addresses and keys move it."""

import json
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from playwright.sync_api import Page, expect
from support.league import HOSTILE
from test_replay import decode, make, situations

from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.stages.sequences.windows import codes_of, role_of, windows
from pitchlore.pipeline.views.replay import _worn, linked
from pitchlore.pipeline.views.scout.content import replays
from pitchlore.pipeline.views.scout.content.learned import Learned
from pitchlore.pipeline.views.scout.content.sources import newest, played, sequence
from pitchlore.pipeline.views.scout.content.teams import gallery
from pitchlore.pipeline.views.scout.occurrences import occurrences
from pitchlore.schemas import ROLES, SIDES, Behaviours, Passes, Shots

#: Finds in the page's own match: of each run the team, the robot and when it starts and ends, ms.
FIND = """async wanted => {
  const [packed] = await data(document.getElementById("payload"));
  const found = finder(understand(await decode(packed))).find(wanted);
  return found && found.hits.map(hit => [hit.team, hit.robot, hit.t, hit.end]);
}"""


@pytest.fixture
def replay(pages) -> str:
    """Address of the first match's replay."""
    return next(iter(sorted((pages.first.parent / "replays").iterdir()))).as_uri()


def shown(page: Page) -> str:
    """The clock of a page that is ready."""
    expect(page.locator("#clock")).to_have_text(re.compile(r"\d\d:\d\d\.\d / "))
    page.wait_for_timeout(200)
    return page.locator("#clock").inner_text().partition(" / ")[0]


def opened(page: Page, address: str) -> str:
    """The clock of an address, loaded anew."""
    page.goto("about:blank")
    page.goto(address)
    return shown(page)


def ms(t_ns: int) -> int:
    return round(t_ns / 1e6)


# ---- what is found


def commonest(own: pl.DataFrame) -> pl.DataFrame:
    """The ten commonest runs of two, of three and of four situations, as behaviours."""
    found = []
    for n in (2, 3, 4):
        runs = windows(own, n)
        keys, counts = np.unique(runs.key, return_counts=True)
        top = keys[np.argsort(-counts, kind="stable")[:10]]
        for role, codes in zip(role_of(top), codes_of(top, n).tolist(), strict=True):
            found.append(("-".join([ROLES[role], *(f"{code:03d}" for code in codes)]), ROLES[role], codes))
    return pl.DataFrame(found, orient="row", schema={
        name: Behaviours.dtypes()[name] for name in ("behaviour_id", "role", "codes")})


def test_behaviours_are_found(store, replay, page):
    """The page finds the occurrences that pipeline.stages.sequences.windows finds of each behaviour by itself."""
    match = next(it for it in played(store) if it.name in replay)
    known = newest(store)
    page.goto(f"{replay}#paused")
    counted = 0
    for side, team in zip(SIDES, (match.home, match.away), strict=True):
        own = sequence(match, side)
        learned = known.of(team).select("behaviour_id", "role", "codes")
        for row in pl.concat([learned, commonest(own)]).iter_slices(1):
            expected = [(r["team"], r["robot"], ms(r["t_ns"]), ms(r["done_ns"]))
                        for r in occurrences(own, row).iter_rows(named=True)]
            found = page.evaluate(FIND, f"{side}:{row['behaviour_id'][0]}")
            assert sorted(map(tuple, found)) == sorted(expected), row["behaviour_id"][0]
            counted += len(expected)
    assert counted > 200


def test_a_break_ends_a_run(replay, page):
    """Situations that do not follow one another are no run; the control has each pair that follows."""
    page.goto(f"{replay}#paused")
    pairs, broken = page.evaluate("""async () => {
      const [packed] = await data(document.getElementById("payload"));
      const match = understand(await decode(packed)), { code, follows } = match.situations;
      const found = (m) => new Set(finder(m).find(`${code[at - 1]}-${code[at]}`).hits.map(hit => hit.t));
      const at = follows.indexOf(1), t = match.situations.start[at - 1];
      const before = found(match).has(t);
      follows[at] = 0;
      return [before, found(match).has(t)];
    }""")
    assert (pairs, broken) == (True, False)


@pytest.mark.parametrize("wanted", ["", "x", "striker", "striker-", "44-44-44-44-44", "striker-044; drop", "constructor", "__proto__"])
def test_nonsense_is_not_found(replay, page, wanted):
    """A word that is no behaviour, no code and no kind of event is refused, and the choice stays."""
    opened(page, f"{replay}#paused&behaviour={wanted}")
    assert page.evaluate(FIND, wanted) is None
    assert page.locator("#situation").input_value() == "21"


@pytest.mark.parametrize("schema", [Passes, Shots])
def test_events_are_the_tables(store, replay, page, schema):
    """The page's passes and shots are the rows of the public tables."""
    match = next(it for it in played(store) if it.name in replay)
    table = getattr(match, schema.NAME)
    page.goto(f"{replay}#paused")
    found = page.evaluate(FIND, {"passes": "pass", "shots": "shot"}[schema.NAME])
    assert [hit[:3] for hit in found] == [
        [team, robot, ms(t_ns)] for team, robot, t_ns in table.select("team", "robot", "t_ns").iter_rows()]
    assert found


@pytest.mark.slow
def test_known_behaviours(store):
    """Each team's behaviours are those of its gallery, in its order; without knowledge there are none."""
    known = newest(store)
    learned = Learned(store, known, list(played(store)))
    teams = [team for match in played(store) for team in (match.home, match.away)]
    found = json.loads(re.fullmatch(r"scoutKnown\((.*)\);\n", replays.known_behaviours(teams, known, learned).decode())[1])
    assert [[kind, name] for kind, name, _ in found] == [[team.kind, team.name] for team in teams]
    for team, (_, _, ids) in zip(teams, found, strict=True):
        own = [it for it in played(store) if team in (it.home, it.away)]
        shown_there = gallery(team, own, known, learned)
        assert ids == [card["id"] for card in shown_there["cards"]]
        assert ids
    assert replays.known_behaviours(teams, None, learned) == b"scoutKnown([]);\n"


@pytest.mark.parametrize(("home", "away", "kind", "worn"), [
    ("blue", "yellow", Kind.VSSS, {"home": "blue", "away": "yellow"}),
    ("Yellow", "BLUE", Kind.SSL, {"home": "yellow", "away": "blue"}),
    ("blue", "yellow", Kind.SIM2D, None), ("blue", "blue", Kind.VSSS, None), ("TIGERs", "yellow", Kind.SSL, None)])
def test_worn(home, away, kind, worn):
    """A team wears a colour where its league has two and both teams are named by them."""
    assert _worn(home, away, PITCHES[kind]) == worn


# ---- the page in the scout's folder


def test_linked_is_escaped():
    """Names in a page that loads its match are text."""
    html = linked(f'm"{HOSTILE}', HOSTILE, HOSTILE)
    assert HOSTILE not in html
    assert "unsafe-inline" not in re.search(r"script-src ([^;]*);", html)[1], "no script in the page runs"
    assert "file:" not in re.search(r'Security-Policy" content="([^"]*)"', make())[1]


def test_data_is_kept_once(pages, replay, page):
    """A replay in the scout's folder has no copy of the match; it shows the one that clips show."""
    match = Path(replay).stem
    assert len((pages.first.parent / "replays" / f"{match}.html").read_bytes()) < 8_000
    assert len((pages.first.parent / "data" / f"{match}.js").read_bytes()) > 10_000
    assert opened(page, f"{replay}#t=5&paused") == "00:05.0"
    assert page.locator("#situation optgroup[label^='behaviours of']").count() > 0


def test_our_team_is_blue(pages, replay, page):
    """A replay that a team's page opens draws that team blue and playing to the right, says so, and keeps it in its address."""
    page.add_init_script("window.places = []; const move = CanvasRenderingContext2D.prototype.translate;"
                         "CanvasRenderingContext2D.prototype.translate = function (...at) { places.push(at); move.apply(this, at); }")
    drawn = "(places.length = 0, document.body.dispatchEvent(new KeyboardEvent('keydown', { key: 'l', bubbles: true })), new Promise((done) => setTimeout(() => done(places.slice(1)), 200)))"
    asked = "[getComputedStyle(document.querySelector('#home i')), getComputedStyle(document.querySelector('#away i'))].map((it) => it.backgroundColor)"
    opened(page, f"{replay}#t=5&paused")
    usual, names = page.evaluate(asked), [page.locator(f"#{side} span").inner_text() for side in SIDES]
    assert page.locator("#colours").text_content().startswith(f"Blue is {names[0]} (home in tables and addresses), orange is {names[1]} (away)")
    shown = page.evaluate(drawn)
    opened(page, f"{replay}#t=5&ours=away&paused")
    assert page.evaluate(asked) == usual[::-1]
    assert len(shown) >= 6
    assert page.evaluate(drawn) == [[pytest.approx(-x), pytest.approx(-y)] for x, y in shown]
    assert [page.locator(f"#{side} small").text_content() for side in SIDES] == ["← attacks left", "attacks right →"]
    assert page.locator("#colours").text_content().startswith(f"Blue is {names[1]} (away in tables and addresses), orange is {names[0]} (home)")
    page.keyboard.press("ArrowRight")
    page.wait_for_url(re.compile("t=6.*ours=away"))
    match = Path(replay).stem
    for found in (pages.first.parent / "teams").glob("*.html"):
        links = re.findall(rf'href="[^"]*{match}.html#t=([^"]*)"', found.read_text())
        name = re.search("<h1>(.*?)</h1>", found.read_text())[1]
        assert {("ours=away" in link) == (name != "blue") for link in links} <= {True}, found


def test_data_is_missing(pages, browser, tmp_path):
    """A replay without its code or its data says which file it misses."""
    source = next((pages.first.parent / "replays").iterdir())
    (tmp_path / "replays").mkdir()
    (tmp_path / "replays" / source.name).write_bytes(source.read_bytes())
    alone = browser.new_page()
    alone.goto((tmp_path / "replays" / source.name).as_uri())
    expect(alone.locator("#lone")).to_contain_text("replay.js")
    (tmp_path / "replay.js").write_bytes((pages.first.parent / "replay.js").read_bytes())
    alone.reload()
    assert alone.locator("#lone").count() == 0
    expect(alone.locator("#trouble")).to_contain_text(f"data/{source.stem}.js is missing")
    alone.close()


def test_commentary_leads_into_the_replay(pages, page):
    """Each sentence of the commentary on a match's page leads to its moment, and the replay says it there."""
    found = next((pages.first.parent / "matches").iterdir())
    page.goto(found.as_uri())
    page.locator("details", has=page.locator(".told")).locator("summary").click()
    lines = page.locator(".told li")
    assert lines.count() > 2
    line = lines.nth(1)
    said_at = line.locator("a").inner_text()
    says = line.inner_text().removeprefix(said_at).strip()
    line.locator("a").click()
    expect(page.locator("#told")).to_have_text(says)
    page.keyboard.press("k")
    minutes, seconds = map(int, said_at.split(":"))
    assert abs(float(shown(page)[3:]) + 60 * float(shown(page)[:2]) - 60 * minutes - seconds) < 3


# ---- address, keys, list


def test_address_of_a_behaviour(replay, page):
    """An address without a moment opens just before the first occurrence; pausing keeps choice and filter in it."""
    page.goto(f"{replay}#paused")
    first = page.evaluate(FIND, "striker-046")[0]
    at = opened(page, f"{replay}#behaviour=striker-046&filter&paused")
    assert float(at[3:]) == pytest.approx(max(0, first[2] / 1000 - 1), abs=0.11)
    assert page.locator("#situation").input_value() == "striker-046"
    assert page.locator("#filter").get_attribute("aria-pressed") == "true"
    page.keyboard.press("n")
    page.wait_for_timeout(600)
    assert re.search(r"#t=[\d.]+&behaviour=striker-046&filter&paused$", page.url)
    now = shown(page)
    assert opened(page, f"{replay}#t=9&robot=away-1&situation=044&paused") == "00:09.0" != now
    assert page.locator("#situation").input_value() == "44", "as the list of situations has it"
    page.keyboard.press("n")
    page.wait_for_timeout(600)
    assert "robot=away-1" in page.url
    assert page.locator("#said").inner_text().startswith(("away 1", shown(page)))


def test_filter(replay, page):
    """The key f dims what is not chosen on pitch and time line, and undoes it."""
    opened(page, f"{replay}#t=5&paused")
    pictures = "['pitch', 'timeline'].map(id => document.getElementById(id).toDataURL())"
    plain = page.evaluate(pictures)
    page.keyboard.press("f")
    page.wait_for_timeout(200)
    dimmed = page.evaluate(pictures)
    assert dimmed[0] != plain[0]
    assert dimmed[1] != plain[1]
    page.keyboard.press("f")
    page.wait_for_timeout(200)
    assert page.evaluate(pictures) == plain


def test_passes_and_shots(replay, page):
    """The keys p and P go to 1 s before each pass and shot, one after the other."""
    opened(page, f"{replay}#t=0&paused")
    kicks = [hit[2] / 1000 for hit in page.evaluate(FIND, "kick")]
    wanted = [t for t in kicks if t > 1.01][:3]
    seen = []
    for _ in wanted:
        page.keyboard.press("p")
        seen.append(float(shown(page)[3:]) + 60 * int(page.locator("#clock").inner_text()[:2]))
    assert seen == pytest.approx([t - 1 for t in wanted], abs=0.11)
    page.keyboard.press("P")
    assert float(shown(page)[3:]) == pytest.approx(seen[-2], abs=0.11)


def test_list(replay, page):
    """The list has goals, passes and shots, narrows by words, and jumps by mouse and by keyboard alone."""
    opened(page, f"{replay}#paused&find=kick")
    page.locator("#panel summary").click()
    rows = page.locator("#list tr")
    kicks = page.evaluate(FIND, "kick")
    assert rows.count() == len(kicks)
    page.fill("#narrow", "shot")
    assert rows.count() == len(page.evaluate(FIND, "shot"))
    assert page.locator("#count").inner_text() == f"{rows.count()} of {len(kicks)}"
    page.locator("#narrow").press("f")
    assert page.locator("#filter").get_attribute("aria-pressed") == "false", "a letter that is typed is no key"
    page.fill("#narrow", "")
    page.locator("#list button").nth(2).focus()
    page.keyboard.press(" ")
    assert page.locator("#play path").get_attribute("d").startswith("M4 2"), "space on a button does not play"
    assert float(shown(page)[3:]) == pytest.approx(max(0, kicks[2][2] / 1000 - 1), abs=0.11)
    page.fill("#codes", "goalkeeper-184")
    page.keyboard.press("Enter")
    assert page.locator("#situation").input_value() == "goalkeeper-184"
    page.fill("#codes", "nonsense")
    page.keyboard.press("Enter")
    assert page.locator("#codes").evaluate("input => input.validationMessage") != ""
    assert page.locator("#situation").input_value() == "goalkeeper-184"


def test_no_trap(replay, page):
    """The tab key goes through all that can be used, and leaves the page's end."""
    opened(page, f"{replay}#paused")
    page.evaluate("document.activeElement.blur()")
    seen = []
    for _ in range(60):
        page.keyboard.press("Tab")
        seen.append(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
        if seen[-1] == "BODY":
            break
    assert seen[-1] == "BODY"
    assert {"play", "situation", "situation-on", "filter", "speed", "help"} <= set(seen)


def test_nothing_is_told_of_missing_tables():
    """Without tables of passes and shots the page lists none."""
    facts = decode(make())
    assert (facts["passes"], facts["shots"], facts["told"], facts["worn"]) == ([], [], [], None)


def test_follows():
    """Situations that touch are consecutive, those further apart than the setting are not."""
    done = situations([
        ("home", 1, 21, "a", 0, 100, 1.0, None), ("home", 1, 22, "b", 100, 200, 1.0, None),
        ("home", 1, 23, "c", 350, 400, 1.0, None), ("away", 2, 21, "a", 400, 500, 1.0, None)])
    assert decode(make(done=done))["situations"]["follows"] == [0, 1, 1, 0]
    assert decode(make(done=done, gap_s=0.1))["situations"]["follows"] == [0, 1, 0, 0]
