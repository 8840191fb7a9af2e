"""The referee's stages and commands, by the league's names and numbers; for their source see ``fields``."""

from __future__ import annotations

from pitchlore.pipeline.importers.ssl_logs.referee import RefereeReport

STAGES = (
    "NORMAL_FIRST_HALF_PRE", "NORMAL_FIRST_HALF", "NORMAL_HALF_TIME", "NORMAL_SECOND_HALF_PRE",
    "NORMAL_SECOND_HALF", "EXTRA_TIME_BREAK", "EXTRA_FIRST_HALF_PRE", "EXTRA_FIRST_HALF", "EXTRA_HALF_TIME",
    "EXTRA_SECOND_HALF_PRE", "EXTRA_SECOND_HALF", "PENALTY_SHOOTOUT_BREAK", "PENALTY_SHOOTOUT", "POST_GAME",
)
FIRST_HALF, SHOOT_OUT, POST_GAME = map(
    STAGES.index, ("NORMAL_FIRST_HALF", "PENALTY_SHOOTOUT", "POST_GAME"))
#: Stages in which colours may change: breaks, and what comes before a later half.
BREAKS = frozenset((2, 3, 5, 6, 8, 9, 11))
#: Half of each stage; a break belongs to the half after it.
_HALVES = (0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4)

COMMANDS = (
    "HALT", "STOP", "NORMAL_START", "FORCE_START", "PREPARE_KICKOFF_YELLOW", "PREPARE_KICKOFF_BLUE",
    "PREPARE_PENALTY_YELLOW", "PREPARE_PENALTY_BLUE", "DIRECT_FREE_YELLOW", "DIRECT_FREE_BLUE",
    "INDIRECT_FREE_YELLOW", "INDIRECT_FREE_BLUE", "TIMEOUT_YELLOW", "TIMEOUT_BLUE", "GOAL_YELLOW",
    "GOAL_BLUE", "BALL_PLACEMENT_YELLOW", "BALL_PLACEMENT_BLUE",
)
#: Commands with which robots may play the ball.
_RUNNING = frozenset(COMMANDS.index(word) for word in (
    "NORMAL_START", "FORCE_START", "DIRECT_FREE_YELLOW", "DIRECT_FREE_BLUE", "INDIRECT_FREE_YELLOW",
    "INDIRECT_FREE_BLUE"))


def is_running(reported: RefereeReport) -> bool:
    """True if robots may play the ball."""
    return reported.command in _RUNNING and reported.stage != POST_GAME


def half_of(reported: RefereeReport) -> int:
    """Half of a match, from 0; those of overtime and the shoot-out are further ones."""
    return _HALVES[min(reported.stage, len(_HALVES) - 1)]


def league_word(words: tuple[str, ...], number: int) -> str:
    """The league's word for a stage or command."""
    return words[number] if number < len(words) else f"number {number}"
