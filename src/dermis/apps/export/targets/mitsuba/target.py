"""Export to Mitsuba 3: a scene whose skin is a homogeneous medium, as Mitsuba has no diffusion profiles.

Like real skin, the medium can have a refracting surface with an index of 1.4. Mitsuba cannot sample lights
through such a surface, and rays in random directions hit only environments and area lights. Point and spot
lights therefore need an index-matched surface, for which another medium is fitted.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import fit_burley_width, fit_homogeneous_medium
from dermis.apps.export.hair_curves import HAIR_LIMITATIONS, curve_groups
from dermis.apps.export.scene_parts import mesh_ply
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import (
    Parameter,
    Parameters,
    Target,
    flat_tuple,
    get_numbers,
    replace_values,
    write_files,
)
from dermis.apps.export.targets.mitsuba.scene import (
    INDEX_MATCHED_REFLECTANCE,
    IOR_BY_SURFACE_MODEL,
    PART_ROLES,
    IsotropicMedium,
    SkinAppearance,
    SurfaceModel,
    scene_files,
)
from dermis.formats.part_pictures import PartRole
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.half_space import HalfSpaceKind, half_space, tabulated_albedo
from dermis.optics.media import Floats
from dermis.scene.model import Scene
from dermis.scene.skin import DEFAULT_ROUGHNESS

_LUMINANCE_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
_BRIGHT_TEXEL_PERCENTILE = 99.0  # of the colour map; brighter texels are clipped
_MAX_SAMPLED_MAP_SIDE = 512  # of the map from which the percentile is computed [texel]
Map = NDArray[np.float32]
_EXTINCTION_NAME, _ALBEDO_NAME, _TRANSMITTANCE_NAME, _IOR_NAME, _ALPHA_NAME = (
    "sigma_t",
    "albedo",
    "passing",
    "int_ior",
    "alpha",
)
_PICTURE_SIZE, _SAMPLES_PER_PIXEL = (512, 512), 256


class Mitsuba(Target):
    """Export to a Mitsuba scene in mm, with medium, surface, lights, camera and meshes."""

    name = "mitsuba"
    title = "Mitsuba"
    suffixes = ("",)
    versions = ("3",)
    variants = ("matched", "rough", "smooth")
    needs_maps = True
    import_steps = (
        "Install Mitsuba 3: `pip install mitsuba`.",
        "Render with `mitsuba scene.xml`, or in Python, after `import mitsuba as mi`, with "
        "`mi.set_variant('llvm_ad_rgb', 'scalar_rgb')` and `mi.render(mi.load_file('scene.xml'))`.",
        "For another boundary of the skin, add `-D boundary=rough`, `smooth` or `matched` to the command.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {
        "scene.xml": "scene with camera and lights",
        "boundary_*.xml": "skin with one kind of boundary",
        "meshes/*": "triangles of one material",
        "textures/*": "pictures of the materials",
        "hairs/*": "hairs with similar absorption",
    }
    limitations = (
        "One medium per channel cannot represent layers, whose red light spreads differently. Through rough "
        "and smooth surfaces, point, spot and parallel lights cannot be sampled and are black. The matched "
        "surface has a constant reflectance, and colour maps change its lightness only. " + HAIR_LIMITATIONS
    )
    part_limitations = (
        "Parts that are not skin do not emit light, and green of their normal maps is inverted where uv is "
        "mirrored."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters of the medium, fitted to the skin's profile and lightest colour."""
        surface_model, colours = self._surface_model, skin_colours(subject)
        medium = fit_medium(subject.curve, colours, surface_model)
        transmittance = colours.transmittance(surface_model)
        return (
            Parameter(
                _EXTINCTION_NAME, medium.sigma_t, "1/mm", "extinction; divided by its maximum in the file"
            ),
            Parameter(_ALBEDO_NAME, medium.albedo, "-", "of single scattering: not the skin's colour"),
            Parameter(
                _TRANSMITTANCE_NAME, transmittance, "-", "mean transmittance of the textures, both ways"
            ),
            Parameter(_IOR_NAME, IOR_BY_SURFACE_MODEL[surface_model], "-", "of the surface; 1 for none"),
            Parameter(
                _ALPHA_NAME, mean_roughness(subject), "-", "Beckmann roughness, without a texture of it"
            ),
        )

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return parameters with the skin's colour as albedo, and the inverse Burley width as extinction."""
        extinction, albedo = (
            flat_tuple(1.0 / fit_burley_width(subject.curve)),
            flat_tuple(subject.clipped_albedo()),
        )
        values = {_EXTINCTION_NAME: extinction, _ALBEDO_NAME: albedo, _TRANSMITTANCE_NAME: (1.0,) * 3}
        return replace_values(self.parameters(subject, version), values)

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the profile of random walks through the medium, for light incident along the normal."""
        surface_model = self._surface_model
        names = _EXTINCTION_NAME, _ALBEDO_NAME, _TRANSMITTANCE_NAME
        sigma, albedo, transmittance = (np.array(get_numbers(parameters, name)) for name in names)
        curve = half_space(_half_space_kind(surface_model), albedo, 1.0 / sigma)
        matched = surface_model == "matched"
        energy = half_space("walk", albedo, np.ones(3)).energy if matched else curve.energy
        factor = subject.curve.energy * _surface_transmittance(surface_model)
        mean = np.maximum(skin_colours(subject).mean, 1e-9)
        return curve.with_energy(factor * energy * transmittance / mean)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the scene with one XML file for each surface model, and with meshes and textures."""
        colours, scene = skin_colours(subject), subject.scene or Scene(subject.head_or_ball)
        media = {each: fit_medium(subject.curve, colours, each) for each in IOR_BY_SURFACE_MODEL}
        pictured = _image_roles_by_material(subject)
        opaque = _encode_opaque_meshes(scene, self.adapter, pictured)
        pictures = subject.part_pictures.encode(PART_ROLES) if subject.part_pictures else {}
        textures, hairs = skin_textures(subject, colours), tuple(curve_groups(scene.head))
        appearance = SkinAppearance(media, *textures, opaque, pictured, pictures, hairs)
        return write_files(
            output, scene_files(scene, appearance, self._surface_model, _PICTURE_SIZE, _SAMPLES_PER_PIXEL)
        )

    @property
    def _surface_model(self) -> SurfaceModel:
        return next(one for one in IOR_BY_SURFACE_MODEL if one == (self.variant or self.variants[0]))


