"""The scout's page that compares, and pages of chosen teams and matches."""

import json
import re
from itertools import pairwise

import numpy as np
import polars as pl
import pytest
import scipy

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.numbers.statistics import welch
from pitchlore.pipeline.views.scout.content import compare
from pitchlore.pipeline.views.scout.content.sources import chosen_matches, played
from pitchlore.pipeline.views.scout.content.write import write_pages
from pitchlore.pipeline.views.scout.facts import PARTS, mean_number, numbers, parts, played_s
from pitchlore.schemas import SIDES, Behaviours
from pitchlore.schemas.behaviours import for_people


def facts_of(script: bytes):
    return json.loads(re.fullmatch(r"\w+\((.*)\);\n", script.decode(), re.DOTALL)[1])


@pytest.fixture(scope="module")
def league(store):
    return list(played(store))


def lines_of(store, league):
    """Numbers that the scripts take from the league's lines, by match."""
    return {match.name: {"played_s": played_s(match.trajectories)} for match in league}


def test_chosen(league):
    """Teams and ids choose matches, each once; without any all are chosen."""
    one, two = league
    assert chosen_matches(league, []) == league
    assert chosen_matches(league, [one.name]) == [one]
    assert chosen_matches(league, [two.name[:4]]) == [two]
    assert chosen_matches(league, ["yellow"]) == [one], "the second match has another name for it"
    assert chosen_matches(league, ["blue", one.name]) == league
    for name in ("nobody", ""):
        with pytest.raises(NotFound, match=r"no team has this name.*blue"):
            chosen_matches(league, [name])


def test_pages_of_a_choice(store, league):
    """The pages of a choice are a folder of their own, which says how many matches it leaves out."""
    found = write_pages(store, names=["yellow"])
    assert re.fullmatch(r"scout-yellow-[0-9a-f]{6}", found.first.parent.name)
    assert [path.stem for path in (found.first.parent / "matches").iterdir()] == [league[0].name]
    assert "1 of 2 matches" in found.first.read_text()


def test_numbers_of_both(store, league):
    """The page that compares has the numbers of the matches' and the teams' own pages."""
    match = league[0]
    own = numbers(match)
    lines = {it.name: {"score": "? : ?", "seconds": 60.0, "numbers": {
        side: each._asdict() for side, each in numbers(it).items()}} for it in league}
    found = facts_of(compare.numbers_script(league, [match.home, match.away], lines, compare.versions(store)))
    first = next(it for it in found["matches"] if it["id"] == match.name)
    assert first["numbers"] == [json.loads(json.dumps(own[side]._asdict())) for side in SIDES]
    two = [it for it in found["sets"] if it["team"] == found["teams"][0]["slug"]]
    assert {it["says"].rpartition(", ")[2] for it in two} >= {f"against {match.away.name}"}
    assert all(len(it["matches"]) == 1 and it["numbers"]["shots"][3] == it["against"]["shots"][3] == 1 for it in two)
    assert found["teams"][0]["against"]["shots"][0] == pytest.approx(10 * sum(lines[it.name]["numbers"]["away"]["shots"] for it in league) / 2)
    goals = [(own["home"].goals, own["away"].goals) for own in map(numbers, league)]
    assert found["teams"][0]["standing"] == {
        "won": sum(a > b for a, b in goals), "drawn": sum(a == b for a, b in goals), "lost": sum(a < b for a, b in goals),
        "goals": sum(a for a, _ in goals), "against": sum(b for _, b in goals)}
    home = found["teams"][0]
    assert (home["name"], home["matches"]) == ("blue", 2)
    mean, low, high, n, varies, error = home["numbers"]["shots"]
    assert (low, high, n, varies, error) == (None, None, 2, False, None), "two matches have no interval"
    assert mean == pytest.approx(10 * sum(lines[it.name]["numbers"]["home"]["shots"] for it in league) / 2)


