"""The scout's maps, what follows what, and where behaviours begin and end: the numbers, the pages, a browser."""

import re
import shutil
from html import unescape
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from playwright.sync_api import expect
from support.league import HOSTILE

from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.pipeline.views.commentary.words import in_digits
from pitchlore.pipeline.views.scout.content.learned import Learned
from pitchlore.pipeline.views.scout.content.sources import newest, played
from pitchlore.pipeline.views.scout.content.teams import gallery
from pitchlore.pipeline.views.scout.content.write import write_pages
from pitchlore.pipeline.views.scout.maps import lying, maps, nearest, sign
from pitchlore.pipeline.views.scout.occurrences import occurrence_places, occurrences
from pitchlore.pipeline.views.scout.ring import Edge, Node, ring
from pitchlore.pipeline.views.scout.transitions import neighbours_of, transitions
from pitchlore.schemas import SIDES, Behaviours, Decisions, Grams, Neurons, Trajectories

S = 10**9


@pytest.fixture(scope="module")
def learned(store) -> Learned:
    return Learned(store, newest(store), list(played(store)))


def teams(store):
    return sorted({team for match in played(store) for team in (match.home, match.away)})


def with_behaviours(store):
    known = newest(store)
    return [team for team in teams(store) if not known.of(team).is_empty()]


def richest(store):
    return max(teams(store), key=lambda team: newest(store).of(team).height)


def page_of(pages, folder, team):
    return pages.first.parent / folder / f"{team.slug}.html"


# ---- what follows what


def decided(*rows):
    """(match, robot, t in s, behaviour, episode) each, as decisions of home's midfield."""
    rest = {"team": "home", "role": "midfield", "end_ns": 0, "state": 0, "chosen": False, "random": False,
            "reward": 0.0, "ends": None, "value": 0.0}
    return pl.DataFrame([
        {"match_id": match, "robot": robot, "t_ns": t * S, "behaviour_id": name, "episode": episode, **rest}
        for match, robot, t, name, episode in rows], schema=Decisions.dtypes())


def test_transitions():
    """The next one is of the same match, robot and episode; a random move is one, too."""
    a, b, c = "midfield-001", "midfield-011", "striker-021"
    found = transitions(decided(
        ("m-1", 1, 0, a, 0), ("m-1", 1, 1, b, 0), ("m-1", 1, 2, a, 0), ("m-1", 1, 9, b, 0), ("m-1", 1, 20, c, 1),
        ("m-1", 2, 0, a, 0), ("m-1", 2, 1, None, 0), ("m-1", 2, 2, c, 0), ("m-2", 2, 0, a, 0)))
    assert found.begun.rows() == [
        (a, "midfield", 4), (b, "midfield", 2), (c, "striker", 2), ("midfield-194", "midfield", 1)]
    assert found.counts.rows() == [
        (a, b, 2), (a, "midfield-194", 1), (b, a, 1), ("midfield-194", c, 1)]
    near = neighbours_of(found)
    assert near[a] == ([(b, 1, 4)], [(b, 2, 4), ("midfield-194", 1, 4)])
    assert near[c] == ([("midfield-194", 1, 2)], [])


def test_transitions_are_plain_counts(store, learned):
    """The counts are those of one question in SQL to the public tables."""
    counted = 0
    for team in teams(store):
        asked = ask(refresh(store)[0], f"""
            with rows as (
              select d.*, lead(d.behaviour_id) over (
                partition by d.match_id, d.team, d.robot, d.episode order by d.t_ns) as following
              from decisions d join sides s on s.match_id = d.match_id and s.side = d.team
              where s.team = '{team.name.replace("'", "''")}' and s.kind = '{team.kind}')
            select behaviour_id, following, count(*) as times from rows where following is not null
            group by all order by all""")
        ours = transitions(learned.decisions(team)).counts.sort("behaviour_id", "then")
        counted += ours.height
        assert ours.rows() == [tuple(row) for row in asked.rows()]
    assert counted > 8


