"""Moments of a match with their weights; the commentary tells some of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from itertools import pairwise
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.game.roles import roles
from pitchlore.pipeline.views.commentary.settings import CommentarySettings
from pitchlore.pipeline.views.commentary.spells import Spell
from pitchlore.pipeline.views.commentary.words import (
    OTHER,
    PASSES,
    enumerated,
    metres,
    percent,
    restart_sentence,
    robot,
    score_words,
    time_elapsed,
)

#: Robot loses the ball (Table 1).
_LOSES = 22


class Weight(IntEnum):
    """Importance of a moment; of two close ones the greater is reported."""

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
        actor: team of the robot that acts first; ``team`` unless it is said.
    """

    t_ns: int
    kind: str
    team: str | None
    robot: int | None
    text: str
    weight: Weight
    actor: str | None = None

    def line(self) -> str:
        """The moment with the match clock, for people."""
        return f"{time_elapsed(self.t_ns):>6}  {self.text}"

    def facts(self) -> dict[str, object]:
        """The moment for programs, with t in seconds since the first sample."""
        return {"t": self.t_ns / 1e9, "clock": time_elapsed(self.t_ns), "kind": self.kind, "team": self.team,
                "robot": self.robot, "text": self.text}


def of_the_referee(
    referee: pl.DataFrame, match: pl.DataFrame, names: Mapping[str, str]
) -> Iterator[Moment]:
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
            text = restart_sentence(row["note"], names.get(team))
            yield Moment(t_ns, "restart", team, None, text, Weight.ALWAYS)
        elif event == "kick-off" and last != "goal":
            text = f"Kick-off for {names[team]}." if team else "Kick-off."
            yield Moment(t_ns, "kick-off", team, None, text, Weight.ALWAYS)
        if event not in ("play", "stop"):
            last = event
    if last != "end":
        row = match.row(0, named=True)
        text = _with_score("The recording ends", row)
        yield Moment(round(row["duration_s"] * 1e9), "end", None, None, text, Weight.ALWAYS)


def _with_score(what: str, row: dict[str, Any]) -> str:
    return f"{what}, {score_words(row)}." if score_words(row) else f"{what}."


def of_shots(shots: pl.DataFrame, touched: pl.DataFrame, names: Mapping[str, str]) -> Iterator[Moment]:
    """Shots that are no goals; the touches are :func:`pipeline.views.commentary.goals.at_ball`."""
    stops = touched.select("t_ns", side="team", by=pl.col("robot").cast(shots.schema["by"]), stopper="role")
    sides = pl.col("team").cast(pl.String).replace_strict(OTHER)
    reported = shots.with_columns(side=sides).sort("t_ns").join_asof(
        stops, on="t_ns", by=("side", "by"), strategy="forward", check_sortedness=False)
    for row in reported.iter_rows(named=True):
        t_ns, team, number, outcome = row["t_ns"], row["team"], row["robot"], row["outcome"]
        what = f"{robot(names[team], number, row['role'])} shoots from {metres(row['distance'])}"
        stopper = robot(names[row["side"]], row["by"], row["stopper"])
        if outcome == "saved":
            text = f"{what}; {stopper} saves."
            yield Moment(t_ns, "save", row["side"], row["by"], text, Weight.CHANCE, actor=team)
        elif outcome == "blocked":
            yield Moment(t_ns, "shot", team, number, f"{what}; {stopper} is in the way.", Weight.ATTEMPT)
        elif outcome == "wide":
            yield Moment(t_ns, "shot", team, number, f"{what}, wide.", Weight.CHANCE)
        elif outcome in ("own", "missed"):
            yield Moment(t_ns, "shot", team, number, f"{what} at the goal.", Weight.ATTEMPT)


