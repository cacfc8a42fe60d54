"""Export to OpenPBR and Standard Surface as a MaterialX document, with the maps of a head beside it.

OpenPBR interprets the subsurface radius as the mean free path of a random walk through an index-matched
medium. The parameters are fitted so that the random walk has the skin's profile.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import ClassVar

import numpy as np

from dermis.apps.export.fitting import (
    cumulative_burley_profile,
    fit_burley_width,
    fit_homogeneous_medium,
    profile_error,
)
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, flat_tuple, get_numbers
from dermis.apps.export.targets.openpbr.materials import (
    OPEN_PBR,
    STANDARD_SURFACE,
    file_prefix,
    input_name,
    mesh_materials,
    write_maps,
    write_part_pictures,
)
from dermis.base.extras import import_extra
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.half_space import half_space
from dermis.optics.media import Floats, Layer, albedo_from_colour
from dermis.specular.fresnel import SKIN_ETA

_METRES_PER_MM = 1e-3
_SHADER_BY_VARIANT = {
    "open-pbr": OPEN_PBR,
    "standard-surface": STANDARD_SURFACE,
    "open-pbr-profile": OPEN_PBR,
    "standard-surface-profile": STANDARD_SURFACE,
}


class OpenPbr(Target):
    """Export to a MaterialX document with one material for each material of the head.

    Variants that end in "profile" are for renderers that interpret the radius as the width d of a Burley
    profile.
    """

    name = "openpbr"
    title = "OpenPBR (MaterialX 1.39)"
    suffixes: ClassVar[tuple[str, ...]] = (".mtlx", "")
    versions = ("1.1.1",)
    variants = tuple(_SHADER_BY_VARIANT)
    needs_maps = True
    import_steps: ClassVar[tuple[str, ...]] = (
        "Import a mesh of the same head, such as an export to `usd` or `gltf`, into a scene in metres.",
        "Import the .mtlx file with the MaterialX editor of the program.",
        "Assign each material to the part with its name.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.mtlx": "MaterialX document with one material for each part",
        "*_roughness.png": "roughness of OpenPBR, the square root of Beckmann's m; linear",
    }
    limitations = (
        "Correct in renderers with random walks as OpenPBR specifies, and, in the variants for a profile, in "
        "renderers with MaterialX's profile, whose d is the radius. Interpreted as d, the radii of random "
        "walks diffuse light up to 3.6 times too far, most in dark skin. MaterialX's GLSL only modifies "
        "shading by curvature. With a colour map, the diffusion is correct for the mean colour, and smaller "
        "in darker skin."
    )
    part_limitations = (
        "The pictures of parts that are not skin have the uv of the meshes that exports to usd and gltf "
        "contain, not those of the original file."
    )

    @property
    def shader(self) -> str:
        """Return the MaterialX node category of the surface shader: OpenPBR or Standard Surface."""
        return _SHADER_BY_VARIANT[self.variant or "open-pbr"]

    @property
    def uses_burley_profile(self) -> bool:
        """Return whether the radius is the width d of a Burley profile instead of a mean free path."""
        return self.variant.endswith("profile")

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return `import_steps`; skin without a head has no mesh to import."""
        if subject.head is not None:
            return self.import_steps
        return (
            "Open a scene in metres with the object that is to have the skin.",
            self.import_steps[1],
            "Assign the material to the object.",
        )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the radii for which the random walk or Burley profile is closest to the reference."""
        if self.uses_burley_profile:
            d = fit_burley_width(subject.curve)
            return surface_parameters(subject, self.shader, d, "largest d of the profiles")
        path = fitted_mean_free_path_mm(subject)
        meaning = f"largest mean free path; {profile_error_text(path, subject)}"
        return surface_parameters(subject, self.shader, path, meaning)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters of a user who enters published diffuse mean free paths as mean free paths.

        `published_mean_free_path_mm` returns the entered values. OpenPBR expects mean free paths, which have
        other values.
        """
        meaning = "diffuse mean free path, as published"
        return surface_parameters(subject, self.shader, published_mean_free_path_mm(subject), meaning)

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile that the renderer will show for the exported radii.

        In variants whose name ends in "profile", it is MaterialX's Burley profile; in all others, it is the
        profile of a random walk.
        """
        radius = get_radii_mm(parameters, self.shader)
        if self.uses_burley_profile:
            return materialx_profile(radius, subject)
        colour = np.array(get_numbers(parameters, input_name(self.shader, "subsurface_color")))
        return random_walk_profile(colour, radius, subject)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the document, and the maps beside it."""
        mx = import_extra("MaterialX", "writing MaterialX")
        from dermis.apps.export.targets.openpbr.document import build_document

        file = self.main_file(output, subject)
        prefix = file_prefix(file, subject)
        maps = write_maps(subject, file.parent, prefix)
        definitions = mesh_materials(subject, get_radii_mm(parameters, self.shader), maps)
        document = build_document([*definitions.values()], self.shader, prefix)
        mx.writeToXmlFile(document, str(file))
        return [file, *maps.values(), *write_part_pictures(subject, file.parent, prefix)]


