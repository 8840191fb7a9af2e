"""Style of all plots: colours, plain axes, and reproducible bytes."""

from __future__ import annotations

import io
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure

#: A matplotlib line style: a name, or an offset with lengths of dashes and gaps in points.
Dashes = str | tuple[int, tuple[float, ...]]

#: Okabe and Ito's colours, which colour-blind people can tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def plain(axes: Axes, grid: Literal["x", "y"], *without: str) -> None:
    """Put an axis's grid behind everything; remove the frame at the top, the right and the sides named."""
    axes.grid(axis=grid, color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right", *without):
        axes.spines[side].set_visible(False)


def plot_png(figure: Figure, dpi: int = 110) -> bytes:
    """PNG of a figure; equal figures give equal bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})
    return buffer.getvalue()
