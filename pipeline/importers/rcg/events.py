"""Events of the referee, from playmodes and scores."""

from __future__ import annotations

from pitchlore.pipeline.importers.rcg.lines import ParsedLines
from pitchlore.pipeline.importers.rows import Event
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.schemas import SIDES, Side

#: Playmodes in which the named team brings the ball back into play.
_RESTARTS = {
    "kick_in", "free_kick", "indirect_free_kick", "corner_kick", "goal_kick", "penalty_kick", "drop_ball",
}
#: Playmodes between halves; the first of them at or after the half's last cycle is half-time.
_BREAKS = {"before_kick_off", "first_half_over", "half_time", "kick_off"}


def events_of(record: ParsedLines, t_ns: I64, source: SourceFile) -> tuple[list[Event], bool]:
    """Referee events, and whether the log reaches time over.

    Raises:
        BadRecording: if it has more goals than the limit.
    """
    events: list[Event] = []
    told_goals = 0
    score = _score_at_start(record)
    half_cycles = record.server.half_cycles
    half = record.numbers[0] // half_cycles + 1 if half_cycles > 0 else 1
    reported: set[tuple[int, Side]] = set()
    over = False

    def emit(index: int, event: str, note: str, team: Side | None = None) -> None:
        at = int(t_ns[min(index, len(t_ns) - 1)])
        events.append(Event(at, event, team, score["home"], score["away"], note))

    def count(goals: int) -> None:
        nonlocal told_goals
        told_goals += abs(goals)
        if told_goals > source.limits.goals:
            raise source.too_much(f"{told_goals} goals", "goals")

    for index, cycle, mark in record.marks:
        if isinstance(mark, tuple):
            for team, goals in zip(SIDES, mark, strict=True):
                before = score[team] or 0
                count(goals - before)
                for made in range(before + 1, goals + 1):  # a rise without a playmode
                    score[team] = made
                    reported.add((index, team))
                    emit(index, "goal", "team", team)
                score[team] = goals
            continue
        mode, side = _split(mark)
        if mode in _BREAKS and 0 < half * half_cycles <= cycle:
            half += 1
            emit(index, "half", mark)
            if mode != "kick_off":
                continue
        if mode == "goal" and side is not None:
            if (index, side) not in reported:
                count(1)
                known = score[side]
                score[side] = None if known is None else known + 1
                emit(index, "goal", mark, side)
        elif mode == "kick_off":
            emit(index, "kick-off", mark, side)
        elif mode == "play_on":
            emit(index, "play", mark)
        elif mode in _RESTARTS:
            emit(index, "fault", mark, side)
        elif mode == "time_over":
            over = True
            emit(index, "end", mark)
        else:
            # pauses, offences (a restart of the other team follows) and the penalty shoot-out
            emit(index, "stop", mark)
    return events, over


def _score_at_start(record: ParsedLines) -> dict[Side, int | None]:
    """The score at which the log begins: the first that it tells, without the goals that it has until then.

    A log that tells none has 0 : 0 if it begins with the match; else nobody knows.
    """
    first = next(((index, mark) for index, _, mark in record.marks if isinstance(mark, tuple)), None)
    if first is None:
        usual = 0 if record.numbers[0] <= 1 else None
        return {"home": usual, "away": usual}
    at, goals = first
    made = [_split(mark) for index, _, mark in record.marks if isinstance(mark, str) and index <= at]
    return {team: max(n - made.count(("goal", team)), 0) for team, n in zip(SIDES, goals, strict=True)}


def _split(mode: str) -> tuple[str, Side | None]:
    """Playmode without its side, and the side."""
    if mode.endswith("_l"):
        return mode[:-2], "home"
    if mode.endswith("_r"):
        return mode[:-2], "away"
    return mode, None
