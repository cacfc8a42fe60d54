"""Ambient occlusion of a moving head: the map baked at rest, updated by the changes of vertex visibility."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.features.shape.mesh import HeadGeometry, upload_triangles
from dermis.frame.features.visibility.layers import ViewLayers, draw_layers, make_layers
from dermis.frame.programs import TILE_SIDE, program, workgroup_grid
from dermis.frame.projection import PIXEL_CENTRE, Views, view_axes_array
from dermis.gpu import Bindings, Buffer, CommandList, Device, Recorder, Texture, UniformRecord, make_texture
from dermis.mesh.geometry import fibonacci_sphere
from dermis.mesh.head import Head
from dermis.mesh.morph_targets import no_targets
from dermis.mesh.outline import Outline, RigOutline, rig_outline
from dermis.mesh.rig import PoseArrays
from dermis.mesh.subdivide import coarse_triangles

Floats = NDArray[np.float64]
SKY_VIEW_COUNT = 64
"""Number of directions from which a depth map of the moving head is drawn."""
DEPTH_MAP_SIDE = 256
"""Side of a depth map [texels]."""
_VIEW_MARGIN_MM = 1.0  # free space around the head in a view
_VIEW_BORDER_TEXELS = 2.0  # empty texels around the head, so that points lifted off its surface stay inside
_ROTATION_POINT_RADIUS_MM = (
    100.0  # distance from the middle of the head at which the weight of rotation_points falls to 1/e
)
_MAX_ROTATION_POINT_COUNT = 512
_VERTEX_VISIBILITY_SHADER = "occlusion/moving_occlusion_vertices.wgsl"
# Arguments of `coarse_triangles`: least number of faces, and largest distance of omitted vertices from the
# simplified surface [mm], a quarter of a texel.
_OCCLUDER_MIN_FACES_AND_MAX_ERROR = (5_000, 0.4)


class SkyViews(NamedTuple):
    """Orthographic views of a head from directions all around it, for the depth maps of ambient occlusion.

    views : matrices from world to clip space
    to_map : (k, 3, 4) matrices from world positions to column [texel], row [texel] and depth
    to_sky : (k, 3) unit vectors from the head to the viewpoint
    steps_mm : (k, 2, 3) world-space offsets from a depth map texel to its right and to its upper neighbour
        [mm]
    """

    views: Views
    to_map: Floats
    to_sky: Floats
    steps_mm: Floats


@dataclass(frozen=True, eq=False)
class HeadRotationPoints:
    """Control points whose motion determines the estimated rotation of a head.

    points : (s,) indices of the control points
    offsets : (s, 3) vectors from the weighted mean position to each point at rest, times the point's weight
        [mm]
    outline : the same control points in a form that can be posed: their positions at rest, and the bones that
        move them
    """

    points: NDArray[np.intp]
    offsets: Floats
    outline: RigOutline


def sky_views(outline: Outline, rotation: Floats) -> SkyViews:
    """Return orthographic views from directions all around the head, each just wide enough to show all of it.

    outline : points that bound the head in its current shape
    rotation : (3, 3) rotation of the head, which also rotates the view directions
    """
    axes = _sky_view_axes() @ rotation.T
    local = (axes.reshape(-1, 3).astype(np.float32) @ outline.homogeneous_points[:3]).reshape(
        *axes.shape[:2], -1
    )
    low, high = local.min(axis=2).astype(np.float64), local.max(axis=2).astype(np.float64)
    half, middle = 0.5 * (high - low) + _VIEW_MARGIN_MM, 0.5 * (high + low)
    half[:, 2] += outline.margin_mm
    half[:, :2] *= DEPTH_MAP_SIDE / (DEPTH_MAP_SIDE - 2.0 * _VIEW_BORDER_TEXELS)
    clips = np.zeros((SKY_VIEW_COUNT, 4, 4))
    clips[:, :3, :3], clips[:, :3, 3] = axes / half[..., None], -middle / half
    clips[:, 2] *= -0.5  # from 1 near to 0 far
    clips[:, 2, 3] += 0.5
    clips[:, 3, 3] = 1.0
    to_map = clips[:, :3].copy()
    to_map[:, :2] *= 0.5 * DEPTH_MAP_SIDE * np.array([[1.0], [-1.0]])
    to_map[:, :2, 3] += 0.5 * DEPTH_MAP_SIDE - 0.5
    steps = axes[:, :2] * (2.0 / DEPTH_MAP_SIDE * half[:, :2, None])
    return SkyViews(Views(clips, PIXEL_CENTRE), to_map, -axes[:, 2], steps)


@lru_cache(maxsize=1)
def _sky_view_axes() -> Floats:
    """Return the axes of views of a head at rest from k directions spread evenly around it, (k, 3, 3).

    The axes of a view are unit vectors to its right, upwards and forward.
    """
    up = np.array([0.0, 1.0, 0.0])
    return np.array([view_axes_array(-to_sky, up) for to_sky in fibonacci_sphere(SKY_VIEW_COUNT)])


def make_head_rotation_points(head: Head) -> HeadRotationPoints:
    """Choose control points from whose motion the rotation of a head is estimated.

    Their weights decrease with the distance from the centre of the head, so that moving shoulders have little
    effect.
    """
    rig = head.control_rig
    points = np.unique(np.linspace(0, len(rig.positions_mm) - 1, _MAX_ROTATION_POINT_COUNT).astype(np.intp))
    positions = rig.positions_mm[points].astype(np.float64)
    distance2 = ((positions - head.centre_mm) ** 2).sum(axis=1)
    weight = np.exp(-distance2 / _ROTATION_POINT_RADIUS_MM**2)[:, None]
    offsets = weight * (positions - (weight * positions).sum(axis=0) / weight.sum())
    return HeadRotationPoints(
        points, offsets, rig_outline(rig.positions_mm, no_targets(), rig.skeleton, points)
    )


def head_rotation(rotation_points: HeadRotationPoints, pose_arrays: PoseArrays) -> Floats:
    """Return the (3, 3) rotation that best fits the motion of the `rotation_points` [Kabsch1976].

    Morph targets do not rotate a head and are ignored.
    """
    rest = rotation_points.outline.rest_mm.copy()
    rest[:3] = pose_arrays.positions_mm[rotation_points.points].T
    posed = replace(rotation_points.outline, rest_mm=rest).pose(np.zeros(0, np.float32), pose_arrays.matrices)
    left, _, right = np.linalg.svd(posed.T.astype(np.float64) @ rotation_points.offsets)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return np.asarray(left @ right)


@dataclass(frozen=True, eq=False)
class MovingOcclusion:
    """Resources from which the occlusion map of a moving head is updated.

    rest_map : texture of the occlusion map that was baked at rest
    corners : texture of the vertices that each texel interpolates, as indices and weights, see
        moving_occlusion_corners.wgsl
    """

    rest_map: Texture
    corners: Texture


@dataclass(frozen=True, eq=False)
class VertexSkyVisibility:
    """Visible fraction of the sky at the vertices of a head, and depth maps from which it is computed.

    layers : depth maps from directions all around the head
    occluders : triangles of a simplified head, which are drawn into the depth maps
    visibility : buffer of two fractions for each vertex: at rest and in the current shape
    vertices : number of vertices
    """

    layers: ViewLayers
    occluders: HeadGeometry
    visibility: Buffer
    vertices: int


def make_vertex_sky_visibility(
    device: Device, head: Head, rest_geometry: HeadGeometry
) -> VertexSkyVisibility:
    """Create the resources of `VertexSkyVisibility`, and compute the visibility for the head at rest.

    The visibility of a vertex is the fraction of the sky that is visible from it.

    rest_geometry : the triangles of the head at rest
    """
    count, rig, commands = len(head.mesh.positions), head.control_rig, CommandList(device, timed=False)
    layers = make_layers(device, (DEPTH_MAP_SIDE, DEPTH_MAP_SIDE), SKY_VIEW_COUNT, store_triangles=False)
    occluders = upload_triangles(device, coarse_triangles(head, *_OCCLUDER_MIN_FACES_AND_MAX_ERROR))
    sky = VertexSkyVisibility(
        layers, occluders, device.buffer(np.zeros((count, 2), np.float32), "STORAGE"), count
    )
    views = sky_views(Outline(rig.outline_mm(rig.rest)), np.eye(3))
    _draw_vertex_visibility(
        commands, sky, views, sky_views_record(device, views, count), rest_geometry, is_at_rest=True
    )
    commands.submit()
    return sky


def make_moving_occlusion_map(device: Device, rest_occlusion_map: Texture) -> tuple[Texture, MovingOcclusion]:
    """Return an empty occlusion map for a moving head, and the resources that update it.

    rest_occlusion_map : texture of the occlusion map that was baked at rest
    """
    side, rows = rest_occlusion_map.size[:2]
    corners = make_texture(device, (side, side), "rgba32uint")
    return make_texture(device, (side, rows), "r32float"), MovingOcclusion(rest_occlusion_map, corners)


def draw(
    graph: Recorder,
    vertex_visibility: VertexSkyVisibility,
    views: SkyViews,
    views_record: UniformRecord,
    occlusion_maps: Sequence[tuple[LitAtlas, MovingOcclusion | None]],
) -> None:
    """Declare the passes that update the occlusion maps of all atlas layouts for the current shape.

    views_record : uniform record of `views`, from `sky_views_record`
    occlusion_maps : each atlas layout with the resources that update its occlusion map, None if the layout
        has no map to update
    """
    _draw_vertex_visibility(graph, vertex_visibility, views, views_record, occlusion_maps[0][0].head)
    for layout, occlusion in occlusion_maps:
        if occlusion:
            _draw_occlusion_map(graph, vertex_visibility, layout, occlusion)


def _draw_occlusion_map(
    graph: Recorder, vertex_visibility: VertexSkyVisibility, layout: LitAtlas, occlusion: MovingOcclusion
) -> None:
    """Declare the passes that update the occlusion map of an atlas layout.

    The map is updated from the fractions of the sky that are visible from each vertex: in the current shape,
    and at rest. The pass that finds the vertices around each texel runs only once, because its inputs are
    constant.
    """
    moving_map = cast(Texture, layout.bindings["occlusion_map"])
    bindings: Bindings = {
        **layout.head.resources,
        "atlas": layout.atlas.resources["atlas"],
        "corners": occlusion.corners,
    }
    find_corners = program(graph.device, "occlusion/moving_occlusion_corners.wgsl")
    graph.compute("occlusion", find_corners, bindings, occlusion.corners.size[:2])
    maps: Bindings = {
        "rest_map": occlusion.rest_map,
        "visibility": vertex_visibility.visibility,
        "moving_map": moving_map,
    }
    fill = program(graph.device, "occlusion/moving_occlusion.wgsl")
    graph.compute("occlusion", fill, {**bindings, **maps}, moving_map.size[:2], TILE_SIDE)


def sky_views_record(device: Device, views: SkyViews, vertex_count: int) -> UniformRecord:
    """Return the uniform record of the orthographic views `SkyViews` for moving_occlusion_vertices.wgsl.

    With it, the shader looks up vertices in the depth maps that are drawn from these views.

    vertex_count : number of vertices of the mesh
    """
    record = program(device, _VERTEX_VISIBILITY_SHADER).make_record("Sky", vertices=vertex_count)
    members = record["views"]
    members["column"], members["row"], members["depth"] = views.to_map.swapaxes(0, 1)
    members["to_sky"] = views.to_sky
    members["right"], members["up"] = views.steps_mm.swapaxes(0, 1)
    return record


def _draw_vertex_visibility(
    graph: Recorder,
    vertex_visibility: VertexSkyVisibility,
    views: SkyViews,
    views_record: UniformRecord,
    head: HeadGeometry,
    is_at_rest: bool = False,
) -> None:
    """Declare the passes that compute the visible fraction of the sky at the vertices of a shape.

    views_record : uniform record of `views`, from `sky_views_record`
    is_at_rest : whether `head` is at rest; the fractions are then stored as the fractions at rest
    """
    draw_layers(
        graph,
        "occlusion",
        vertex_visibility.layers,
        views.views,
        vertex_visibility.occluders.with_vertices_of(head),
    )
    bindings: Bindings = {
        **head.resources,
        "sky": views_record,
        "maps": vertex_visibility.layers.texture,
        "visibility": vertex_visibility.visibility,
    }
    shader = program(
        graph.device, _VERTEX_VISIBILITY_SHADER, (("RESTING", is_at_rest),) if is_at_rest else ()
    )
    graph.dispatch("occlusion", shader, bindings, workgroup_grid(vertex_visibility.vertices))
