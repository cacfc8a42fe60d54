"""How thick the flesh is below what pixels see, by the pairs of the translucency."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.frame.atlas_layout import PairBuffers, Translucency
from dermis.frame.passes import each, program
from dermis.frame.passes.outputs import planes as outputs
from dermis.frame.passes.outputs.geometry import look_of
from dermis.frame.passes.outputs.planes import Planes
from dermis.frame.projection import Triple
from dermis.gpu import Bindings, Device, Recorder, make_texture, upload


def make_map(device: Device, pairs: PairBuffers) -> Any:
    """A texture of the coarse atlas: the pairs' reach, and 1 where there is surface."""
    surface = pairs.cells.surface
    texels = np.zeros((*surface.shape, 4), np.float32)
    texels[..., 0], texels[..., 3] = pairs.cells.radius_mm * surface, surface
    texture = make_texture(device, surface.shape, "rgba32float", name="thickness")
    upload(device, texture, texels)
    return texture


def measure(graph: Recorder, thin: Translucency, into: Any) -> None:
    """Fill the texture of `make_map` for the surface as it is now [mm]."""
    pairs, shader = thin.pairs, program(graph.device, "outputs/thickness_map.wgsl")
    count, cells = pairs.receivers[1], pairs.cells
    reach = {"count": count, "radius_mm": cells.radius_mm, "spacing2_mm2": cells.spacing_mm**2}
    bound = {
        "reach": shader.record("Reach", **reach),
        "listed": pairs.sums,
        "pairs": pairs.pairs,
        "receiver_points": thin.receiver_points,
        "source_points": thin.source_points,
        "thickness_map": into,
    }
    graph.dispatch("outputs", shader, bound, each(count))


def draw(
    graph: Recorder, planes: Planes, lit: Bindings, look: tuple[Any, Triple], centres: Any, measured: Any
) -> None:
    """Fill the planes.

    lit : resources of the shading
    look : record of the shading, and the head's centre
    centres : texture of the triangles at the pixels' centres
    measured : texture that `measure` filled
    """
    shader = outputs.stage_program(graph.device, planes)
    bound = {**lit, "look": look_of(shader, *look), "centres": centres, "thickness_map": measured}
    outputs.draw(graph, planes, shader, bound)
