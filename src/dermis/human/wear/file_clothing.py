"""Meshes and materials of garments of MakeHuman's files."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index
from dermis.human.wear.base_mesh import base_mesh
from dermis.human.wear.clothing import bone_weights, displacements
from dermis.human.wear.hair_obstacles import ClothObstacle
from dermis.human.wear.look import FileClothing
from dermis.human.wear.mhclo import read_garment
from dermis.human.wear.skin_sheet import NECK_AXIS_Z_MM, point_normals
from dermis.human.wear.worn import Worn
from dermis.mesh.mesh import Material

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_ROUGHNESS = 0.86


def file_garment_points_mm(control_mm: Floats, clothing: FileClothing) -> Doubles:
    """Return the points (m, 3) of a garment on a person [mm].

    control_mm : (p, 3) control points of the person at rest
    """
    return read_garment(clothing.file).points_mm(control_mm.astype(np.float64))


def file_garment_materials(clothing: FileClothing) -> tuple[Material, ...]:
    """Return the material of a garment."""
    colour = read_garment(clothing.file).colour
    return (Material("cloth", "opaque", colour, roughness=_ROUGHNESS, label="clothing"),)


def worn_file_garment(clothing: FileClothing) -> Worn:
    """Return the mesh of a garment, cached until the file changes."""
    return _worn(clothing.file, clothing.stamp)


def file_garment_obstacle(points_mm: Doubles, clothing: FileClothing) -> ClothObstacle:
    """Return the outside of a garment, on which hair lies.

    points_mm : (m, 3) points of the garment on a person [mm]
    """
    worn = worn_file_garment(clothing)
    normals = point_normals(points_mm, worn.point[worn.triangles])
    return ClothObstacle(points_mm, normals, np.zeros(len(points_mm), bool), (0.0, NECK_AXIS_Z_MM))


@lru_cache(16)
def _worn(file: str, stamp: tuple[int, int] | None) -> Worn:
    garment = read_garment(file)
    bind = _bind(garment.base, garment.weight)
    bone, weight = bone_weights(bind)
    material = np.zeros(len(garment.triangles), np.int32)
    uv = garment.uv.astype(np.float32)
    return Worn(garment.point, uv, garment.triangles, material, bone, weight, *displacements(bind))


def _bind(base: Index, weight: Doubles) -> csr_array:
    """Return the weights (m, p) of the points of the bust in each point of a garment.

    base, weight : (m, 3) vertices of hm08 and their weights
    """
    from scipy.sparse import csr_array

    mesh = base_mesh()
    rows = np.repeat(np.arange(len(base)), 3)
    shape = len(base), len(mesh.offset_mm)
    return csr_array(csr_array((weight.ravel(), (rows, base.ravel())), shape=shape) @ mesh.weights)
