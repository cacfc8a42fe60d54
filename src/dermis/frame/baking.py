"""Baking of skin maps: properties and light of the skin at the texels of the uv layout."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import rasterise, texel_corners
from dermis.base.errors import DermisError
from dermis.frame.features.shading import bake as baking_pass
from dermis.frame.features.shading.bake import BAKED_CHANNEL_COUNT, BAKED_CHANNELS
from dermis.frame.features.shape import curvature
from dermis.frame.features.shape.curvature import make_curvature
from dermis.frame.inputs import FrameInputs
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, MutableBindings
from dermis.mesh.geometry import cross_2d, uv_cross
from dermis.mesh.mesh import Mesh
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
LOGGER = logging.getLogger("dermis")
# Surface points per pass, whose results fit in a buffer of the default size limit of WebGPU.
_POINTS_PER_PASS = 1 << 20
_DISCARDED_PICTURE_SIZE = (
    64,
    64,
)  # size of the picture, which is discarded: the frame only has to light the atlas
_ALBEDO_ATLAS_SIDE = 512  # side of the atlas where only albedo is baked [texels]
_ALBEDO_MAP_SIDE = 2048  # side of the maps that sets the filter width where only albedo is baked [texels]
_ABSENCE_REASONS_OF_OUTPUTS = {
    ("thickness",): "no light crosses thin parts: transmission is none, or no light is blurred",
    ("melanin", "blood"): "the skin is not made of pigments",
}  # outputs that only some scenes have, and the reason why other scenes lack them


@dataclass(frozen=True, eq=False)
class BakedMaps:
    """Maps of the skin of a head in its uv layout, row 0 at the top.

    covered : (n, n) mask of texels whose centre is on skin; any other texel is a copy of the nearest texel in
        the mask
    maps : dictionary from a name in `features.shading.bake.BAKED_CHANNELS` to an (n, n) or (n, n, c) map
    absent : dictionary from the name of each missing map to the reason why it is missing
    """

    covered: NDArray[np.bool_]
    maps: dict[str, Floats]
    absent: dict[str, str]


def bake(renderer: Renderer, scene: Scene, settings: Settings, map_side: int) -> BakedMaps:
    """Compute maps of a head's skin: properties of the surface, and light before and after scattering.

    settings : settings of the frame; `size`, `samples`, `technique` and `strands` are ignored
    map_side : side of the maps, a power of two [texels]

    The maps are evaluated at the centres of texels, with a filter as wide as a texel.

    Raises DermisError for sizes that exceed the limits of the device, and if the device fails.
    """
    changes = {"size": _DISCARDED_PICTURE_SIZE, "samples": 1, "technique": "texture-space", "parts": "all"}
    settings = settings.model_copy(update=changes)
    absent: dict[str, str] = {}
    outputs = tuple(
        name
        for names in _ABSENCE_REASONS_OF_OUTPUTS
        for name in _available_outputs(renderer, scene, settings, names, absent)
    )
    texel, points = texel_surface_points(scene.head.mesh, map_side)
    job = partial(_bake_points, renderer, scene, settings, outputs, points, map_side)
    return _arrange_as_maps(map_side, texel, renderer.reopening_device.run(job), absent)


def bake_albedo(
    renderer: Renderer,
    scene: Scene,
    triangle_index: NDArray[np.integer],
    barycentric_weights: NDArray[np.floating],
) -> Floats:
    """Return the (n, 3) linear Rec. 709 albedo at surface points of skin, eyes or mouth [-].

    triangle_index : (n,) indices of the triangles on which the points lie
    barycentric_weights : (n, 2) barycentric weights of the second and third corner
    """
    settings = Settings(size=_DISCARDED_PICTURE_SIZE, samples=1, atlas=_ALBEDO_ATLAS_SIDE, strands=False)
    points = baking_pass.bake_point_words(triangle_index, barycentric_weights)
    job = partial(_bake_points, renderer, scene, settings, (), points, _ALBEDO_MAP_SIDE)
    values = renderer.reopening_device.run(job)
    return np.ascontiguousarray(values[:, : BAKED_CHANNELS["albedo"]])


def texel_surface_points(mesh: Mesh, map_side: int) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Return the indices of texels whose centres are on skin, and the surface points at these centres.

    The surface points are packed for bake.wgsl.

    Where triangles overlap in uv, a triangle that is not mirrored takes precedence over a mirrored triangle,
    and a later triangle over an earlier triangle.
    """
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    texel, triangle = rasterise(mesh, map_side, np.flatnonzero(skin))
    order = np.argsort(uv_cross(mesh.uv[mesh.triangles])[triangle] > 0, kind="stable")
    owner = np.full(map_side * map_side, -1, np.int64)
    owner[texel[order]] = triangle[order]
    covered = np.flatnonzero(owner >= 0)
    return covered, baking_pass.bake_point_words(
        owner[covered], _texel_weights(mesh, map_side, covered, owner[covered])
    )