def surface_parameters(
    subject: Subject, shader_category: str, radius_mm: Floats, radius_meaning: str
) -> Parameters:
    """Return the parameters of a surface shader with given subsurface radii.

    shader_category : MaterialX node category of the shader, `OPEN_PBR` or `STANDARD_SURFACE`
    radius_mm : (3,) subsurface radii [mm]
    radius_meaning : explanation of subsurface_radius for the report
    """
    longest, skin, colour = float(radius_mm.max()), subject.skin, flat_tuple(subject.clipped_albedo())
    roughness = float(np.sqrt(skin.roughness * skin.roughness_factor))
    inputs = (
        ("subsurface_weight", 1.0, "-", "all light that is not reflected enters the skin"),
        ("subsurface_color", colour, "-", "diffuse reflectance; the mean of a colour map"),
        ("subsurface_radius", _METRES_PER_MM * longest, "m", radius_meaning),
        ("subsurface_radius_scale", flat_tuple(radius_mm / longest), "-", "each channel's relative to that"),
        ("subsurface_scatter_anisotropy", 0.0, "-", "the lengths are reduced ones"),
        ("specular_ior", SKIN_ETA, "-", "of the surface; reflectance 0.028 at normal incidence"),
        (
            "specular_weight",
            skin.specular_strength,
            "-",
            "factor of the specular reflection; the mean of a map",
        ),
        ("specular_roughness", roughness, "-", "square root of Beckmann's m, or its map"),
    )
    return tuple(Parameter(input_name(shader_category, name), *values) for name, *values in inputs)


def profile_error_text(mfp_mm: Floats, subject: Subject) -> str:
    """Return a sentence on the errors in renderers that treat the mean free path as a Burley width d.

    mfp_mm : (3,) exported mean free paths [mm]
    """
    errors = profile_error(subject.curve, materialx_profile(mfp_mm, subject)).edge
    return f"interpreted as d, errors at shadow edges are {', '.join(f'{error:.3f}' for error in errors)}"


def get_radii_mm(parameters: Parameters, shader_category: str) -> Floats:
    """Return the subsurface radii (3,) from the parameters of a surface shader [mm]."""
    longest = get_numbers(parameters, input_name(shader_category, "subsurface_radius"))[0] / _METRES_PER_MM
    return longest * np.array(get_numbers(parameters, input_name(shader_category, "subsurface_radius_scale")))


def fitted_mean_free_path_mm(subject: Subject) -> Floats:
    """Return the mean free paths (3,) for which a random walk is closest to the subject's profile [mm]."""
    return fit_homogeneous_medium(subject.curve, subject.albedo, "walk").mfp_mm


def published_mean_free_path_mm(subject: Subject) -> Floats:
    """Return the diffuse mean free paths (3,) that the dipole model gives for the tissue [mm].

    A diffuse mean free path is 1 / sigma_tr of the lowest layer, [Jensen2001]. If the coefficients of this
    layer are not given for RGB, the widths of the closest Burley profiles are returned instead.
    """
    layer = lowest_layer(subject)
    if layer is None:
        return fit_burley_width(subject.curve)
    return np.asarray(1.0 / np.sqrt(3.0 * np.maximum(layer.sigma_a, 1e-9) * layer.sigma_t_prime))


def lowest_layer(subject: Subject) -> Layer | None:
    """Return the lowest layer of the tissue; None without tissue, or if its coefficients are not for RGB."""
    tissue = subject.tissue
    if tissue is None or tissue.rgb is not None or tissue.medium.channels != 3:
        return None
    return tissue.medium.layers[-1]


def random_walk_profile(base_colour: Floats, mfp_mm: Floats, subject: Subject) -> CumulativeProfile:
    """Return the cumulative profile of a random walk whose albedo is derived from the base colour.

    The albedo follows from van de Hulst's formula, so the energy of the profile includes the error of this
    formula.

    base_colour : (3,) base colour
    mfp_mm : (3,) mean free paths [mm]
    """
    return subject.rescale_energy(half_space("walk", albedo_from_colour(base_colour), mfp_mm))


def materialx_profile(mfp_mm: Floats, subject: Subject) -> CumulativeProfile:
    """Return the cumulative profile of renderers that follow MaterialX's specification.

    In this specification, the subsurface radius is the width d of Burley's profile.

    mfp_mm : (3,) exported radii [mm]
    """
    return cumulative_burley_profile(mfp_mm, subject.curve.energy)


TARGET = OpenPbr()
