"""Maps of a head in its own uv layout, with light before and after it spreads, as pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.apps.export.fitting import gaussian_curve
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, value_of, with_values, write_files
from dermis.apps.export.targets.maps.files import SIDES, NormalY, baked_maps, check_side, map_files
from dermis.base.errors import refuse
from dermis.frame.features.diffusion.profiles import SkinProfiles
from dermis.optics.curve import Curve
from dermis.scene.settings import Settings

_SPREAD = "scattered"
_ATLAS = 2048  # texels of the map in which light spreads, at most


class MapFolder(Target):
    """OpenEXR in linear numbers and PNG to look at, with a JSON of units and ranges."""

    name = "maps"
    title = "maps"
    suffixes = ("",)
    versions = ("1",)
    variants = ("opengl", "directx")
    wrong = (
        "Light is baked for one pose and the lights of one scene, as it leaves along the normal. The profile "
        "is the sum of Gaussians that the frame blurs by. Reflections off the surface depend on the eye: no "
        "map has them."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return what is written, and which of the two maps of light is to be shown."""
        return (
            Row("size", self.side, "texel", "side of the maps"),
            Row("normal_green", self._green, "-", "towards row 0, or away from it"),
            Row(_SPREAD, True, "-", "the light shown is that after it spread, scattered.exr"),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return light that has not spread, times the albedo: an ordinary light map."""
        return with_values(self.parameters(subject, version), {_SPREAD: False})

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the sum of Gaussians by which the frame spreads light, or none."""
        energy = subject.curve.energy
        if not value_of(rows, _SPREAD) or subject.scene is None:
            return Curve.of(lambda r: np.repeat(np.where(r > 0.0, 1.0, 0.0)[:, None], 3, axis=1), energy)
        profile = SkinProfiles().of(subject.scene.skin)
        return gaussian_curve(profile.variance_mm2, profile.weight, energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write all maps of the scene."""
        from dermis.frame.renderer import Renderer

        if subject.scene is None:
            came = f"the skin {subject.name} came"
            refuse("maps", "a head, which they are painted for", came, "Name a head, with --profile")
        scene, side = subject.scene, check_side(self.side)
        settings = Settings(atlas=min(max(side, SIDES[0]), _ATLAS))
        baked = baked_maps(Renderer(self.adapter), scene, settings, side)
        return write_files(place, map_files(baked, scene, self._green))

    @property
    def _green(self) -> NormalY:
        return "down" if self.variant == "directx" else "up"


TARGET = MapFolder()
