"""Posed head with eyes, hair fibres and textures, as input of a path tracer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.grown_strands import hair_strands
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.scene.model import Scene

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SkinTextures:
    """Textures of skin, eyes and teeth of a person, linear Rec. 709, row 0 at v = 0.

    colour : (n, n, 3) colour map of the skin [-]
    roughness : (n, n) roughness map of the skin [-]
    strength : (n, n) specular strength of the skin, as the field `rho_s` of `Surface` [-]
    height_mm : (n, n) relief of the skin [mm]
    iris : (k, k, 3) texture of the iris plane, from -reach_mm to reach_mm along x and y of the eye
    reach_mm : half the side of the iris texture [mm]
    white : (k, k, 3) texture of the eyeball in polar coordinates: the distance from the middle of the texture
        is proportional to the angle from the eye's axis; 180 degrees are 0.49 of the texture's side
    teeth : textures (k, k, 3) of the upper and of the lower teeth
    """

    colour: Floats
    roughness: Floats
    strength: Floats
    height_mm: Floats
    iris: Floats
    reach_mm: float
    white: Floats
    teeth: tuple[Floats, Floats]

    def arrays(self) -> Iterator[Floats]:
        """Yield all texture arrays, for hashing."""
        yield from (
            self.colour,
            self.roughness,
            self.strength,
            self.height_mm,
            self.iris,
            self.white,
            *self.teeth,
        )


@dataclass(frozen=True, eq=False)
class HairFibres:
    """Hair fibres as polylines with round cross sections.

    knots_mm : (n, k, 3) positions from root to tip, relative to the head's centre [mm]
    radius_mm : (n, k) radius at the knots [mm]
    absorption : (n, 3) absorption coefficient of the fibres [1/mm]
    """

    knots_mm: Doubles
    radius_mm: Floats
    absorption: Floats


@dataclass(frozen=True, eq=False)
class Person:
    """Posed head with its textures; positions are relative to the head's centre [mm].

    eyes : (m, 4, 4) transforms from head space to the space of each eye. There, the eye has the size of an
        average eye [mm], and its axis is z
    eye_materials : (m,) indices of the eyes' materials; refracting eyeballs replace the triangles of these
        materials
    """

    name: str
    mesh: Mesh
    eyes: Doubles
    eye_materials: tuple[int, ...]
    hairs: tuple[HairFibres, ...]
    textures: SkinTextures

    def arrays(self) -> Iterator[NDArray[np.generic]]:
        """Yield all arrays of the person, for hashing."""
        mesh = self.mesh
        yield from (mesh.positions, mesh.normals, mesh.uv, mesh.point, mesh.triangles, mesh.material)
        yield self.eyes
        for hairs in self.hairs:
            yield from (hairs.knots_mm, hairs.radius_mm, hairs.absorption)
        yield from self.textures.arrays()


def posed_person(scene: Scene, textures: SkinTextures) -> Person:
    """Return the posed head of a scene together with its textures, as input of the path tracer.

    Raises DermisError for a head without modelled eyes.
    """
    head, mesh = scene.head, scene.head.mesh
    if head.eyes is None:
        refuse(head.name, "a head with eyes of true shape", "it has none", "Load human")
    rig = head.control_rig
    pose_arrays = scene.pose_arrays or rig.rest
    points = rig.posed_points_mm(pose_arrays) - np.array(head.centre_mm)
    posed_mesh = build_mesh(
        points[mesh.point].astype(np.float32),
        mesh.uv,
        mesh.triangles,
        mesh.material,
        mesh.materials,
        point=mesh.point,
        quads=mesh.quads,
    )
    hairs = tuple(
        HairFibres(strands.knot_positions_mm(mesh, points), strands.radius_mm, strands.absorption)
        for strands in (head.strands, hair_strands(head, points))
        if strands is not None and len(strands)
    )
    centred = np.eye(4)
    centred[:3, 3] = head.centre_mm
    eyes = head.eyes.eye_matrices(rig, pose_arrays) @ centred
    return Person(head.name, posed_mesh, eyes, tuple(head.eyes.material.tolist()), hairs, textures)
