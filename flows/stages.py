"""The chain of stages as data: each stage's inputs, version and computation.

Runs, seasons, the catalogue, forget, prune, verify, the goldens and the tests iterate :data:`STAGES`. A new
stage is one entry here. The code of a stage is loaded when it is computed, because commands that only look
at tables iterate this list, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from flows import knowledge, models, policies
from flows.chain import Chain
from flows.stage import Inputs, Longer, Per, Stage
from pipeline.settings import (
    BehaviourSettings,
    GoalSettings,
    GramSettings,
    ModelSettings,
    MomentSettings,
    SituationSettings,
    TrajectorySettings,
    ValueSettings,
)
from pipeline.store.work import Made
from schemas import (
    SIDES,
    Behaviours,
    Claims,
    Commands,
    Decisions,
    Evaluations,
    Games,
    Goals,
    Grams,
    Growth,
    Matches,
    Moments,
    Occasions,
    Paradigms,
    Patterns,
    Policies,
    Quality,
    Referee,
    Situations,
    StatesPlayed,
    Trajectories,
    Values,
    Verdicts,
    Worths,
)

if TYPE_CHECKING:
    from pipeline.matches.frame import MatchLog


def _log(inputs: Inputs) -> MatchLog:
    """The log of the match."""
    from pipeline import matches  # noqa: PLC0415 (see above)

    data = inputs.blob("matches", "log")
    assert data is not None
    return matches.read(data, where=inputs.where("matches", "log"))


def _trajectories(inputs: Inputs, settings: TrajectorySettings) -> Made:
    from pipeline.trajectories.derive import trajectories  # noqa: PLC0415 (see above)

    table, quality = trajectories(_log(inputs), settings)
    return Made([(table, Trajectories), (quality, Quality)])


def _situations(inputs: Inputs, settings: SituationSettings) -> Made:
    from pipeline.situations.recognise import recognise  # noqa: PLC0415 (see above)

    found = recognise(inputs.table("trajectories", Trajectories), inputs.pitch, settings)
    counts = {team: found.filter(pl.col("team") == team).height for team in SIDES}
    return Made([(found, Situations)], details={"situations": counts})


def _goals(inputs: Inputs, settings: GoalSettings) -> Made:
    from pipeline.goals import attribute  # noqa: PLC0415 (see above)

    table = attribute(
        inputs.table("matches", Referee), inputs.table("trajectories", Trajectories),
        inputs.table("situations", Situations), inputs.pitch, settings,
    )
    return Made([(table, Goals)], details={"goals": table.height})


def _moments(inputs: Inputs, settings: MomentSettings) -> Made:
    from pipeline.values.moments import moments  # noqa: PLC0415 (see above)

    table = moments(
        inputs.table("trajectories", Trajectories), inputs.table("matches", Referee), inputs.pitch, settings)
    return Made([(table, Moments)])


def _models(inputs: Inputs, settings: ModelSettings) -> Made:
    from pipeline.values.models import fit, shipped, to_bytes  # noqa: PLC0415 (see above)

    found, report = fit(pl.concat(inputs.tables("moments", Moments)), settings, shipped())
    return Made([], blobs={"models": ("npz", to_bytes(found))} if found else {}, details={"report": report})


def _values(inputs: Inputs, settings: ValueSettings) -> Made:
    from pipeline.values.models import from_bytes, shipped  # noqa: PLC0415 (see above)
    from pipeline.values.worths import values, worths  # noqa: PLC0415 (see above)

    fitted = inputs.blob("models", "models")
    table = values(inputs.table("moments", Moments), from_bytes(fitted) if fitted else shipped())
    changed = worths(
        inputs.table("situations", Situations), table, inputs.table("matches", Referee),
        inputs.table("trajectories", Trajectories), settings,
    )
    return Made([(table, Values), (changed, Worths)], details={"models": "fitted" if fitted else "shipped"})


def _grams(inputs: Inputs, settings: GramSettings) -> Made:
    from pipeline.grams.count import cover, grams, value  # noqa: PLC0415 (see above)

    changed = inputs.table("values", Worths).select("change", "x", "y")
    valued = value(
        inputs.table("situations", Situations), inputs.table("goals", Goals), settings).hstack(changed)
    longer = list(inputs.tables("behaviours", Patterns))
    taken = cover(valued, pl.concat(longer), settings) if longer else None
    table = grams(valued, inputs.n, taken, settings)
    return Made([(table, Grams)], details={"windows": int(table["count"].sum())})


def _behaviours(inputs: Inputs, settings: BehaviourSettings) -> Made:
    from pipeline.behaviours.select import select  # noqa: PLC0415 (see above)
    from pipeline.behaviours.som import to_bytes  # noqa: PLC0415 (see above)
    from pipeline.grams.count import merge  # noqa: PLC0415 (see above)

    counted = pl.col("team").is_in(settings.teams)
    merged = merge(table.filter(counted) for table in inputs.tables("grams", Grams))
    recognised = sum(int(receipt.details["situations"][team])
                     for receipt in inputs["situations"] for team in settings.teams)
    selection = select(merged, recognised, settings, next(r for r in settings.rounds if r.n == inputs.n))
    return Made(
        [(selection.patterns, Patterns)],
        blobs={"map": ("npz", to_bytes(selection.map))} if selection.map else {},
        details={"report": {k: list(v) if isinstance(v, tuple) else v
                            for k, v in selection.report._asdict().items()}},
    )


def _decisions(inputs: Inputs, settings: GramSettings) -> Made:
    from pipeline.decisions import complete, observe  # noqa: PLC0415 (see above)
    from pipeline.grams.count import value  # noqa: PLC0415 (see above)

    goals = inputs.table("goals", Goals)
    seen = observe(
        value(inputs.table("situations", Situations), goals, settings),
        inputs.table("trajectories", Trajectories), inputs.table("matches", Referee),
        pl.concat(inputs.tables("behaviours", Patterns)), inputs.pitch, settings,
    )
    # a log that is known to hold no decisions is not read
    logged = Decisions.empty() if inputs.details("matches").get("decisions") == 0 else _log(inputs).decisions
    table = complete(seen, value(logged, goals, settings, start="t_ns"))
    return Made([(table, Decisions)],
                details={"decisions": table.height, "chosen": int(table["chosen"].sum())})


STAGES = Chain(
    Stage("matches", Per.MATCH, schemas=(Matches, Referee, Quality, Commands), version=1),
    Stage("trajectories", Per.MATCH, ("matches",), (Trajectories, Quality), 1, _trajectories),
    Stage("situations", Per.MATCH, ("matches", "trajectories"), (Situations,), 2, _situations),
    Stage("goals", Per.MATCH, ("matches", "trajectories", "situations"), (Goals,), 2, _goals),
    Stage("moments", Per.MATCH, ("matches", "trajectories"), (Moments,), 1, _moments),
    Stage("models", Per.GROUP, ("moments",), (), 2, _models, choose=models.choose),
    Stage("values", Per.MATCH, ("matches", "trajectories", "situations", "moments", "models"),
          (Values, Worths), 2, _values),
    Stage("grams", Per.GRAMS, ("situations", "goals", "values", Longer("behaviours")), (Grams,), 2, _grams),
    Stage("behaviours", Per.ROUND, ("grams", "situations"), (Patterns,), 2, _behaviours),
    Stage("decisions", Per.MATCH, ("matches", "trajectories", "situations", "goals", "behaviours"),
          (Decisions,), 1, _decisions),
    Stage("knowledge", Per.VERSION, ("behaviours", "decisions"), (Behaviours, Occasions), 1,
          knowledge.compute, knowledge.plan),
    Stage("policies", Per.VERSION, ("knowledge", "decisions"), (Policies,), 1,
          policies.compute, policies.plan),
    Stage("paradigms", Per.OWN, schemas=(Paradigms, Verdicts), version=1),
    Stage("seasons", Per.OWN, schemas=(Games, Growth, StatesPlayed), version=1),
    Stage("evaluations", Per.OWN, schemas=(Evaluations,), version=1),
    Stage("report", Per.OWN, ("seasons", "evaluations"), schemas=(Claims,), version=3),
)
