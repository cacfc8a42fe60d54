"""Meshes of a head for Mitsuba: closed surfaces about the skin's medium, and its other parts with colours."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.scene_parts import encode_ply
from dermis.apps.export.targets.mitsuba.xml import XmlBackend
from dermis.apps.truths.mitsuba_scene import interface_gap_mm
from dermis.apps.truths.mitsuba_solid import offset_inwards, closed_skin
from dermis.frame.baking import bake_albedo
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.scene.model import Scene

_SUBDIVISIONS = 4  # times, along a side


def skin_meshes(backend: XmlBackend, head: Head) -> dict[str, bytes]:
    """Return PLY files of the skin about the head's centre [mm], by the names of their shapes.

    "skin" has normals and uv, "caps" shut its openings; "upper" and "upper_caps" are a little outside,
    for a matched surface, which is there twice.

    Raises DermisError when the skin encloses no volume.
    """
    mesh, centre = head.mesh, np.array(head.centre_mm, np.float32)
    solid = closed_skin(mesh, head.name)
    solid = replace(solid, positions=(solid.positions - centre).astype(np.float32))
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    outer, _ = offset_inwards(solid, -interface_gap_mm(backend, solid), head.name)
    used, corners = np.unique(mesh.triangles[skin], return_inverse=True)
    of_solid = np.unique(mesh.point[used], return_inverse=True)[1]  # as the solid's points are numbered
    given = mesh.normals[used], mesh.uv[used]
    count = int(skin.sum())
    files = {}
    for name, one, caps in (("skin", solid, "caps"), ("upper", outer, "upper_caps")):
        files[name] = encode_ply(corners.reshape(-1, 3), one.positions[of_solid], *given)
        if len(one.triangles) > count:
            shut, ends = np.unique(one.triangles[count:], return_inverse=True)
            files[caps] = encode_ply(ends.reshape(-1, 3), one.positions[shut])
    return files


class SubdividedTriangles(NamedTuple):
    """Triangles that are divided evenly.

    triangle : (n,) in which each corner lies
    weights : (n, 3) of that triangle's corners
    corners : (m, 3) of the smaller triangles
    """

    triangle: NDArray[np.int64]
    weights: NDArray[np.float64]
    corners: NDArray[np.int64]


def subdivide_triangles(triangles: NDArray[np.integer], subdivisions: int = _SUBDIVISIONS) -> SubdividedTriangles:
    """Divide each of some triangles into finer^2 smaller ones, which share no corners with those of others.

    triangles : (t,) numbers
    """
    places = [(i, j) for i in range(subdivisions + 1) for j in range(subdivisions + 1 - i)]
    at = {place: index for index, place in enumerate(places)}
    upright = [(at[i, j], at[i + 1, j], at[i, j + 1]) for i in range(subdivisions) for j in range(subdivisions - i)]
    turned = [
        (at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]) for i in range(subdivisions) for j in range(subdivisions - i - 1)
    ]
    second, third = np.array(places, np.float64).T / subdivisions
    weights = np.stack([1.0 - second - third, second, third], axis=1)
    first = len(places) * np.arange(len(triangles))[:, None, None]
    corners = (first + np.array(upright + turned)).reshape(-1, 3)
    return SubdividedTriangles(np.repeat(triangles, len(places)), np.tile(weights, (len(triangles), 1)), corners)


def coloured_meshes(renderer: Renderer, scene: Scene) -> dict[int, bytes]:
    """Return files of all materials but the skin, by their indices; the head about its centre [mm].

    They have no maps: fine triangles have a colour at each corner.
    """
    mesh = scene.head.mesh
    opaque = [k for k, material in enumerate(mesh.materials) if material.kind != "skin"]
    parts = {k: subdivide_triangles(np.flatnonzero(mesh.material == k)) for k in opaque if (mesh.material == k).any()}
    if not parts:
        return {}
    triangle, weights = (np.concatenate([one[i] for one in parts.values()]) for i in (0, 1))
    colours = bake_albedo(renderer, scene, triangle, weights[:, 1:])
    ends = np.cumsum([len(one.triangle) for one in parts.values()])[:-1]
    each = zip(parts.items(), np.split(colours, ends), strict=True)
    return {k: _file(scene.head, part, colour) for (k, part), colour in each}


def _file(head: Head, part: SubdividedTriangles, colours: NDArray[np.float32]) -> bytes:
    mesh, corners = head.mesh, head.mesh.triangles[part.triangle]
    between = part.weights[:, :, None]
    places = (between * mesh.positions[corners]).sum(axis=1) - np.array(head.centre_mm)
    normals = (between * mesh.normals[corners]).sum(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return encode_ply(part.corners, places, normals, None, np.clip(colours, 0.0, 1.0))
