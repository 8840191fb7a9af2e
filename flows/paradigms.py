"""The curves and reports of section 5, brought up to date."""

from pathlib import Path

from pitchlore.pipeline.engine.paradigms import bring_curves_up_to_date
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.run import concluded, suspecting
from pitchlore.pipeline.stages.paradigms.experiments import Design
from pitchlore.pipeline.views.plots.paradigms import plots_of_points


def play_paradigms(data: Path, design: Design = Design(), on: str | None = None) -> StageReport:
    """Play the missing curves of a design, then report on its figures."""
    store = suspecting(data)
    with placed(on, store.root):
        return concluded(store, bring_curves_up_to_date(store, design, plots_of_points))
