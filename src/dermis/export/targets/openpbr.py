"""OpenPBR and Standard Surface as a MaterialX document, with the maps of a head beside it.

OpenPBR takes the radius for the mean free path of a random walk through a medium of the index of the air,
whatever its phase function; the fit is of the curve of such a walk.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.export.curve import Curve
from dermis.export.deviation import deviation
from dermis.export.subject import Subject
from dermis.export.target import Row, Rows, Target, numbers_of
from dermis.export.targets.openpbr_document import (
    OPEN_PBR,
    STANDARD,
    TASK,
    document_of,
    input_name,
)
from dermis.export.targets.openpbr_files import looks_of, place_of, skin_of, write_pictures
from dermis.export.targets.openpbr_fit import fitted_mm, profile_of_specification, typed_mm, walk
from dermis.extras import needed
from dermis.optics.media import Floats
from dermis.specular.fresnel import SKIN_ETA

_M = 1e-3
_SHADERS = {"open-pbr": OPEN_PBR, "standard-surface": STANDARD}


class OpenPbr(Target):
    """A document with a material for each part of the head."""

    name: ClassVar[str] = "openpbr"
    title: ClassVar[str] = "OpenPBR (MaterialX 1.39)"
    suffixes: ClassVar[tuple[str, ...]] = (".mtlx", "")
    versions: ClassVar[tuple[str, ...]] = ("1.1.1",)
    variants: ClassVar[tuple[str, ...]] = tuple(_SHADERS)
    needs_maps: ClassVar[bool] = True
    wrong: ClassVar[str] = (
        "Right in renderers that walk as OpenPBR says. MaterialX's specification also allows a profile whose "
        "d is the radius: there light spreads up to 3.6 times as far, most in dark skin (see the radius); "
        "MaterialX's GLSL only bends the shading by curvature. With a map of the colour the spread is right "
        "at its mean, and smaller where the skin is darker."
    )

    @property
    def shader(self) -> str:
        """Of the material's node."""
        return _SHADERS[self.variant or "open-pbr"]

    def parameters(self, subject: Subject, version: str) -> Rows:
        """The walk whose curve is nearest."""
        return surface_rows(subject, self.shader, fitted_mm(subject))

    def naive(self, subject: Subject, version: str) -> Rows:
        """The diffuse mean free paths of published tables, typed in as mean free paths."""
        return surface_rows(subject, self.shader, typed_mm(subject))

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The walk of these rows."""
        colour = np.array(numbers_of(rows, input_name(self.shader, "subsurface_color")))
        return walk(colour, radii_mm(rows, self.shader), subject)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The document, and the maps beside it."""
        mx = needed("MaterialX", TASK)
        file, prefix = place_of(place, subject, ".mtlx")
        pictures = write_pictures(subject, file.parent, prefix)
        looks = looks_of(subject, radii_mm(rows, self.shader), pictures)
        document = document_of([*looks.values()], self.shader, prefix)
        mx.writeToXmlFile(document, str(file))
        return [file, *pictures.values()]


def surface_rows(subject: Subject, shader: str, mfp_mm: Floats) -> Rows:
    """What is typed into a shader for mean free paths."""
    longest, skin = float(mfp_mm.max()), skin_of(subject)
    colour = tuple(map(float, np.clip(subject.albedo, 0.0, 1.0)))
    rough = float(np.sqrt(skin.roughness * skin.smoothing))
    told = (
        ("subsurface_weight", 1.0, "-", "all that is not reflected goes into the skin"),
        ("subsurface_color", colour, "-", "colour that is seen; the mean of the map where there is one"),
        ("subsurface_radius", _M * longest, "m", f"longest mean free path; {_misread(mfp_mm, subject)}"),
        ("subsurface_radius_scale", tuple((mfp_mm / longest).tolist()), "-", "mean free paths over that"),
        ("subsurface_scatter_anisotropy", 0.0, "-", "the paths are those of isotropic scattering"),
        ("specular_ior", SKIN_ETA, "-", "index of the surface, which reflects 0.028 straight ahead"),
        ("specular_weight", skin.strength, "-", "share of that; the map's mean"),
        ("specular_roughness", rough, "-", "root of Beckmann's m, or its map"),
    )
    return tuple(Row(input_name(shader, name), value, unit, meaning) for name, value, unit, meaning in told)


def _misread(mfp_mm: Floats, subject: Subject) -> str:
    """How wrong renderers are that take the radius for the d of a profile."""
    off = deviation(subject.curve, profile_of_specification(mfp_mm, subject)).edge
    return f"taken for a profile's d, edges of shadows are off by {', '.join(f'{one:.3f}' for one in off)}"


def radii_mm(rows: Rows, shader: str) -> Floats:
    """(3,) mean free paths of rows."""
    longest = numbers_of(rows, input_name(shader, "subsurface_radius"))[0] / _M
    return np.asarray(longest * np.array(numbers_of(rows, input_name(shader, "subsurface_radius_scale"))))


TARGET = OpenPbr()
