"""Where the cells lie that give and take light through thin parts, by the surface as it is now."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.atlas.translucency.cells import Cells
from dermis.frame.passes import each, program
from dermis.gpu import Bindings, ComputeProgram, Constants, Device, Recorder

RECEIVER_BYTES, SOURCE_BYTES = 48, 32
"""Of a place that takes light, and of one that gives it; see translucent_pair.wgsl."""

_FACETS: Constants = (("FACETS", 1),)


def space(device: Device, count: int, size: int = 4) -> Any:
    """A buffer for a number of things of some bytes; never without any."""
    return device.space(size * max(1, count))


def draw_receivers(
    graph: Recorder,
    surface: Bindings,
    cells: Cells,
    asked: tuple[Any, int],
    points: Any,
    facets: bool = False,
) -> None:
    """Points, normals and metric of cells that take light.

    surface : resources of geometry.wgsl, and stretch_map of the atlas
    asked : buffer of the places on the mesh, and how many there are
    points : buffer to write to
    facets : whether the metric is that of the triangles, and not the stretch map's
    """
    shader = program(graph.device, "translucency_receivers.wgsl", _FACETS if facets else ())
    listed, count = asked
    bound = {"cells": _record(shader, cells, count), "receivers": listed, "receiver_points": points}
    graph.dispatch("pairs", shader, {**surface, **bound}, each(count))


def draw_sources(
    graph: Recorder, surface: Bindings, cells: Cells, asked: tuple[Any, int], points: Any
) -> None:
    """Centres, normals and areas of cells that give light.

    surface : resources of geometry.wgsl, and the atlas
    asked : buffer of the cells, and how many there are
    points : buffer to write to
    """
    shader = program(graph.device, "translucency_sources.wgsl")
    listed, count = asked
    bound = {"cells": _record(shader, cells, count), "sources": listed, "source_points": points}
    graph.dispatch("pairs", shader, {**surface, **bound}, each(count))


def _record(shader: ComputeProgram, cells: Cells, count: int) -> np.ndarray[Any, Any]:
    shape = {"size": cells.size, "side": cells.side, "stride": cells.stride}
    return shader.record("Cells", **shape, count=count)
