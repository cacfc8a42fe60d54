"""Plots of the panel: layers of a sum over time, and curves over a logarithmic axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from imgui_bundle import imgui, implot
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Grey = tuple[float, float, float]
_HEIGHT = 130.0
_BARE = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
_PLOT = int(_BARE | implot.Flags_.no_inputs | implot.Flags_.no_legend)


def stacked(label: str, series: Mapping[str, Floats], colours: Sequence[Grey], unit: str) -> None:
    """Areas one on top of another, the last value at the right edge."""
    count = len(next(iter(series.values())))
    top = float(np.sum(list(series.values()), axis=0).max())
    if not implot.begin_plot(f"##{label}", imgui.ImVec2(-1.0, _HEIGHT), _PLOT):
        return
    implot.setup_axes("frames", unit, int(implot.AxisFlags_.no_tick_labels), 0)
    limits = 0.0, max(1.0, count - 1.0), 0.0, 1.1 * max(top, 1e-3)
    implot.setup_axes_limits(*limits, int(imgui.Cond_.always))
    x, below = np.arange(count, dtype=np.float64), np.zeros(count)
    for (name, values), colour in zip(series.items(), colours, strict=True):
        spec = implot.Spec()
        spec.fill_color = imgui.ImVec4(*colour, 1.0)
        implot.plot_shaded(name, x, below, below + values, spec)
        below = below + values
    implot.end_plot()


def curves(label: str, x: Floats, series: Mapping[str, Floats], colours: Sequence[Grey], axes: str) -> None:
    """Curves over a logarithmic axis, from 0 to a little more than the highest.

    axes : what x and y are, with a comma between them
    """
    top = max(float(values.max()) for values in series.values())
    if not implot.begin_plot(f"##{label}", imgui.ImVec2(-1.0, _HEIGHT), _PLOT):
        return
    across, up = axes.split(", ")
    implot.setup_axes(across, up)
    implot.setup_axis_scale(int(implot.ImAxis_.x1), int(implot.Scale_.log10))
    limits = float(x[0]), float(x[-1]), 0.0, 1.1 * max(top, 1e-9)
    implot.setup_axes_limits(*limits, int(imgui.Cond_.always))
    for (name, values), colour in zip(series.items(), colours, strict=True):
        spec = implot.Spec()
        spec.line_color, spec.line_weight = imgui.ImVec4(*colour, 1.0), 1.5
        implot.plot_line(name, x, np.ascontiguousarray(values), spec)
    implot.end_plot()
