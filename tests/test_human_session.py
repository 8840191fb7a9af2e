"""Seasons against a person: games at the window, one now, one later, by injected events and without a screen."""

import json

import numpy as np
import pytest

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.recipe import TeamSettings
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.engine import games as loop
from pitchlore.pipeline.engine.games import done, store_of
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.sessions import human, person
from pitchlore.pipeline.stages.seasons.settings import Season, parse_season
from pitchlore.pipeline.store import Store
from pitchlore.schemas import AWAY, Games

pygame = pytest.importorskip("pygame", reason="pygame-ce is not installed (the extra `play`)")

from support.window import button, key, script, without_pygame  # noqa: E402

from pitchlore.pipeline.arena.window.painting import Picture  # noqa: E402
from pitchlore.pipeline.arena.window.screen import Window  # noqa: E402

pytestmark = pytest.mark.slow

SECONDS = 4
SHORT = f'base = "paper"\ngames = 2\n[referee]\nduration_s = {SECONDS}\n'
OWN = Season(name="short", opponent="person", seed=3, settings=parse_season(SHORT, where="short.toml"))

LEAVE, BEGIN = [pygame.event.Event(pygame.QUIT)], [key(pygame.K_p)]


@pytest.fixture(autouse=True)
def no_screen(monkeypatch):
    """The window is hidden, paints nothing, and closes at the final whistle."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(person, "_FAREWELL_S", 0.0)
    monkeypatch.setattr(Window, "show", lambda *_: None)
    yield
    pygame.quit()


@pytest.fixture
def season(call, tmp_path):
    """Call `pitchlore season --opponent person` on a data folder: exit code, what it says, and its errors."""
    (tmp_path / "short.toml").write_text(SHORT)

    def run(*words):
        return call("season", "--settings", tmp_path / "short.toml", "--opponent", "person", "--seed", 3,
                    "--data", tmp_path / "data", *words)

    return run


def rows(data):
    store = Store(data)
    return store.read_table(done(store, OWN), "games", Games)


def test_one_now_one_tomorrow(season, call, monkeypatch, tmp_path):
    """One game is played now; one is left in the middle and counts nowhere; it is played anew and resumes the season."""
    data = tmp_path / "data"
    opened = script(
        monkeypatch,
        {3: BEGIN, 4: [key(pygame.K_SPACE)]},  # a whole game
        {2: BEGIN, 20: [key(pygame.K_ESCAPE)]}, {1: LEAVE},  # left in the middle; left before it begins
        {3: [button(pygame.CONTROLLER_BUTTON_START)], 4: [button(pygame.CONTROLLER_BUTTON_A)]},
    )
    code, out, _ = season("--now", 1, "--json")
    assert code == 0
    said = json.loads(out)
    assert said["report"]["made"] == ["short-person-3 game 1"]
    assert [row["games"] for row in said["seasons"]] == [1]
    assert len(opened) == 1
    own, before = store_of(data, OWN), rows(data)

    code, out, _ = season()
    assert (code, len(opened)) == (0, 2)
    (part,) = (own.root / "left").iterdir()
    assert f"A game was left before its end. It does not count; its log is {part}." in out
    assert "short-person-3 game 2 of 2 is next: the same command goes on" in out
    assert rows(data).equals(before)
    assert len(list(own.receipts("matches"))) == 1
    left = log.read(part.read_bytes(), where="left")
    assert 15 <= len(left.frames) <= 20
    code, out, _ = season()
    assert (code, len(opened), len(list((own.root / "left").iterdir()))) == (0, 3, 1)

    code, out, _ = season()
    assert (code, len(opened)) == (0, 4)
    assert "is next" not in out
    games = rows(data)
    assert games.head(1).equals(before)
    assert games.select("game", "opponent", "left", "lead").rows() == [(1, "person", 0, 0), (2, "person", 1, 0)]
    assert games["policy_version"].to_list() == [None, 1]
    for number, match in enumerate(games["match_id"], 1):
        label = None if number == 1 else loop.labelled(own, own.manifest("policies", number - 1))[0]
        whole = log.read(own.read(own.receipt("matches", match), "log"), where=match)
        assert (whole.info.home, whole.info.away, whole.info.complete) == ("learned", "human", True)
        assert len(whole.frames) == 60 * SECONDS + 1
        assert whole.info.match_id == OWN.recipes(number, label)[0].match_id
        robots = whole.frames.robots[whole.frames.robots["team"] == AWAY]
        assert np.hypot(robots["vx"], robots["vy"]).max() > 0.9  # Space, or A on the pad; no script of the team drives so fast
    assert season()[0] == 0
    assert len(opened) == 4  # it is over
    assert entrant(Store(data), OWN.id, {}).settings.kind == "learned"


def test_killed_while_learning(season, monkeypatch, tmp_path):
    """A game that was played is not played again if its process was killed while it learned."""
    opened = script(monkeypatch, {1: BEGIN}, {1: LEAVE})
    learn = human.learn_from_game

    def killed(*_):
        raise OSError("killed")

    monkeypatch.setattr(human, "learn_from_game", killed)
    assert season("--now", 1)[0] != 0
    assert Store(tmp_path / "data").receipt("seasons", OWN.id) is None
    monkeypatch.setattr(human, "learn_from_game", learn)
    assert season("--now", 1)[0] == 0
    assert len(opened) == 1
    assert rows(tmp_path / "data")["left"].to_list() == [0]


def test_killed_while_playing(season, monkeypatch, tmp_path):
    """A game whose process was killed while it was played is played anew, and counts as left."""
    opened = script(monkeypatch, {1: LEAVE}, {1: BEGIN})
    own = store_of(tmp_path / "data", OWN)
    match = OWN.recipes(1, None)[0].match_id
    (own.root / "playing").mkdir(parents=True)
    (own.root / "playing" / f"{match}.mcap").write_bytes(b"half a log")
    assert season()[0] == 0
    assert (own.root / "left" / f"{match}-1.mcap").read_bytes() == b"half a log"
    assert season("--now", 1)[0] == 0
    assert len(opened) == 2
    assert rows(tmp_path / "data")["left"].to_list() == [1]


def test_waiting(season, monkeypatch):
    """The window shows which game is next and how it begins, and time stands still until then."""
    shown = []
    monkeypatch.setattr(Window, "show", lambda _, picture: shown.append(picture))
    script(monkeypatch, {50: LEAVE})
    assert season()[0] == 0
    assert len(shown) == 50
    assert {(picture.message, picture.hint) for picture in shown} == {("Game 1 of 2", "P or Start begins")}
    assert {picture.clock_s for picture in shown} == {1 / 60}  # the kick-off, which is painted
    assert isinstance(shown[0], Picture)
    assert shown[0].driven in (4, 5, 6)


@pytest.mark.parametrize(("words", "message"), [
    (("--opponent", "person", "--opponent", "static"), "a person plays one season at a time"),
    (("--opponent", "person", "--seasons", 2), "--seed tells people apart"),
    (("--opponent", "person", "--on", "processes:2"), "a person plays at the window of this machine"),
    (("--opponent", "static", "--now", 2), "only a person plays some games now and some later"),
    (("--opponent", "person", "--settings", "best"),
     ("best-person-1: a person plays no practice matches, and it has 3 beside each game. "
      "Take --settings paper, best-in-games, or a TOML file with practice = 0.\n")),
])
def test_refused(call, tmp_path, words, message):
    """A setting that a person cannot play by is refused in one line, before anything is played."""
    settings = () if "--settings" in words else ("--settings", "paper")
    code, _, error = call("season", *settings, *words, "--data", tmp_path)
    assert code == 1
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "seasons").exists()


def test_no_window(call, monkeypatch, tmp_path):
    """Without pygame or a screen, one line says so, and the game is neither played nor left."""
    words = ("season", "--settings", "paper", "--opponent", "person", "--data", tmp_path)
    with monkeypatch.context() as patch:
        patch.setenv("SDL_VIDEODRIVER", "none-such")
        code, _, error = call(*words)
    assert code == 1
    assert "no window can be opened" in error
    without_pygame(monkeypatch)
    code, _, error = call(*words)
    assert error == ("pitchlore: season: its window needs pygame-ce, which is not installed. "
                     "Install the extra pitchlore[play].\n")
    assert not list((tmp_path / "seasons" / "paper-person-1").glob("left/*"))


def test_opposing(tmp_path):
    """The opponent of a season against a person is the team that a person plays; others are scripts."""
    assert OWN.recipes(1, None)[0].away == OWN.rival(1).team == TeamSettings(kind="human")
    assert OWN.model_copy(update={"opponent": "static"}).rival(1).team == TeamSettings(kind="static")
    with pytest.raises(BadSettings, match="a person plays at the window"):
        loop.play_game(tmp_path, OWN, 1)
