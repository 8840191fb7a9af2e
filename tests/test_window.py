"""A person at the window: keys and sticks by injected events, no screen; what was played is a match like any."""

import json
import math
import time
from itertools import pairwise

import numpy as np
import polars as pl
import pytest

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.human import DriveCommand
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.sessions.person import PersonMatch
from pitchlore.pipeline.store import Store
from pitchlore.schemas import AWAY, HOME, Matches, Referee

pygame = pytest.importorskip("pygame", reason="pygame-ce is not installed (the extra `play`)")

from support.window import button, key, script, without_pygame  # noqa: E402

from pitchlore.pipeline.arena.window import screen  # noqa: E402
from pitchlore.pipeline.arena.window.controls import DEAD_ZONE, Controls  # noqa: E402
from pitchlore.pipeline.arena.window.painting import Picture, WindowPainter  # noqa: E402
from pitchlore.pipeline.arena.window.screen import MOST_DUE, Window  # noqa: E402

VSSS = PITCHES[Kind.VSSS]


@pytest.fixture(autouse=True)
def no_screen(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    pygame.quit()


def stick(axis, part):
    return pygame.event.Event(pygame.CONTROLLERAXISMOTION, axis=axis, value=round(part * 32767), instance_id=0)


class TestKeys:
    @pytest.mark.parametrize(("codes", "command"), [
        ([], DriveCommand()),
        (["UP"], DriveCommand(forward=1)), (["w"], DriveCommand(forward=1)),
        (["DOWN"], DriveCommand(forward=-1)), (["s"], DriveCommand(forward=-1)),
        (["LEFT"], DriveCommand(turn=1)), (["a"], DriveCommand(turn=1)),
        (["RIGHT"], DriveCommand(turn=-1)), (["d"], DriveCommand(turn=-1)),
        (["UP", "LEFT", "SPACE"], DriveCommand(forward=1, turn=1, boost=True)),
        (["UP", "w"], DriveCommand(forward=1)), (["UP", "DOWN"], DriveCommand()),
    ])
    def test_held(self, codes, command):
        """A key drives as long as it is held."""
        controls = Controls()
        events = [key(getattr(pygame, f"K_{code}")) for code in codes]
        assert controls.listen(events).command == command
        assert controls.listen([]).command == command  # still held
        assert controls.listen([key(event.key, down=False) for event in events]).command == DriveCommand()

    def test_once(self):
        """A key that switches, pauses or leaves acts once when it is pressed."""
        controls = Controls()
        assert controls.listen([key(pygame.K_TAB)]).switch == "next"
        assert controls.listen([]).switch is None  # though it is held
        assert controls.listen([key(pygame.K_e)]).switch == "nearest"
        assert controls.listen([key(pygame.K_p)]).paused
        assert controls.listen([]).paused
        assert not controls.listen([key(pygame.K_p)]).paused
        assert controls.listen([key(pygame.K_ESCAPE)]).leave
        assert Controls().listen([pygame.event.Event(pygame.QUIT)]).leave, "the window is closed"

    def test_other_keys_do_nothing(self):
        asked = Controls().listen([key(pygame.K_F5), key(pygame.K_F5, down=False), button(99), stick(4, 1.0)])
        assert asked == (DriveCommand(), None, False, False)

    def test_lost_focus(self):
        """A window that loses the focus lets go of the keys and pauses."""
        asked = Controls().listen([key(pygame.K_UP), pygame.event.Event(pygame.WINDOWFOCUSLOST)])
        assert asked.command == DriveCommand()
        assert asked.paused


class TestPads:
    def test_stick(self):
        """The stick drives in proportion, but for a dead zone."""
        controls = Controls()
        x, y = pygame.CONTROLLER_AXIS_LEFTX, pygame.CONTROLLER_AXIS_LEFTY
        forward, turn, _ = controls.listen([stick(y, -0.5), stick(x, 0.25)]).command  # up, right
        assert (forward, turn) == pytest.approx((0.5, -0.25), abs=1e-4)
        assert controls.listen([stick(y, 0.9 * DEAD_ZONE), stick(x, -1.0)]).command == DriveCommand(turn=1)
        full = pygame.event.Event(pygame.CONTROLLERAXISMOTION, axis=y, value=-32768, instance_id=0)
        assert controls.listen([full]).command.forward == 1

    def test_unplugged(self):
        """An unplugged pad lets go and pauses, but keys stay held."""
        controls = Controls()
        controls.listen([stick(pygame.CONTROLLER_AXIS_LEFTX, 1.0), button(pygame.CONTROLLER_BUTTON_A),
                         key(pygame.K_UP)])
        asked = controls.listen([pygame.event.Event(pygame.CONTROLLERDEVICEREMOVED, instance_id=0)])
        assert asked == (DriveCommand(forward=1), None, True, False)


class TestPainting:
    SIZE = (600, 540)

    def paint(self, bodies=None, **scene):
        if bodies is None:
            bodies = np.zeros((7, 6))
            bodies[1:, 0], bodies[0, 1] = [-0.6, -0.4, -0.2, 0.2, 0.4, 0.6], 0.4
        given = {"home_attacks": 1, "score": (0, 0), "clock_s": 0.0, "duration_s": 120.0} | scene
        canvas = WindowPainter(VSSS, ("you", "static"), self.SIZE).paint(Picture(bodies, **given))
        return np.asarray(canvas).swapaxes(0, 1).astype(int)

    def where(self, picture, colour):
        """Centre of the pixels of a colour, and how many there are."""
        hits = np.argwhere(np.abs(picture - np.array(colour)).sum(axis=2) < 30)
        return hits.mean(axis=0) if len(hits) else None, len(hits)

    def test_bodies(self):
        """Bodies are painted where they are."""
        bodies = np.zeros((3, 6))
        bodies[0, :2], bodies[1, :2], bodies[2, :2] = (0.0, 0.45), (-0.5, -0.3), (0.5, -0.3)
        picture = self.paint(bodies)[:, 84:500]  # between head and foot
        scale = min((600 - 44) / 1.7, (540 - 124) / 1.3)
        (x, y), _ = self.where(picture[:, :100], (255, 255, 255))
        assert (x, y) == pytest.approx((300, 208 - 0.45 * scale), abs=2)
        (x, y), count = self.where(picture[100:250, 260:], (63, 158, 230))
        assert (x + 100, y + 260) == pytest.approx((300 - 0.5 * scale, 208 + 0.3 * scale), abs=4)
        assert count > 100

    def test_goals(self):
        """A goal has the colour of the team that keeps it."""
        first, second = self.paint(home_attacks=1), self.paint(home_attacks=-1)
        blue = (63, 158, 230)
        assert self.where(first[:60, 150:430], blue)[1] > 50
        assert self.where(second[540:, 150:430], blue)[1] > 50
        assert self.where(first[540:, 150:430], blue)[1] == 0

    def test_what_changes_is_seen(self):
        """A change of robot, message, score, clock or heading is seen in the picture."""
        plain = self.paint()
        for change in ({"driven": 2}, {"driven": 5}, {"message": "Pause"}, {"score": (1, 0)}, {"clock_s": 61.0}):
            assert (self.paint(**change) != plain).any(), change
        assert (self.paint() == plain).all()
        turned = np.zeros((7, 6))
        turned[1:, 0], turned[0, 1] = [-0.6, -0.4, -0.2, 0.2, 0.4, 0.6], 0.4
        turned[3, 2] = math.pi / 2
        assert (self.paint(turned) != plain).any()

    def test_nothing_stays(self):
        """A picture is the same whatever was painted before it."""
        painter, bodies = WindowPainter(VSSS, ("you", "static"), self.SIZE), np.zeros((7, 6))
        first, _, _, again = (painter.paint(Picture(bodies, sign, (0, 0), seconds, 120.0, message=message)).tobytes()
                              for sign, seconds, message in [(1, 0, ""), (-1, 1, "Pause"), (1, 2, ""), (1, 0, "")])
        assert first == again


class TestWindow:
    def test_clock(self):
        """The match never goes faster than the clock, and catches up by few frames at once."""
        with Window(VSSS, ("you", "static"), 250.0) as window:
            start = time.perf_counter()
            frames = sum(window.due() for _ in range(50))
            assert frames <= (time.perf_counter() - start) * 250 + 1
            time.sleep(0.1)  # 25 frames
            assert window.due() == MOST_DUE

    def test_can_be_made_smaller(self):
        with Window(VSSS, ("you", "static"), 60.0) as window:
            pygame.display.set_mode((500, 470), pygame.RESIZABLE)
            pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=(500, 470), w=500, h=470))
            window.listen()
            window.show(Picture(np.zeros((7, 6)), 1, (0, 0), 0.0, 60.0))
            assert pygame.display.get_surface().get_size() == (500, 470)


