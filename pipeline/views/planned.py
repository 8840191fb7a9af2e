"""The plan of a run as a web page: the graph of stages, coloured by what stands, and the reasons below it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from markupsafe import Markup

from pitchlore.pipeline.engine.planning import RunPlan, StagePlan

#: Size of a stage's box and the room between two, pixels.
_WIDTH, _HEIGHT, _GAP, _FALL = 150, 46, 26, 40
#: Meaning of each colour.
_COLOURS = {"fresh": "stands", "new": "would be made", "perhaps": "perhaps", "refused": "refused"}
#: Outputs that are named for a reason of a stage; the others are counted.
_NAMED = 5
_STYLE = Markup("""
:root { --ground: #fff; --ink: #1b2430; --quiet: #5d6875; --line: #c3cad2; --box: #eef1f4;
        --new: #ffe0a3; --perhaps: #fff4d9; --refused: #f6c6c0; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #14181d; --ink: #e6eaee; --quiet: #a3adb8; --line: #48525d; --box: #222a32;
          --new: #7a5a10; --perhaps: #4a3f22; --refused: #6e302a; } }
body { background: var(--ground); color: var(--ink); font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto;
       max-width: 60rem; padding: 0 1rem; }
svg { max-width: 100%; height: auto; } svg text { fill: var(--ink); font-size: 13px; }
svg .count { fill: var(--quiet); font-size: 11px; }
path { fill: none; stroke: var(--line); stroke-width: 1.2; }
.fresh { fill: var(--box); } .new { fill: var(--new); } .perhaps { fill: var(--perhaps); }
.refused { fill: var(--refused); } rect { stroke: var(--line); }
table { border-collapse: collapse; }
td, th { text-align: left; padding: .2rem .8rem .2rem 0; vertical-align: top; }
td { border-top: 1px solid var(--line); overflow-wrap: anywhere; } .quiet { color: var(--quiet); }
""")


def plan_page(plan: RunPlan, where: str) -> str:
    """A web page that needs no network: the graph of stages, and a row for each reason.

    Args:
        plan: the plan.
        where: the data folder, for the heading.
    """
    sure, perhaps = plan.work_s
    outputs, others = plan.counts
    said = (f"{outputs} to make, {sure:.1f} s of work; perhaps {others} more, "
            f"{perhaps:.1f} s. The cost is by {plan.runs} run{'' if plan.runs == 1 else 's'} in the log.")
    if not outputs + others:
        said = "Nothing to make: every receipt holds."
    swatch = Markup(
        '<svg width="14" height="14" aria-hidden="true"><rect class="{}" width="14" height="14"/></svg> {}')
    key = Markup(" ").join(swatch.format(*each) for each in _COLOURS.items())
    rows = Markup().join(row for stage in plan.stages for row in _reasons(stage))
    head = Markup("<tr><th>stage</th><th>reason</th><th>outputs</th></tr>") if rows else Markup()
    notes = Markup().join(Markup("<p>{}</p>").format(note) for note in plan.notes)
    return str(Markup(
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>Plan of {where}</title>'
        '<meta name="viewport" content="width=device-width"><style>{style}</style></head><body>'
        '<h1>What a run would do</h1><p class="quiet">{where}</p><p>{said}</p><p>{key}</p><p>{graph}</p>'
        '{notes}<table>{head}{rows}</table></body></html>\n').format(
            where=where, style=_STYLE, said=said, key=key, graph=_graph(plan), notes=notes, head=head,
            rows=rows))


def _reasons(stage: StagePlan) -> Iterator[Markup]:
    """The rows of a stage's reasons."""
    for detail, sure, outputs in stage.reasons(_NAMED):
        yield Markup("<tr><td>{}</td><td>{}</td><td>{}</td></tr>").format(
            stage.noun, detail if sure else f"perhaps, {detail}", outputs)


def _graph(plan: RunPlan) -> Markup:
    """The stages as boxes, each below all that it is made from; a line is left out if others imply it."""
    level: dict[str, int] = {}
    above: dict[str, set[str]] = {}
    for stage in plan.stages:
        level[stage.noun] = 1 + max((level[noun] for noun in stage.inputs), default=-1)
        above[stage.noun] = {*stage.inputs}.union(*(above[noun] for noun in stage.inputs))
    ranks = [[noun for noun, own in level.items() if own == each] for each in range(1 + max(level.values()))]
    width = max(map(len, ranks)) * (_WIDTH + _GAP) - _GAP
    place = dict[str, tuple[float, float]]()
    for row, rank in enumerate(ranks):
        left = (width - len(rank) * (_WIDTH + _GAP) + _GAP) / 2
        for at, noun in enumerate(rank):
            place[noun] = left + at * (_WIDTH + _GAP), row * (_HEIGHT + _FALL)
    edges = Markup().join(
        _edge(place, noun, stage.noun) for stage in plan.stages for noun in stage.inputs
        if not any(noun in above[other] for other in stage.inputs))
    boxes = Markup().join(_box(stage, *place[stage.noun]) for stage in plan.stages)
    height = len(ranks) * (_HEIGHT + _FALL) - _FALL
    return Markup(
        '<svg viewBox="-1 -1 {} {}" width="{}" role="img" aria-label="Graph of the stages">{}{}</svg>'
    ).format(width + 2, height + 2, width + 2, edges, boxes)


def _edge(place: Mapping[str, tuple[float, float]], above: str, below: str) -> Markup:
    (x, y), (u, v) = place[above], place[below]
    x, u, y = x + _WIDTH / 2, u + _WIDTH / 2, y + _HEIGHT
    return Markup('<path d="M{} {}C{} {} {} {} {} {}"/>').format(x, y, x, y + _FALL, u, v - _FALL, u, v)


def _box(stage: StagePlan, x: float, y: float) -> Markup:
    sure, perhaps = (stage.count(sure=each) for each in (True, False))
    refused = sum(one.why == "refused" for one in stage.todo)
    colour = "new" if sure else "perhaps" if perhaps else "refused" if refused else "fresh"
    counts = {"fresh": stage.fresh, "to make": sure, "perhaps": perhaps, "refused": refused}
    said = ", ".join(f"{count} {word}" for word, count in counts.items() if count) or "nothing yet"
    middle = x + _WIDTH / 2
    return Markup(
        '<rect class="{}" x="{}" y="{}" width="{}" height="{}" rx="6"/>'
        '<text x="{}" y="{}" text-anchor="middle">{}</text>'
        '<text class="count" x="{}" y="{}" text-anchor="middle">{}</text>').format(
            colour, x, y, _WIDTH, _HEIGHT, middle, y + 19, stage.noun, middle, y + 36, said)
