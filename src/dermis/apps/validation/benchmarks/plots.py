"""Plots of a benchmark as SVG: time over each of the frame's sizes, and the usual frame by stage."""

from __future__ import annotations

from collections.abc import Callable
from io import StringIO
from typing import TYPE_CHECKING, Any

from dermis.base.extras import needed

if TYPE_CHECKING:
    from dermis.apps.validation.benchmarks.measure import Row
    from dermis.apps.validation.benchmarks.run import Benchmark

_TEXT, _TOTAL, _FLOOR = "#c8c8d0", "#e8a87c", "#6fb3b8"
_AXES: dict[str, tuple[str, Callable[[Row], float]]] = {
    "image": ("image [megapixel]", lambda row: row.case.image[0] * row.case.image[1] / 1e6),
    "atlas": ("side of the atlas [texel]", lambda row: row.case.atlas),
    "gaussians": ("Gaussians", lambda row: row.case.gaussians),
    "lights": ("lights with shadows", lambda row: row.case.lights),
    "subdivide": ("triangles [thousand]", lambda row: row.triangles / 1e3),
}


def plain(number: float) -> str:
    """Three significant digits without an exponent."""
    return f"{number:.0f}" if number >= 1000 else f"{number:.3g}"


def scaling(made: Benchmark) -> str:
    """Device time and floor over each size that was varied, as SVG text."""
    varied = [name for name in _AXES if any(row.case.varies == name for row in made.rows)]
    if not varied:
        return ""
    figure, panels = _figure(width=3.4 * len(varied), height=2.9, columns=len(varied))
    for axes, name in zip(panels, varied, strict=True):
        label, value = _AXES[name]
        rows = sorted((row for row in made.rows if row.case.varies in ("", name)), key=value)
        across = [value(row) for row in rows]
        axes.plot(across, [row.gpu_ms["total"] for row in rows], "o-", color=_TOTAL, label="device", ms=4)
        axes.plot(across, [row.floor_ms["total"] for row in rows], "s--", color=_FLOOR, label="floor", ms=3)
        axes.set(xlabel=label, xscale="log", yscale="log")
        _marks(axes.xaxis, across)
        _marks(axes.yaxis, None)
    panels[0].set_ylabel("ms a frame")
    panels[0].legend(frameon=False, labelcolor=_TEXT, fontsize=8)
    return _svg(figure)


def stages(row: Row) -> str:
    """Device time of each stage and its floor as bars, as SVG text."""
    names = [stage for stage in row.gpu_ms if stage != "total"]
    figure, (axes,) = _figure(width=7.0, height=0.34 * len(names) + 0.9, columns=1)
    places = range(len(names))
    axes.barh(places, [row.gpu_ms[name] for name in names], 0.7, color=_TOTAL, label="device")
    axes.barh(places, [row.floor_ms.get(name, 0.0) for name in names], 0.3, color=_FLOOR, label="floor")
    axes.set_yticks(places, names)
    axes.invert_yaxis()
    axes.set_xlabel("ms")
    axes.legend(frameon=False, labelcolor=_TEXT, fontsize=8)
    return _svg(figure)


def _figure(width: float, height: float, columns: int) -> tuple[Any, list[Any]]:
    figure = needed("matplotlib.figure", "plots").Figure(figsize=(width, height), layout="constrained")
    figure.patch.set_alpha(0.0)
    panels = list(figure.subplots(1, columns, squeeze=False)[0])
    for axes in panels:
        axes.patch.set_alpha(0.0)
        axes.tick_params(colors=_TEXT, labelsize=8, which="both")
        axes.xaxis.label.set_color(_TEXT)
        axes.yaxis.label.set_color(_TEXT)
        axes.grid(alpha=0.2, linewidth=0.5)
        for spine in axes.spines.values():
            spine.set_visible(False)
    return figure, panels


def _marks(axis: Any, places: list[float] | None) -> None:
    """Plain numbers at the measured places, or at round ones."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(FixedLocator(places) if places else LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))


def _svg(figure: Any) -> str:
    from matplotlib import rc_context

    drawn = StringIO()
    with rc_context({"svg.hashsalt": "dermis", "svg.fonttype": "none"}):
        figure.savefig(drawn, format="svg", metadata={"Date": None})
    return drawn.getvalue().partition("<svg")[2].join(("<svg", ""))
