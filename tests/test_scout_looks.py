"""How the scout's pages look and lead about: nothing is squeezed, filters say what is left, pictures say who attacks."""

import json
import re

import polars as pl
import pytest
from support.league import gallery
from test_commentary import KEEPER, rolls, tell
from test_replay import make
from test_scout import text_of

from pitchlore.flows.commands.printing import print_cards
from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.views.card import cards
from pitchlore.pipeline.views.glossary import TERMS
from pitchlore.pipeline.views.replay import linked
from pitchlore.pipeline.views.scout import words
from pitchlore.pipeline.views.scout.content.chances import size
from pitchlore.pipeline.views.scout.content.flaws import WORDS, flaws
from pitchlore.pipeline.views.scout.content.sources import matches_in_words, played
from pitchlore.pipeline.views.scout.pages import rendered as render
from pitchlore.pipeline.views.scout.pictures import MANY, SINGLE, Mark, on_pitch, pass_arrow, passes_drawn
from pitchlore.pipeline.views.scout.timeline import over_time
from pitchlore.schemas.matches import FLAWS

VSSS = PITCHES[Kind.VSSS]


def test_flaws_are_words():
    """Each kind of flaw has words; samples say of how many."""
    assert set(WORDS) == set(FLAWS)
    table = pl.DataFrame({"flaw": ["gap", "direction inferred", "gap", "truncated"], "count": [1, 90, 1, 1]})
    assert flaws(table, 100) == (
        "direction of attack inferred: 90 of 100 samples; without samples: 2 gaps; file is cut off")
    assert flaws(table.filter(pl.col("count") > 1), 80) == "direction of attack inferred: 90 samples"
    assert flaws(table.head(1), 100) == "without samples: 1 gap"


def test_blank_parts_and_times():
    """Blank parts of a strip are one box each with its words; times are under it; the end has none."""
    drawn = str(over_time([0.5, None, None, None, None, 1.0, None, 0.0], [], "possession", 480.0, "nobody <had> it"))
    assert drawn.count('class="blank"') == 2
    assert drawn.count("nobody &lt;had&gt; it</span>") == 1, "one is too narrow for words"
    assert re.findall(r">(\d+:\d\d)<", drawn) == [f"{minute}:00" for minute in range(8)]
    assert "blank" not in over_time([0.5, 0.5], [], "possession", 480.0, "nobody")


@pytest.mark.parametrize("far", [0.5, 0.02, 0.0])
def test_passes_have_heads(far):
    """A pass leads to its receipt, and a short one has a head, too."""
    row = {"x": 0.0, "y": 0.0, "to_x": far, "to_y": 0.0, "robot": 1, "receiver": 2}
    drawn = on_pitch(VSSS, "passes", marks=[pass_arrow(row, "home", VSSS)])
    assert ('<path class="head"' in drawn) == ('<g class="mark home">' in drawn) == (far > 0)


def test_marks_make_no_layers(pages):
    """No mark has an opacity of its own, but fill and line have: a hundred layers tint the dark ground below them."""
    style = (pages.first.parent / "scout.css").read_text()
    rules = re.findall(r"([^{}]*\.(?:mark|many)\b[^{}]*)\{([^{}]*)\}", style)
    assert sum("stroke-opacity" in rule for _, rule in rules) > 3
    assert not [each for each in rules if re.search(r"(?<!-)\bopacity:", each[1])]


def test_many_passes_are_ways():
    """Few passes have an arrow each; of many one stands for all from part to part, wider for more, and what is left out is said."""
    each = {"y": 0.0, "to_y": 0.0, "robot": 1, "receiver": 2}
    few = pl.DataFrame([{"x": -0.6, "to_x": 0.6} | each] * SINGLE)
    marks, says = passes_drawn(few, "home", VSSS)
    assert (len(marks), says) == (SINGLE, "Arrows lead from pass to receipt.")
    many = pl.concat([few, pl.DataFrame([{"x": -0.7, "to_x": 0.7} | each, *[{"x": 0.6, "to_x": 0.1} | each] * 2, {"x": 0.0, "to_x": -0.6} | each])])
    (wide, thin), says = passes_drawn(many, "home", VSSS)
    assert (wide.says, thin.says) == (f"{SINGLE + 1} passes", "2 passes"), "the mean of near ones"
    assert wide.to[0] == pytest.approx((0.6 * SINGLE + 0.7) / (SINGLE + 1))
    assert wide.width > 5 * thin.width > 0
    assert says.endswith("Passes of rarer ways are left out: 1.")
    assert 'style="stroke-width:' in on_pitch(VSSS, "passes", marks=[wide])


