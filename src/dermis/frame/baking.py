"""The skin as maps: what a frame knows of it, at the texels of its own uv layout."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import cross, rasterise, texel_corners
from dermis.base.errors import DermisError
from dermis.frame.features.shading import bake as baking_pass
from dermis.frame.features.shading.bake import CHANNELS, COUNT
from dermis.frame.features.shape import curvature
from dermis.frame.features.shape.curvature import make_curvature
from dermis.frame.inputs import Inputs
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, MutableBindings
from dermis.mesh.geometry import uv_cross
from dermis.mesh.mesh import Mesh
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
LOGGER = logging.getLogger("dermis")
_AT_ONCE = 1 << 20  # places; their numbers fit a buffer of WebGPU's default limits
_PICTURE = (64, 64)  # of the frame that lights the atlas, which nobody looks at
_COLOURS_ATLAS, _COLOURS_SIDE = 512, 2048  # of colours alone: the light's map, texels that they are means of
_CONDITIONAL = {
    ("thickness",): "light passes no thin parts: transmission none, or no blurred light",
    ("melanin", "blood"): "the skin is not made of pigments",
}  # outputs that not every scene has, and why


@dataclass(frozen=True, eq=False)
class Baked:
    """Maps of a head's skin, row 0 at the top.

    covered : (n, n) whether a texel's centre lies on skin; the others continue what is beside them
    maps : (n, n) or (n, n, c) of each name of `baked_numbers.CHANNELS` that the scene has
    absent : of those that it has not, why, in words
    """

    covered: NDArray[np.bool_]
    maps: dict[str, Floats]
    absent: dict[str, str]


def bake(renderer: Renderer, scene: Scene, settings: Settings, side: int) -> Baked:
    """Maps of the skin in the layout of its uv, with the light of the scene before and after it spreads.

    settings : of the light's way; size, samples, technique and strands' picture do not count
    side : of the maps, a power of two [texel]

    Texels hold what the frame has at their centres, filtered over a texel's side.

    Raises DermisError for sizes over the device's limits and when the device fails.
    """
    asked = {"size": _PICTURE, "samples": 1, "technique": "texture-space", "parts": "all"}
    settings = settings.model_copy(update=asked)
    absent: dict[str, str] = {}
    outputs = tuple(
        name for names in _CONDITIONAL for name in _there(renderer, scene, settings, names, absent)
    )
    texel, places = layout_places(scene.head.mesh, side)
    numbers = renderer.kept_open.run(partial(_baked, renderer, scene, settings, outputs, places, side))
    return _filled(side, texel, numbers, absent)


def baked_colours(
    renderer: Renderer, scene: Scene, triangle: NDArray[np.integer], weights: NDArray[np.floating]
) -> Floats:
    """(n, 3) albedo at places of triangles, those of eyes and mouths included; linear Rec. 709 [-].

    weights : (n, 2) of the triangles' second and third corner
    """
    settings = Settings(size=_PICTURE, samples=1, atlas=_COLOURS_ATLAS, strands=False)
    places = baking_pass.places_of(triangle, weights)
    found = renderer.kept_open.run(partial(_baked, renderer, scene, settings, (), places, _COLOURS_SIDE))
    return np.ascontiguousarray(found[:, : CHANNELS["albedo"]])


def layout_places(mesh: Mesh, side: int) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Texels of a layout whose centres lie on skin, and their places as bake.wgsl reads them.

    Where two parts overlap, what is not mirrored in uv wins, and of that the last.
    """
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    texel, triangle = rasterise(mesh, side, np.flatnonzero(skin))
    order = np.argsort(uv_cross(mesh.uv[mesh.triangles])[triangle] > 0, kind="stable")
    owner = np.full(side * side, -1, np.int64)
    owner[texel[order]] = triangle[order]
    found = np.flatnonzero(owner >= 0)
    return found, baking_pass.places_of(owner[found], _weights(mesh, side, found, owner[found]))


def _weights(
    mesh: Mesh, side: int, texel: NDArray[np.int64], triangle: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(n, 2) of the second and the third corner."""
    corners = texel_corners(mesh, side, triangle)
    at = np.stack([texel % side, texel // side], axis=1) - corners[:, 0]
    second, third = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = cross(second, third)
    area = np.where(area == 0.0, 1.0, area)
    found = np.clip(np.stack([cross(at, third) / area, cross(second, at) / area], axis=1), 0.0, 1.0)
    return np.asarray(found / np.maximum(found.sum(axis=1, keepdims=True), 1.0))


def _there(
    renderer: Renderer, scene: Scene, settings: Settings, names: tuple[str, ...], absent: dict[str, str]
) -> tuple[str, ...]:
    """The names of outputs, if the scene has them; why not goes into `absent`."""
    try:
        renderer.draw(scene, settings, timed=False, outputs=names)
    except DermisError:
        absent |= dict.fromkeys(names, _CONDITIONAL[names])
        return ()
    return names


def _baked(
    renderer: Renderer,
    scene: Scene,
    settings: Settings,
    outputs: tuple[str, ...],
    places: NDArray[np.uint32],
    side: int,
) -> Floats:
    """(n, COUNT) numbers of the places, in the light of a frame that is drawn for it."""
    renderer.draw(scene, settings, timed=False, outputs=outputs)
    inputs = renderer.prepare(scene, settings, "", outputs)
    bound, made = _bound(renderer, inputs, scene), inputs.resources.outputs
    pigments = made.light.pigments if made is not None and "melanin" in outputs else (0.0, 0.0)
    found = np.empty((len(places), COUNT), np.float32)
    for start in range(0, len(places), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        how = bound, places[part], 1.0 / side, pigments
        found[part] = baking_pass.bake(renderer.device, inputs.constants, *how)
        LOGGER.info("baking maps: %d of %d texels", min(part.stop, len(places)), len(places))
    return found


def _bound(renderer: Renderer, inputs: Inputs, scene: Scene) -> MutableBindings:
    """What the shader reads of the frame."""
    made, device = inputs.resources, renderer.device
    space = make_curvature(device, scene.head.topology.mesh)
    frame = CommandList(device, timed=False)
    curvature.draw(frame, made.head, space)
    frame.submit()
    measured = made.outputs.light.thickness if made.outputs else None
    thickness = baking_pass.no_thickness(device) if measured is None else measured
    own: MutableBindings = {"curvatures": space.smoothed, "thickness_map": thickness}
    return {**inputs.lit, "shade": inputs.view, "scattered": made.scattered, **own}


def _filled(side: int, texel: NDArray[np.int64], numbers: Floats, absent: dict[str, str]) -> Baked:
    """The maps, continued over what no skin covers."""
    covered = np.zeros(side * side, np.bool_)
    covered[texel] = True
    beside, nearest = np.flatnonzero(~covered), _nearest(covered.reshape(side, side))
    maps, first = {}, 0
    for name, count in CHANNELS.items():
        values = numbers[:, first : first + count]
        first += count
        if name in absent:
            continue
        whole = np.zeros((side * side, count), np.float32)
        whole[texel] = values
        whole[beside] = whole[nearest]
        maps[name] = whole.reshape((side, side) if count == 1 else (side, side, count))
    return Baked(covered.reshape(side, side), maps, absent)


def _nearest(covered: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For each texel that is not covered, in order, the nearest that is."""
    from scipy.ndimage import distance_transform_edt

    y, x = distance_transform_edt(~covered, return_distances=False, return_indices=True)
    return np.asarray((y.astype(np.int64) * covered.shape[1] + x)[~covered])
