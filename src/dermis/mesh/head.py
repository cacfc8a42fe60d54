"""A head to render: mesh and maps in one."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from dermis.base.arrays import Floats
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyes import Eyes
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.mesh.rig import Rig
from dermis.mesh.strands import Strands


@dataclass(frozen=True, repr=False)
class Head:
    """A mesh in mm with its maps.

    name : sample or file
    attribution : whom to credit when a picture of it is shown, empty when that is not required
    rig : what moves it; None for a head whose points move only if all their places are given
    eyes : its eyeballs, where they are of true shape
    strands : its brows and lashes, None for none
    hair : of head and beard, in no order: from afar the first few, wider, stand for all; None for none
    note : what could not be made of its file, and why; empty for nothing
    levels : of subdivision that its mesh has come through
    template : the head whose atlas and tables serve this one too, and all others with its layout, triangles
        and points; None for a head with its own
    """

    name: str
    mesh: Mesh
    maps: Maps
    attribution: str = ""
    rig: Rig | None = None
    eyes: Eyes | None = None
    strands: Strands | None = None
    hair: Strands | None = None
    note: str = ""
    levels: int = 0
    template: Head | None = None

    def __repr__(self) -> str:
        """Name, size, maps and what moves it, on two lines."""
        maps = [one.name for one in fields(Maps) if getattr(self.maps, one.name) is not None]
        told = [f"maps: {', '.join([*maps, *(['painted'] if self.maps.is_painted else [])]) or 'none'}"]
        counts = {"targets": len(self.targets), "bones": len(self.bones)}
        told += [f"{count} {name}" for name, count in counts.items() if count]
        told += [name for name in ("eyes", "strands", "hair") if getattr(self, name) is not None]
        size = f"{len(self.mesh.triangles):,} triangles at level {self.levels} of subdivision"
        return f"<Head {self.name!r}: {size}\n {'; '.join(told)}>"

    @cached_property
    def control(self) -> Rig:
        """Its rig, or that of its points alone."""
        if self.rig is not None:
            return self.rig
        return Rig(self.mesh.points_mm.astype(np.float32))

    @cached_property
    def bare(self) -> Head:
        """Its shape and what moves it, the same whatever it looks like."""
        if self.rig is None:
            return self
        eyes = self.eyes and self.eyes.with_look(EyeLook())
        return replace(self, maps=Maps(), eyes=eyes)

    @property
    def topology(self) -> Head:
        """The bare head that atlas and tables are made for: the template of its rig, or itself."""
        shared = self.template
        own = shared is None or self.rig is None or self.rig.template is not shared.rig
        return self.bare if shared is None or own else shared

    @property
    def positions_mm(self) -> Floats:
        """(n, 3) the unique points of the mesh as it was loaded, before any subdivision [mm].

        Without those of eyeballs that are not the file's own, see `Rig.rigid_followers`.
        """
        places = self.control.positions_mm
        return places[: self.control.file_point_count] if self.control.rigid_followers else places

    @property
    def targets(self) -> tuple[str, ...]:
        """Names of its morph targets."""
        return self.control.targets.names

    @property
    def bones(self) -> tuple[str, ...]:
        """Names of its bones."""
        skeleton = self.control.skeleton
        return skeleton.names if skeleton else ()

    @property
    def centre_mm(self) -> tuple[float, float, float]:
        """The middle of the head itself, without neck and shoulders: scenes are placed around it [mm]."""
        return self.mesh.skull_centre_mm

    def frontmost(self, x_mm: float, y_mm: float) -> tuple[float, float, float]:
        """The point of the surface in front of (x, y), relative to the centre [mm]."""
        p = self.mesh.positions - np.array(self.centre_mm, dtype=np.float32)
        off = np.hypot(p[:, 0] - x_mm, p[:, 1] - y_mm)
        near = off <= max(6.0, float(off.min()) + 1.0)
        x, y, z = p[near][np.argmax(p[near][:, 2])]
        return float(x), float(y), float(z)