def played(call, data, *words):
    """The report of a match, the store, its receipt and its log."""
    code, out, _ = call("play", "--json", "--data", data, *words)
    assert code == 0
    report, store = json.loads(out), Store(data)
    receipt = store.receipt("matches", report["match_id"])
    return report, store, receipt, log.read(store.read(receipt, "log"), where="log")


def path(match, team, number):
    """x, y, theta of a robot at every frame."""
    robots = match.frames.robots
    mine = robots[(robots["team"] == team) & (robots["id"] == number)]
    return np.stack([mine["x"], mine["y"], mine["theta"]], axis=1).astype(float)


def ahead(match):
    """The way of home 1 from frame 2 to 32, metres in its direction."""
    keeper = path(match, HOME, 1)
    return (keeper[32, :2] - keeper[2, :2]) @ [math.cos(keeper[2, 2]), math.sin(keeper[2, 2])]


def watched(monkeypatch):
    """The robots that are driven, frame by frame, as the match goes on."""
    drove, picture = [], PersonMatch._picture
    monkeypatch.setattr(PersonMatch, "_picture", lambda own, *words: (
        drove.append(own.person.driven), picture(own, *words))[1])
    return drove


class TestPlay:
    def test_at_the_keys(self, monkeypatch, call, tmp_path):
        """A person's keys are in the log of the match."""
        switches = {60: [key(pygame.K_UP, down=False), key(pygame.K_TAB)], 61: [key(pygame.K_SPACE)]}
        script(monkeypatch, {1: [key(pygame.K_TAB)], 2: [key(pygame.K_UP)], 40: [key(pygame.K_RIGHT)],
                             50: [key(pygame.K_RIGHT, down=False)], **switches,
                             90: [key(pygame.K_SPACE, down=False)], 100: [key(pygame.K_ESCAPE)]})
        drove = watched(monkeypatch)
        report, store, receipt, match = played(call, tmp_path, "--seed", "1", "--minutes", "1")

        # the taker of the kick-off, then the goalkeeper, then the next
        assert [drove[0], *(b for a, b in pairwise(drove) if a != b)] == [3, 1, 2]
        assert drove.index(2) == 60
        assert ahead(match) == pytest.approx(0.72 * 0.5 - 0.04, abs=0.03)  # half a second at 0.72 m/s, but for the start
        turned = np.unwrap(path(match, HOME, 1)[:, 2])
        assert turned[55] - turned[40] == pytest.approx(-5.0 * 10 / 60, rel=0.15)
        speed = np.hypot(*np.diff(path(match, HOME, 2)[:, :2], axis=0).T) * 60
        assert speed[62:90].max() > 0.9  # more than anybody drives without Space

        assert report["complete"] is False
        row = store.read_table(receipt, "matches", Matches).row(0, named=True)
        assert (row["home"], row["away"], row["format"]) == ("human", "static", "world")
        assert row["incomplete_reason"].startswith("left after 1.")
        end = store.read_table(receipt, "referee", Referee).filter(pl.col("event") == "end").row(0, named=True)
        assert end["note"] == "left early"
        assert end["t_ns"] == match.frames.t_ns[-1]
        assert not list((tmp_path / "playing").glob("*.mcap"))

    def test_at_the_pad(self, monkeypatch, call, tmp_path):
        """A person's pad is in the log of the match."""
        opened = []

        class Pad:
            """A gamepad as SDL opens it; the second is pulled out before it can be."""

            def __init__(self, index):
                if index:
                    raise pygame.error("no such device")
                opened.append(index)

        y = pygame.CONTROLLER_AXIS_LEFTY
        plugged = [pygame.event.Event(pygame.CONTROLLERDEVICEADDED, device_index=index) for index in (0, 1)]
        monkeypatch.setattr(screen.controller, "Controller", Pad)
        script(monkeypatch, {
            1: plugged, 2: [button(pygame.CONTROLLER_BUTTON_X), stick(y, -0.5)],
            40: [stick(y, 0.0), button(pygame.CONTROLLER_BUTTON_X, down=False),
                 button(pygame.CONTROLLER_BUTTON_RIGHTSHOULDER)],
            42: [button(pygame.CONTROLLER_BUTTON_A)], 70: [button(pygame.CONTROLLER_BUTTON_A, down=False)],
            72: [button(pygame.CONTROLLER_BUTTON_START)], 82: [button(pygame.CONTROLLER_BUTTON_START)],
            90: [button(pygame.CONTROLLER_BUTTON_BACK)],
        })
        drove = watched(monkeypatch)
        _, store, receipt, match = played(call, tmp_path, "--seed", "1", "--minutes", "1")

        assert opened == [0]
        assert [drove[0], *(b for a, b in pairwise(drove) if a != b)] == [3, 1, 2]
        assert ahead(match) == pytest.approx(0.36 * 0.5 - 0.01, abs=0.02)  # at half of 0.72 m/s, but for the start
        speed = np.hypot(*np.diff(path(match, HOME, 2)[:, :2], axis=0).T) * 60
        assert speed[50:70].max() > 0.9  # more than anybody drives without A
        row = store.read_table(receipt, "matches", Matches).row(0, named=True)
        assert row["incomplete_reason"].startswith("left after 1.3")  # 90 frames, of which 10 were a pause

    def test_final_whistle(self, monkeypatch, call, tmp_path):
        """A person can play as away to the final whistle, and a pause takes nothing off the match."""
        script(monkeypatch, {1: [key(pygame.K_UP)], 20: [key(pygame.K_p)], 50: [key(pygame.K_p)]})
        report, _, _, match = played(
            call, tmp_path, "--as", "away", "--against", "random", "--minutes", "0.02")
        assert report["complete"]
        assert report["as"] == "away"
        assert match.info.away == "human"
        assert len(match.frames) == 73  # 1.2 s: who pauses plays no less
        assert match.info.complete
        moved = [np.hypot(*(path(match, AWAY, n)[-1] - path(match, AWAY, n)[0])[:2]) for n in (1, 2, 3)]
        assert max(moved) > 0.1

    def test_seed_again(self, monkeypatch, call, tmp_path):
        """No match is played over another with the same seed."""
        script(monkeypatch, *[{5: [key(pygame.K_ESCAPE)]}] * 3)
        ids = [played(call, tmp_path)[0]["match_id"] for _ in range(2)]
        assert ids[0] != ids[1]
        code, _, error = call("play", "--seed", 1, "--data", tmp_path)
        assert code == 1
        assert "has been played with seed 1. Give another --seed, or none." in error

    def test_broken_off(self, monkeypatch, call, tmp_path):
        """An error that breaks the match off leaves its log for the next run."""
        from pitchlore.pipeline.engine.recordings import inbox

        def due(_):
            raise RuntimeError("the screen is gone")

        monkeypatch.setattr(Window, "due", due)
        code, _, error = call("play", "--data", tmp_path)
        assert code == 1
        assert "the screen is gone" in error
        assert [r.file.name.startswith("human-static-1-") for r in inbox(Store(tmp_path))] == [True]

    @pytest.mark.parametrize(("driver", "said"), [
        ("none-such", "no window can be opened"), ("offscreen", "no window can be opened (there is no display)"),
    ])
    def test_without_a_screen(self, monkeypatch, call, tmp_path, driver, said):
        """Without a screen, play says so in one line, and does not let SDL paint for nobody."""
        for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
            monkeypatch.delenv(name, raising=False)
        if driver == "offscreen":
            monkeypatch.setattr(pygame.display, "get_driver", lambda: driver)
        else:
            monkeypatch.setenv("SDL_VIDEODRIVER", driver)
        code, _, error = call("play", "--data", tmp_path)
        assert (code, error.count("\n")) == (1, 1)
        assert said in error
        assert not (tmp_path / "matches").exists()

def test_without_pygame(monkeypatch, call, tmp_path):
    """Without pygame, play says in one line how to install it."""
    without_pygame(monkeypatch)
    code, out, error = call("play", "--data", tmp_path)
    assert (code, out) == (1, "")
    assert error == ("pitchlore: play: its window needs pygame-ce, which is not installed. "
                     "Install the extra pitchlore[play].\n")
