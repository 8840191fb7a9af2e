"""Plots of paradigms: what is drawn is what the table says, readable and the same every time."""

import numpy as np
import polars as pl
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from support.points import curve, over_decays, point, table

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.views.plots.paradigms import plot_curves, plot_sensitivity
from pitchlore.pipeline.views.plots.style import plot_png
from pitchlore.schemas.paradigms import Paradigms

pytestmark = pytest.mark.slow

PAPER = (0.9997, 0.7, 0.604, 0.781)
DECAYS = {0.99: 0.1, 0.9997: 0.6, 0.9999: 0.3}


def everything():
    return table(
        *(curve(4, name, {0: 1.0, -5: 0.8, -30: 0.3}, decay=decay)
          for name in ("IQ", "JAQ", "IVQ", "FMQ") for decay in (0.998, 0.999, 0.9999)),
        *(over_decays(name, DECAYS) for name in ("IQ", "JAQ", "IVQ", "lenient", "WoLF-PHC")),
        over_decays("IVQ", DECAYS, reading="unbracketed, discount 0.9"),
        over_decays("IVQ", DECAYS, reading="unbracketed, discount 0.9", runs=100),
        *(curve(6, name, {0: 0.5, 7: 0.4, 15: 0.2}, decay=decay, path=6.0)
          for name in ("IL-A", "IL-B", "JAQ", "IVQ", "lenient") for decay in (0.99, 0.9999)),
        *(point(5, name, 0.4, reading=reading, study="sensitivity")
          for name in ("IQ", "IVQ") for reading in ("printed", "in turn")),
    )


def lines(figure):
    """{label: handle} of a figure's legends."""
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    labels = {text.get_text(): handle for legend in legends
              for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True)}
    return {" ".join(label.split()): handle for label, handle in labels.items()}


def look(handle):
    return to_hex(handle.get_color()), handle.get_marker(), handle.get_linestyle(), handle.get_markerfacecolor()


@pytest.mark.parametrize("figure", [4, 5, 6, 7])
def test_axes(figure):
    """Axes have titles and room for all probabilities, and the lowest have a legend."""
    drawn = plot_curves(everything(), figure, paper=PAPER)
    rows = {4: 3, 5: 1, 6: 2, 7: 2}[figure]
    assert len(drawn.axes) == 2 * rows
    assert all(axes.get_xlabel() for axes in drawn.axes[-2:])
    assert all(axes.get_ylabel() for axes in drawn.axes[::2])
    if rows > 1:
        assert [axes.get_title(loc="left")[:3] for axes in drawn.axes[::2]] == ["(a)", "(b)", "(c)"][:rows]
    if figure != 7:
        low, high = drawn.axes[0].get_ylim()
        assert -0.05 < low < 0 < 1 < high < 1.05
    assert all(axes.get_legend() for axes in drawn.axes[-2:])


def test_points_and_intervals():
    """Points and intervals are the table's."""
    points = table(over_decays("IVQ", DECAYS), over_decays("IVQ", DECAYS, reading="b"))
    (axes,) = plot_curves(points, 5).axes
    rows = points.filter(pl.col("reading") == "b").sort("decay")
    drawn = axes.lines[1]
    assert drawn.get_ydata().tolist() == rows["p_optimal"].to_list()
    assert drawn.get_xdata() == pytest.approx([1 / (1 - decay) for decay in rows["decay"]])
    bars = [c for c in axes.collections if isinstance(c, LineCollection)][1].get_segments()
    assert [tuple(segment[:, 1]) for segment in bars] == rows.select("p_low", "p_high").rows()


def test_number_of_runs():
    """The points of the most runs are drawn."""
    points = table(over_decays("IQ", {0.99: 0.2}, runs=2000), over_decays("IQ", {0.99: 0.3}, runs=100))
    assert plot_curves(points, 5).axes[0].lines[0].get_ydata().tolist() == [0.2]