def test_shots_do_not_pile_up():
    """Marks of shots are smaller where there are many; their areas go on to grow with xG."""
    assert size(0.5, 40) == size(0.5, 3) == pytest.approx(2 * size(0.5, 160))
    assert size(0.5, 160) > size(0.1, 160) > 0
    assert size(None, 1) == 1.1


def test_many_marks_are_faint():
    """Many marks are drawn thin; few are not."""
    for count in (MANY - 1, MANY):
        drawn = on_pitch(VSSS, "shots", marks=[Mark(0, 0, "mark home", "")] * count)
        assert ("pitch many" in drawn) == (count == MANY)


def test_marks_are_in_the_table(store, pages):
    """The table behind a picture has the links of its marks."""
    match = next(iter(store.receipts("matches"))).name
    shown = text_of(pages, f"matches/{match}.html")
    marks = re.findall(r'<a href="([^"]*)"><title>[^<]+</title><circle', shown)
    rows = re.findall(r'<td><a href="([^"]*)">', shown)
    assert marks
    assert set(marks) <= set(rows)


def test_every_picture_says_who_attacks(store, pages):
    """Each pitch on the pages of matches and teams stands with a sentence on the direction."""
    root = pages.first.parent
    for found in [*(root / "matches").glob("*.html"), *(root / "teams").glob("*.html")]:
        parts = found.read_text().split('<svg class="pitch')[1:]
        assert len(parts) > 4
        for part in parts:
            assert re.search(r"to the right", part.partition("</svg>")[2][:400]), found.name


def test_one_match_is_no_number():
    """The report on one match says so."""
    facts = {"team": {"name": "a", "kind": "vsss", "slug": "a"}, "behaviours": [], "worse": [], "sentences": [], "menu": [], "made": "", "known": False, "card": None}
    for matches, said in ((1, "last match ·"), (3, "last 3 matches ·"), (11, "last 11 matches ·")):
        assert f"from its {said}" in render("opponent", **facts, counted=matches_in_words(matches, 0)).decode()


def test_replay_leads_back(pages):
    """A replay in the scout leads to its match and the league; a stand-alone one, of the same page, does not."""
    found = next((pages.first.parent / "replays").iterdir())
    links = re.findall(r'<a href="([^"]*)"', found.read_text())
    assert links == [f"../matches/{found.name}", "../index.html"]
    assert all((found.parent / link).exists() for link in links)
    assert "<nav" not in make()
    assert "{{" not in linked("m", "a", "b")


def test_matches_name_their_teams(pages):
    """Goals, commentary, shots and captions of a match name the teams, and each goal says its shot."""
    for found in (pages.first.parent / "matches").iterdir():
        shown = found.read_text()
        home, away = re.search(r"<title>(.*) – (.*) · Pitchlore", shown).groups()
        said = re.findall(r'<a href="[^"]*">\d+:\d\d</a> (.*)', shown)
        assert said
        assert not [each for each in said if re.search(r"\b(home|away) \d", each)]
        assert set() < set(re.findall(r'</a><td class="(?:home|away)">(.*?)<td>', shown)) <= {home, away}
        assert set(re.findall(r'aria-label="[^"]*robot \d+ of ([^,"]*),', shown)) <= {home, away}
        goals = re.findall(r'<li id="goal-\d+">.*?</figure>', shown, re.DOTALL)
        assert len(goals) == shown.count('<figure class="clip"')
        assert all(re.search("no shot|shot from", goal) for goal in goals)


def test_bar_is_of_who_acts():
    """A save begins with the shot, and an error with who errs: the commentary's bar is of that team."""
    (save,) = [it for it in tell({"ball": rolls(0.64), **KEEPER}).moments if it.kind == "save"]
    assert (save.team, save.actor) == ("away", "home")


