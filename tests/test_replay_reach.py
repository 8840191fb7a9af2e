"""The replay page by fingers, with less motion, on small screens, and for those who cannot see it."""

import re
from pathlib import Path

import polars as pl
import pytest
from support.handmade import derived, handmade
from support.league import serious
from support.recordings import INSPER, SSL, imported
from test_replay import MS, make
from test_replay import trajectories as samples
from test_replay_finds import opened, replay, shown  # noqa: F401 (fixtures)

from pitchlore.pipeline.views.commentary import commentary
from pitchlore.pipeline.views.replay import page as replay_page
from pitchlore.schemas import Goals, Referee

#: Play that stops from 0.4 to 0.9 s.
STOPPAGE = samples([
    (t, team, robot, 0.1, 0.1, 0.0, 0 if t <= 400 else 1 if t >= 900 else None)
    for t in range(0, 2000, 100) for team, robot in (("ball", None), ("home", 1))])


def whole(name: str, folder: Path) -> str:
    """Address of the stand-alone page of a recording, with all that is made from it."""
    log = imported(name)
    match = handmade(log.info.pitch, **derived(log))
    path = folder / "replay.html"
    path.write_text(replay_page(match, reported=commentary(match).sentences()))
    return path.as_uri()


def test_fingers(replay, browser):  # noqa: F811
    """Two fingers zoom and move the time line; one that taps or drags seeks; buttons are 40 pixels."""
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    phone = context.new_page()
    at = opened(phone, f"{replay}#t=5&paused")
    low = phone.locator("#controls button:visible").evaluate_all(
        "all => Math.min(...all.map(each => Math.min(each.offsetHeight, each.offsetWidth)))")
    assert low >= 40
    box = phone.locator("#timeline").bounding_box()
    y, send = box["y"] + 60, context.new_cdp_session(phone)

    def touch(kind: str, *xs: float) -> None:
        send.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [
            {"x": box["x"] + x, "y": y, "id": n} for n, x in enumerate(xs)]})

    before = phone.locator("#timeline").evaluate("canvas => canvas.toDataURL()")
    touch("touchStart", 200.0)
    touch("touchStart", 200.0, 260.0)
    for grown in (10.0, 20.0, 40.0):
        touch("touchMove", 200.0 - grown, 260.0 + grown)
    touch("touchEnd")
    assert shown(phone) == at, "zooming does not seek"
    assert phone.locator("#timeline").evaluate("canvas => canvas.toDataURL()") != before
    phone.touchscreen.tap(box["x"] + 300, y)
    assert shown(phone) != at
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390
    context.close()


def test_motion(replay, browser):  # noqa: F811
    """A user who wants less motion has to begin it: the control plays by itself."""
    for motion, playing in (("reduce", False), ("no-preference", True)):
        context = browser.new_context(reduced_motion=motion)
        own = context.new_page()
        first = opened(own, f"{replay}#t=5")
        own.wait_for_timeout(400)
        assert (shown(own) != first) == playing
        context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["scout", SSL, INSPER])
def test_for_everybody(replay, page, tmp_path, name, scheme):  # noqa: F811
    """Axe finds nothing serious in any league's page, all fits a small screen, and nothing is wider than a phone."""
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    opened(page, (replay if name == "scout" else whole(name, tmp_path)) + "#t=20")
    box = page.locator("#timeline").bounding_box()
    assert box["height"] > 100
    assert box["y"] + box["height"] <= 768
    if page.locator("#goals button").count():
        goal = page.locator("#goals button").first.bounding_box()
        assert goal["y"] + goal["height"] <= 768
    page.locator("#panel summary").click()
    assert serious(page, scheme) == []
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    if name == "scout":
        way, team = (page.locator(each).bounding_box() for each in ("header nav", "#home"))
        assert way["y"] + way["height"] <= team["y"], "the way back does not lie on the team's name"


def test_words_behind_the_pitch(replay, page):  # noqa: F811
    """Where robots and ball are stands in words, too."""
    opened(page, f"{replay}#t=5&paused")
    places = page.locator("#now .unseen").all_text_contents()
    assert len(places) == page.locator("#now .now").count() + 1
    assert all(re.search(r"at x -?\d+\.\d\d m, y -?\d+\.\d\d m|not seen", each) for each in places)
    assert any(each.startswith("ball, at") for each in places)


@pytest.mark.slow
def test_banner_of_a_goal(page, tmp_path):
    """A goal's banner is there while its stoppage lasts, not over the play that follows, nor where a clip begins later."""
    goals = pl.DataFrame([("m-1", 450 * MS, "home", 1, "direct", "referee", None)], schema=Goals.dtypes(), orient="row")
    (tmp_path / "replay.html").write_text(make(STOPPAGE, goals=goals))
    page.add_init_script("window.drawn = []; const fill = CanvasRenderingContext2D.prototype.fillText;"
                         "CanvasRenderingContext2D.prototype.fillText = function (text, ...at) { drawn.push(text); fill.call(this, text, ...at); }")
    for t, banner in ((0.6, True), (1.0, False), (0.3, False)):
        opened(page, f"{(tmp_path / 'replay.html').as_uri()}#t={t}&paused")
        assert page.evaluate("drawn.some((text) => String(text).startsWith('Goal for Blues'))") == banner
    later = "decode(document.getElementById('payload').textContent).then(understand).then((m) => [m.goalAt(600, 0), m.goalAt(600, 500)])"
    first, second = page.evaluate(later)
    assert first["stopped"]
    assert second is None


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_score_that_nobody_knows(page, tmp_path, known):
    """A score that nobody reported is counted from the goals that were found, and said so; one that is reported is shown."""
    goals = pl.DataFrame([("m-1", 450 * MS, "home", 1, "direct", "ball", 0.95)], schema=Goals.dtypes(), orient="row")
    scores = ((0, 0), (1, 0)) if known else ((None, None), (None, None))
    referee = pl.DataFrame([("m-1", t * MS, event, team, *score, None) for (t, event, team), score in zip(
        ((0, "play", None), (450, "goal", "home")), scores, strict=True)], schema=Referee.dtypes(), orient="row")
    (tmp_path / "replay.html").write_text(make(STOPPAGE, goals=goals, referee=referee))
    for t, reported in ((0.2, "0 : 0"), (1.0, "1 : 0")):
        opened(page, f"{(tmp_path / 'replay.html').as_uri()}#t={t}&paused")
        assert page.locator("#score").text_content() == (reported if known else f"{reported} counted")
        assert page.locator("#goals .code").all_text_contents() == ["1 : 0"], "counted is said once"