def fit_medium(
    reference_profile: CumulativeProfile, colours: SkinColours, surface_model: SurfaceModel
) -> IsotropicMedium:
    """Return the medium with the colour `SkinColours.medium_colour` and the profile closest to the reference.

    The colour is matched for light from all directions, as heads are lit from all sides. The profile is
    matched for light incident along the normal.

    colours : mean and brightest colour of the skin
    surface_model : model of the surface above the medium
    """
    energy = colours.medium_colour(surface_model) / _surface_transmittance(surface_model)
    if surface_model == "matched":
        energy = half_space("matched", tabulated_albedo("walk", energy), np.ones(3)).energy
    medium = fit_homogeneous_medium(reference_profile, energy, _half_space_kind(surface_model))
    return IsotropicMedium(flat_tuple(1.0 / medium.mfp_mm), flat_tuple(medium.albedo))


def _half_space_kind(surface_model: SurfaceModel) -> HalfSpaceKind:
    return "matched" if surface_model == "matched" else "skin"


def _surface_transmittance(surface_model: SurfaceModel) -> float:
    """Return the transmittance of the reflecting layer above the medium; 1 if there is no such layer.

    Only the surface model "matched" has this layer: its medium has the refractive index of air and does not
    reflect, so the layer adds the reflection of skin.
    """
    return 1.0 - INDEX_MATCHED_REFLECTANCE if surface_model == "matched" else 1.0


def _image_roles_by_material(subject: Subject) -> dict[int, set[PartRole]]:
    """Return the roles of the texture images of each material, by material index; eyeballs are left out."""
    head, pictures = subject.head_or_ball, subject.part_pictures
    if pictures is None:
        return {}
    used = {*np.unique(head.mesh.material).tolist()} - {*(head.eyes.material.tolist() if head.eyes else ())}
    roles = {k: pictures.needed_roles(head.mesh.materials[k]) for k in sorted(used)}
    return {k: part_roles for k, part_roles in roles.items() if part_roles}