def test_numbers_of_things():
    """One is singular, names within a phrase are small, and the paper's slip is spelt right."""
    assert (number_of(1, "goal"), number_of(0, "goal"), number_of(1200, "shot")) == ("1 goal", "0 goals", "1,200 shots")
    assert words.said([47, 78, 21]) == "ball hits the robot, then orients to its own goal, then kicks the ball"
    assert words.of_behaviour("striker-001-021") == "Has ball → kicks ball"
    longest = max(words.TITLES.values(), key=lambda title: len(title.split()))
    assert len(f"striker: {' → '.join([longest] * 4)}".replace("→", "").split()) <= 10
    assert len({*words.TITLES.values()}) == len(words.TITLES), "no two situations have one title"


def test_few_goals(store, pages, capsys):
    """Each page that shows V, or what follows from it, and the card in the terminal say that the league has few goals; no other does."""
    goals = store.receipt("models", "all").details["report"]["vsss"]["goals"]
    for found in pages.first.parent.rglob("*.html"):
        follows = found.parent.name in {"matches", "teams", "behaviours", "maps", "against", "policies"} or found.stem in {"index", "compare"}
        assert (f"Few goals: {goals} goals in vsss so far" in found.read_text()) == follows, found
    assert goals < 10
    told = cards(store)
    print_cards(told)
    assert capsys.readouterr().out.count(f"Few goals: {goals} goals in vsss so far") == 1 < len(told)


def test_one_list_of_words(pages):
    """The page of words has each word of the list, and the scripts have its meaning once."""
    shown = (pages.first.parent / "words.html").read_text()
    assert re.findall(r'<dt id="([\w-]+)">', shown) == [term.key for term in TERMS]
    for script in ("scout.js", "replay.js"):
        text = (pages.first.parent / script).read_text()
        assert all(text.count(json.dumps(term.means, ensure_ascii=False)) == 1 for term in TERMS)


# ---- in a browser


#: Words that pages of a kind explain where they stand, at least.
EXPLAINED = {
    "index": {"pressing", "possession", "shots"}, "matches": {"v", "possession", "xg", "pressing", "phase", "ppda", "beyond", "goals"},
    "teams": {"possession", "xg", "pressing", "phase", "ppda", "interval"}, "behaviours": {"went-with", "support", "value", "n"},
    "maps": {"gram", "neuron", "v", "value", "instance"}, "against": {"v", "went-with", "pressing", "shots"},
    "compare": {"value", "v", "support", "possession"}, "policies": {"policy", "state", "value"},
    "situations": {"situation"}, "words": {"v"}, "replays": {"goals"}}


def test_words_are_explained(pages, page, tmp_path):
    """Each kind of page marks its words. A meaning is shown at its word, inside the window, by pointer and by keyboard."""
    root = pages.first.parent
    for name, least in EXPLAINED.items():
        page.goto((gallery(pages) if name == "behaviours" else next(iter(sorted((root / name).glob("*.html"))), root / f"{name}.html")).as_uri())
        page.locator(".term, [data-term]").first.wait_for(state="attached")
        assert least <= set(page.locator("[data-term]").evaluate_all("all => all.map((it) => it.dataset.term)")), name
    page.set_viewport_size({"width": 390, "height": 600})
    page.goto(next((root / "matches").glob("*.html")).as_uri())
    bubble, means = page.locator("#meaning"), {term.key: term.means.replace("`", "") for term in TERMS}
    page.locator("main").focus()
    for _ in range(60):
        page.keyboard.press("Tab")
        if key := page.evaluate("document.activeElement.dataset.term"):
            break
    assert means[key] in bubble.inner_text()
    page.keyboard.press("Escape")
    assert not bubble.is_visible()
    page.locator(".term:visible").first.dispatch_event("pointerover", {"bubbles": True})
    assert bubble.is_visible()
    for term in page.locator(".term:visible").all():
        term.focus()
        assert means[term.get_attribute("data-term")] in bubble.inner_text()
        box = bubble.bounding_box()
        assert 0 <= box["x"] <= box["x"] + box["width"] <= 390
        assert 0 <= box["y"] <= box["y"] + box["height"] <= 600
    (tmp_path / "called.html").write_text(f'<nav><a>pressing</a></nav><main>pressing and Support</main><a class="to-top"></a><script src="{(root / "scout.js").as_uri()}"></script>')
    page.goto((tmp_path / "called.html").as_uri())
    page.evaluate("explain(document.querySelector('main'))")
    assert page.locator(".term").all_inner_texts() == ["Support"], "a team is called pressing"