def test_ring():
    """All nodes and arrows are drawn, what they say is text, and the same graph is the same picture."""
    nodes = [Node(f"b-{n}", f"G{n}", role, HOSTILE) for n, role in enumerate(["goalkeeper"] * 3 + ["striker"] * 2)]
    edges = [Edge(0, 1, 0.5, "x"), Edge(1, 0, 0.25, HOSTILE), Edge(2, 2, 1.0, "y"), Edge(0, 4, 0.1, "z")]
    drawn = ring(nodes, edges, HOSTILE)
    assert "<script" not in drawn
    assert re.findall(r'data-place="([^"]+)"', drawn) == [node.key for node in nodes]
    assert sorted(re.findall(r'data-from="b-(\d)" data-to="b-(\d)"', drawn)) == [("0", "1"), ("0", "4"), ("1", "0"), ("2", "2")]
    assert drawn == ring(nodes, edges, HOSTILE)
    assert "nan" not in drawn
    widths = {said: float(width) for width, said in re.findall(r'stroke-width="([^"]+)".*?<title>(.)', drawn)}
    assert widths["y"] > widths["x"] > widths["z"]
    places = np.array([[float(each) for each in pair] for pair in re.findall(r'<circle cx="([^"]+)" cy="([^"]+)"', drawn)])
    assert np.linalg.norm(places[:, None] - places, axis=2)[~np.eye(5, dtype=bool)].min() > 18, "none lies on another"
    assert "nan" not in ring(nodes[:1], [Edge(0, 0, 1.0, "x")], "one")


# ---- where behaviours begin and end


def test_placed():
    """Places are those of the last sample at the start, and before the end; away's are turned."""
    found = pl.DataFrame({
        "behaviour_id": ["a", "b", "c"], "match_id": "m-1", "team": ["home", "away", "home"], "robot": [1, 1, 2],
        "t_ns": [S, 0, 0], "done_ns": [3 * S, 2 * S, S], "change": 0.0}, schema_overrides={"robot": pl.Int16})
    rows = [("home", 1, t * S, t / 10, t / 20) for t in range(4)] + [("away", 1, t * S, t / 10, 0.5) for t in range(4)]
    rows += [("home", 2, 0, float("nan"), 0.0)]
    trajectories = pl.DataFrame(rows, orient="row", schema={
        name: Trajectories.dtypes()[name] for name in ("team", "robot", "t_ns", "x", "y")})
    reported = occurrence_places(found, trajectories).sort("behaviour_id")
    assert reported.select("x", "y", "to_x", "to_y").rows()[0] == pytest.approx((0.1, 0.05, 0.2, 0.1))
    assert reported.select("x", "y", "to_x", "to_y").rows()[1] == pytest.approx((0.0, -0.5, -0.1, -0.5))
    assert reported.select("x", "to_x").rows()[2] == (None, None)


def test_begins_where_its_situation_does(store):
    """In a recording the beginnings are the places that sequences have, and ends are not beginnings."""
    known, checked = newest(store), 0
    for match in played(store):
        trajectories = match.trajectories
        for side, team in zip(SIDES, (match.home, match.away), strict=True):
            sequence = match.sequences.filter(pl.col("team") == side)
            found = occurrence_places(occurrences(sequence, known.of(team)), trajectories)
            reported = found.join(
                sequence.select("robot", "start_ns", wanted_x="x", wanted_y="y"), left_on=("robot", "t_ns"),
                right_on=("robot", "start_ns")).drop_nulls()
            checked += reported.height
            assert reported["x"].to_list() == pytest.approx(reported["wanted_x"].to_list())
            assert reported["y"].to_list() == pytest.approx(reported["wanted_y"].to_list())
            assert reported.is_empty() or (reported["x"] != reported["to_x"]).any()
    assert checked > 20


def test_as_many_as_the_support(store, pages, learned):
    """The occurrences that a card draws are those that the knowledge counted, even if not all behaviours are shown."""
    for shown in (60, 2, 1):
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr("pitchlore.pipeline.views.scout.gallery.SHOWN", shown)
            patched.setattr("pitchlore.pipeline.views.scout.gallery.SHOWN_OF_ORDER", 1)
            patched.setattr("pitchlore.pipeline.views.scout.content.teams.for_people", lambda own: own.with_columns(effect=0.0).sort("n", "support", descending=[False, True]))
            for team in with_behaviours(store):
                own = [match for match in played(store) if team in (match.home, match.away)]
                for card in gallery(team, own, newest(store), learned)["cards"]:
                    assert card["way"]["n"] == card["support"]


# ---- the maps


def test_nearest_and_sign():
    """A weight is called by the nearest code, the least on a tie; a value's sign is a character."""
    assert nearest([1.4, 12.0, 193.0], [11, 1, 13, 194]) == [1, 11, 194]
    assert [sign(value) for value in (0.1, -0.1, 0.0, None)] == ["+", "−", "0", ""]


def test_behaviours_lie_where_the_knowledge_says(store, learned):
    """A behaviour's neuron is that of its gram; one that is no gram of these matches lies on none."""
    known = newest(store)
    for team in with_behaviours(store):
        own = known.of(team)
        assert lying(own, learned.grams(team))["neuron"].to_list() == own["neuron"].to_list()
        assert lying(own, learned.grams(team).clear())["neuron"].null_count() == own.height


