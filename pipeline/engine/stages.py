"""The chain of stages as data: each stage's inputs, version and computation.

Runs, seasons, the catalogue, forget, prune, verify, the goldens and the tests iterate :data:`STAGES`. A new
stage is one entry here. The code of a stage is loaded when it is computed, because commands that only look
at tables iterate this list, too.
"""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.engine import knowledge, models, policies
from pitchlore.pipeline.engine.chain import Chain
from pitchlore.pipeline.engine.habits import recovered_options, what_was_done
from pitchlore.pipeline.engine.inputs import Held, Inputs
from pitchlore.pipeline.engine.stage import Per, Stage
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import (
    ActSettings,
    AnalysisSettings,
    BehaviourSettings,
    ChanceSettings,
    EventSettings,
    GoalSettings,
    GramSettings,
    ModelSettings,
    MomentSettings,
    OptionSettings,
    SideSettings,
    SituationSettings,
    TrajectorySettings,
    ValueSettings,
)
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.pipeline.store.work import Made
from pitchlore.schemas import (
    SIDES,
    Acts,
    Appraisals,
    Behaviours,
    Chances,
    Choices,
    Claims,
    Clues,
    Commands,
    Decisions,
    Efforts,
    Evaluations,
    GameEvents,
    Games,
    Goals,
    Grams,
    Growth,
    Habits,
    HabitTrees,
    Kicks,
    Matches,
    Moments,
    Neurons,
    Occasions,
    Options,
    Paradigms,
    PassAttempts,
    Passes,
    Patterns,
    Phases,
    Policies,
    Possession,
    Pressing,
    Pressure,
    Quality,
    Referee,
    Restarts,
    Returns,
    Sequences,
    Shots,
    Sides,
    Sights,
    Situations,
    Space,
    Stamina,
    States,
    StatesPlayed,
    Trajectories,
    Values,
    Verdicts,
    Worths,
)


def _bodies(inputs: Inputs) -> pl.DataFrame:
    """The match's trajectories; where the log has the ball's heights, with a column z, null elsewhere."""
    table = inputs.table("trajectories", Trajectories)
    if not inputs.details("matches").get("heights"):
        return table
    from pitchlore.pipeline.stages.trajectories.heights import with_heights  # noqa: PLC0415 (see above)

    return with_heights(table, inputs.log().heights)


def _trajectories(inputs: Inputs, settings: TrajectorySettings) -> Made:
    from pitchlore.pipeline.stages.trajectories.derive import trajectories  # noqa: PLC0415 (see above)

    table, quality = trajectories(inputs.log(), settings)
    return Made([(table, Trajectories), (quality, Quality)])


def _situations(inputs: Inputs, settings: SituationSettings) -> Made:
    from pitchlore.pipeline.stages.situations.recognise import recognise  # noqa: PLC0415 (see above)

    found = recognise(_bodies(inputs), inputs.pitch, settings)
    counts = {team: found.filter(pl.col("team") == team).height for team in SIDES}
    return Made([(found, Situations)], details={"situations": counts})


def _options(inputs: Inputs, settings: OptionSettings) -> Made:
    if not settings.recover:
        return Made([(Options.empty(), Options), (Clues.empty(), Clues)], details={"options": 0})
    found, clues, robots = recovered_options(inputs, settings)
    shown = {"robots": {side: own._asdict() for side, own in robots.items() if own.measured}}
    return Made([(found, Options), (clues, Clues)], details={
        "options": found.height, **(shown if settings.robots == "measured" else {})})


def _sides(inputs: Inputs, settings: SideSettings) -> Made:
    from pitchlore.pipeline.stages.sides import sides  # noqa: PLC0415 (see above)

    table = sides(inputs.table("matches", Matches), settings, inputs.details("matches").get("flaws", ()))
    return Made([(table, Sides)], details={
        "kind": table["kind"][0], "counts_as": table["counts_as"].to_list()})


def _goals(inputs: Inputs, settings: GoalSettings) -> Made:
    from pitchlore.pipeline.stages.goals import attribute  # noqa: PLC0415 (see above)

    reported = inputs.details("matches").get("goals", {})
    table = attribute(
        inputs.table("matches", Referee), _bodies(inputs),
        inputs.table("situations", Situations), inputs.pitch, settings, reported.get("from"),
        reported.get("confidence", {}),
    )
    return Made([(table, Goals)], details={"goals": table.height})


def _events(inputs: Inputs, settings: EventSettings) -> Made:
    from pitchlore.pipeline.stages.events.derive import events  # noqa: PLC0415 (see above)

    found = events(_bodies(inputs), inputs.table("matches", Referee), inputs.pitch, settings)
    return Made([(found.possession, Possession), (found.passes, Passes), (found.shots, Shots),
                 (found.pressure, Pressure), (found.restarts, Restarts)])


