"""Meshes for Mitsuba: closed surfaces around the skin's medium, and coloured meshes of other materials."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.scene_parts import encode_ply
from dermis.apps.export.targets.mitsuba.xml import XmlBackend
from dermis.apps.truths.mitsuba_scene import interface_gap_mm
from dermis.apps.truths.mitsuba_solid import closed_skin, offset_inwards
from dermis.frame.baking import bake_albedo
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.scene.model import Scene

_SEGMENTS_PER_EDGE = 4  # segments per edge


def skin_meshes(xml_backend: XmlBackend, head: Head) -> dict[str, bytes]:
    """Return the meshes of the skin's surface as PLY files, in a dictionary by shape name.

    Positions are in mm, relative to the head's centre. The shape "skin" has normals and uv, and "caps" closes
    its openings. The shapes "upper" and "upper_caps" lie slightly outside "skin" and "caps". They are used
    only for an index-matched surface, which consists of two layers: an outer and an inner one.

    Raises DermisError if the skin does not enclose a volume.
    """
    mesh, centre = head.mesh, np.array(head.centre_mm, np.float32)
    closed = closed_skin(mesh, head.name)
    closed = replace(closed, positions=(closed.positions - centre).astype(np.float32))
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    outer, _ = offset_inwards(closed, -interface_gap_mm(xml_backend, closed), head.name)
    used, corners = np.unique(mesh.triangles[skin], return_inverse=True)
    solid_vertex = np.unique(mesh.point[used], return_inverse=True)[1]
    attributes = mesh.normals[used], mesh.uv[used]
    count = int(skin.sum())
    files = {}
    for name, surface, caps in (("skin", closed, "caps"), ("upper", outer, "upper_caps")):
        files[name] = encode_ply(corners.reshape(-1, 3), surface.positions[solid_vertex], *attributes)
        if len(surface.triangles) > count:
            cap_vertices, cap_corners = np.unique(surface.triangles[count:], return_inverse=True)
            files[caps] = encode_ply(cap_corners.reshape(-1, 3), surface.positions[cap_vertices])
    return files


class SubdividedTriangles(NamedTuple):
    """Triangles of a mesh, each divided evenly into smaller triangles.

    triangle : (n,) index of the original triangle that contains each new vertex
    weights : (n, 3) barycentric weights of each new vertex in the original triangle
    corners : (m, 3) indices of the new vertices at the corners of each new triangle
    """

    triangle: NDArray[np.int64]
    weights: NDArray[np.float64]
    corners: NDArray[np.int64]


def subdivide_triangles(
    triangles: NDArray[np.integer], segments_per_edge: int = _SEGMENTS_PER_EDGE
) -> SubdividedTriangles:
    """Divide triangles of a mesh, each evenly into `segments_per_edge` ** 2 smaller triangles.

    Neighbouring original triangles share no new vertices.

    triangles : (t,) indices of the original triangles
    segments_per_edge : number of segments per edge of an original triangle after the division
    """
    grid = [(i, j) for i in range(segments_per_edge + 1) for j in range(segments_per_edge + 1 - i)]
    at = {point: index for index, point in enumerate(grid)}
    upward = [
        (at[i, j], at[i + 1, j], at[i, j + 1])
        for i in range(segments_per_edge)
        for j in range(segments_per_edge - i)
    ]
    downward = [
        (at[i + 1, j], at[i + 1, j + 1], at[i, j + 1])
        for i in range(segments_per_edge)
        for j in range(segments_per_edge - i - 1)
    ]
    second, third = np.array(grid, np.float64).T / segments_per_edge
    weights = np.stack([1.0 - second - third, second, third], axis=1)
    first = len(grid) * np.arange(len(triangles))[:, None, None]
    corners = (first + np.array(upward + downward)).reshape(-1, 3)
    weights = np.tile(weights, (len(triangles), 1))
    return SubdividedTriangles(np.repeat(triangles, len(grid)), weights, corners)


def coloured_meshes(renderer: Renderer, scene: Scene, material_indices: Iterable[int]) -> dict[int, bytes]:
    """Return a dictionary from material index to a PLY file of the triangles with this material.

    The triangles are subdivided, with a colour at each vertex instead of maps. Positions are in mm, relative
    to the head's centre.

    material_indices : indices of the materials
    """
    mesh = scene.head.mesh
    parts = {k: subdivide_triangles(np.flatnonzero(mesh.material == k)) for k in material_indices}
    triangle, weights = (np.concatenate([part[i] for part in parts.values()]) for i in (0, 1))
    colours = bake_albedo(renderer, scene, triangle, weights[:, 1:])
    ends = np.cumsum([len(part.triangle) for part in parts.values()])[:-1]
    coloured = zip(parts.items(), np.split(colours, ends), strict=True)
    return {k: _encode_coloured_mesh(scene.head, part, colour) for (k, part), colour in coloured}


def _encode_coloured_mesh(
    head: Head, subdivided_triangles: SubdividedTriangles, vertex_colours: NDArray[np.float32]
) -> bytes:
    mesh, corners = head.mesh, head.mesh.triangles[subdivided_triangles.triangle]
    weights = subdivided_triangles.weights[:, :, None]
    positions = (weights * mesh.positions[corners]).sum(axis=1) - np.array(head.centre_mm)
    normals = (weights * mesh.normals[corners]).sum(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return encode_ply(
        subdivided_triangles.corners, positions, normals, None, np.clip(vertex_colours, 0.0, 1.0)
    )