def test_knowledge(store, league):
    """A version's script has each team's behaviours, in their order for people, as the table has them."""
    manifest = compare.versions(store)[0]
    table = store.read_table(manifest, "behaviours", Behaviours)
    found = facts_of(compare.knowledge(store, manifest, league, lines_of(store, league)))
    assert found["version"] == manifest.version
    assert sum(len(team["behaviours"]) for team in found["teams"]) == table.height
    for team in found["teams"]:
        rows = table.filter(pl.col("team") == team["name"])
        assert {row[0] for row in team["behaviours"]} == set(rows["behaviour_id"])
        sides = [match for match in league for each in (match.home, match.away) if each.name == team["name"]]
        played = sum(played_s(match.trajectories) for match in sides)
        assert team["minutes"] == pytest.approx(played / 60)
        assert 0 < played <= sum(match.matches["duration_s"][0] for match in sides)
        assert [row[0] for row in team["behaviours"]] == for_people(rows)["behaviour_id"].to_list()
    part = facts_of(compare.knowledge(store, manifest, league[:1], lines_of(store, league)))
    assert {team["minutes"] for team in part["teams"]} == {None}, "a match that it was learned from is not there"


def test_parts(store, league):
    """Possession in parts adds up to that of the whole match; so does territory."""
    tables = league[0]
    found = parts(tables)
    assert len(found) == PARTS
    whole = numbers(tables)["home"]
    end = tables.matches["duration_s"][0] * 1e9
    edges = [part.start_s * 1e9 for part in found] + [end]
    held = [sum(max(0, min(stop, high) - max(start, low)) for start, stop in tables.possession.select(
        "start_ns", "end_ns").iter_rows()) for low, high in pairwise(edges)]
    own = sum(part.possession * it for part, it in zip(found, held, strict=True) if part.possession is not None)
    assert own / sum(held) == pytest.approx(whole.possession, abs=1e-3)
    assert all(part.territory is None or 0 <= part.territory <= 1 for part in found)


def test_goals_in_halves(store, league):
    """Goals of halves are those of the table; of a whole match the score."""
    tables = league[0]
    end = int(tables.matches["duration_s"][0] * 1e9) + 1
    middle = int(tables.goals["t_ns"][0]) + 1
    first, second = numbers(tables, 0, middle), numbers(tables, middle, end)
    for side in SIDES:
        count = tables.goals.filter(pl.col("team") == side).height
        assert first[side].goals + second[side].goals == count
        assert numbers(tables)[side].goals == tables.matches[f"score_{side}"][0]


# ---- in a browser


def test_compares(pages, page):
    """Matches, teams and behaviours are compared as chosen, the choice is in the address, and names are text."""
    page.goto((pages.first.parent / "compare.html").as_uri())
    matches = page.locator("#matches .found")
    assert matches.locator("tbody tr").count() > 8
    choices = page.locator("#matches [data-side='0'] option")
    ids = choices.evaluate_all("them => them.map(it => it.value)")
    page.select_option("#matches [data-side='0']", ids[1])
    page.select_option("#matches [data-side='1']", ids[1])
    cells = matches.locator("tbody tr").first.locator("td").all_inner_texts()
    assert cells[:2] == cells[2:4], "a match is like itself"
    assert cells[4:] == ["0", "0"], "and differs by nothing: that stands after what it is made from"
    sets = page.locator("#sets .found tbody tr")
    assert sets.first.locator("td").all_inner_texts()[:3] == ["1", "", "1"]
    assert page.locator("#sets .found p").first.inner_text().startswith("Too few matches to tell a difference from chance (1 match against 1)")
    assert sets.nth(1).locator("th").inner_text() == "won – drawn – lost"
    page.reload()
    assert page.locator("#matches [data-side='0']").input_value() == ids[1]
    assert page.title() != "taken"
    assert "<script>" in page.locator("#teams").inner_text() or "<script>" in choices.all_inner_texts()[1]
    rows = page.locator("#behaviours .found tbody tr")
    rows.first.wait_for()
    every = rows.count()
    assert "in both" in page.locator("#behaviours .found").first.inner_text()
    counts = []
    for only in ("first", "second"):
        page.select_option("[data-show]", only)
        counts.append(rows.count())
    assert 0 < sum(counts) <= every


def test_one_version_compared_with_itself(pages, page):
    """A team and itself have all in common, and no test of a difference is made."""
    page.goto((pages.first.parent / "compare.html").as_uri())
    page.locator("#behaviours .found tbody tr").first.wait_for()
    page.select_option("#behaviours [data-side='1']", page.locator("#behaviours [data-side='0']").input_value())
    assert page.locator("#behaviours .found p").first.inner_text() == "Both are the same team in the same version."