def _analysis(inputs: Inputs, settings: AnalysisSettings) -> Made:
    from pitchlore.pipeline.stages.analysis.derive import analysis  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.events.derive import Events  # noqa: PLC0415 (see above)

    tables = (Possession, Passes, Shots, Pressure, Restarts)
    found = analysis(_bodies(inputs), inputs.table("matches", Referee),
                     Events(*(inputs.table("events", table) for table in tables)), inputs.pitch, settings)
    return Made(list(zip(found, (PassAttempts, Efforts, Phases, Pressing, Space), strict=True)))


def _moments(inputs: Inputs, settings: MomentSettings) -> Made:
    from pitchlore.pipeline.stages.values.moments import moments  # noqa: PLC0415 (see above)

    table = moments(
        inputs.table("trajectories", Trajectories), inputs.table("matches", Referee), inputs.pitch, settings)
    return Made([(table, Moments)])


def _models(inputs: Inputs, settings: ModelSettings) -> Made:
    from pitchlore.pipeline.stages.values import chances, shooting  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.values.fitting import fit  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.values.models import shipped, to_bytes  # noqa: PLC0415 (see above)

    leagues: dict[str, dict[str, pl.DataFrame]] = {}
    shots: dict[str, dict[str, tuple[pl.DataFrame, Pitch]]] = {}
    tables_of = (inputs.tables("moments", Moments), inputs.tables("events", Shots))
    for match, table, of_match in zip(inputs["matches"], *tables_of, strict=True):
        kind = models.league_kind(match)
        leagues.setdefault(kind, {})[match.name] = table
        shots.setdefault(kind, {})[match.name] = of_match, Pitch.model_validate(match.details["pitch"])
    blobs, reports, of_shots = {}, {}, {}
    for kind, tables in sorted(leagues.items()):
        found, reports[kind] = fit(pl.concat(tables.values()), settings, shipped())
        if found is not None:
            blobs[kind] = ("npz", to_bytes(found))
        by_shots, of_shots[kind] = shooting.fit_shots(shots[kind], settings.penalty)
        blobs[_shots_of(kind)] = ("npz", chances.chances_to_bytes(by_shots))
    matches = {kind: list(tables) for kind, tables in leagues.items()}
    return Made([], blobs=blobs, details={"report": reports, "shots": of_shots, "matches": matches})


def _shots_of(kind: str) -> str:
    """The role of the models of a league's shots."""
    return f"shots-{kind}"


def _chances(inputs: Inputs, settings: ChanceSettings) -> Made:
    from pitchlore.pipeline.stages.values.chances import chances, chances_from_bytes  # noqa: PLC0415 (see above)

    fitted = inputs.blob("models", _shots_of(inputs.pitch.kind))
    (match,) = inputs["matches"]
    table = chances(match.name, inputs.table("events", Shots), inputs.pitch,
                    chances_from_bytes(fitted) if fitted else None, settings)
    return Made([(table, Chances)], details={"goals_at_least": settings.goals_at_least})


def _values(inputs: Inputs, settings: ValueSettings) -> Made:
    from pitchlore.pipeline.stages.values.models import from_bytes, shipped  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.values.worths import values, worths  # noqa: PLC0415 (see above)

    fitted = inputs.blob("models", inputs.pitch.kind)
    table = values(inputs.table("moments", Moments), from_bytes(fitted) if fitted else shipped())
    changed = worths(
        inputs.table("situations", Situations), table, inputs.table("matches", Referee),
        inputs.table("trajectories", Trajectories), settings,
    )
    return Made([(table, Values), (changed, Worths)], details={"models": "fitted" if fitted else "shipped"})


def _acts(inputs: Inputs, settings: ActSettings) -> Made:
    from pitchlore.pipeline.stages.acts.derive import acts  # noqa: PLC0415 (see above)

    tables = {schema.NAME: inputs.table(noun, schema) for noun, schema in (
        ("trajectories", Trajectories), ("goals", Goals), ("values", Values), ("events", Possession),
        ("events", Passes), ("events", Pressure), ("events", Shots))}
    return Made([(acts(tables, inputs.pitch, settings), Acts)])


def _sequences(inputs: Inputs, settings: GramSettings) -> Made:
    from pitchlore.pipeline.stages.sequences.derive import choices, sequences  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.sequences.sights import sights  # noqa: PLC0415 (see above)

    goals, bodies = inputs.table("goals", Goals), inputs.table("trajectories", Trajectories)
    referee = inputs.table("matches", Referee)
    done, worth = what_was_done(inputs, settings, referee, bodies)
    table = sequences(done, goals, worth, bodies, referee, inputs.pitch, settings)
    # a log that is known to hold no decisions is not read
    if inputs.details("matches").get("decisions") == 0 and settings.watched_s is None:
        return Made([(table, Sequences)])
    log = inputs.log()
    logged = choices(log.decisions, goals, settings)
    seen = sights(log, inputs.table("values", Values), settings, table)
    return Made([(table, Sequences), (logged, Choices), (seen, Sights)])


