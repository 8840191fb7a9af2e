"""The scout's pages of policies, its situations by kind of pitch, and its restarts: in tables and in a browser."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.league import copied, serious
from support.looking import pairs_of
from support.played import looking
from test_scout import test_links_lead_somewhere, test_nothing_but_text, text_of  # noqa: F401 (here of policies, too)

from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.face.versions import Knowledge
from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind
from pitchlore.pipeline.settings import KnowledgeSettings, PolicySettings, Settings, SituationSettings
from pitchlore.pipeline.stages.situations import fuzzy
from pitchlore.pipeline.stages.situations.rulebook import term_table, terms_used
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.pipeline.state import encode
from pitchlore.pipeline.state.table import LEVELS
from pitchlore.pipeline.state.words import elements_of, levels_in_words
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made
from pitchlore.pipeline.views.scout.content.policies import newest_policies
from pitchlore.pipeline.views.scout.content.sources import played
from pitchlore.pipeline.views.scout.content.write import WrittenPages, write_pages
from pitchlore.pipeline.views.scout.curves import TermCurve, term_chart
from pitchlore.pipeline.views.scout.preferred import actions_of, preference_picture, preferred
from pitchlore.pipeline.views.scout.states import around_ball, sentences, zone
from pitchlore.schemas import KEYS, ROLES, Appraisals, Policies, Referee, Restarts, States
from pitchlore.schemas.sights import SIGHT

VSSS = PITCHES[Kind.VSSS]
COARSER = Settings(knowledge=KnowledgeSettings(backoff=("self9", "self6", "role0")), policies=PolicySettings(learner="sarsa"))


def learn(store: Store) -> None:
    """A policy by several keys."""
    scope = scope_of(store)
    for noun in ("knowledge", "policies"):
        emit(store, STAGES[noun], STAGES[noun].settings(COARSER), scope)


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> Store:
    made = copied(tmp_path_factory)
    learn(made)
    return made


@pytest.fixture(scope="module")
def pages(store) -> WrittenPages:
    return write_pages(store)


def policy_page(pages: WrittenPages) -> str:
    (found,) = (pages.first.parent / "policies").glob("*.html")
    return found.read_text()


# ---- states in sentences and pictures


@given(st.sampled_from(KEYS), st.sampled_from(ROLES), st.tuples(*(st.integers(0, int(n) - 1) for n in LEVELS)))
@settings(max_examples=150)
def test_every_state_is_told(key, role, levels):
    """Each state has sentences; what the key does not keep is not said, and pictures are there where it is kept."""
    slot = ROLES.index(role)
    state = encode(np.array([levels], dtype=np.uint8), key, np.array([slot]))
    words = levels_in_words(elements_of(state, key, slot)[0].to_list())
    reported = " ".join(sentences(words, role))
    assert ("We lead" in reported, "It is level" in reported, "We trail" in reported).count(True) == ("score" in words)
    assert ("Play is" in reported) == ("game situation" in words)
    assert (zone(words, VSSS) is None) == ("distance of ball to own goal" not in words)
    assert (around_ball(words, role, VSSS) is None) == (f"distance of own {role} to ball" not in words)
    assert reported.count("(decides)") <= 1
    if key == "role0":
        assert reported == "Any state: the key keeps nothing of it."


def test_sentences():
    """A state reads as a coach would say it."""
    words = {
        "distance of own striker to ball": "near", "orientation of own striker to ball": "front",
        "own striker in relation to ball and its own goal": "before",
        "orientation of own striker to its adversary's goal": "pointing", "distance of ball to own goal": "far",
        "distance of ball to adversary's goal": "very close", "ball direction": "45 degrees", "ball velocity": "fast",
    }
    assert sentences(words, "striker") == [
        "The ball is far from our goal and very close to their goal, is fast, last moved ahead to the left.",
        "Our striker (decides) is near the ball, is goal-side of it, faces it, points at its adversary's goal."]


@pytest.mark.parametrize("kind", list(Kind))
def test_zones_share_the_pitch(kind):
    """The zones of all levels cover the pitch, and none covers another; the centre spot, close to both goals, is drawn."""
    pitch, area = PITCHES[kind], 0.0
    for own in ("very close", "close", "far"):
        for their in ("very close", "close", "far"):
            drawn = str(zone({"distance of ball to own goal": own, "distance of ball to adversary's goal": their}, pitch))
            assert ("spot" in drawn) == (own == their == "close")
            runs = re.findall(r"M[-\d.]+ [-\d.]+h([\d.]+)v([\d.]+)", re.search('class="zone"[^>]*', drawn)[0])
            area += sum(float(wide) * float(high) for wide, high in runs)
    assert area == pytest.approx(pitch.length * pitch.width, rel=0.02)


# ---- the page of a policy


def test_counts_are_those_of_the_table(store, pages):
    """The page's counts are those of the table states, its shares of known decisions those of the knowledge."""
    states = store.read_table(store.latest("policies"), "states", States)
    shown = policy_page(pages)
    known = Knowledge(store, store.latest("knowledge")).known
    assert len(known) == 4
    assert [f"{float(share):.1f} {key}" for share, key in re.findall(
        r"([\d.]+)\s%(?: were in a state that is known)? by (\w+)", shown)] == [
            f"{round(100 * share):.1f} {key}" for key, share in known.items()]
    for (key, role), rows in states.group_by("key", "role"):
        row = re.search(rf"<td>{key}</td><td>{role}</td>(.*?)</tr>", shown)[1]
        cells = re.findall(r">([^<]*)</td>", row)
        counts = [rows.filter(pl.col("verdict") == verdict).height for verdict in ("few", "close", "sure")]
        assert cells[1:6] == list(map(str, [rows.height, rows["visits"].sum(), *counts]))
    assert f"of {states.height} states" in shown