def test_a_tap_explains(pages, browser):
    """On a phone the first tap on a word opens its meaning, and a tap elsewhere closes it."""
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    phone = context.new_page()
    phone.goto(pages.first.as_uri())
    term, bubble = phone.locator(".term:visible").first, phone.locator("#meaning")
    term.tap()
    phone.wait_for_timeout(100)
    assert bubble.is_visible()
    assert bubble.inner_text().endswith(phone.evaluate("WORDS.find(([key]) => key === document.querySelector('.term').dataset.term)[2].replaceAll('`', '')"))
    phone.locator("h1").first.tap()
    assert not bubble.is_visible()
    context.close()


def test_a_phone_folds(pages, page):
    """On a phone tables are folded below the pictures, a link to a part opens it, and a wider window has all open."""
    page.set_viewport_size({"width": 390, "height": 844})
    team = next((pages.first.parent / "teams").glob("*.html")).as_uri()
    page.goto(team)
    folded = page.locator("details.fold")
    assert folded.count() > 4
    assert folded.evaluate_all("all => all.some((it) => it.open)") is False
    assert page.evaluate("document.documentElement.scrollHeight") < 8 * 844
    page.locator(".sections a[href='#numbers']").click()
    page.locator("h2#numbers ~ .folds table").first.wait_for()
    assert folded.evaluate_all("all => all.filter((it) => it.open).length") == 1
    page.set_viewport_size({"width": 1366, "height": 844})
    page.locator("#keeper ~ .folds > table").wait_for()
    assert not folded.count()
    table = page.locator("#matches + .tools + table, #analysis + .folds > table").first
    assert not table.evaluate("it => it.classList.contains('over')"), "it has room"


def test_a_sign_stays_with_its_number(pages):
    """On all pages but the replays a space that does not break stands before a percent sign."""
    texts = [found.read_text() for found in pages.first.parent.rglob("*.html") if found.parent.name != "replays"]
    assert sum(text.count("\u00a0%") for text in texts) > 50
    assert not [text for text in texts if re.search(r"\d %", text)]


def test_menus_begin_with_the_newest(store, pages, page):
    """Menus of all pages have the newest match's teams first; the pages themselves do not say which."""
    newest = list(played(store))[-1]
    for found in (pages.first, next((pages.first.parent / "matches").glob("*.html")), pages.first.parent / "situations.html"):
        page.goto(found.as_uri())
        for menu, folder in (("nav", "teams"), ("nav .menu div", "against")):
            links = page.locator(f"{menu} > a[href*='{folder}/']").evaluate_all("all => all.map((it) => it.getAttribute('href').split('/').at(-1))")
            assert links[:2] == [f"{team.slug}.html" for team in (newest.home, newest.away)]
            assert len({*links}) == len(links) > 2


def test_panels_have_room(pages, page):
    """On a desktop a map's panel is wide, the page is not endless, and no sign lies on its count."""
    for found in (pages.first.parent / "maps").glob("*.html"):
        page.goto(found.as_uri())
        if not page.locator(".panel:visible").count():
            continue
        for panel in page.locator(".panel:visible").all():
            assert panel.bounding_box()["width"] > 400
        for around in page.locator(".around > .map, .around > .ring").all():
            assert around.bounding_box()["width"] > 300
        assert page.evaluate("document.documentElement.scrollHeight") < 9000
        over = """firsts => firsts.filter((it) => {
            const range = document.createRange(), [count, sign] = it.children;
            range.selectNodeContents(count);
            const [a, b] = [range.getBoundingClientRect(), sign.getBoundingClientRect()];
            return b.width && a.right > b.left && a.bottom > b.top;
        }).length"""
        for width in (1366, 390):
            page.set_viewport_size({"width": width, "height": 768})
            assert page.locator(".cell .first").evaluate_all(over) == 0
        page.set_viewport_size({"width": 1366, "height": 768})


def test_filters_say_what_is_left(pages, page):
    """Each filtered page says how many are shown, and says so if there are none."""
    root = pages.first.parent
    for found in (pages.first, gallery(pages), root / "situations.html"):
        page.goto(found.as_uri())
        said = page.locator(".shown[role=status]")
        assert re.fullmatch(r"(\d+) of \1 shown|\d+ of \d+ cards, \d+ of \d+ rows shown", said.inner_text())
        page.fill("[data-filter]", "no such thing")
        assert re.fullmatch(r"Nothing fits the filter: 0 of \d+( cards, 0 of \d+ rows)? shown\.", said.inner_text())
        page.wait_for_load_state("networkidle")  # a clip's data that still load would count as failed


