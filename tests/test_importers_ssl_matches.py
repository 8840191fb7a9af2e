"""Scenes of the league's rules and of recorders that nobody stopped: which match a log is, and whose goals are whose."""

import struct
from pathlib import Path

import polars as pl
import pytest
from support.ssl_games import EPOCH, GEOMETRY, STEP, command, frames, ns, ordered
from support.ssl_messages import REFEREE, VISION_2014, Message, Seen, Team, log, referee, vision

from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.models import matches_to_fit
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Output, Scope
from pitchlore.pipeline.importers.readers import open_source, read
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap, load_map
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.table import row
from pitchlore.pipeline.settings import ImportSettings, ModelSettings, SideSettings
from pitchlore.pipeline.stages.sides import sides
from pitchlore.pipeline.store import Store

STAGES = ["pre", "1st", "ht", "pre2", "2nd", "otbreak", "otpre", "ot1", "otht", "otpre2", "ot2", "sobreak", "so", "post"]
NAMES = {"T": "TIGERs", "Z": "ZJUNlict", "R": "RoboTeam", "E": "ER-Force", "-": ""}
#: A first half: Z is blue and leads by two goals, at frames 10 and 20.
HALF = """
0 pre STOP T0 Z0 | 2 1st NORMAL_START T0 Z0 | 10 1st STOP T0 Z0 | 12 1st STOP T0 Z1 | 14 1st NORMAL_START T0 Z1
20 1st STOP T0 Z1 | 21 1st STOP T0 Z2 | 24 1st NORMAL_START T0 Z2
"""
#: It is the whole match.
WON = HALF + "| 40 post HALT T0 Z2"
#: A second match, with a goal.
NEXT = "| 60 pre STOP E0 R0 | 62 1st NORMAL_START E0 R0 | 70 1st STOP E0 R1 | 80 post HALT E0 R1"


def said(scene: str) -> list[Message]:
    """The referee's packets: frame, stage, command, and name and score of yellow and blue; ``+`` if blue is at +x; ``@`` and
    a controller's identity."""
    messages, before, counter = [], "", 0
    for line in scene.replace("\n", "|").split("|"):
        if not line.strip():
            continue
        frame, stage, word, yellow, blue, *more = line.split()
        counter += word != before
        before = word
        teams = [Team(NAMES[text[0]], int(text[1:])) for text in (yellow, blue)]
        source = next((text for text in more if text[0] == "@"), "gc")
        content = referee(STAGES.index(stage), command(word), counter, *teams, blue_on_positive="+" in more, source=source)
        messages.append(Message(ns(int(frame) * STEP) - 1, REFEREE, content))
    return messages


def shown(game: MatchLog) -> str:
    """Teams and score, the goals' frames and sides, other events that tell the course, and home's robots as they change."""
    rows, table = game.referee.select("t_ns", "event", "team").rows(), row(game).row(0, named=True)
    words = [f"{event} {round(t_ns / 1e9 / STEP)}{' ' + team if event == 'goal' else ''}" for t_ns, event, team in rows
             if event in ("goal", "half", "end")]
    home = game.frames.robots[game.frames.robots["team"] == 0]["id"].tolist()
    changes = [f"#{number} from {i}" for i, number in enumerate(home) if i and home[i - 1] != number]
    shot = "" if table["shoot_out_home"] is None else f" ({table['shoot_out_home']} : {table['shoot_out_away']})"
    title = f"{table['home']} {table['score_home']} : {table['score_away']}{shot} {table['away']}"
    return ", ".join([title, *words, *changes])


def games(data: bytes, mapping: str = "") -> list[MatchLog]:
    """All matches of a log."""
    source, found = open_source(data, "game.log"), TrackingMap() if not mapping else load_map(mapping)
    first = read(source, found)
    many = first.info.settings.get("match", {"of": 1})["of"]  # type: ignore[index]
    return [first, *(read(source.numbered(number), found) for number in range(2, many + 1))]


ZT = "ZJUNlict 2 : 0 TIGERs, goal 10 home, goal 20 home"
SECOND = "RoboTeam 1 : 0 ER-Force, goal 10 home, end 20"