def test_states_are_in_words(store, pages):
    """No page shows a state by its number alone: each card has its sentence, and its candidates in words."""
    shown = policy_page(pages)
    cards = re.findall(r'<article class="card" data-role.*?</article>', shown, re.DOTALL)
    assert len(cards) > 10
    for card in cards:
        assert re.search(r"<p>(The ball|Any state|Our)", card)
        assert "<td class=\"wraps\">" in card
    top = store.read_table(store.latest("policies"), "states", States).filter(
        pl.col("verdict").is_in(["few", "close"]), pl.col("key") == "self6", pl.col("role") == "striker",
    ).sort("visits", "state", descending=[True, False]).row(0, named=True)
    numbers = store.read_table(store.latest("policies"), "states", States)["state"]
    assert not {str(each) for each in numbers if each > 10**6} & set(re.findall(r"\d+", re.sub(r"<[^>]*>", " ", shown)))
    words = elements_of(np.array([top["state"]]), "self6", ROLES.index("striker"))[0].to_list()
    assert sentences(levels_in_words(words), "striker")[0] in shown


def test_what_stands_is_kept(store, tmp_path):
    """A second call writes nothing but a page that is missing; a new policy has its pages written, and no page of a match."""
    shutil.copytree(store.root, tmp_path / "data", ignore=shutil.ignore_patterns("scout"))
    own = Store(tmp_path / "data")
    write_pages(own)
    assert write_pages(own).new == 0
    next((own.root / "scout" / "matches").iterdir()).unlink()
    assert write_pages(own).new == 1, "what is missing is written again"
    other = COARSER.policies.model_copy(update={"discount": 0.9})
    emit(own, STAGES["policies"], other, scope_of(own))
    assert write_pages(own).new == 2
    assert "version 2" in (tmp_path / "data" / "scout" / "policies.html").read_text()
    assert "times 0.9 for" in next((tmp_path / "data" / "scout" / "policies").iterdir()).read_text()


