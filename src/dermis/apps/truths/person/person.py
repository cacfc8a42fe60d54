"""A person as a path tracer takes it: the posed head with its eyes and hairs, and what is painted on it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.scene.model import Scene

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SkinTextures:
    """Pictures of what a person looks like, linear Rec. 709, row 0 at v = 0.

    colour, roughness : (n, n, 3), (n, n) of the skin by its uv [-]
    height_mm : (n, n) of its relief
    iris : (k, k, 3) of the plane of the iris, from -reach_mm to reach_mm along x and y of the eye
    reach_mm : half of the side of that picture
    white : (k, k, 3) of the ball, by the uv of its layout: the angle from the axis is the distance from the
        middle, half a turn of it 0.49
    teeth : (k, k, 3) of the upper and of the lower ones by their uv
    """

    colour: Floats
    roughness: Floats
    height_mm: Floats
    iris: Floats
    reach_mm: float
    white: Floats
    teeth: tuple[Floats, Floats]

    def arrays(self) -> Iterator[Floats]:
        """Yield all pictures."""
        yield from (self.colour, self.roughness, self.height_mm, self.iris, self.white, *self.teeth)


@dataclass(frozen=True, eq=False)
class HairFibres:
    """Round fibres in space.

    knots_mm : (n, k, 3) from root to tip, from the head's centre
    radius_mm : (n, k)
    absorption : (n, 3) of their inside [1/mm]
    """

    knots_mm: Doubles
    radius_mm: Floats
    absorption: Floats


@dataclass(frozen=True, eq=False)
class Person:
    """A posed head with what is painted on it; places are in mm from its centre.

    eyes : (m, 4, 4) from that space to each eye's own, in mm of a usual eye, z along its axis
    eye_materials : (m,) of the mesh, whose triangles true eyes replace
    """

    name: str
    mesh: Mesh
    eyes: Doubles
    eye_materials: tuple[int, ...]
    hairs: tuple[HairFibres, ...]
    paint: SkinTextures

    def arrays(self) -> Iterator[NDArray[np.generic]]:
        """Yield all arrays of the person."""
        mesh = self.mesh
        yield from (mesh.positions, mesh.normals, mesh.uv, mesh.point, mesh.triangles, mesh.material)
        yield self.eyes
        for hairs in self.hairs:
            yield from (hairs.knots_mm, hairs.radius_mm, hairs.absorption)
        yield from self.paint.arrays()


def posed_person(scene: Scene, paint: SkinTextures) -> Person:
    """Return the head of a scene in its pose.

    Raises DermisError for a head without eyes of true shape.
    """
    head, mesh = scene.head, scene.head.mesh
    if head.eyes is None:
        refuse(head.name, "a head with eyes of true shape", "it has none", "Load human")
    rig = head.control
    motion = scene.motion or rig.rest
    points = rig.points_mm(motion) - np.array(head.centre_mm)
    made = build_mesh(
        points[mesh.point].astype(np.float32),
        mesh.uv,
        mesh.triangles,
        mesh.material,
        mesh.materials,
        point=mesh.point,
        quads=mesh.quads,
    )
    hairs = tuple(
        HairFibres(strands.places_mm(mesh, points), strands.radius_mm, strands.absorption)
        for strands in (head.strands, head.hair)
        if strands is not None and len(strands)
    )
    centred = np.eye(4)
    centred[:3, 3] = head.centre_mm
    eyes = head.eyes.frames(rig, motion) @ centred
    return Person(head.name, made, eyes, tuple(head.eyes.material.tolist()), hairs, paint)
