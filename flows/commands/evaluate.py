"""The command evaluate: measure a team by many matches."""

from __future__ import annotations

import json as encoder
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, NamedTuple

import polars as pl
from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Json, On, UserPath
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.playing import (
    AS_LEARNED,
    AS_USUAL,
    MINUTES,
    TEAM_WORDS,
    Learners,
    Many,
    Playing,
    Seed,
    option,
)
from pitchlore.flows.commands.printing import console, print_frame, print_json, print_stand_in
from pitchlore.pipeline.arena.match.recipe import team_slug
from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.software import software
from pitchlore.pipeline.engine.catalog import renew
from pitchlore.pipeline.engine.evaluations import Played, evaluate, measure
from pitchlore.pipeline.engine.placement.places import place_of
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.stages.evaluations import FOULS, Evaluation, EvaluationSummary, Measured, summarise
from pitchlore.pipeline.store import Store
from pitchlore.schemas import note_on
from pitchlore.schemas.evaluations import PENALTY_S, minutes_of, word_of

#: What is said of a team against itself.
_OF_ITSELF = "is the same team: its home side is measured, in matches with seeds of their own."
#: Options: the team that is measured, and its opponent.
WhoIsMeasured = Annotated[str, Parameter(help=f"Team to measure: {TEAM_WORDS}.")]
Against = Annotated[str, Parameter(help=f"Opponent, another such team (default: the panel of {len(PANEL)}).")]