@pytest.mark.parametrize(("scene", "wanted"), [
    # the controller goes on after the match
    (WON, [ZT + ", end 40"]),
    (WON + "| 50 pre HALT E0 R0", [ZT + ", end 40"]),
    (WON + "| 50 pre HALT -0 -0", [ZT + ", end 40"]),
    (WON + "| 50 pre HALT T0 Z0", [ZT + ", end 40"]),
    (WON + "| 50 post HALT T0 Z0", [ZT + ", end 40"]),
    (WON + "| 50 post HALT -0 -2", [ZT + ", end 40"]),
    (WON + "| 50 post HALT E0 Z2 | 52 post HALT E0 R2 | 54 pre HALT E0 R0", [ZT + ", end 40"]),
    (WON + "| 50 post HALT T0 Z1 | 52 post HALT T0 Z0", [ZT + ", end 40"]),  # by hand, goal by goal
    (HALF.replace("Z2", "Z1") + "| 40 post HALT T0 Z1 | 50 post HALT T0 Z0 | 52 post HALT E0 R0",
     ["ZJUNlict 1 : 0 TIGERs, goal 10 home, end 40"]),
    (HALF + "| 50 pre HALT -0 -0", [ZT]),  # nobody said that it is over
    (WON + "| 50 pre HALT -0 -0 @new", [ZT + ", end 40"]),  # a controller that was started anew
    # what was before the match
    ("0 post HALT E3 R1 | 1 pre HALT -0 -0" + HALF.replace("\n0 ", "\n| 2 ").replace("2 1st NORMAL", "3 1st NORMAL"),
     ["ZJUNlict 2 : 0 TIGERs, goal 9 home, goal 19 home"]),
    # a second match in the recording
    (WON + NEXT, [ZT + ", end 40", SECOND]),
    (WON + NEXT.replace("T0", "@new"), [ZT + ", end 40", SECOND]),
    (HALF + NEXT, [ZT, SECOND]),
    (WON + "| 60 pre STOP T0 Z0 | 62 1st NORMAL_START T0 Z0 | 70 1st STOP T1 Z0",  # of the same teams
     [ZT + ", end 40", "ZJUNlict 0 : 1 TIGERs, goal 10 away"]),
    (WON + NEXT + "| 90 pre HALT -0 -0", [ZT + ", end 40", SECOND]),
    # people correct the score, or take back the end
    (HALF + "| 30 1st HALT T0 Z1 | 32 1st FORCE_START T0 Z1 | 40 post HALT T0 Z1",
     ["ZJUNlict 1 : 0 TIGERs, goal 10 home, end 40"]),
    (WON + "| 50 post HALT T0 Z1", ["ZJUNlict 1 : 0 TIGERs, goal 10 home, end 40"]),
    (WON + "| 50 1st HALT T0 Z2 | 52 1st FORCE_START T0 Z2 | 60 1st STOP T1 Z2 | 70 post HALT T1 Z2",
     ["ZJUNlict 2 : 1 TIGERs, goal 10 home, goal 20 home, goal 60 away, end 70"]),
    ("0 pre STOP T0 Z0 | 2 1st NORMAL_START T0 Z0 | 4 pre HALT T0 Z0 | 6 1st NORMAL_START T0 Z0 | 20 1st STOP T0 Z1",
     ["ZJUNlict 1 : 0 TIGERs, goal 20 home"]),  # a kick-off that is taken again
    (HALF + "| 30 1st STOP T0 Z7 | 32 1st STOP T0 Z2 | 40 1st NORMAL_START T0 Z2", [ZT]),  # it was typed wrongly
    (HALF + "| 40 post HALT T10 Z0", ["ZJUNlict 0 : 10 TIGERs, end 40"]),  # a forfeit is no goals
    # the controller crashes and is started anew, in the match
    (HALF + "| 30 1st HALT T0 Z2 @new | 34 1st FORCE_START T0 Z2 @new | 50 1st STOP T0 Z3 @new",
     ["ZJUNlict 3 : 0 TIGERs, goal 10 home, goal 20 home, goal 50 home"]),
    # colours change at half-time, by the controller's button or by hand; blue's goal stays where it is or not
    (HALF + "| 40 ht HALT T0 Z2 | 44 pre2 STOP Z2 T0 | 48 2nd NORMAL_START Z2 T0 | 60 2nd STOP Z2 T1 | 75 post HALT Z2 T1",
     ["ZJUNlict 2 : 1 TIGERs, goal 10 home, goal 20 home, half 40, goal 60 away, end 75, #1 from 44"]),
    (HALF + "| 40 ht HALT T0 Z2 | 44 ht STOP Z0 T2 | 45 ht STOP Z2 T2 | 46 ht STOP Z2 T0 | 48 2nd NORMAL_START Z2 T0",
     [ZT + ", half 40, #1 from 44"]),
    (HALF + "| 40 ht HALT T0 Z2 | 43 ht HALT Z0 Z2 | 44 ht HALT Z0 T2 | 46 ht HALT Z2 T0 | 48 2nd NORMAL_START Z2 T0",
     [ZT + ", half 40, #1 from 44"]),
    (HALF + "| 40 2nd HALT T0 Z2 | 44 2nd STOP Z2 T0 + | 48 2nd NORMAL_START Z2 T0 +", [ZT + ", half 40, #1 from 44"]),
    (("0 pre STOP T0 Z0 | 2 1st NORMAL_START T0 Z0 | 30 ht HALT T0 Z0 | 32 ht HALT Z0 T0 | 40 2nd NORMAL_START Z0 T0"
     "| 50 2nd STOP Z1 T0"), ["ZJUNlict 1 : 0 TIGERs, half 30, goal 50 home, #1 from 32"]),
    (HALF + "| 40 ht HALT T0 Z2 | 44 ht STOP Z2 R0 | 48 2nd NORMAL_START Z2 R0",  # one of the names is typed anew
     ["ZJUNlict 2 : 0 RoboTeam, goal 10 home, goal 20 home, half 40, #1 from 44"]),
    # without names the scores tell; a change by mistake is none
    (HALF + "| 40 ht HALT T0 Z2 | 42 ht HALT -0 -2 | 44 pre2 STOP -2 -0 | 48 2nd NORMAL_START -2 -0 | 60 2nd STOP -2 -1 | 75 post HALT -2 -1",
     ["ZJUNlict 2 : 1 TIGERs, goal 10 home, goal 20 home, half 40, goal 60 away, end 75, #1 from 44"]),
    (("0 pre STOP -0 -0 | 2 1st NORMAL_START -0 -0 | 10 1st STOP -0 -1 | 40 ht HALT -0 -1 | 44 ht HALT -1 -0 | 48 2nd NORMAL_START -1 -0"
     "| 60 2nd STOP -1 -1"), ["blue 1 : 1 yellow, goal 10 home, half 40, goal 60 away, #1 from 44"]),
    (HALF + "| 40 ht HALT T0 Z2 | 42 ht HALT Z2 T0 | 44 ht HALT T0 Z2 | 48 2nd NORMAL_START T0 Z2 | 60 2nd STOP T0 Z3",
     ["ZJUNlict 3 : 0 TIGERs, goal 10 home, goal 20 home, half 40, goal 60 home"]),
    # and once more in overtime, before a shoot-out whose goals count by themselves
    (HALF + "| 30 ht HALT T0 Z2 | 32 ht HALT Z2 T0 | 34 2nd NORMAL_START Z2 T0 | 36 2nd STOP Z2 T2 | 40 otbreak HALT Z2 T2"
     "| 42 ot1 NORMAL_START Z2 T2 | 44 otht HALT Z2 T2 | 46 otht HALT T2 Z2 | 48 ot2 NORMAL_START T2 Z2 | 50 sobreak HALT T2 Z2"
     "| 52 so PREPARE_PENALTY_BLUE T2 Z2 | 54 so NORMAL_START T2 Z2 | 56 so STOP T2 Z3 | 58 so PREPARE_PENALTY_YELLOW T2 Z3"
     "| 60 so NORMAL_START T2 Z3 | 62 so STOP T3 Z3 | 64 so STOP T2 Z3 | 70 post HALT T2 Z3 | 80 pre HALT -0 -0",
     [("ZJUNlict 2 : 2 (1 : 0) TIGERs, goal 10 home, goal 20 home, half 30, goal 36 away, goal 36 away, half 40, half 44, half 50, "
      "end 70, #1 from 32, #2 from 46")]),
    # names that were the wrong way round are put right: before the match, and in it
    ("0 pre STOP T0 Z0 | 1 pre STOP Z0 T0 | 2 1st NORMAL_START Z0 T0 | 20 1st STOP Z0 T1", ["TIGERs 1 : 0 ZJUNlict, goal 20 home"]),
    (HALF + "| 30 1st HALT Z0 T2 | 34 1st FORCE_START Z0 T2", ["TIGERs 2 : 0 ZJUNlict, goal 10 home, goal 20 home"]),
    # time-outs, substitutions, cards and an emergency stop halt play, and the match goes on
    (HALF + "| 30 1st STOP T0 Z2 | 32 1st TIMEOUT_YELLOW T0 Z2 | 40 1st STOP T0 Z2 | 42 1st HALT T0 Z2 | 44 1st STOP T0 Z2"
     "| 46 1st DIRECT_FREE_BLUE T0 Z2 | 50 1st HALT T0 Z2 | 52 1st TIMEOUT_BLUE T0 Z2 | 60 1st DIRECT_FREE_YELLOW T0 Z2", [ZT]),
    # it ends early, at ten goals; a test of a team, without names and stages
    ("0 1st FORCE_START T0 Z9 | 20 1st STOP T0 Z10 | 22 post HALT T0 Z10", ["ZJUNlict 10 : 0 TIGERs, goal 20 home, end 22"]),
    ("0 pre FORCE_START -0 -0 | 20 pre STOP -0 -1 | 24 pre FORCE_START -0 -1", ["blue 1 : 0 yellow, goal 20 home"]),
])
def test_scenes(scene: str, wanted: list[str]) -> None:
    """Each log is the matches that were played, each with its own teams, goals and end."""
    found = games(log(ordered(said(scene), frames(100))))
    assert list(map(shown, found)) == wanted
    assert all(game.info.complete for game in found)
    # what was left out, set by people or told by another name is said
    told = {flaw for game in found for flaw in game.quality["flaw"]}
    assert ("several matches" in told) == (len(wanted) > 1)
    assert ("colours switched" in told) == any("#" in text for text in wanted)
    assert ("skipped" in told) == (sum(len(game.frames) for game in found) < 100)


