"""Heads: a mesh with maps, rig, eyes and hair."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.base.renamed import renamed_attribute
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyes import Eyes
from dermis.mesh.file_vertices import FileVertices
from dermis.mesh.groom import Groom
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.mesh.rig import Rig
from dermis.mesh.skull import Point, centre_of_box, facing_axes, head_bone
from dermis.mesh.strands import Strands

_MIN_HEAD_BONE_WEIGHT = 0.5  # smallest weight of the head bone for points of the skull


@dataclass(frozen=True, repr=False)
class Head:
    """A head to render: a mesh in millimetres with maps, rig, eyes and hair.

    `load_head` reads heads from files; `Human.head` generates them.

    Parameters
    ----------
    name : str
        Name of the sample or of the file.
    mesh : Mesh
        Triangles with uv [mm].
    maps : Maps
        Colour, relief and other maps.
    attribution : str, optional
        Credit that pictures of the head require, empty if there is none.
    rig : Rig, optional
        Morph targets and bones; None for a head that can only be posed by new positions of its points.
    eyes : Eyes, optional
        Eyeballs of realistic shape.
    strands : Strands, optional
        Strands of brows and lashes.
    hair : Groom, optional
        Scalp hair and beard, whose strands are grown on the GPU.
    note : str, optional
        Text about parts of the file that are not used, with reasons; empty if all parts are used.
    levels : int, optional
        Levels of subdivision of the mesh.
    template : Head, optional
        Head with the same triangles and uv, whose uv atlas and other precomputed data this head reuses.
    file_vertices : FileVertices, optional
        Correspondence between points and vertices of the mesh file, for mesh sequences.
    undressed : Head, optional
        The same head without worn items, whose points, vertices, triangles and materials come first
        in this head; None for a head that wears nothing.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps()).positions_mm.shape
    (26, 3)
    """

    name: str
    mesh: Mesh
    maps: Maps
    attribution: str = ""
    rig: Rig | None = None
    eyes: Eyes | None = None
    strands: Strands | None = None
    hair: Groom | None = None
    note: str = ""
    levels: int = 0
    template: Head | None = None
    file_vertices: FileVertices | None = None
    undressed: Head | None = None

    def __repr__(self) -> str:
        """Return name, size, maps and rig on two lines."""
        maps = [one.name for one in fields(Maps) if getattr(self.maps, one.name) is not None]
        parts = [f"maps: {', '.join([*maps, *(['painted'] if self.maps.is_painted else [])]) or 'none'}"]
        counts = {"targets": len(self.targets), "bones": len(self.bones)}
        parts += [f"{count} {name}" for name, count in counts.items() if count]
        parts += [name for name in ("eyes", "strands", "hair") if getattr(self, name) is not None]
        size = f"{len(self.mesh.triangles):,} triangles at level {self.levels} of subdivision"
        return f"<Head {self.name!r}: {size}\n {'; '.join(parts)}>"

    @cached_property
    def control_rig(self) -> Rig:
        """Return the rig; a head without a rig gets a rig of its points that has no targets and no bones."""
        if self.rig is not None:
            return self.rig
        return Rig(self.mesh.points_mm.astype(np.float32))

    @property
    def body(self) -> Head:
        """Return the head without clothing, glasses and headwear."""
        return self.undressed or self

    @cached_property
    def without_maps(self) -> Head:
        """Return the head without maps and with default eyes, for caches that depend on shape only."""
        if self.rig is None:
            return self
        eyes = self.eyes and self.eyes.with_look(EyeLook())
        return replace(self, maps=Maps(), eyes=eyes)

    @property
    def topology_head(self) -> Head:
        """Return the head from which the uv atlas and other data that depend on topology are computed.

        The result is the `template`, so that all heads with this template share these data. The result is
        `without_maps` if there is no template, or if the template's rig is not the `Rig.template` of this
        head's rig.
        """
        template = self.template
        if template is None or self.rig is None or self.rig.template is not template.rig:
            return self.without_maps
        return template

    @property
    def positions_mm(self) -> Floats:
        """Return the points (n, 3) of the mesh as loaded, before any subdivision [mm].

        Points of fitted eyeballs are left out, because they are not in the file, see `Rig.rigid_followers`.
        """
        positions = self.control_rig.positions_mm
        return (
            positions[: self.control_rig.file_point_count] if self.control_rig.rigid_followers else positions
        )

    @property
    def targets(self) -> tuple[str, ...]:
        """Return the names of the morph targets."""
        return self.control_rig.targets.names

    @property
    def bones(self) -> tuple[str, ...]:
        """Return the names of the bones."""
        skeleton = self.control_rig.skeleton
        return skeleton.names if skeleton else ()

    @cached_property
    def skull_centre_mm(self) -> Point | None:
        """Return the centre of the skull [mm]; None for a mesh without a head.

        Neck, shoulders, body and worn items do not shift this centre. If the mesh is a whole body
        whose skeleton has a head bone, it is the centre of the points that follow this bone.
        """
        if self.undressed is not None:
            return self.undressed.skull_centre_mm
        skeleton = None if self.mesh.is_head_sized or self.rig is None else self.rig.skeleton
        bone = None if skeleton is None else head_bone(skeleton.names)
        if skeleton is None or bone is None:
            return self.mesh.skull_centre_mm
        follows = ((skeleton.bone == bone) & (skeleton.weight > _MIN_HEAD_BONE_WEIGHT)).any(axis=1)
        points = self.control_rig.positions_mm[follows]
        return centre_of_box(points) if len(points) else self.mesh.skull_centre_mm

    @cached_property
    def centre_mm(self) -> Point:
        """Return the origin of the scene: the centre of the skull, or of a mesh without a head [mm]."""
        return self.skull_centre_mm or centre_of_box(self.mesh.positions)

    @cached_property
    def front_view_axes(self) -> Doubles:
        """Return unit vectors to the viewer's right, upwards and to the front, as rows (3, 3).

        For a head the directions are x, y and z. The front of a flat patch of skin is the side to which its
        normals point.
        """
        return (
            np.eye(3)
            if self.skull_centre_mm is not None
            else facing_axes(self.mesh.positions, self.mesh.normals)
        )

    @property
    def front_view_positions_mm(self) -> Floats:
        """Return the positions (v, 3) of the vertices as seen from the front, relative to the centre [mm].

        The coordinates are along the directions of `front_view_axes`: x to the viewer's right, y up, and z to
        the front, towards the viewer.
        """
        positions = self.mesh.positions - np.array(self.centre_mm, dtype=np.float32)
        return (
            positions
            if self.skull_centre_mm is not None
            else positions @ self.front_view_axes.T.astype(np.float32)
        )

    @cached_property
    def reach_mm(self) -> float:
        """Return the largest distance of a vertex from the centre [mm]."""
        offsets = self.mesh.positions - np.array(self.centre_mm)
        return float(np.sqrt(np.einsum("vi,vi->v", offsets, offsets).max()))

    def frontmost_point_mm(self, x_mm: float, y_mm: float) -> tuple[float, float, float]:
        """Return the position (x, y, z) of the frontmost vertex near a point seen from the front [mm].

        The position is relative to the head's centre.

        x_mm, y_mm : position to the viewer's right and upwards, relative to the head's centre [mm]
        """
        p = self.front_view_positions_mm
        distance = np.hypot(p[:, 0] - x_mm, p[:, 1] - y_mm)
        near = distance <= max(6.0, float(distance.min()) + 1.0)
        x, y, z = p[near][np.argmax(p[near][:, 2])]
        return float(x), float(y), float(z)

    frontmost = renamed_attribute("frontmost", "frontmost_point_mm")