def test_differences_are_of_shown_numbers(pages, page):
    """A difference is that of the two numbers beside it, and a team keeps its columns where it changes sides."""
    page.goto((pages.first.parent / "compare.html").as_uri())
    page.locator("#matches .found tbody tr").first.wait_for()
    assert page.evaluate("[less(0.526, 0.534, true), less(0.536, 0.534, true), less(2.04, 2.06, false, 1), less(null, 1)]") == ["0", "−1", "+0.1", "–"]
    page.evaluate("""() => { const [one] = league.matches;
        league.matches.push({ ...one, id: "turned", names: [...one.names].reverse(), numbers: [...one.numbers].reverse() });
        document.querySelectorAll("#matches .found")[1].replaceChildren(...twoMatches(one.id, "turned")); }""")
    heads = page.locator("#matches .found thead tr").last.locator("th").all_inner_texts()
    assert heads[-6:-4] == heads[-4:-2] == heads[-2:]
    for row in page.locator("#matches .found tbody tr").all():
        cells = row.locator("td").all_inner_texts()
        assert cells[:2] == cells[2:4]
        assert {*cells[4:]} <= {"0", "0.00", "–"}


def test_a_phone_folds_comparisons(pages, page):
    """On a phone the tables of a comparison are folded below what is chosen and said; an address opens its own."""
    page.set_viewport_size({"width": 390, "height": 844})
    address = (pages.first.parent / "compare.html").as_uri()
    page.goto(address)
    page.locator("#sets .found p:visible").first.wait_for()
    assert not page.locator("main table:visible").count()
    page.locator("#matches summary").click()
    page.locator("#matches table:visible").wait_for()
    page.select_option("#matches [data-side='1']", index=0)
    assert page.locator("#matches table:visible").count() == 1, "another choice leaves it open"
    page.locator(".sections a[href='#sets']").click()
    page.locator("#sets table:visible").wait_for()
    slug = page.locator("#teams [data-side='0']").input_value()
    page.goto("about:blank")
    page.goto(f"{address}#teams={slug}")
    page.locator("#teams table:visible").wait_for()
    assert not page.locator("#matches table:visible").count()


def test_numbers_of_comparisons(pages, page):
    """Ends of an interval stand without percent signs, as on other pages, and matches are called without digests."""
    page.goto((pages.first.parent / "compare.html").as_uri())
    page.locator("#matches .found tbody tr").first.wait_for()
    assert page.evaluate("interval([0.53, 0.426, 0.634, 7, false], true)") == "53\u00a0% [43, 63]"
    assert page.evaluate("interval([-1, -2, 0.5, 7, false], false)") == "−1.0 [−2.0, 0.5]"
    assert page.evaluate("named({ id: 'a-b-2026-10-17-45b9335eb643', names: ['A', 'B'], score: '1 : 0' })") == "a-b-2026-10-17: A 1 : 0 B"
    order = """() => { const made = table(["", "n"], [["b", "−2"], ["c", "10"], ["a", "−10"]]); sortable(made);
        made.tHead.rows[0].cells[1].click(); return [...made.tBodies[0].rows].map((row) => row.cells[0].textContent); }"""
    assert page.evaluate(order) == ["a", "b", "c"], "below zero by size"


def test_no_test_of_few_matches(pages, page):
    """A difference has a star from four matches on each side on, and none below, however alike the matches are."""
    page.goto((pages.first.parent / "compare.html").as_uri())
    page.locator("#sets .found tbody tr").first.wait_for()
    stars = page.evaluate("""[[1, null, null, 2, false, null], [1, 1, 1, 4, false, 0]].map((one) => apart(one, [one[0] + 1, ...one.slice(1)], false, true))""")
    assert stars == ["+1.0", "★ +1.0 ± 0.0"]
    assert page.evaluate("interval([48.8, null, null, 2], false)") == "48.8 too few matches"
    assert page.evaluate("interval([48.8, 0, 99, 4, true], false)") == "48.8 varies too much"
    said = page.evaluate("""[1, 9].map((to) => { const key = league.measures[0][1], of = (at) => Object.fromEntries(
        league.measures.map(([, name]) => [name, name === key ? [at, at - 1, at + 1, 4, false, 1 / 3.1824] : null]));
        return answered([{ numbers: of(1), against: of(1) }, { numbers: of(to), against: of(1) }], [4, 4], true); })""")
    assert said == ["No difference between these sets is larger than chance gives (4 matches against 4).",
                    "More than chance gives changed: goals (+8.0 ± 1.1) (4 matches against 4); of 2 numbers chance alone makes about 0.1 so."]
    met = page.evaluate("""(() => { league.matches = [["a", "Bears"], ["b", "Bears"], ["c", "Wolves"], ["d", "Bears"], ["e", "Wolves"]].map(([id, name]) => ({ id, names: ["Foxes", name] }));
        return [["ab", "d"], ["ab", "c"], ["ac", "abce"], ["ac", "abe"]].map((both) => adversaries(both.map((ids) => ({ matches: [...ids] })), ["Foxes", "Foxes"])); })()""")
    assert met == ["Both sets have the same adversaries.",
                   "The adversaries differ, too: the first set has Bears twice and no Wolves; the second set has no Bears and Wolves once.",
                   "Both sets have the same adversaries, in the same shares.",
                   "The shares of the adversaries differ, too: the first set has Bears once and Wolves once; the second set has Bears twice and Wolves once."]


