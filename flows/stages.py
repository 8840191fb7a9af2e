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
from flows.stage import Inputs, Part, Per, Stage
from pipeline.settings import (
    BehaviourSettings,
    GoalSettings,
    GramSettings,
    ModelSettings,
    MomentSettings,
    SideSettings,
    SituationSettings,
    TrajectorySettings,
    ValueSettings,
)
from pipeline.store.receipts import Receipt
from pipeline.store.work import Made
from pipeline.teams import Team, of_sides
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
    Sequences,
    Sides,
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


def _sides(inputs: Inputs, settings: SideSettings) -> Made:
    from pipeline.sides import sides  # noqa: PLC0415 (see above)

    table = sides(inputs.table("matches", Matches), settings)
    return Made([(table, Sides)], details={
        "kind": table["kind"][0], "counts_as": table["counts_as"].to_list()})


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

    leagues: dict[str, dict[str, pl.DataFrame]] = {}
    for match, table in zip(inputs["matches"], inputs.tables("moments", Moments), strict=True):
        leagues.setdefault(models.kind_of(match), {})[match.name] = table
    blobs, reports = {}, {}
    for kind, tables in sorted(leagues.items()):
        found, reports[kind] = fit(pl.concat(tables.values()), settings, shipped())
        if found is not None:
            blobs[kind] = ("npz", to_bytes(found))
    matches = {kind: list(tables) for kind, tables in leagues.items()}
    return Made([], blobs=blobs, details={"report": reports, "matches": matches})


def _values(inputs: Inputs, settings: ValueSettings) -> Made:
    from pipeline.values.models import from_bytes, shipped  # noqa: PLC0415 (see above)
    from pipeline.values.worths import values, worths  # noqa: PLC0415 (see above)

    fitted = inputs.blob("models", inputs.pitch.kind)
    table = values(inputs.table("moments", Moments), from_bytes(fitted) if fitted else shipped())
    changed = worths(
        inputs.table("situations", Situations), table, inputs.table("matches", Referee),
        inputs.table("trajectories", Trajectories), settings,
    )
    return Made([(table, Values), (changed, Worths)], details={"models": "fitted" if fitted else "shipped"})


def _sequences(inputs: Inputs, settings: GramSettings) -> Made:
    from pipeline.sequences import sequences  # noqa: PLC0415 (see above)

    table = sequences(inputs.table("situations", Situations), inputs.table("goals", Goals),
                      inputs.table("values", Worths), settings)
    return Made([(table, Sequences)])


def _counting(own: Receipt) -> dict[str, Team]:
    """The teams that the sides of a match count for, by the receipt of its sides."""
    return {side: Team(team, own.details["kind"])
            for side, team in zip(SIDES, own.details["counts_as"], strict=True) if team is not None}


def _behaviours(inputs: Inputs, settings: BehaviourSettings) -> Made:
    from pipeline.behaviours.rounds import learn  # noqa: PLC0415 (see above)
    from pipeline.behaviours.som import to_bytes  # noqa: PLC0415 (see above)

    learned = learn(
        lambda: inputs.tables("sequences", Sequences),
        {receipt.name: _counting(receipt) for receipt in inputs["sides"]}, settings)
    return Made(
        [(learned.patterns, Patterns), (learned.grams, Grams)],
        blobs={f"maps-n{n}": ("npz", to_bytes(maps)) for n, maps in learned.maps.items()},
        details={"reports": learned.reports, "held": learned.held},
    )


def _decisions(inputs: Inputs, settings: GramSettings) -> Made:
    from pipeline.decisions import complete, observe  # noqa: PLC0415 (see above)
    from pipeline.sequences import value  # noqa: PLC0415 (see above)

    goals = inputs.table("goals", Goals)
    seen = observe(
        value(inputs.table("situations", Situations), goals, settings),
        inputs.table("trajectories", Trajectories), inputs.table("matches", Referee),
        of_sides(inputs.table("behaviours", Patterns), inputs.table("sides", Sides)),
        inputs.pitch, settings,
    )
    # a log that is known to hold no decisions is not read
    logged = Decisions.empty() if inputs.details("matches").get("decisions") == 0 else _log(inputs).decisions
    table = complete(seen, value(logged, goals, settings, start="t_ns"))
    choosing = table.filter("chosen")["team"].unique(maintain_order=True).to_list()
    return Made([(table, Decisions)], details={
        "decisions": table.height, "chosen": int(table["chosen"].sum()), "choosing": choosing})


STAGES = Chain(
    Stage("matches", Per.MATCH, schemas=(Matches, Referee, Quality, Commands), version=2),
    Stage("sides", Per.MATCH, ("matches",), (Sides,), 1, _sides),
    Stage("trajectories", Per.MATCH, ("matches",), (Trajectories, Quality), 1, _trajectories),
    Stage("situations", Per.MATCH, ("matches", "trajectories"), (Situations,), 2, _situations),
    Stage("goals", Per.MATCH, ("matches", "trajectories", "situations"), (Goals,), 2, _goals),
    Stage("moments", Per.MATCH, ("matches", "trajectories"), (Moments,), 1, _moments),
    Stage("models", Per.GROUP, ("matches", "moments"), (), 2, _models, choose=models.choose),
    Stage("values", Per.MATCH, ("matches", "trajectories", "situations", "moments", "models"),
          (Values, Worths), 2, _values),
    Stage("sequences", Per.MATCH, ("situations", "goals", "values"), (Sequences,), 1, _sequences),
    Stage("behaviours", Per.GROUP, ("sides", "sequences"), (Patterns, Grams), 4, _behaviours),
    Stage("decisions", Per.MATCH,
          ("matches", "sides", "trajectories", "situations", "goals", Part("behaviours", "held")),
          (Decisions,), 2, _decisions),
    Stage("knowledge", Per.VERSION, ("sides", "behaviours", "decisions"), (Behaviours, Occasions), 2,
          knowledge.compute, knowledge.plan),
    Stage("policies", Per.VERSION, ("knowledge", "sides", "decisions"), (Policies,), 2,
          policies.compute, policies.plan),
    Stage("paradigms", Per.OWN, schemas=(Paradigms, Verdicts), version=1),
    Stage("seasons", Per.OWN, schemas=(Games, Growth, StatesPlayed), version=1),
    Stage("evaluations", Per.OWN, schemas=(Evaluations,), version=1),
    Stage("report", Per.OWN, ("seasons", "evaluations"), schemas=(Claims,), version=3),
)