def test_maps_by_hand():
    """Colours follow the counts, gaps the distances; lists are the most frequent grams; unseen neurons say so."""
    neurons = pl.DataFrame([
        {"team": "x", "kind": "vsss", "n": 1, "neuron": at, "grid_row": 0, "grid_column": at, "prototype": [weight], "grams": grams,
         "count": count, "value": value, "kept": count > 0, "distance": distance, "quantisation_error": 1.5,
         "topographic_error": 0.25}
        for at, (weight, grams, count, value, distance) in enumerate([
            (1.2, 2, 20, 0.5, 4.0), (40.0, 1, 10, -0.5, 8.0), (194.0, 0, 0, None, 6.0)])], schema=Neurons.dtypes())
    grams = pl.DataFrame([
        {"team": "x", "kind": "vsss", "role": role, "codes": [code], "n": 1, "count": count, "value_sum": total,
         "neuron": neuron} for role, code, count, total, neuron in [
            ("striker", 1, 5, 2.5, 0), ("midfield", 1, 15, 7.5, 0), ("striker", 44, 10, -5.0, 1)]],
        schema=Grams.dtypes())
    own = pl.DataFrame([{"behaviour_id": "midfield-001", "role": "midfield", "codes": [1], "n": 1, "support": 15,
                         "value": 0.4, "neuron": 7}], schema=Behaviours.dtypes())
    (found,) = maps(neurons, grams, lying(own, grams), [])
    first, second, third = found["cells"]
    assert (found["rows"], found["columns"], found["count"], found["behaviours"]) == (1, 3, 30, 1)
    assert [cell["shade"] for cell in found["cells"]] == [45, 22, 0]
    assert [cell["gap"] for cell in found["cells"]] == [1, 9, 5]
    assert [(each["role"], each["count"], each["value"]) for each in first["list"]] == [("midfield", 15, 0.5), ("striker", 5, 0.5)]
    assert (first["behaviours"], second["behaviours"]) == (["midfield-001"], [])
    assert (second["near"], third["near"], third["sign"], third["list"]) == ("Reaches ball", "Moves randomly", "", [])


def test_only_what_the_version_was_made_from(store, tmp_path):
    """If the maps are gone or were made anew, the page says what to do, and pages are written anew."""
    own = Store(shutil.copytree(store.root, tmp_path / "data"))
    (own.root / "behaviours" / "all.receipt.json").unlink()
    assert not Learned(own, newest(own), list(played(own))).mapped
    assert write_pages(own).new == 4 * len(teams(own)), "pages of a team alone"
    for team in with_behaviours(own):
        shown = (own.root / "scout" / "maps" / f"{team.slug}.html").read_text()
        assert "Call <code>pitchlore run</code>" in shown
        assert 'class="ring"' in shown, "decisions stand"
        assert "on the map" not in (own.root / "scout" / "behaviours" / f"{team.slug}.html").read_text()


def test_without_knowledge(store, tmp_path):
    """Without knowledge there is a page that says so."""
    own = Store(shutil.copytree(store.root, tmp_path / "data", ignore=shutil.ignore_patterns("scout", "knowledge")))
    write_pages(own)
    assert "There is no knowledge yet" in next((own.root / "scout" / "maps").iterdir()).read_text()


def test_pages_say_what_the_tables_say(store, pages, learned):
    """Each cell has its neuron's numbers, each panel its grams', each behaviour is on its neuron."""
    for team in with_behaviours(store):
        shown = page_of(pages, "maps", team).read_text()
        rows = learned.neurons(team)
        assert re.findall(r"<b>(\d+)</b><span class=\"sign\">(.?)</span>", shown) == [
            (str(row["count"]), sign(row["value"])) for row in rows.iter_rows(named=True)]
        assert shown.count('class="cell') == rows.height == shown.count('id="n')
        marked = sum(int(each) for each in re.findall(r"◆(\d+)<", shown))
        assert marked == newest(store).of(team).height
        panels = dict(re.findall(r'<article class="panel" id="(n\d-\d+)"(.*?)</article>', shown, re.DOTALL))
        for (n, neuron), own in learned.grams(team).group_by("n", "neuron"):
            most = own.sort("count", "role", "codes", descending=[True, False, False]).row(0, named=True)
            text = unescape(panels[f"n{n}-{neuron}"])
            assert f'<td class="n">{most["count"]}</td><td class="n">{in_digits(most["value_sum"] / most["count"], 3)}</td>' in text
        begun = transitions(learned.decisions(team)).begun
        assert f"n = {begun['n'].sum()} decisions" in shown
        assert f"begun {begun['n'][0]} times" in shown