@pytest.mark.parametrize(("home", "wanted"), [
    ("TIGERs", "TIGERs 0 : 2 ZJUNlict, goal 10 away, goal 20 away, half 40, #2 from 44"),
    ("yellow", "TIGERs 0 : 2 ZJUNlict, goal 10 away, goal 20 away, half 40, #2 from 44"),
    ("ZJUNlict", ZT + ", half 40, #1 from 44"),
])
def test_names_as_teams(home: str, wanted: str) -> None:
    """A map names a team; a colour is that of the beginning. Home attacks where its own goal is not."""
    scene = HALF + "| 40 ht HALT T0 Z2 | 44 ht HALT Z2 T0 + | 48 2nd NORMAL_START Z2 T0 +"
    (game,) = games(log(ordered(said(scene), frames(100))), f'[teams]\nhome = "{home}"')
    assert shown(game) == wanted
    # blue's goal is at -x, then at +x: Z, who was blue, is yellow then and stays at -x
    assert {period.home_attacks for period in game.info.periods} == {1 if home == "ZJUNlict" else -1}


@pytest.mark.parametrize(("hours", "then", "wanted"), [
    (3, "| 34 1st FORCE_START T0 Z2 | 50 1st STOP T0 Z3", ["ZJUNlict 3 : 0 TIGERs, goal 10 home, goal 20 home"]),
    (3, "| 34 2nd NORMAL_START Z2 T0 | 50 2nd STOP Z3 T0", ["ZJUNlict 3 : 0 TIGERs, goal 10 home, goal 20 home"]),
    (3, "| 30 1st NORMAL_START E0 R0 | 50 1st STOP E0 R1", [ZT, "RoboTeam 1 : 0 ER-Force, goal 20 home"]),
    (3, "| 30 1st NORMAL_START T0 Z0 | 50 1st STOP T0 Z1", [ZT, "ZJUNlict 1 : 0 TIGERs, goal 20 home"]),
    (-3, "| 30 1st FORCE_START T0 Z2 | 50 1st STOP T0 Z3", [ZT, "ZJUNlict 3 : 0 TIGERs, goal 20 home"]),
])
@pytest.mark.parametrize("headers", [False, True])
def test_long_breaks(hours: float, then: str, wanted: list[str], headers: bool) -> None:
    """A match goes on after hours if the referee says so: the same teams, no earlier stage and no lower score."""
    messages = ordered(said(HALF + then), frames(100))
    first = [m for m in messages if m.received < ns(30 * STEP) - 1]
    later = [m._replace(received=m.received + round(hours * 3600e9)) for m in messages if m.received >= ns(30 * STEP) - 1]
    if not headers and hours < 0:
        pytest.skip("the clock of one log does not go back")
    found = games(log(first) + log(later)) if headers else games(log([*first, *later]))
    assert [shown(game).split(", half")[0].split(", goal 50")[0] for game in found] == wanted