def test_differences_are_welchs(pages, page):
    """The interval of the difference of two sets is that of Welch, as the page of a team and scipy have it."""
    sides = np.array([1.0, 4.0, 2.0, 9.0]), np.array([10.0, 10.5, 9.0, 30.0, 11.0])
    page.goto((pages.first.parent / "compare.html").as_uri())
    means = [list(mean_number(side.tolist())) for side in sides]
    low, high = welch(sides[1], sides[0])
    assert page.evaluate("([one, other]) => welch(one, other)", means) == pytest.approx((high - low) / 2, rel=1e-5)
    assert page.evaluate("[1, 3, 6.5, 40, 500].map(student)") == pytest.approx(scipy.stats.t.ppf(0.975, [1, 3, 6.5, 40, 500]), rel=1e-4)


def test_partner_of_a_team(pages, page):
    """The team that is compared with is one of its league that it has played, and the behaviours are those teams'."""
    address = (pages.first.parent / "compare.html").as_uri()
    page.goto(address)
    page.locator("#behaviours .found tbody tr").first.wait_for()
    teams = page.evaluate("league.teams.map(({ slug, name, kind }) => [slug, `${name} (${kind})`])")
    for slug, name in teams:
        page.goto("about:blank")
        page.goto(f"{address}#teams={slug}")
        page.locator("#behaviours .found > *").first.wait_for()
        both = [page.locator(f"#teams [data-side='{side}'] option:checked").inner_text() for side in (0, 1)]
        assert both[0] == name
        assert page.evaluate("(slugs) => met(slugs.map((slug) => league.teams.find((it) => it.slug === slug)))", [
            page.locator(f"#teams [data-side='{side}']").input_value() for side in (0, 1)])
        of_team = page.evaluate("(slug) => league.sets.some((it) => it.team === slug)", slug)  # one match makes no set
        assert not of_team or page.locator("#sets [data-side='0'] option:checked").inner_text().startswith(f"{name}, ")
        chosen = page.locator("#behaviours [data-side] option:checked").all_inner_texts()
        known = page.locator("#behaviours [data-side='0'] option").all_inner_texts()
        assert chosen == [each for each in both if each in known]
    page.select_option("#teams [data-side='1']", teams[0][0])
    if teams[0][1] in known:
        assert page.locator("#behaviours [data-side='1'] option:checked").inner_text() == teams[0][1]


def test_how_often_sorts(pages, page):
    """Behaviours are counted in ten minutes of play, a click sorts by that, and the first twenty are shown."""
    page.goto((pages.first.parent / "compare.html").as_uri())
    rows = page.locator("#behaviours .found tbody tr")
    rows.first.wait_for()
    visible, every = page.locator("#behaviours .found tbody tr:visible"), rows.count()
    assert visible.count() == every <= 20, "the control: few are all shown"
    page.evaluate("""known.forEach((teams) => teams.forEach((team) => {
        for (let i = 0; i < 40; i++) team.behaviours.push([`striker-${String(i).padStart(3, "0")}`, 3 + 7 * i % 41, 0.01, null, null]);
    }))""")
    page.select_option("[data-show]", "first")
    page.select_option("[data-show]", "all")
    every = rows.count()
    assert every > 40
    rates = page.locator("#behaviours .found thead th", has_text="each 10 min").first
    rates.click()
    rates.click()
    shown = visible.evaluate_all("rows => rows.map((row) => row.cells[2].textContent)")
    assert len(shown) == 20
    rate = [float(it) for it in shown]
    assert rate == sorted(rate, reverse=True)
    assert rate[0] > rate[-1]
    page.get_by_role("button", name=f"Show all {every}").click()
    assert visible.count() == every
