"""Words of the commentary."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

#: Words for a robot's actions with the ball that may lead to a goal, by code of Table 1.
DONE: dict[int, str] = {
    1: "has {ball}",
    11: "guides {ball}",
    21: "kicks {ball}",
    23: "lets a teammate have {ball}",
    33: "leaves {ball}",
    44: "reaches {ball}",
    45: "receives {ball}",
    47: "is hit by {ball}",
}

#: A restart in the words of the sources, and in ours.
RESTARTS: dict[str, str] = {
    "freeball": "The ball is stuck: free ball",
    "free ball": "The ball is stuck: free ball",
    "segment": "Play goes on after a break",
    **{word: word.capitalize() for word in (
        "penalty", "goal kick", "kick in", "free kick", "indirect free kick", "corner kick", "penalty kick",
        "drop ball",
    )},
}

#: A pass in words, by its direction (schema Passes).
PASSES: dict[str, str] = {
    "front": "passes forward", "left": "passes", "back": "passes back", "right": "passes",
}

OTHER = {"home": "away", "away": "home"}


def time_elapsed(t_ns: int) -> str:
    """Minutes and seconds since the first sample, rounded down to whole seconds."""
    seconds = t_ns // 1_000_000_000
    return f"{seconds // 60}:{seconds % 60:02d}"


def percent(share: float | None) -> str:
    """A share in percent, – for None; with a digit more where it is nearly, and not quite, none or all."""
    if share is None:
        return "–"
    nearly = 0 < share < 1 and not 0.005 <= share < 0.995
    return f"{100 * share:.{1 if nearly else 0}f} %"


def in_digits(value: float | None, digits: int = 2) -> str:
    """A number with digits after the point, – for None; no minus before a zero."""
    return "–" if value is None else with_minus(f"{round(value, digits) + 0.0:.{digits}f}")


def with_minus(text: str) -> str:
    """A text of numbers with the sign for minus in place of hyphens."""
    return text.replace("-", "−")


def side_names(home: str, away: str) -> dict[str, str]:
    """Name of each side: its team, and the side, too, where a team plays itself."""
    return {side: name if home != away else f"{name} ({side})"
            for side, name in (("home", home), ("away", away))}


def robot(team: str, number: int, role: str | None) -> str:
    """A robot's name; ``team`` is what its team is called."""
    return f"{team} {number}" if role is None else f"{team} {number} ({role})"


def score_words(row: dict[str, Any]) -> str:
    """The score in a row that has it, empty where unknown."""
    known = row["score_home"] is not None and row["score_away"] is not None
    return f"{row['score_home']} : {row['score_away']}" if known else ""


def metres(length: float) -> str:
    """A length in words: to the centimetre below a metre, to the decimetre below ten metres."""
    return f"{length:.2f} m" if length < 1 else f"{length:.1f} m" if length < 10 else f"{length:.0f} m"


def enumerated(items: Sequence[str]) -> str:
    """The items as "a, b and c"."""
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)


def restart_word(note: str) -> str:
    """A restart in its source's word, without how it was found."""
    return note.partition(":")[0].replace("_", " ").strip()


def restart_sentence(note: str | None, team: str | None) -> str:
    """Sentence for a restart of a team that is called so; an unknown word is quoted."""
    word = restart_word(note or "")
    words = word.lower().removesuffix(" l").removesuffix(" r")
    said = RESTARTS.get(words, f"Play restarts ({word})" if word else "Play restarts")
    return f"{said} for {team}." if team else f"{said}."


def story(steps: Sequence[tuple[str, int]], named: str = "") -> str:
    """Robots' actions with the ball as one sentence; a name is given only when it changes.

    Args:
        steps: name and code of each situation, in order of time.
        named: name given just before.
    """
    parts: list[str] = []
    for name, code in steps:
        done = DONE[code].format(ball="it" if parts else "the ball")
        joint = ", " if name == named else "; "
        parts.append(f"{joint if parts else ''}{'' if name == named else f'{name} '}{done}")
        named = name
    return "".join(parts)
