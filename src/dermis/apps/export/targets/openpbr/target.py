"""OpenPBR and Standard Surface as a MaterialX document, with the maps of a head beside it.

OpenPBR takes the radius for the mean free path of a random walk through a medium of the index of the air,
whatever its phase function; the fit is of the curve of such a walk.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.apps.export.fitting import deviation, fit_d, homogeneous, lobe
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, floats, numbers_of
from dermis.apps.export.targets.openpbr.materials import (
    OPEN_PBR,
    STANDARD,
    input_name,
    looks_of,
    prefix_of,
    write_pictures,
)
from dermis.base.extras import needed
from dermis.optics.curve import Curve
from dermis.optics.half_space import half_space
from dermis.optics.media import Floats, Layer, albedo_of_colour
from dermis.specular.fresnel import SKIN_ETA

TYPED = "diffuse mean free path, as published"
_M = 1e-3
_SHADERS = {
    "open-pbr": OPEN_PBR,
    "standard-surface": STANDARD,
    "open-pbr-profile": OPEN_PBR,
    "standard-surface-profile": STANDARD,
}


class OpenPbr(Target):
    """A document with a material for each part of the head.

    Variants that end in "profile" are for renderers that take the radius for the d of a profile.
    """

    name = "openpbr"
    title = "OpenPBR (MaterialX 1.39)"
    suffixes = (".mtlx", "")
    versions = ("1.1.1",)
    variants = tuple(_SHADERS)
    needs_maps = True
    wrong = (
        "Right in renderers that walk as OpenPBR says, or in the variants for a profile in those that take "
        "MaterialX's, whose d is the radius: it would spread a walk's radii up to 3.6 times as far, most in "
        "dark skin. MaterialX's GLSL only bends the shading by curvature. With a map of the colour the "
        "spread is right at its mean, and smaller where the skin is darker."
    )

    @property
    def shader(self) -> str:
        """Of the material's node."""
        return _SHADERS[self.variant or "open-pbr"]

    @property
    def is_profile(self) -> bool:
        """Whether the radius is the d of a profile, and not the mean free path of a walk."""
        return self.variant.endswith("profile")

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the walk, or the profile, whose curve is nearest."""
        if self.is_profile:
            return surface_rows(subject, self.shader, fit_d(subject.curve), "d of the profile, the widest")
        path = fitted_mm(subject)
        return surface_rows(subject, self.shader, path, f"longest mean free path; {misread(path, subject)}")

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return the diffuse mean free paths of published tables, typed in."""
        return surface_rows(subject, self.shader, typed_mm(subject), TYPED)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve of the walk of these rows, or of the profile."""
        radius = radii_mm(rows, self.shader)
        if self.is_profile:
            return profile_of_specification(radius, subject)
        return walk(np.array(numbers_of(rows, input_name(self.shader, "subsurface_color"))), radius, subject)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the document, and the maps beside it."""
        mx = needed("MaterialX", "writing MaterialX")
        from dermis.apps.export.targets.openpbr.document import document_of

        file = self.file_in(place, subject)
        prefix = prefix_of(file, subject)
        pictures = write_pictures(subject, file.parent, prefix)
        looks = looks_of(subject, radii_mm(rows, self.shader), pictures)
        document = document_of([*looks.values()], self.shader, prefix)
        mx.writeToXmlFile(document, str(file))
        return [file, *pictures.values()]


def surface_rows(subject: Subject, shader: str, radius_mm: Floats, meaning: str) -> Rows:
    """Return the parameters of a shader with radii (3,); meaning is that of the longest."""
    longest, skin, colour = float(radius_mm.max()), subject.skin, floats(subject.colour())
    rough = float(np.sqrt(skin.roughness * skin.smoothing))
    inputs = (
        ("subsurface_weight", 1.0, "-", "all that is not reflected goes into the skin"),
        ("subsurface_color", colour, "-", "colour that is seen; the mean of the map where there is one"),
        ("subsurface_radius", _M * longest, "m", meaning),
        ("subsurface_radius_scale", floats(radius_mm / longest), "-", "each channel's over that"),
        ("subsurface_scatter_anisotropy", 0.0, "-", "lengths are those of isotropic scattering"),
        ("specular_ior", SKIN_ETA, "-", "index of the surface, which reflects 0.028 straight ahead"),
        ("specular_weight", skin.strength, "-", "share of that; the map's mean"),
        ("specular_roughness", rough, "-", "root of Beckmann's m, or its map"),
    )
    return tuple(Row(input_name(shader, name), value, unit, meaning) for name, value, unit, meaning in inputs)


def misread(mfp_mm: Floats, subject: Subject) -> str:
    """Return how wrong renderers are that take the radius for the d of a profile."""
    off = deviation(subject.curve, profile_of_specification(mfp_mm, subject)).edge
    return f"taken for a profile's d, edges of shadows are off by {', '.join(f'{one:.3f}' for one in off)}"


def radii_mm(rows: Rows, shader: str) -> Floats:
    """Return the radii (3,) of rows [mm]."""
    longest = numbers_of(rows, input_name(shader, "subsurface_radius"))[0] / _M
    return np.asarray(longest * np.array(numbers_of(rows, input_name(shader, "subsurface_radius_scale"))))


def fitted_mm(subject: Subject) -> Floats:
    """Return the mean free paths (3,) of the walk of the subject's colour whose curve is nearest [mm]."""
    return homogeneous(subject.curve, subject.albedo, "walk").mfp_mm


def typed_mm(subject: Subject) -> Floats:
    """Return the diffuse mean free path (3,) that tables print for tissue, without tissue the lobe's d [mm].

    Source: 1 / sigma_tr of the lowest layer, [Jensen2001].
    """
    layer = lowest(subject)
    if layer is None:
        return fit_d(subject.curve)
    return np.asarray(1.0 / np.sqrt(3.0 * np.maximum(layer.sigma_a, 1e-9) * layer.sigma_t_prime))


def lowest(subject: Subject) -> Layer | None:
    """Return the lowest layer of tissue in three channels, None without one."""
    tissue = subject.tissue
    if tissue is None or tissue.rgb is not None or tissue.medium.channels != 3:
        return None
    return tissue.medium.layers[-1]


def walk(colour: Floats, mfp_mm: Floats, subject: Subject) -> Curve:
    """Return the curve of a walk whose albedo follows from a colour by van de Hulst's formula.

    All light together is that of the subject, times what the formula is off by.
    """
    return subject.scaled(half_space("walk", albedo_of_colour(colour), mfp_mm))


def profile_of_specification(mfp_mm: Floats, subject: Subject) -> Curve:
    """Return the curve of a renderer with the lobe of MaterialX's specification: its d is the radius."""
    return lobe(mfp_mm, subject.curve.energy)


TARGET = OpenPbr()