def _counting(sides: Sequence[Held]) -> dict[str, dict[str, Team]]:
    """The teams that the sides of matches count for, by match and side, by the receipts of their sides."""
    return {
        own.name: {side: Team(team, own.details["kind"])
                   for side, team in zip(SIDES, own.details["counts_as"], strict=True) if team is not None}
        for own in sides
    }


def _behaviours(inputs: Inputs, settings: BehaviourSettings) -> Made:
    from pitchlore.pipeline.stages.behaviours.rounds import learn  # noqa: PLC0415 (see above)
    from pitchlore.pipeline.stages.behaviours.som import maps_to_bytes  # noqa: PLC0415 (see above)

    learned = learn(lambda: inputs.batches("sequences", Sequences), _counting(inputs["sides"]), settings)
    return Made(
        [(learned.patterns, Patterns), (learned.grams, Grams), (learned.neurons, Neurons)],
        blobs={f"maps-n{n}": ("npz", maps_to_bytes(maps)) for n, maps in learned.maps.items()},
        details={"reports": learned.reports},
    )


def _decisions(inputs: Inputs, settings: Frozen) -> Made:
    from pitchlore.pipeline.stages.decisions import all_decisions, choosing, decision_digests  # noqa: PLC0415 (see above)

    table = all_decisions(
        lambda: inputs.batches("sequences", Sequences), _counting(inputs["sides"]),
        inputs.table("behaviours", Patterns).filter("kept"), pl.concat(inputs.batches("sequences", Choices)),
    )
    found, logged = decision_digests(table), choosing(table)
    reported = {match.name: {"sha256": found.get(match.name, digest(b"")),
                         "choosing": logged.get(match.name, [])} for match in inputs["sequences"]}
    return Made([(table, Decisions)], details={
        "decisions": table.height, "chosen": int(table["chosen"].sum()), "matches": reported})


STAGES = Chain(
    Stage("matches", Per.MATCH,
          schemas=(Matches, Referee, Quality, Commands, GameEvents, Kicks, Stamina), version=5),
    Stage("sides", Per.MATCH, ("matches",), (Sides,), 2, _sides),
    Stage("trajectories", Per.MATCH, ("matches",), (Trajectories, Quality), 1, _trajectories),
    Stage("situations", Per.MATCH, ("matches", "trajectories"), (Situations,), 4, _situations),
    Stage("options", Per.MATCH, ("matches", "trajectories"), (Options, Clues), 1, _options),
    Stage("goals", Per.MATCH, ("matches", "trajectories", "situations"), (Goals,), 3, _goals),
    Stage("events", Per.MATCH, ("matches", "trajectories"),
          (Possession, Passes, Shots, Pressure, Restarts), 7, _events),
    Stage("analysis", Per.MATCH, ("matches", "trajectories", "events"),
          (PassAttempts, Efforts, Phases, Pressing, Space), 1, _analysis, told=True),
    Stage("moments", Per.MATCH, ("matches", "trajectories"), (Moments,), 1, _moments),
    Stage("models", Per.GROUP, ("matches", "moments", "events"), (), 6, _models,
          choose=models.matches_to_fit),
    Stage("chances", Per.MATCH, ("matches", "events", "models"), (Chances,), 1, _chances),
    Stage("values", Per.MATCH, ("matches", "trajectories", "situations", "moments", "models"),
          (Values, Worths), 4, _values),
    Stage("sequences", Per.MATCH, ("matches", "trajectories", "situations", "options", "goals", "values"),
          (Sequences, Choices, Sights), 4, _sequences),
    Stage("acts", Per.MATCH, ("matches", "trajectories", "goals", "events", "values"), (Acts,), 1, _acts,
          told=True),
    Stage("behaviours", Per.GROUP, ("sides", "sequences"), (Patterns, Grams, Neurons), 7, _behaviours),
    Stage("decisions", Per.GROUP, ("sides", "sequences", "behaviours"), (Decisions,), 3, _decisions),
    Stage("knowledge", Per.VERSION,
          ("matches", "sides", "trajectories", "options", "behaviours", "decisions"),
          (Behaviours, Occasions, Habits, HabitTrees), 2,
          knowledge.compute, knowledge.plan),
    Stage("policies", Per.VERSION, ("matches", "knowledge", "sides", "sequences", "decisions"),
          (Policies, Appraisals, Returns, States), 5,
          policies.compute, policies.plan),
    Stage("paradigms", Per.OWN, schemas=(Paradigms, Verdicts), version=2),
    Stage("seasons", Per.OWN, schemas=(Games, Growth, StatesPlayed), version=2),
    Stage("evaluations", Per.OWN, schemas=(Evaluations,), version=3),
    Stage("report", Per.OWN, ("seasons", "evaluations"), schemas=(Claims,), version=8),
)