def test_older_policy(store, tmp_path, call):
    """A policy that was trained before states were kept says so; the next run makes one that has them."""
    shutil.copytree(store.root, tmp_path / "data", ignore=shutil.ignore_patterns("scout", "policies"))
    own = Store(tmp_path / "data")
    stage = STAGES["policies"]

    def before(inputs, chosen):
        made = stage.compute(inputs, chosen)
        return Made(made.tables[:1], details=made.details)

    older = replace(stage, compute=before, schemas=(Policies,), version=2)
    emit(own, older, COARSER.policies, scope_of(own))
    page = policy_page(write_pages(own))
    assert "trained before" in page
    assert not [it for it in newest_policies(own, list(played(own))) if it.reported]
    code, _, err = call("policy", "show", "--data", own.root)
    assert (code, "pitchlore train" in err) == (1, True)
    manifest, new = emit(own, stage, COARSER.policies, scope_of(own))
    assert (manifest.version, new) == (2, True)
    assert "How many states" in policy_page(write_pages(own))


# ---- a policy that looks


def test_preferred():
    """By hand: one action is worth 1 where the ball is ahead, and -1 behind; the other is always worth 0."""
    values = pairs_of(goalkeeper=[], midfield=[], striker=[21, 44])
    node = {"version": 1, "code": 21, "tree": 0, "node": 0, "feature": None, "threshold": None, "missing_left": None,
            "left": None, "right": None, "value": 0.0}
    trees = Appraisals.of([
        node | {"feature": "ball_x", "threshold": 0.0, "missing_left": True, "left": 1, "right": 2},
        node | {"node": 1, "value": -1.0}, node | {"node": 2, "value": 1.0}])
    nowhere = (np.nan, np.nan)
    ball = [(-0.5, 0.1)] * 30 + [(0.5, 0.1)] * 20 + [(0.5, 0.5)] * 9 + [nowhere] * 41  # of which it is taken for behind
    sight = np.zeros((len(ball), len(SIGHT)), np.float32)
    sight[:, [list(SIGHT).index(name) for name in ("ball_x", "ball_y")]] = ball
    sights = pl.DataFrame({"role": ["striker"] * len(ball), "sight": pl.Series(sight, dtype=pl.Array(pl.Float32, len(SIGHT)))})
    found = preferred(values, trees, sights)
    assert found["behaviour_id"].to_list() == ["striker-044"] * 30 + ["striker-021"] * 29 + ["striker-044"] * 41
    assert found["gain"].to_list() == [0.0] * 30 + [1.0] * 29 + [0.0] * 41
    assert actions_of(found).rows() == [("striker-044", "A", 0.71, 0.0), ("striker-021", "B", 0.29, 1.0)]
    drawn = str(preference_picture(found, {"striker-044": "A", "striker-021": "B"}, VSSS, "here"))
    assert re.findall(r">([A-Z])<", drawn) == ["A", "A", "B", "B"]  # nine moments are too few
    assert "B in 100 % of 20 moments" in drawn
    assert preferred(values, trees, sights.clear()).is_empty()
    assert preferred(values, trees, sights.with_columns(role=pl.lit("midfield"))).is_empty()


def test_policy_that_looks(tmp_path, call):
    """The page of a policy that looks says what it prefers where; each letter of a picture is in the table under it.

    The command says that its states do not tell.
    """
    looking(tmp_path)
    (folder,) = (path for path in (tmp_path / "seasons").iterdir() if path.is_dir())
    own = Store(folder)
    page = policy_page(write_pages(own))
    assert "What policy 2 prefers" in page
    assert "unsure" not in page
    for part in page.split("<h2")[1:4]:
        picture_of, table = part.split("<table", 1)
        letters = re.findall(r"<td>([A-Za-z])</td>", table)
        assert set(re.findall(r">([A-Za-z])</text>", picture_of)) <= set(letters)
        shares = [float(each) for each in re.findall(r'<td class="n">([0-9.]+)\s%</td>', table)]
        assert len(letters) == len(shares) > 1
        assert sum(shares) == pytest.approx(100, abs=len(shares))
    assert write_pages(own).new == 0
    code, out, _ = call("policy", "show", "--data", own.root)
    assert (code, "worth most at what it sees. These states decide nothing" in out) == (0, True)