def of_passes(
    passes: pl.DataFrame, trajectories: pl.DataFrame, pitch: Pitch, names: Mapping[str, str],
    settings: CommentarySettings,
) -> Iterator[Moment]:
    """Passes that are long enough."""
    least = settings.pass_m * SCALES[pitch.kind].close
    reported = passes.with_columns(
        giver=roles(trajectories, *passes.select("team", "robot", "t_ns")),
        taker=roles(trajectories, *passes.select("team", "receiver", "received_ns")),
    ).filter((pl.col("to_x") - pl.col("x")) ** 2 + (pl.col("to_y") - pl.col("y")) ** 2 >= least**2)
    for row in reported.iter_rows(named=True):
        how = "plays a through pass" if row["through"] else PASSES[row["direction"]]
        team, name = row["team"], names[row["team"]]
        text = (f"{robot(name, row['robot'], row['giver'])} {how} to"
                f" {robot(name, row['receiver'], row['taker'])}.")
        yield Moment(row["t_ns"], "pass", team, row["robot"], text, Weight.PLAY)


def of_spells(
    spells: Sequence[Spell], situations: pl.DataFrame, pitch: Pitch, settings: CommentarySettings
) -> Iterator[Moment]:
    """Balls won and kept."""
    lost = situations.filter(pl.col("code") == _LOSES)
    for spell in spells:
        if spell.seconds >= settings.spell_s and spell.touches >= settings.spell_touches:
            yield Moment(spell.start_ns, "possession", spell.team, spell.robots[0],
                         f"{_won(spell, lost)} {_kept(spell, pitch)}.", Weight.PLAY)


def of_lulls(
    reported: Sequence[Moment], spells: Sequence[Spell], names: Mapping[str, str],
    settings: CommentarySettings
) -> Iterator[Moment]:
    """Possession, and changes of sides, in long stretches without other moments; all are given by time."""
    for before, after in pairwise(reported):
        during = [spell for spell in spells if before.t_ns < spell.start_ns and spell.end_ns <= after.t_ns]
        seconds = sum(spell.until_ns - spell.start_ns for spell in during) / 1e9
        if after.t_ns - before.t_ns < round(settings.lull_s * 1e9) or seconds < settings.lull_s / 2:
            continue
        held = sum(spell.held_s for spell in during)
        homes = sum(spell.held_s for spell in during if spell.team == "home") / held
        more, share = ("home", homes) if homes > 0.5 else ("away", 1 - homes)
        turns = sum(one.team != two.team for one, two in pairwise(during))
        duels = seconds - held
        text = f"{names[more]} has {percent(share)} of the possession in the next {seconds:.0f} s."
        if duels > held or turns * settings.scramble_s >= held:
            changes = "once" if turns == 1 else f"{turns} times"
            nobody = f", and nobody has it for {duels:.0f} s" if duels > held else ""
            text = (f"A scramble: in {seconds:.0f} s the ball changes sides {changes}{nobody};"
                    f" {names[more]} has {percent(share)} of the possession.")
        yield Moment(during[0].start_ns, "possession", more, None, text, Weight.PLAY)


def _won(spell: Spell, lost: pl.DataFrame) -> str:
    """Words for a team's gain of the ball; a situation "loses the ball" means that it was taken."""
    if spell.lost_by is None:
        return f"{spell.first} is first at the ball"
    team, number, name = spell.lost_by
    robbed = lost.filter(
        pl.col("team") == team, pl.col("robot") == number,
        pl.col("start_ns") <= spell.start_ns, pl.col("end_ns") >= spell.lost_ns,
    )
    return f"{spell.first} {'gets' if robbed.is_empty() else 'takes'} the ball from {name}"


def _kept(spell: Spell, pitch: Pitch) -> str:
    """Words for a team's time on the ball: duration, robots, and distance gained."""
    third = pitch.length / 6
    far = ", up to the other goal's third" if spell.x < third < spell.far else ""
    others = [str(number) for number in spell.robots[1:]]
    mates = f" with {enumerated(others)}" if others else ""
    return f"and keeps it{mates} for {spell.seconds:.0f} s{far}"
