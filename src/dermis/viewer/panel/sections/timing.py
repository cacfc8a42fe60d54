"""Device time of each stage over the last frames."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from dermis.viewer.desk import Desk
from dermis.viewer.panel.plots import stacked

TITLE = "Timing"
OPEN = False
_TOTAL = "total"
_GOLDEN = 0.618034  # of the circle of hues between two stages: neighbours never look alike


def draw(desk: Desk) -> None:
    """A graph, and under it each stage of the last frame and its mean."""
    series = stage_series(list(desk.studio.times))
    if not series:
        imgui.text_disabled("the adapter tells no times")
        return
    colours = [colorsys.hls_to_rgb((_GOLDEN * k) % 1.0, 0.6, 0.5) for k in range(len(series))]
    stacked("stages", series, colours, "ms")
    for (name, values), colour in zip(series.items(), colours, strict=True):
        imgui.text_colored(imgui.ImVec4(*colour, 1.0), f"{values[-1]:8.2f} ms")
        imgui.same_line()
        imgui.text(f"{name}, mean {values.mean():.2f}")
    whole = np.sum(list(series.values()), axis=0)
    imgui.text(f"{whole[-1]:8.2f} ms of {len(whole)} frames' mean {whole.mean():.2f}")


def stage_series(frames: Sequence[dict[str, float]]) -> dict[str, NDArray[np.float64]]:
    """(n,) times of each stage over n frames, 0 in frames without it [ms]."""
    names = dict.fromkeys(name for frame in frames for name in frame if name != _TOTAL)
    return {name: np.array([frame.get(name, 0.0) for frame in frames], np.float64) for name in names}