# ---- policies and pages of other matches


def test_of_other_teams(store, tmp_path):
    """Pages of some matches only lead to no team that they leave out."""
    chosen = write_pages(store, tmp_path / "pages", [next(iter(store.receipts("matches"))).name])
    test_links_lead_somewhere(chosen)


def test_no_policy(tmp_path_factory):
    """Without a policy the list says how to get one."""
    own = copied(tmp_path_factory)
    assert "There is no policy yet" in text_of(write_pages(own), "policies.html")
    assert not list((own.root / "scout").glob("policies/*"))


def test_command(store, call):
    """``policy show`` prints states in words, those that were asked for; unknown names are one line."""
    for words in ([], ["--role", "striker", "--key", "self6", "--unsure"]):
        code, out, _ = call("policy", "show", *words, "--json", "--data", store.root)
        rows = json.loads(out)
        assert code == 0
        assert rows
        assert not words or {(row["role"], row["key"]) for row in rows} == {("striker", "self6")}
        assert all(len(row["elements"]) == int(re.sub(r"\D", "", row["key"])) for row in rows)
    assert "distance of ball to own goal: " in call("policy", "show", "--key", "self6", "--most", "1", "--data", store.root)[1]
    code, _, err = call("policy", "show", "--role", "libero", "--data", store.root)
    assert (code, "no role 'libero'" in err) == (1, True)


# ---- restarts


def test_restarts_of_a_team(store, pages):
    """A team's page and the report on it count the same restarts as the table, beside the control."""
    restarts = pl.concat([store.read_table(it, "restarts", Restarts) for it in store.receipts("events")])
    given = pl.concat([store.read_table(it, "referee", Referee) for it in store.receipts("matches")]).filter(
        pl.col("event").is_in(["kick-off", "fault"]))
    assert restarts.height == 2 * given.height > 0
    own = restarts.filter("own", pl.col("team") == "home", pl.col("kind") == "kick-off")
    name = next(it.stem for it in (pages.first.parent / "teams").glob("blue-*"))
    row = re.search(r'<th scope="row">kick-off</th>(.*?)</tr>', text_of(pages, f"teams/{name}.html"))[1]
    shot = own.filter(pl.col("shot_ns") - pl.col("taken_ns") <= 8 * 10**9).height
    assert re.findall(r'"n">([^<]*?)(?: <|<)', row)[:2] == [str(own.height), f"{shot / own.height:.0%}".replace("%", "\u00a0%")]
    assert "control: any moment of play" in text_of(pages, f"teams/{name}.html")
    assert f"kick-off {shot} of {own.height}" in text_of(pages, f"against/{name}.html")


# ---- situations


def test_terms_used():
    """The terms of a situation are those that its rules and their words name."""
    used = terms_used()
    assert set(used["code"].to_list()) == set(TABLE_1) - {194}
    of = {code: set(rows.select("signal", "term").rows()) for (code,), rows in used.group_by("code")}
    assert of[184] == {("speed", "EQUAL"), ("playing_time", "MEDIUM"), ("playing_time", "LONG")}
    assert of[78] == {("own_goal_off_heading", "FACING")}
    assert {("ball_jolt", "MUCH_FASTER"), ("nearest_ball_distance", "CONTACT")} <= of[21], "words are followed"
    for kind in Kind:
        terms = term_table(kind)
        assert used.join(terms, on=["variable", "term"], how="anti").is_empty()