def test_looks():
    """Every learner and reading has a look of its own, the same in all figures."""
    looks = {}
    for figure in (4, 5, 6, 7):
        for label, handle in lines(plot_curves(everything(), figure)).items():
            assert looks.setdefault(label, look(handle)) == look(handle)
    assert len(looks) == len(set(looks.values())) == 9
    by_learner = {label.split(",")[0]: marker for label, (_, marker, _, _) in looks.items()}
    assert len(set(by_learner.values())) == len(by_learner)  # distinguished without colour


def test_papers_point():
    """The paper's point is drawn with its interval, in its own figure only."""
    points = table(over_decays("IVQ", DECAYS))
    assert not any("paper's IVQ" in label for label in lines(plot_curves(points, 5)))
    drawn = plot_curves(points, 5, paper=PAPER)
    assert "the paper's IVQ: 0.7 at 0.9997 (100 runs: 0.60 to 0.78)" in lines(drawn)
    assert not any("paper's IVQ" in label for label in lines(plot_curves(everything(), 4, paper=PAPER)))
    (bar,) = drawn.axes[0].containers[0].lines[2]
    assert bar.get_segments()[0][:, 1] == pytest.approx([0.604, 0.781])


def test_missing_paths():
    """A missing path leaves a gap, and a long one fits on a logarithmic axis."""
    some = [point(6, "IVQ", 0.5, k=0.0, path=5.0), point(6, "IVQ", 0.0, k=1.0), point(6, "IVQ", 0.1, k=2.0, path=90.0, half=None)]
    (axes,) = plot_curves(table(some), 7).axes
    assert np.isnan(axes.lines[0].get_ydata()).tolist() == [False, True, False]
    assert axes.get_yscale() == "log"
    assert axes.get_ylim()[1] > 90


def test_equal_bytes():
    """Equal tables give equal bytes."""
    points = everything()
    for draw in (lambda p: plot_curves(p, 5, paper=PAPER), lambda p: plot_curves(p, 6), plot_sensitivity):
        assert plot_png(draw(points)) == plot_png(draw(points.sample(fraction=1.0, shuffle=True, seed=2)))


def test_forest_rows():
    """A forest has a row for each reading under its learner."""
    (axes,) = plot_sensitivity(everything()).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["IQ", "printed", "in turn", "IVQ", "printed", "in turn"]
    heights = list(axes.get_yticks())
    assert heights == sorted(heights, reverse=True)
    drawn = [line.get_ydata()[0] for line in axes.lines if len(line.get_xdata()) == 1]
    assert sorted(drawn, reverse=True) == [heights[i] for i in (1, 2, 4, 5)]
    assert axes.get_xlabel()
    assert "0.400 [0.379, 0.422]" in {text.get_text() for text in axes.texts}


def test_forest_of_games():
    """A forest of several games has axes for each game and a legend of the settings."""
    points = table(
        point(5, "IVQ", 0.4, study="sensitivity"), point(5, "IVQ", 0.5, decay=0.9999, study="sensitivity"),
        point(4, "IVQ", 0.4, k=-30.0, study="sensitivity"),
        point(4, "IVQ", 0.4, k=-30.0, reading="a reading " * 12, study="sensitivity"),
    )
    drawn = plot_sensitivity(points)
    assert [axes.get_legend().get_title().get_text() for axes in drawn.axes] == ["penalty game", "climbing game"]
    texts = [text.get_text() for text in drawn.axes[1].get_legend().get_texts()]
    assert texts == ["decay 0.9997, 2,000 trainings", "decay 0.9999, 2,000 trainings"]
    assert plot_png(drawn).startswith(b"\x89PNG")


def test_nothing_to_draw():
    """If there are no points to draw, the error says so."""
    for draw in (lambda: plot_curves(Paradigms.empty(), 4), lambda: plot_sensitivity(Paradigms.empty())):
        with pytest.raises(NotFound, match="there are no points"):
            draw()
