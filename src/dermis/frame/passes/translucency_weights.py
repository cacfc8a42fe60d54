"""How much light passes between translucent pairs, of the surface as it is and for a profile."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.frame.atlas_layout import PairBuffers, Translucency
from dermis.frame.passes import program
from dermis.frame.passes.translucency import add_up
from dermis.frame.passes.translucency_points import draw_receivers, draw_sources
from dermis.gpu import Bindings, ComputeProgram, Device, Recorder
from dermis.optics.gaussians import MOST_GAUSSIANS
from dermis.optics.thin_parts import ROWS, ThinParts

Floats = NDArray[np.float64]
GRAIN = (
    0.72  # sampled at their spacing, Gaussians of more variance than this times its square are even to 1e-6
)
_ROW, _SIZE = 1024, 64  # pairs of a row, and of a workgroup in it, as in the shader
_SMOOTH = 0.45  # of the spacing; light of this standard deviation has no detail that the sources miss


def draw(graph: Recorder, thin: Translucency) -> None:
    """Weigh the pairs of the surface as it is now, and sum what it does not return because of them."""
    pairs, cells = thin.pairs, thin.pairs.cells
    draw_receivers(graph, thin.surface, cells, pairs.receivers, thin.receiver_points)
    draw_sources(graph, thin.surface, cells, pairs.sources, thin.source_points)
    bound = {
        "pairs": pairs.pairs,
        "receiver_points": thin.receiver_points,
        "source_points": thin.source_points,
        "weights": thin.weights,
    }
    shader, groups = _shader(graph.device, thin.gaussians, thin.slabs), max(1, -(-pairs.count // _ROW))
    for weighed in (thin.losing, thin.weighing):
        graph.dispatch("pairs", shader, {**bound, **weighed}, (_ROW // _SIZE, groups, 1))
        if weighed is thin.losing:
            add_up(graph, thin, thin.evenly, pairs.lost, stage="pairs")


def source_level(spacing_mm: float, variance_mm2: Floats) -> int:
    """The blurred level that is smooth enough for the sources to tell all of it."""
    smooth = np.flatnonzero(variance_mm2 >= (_SMOOTH * spacing_mm) ** 2)
    return int(smooth[0]) if len(smooth) else len(variance_mm2) - 1


def weighing(
    device: Device,
    pairs: PairBuffers,
    variance_mm2: Floats,
    weight: Floats,
    thin: ThinParts | None = None,
    passing: Floats | None = None,
) -> Bindings:
    """The record of a profile's pass, and its table.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    passing : (ROWS, k, 3) of the tables of thin parts
    """
    gaussian = np.zeros((MOST_GAUSSIANS, 4), np.float32)
    gaussian[: len(weight), :3], gaussian[: len(weight), 3] = weight, variance_mm2
    record = _shader(device, len(weight), thin is not None).record(
        "Weighing",
        reach_mm=1.0 if thin is None else thin.reach_mm,
        radius_mm=pairs.cells.radius_mm,
        before_mm2=variance_mm2[source_level(pairs.cells.spacing_mm, variance_mm2)],
        cell_mm2=pairs.cells.spacing_mm**2,
        grain=GRAIN,
        gaussian=gaussian,
    )
    return {"weighing": record, "passing": device.buffer(_table(len(weight), thin, passing), "STORAGE")}


def _table(gaussians: int, thin: ThinParts | None, passing: Floats | None) -> NDArray[np.float32]:
    """(ROWS k, 4) what passes by thickness and Gaussian, and how deep each thickness is; one row for none."""
    if thin is None or passing is None:
        return np.zeros((1, 4), np.float32)
    table = np.zeros((ROWS, gaussians, 4), np.float32)
    table[..., :3], table[:, 0, 3] = passing, thin.deep
    return table.reshape(-1, 4)


def _shader(device: Device, gaussians: int, slabs: bool) -> ComputeProgram:
    return program(device, "translucency_weights.wgsl", (("COUNT", gaussians), ("SLABS", slabs)))