@pytest.mark.parametrize("kind", list(Kind))
def test_curves_are_the_memberships(kind):
    """At each corner of a drawn curve the degree is that of the membership function."""
    table = term_table(kind)
    for (variable,), rows in table.group_by("variable", maintain_order=True):
        lines = [TermCurve(*row) for row in rows.select("term", "a", "b", "c", "d", "rises_at", "falls_at").rows()]
        drawn = str(term_chart(lines, str(variable)))
        corners = [at for line in lines for at in line[1:5] if at is not None]
        low, high = min(corners), max(corners)
        margin = 0.15 * (high - low)
        low, high = (low - margin if low < 0 else 0.0), high if variable in ("orientation", "bearing") else high + margin
        for line, way in zip(lines, re.findall(r'class="line-\d" d="M([^"]*)"', drawn), strict=True):
            trapezoid = fuzzy.terms(SCALES[kind])[fuzzy.Variable(variable)][line.term]
            for point in way.split(" L"):
                x, y = map(float, point.split())
                at = low + (x - 20) / 272 * (high - low)
                near = fuzzy.membership(trapezoid, np.linspace(at - 0.01 * (high - low), at + 0.01 * (high - low), 9))
                assert near.min() - 0.06 <= (74 - y) / 66 <= near.max() + 0.06


def test_situations_by_kind(pages):
    """Each situation has its curves, with units and a table; shares, curves and clips name their kind of pitch."""
    shown = text_of(pages, "situations.html")
    cards = re.findall(r'<article class="card">.*?</article>', shown, re.DOTALL)
    assert len(cards) == len(TABLE_1)
    with_curves = [card for card in cards if '<svg class="curve" ' in card]
    assert len(with_curves) == len(TABLE_1) - 1, "194 has no rule"
    first = cards[0]
    assert "Distance [m], vsss" in first
    assert "Distance [m], 2d" in first
    assert "Bearing [rad], all kinds of pitch" in first
    assert first.count("<details>") == first.count('<svg class="curve" role')
    assert 'data-kinds="vsss"' in first
    assert SituationSettings().fire_at == 0.5, "the curves' numbers are where a term passes one half"


# ---- in a browser


def test_filters(pages, page):
    """A role and a key show their own states only; a kind of pitch its own curves, shares and clips."""
    root = pages.first.parent
    page.goto(next((root / "policies").iterdir()).as_uri())
    visible = page.locator("article.card:visible")
    assert set(visible.evaluate_all("it => it.map(card => card.dataset.key)")) == {"self6"}
    page.select_option("[data-pick=key]", "")
    every = visible.count()
    page.select_option("[data-pick=role]", "striker")
    assert 0 < visible.count() < every
    assert set(visible.evaluate_all("it => it.map(card => card.dataset.role)")) == {"striker"}
    page.goto((root / "situations.html").as_uri())
    curves_seen = page.locator("figure[data-kinds]:visible")
    assert page.locator("[data-pick=kinds]").input_value() == "vsss"
    for kind in ("2d", "human", "ssl", "vsss"):
        page.select_option("[data-pick=kinds]", kind)
        seen = curves_seen.evaluate_all("it => it.map(each => each.dataset.kinds)")
        assert all(kind in kinds.split() for kinds in seen)
        assert {"vsss ssl 2d human"} < set(seen)  # angles and times are those of all kinds, lengths are not
    assert page.locator(".clip:visible").count() > 10
    page.wait_for_load_state("networkidle")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_for_everybody(pages, page, scheme):
    """axe finds nothing serious, nothing is wider than a phone whatever is opened, and no script fails, in both schemes."""
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    root = pages.first.parent
    largest = max((root / "maps").glob("*.html"), key=lambda path: path.stat().st_size)
    for found in (*root.glob("[ipsw]*.html"), *(root / "policies").iterdir(), *(root / "maps").iterdir(), *(
            next((root / folder).glob("*.html")) for folder in ("matches", "teams", "behaviours", "against"))):
        page.goto(found.as_uri())
        if found == largest:
            page.locator(".ring [data-place]").first.click()
        page.set_viewport_size({"width": {"light": 1280, "dark": 390}[scheme], "height": 844})
        assert (found.parent.name == "maps" and found != largest) or serious(page, scheme) == []
        page.set_viewport_size({"width": 390, "height": 844})
        page.locator("details").evaluate_all("all => all.forEach(each => { each.open = true; })")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390, found.name