def test_keys(pages, page):
    """The first Tab leads to the content; of a card's clips one is a Tab stop, and arrow keys lead on."""
    page.goto(pages.first.as_uri())
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "main"
    page.goto(gallery(pages).as_uri())
    card = next(it for it in page.locator(".clips").all() if it.locator("canvas").count() > 2)
    assert card.locator('canvas[tabindex="0"]').count() == 1
    card.locator("canvas").first.focus()
    page.keyboard.press("ArrowRight")
    second = card.locator("canvas").nth(1)
    assert second.evaluate("it => it === document.activeElement")
    assert (second.get_attribute("role"), second.get_attribute("aria-pressed")) == ("button", "false")
    page.keyboard.press("Space")
    assert second.get_attribute("aria-pressed") == "true"
    page.goto(next(it for it in (pages.first.parent / "matches").glob("*.html") if "><title>" in it.read_text()).as_uri())
    for pitch in page.locator("svg.pitch:has(a)").all():
        assert pitch.locator('a[tabindex="0"]').count() == 1, "the marks of a picture are one Tab stop"


def test_words_that_there_are(pages, page):
    """Where nothing fits, the page says which words there are, and each of them fills the filter."""
    page.goto(gallery(pages).as_uri())
    words = page.locator(".phrases button")
    assert not words.first.is_visible()
    page.fill("[data-filter]", "no such thing")
    said = words.all_inner_texts()
    assert len(said) == len(set(said)) > 2
    words.nth(1).click()
    assert page.input_value("[data-filter]") == said[1]
    assert page.locator("#rows tr:visible").count() > 0
    assert not words.first.is_visible()
    assert all(re.fullmatch(r"Within 10 s, of n = \d+: .*", each) for each in page.locator(".led").all_inner_texts())
    assert page.locator(".led").count() > 0
    page.wait_for_load_state("networkidle")


def test_behaviours_fold(pages, page, tmp_path):
    """A few of many cards are shown; a filter looks through all, a link opens its own, and a button all."""
    html = gallery(pages).read_text()
    cut = html.index('<article class="card"'), html.index("</article>") + len("</article>")
    many = "".join(html[slice(*cut)].replace('<h2 id="', f'<h2 id="again-{i}-') for i in range(20))
    (tmp_path / "behaviours").mkdir()
    for each in ("scout.js", "scout.css", "data"):
        (tmp_path / each).symlink_to(pages.first.parent / each)
    found = tmp_path / "behaviours" / "many.html"
    many = many.replace('data-support="', 'data-support="9')  # often enough to be shown
    found.write_text(html.replace('<div id="cards" data-few="12">', f'<div id="cards" data-few="12">{many}'))
    page.goto(found.as_uri())
    cards, seen = page.locator(".card"), page.locator(".card:visible")
    every = cards.count()
    often = sum(int(card.get_attribute("data-support")) >= 5 for card in cards.all())
    assert every > often > 20
    assert seen.count() == 12
    name = cards.last.locator("h2").get_attribute("id")
    last = page.locator(f".card:has(h2[id='{name}'])")
    page.fill("[data-filter]", name)
    assert not last.is_visible(), "it was seen fewer than five times"
    page.fill("[data-least]", "1")
    assert last.is_visible()
    page.fill("[data-filter]", "")
    assert not last.is_visible()
    page.goto("about:blank")
    page.goto(f"{found.as_uri()}#{name}")
    assert last.is_visible()
    assert often < seen.count() <= every
    page.goto("about:blank")
    page.goto(found.as_uri())
    page.get_by_role("button", name=f"Show all {every} cards").click()
    assert seen.count() == often
    card = next(it for it in cards.all() if it.locator("details").count())
    assert card.locator("canvas:visible").count() == 4
    page.wait_for_load_state("networkidle")