@pytest.mark.parametrize("isolate", [False, True])
def test_import(isolate: bool, tmp_path: Path) -> None:
    """Both matches of a recording come in at once, each with a row and a log; a second import keeps both."""
    file = tmp_path / "final.log"
    file.write_bytes(log(ordered(said(WON + NEXT), frames(100))))
    store, limits = Store(tmp_path / "data"), ImportSettings(isolate=isolate)
    report = import_all(store, [Recording(file=file)], limits)
    first, second = report.made
    assert second == f"{first}-2"
    assert [store.readable("matches", name).details["score"] for name in report.made] == [  # type: ignore[union-attr]
        {"home": 2, "away": 0}, {"home": 1, "away": 0}]
    assert any("the recording has 2 matches" in note for note in report.notes)
    again = import_all(store, [Recording(file=file)], limits)
    assert (again.made, again.kept, again.failed) == ([], 1, {})
    # one that is lost comes in again, and so does a log of ours elsewhere, alone
    store.forget("matches", second)
    assert import_all(store, [Recording(file=file)], limits).made == [second]
    held = store.readable("matches", first)
    assert held is not None
    ours = tmp_path / "first.mcap"
    ours.write_bytes(store.read(held, "log"))
    assert import_all(Store(tmp_path / "other"), [Recording(file=ours)], limits).made == [first]


