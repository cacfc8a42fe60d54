"""OpenPBR and Standard Surface as a MaterialX document, with the maps of a head beside it.

OpenPBR takes the radius for the mean free path of a random walk through a medium of the index of the air,
whatever its phase function; the fit is of the curve of such a walk.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.apps.export.fitting import curve_error, fit_burley_width, fit_homogeneous_medium, burley_curve
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, floats, get_numbers
from dermis.apps.export.targets.openpbr.materials import (
    OPEN_PBR,
    STANDARD,
    input_name,
    mesh_materials,
    file_prefix,
    write_maps,
)
from dermis.base.extras import import_extra
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.half_space import half_space
from dermis.optics.media import Floats, Layer, albedo_from_colour
from dermis.specular.fresnel import SKIN_ETA

PUBLISHED_MEANING = "diffuse mean free path, as published"
_METRES_PER_MM = 1e-3
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
    limitations = (
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

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the walk, or the profile, whose curve is nearest."""
        if self.is_profile:
            return surface_parameters(subject, self.shader, fit_burley_width(subject.curve), "d of the profile, the widest")
        path = fitted_path_mm(subject)
        return surface_parameters(subject, self.shader, path, f"longest mean free path; {profile_error_text(path, subject)}")

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the diffuse mean free paths of published tables, typed in."""
        return surface_parameters(subject, self.shader, published_path_mm(subject), PUBLISHED_MEANING)

    def predicted_curve(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the curve of the walk of these rows, or of the profile."""
        radius = parameter_radii_mm(parameters, self.shader)
        if self.is_profile:
            return materialx_profile(radius, subject)
        return walk_curve(np.array(get_numbers(parameters, input_name(self.shader, "subsurface_color"))), radius, subject)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the document, and the maps beside it."""
        mx = import_extra("MaterialX", "writing MaterialX")
        from dermis.apps.export.targets.openpbr.document import build_document

        file = self.main_file(output,  subject)
        prefix = file_prefix(file, subject)
        pictures = write_maps(subject, file.parent, prefix)
        looks = mesh_materials(subject, parameter_radii_mm(parameters, self.shader), pictures)
        document = build_document([*looks.values()], self.shader, prefix)
        mx.writeToXmlFile(document, str(file))
        return [file, *pictures.values()]


def surface_parameters(subject: Subject, shader: str, radius_mm: Floats, meaning: str) -> Parameters:
    """Return the parameters of a shader with radii (3,); meaning is that of the longest."""
    longest, skin, colour = float(radius_mm.max()), subject.skin, floats(subject.clipped_albedo())
    rough = float(np.sqrt(skin.roughness * skin.smoothing))
    inputs = (
        ("subsurface_weight", 1.0, "-", "all that is not reflected goes into the skin"),
        ("subsurface_color", colour, "-", "colour that is seen; the mean of the map where there is one"),
        ("subsurface_radius", _METRES_PER_MM * longest, "m", meaning),
        ("subsurface_radius_scale", floats(radius_mm / longest), "-", "each channel's over that"),
        ("subsurface_scatter_anisotropy", 0.0, "-", "lengths are those of isotropic scattering"),
        ("specular_ior", SKIN_ETA, "-", "index of the surface, which reflects 0.028 straight ahead"),
        ("specular_weight", skin.strength, "-", "share of that; the map's mean"),
        ("specular_roughness", rough, "-", "root of Beckmann's m, or its map"),
    )
    return tuple(Parameter(input_name(shader, name), value, unit, meaning) for name, value, unit, meaning in inputs)


def profile_error_text(mfp_mm: Floats, subject: Subject) -> str:
    """Return how wrong renderers are that take the radius for the d of a profile."""
    off = curve_error(subject.curve, materialx_profile(mfp_mm, subject)).edge
    return f"taken for a profile's d, edges of shadows are off by {', '.join(f'{one:.3f}' for one in off)}"


def parameter_radii_mm(parameters: Parameters, shader: str) -> Floats:
    """Return the radii (3,) of rows [mm]."""
    longest = get_numbers(parameters, input_name(shader, "subsurface_radius"))[0] / _METRES_PER_MM
    return np.asarray(longest * np.array(get_numbers(parameters, input_name(shader, "subsurface_radius_scale"))))


def fitted_path_mm(subject: Subject) -> Floats:
    """Return the mean free paths (3,) of the walk of the subject's colour whose curve is nearest [mm]."""
    return fit_homogeneous_medium(subject.curve, subject.albedo, "walk").mfp_mm


def published_path_mm(subject: Subject) -> Floats:
    """Return the diffuse mean free path (3,) that tables print for tissue, without tissue the lobe's d [mm].

    Source: 1 / sigma_tr of the lowest layer, [Jensen2001].
    """
    layer = lowest_layer(subject)
    if layer is None:
        return fit_burley_width(subject.curve)
    return np.asarray(1.0 / np.sqrt(3.0 * np.maximum(layer.sigma_a, 1e-9) * layer.sigma_t_prime))


def lowest_layer(subject: Subject) -> Layer | None:
    """Return the lowest layer of tissue in three channels, None without one."""
    tissue = subject.tissue
    if tissue is None or tissue.rgb is not None or tissue.medium.channels != 3:
        return None
    return tissue.medium.layers[-1]


def walk_curve(colour: Floats, mfp_mm: Floats, subject: Subject) -> CumulativeProfile:
    """Return the curve of a walk whose albedo follows from a colour by van de Hulst's formula.

    All light together is that of the subject, times what the formula is off by.
    """
    return subject.rescale_energy(half_space("walk", albedo_from_colour(colour), mfp_mm))


def materialx_profile(mfp_mm: Floats, subject: Subject) -> CumulativeProfile:
    """Return the curve of a renderer with the lobe of MaterialX's specification: its d is the radius."""
    return burley_curve(mfp_mm, subject.curve.energy)


TARGET = OpenPbr()
