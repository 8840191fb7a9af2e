"""Moments of a match with their weights; the commentary tells some of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import IntEnum
from itertools import pairwise
from typing import Any, NamedTuple

import polars as pl

from pipeline.pitch import Pitch
from pipeline.views.commentary.chances import Shot
from pipeline.views.commentary.settings import CommentarySettings
from pipeline.views.commentary.touches import Spell, Touch
from pipeline.views.commentary.words import DONE, OTHER, clock, listed, metres, restart, robot, story, who

#: Robot loses the ball (Table 1).
_LOSES = 22


class Weight(IntEnum):
    """Importance of a moment; of two close ones the greater is told."""

    PLAY = 0
    ATTEMPT = 1
    CHANCE = 2
    ALWAYS = 3


class Moment(NamedTuple):
    """One thing to tell.

    Attributes:
        t_ns: time.
        kind: kick-off, restart, annulled (a goal), half, end, goal, shot, save, pass, or possession.
        team: its team, None without one.
        robot: number of its robot, None without one.
        text: a sentence.
        weight: its importance.
    """

    t_ns: int
    kind: str
    team: str | None
    robot: int | None
    text: str
    weight: Weight

    def line(self) -> str:
        """The moment with the match clock, for people."""
        return f"{clock(self.t_ns):>6}  {self.text}"

    def facts(self) -> dict[str, object]:
        """The moment for programs, with t in seconds since the first sample."""
        return {"t": self.t_ns / 1e9, "clock": clock(self.t_ns), "kind": self.kind, "team": self.team,
                "robot": self.robot, "text": self.text}


def of_the_referee(referee: pl.DataFrame, match: pl.DataFrame) -> Iterator[Moment]:
    """Kick-offs of halves, restarts, half time, and the final whistle or the end of the recording.

    The kick-off after a goal, and the stop before a restart, say nothing new and are left out, unless the
    stop annulled a goal.
    """
    last = ""
    for row in referee.sort("t_ns", maintain_order=True).iter_rows(named=True):
        event, team, t_ns = row["event"], row["team"], row["t_ns"]
        if event == "half":
            yield Moment(t_ns, "half", None, None, _with_score("Half time", row), Weight.ALWAYS)
        elif event == "end":
            yield Moment(t_ns, "end", None, None, _with_score("The final whistle", row), Weight.ALWAYS)
        elif event == "stop" and "goal annulled" in (row["note"] or ""):
            reason = row["note"].rpartition("goal annulled, ")[2]
            yield Moment(t_ns, "annulled", None, None, f"No goal: {reason}.", Weight.ALWAYS)
        elif event == "fault":
            yield Moment(t_ns, "restart", team, None, restart(row["note"], team), Weight.ALWAYS)
        elif event == "kick-off" and last != "goal":
            text = f"Kick-off for {team}." if team else "Kick-off."
            yield Moment(t_ns, "kick-off", team, None, text, Weight.ALWAYS)
        if event not in ("play", "stop"):
            last = event
    if last != "end":
        row = match.row(0, named=True)
        text = _with_score("The recording ends", row)
        yield Moment(round(row["duration_s"] * 1e9), "end", None, None, text, Weight.ALWAYS)


def _with_score(what: str, row: dict[str, Any]) -> str:
    return f"{what}, {_score(row)}." if _score(row) else f"{what}."


def _score(row: dict[str, Any]) -> str:
    known = row["score_home"] is not None and row["score_away"] is not None
    return f"{row['score_home']} : {row['score_away']}" if known else ""


def of_goals(
    goals: pl.DataFrame, referee: pl.DataFrame, situations: pl.DataFrame, touched: Sequence[Touch],
    settings: CommentarySettings,
) -> Iterator[Moment]:
    """Goals: team, maker, kind, and the situations that led to them."""
    given = referee.filter(pl.col("event") == "goal").sort("t_ns", maintain_order=True)
    scores = [_score(row) for row in given.iter_rows(named=True)]
    made = goals.sort("t_ns", maintain_order=True).iter_rows(named=True)
    for goal, score in zip(made, scores, strict=True):
        t_ns, team = goal["t_ns"], goal["team"]
        seen = [touch for touch in touched if touch.start_ns < t_ns]
        head = f"GOAL{f' for {team}' if team else ''}{f', {score}' if score else ''}!"
        credit, scorer = _credit(goal, seen)
        said = ": ".join(part for part in (credit, _way(goal, seen, situations, scorer, settings)) if part)
        yield Moment(t_ns, "goal", team, goal["robot"], f"{head} {said}".strip(), Weight.ALWAYS)


def _credit(goal: dict[str, Any], seen: Sequence[Touch]) -> tuple[str, str]:
    """Maker and kind of a goal in words, and the maker's name if it plays for the scoring team."""
    team, number, kind = goal["team"], goal["robot"], goal["kind"]
    if team is None or number is None or kind is None:
        return "", ""
    side = OTHER[team] if kind == "error" else team
    roles = [touch.role for touch in seen if (touch.team, touch.robot) == (side, number)]
    name = robot(side, number, roles[-1] if roles else None)
    return (f"Error of {name}", "") if kind == "error" else (f"{name}, {kind} action", name)