def still(count: int, seconds: float, ball: bool = True) -> list[Message]:
    """Frames a time apart, with or without a ball that is a number."""
    return [Message(ns(i * seconds), VISION_2014, vision(
        i, EPOCH + i * seconds, balls=[Seen(0.1 * i if ball else float("nan"), 0.0)], yellow=[Seen(-2.0, 0.0, 1, 0.1)],
        blue=[Seen(2.0, 0.0, 2, 3.0)], geometry=GEOMETRY if not i else None)) for i in range(count)]


@pytest.mark.parametrize(("messages", "flaw", "why"), [
    (still(3600, 1.0), "implausible", "a sample each 1 s"),
    (still(60, 5.0), "implausible", "a sample each 5 s"),
    ([*still(50, STEP), *[m._replace(received=m.received + 10**18, content=m.content.replace(
        struct.pack("<d", EPOCH + i * STEP), struct.pack("<d", EPOCH + i * STEP + 1e9)))
        for i, m in enumerate(still(50, STEP))]], "implausible", "it lasts 1e+09 s"),
    (still(50, 0.0), "implausible", "all samples are of one moment"),
    (still(1, 1.0), "implausible", "all samples are of one moment"),
    (still(640, STEP, ball=False), "ball lost", "no ball was seen at all"),
    (still(640, STEP), "", ""),
])
def test_no_course_of_play(messages: list[Message], flaw: str, why: str, tmp_path: Path) -> None:
    """A recording that shows no play is flagged, counts for no team, and no model is fitted to it; others are and do."""
    file = tmp_path / "odd.log"
    file.write_bytes(log(messages))
    store = Store(tmp_path / "data")
    report = import_all(store, [Recording(file=file)])
    (name,) = report.made
    held = store.readable("matches", name)
    assert held is not None
    assert bool(flaw) == bool({"implausible", "ball lost"} & held.details["flaws"].keys())
    assert flaw == "" or any(why in note for note in report.notes)
    counts = sides(pl.DataFrame({"match_id": [name], "home": ["a"], "away": ["b"], "kind": ["ssl"], "score_home": [1],
                                 "score_away": [0]}), SideSettings(), held.details["flaws"])["counts_as"].to_list()
    assert counts == ([None, None] if flaw else ["a", "b"])
    fitted = matches_to_fit(store, Output("all"), Scope(matches=(name,)), ModelSettings())
    assert fitted == (() if flaw else (name,))