def _texel_weights(
    mesh: Mesh, map_side: int, texel_index: NDArray[np.int64], triangle_index: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return (n, 2) barycentric weights of texel centres for the second and third corner of their triangles.

    map_side : side of the maps [texels]
    texel_index : (n,) indices of the texels, counted row by row
    triangle_index : (n,) indices of the triangles that cover these texels
    """
    corners = texel_corners(mesh, map_side, triangle_index)
    offset = np.stack([texel_index % map_side, texel_index // map_side], axis=1) - corners[:, 0]
    second, third = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = cross_2d(second, third)
    area = np.where(area == 0.0, 1.0, area)
    weights = np.stack([cross_2d(offset, third) / area, cross_2d(second, offset) / area], axis=1)
    weights = np.clip(weights, 0.0, 1.0)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1.0))


def _available_outputs(
    renderer: Renderer,
    scene: Scene,
    settings: Settings,
    output_names: tuple[str, ...],
    absence_reasons: dict[str, str],
) -> tuple[str, ...]:
    """Return `output_names`, or () if the renderer cannot compute these outputs for the scene.

    absence_reasons : dictionary from the name of a missing output to the reason; if the result is (), the
        outputs are added to this dictionary
    """
    try:
        renderer.draw(scene, settings, timed=False, outputs=output_names)
    except DermisError:
        absence_reasons |= dict.fromkeys(output_names, _ABSENCE_REASONS_OF_OUTPUTS[output_names])
        return ()
    return output_names


def _bake_points(
    renderer: Renderer,
    scene: Scene,
    settings: Settings,
    output_names: tuple[str, ...],
    packed_points: NDArray[np.uint32],
    map_side: int,
) -> Floats:
    """Compute (n, BAKED_CHANNEL_COUNT) properties and light of the skin at n surface points.

    A frame is rendered first, because it computes the light in the atlas.

    output_names : names of outputs whose resources bake.wgsl needs
    packed_points : (n, 4) surface points, packed by `features.shading.bake.bake_point_words`
    map_side : side of the maps, which sets the width of filters [texels]
    """
    renderer.draw(scene, settings, timed=False, outputs=output_names)
    inputs = renderer.prepare(scene, settings, "", output_names)
    bindings, output_resources = _bake_bindings(renderer, inputs, scene), inputs.resources.outputs
    pigments = (
        output_resources.light.pigments if output_resources and "melanin" in output_names else (0.0, 0.0)
    )
    values = np.empty((len(packed_points), BAKED_CHANNEL_COUNT), np.float32)
    for start in range(0, len(packed_points), _POINTS_PER_PASS):
        part = slice(start, start + _POINTS_PER_PASS)
        options = bindings, packed_points[part], 1.0 / map_side, pigments
        values[part] = baking_pass.bake(renderer.device, inputs.constants, *options)
        LOGGER.info("baking maps: %d of %d texels", min(part.stop, len(packed_points)), len(packed_points))
    return values


def _bake_bindings(renderer: Renderer, inputs: FrameInputs, scene: Scene) -> MutableBindings:
    """Return the resources of bake.wgsl: resources of a rendered frame, plus curvature and thickness."""
    resources, device = inputs.resources, renderer.device
    skin_curvature = make_curvature(device, scene.head.topology_head.mesh)
    frame = CommandList(device, timed=False)
    curvature.draw(frame, resources.head, skin_curvature)
    frame.submit()
    measured = resources.outputs.light.thickness if resources.outputs else None
    thickness = baking_pass.placeholder_thickness(device) if measured is None else measured
    added: MutableBindings = {"curvatures": skin_curvature.smoothed, "thickness_map": thickness}
    return {**inputs.bindings, "shade": inputs.view, "scattered": resources.scattered, **added}


def _arrange_as_maps(
    map_side: int, texel_index: NDArray[np.int64], texel_values: Floats, absence_reasons: dict[str, str]
) -> BakedMaps:
    """Arrange the channels of skin texels as maps, and fill any other texel from the nearest skin texel.

    map_side : side of the maps [texels]
    texel_index : (n,) indices of the skin texels, counted row by row
    texel_values : (n, BAKED_CHANNEL_COUNT) values of these texels; `BAKED_CHANNELS` names the columns
    absence_reasons : dictionary from the name of each output that could not be computed to the reason
    """
    covered = np.zeros(map_side * map_side, np.bool_)
    covered[texel_index] = True
    uncovered, nearest = (
        np.flatnonzero(~covered),
        _nearest_covered_texels(covered.reshape(map_side, map_side)),
    )
    maps, first = {}, 0
    for name, count in BAKED_CHANNELS.items():
        channels = texel_values[:, first : first + count]
        first += count
        if name in absence_reasons:
            continue
        image = np.zeros((map_side * map_side, count), np.float32)
        image[texel_index] = channels
        image[uncovered] = image[nearest]
        maps[name] = image.reshape((map_side, map_side) if count == 1 else (map_side, map_side, count))
    return BakedMaps(covered.reshape(map_side, map_side), maps, absence_reasons)


def _nearest_covered_texels(covered_mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return, for each texel outside a mask, the flat index of the nearest texel inside the mask."""
    from scipy.ndimage import distance_transform_edt

    y, x = distance_transform_edt(~covered_mask, return_distances=False, return_indices=True)
    return np.asarray((y.astype(np.int64) * covered_mask.shape[1] + x)[~covered_mask])