def _encode_opaque_meshes(scene: Scene, adapter: str, textured_materials: Container[int]) -> dict[int, bytes]:
    """Return a dictionary from material index to PLY file, for the head's materials except skin.

    textured_materials : indices of the materials with texture images; other meshes get vertex colours
    """
    mesh, centre = scene.head.mesh, scene.head.centre_mm
    opaque = [k for k in np.unique(mesh.material).tolist() if mesh.materials[k].kind != "skin"]
    meshes = {
        k: mesh_ply(mesh, mesh.material == k, centre, is_v_upwards=False)
        for k in opaque
        if k in textured_materials
    }
    if len(meshes) == len(opaque):
        return meshes
    from dermis.apps.export.targets.mitsuba.meshes import coloured_meshes
    from dermis.frame.renderer import Renderer

    coloured = [k for k in opaque if k not in textured_materials]
    return meshes | coloured_meshes(Renderer(adapter), scene, coloured)


@dataclass(frozen=True, eq=False)
class SkinColours:
    """Mean and brightest colour of the colour map of a skin.

    All skin is one medium, which is as light as the brightest texels of the map. Where the map is darker,
    textures absorb part of the light that enters or leaves the medium.

    mean, brightest : (3,) mean and brightest colour, linear Rec. 709; equal for uniform skin. The brightest
        colour is a high percentile of each channel, so that a few outliers do not matter
    lightness_ratio : high percentile of the texels' luminance, divided by the luminance of `mean` [-]
    """

    mean: Floats
    brightest: Floats
    lightness_ratio: float

    def medium_colour(self, surface_model: SurfaceModel) -> Floats:
        """Return the colour (3,) of the medium without textures.

        Under an index-matched surface, textures can only scale all channels equally, so the colour is the
        mean colour scaled to the luminance of the lightest texels.
        """
        return np.minimum(
            self.lightness_ratio * self.mean if surface_model == "matched" else self.brightest, 0.97
        )

    def transmittance(self, surface_model: SurfaceModel) -> tuple[float, ...]:
        """Return the mean factor (3,) by which textures scale light that enters and leaves the skin [-]."""
        return flat_tuple(self.mean / self.medium_colour(surface_model))


def skin_colours(subject: Subject) -> SkinColours:
    """Return the mean and brightest colour of a subject's colour map; without a map, both are its albedo."""
    texels = None if subject.head is None else subject.head.maps.colour
    if texels is None:
        colour = np.asarray(subject.albedo, np.float64)
        return SkinColours(colour, colour, 1.0)
    stride = max(min(texels.shape[:2]) // _MAX_SAMPLED_MAP_SIDE, 1)
    samples = texels[::stride, ::stride].reshape(-1, 3).astype(np.float64)
    samples = samples[samples.sum(axis=1) > 0.0]
    mean, brightest = samples.mean(axis=0), np.percentile(samples, _BRIGHT_TEXEL_PERCENTILE, axis=0)
    ratio = float(
        np.percentile(samples @ _LUMINANCE_WEIGHTS, _BRIGHT_TEXEL_PERCENTILE) / (mean @ _LUMINANCE_WEIGHTS)
    )
    return SkinColours(mean, np.maximum(brightest, mean), max(ratio, 1.0))


def mean_roughness(subject: Subject) -> float:
    """Return the Beckmann roughness m of the skin, used where no roughness map sets the roughness."""
    return float(subject.skin.roughness_factor * subject.skin.roughness)


def skin_textures(subject: Subject, colours: SkinColours) -> tuple[float | Map, Map | None, Map | None]:
    """Return the fields `roughness`, `transmittance` and `dimming` of the skin's `SkinAppearance`.

    Without a roughness map, the roughness is a number. Without a colour map, the other two are None.
    """
    roughness: float | Map = mean_roughness(subject)
    maps = None if subject.head is None else subject.head.maps
    if maps is not None and maps.roughness is not None:
        roughness = np.clip(maps.roughness * (mean_roughness(subject) / DEFAULT_ROUGHNESS), 0.02, 1.0)
    if maps is None or maps.colour is None:
        return roughness, None, None
    texels = maps.colour
    transmittance = np.sqrt(np.clip(texels / colours.medium_colour("rough"), 0.0, 1.0))
    lightness = texels @ (_LUMINANCE_WEIGHTS / (colours.medium_colour("matched") @ _LUMINANCE_WEIGHTS))
    dimming = 1.0 - np.clip(lightness, 0.0, 1.0)
    return roughness, transmittance.astype(np.float32), dimming.astype(np.float32)


TARGET = Mitsuba()