def _way(
    goal: dict[str, Any], seen: Sequence[Touch], situations: pl.DataFrame, scorer: str,
    settings: CommentarySettings,
) -> str:
    """The scoring team's actions with the ball before a goal, and the robot that touched it last."""
    if goal["team"] is None or not seen:
        return ""
    last = seen[-1]
    done = situations.filter(
        pl.col("team") == goal["team"], pl.col("code").is_in(list(DONE)), pl.col("segment") == last.segment,
        pl.col("end_ns") > goal["t_ns"] - round(settings.lead_s * 1e9), pl.col("start_ns") < goal["t_ns"],
    ).sort("start_ns", "robot").select("team", "robot", "role", "code")
    steps = [(robot(*row[:3]), row[3]) for row in done.iter_rows()]
    lead = [step for before, step in pairwise([None, *steps]) if step is not None and step != before]
    told = story(lead[-settings.lead_steps:], scorer)
    if last.team != goal["team"]:
        return f"{told}; it goes in off {who(last)}." if told else f"the ball goes in off {who(last)}."
    return f"{told}; it is in." if told else f"{who(last)} touches the ball last."


def of_shots(shots: Sequence[Shot]) -> Iterator[Moment]:
    """Shots that are no goals."""
    for shot in shots:
        touch = shot.touch
        what = f"{who(touch)} shoots from {metres(max(0.0, shot.left))}"
        if shot.outcome == "saved" and shot.by:
            yield Moment(touch.end_ns, "save", shot.by.team, shot.by.robot, f"{what}; {who(shot.by)} saves.",
                         Weight.CHANCE)
        elif shot.outcome == "blocked" and shot.by:
            yield Moment(touch.end_ns, "shot", touch.team, touch.robot,
                         f"{what}; {who(shot.by)} is in the way.", Weight.ATTEMPT)
        elif shot.outcome == "wide":
            yield Moment(touch.end_ns, "shot", touch.team, touch.robot, f"{what}, wide.", Weight.CHANCE)
        elif shot.outcome == "else":
            yield Moment(touch.end_ns, "shot", touch.team, touch.robot, f"{what} at the goal.",
                         Weight.ATTEMPT)


def of_play(
    passes: Sequence[tuple[Touch, Touch]], spells: Sequence[Spell], situations: pl.DataFrame, pitch: Pitch,
    settings: CommentarySettings,
) -> Iterator[Moment]:
    """Passes, and balls won and kept."""
    for giver, taker in passes:
        forward = "forward " if taker.start_x - giver.x > pitch.length / 6 else ""
        yield Moment(giver.end_ns, "pass", giver.team, giver.robot,
                     f"{who(giver)} passes {forward}to {robot(taker.team, taker.robot, taker.role)}.",
                     Weight.PLAY)
    lost = situations.filter(pl.col("code") == _LOSES)
    for spell in spells:
        if spell.seconds >= settings.spell_s and len(spell.touches) >= settings.spell_touches:
            yield Moment(spell.start_ns, "possession", spell.team, spell.touches[0].robot,
                         f"{_won(spell, lost)} {_kept(spell, pitch)}.", Weight.PLAY)


def of_lulls(
    told: Sequence[Moment], spells: Sequence[Spell], settings: CommentarySettings
) -> Iterator[Moment]:
    """Possession, and changes of sides, in long stretches without other moments; all are given by time."""
    for before, after in pairwise(told):
        during = [spell for spell in spells if before.t_ns < spell.start_ns and spell.end_ns <= after.t_ns]
        seconds = sum(spell.seconds for spell in during)
        if after.t_ns - before.t_ns < round(settings.lull_s * 1e9) or seconds < settings.lull_s / 2:
            continue
        homes = sum(spell.seconds for spell in during if spell.team == "home") / seconds
        more, share = ("home", homes) if homes > 0.5 else ("away", 1 - homes)
        turns = len(during) - 1
        text = f"{more.capitalize()} have the ball for {share:.0%} of the next {seconds:.0f} s."
        if turns * settings.scramble_s >= seconds:
            text = (f"A scramble: in {seconds:.0f} s the ball changes sides {turns} times;"
                    f" {more} have it for {share:.0%}.")
        yield Moment(during[0].start_ns, "possession", more, None, text, Weight.PLAY)


def _won(spell: Spell, lost: pl.DataFrame) -> str:
    """Words for a team's gain of the ball; a situation "loses the ball" means that it was taken."""
    before, first = spell.lost_by, spell.touches[0]
    if before is None:
        return f"{who(first)} is first at the ball"
    robbed = lost.filter(
        pl.col("team") == before.team, pl.col("robot") == before.robot,
        pl.col("start_ns") <= first.end_ns, pl.col("end_ns") >= before.end_ns,
    )
    return f"{who(first)} {'gets' if robbed.is_empty() else 'takes'} the ball from {who(before)}"


def _kept(spell: Spell, pitch: Pitch) -> str:
    """Words for a team's time on the ball: duration, robots, and distance gained."""
    numbers = [str(number) for number in dict.fromkeys(touch.robot for touch in spell.touches)]
    third = pitch.length / 6
    from_x, to_x = spell.touches[0].start_x, max(touch.x for touch in spell.touches)
    far = ", up to the other goal's third" if from_x < third < to_x else ""
    if len(numbers) == 1:
        return f"and keeps it for {spell.seconds:.0f} s{far}"
    return f"and keeps it with {listed(numbers[1:])} for {spell.seconds:.0f} s{far}"