# ---- in a browser


@pytest.fixture
def chart(store, pages) -> Path:
    """The maps of the team that has most behaviours."""
    return page_of(pages, "maps", richest(store))


def test_walk(chart, page):
    """Arrow keys walk from neuron to neuron and stop at the edges; one panel shows at a time; an address opens one."""
    page.goto(f"{chart.as_uri()}#n1-0")
    walk = page.locator(".walk", has=page.locator("#map-1"))
    current, panel = walk.locator("[aria-current]"), walk.locator(".panel:visible")
    assert (current.get_attribute("data-place"), panel.get_attribute("id")) == ("n1-0", "n1-0")
    current.focus()
    for key, place in (("ArrowRight", "n1-1"), ("ArrowDown", "n1-6"), ("ArrowLeft", "n1-5"), ("ArrowLeft", "n1-5"),
                       ("ArrowUp", "n1-0"), ("ArrowUp", "n1-0")):
        page.keyboard.press(key)
        assert (current.get_attribute("data-place"), panel.get_attribute("id")) == (place, place)
    assert walk.locator("[data-place][tabindex='0']").count() == 1
    walk.locator("[data-place=n1-24]").click()
    assert panel.get_attribute("id") == "n1-24"
    assert page.url.endswith("#n1-24")


def test_the_busiest_is_chosen(chart, page):
    """A map opens with the neuron that has most instances, of thousands, too."""
    changed = chart.with_name("thousands.html")
    text = chart.read_text()
    last = re.search(r'data-place="(n1-\d+)"(?!.*data-place="n1-)', text, re.DOTALL)
    head, tail = text[:last.end()], text[last.end():]
    changed.write_text(head + re.sub(r"<b>[\d,]+</b>", "<b>1,234,567</b>", tail, count=1))
    page.goto(changed.as_uri())
    expect(page.locator(".walk", has=page.locator("#map-1")).locator(".panel:visible")).to_have_attribute("id", last[1])
    changed.unlink()


def test_ring_of_a_page(chart, page):
    """A chosen behaviour has its arrows marked, in and out, and its panel shown; links lead on."""
    page.goto(chart.as_uri())
    nodes = page.locator(".ring [data-place]")
    nodes.nth(2).click()
    key = nodes.nth(2).get_attribute("data-place")
    on = page.locator(".edge.on").evaluate_all("all => all.map(each => each.dataset.from)")
    to = page.locator(".edge.to").evaluate_all("all => all.map(each => each.dataset.to)")
    assert on
    assert set(on) | set(to) == {key}
    drawn = page.locator(".edge").evaluate_all("all => all.map(each => [each.dataset.from, each.dataset.to])")
    assert len(on) + len(to) == sum(key in edge for edge in drawn)
    assert page.locator(f"[id='{key}']").is_visible()
    page.keyboard.press("ArrowLeft")
    expect(nodes.nth(1)).to_have_attribute("aria-current", "true")
    leads, to = page.locator(".panel a[href^='#b-']").evaluate_all(
        "all => all.map(each => [each.closest('.panel').id, each.getAttribute('href').slice(1)]).find(([a, b]) => a !== b)")
    page.locator(f".ring [data-place='{leads}']").click()
    page.locator(f"[id='{leads}'] a[href='#{to}']").first.click()
    expect(page.locator(".ring [aria-current]")).to_have_attribute("data-place", to)
    assert page.locator(f"[id='{to}']").is_visible()


def test_without_script(chart, browser):
    """Without scripts all panels are there to read."""
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(chart.as_uri())
    assert page.locator(".panel:visible").count() == page.locator("[data-place]").count()
    context.close()


def test_roles_filter(store, pages, page):
    """The gallery shows the cards of one role, together with the other filters."""
    page.goto(page_of(pages, "behaviours", richest(store)).as_uri())
    cards = page.locator(".card:visible")
    rare = cards.count()
    page.fill("[data-least]", "1")
    assert rare < cards.count(), "what was seen fewer than five times is shown when it is asked for"
    everything, roles = cards.count(), page.locator("[data-is] option").all_inner_texts()[1:]
    counts = {}
    for role in roles:
        page.select_option("[data-is]", role)
        assert set(cards.evaluate_all("all => all.map(each => each.dataset.role)")) == {role}
        counts[role] = cards.count()
    assert sum(counts.values()) == everything
    assert len(roles) > 1
    page.fill("[data-filter]", "no such words")
    assert cards.count() == 0
