"""The command evaluate: measure a team by many matches."""

from __future__ import annotations

import json as encoder
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import polars as pl
from cyclopts import Parameter

from flows.catalog import renew
from flows.commands.common import DEFAULTS, Common, Json, On
from flows.commands.playing import AS_LEARNED, AS_USUAL, TEAM_WORDS, Learners, Many, Playing, Seed
from flows.commands.printing import bars, console, print_frame, print_json, print_stand_in
from flows.evaluations import evaluate
from flows.placement.places import crew_at
from flows.progress import listener
from pipeline.errors import BadSettings
from pipeline.store import Store
from pipeline.store.receipts import software
from pipeline.studies.evaluations import Evaluation, EvaluationSummary, Measured, slug, summarise
from schemas import note_on
from schemas.evaluations import minutes_of, word_of

#: Options: the team that is measured, and its opponent.
WhoIsMeasured = Annotated[str, Parameter(help=f"Team to measure: {TEAM_WORDS}.")]
Against = Annotated[str, Parameter(help=(
    f"Opponent: {TEAM_WORDS}. If a team plays itself, its home side is measured, and each match has its own "
    "seed: this measures the arena."
))]  # fmt: skip


def evaluate_team(
    *,
    policy: WhoIsMeasured = "learned",
    against: Against = "static",
    matches: Many = 200,
    seed: Seed = 0,
    playing: Playing = AS_USUAL,
    learners: Learners = AS_LEARNED,
    on: On = None,
    export: Path | None = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Measure a team by pairs of matches with one seed and sides swapped; 95 % intervals are over the pairs.

    Args:
        policy: Team to measure.
        against: Opponent.
        matches: Number of matches, even. Matches that were played before are not played again.
        seed: Seed of the first pair of matches; each later pair has the next seed.
        playing: How the matches are played.
        learners: How learned teams play.
        on: Where matches are played.
        export: Also write the results into this folder: the matches as CSV, and the summary with command,
            settings, seeds and software as JSON.
        json: Print JSON.
        common: Options of every command.
    """
    if matches % 2:
        raise BadSettings(f"{matches} matches do not come in pairs", where="--matches",
                          next_step=f"Ask for {matches + 1}")
    store = common.store
    how = playing.matches(store)
    (team, opponent), policies = learners.entrants(store, policy, against)
    evaluation = Evaluation(**how.of_match(), team=team, opponent=opponent)
    minutes = how.referee.duration_s / 60
    seeds = range(seed, seed + matches // 2)
    with crew_at(on, store.root) as crew, bars() as progress:
        listener.set(progress)
        rows, played = evaluate(store, evaluation, seeds, policies, crew)
    summary = summarise(rows)
    if json:
        print_json(_plain(summary) | {"minutes": minutes, "seed": seed, "played_now": 2 * played,
                                      "note": note_on(summary.team, summary.opponent)})
    else:
        print_frame(_table(summary), title=(
            f"{summary.team} against {summary.opponent}: {summary.matches} matches of {minutes:g} min,"
            f" {how.robots} a side on {how.pitch.length:g} by {how.pitch.width:g} m"))
        console().print(f"{2 * played} matches played now, {summary.matches - 2 * played} before;"
                        f" intervals are over {summary.pairs} pairs.")
        if evaluation.of_itself:
            console().print("A team against itself: its home side, in matches with seeds of their own.")
        print_stand_in(summary.team, summary.opponent)
    if export:
        command = _command(evaluation, seeds, {
            "settings": playing.settings, "robots": playing.robots, **asdict(learners)})
        _export(store, evaluation, seeds, command, rows, summary, export)
        if not json:
            console().print(f"{export}: {_stem(summary)} written", soft_wrap=True)
    renew(store)


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
        ("share of learned actions", summary.learned_share, "" if summary.learned_share else "none decided"),
    ]
    return pl.DataFrame([
        {"": name, "mean": None if m is None else m.value, "95 % low": None if m is None else m.low,
         "95 % high": None if m is None else m.high, "count": count}
        for name, m, count in rows
    ])


def _stem(summary: EvaluationSummary) -> str:
    """Name of the files of an evaluation, without their ends."""
    return slug(summary.team, summary.opponent)


def _export(
    store: Store, evaluation: Evaluation, seeds: range, command: str, rows: pl.DataFrame,
    summary: EvaluationSummary, folder: Path,
) -> None:
    """Write the matches as CSV, and the summary with its origin as JSON: small, readable, to be kept in git.

    The files do not depend on the time or on the number of processes.
    """
    said = {
        "command": command, "software": software(), "seeds": {"first": seeds[0], "last": seeds[-1]},
        "summary": _plain(summary), "note": note_on(summary.team, summary.opponent),
        "settings": evaluation.model_dump(mode="json"),
    }
    matches = rows.select("seed", "match", "side", "match_seed", "goals_for", "goals_against", "actions",
                          "other_actions")
    stem = folder / _stem(summary)
    store.write_bytes(stem.with_name(f"{stem.name}.matches.csv"), matches.write_csv().encode())
    text = encoder.dumps(said, indent=1, allow_nan=False)
    store.write_bytes(stem.with_name(f"{stem.name}.json"), f"{text}\n".encode())


def _command(evaluation: Evaluation, seeds: range, options: Mapping[str, object]) -> str:
    """The command that plays these matches again, in any data folder that has the teams."""
    team, opponent = (word_of(side.name) for side in (evaluation.team, evaluation.opponent))
    words = {"policy": team, "against": opponent, "matches": 2 * len(seeds), "seed": seeds[0],
             "minutes": minutes_of(evaluation.referee.duration_s), **options}
    said = " ".join(f"--{name} {word}" for name, word in words.items() if word is not None)
    return f"pitchlore evaluate {said}"
