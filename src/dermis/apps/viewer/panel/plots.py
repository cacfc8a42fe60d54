"""Plots of the panel: the diffusion profile and the stages' times."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui, implot
from numpy.typing import NDArray

from dermis.apps.viewer.session import Session
from dermis.base.errors import DermisError

Floats = NDArray[np.float64]
Colour = tuple[float, float, float]
CHANNELS = ((0.9, 0.35, 0.3), (0.35, 0.8, 0.4), (0.4, 0.55, 1.0))
_HEIGHT = 130.0
_BARE = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
_PLOT = int(_BARE | implot.Flags_.no_inputs | implot.Flags_.no_legend)
_RADII_MM = np.geomspace(0.01, 30.0, 160)
_TOTAL = "total"
_GOLDEN = 0.618034  # of the circle of hues between two stages, so that neighbours never look alike


def plot_profile(session: Session) -> None:
    """Plot r R(r) of the Gaussians that the frame blurs with, by channel."""
    try:
        profile = session.studio.renderer.profile_of(session.state.scene.skin)
    except DermisError:  # the message over the picture says why
        return
    r, values = _RADII_MM, profile.radiant_exitance(_RADII_MM)
    highest = float((r[:, None] * values).max())
    if not _begin("profile", ("r [mm]", "r R(r) [1/mm]"), (r[0], r[-1]), max(highest, 1e-9)):
        return
    implot.setup_axis_scale(int(implot.ImAxis_.x1), int(implot.Scale_.log10))
    for k, (name, colour) in enumerate(zip(("red", "green", "blue"), CHANNELS, strict=True)):
        spec = implot.Spec()
        spec.line_color, spec.line_weight = imgui.ImVec4(*colour, 1.0), 1.5
        implot.plot_line(name, r, np.ascontiguousarray(r * values[:, k]), spec)
    implot.end_plot()


def draw_timing(session: Session) -> None:
    """Plot the stages' times of the last frames, and list those of the last one."""
    series = stage_series(list(session.studio.times))
    if not series:
        imgui.text_disabled("this adapter reports no times")
        return
    total = np.sum(list(series.values()), axis=0)
    colours = [colorsys.hls_to_rgb((_GOLDEN * k) % 1.0, 0.6, 0.5) for k in range(len(series))]
    _plot_stacked(series, colours, total)
    for (name, values), colour in zip(series.items(), colours, strict=True):
        imgui.text_colored(imgui.ImVec4(*colour, 1.0), f"{values[-1]:8.2f} ms")
        imgui.same_line()
        imgui.text(f"{name}, mean {values.mean():.2f}")
    imgui.text(f"{total[-1]:8.2f} ms in total, mean of {len(total)} frames {total.mean():.2f}")


def stage_series(frames: Sequence[dict[str, float]]) -> dict[str, Floats]:
    """(n,) times of each stage over n frames, 0 in frames without it [ms]."""
    names = dict.fromkeys(name for frame in frames for name in frame if name != _TOTAL)
    return {name: np.array([frame.get(name, 0.0) for frame in frames], np.float64) for name in names}


def _plot_stacked(
    series: dict[str, Floats], colours: Sequence[tuple[float, float, float]], total: Floats
) -> None:
    """Areas stacked on one another, the last frame at the right edge."""
    last = max(1.0, len(total) - 1.0)
    if not _begin("stages", ("frames", "ms"), (0.0, last), max(float(total.max()), 1e-3)):
        return
    x, below = np.arange(len(total), dtype=np.float64), np.zeros(len(total))
    for (name, values), colour in zip(series.items(), colours, strict=True):
        spec = implot.Spec()
        spec.fill_color = imgui.ImVec4(*colour, 1.0)
        implot.plot_shaded(name, x, below, below + values, spec)
        below = below + values
    implot.end_plot()


def _begin(label: str, axes: tuple[str, str], across: tuple[float, float], highest: float) -> bool:
    """Begin a plot from 0 to a little above the highest value; returns whether it is visible."""
    if not implot.begin_plot(f"##{label}", imgui.ImVec2(-1.0, _HEIGHT), _PLOT):
        return False
    hidden = int(implot.AxisFlags_.no_tick_labels) if axes[0] == "frames" else 0
    implot.setup_axes(*axes, hidden, 0)
    implot.setup_axes_limits(*across, 0.0, 1.1 * highest, int(imgui.Cond_.always))
    return True