def evaluate_team(
    *,
    policy: WhoIsMeasured = "learned",
    against: Against | None = None,
    matches: Many = 200,
    seed: Seed = 0,
    playing: Playing = AS_USUAL,
    learners: Learners = AS_LEARNED,
    on: On = None,
    export: UserPath | None = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Measure a team by pairs of matches with one seed and sides swapped; 95 % intervals are over the pairs.

    Args:
        policy: Team to measure.
        against: One opponent. The options of learners are its, too; those of the panel play as they are.
        matches: Number of matches, even; those that were played are kept.
        seed: Seed of the first pair; each later one has the next.
        playing: How the matches are played.
        learners: How learned teams play.
        on: Where matches are played.
        export: Folder for the matches as CSV and the summary as JSON.
        json: Print JSON.
        common: Options of every command.
    """
    if matches % 2:
        raise BadSettings(f"{matches} matches do not come in pairs", where="--matches",
                          next_step=f"Ask for {matches + 1}")
    place_of(on)  # so that a word that names none is refused at once
    store = common.store
    how = playing.matches(store)
    panel = against is None
    words = [policy] if against is None else [policy, against]
    (team, *opponents), policies = learners.entrants(store, *words)
    opponents = opponents or [entrant(store, word, policies) for word in PANEL]
    seeds = range(seed, seed + matches // 2)
    evaluations = [Evaluation(**how.of_match(), team=team, opponent=opponent) for opponent in opponents]
    play = perform(store, "evaluation_flow", Played, measure)
    played = play(store.root, evaluations, [*words, *(PANEL if panel else ())], seed, len(seeds), on).pairs
    given = {"settings": playing.settings, "robots": playing.robots, **asdict(learners)}
    options = [_option(name, value) for name, value in given.items() if value is not None]
    measured = [
        _Measurement(evaluation, seeds, rows, summarise(rows), 2 * new, options)
        for evaluation, new in zip(evaluations, played, strict=True)
        for rows in [evaluate(store, evaluation, seeds, policies)[0]]
    ]
    if json:
        said = [one.plain() for one in measured]
        print_json({"team": team.name, "panel": said} if panel else said[0])
    elif panel:
        _print_panel(measured)
    else:
        _print(measured[0])
    if export:
        for one in measured:
            _export(store, one, export)
            if not json:
                console().print(f"{export}: {one.stem} written", soft_wrap=True)
    renew(store)


class _Measurement(NamedTuple):
    """A measurement against one opponent: its settings, seeds, rows of schema Evaluations, and summary.

    ``played`` is the number of matches that were played now, ``options`` are those on how to play that were
    given, but for the minutes.
    """

    evaluation: Evaluation
    seeds: range
    rows: pl.DataFrame
    summary: EvaluationSummary
    played: int
    options: Sequence[str]

    def plain(self) -> dict[str, object]:
        """The measurement for programs."""
        return _plain(self.summary) | {
            "minutes": self.minutes, "seed": self.seeds[0], "played_now": self.played,
            "note": note_on(self.summary.team, self.summary.opponent),
        }

    @property
    def minutes(self) -> float:
        """Length of a match."""
        return self.evaluation.referee.duration_s / 60

    @property
    def matches(self) -> str:
        """The matches in words."""
        how, options = self.evaluation, " ".join(self.options)
        return (f"{self.summary.matches} matches of {self.minutes:g} min, {how.robots} a side on"
                f" {how.pitch.length:g} by {how.pitch.width:g} m{options and f', {options}'}")

    @property
    def stem(self) -> str:
        """Name of its files, without their ends: measurements with other options have others."""
        length = [] if self.minutes == MINUTES else [_option("minutes", f"{self.minutes:g}")]
        options = (word.removeprefix("--").replace(" ", "-") for word in (*length, *self.options))
        return team_slug(self.summary.team, self.summary.opponent, *options)

    @property
    def command(self) -> str:
        """The command that plays these matches again, in any data folder that has the teams."""
        team, opponent = (word_of(side.name) for side in (self.evaluation.team, self.evaluation.opponent))
        minutes = minutes_of(self.evaluation.referee.duration_s)
        words = {"policy": team, "against": opponent, "matches": 2 * len(self.seeds), "seed": self.seeds[0],
                 "minutes": minutes}
        return " ".join(["pitchlore evaluate", *(_option(*word) for word in words.items()), *self.options])


def _print(one: _Measurement) -> None:
    """Print a measurement against one opponent."""
    summary = one.summary
    print_frame(_table(summary), title=f"{summary.team} against {summary.opponent}: {one.matches}")
    console().print(f"{one.played} matches played now, {summary.matches - one.played} before;"
                    f" intervals are over {summary.pairs} pair{'s' if summary.pairs > 1 else ''}.")
    console().print(_fouls(one.rows, summary.team, summary.opponent), soft_wrap=True)
    if one.evaluation.of_itself:
        console().print(f"{summary.opponent} {_OF_ITSELF}")
    print_stand_in(summary.team, summary.opponent)


def _print_panel(measured: Sequence[_Measurement]) -> None:
    """Print the measurements against the panel, a row for each opponent."""
    first = measured[0].summary
    print_frame(pl.DataFrame([
        {"opponent": one.summary.opponent, "goal difference a match": one.summary.goal_difference.value,
         "95 % low": one.summary.goal_difference.low, "95 % high": one.summary.goal_difference.high,
         "wins": one.summary.wins, "draws": one.summary.draws, "losses": one.summary.losses}
        for one in measured
    ]), title=f"{first.team} against the panel: each {measured[0].matches}")
    played = sum(one.played for one in measured)
    console().print(f"{played} matches played now, {sum(one.summary.matches for one in measured) - played}"
                    f" before; intervals are over {first.pairs} pairs, whose seeds all rows share. Each is a"
                    " 95 % interval by itself.")
    console().print(_fouls(pl.concat(one.rows for one in measured), first.team, "the panel"), soft_wrap=True)
    for one in measured:
        if one.evaluation.of_itself:
            console().print(f"{one.summary.opponent} {_OF_ITSELF}")
    print_stand_in(*(one.summary.opponent for one in measured), first.team)


def _fouls(rows: pl.DataFrame, team: str, opponent: str) -> str:
    """Fouls and penalties of matches of schema Evaluations, and the penalties' goals, in a line."""
    counts = rows.select(FOULS)
    sums, means = counts.sum().row(0, named=True), counts.mean().row(0, named=True)

    def told(whom: str, taker: str) -> str:
        penalties, goals = sums[f"penalties_{whom}"], sums[f"penalty_goals_{whom}"]
        became = f" ({100 * goals / penalties:.0f} % a goal within {PENALTY_S:g} s)" if penalties else ""
        given = f"{means[f'penalties_{whom}']:.1f} of them penalties{became}"
        return f"{taker} took {means[f'fouls_{whom}']:.1f} restarts, {given}"

    return f"Fouls a match: {told('for', team)}; {told('against', opponent)}."


def _plain(summary: EvaluationSummary) -> dict[str, object]:
    """The summary for programs; each measure is an object with value, low and high."""
    return {name: value._asdict() if isinstance(value, Measured) else value for name, value in summary}


def _table(summary: EvaluationSummary) -> pl.DataFrame:
    """The summary for people, a row for each quantity."""
    rows = [
        ("wins", summary.win_rate, f"{summary.wins} of {summary.matches}"),
        ("draws", summary.draw_rate, f"{summary.draws} of {summary.matches}"),
        ("losses", summary.loss_rate, f"{summary.losses} of {summary.matches}"),
        ("goal difference a match", summary.goal_difference, ""),
        ("goals for a match", summary.goals_for, ""),
        ("goals against a match", summary.goals_against, ""),
        ("learned behaviours, share of time", summary.learned_time, ""),
        ("the same, share of decisions", summary.learned_share,
         "" if summary.learned_share else "none decided"),
        ("decisions of two frames or fewer", summary.brief, ""),
    ]
    return pl.DataFrame([
        {"": name, "mean": None if m is None else m.value, "95 % low": None if m is None else m.low,
         "95 % high": None if m is None else m.high, "count": count}
        for name, m, count in rows
    ])


def _export(store: Store, one: _Measurement, folder: Path) -> None:
    """Write the matches as CSV, and the summary with its origin as JSON: small, readable, to be kept in git.

    The files do not depend on the time or on the number of processes.
    """
    evaluation, seeds, rows, summary, *_ = one
    said = {
        "command": one.command, "software": software(), "seeds": {"first": seeds[0], "last": seeds[-1]},
        "summary": _plain(summary), "note": note_on(summary.team, summary.opponent),
        "settings": evaluation.model_dump(mode="json"),
    }
    matches = rows.select("seed", "match", "side", "match_seed", "goals_for", "goals_against", "actions",
                          "other_actions", "played_s", "other_s", "brief_actions", *FOULS)
    stem = folder / one.stem
    store.write_bytes(stem.with_name(f"{stem.name}.matches.csv"), matches.write_csv().encode())
    text = encoder.dumps(said, indent=1, allow_nan=False)
    store.write_bytes(stem.with_name(f"{stem.name}.json"), f"{text}\n".encode())


def _option(name: str, word: object) -> str:
    """An option as it is given."""
    if isinstance(word, bool):
        return option(name if word else f"no_{name}")
    return f"{option(name)} {word}"