@pytest.mark.parametrize(("width", "share"), [(1366, 0.5), (390, 0.46)])
def test_wide_tables(pages, page, width, share):
    """A table that is wider than its place says so, and its first column stays in sight, with whole words."""
    page.set_viewport_size({"width": width, "height": 844})
    for folder in ("teams", "matches"):
        page.goto(next((pages.first.parent / folder).glob("*.html")).as_uri())
        page.evaluate("document.querySelectorAll('details').forEach((it) => { it.open = true; })")
        page.evaluate("document.querySelectorAll('main table').forEach((it) => { it.style.maxWidth = '360px'; })")
        page.locator("table.over").first.wait_for()
        for table in page.locator("table.over").all():
            hint = table.evaluate("it => it.previousElementSibling.textContent")
            assert "scroll it" in hint
            assert table.evaluate("it => getComputedStyle(it.previousElementSibling).display") != "none"
            left = table.evaluate("it => { it.scrollLeft = 90; return it.getBoundingClientRect().left; }")
            first = table.locator("tbody tr > :first-child").first
            assert first.bounding_box()["x"] == pytest.approx(left, abs=1)
            assert first.bounding_box()["width"] <= share * width
            assert first.evaluate("it => it.scrollWidth <= it.clientWidth + 1"), "no word is cut"
            clear = first.evaluate("it => getComputedStyle(it).backgroundColor")
            assert clear not in {"rgba(0, 0, 0, 0)", "transparent"}, "what scrolls beneath is not seen"


def test_way_to_the_top(pages, page):
    """The way to the top covers nothing, and is not on pages that do not scroll."""
    match = next((pages.first.parent / "matches").glob("*.html")).as_uri()
    over = """() => {
        const way = document.querySelector(".to-top").getBoundingClientRect(), main = document.querySelector("main").getBoundingClientRect();
        return way.left < main.right && way.top < main.bottom && way.bottom > main.top;
    }"""
    for width in (390, 1366, 1500, 1920):
        page.set_viewport_size({"width": width, "height": 768})
        page.goto(match)
        page.locator(".to-top").wait_for()
        assert not page.evaluate(over)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.goto((pages.first.parent / "policies.html").as_uri())
    page.locator(".to-top").wait_for(state="hidden")


def test_nothing_is_cut(pages, page):
    """The running of robots has room beside other tables, tables one below the other do not touch, and a long goal is read on a phone."""
    page.set_viewport_size({"width": 1366, "height": 900})
    for found in (pages.first.parent / "teams").glob("*.html"):
        page.goto(found.as_uri())
        page.evaluate("document.querySelectorAll('.flows details').forEach((it) => { it.open = true; })")
        running = page.locator(".flows details table")
        assert page.locator(".flows details summary").first.inner_text().endswith(("over 1 match as a table", "over 2 matches as a table"))
        assert running.evaluate_all("them => them.every((it) => it.scrollWidth <= it.clientWidth)")
        gaps = page.evaluate("""[...document.querySelectorAll("table ~ table")].filter((it) => it.checkVisibility()).map((it) => it.getBoundingClientRect().top
            - [...it.parentNode.querySelectorAll(":scope > table")].filter((each) => each.compareDocumentPosition(it) & 4).at(-1).getBoundingClientRect().bottom)""")
        assert min(gaps, default=9) > 8
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto((pages.first.parent / "index.html").as_uri())
    assert not page.get_by_text("Where the ball was").first.is_visible()
    page.goto(next((pages.first.parent / "replays").iterdir()).as_uri() + "#paused")
    told = page.locator("#told span")
    told.wait_for(state="attached")
    page.evaluate("document.querySelector('#told span').textContent = 'GOAL for Foxes! Foxes 2 (midfield), indirect action: is hit by the ball, reaches it, has it, guides it; it goes in off Wolves 1 (goalkeeper).'")
    assert told.evaluate("it => it.scrollHeight <= it.clientHeight && it.getBoundingClientRect().bottom <= innerWidth * 3")
    assert told.evaluate("it => it.getBoundingClientRect().bottom <= it.parentNode.getBoundingClientRect().bottom")


def test_policies_that_copy():
    """Policies that all copy have no column of states."""
    rows = [{"version": 1, "team": None, "slug": "all", "told": False, "states": states, "unsure": None} for states in (None, 7)]
    for some, there in ((rows[:1], False), (rows, True)):
        assert ("<th class=\"n\">States</th>" in render("policies", rows=some, menu=[], made="").decode()) == there
