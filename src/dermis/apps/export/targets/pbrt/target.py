"""Export to pbrt, with parameters of the material `subsurface`, fitted with pbrt's diffusion model."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path, PurePath
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.export.fitting import fit_radius_scale, scale_radii
from dermis.apps.export.hair_curves import HAIR_LIMITATIONS, curve_groups
from dermis.apps.export.scene_parts import mesh_ply
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, flat_tuple, get_numbers, write_files
from dermis.apps.export.targets.openpbr.materials import (
    PART_PREFIX,
    encode_map_files,
    file_prefix,
    open_pbr_maps,
)
from dermis.apps.export.targets.openpbr.target import published_mean_free_path_mm
from dermis.apps.export.targets.pbrt.hairs import hair_directives
from dermis.apps.export.targets.pbrt.scene import Lines, camera_directives, format_directive, light_directives
from dermis.formats.part_pictures import PartRole
from dermis.human.person_file import relief_slopes
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.diffusion.boundary import fresnel, internal_moment
from dermis.optics.media import SKIN_ETA
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

Floats = NDArray[np.float64]

_TABLE_ALBEDO_COUNT, _TABLE_RADIUS_COUNT, _SAMPLE_DEPTH_COUNT = 100, 64, 100
_FIRST_TABLE_RADIUS, _TABLE_RADIUS_RATIO = (
    2.5e-3,
    1.2,
)  # first radius [mean free paths] and ratio of successive radii
_ALBEDO_SPACING_EXPONENT = 8.0  # larger values place more of the albedos near 1
_TEXTURES_BY_ROLE = {
    "colour": ("spectrum", "sRGB", "reflectance"),
    "roughness": ("float", "linear", "roughness"),
}
_PART_TEXTURES: Mapping[PartRole, tuple[str, str]] = {
    "colour": ("spectrum", "sRGB"),
    "alpha": ("float", "linear"),
    "metalness": ("float", "linear"),
    "opacity": ("float", "linear"),
}
_REFLECTANCE_NAME, _MFP_NAME = "reflectance", "mfp"
_OPAQUE_PART_ROUGHNESS = 0.3  # of materials other than skin
_RELATIVE_CAMERA_DISTANCE, _RELATIVE_FRAME_HEIGHT = (
    10.0,
    1.4,
)  # camera distance and visible height, relative to the ball


class DiffusionTable(NamedTuple):
    """Radial profiles of pbrt's subsurface material for a range of albedos, at one index of refraction.

    albedo : (n,) single-scattering albedos
    radius : (m,) radii [mean free paths]
    reflectance : (n,) diffuse reflectance at each albedo
    reflectance_within : (n, m) part of the reflectance due to light that leaves within each radius
    """

    albedo: Floats
    radius: Floats
    reflectance: Floats
    reflectance_within: Floats

    def interpolate_reflectance_within(self, radius: ArrayLike, reflectance: float) -> Floats:
        """Return the part of the diffuse reflectance due to light that leaves within given radii [-].

        radius : radii [mean free paths]
        reflectance : total diffuse reflectance, from light that leaves at any radius [-]
        """
        row = np.interp(reflectance, self.reflectance, np.arange(_TABLE_ALBEDO_COUNT))
        low = int(min(row, _TABLE_ALBEDO_COUNT - 2))
        first, second = self.reflectance_within[low : low + 2]
        reflectance_within = first + (row - low) * (second - first)
        return np.asarray(np.interp(np.asarray(radius, np.float64), self.radius, reflectance_within))


@cache
def diffusion_table(eta: float) -> DiffusionTable:
    """Return pbrt's diffusion table for isotropic scattering.

    eta : index of refraction of the medium

    Source: [Habel2013] in the form of [Pharr2023], but with exact moments of the Fresnel reflectance.
    """
    radius = np.concatenate(
        [[0.0], _FIRST_TABLE_RADIUS * _TABLE_RADIUS_RATIO ** np.arange(_TABLE_RADIUS_COUNT - 1)]
    )
    steps = np.arange(_TABLE_ALBEDO_COUNT) / (_TABLE_ALBEDO_COUNT - 1)
    albedo = np.expm1(-_ALBEDO_SPACING_EXPONENT * steps) / np.expm1(-_ALBEDO_SPACING_EXPONENT)
    multiple = np.stack([_multiple_scattering(radius, one, eta) for one in albedo])
    profile = 2.0 * np.pi * radius * (multiple + albedo[:, None] * _single_scattering(radius, eta))
    reflectance_within = _integrate_spline(radius, profile)
    return DiffusionTable(albedo, radius, reflectance_within[:, -1], reflectance_within)


def _multiple_scattering(radius: Floats, albedo: float, eta: float) -> Floats:
    """Return the radiant exitance (m,) of light scattered more than once, for a unit extinction coefficient.

    radius : (m,) distances from a beam of unit power [mean free paths]
    albedo : single-scattering albedo [-]
    eta : index of refraction of the medium
    """
    D = (2.0 - albedo) / 3.0
    decay = np.sqrt((1.0 - albedo) / D)
    first, second = internal_moment(1, eta), internal_moment(2, eta)
    boundary = -2.0 * D * (1.0 + 3.0 * second) / (1.0 - 2.0 * first)
    real = _sample_depths()[:, None]
    image = 2.0 * boundary - real
    near, far = np.hypot(radius, real), np.hypot(radius, image)
    fluence = (np.exp(-decay * near) / near - np.exp(-decay * far) / far) / D
    flux = sum(
        sign * z * (1.0 + decay * d) * np.exp(-decay * d) / d**3
        for sign, z, d in ((1.0, real, near), (-1.0, image, far))
    )
    exitance = 0.25 * (1.0 - 2.0 * first) * fluence + 0.5 * (1.0 - 3.0 * second) * flux
    kappa = -np.expm1(-2.0 * (near + real))
    return np.asarray(albedo**2 * (kappa * exitance).mean(axis=0) / (4.0 * np.pi))


def _single_scattering(radius: Floats, eta: float) -> Floats:
    """Return the radiant exitance (m,) of light scattered once, for unit albedo and extinction coefficient.

    radius : (m,) distances from a beam of unit power [mean free paths]
    eta : index of refraction of the medium
    """
    critical_depth = radius * np.sqrt(eta**2 - 1.0)  # light scattered at a smaller depth is totally reflected
    depth = critical_depth + _sample_depths()[:, None]
    path = np.hypot(radius, depth)
    cosine = depth / path
    transmitted = 1.0 - fresnel(cosine, 1.0 / eta)
    exitance = np.exp(-path - critical_depth) / path**2 * transmitted * cosine
    return np.asarray(exitance.mean(axis=0) / (4.0 * np.pi))


def _sample_depths() -> Floats:
    return np.asarray(-np.log1p(-(np.arange(_SAMPLE_DEPTH_COUNT) + 0.5) / _SAMPLE_DEPTH_COUNT))


def _integrate_spline(knot_positions: Floats, knot_values: Floats) -> Floats:
    """Return the integrals (n, m) of Catmull-Rom splines from the first knot to each knot.

    knot_positions : (m,) increasing knots
    knot_values : (n, m) values of each spline at the knots
    """
    slope = np.empty_like(knot_values)
    slope[:, 1:-1] = (knot_values[:, 2:] - knot_values[:, :-2]) / (knot_positions[2:] - knot_positions[:-2])
    slope[:, 0] = (knot_values[:, 1] - knot_values[:, 0]) / (knot_positions[1] - knot_positions[0])
    slope[:, -1] = (knot_values[:, -1] - knot_values[:, -2]) / (knot_positions[-1] - knot_positions[-2])
    width = np.diff(knot_positions)
    areas = width * (
        0.5 * (knot_values[:, 1:] + knot_values[:, :-1]) + width * (slope[:, :-1] - slope[:, 1:]) / 12.0
    )
    return np.concatenate([np.zeros((len(knot_values), 1)), np.cumsum(areas, axis=1)], axis=1)


class Pbrt(Target):
    """Export to a pbrt-v4 scene in mm, with meshes and maps in files beside the scene file."""

    name = "pbrt"
    title = "pbrt"
    suffixes = (".pbrt", "")
    versions = ("4",)
    needs_maps = True
    untested = True
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*_hair_*.pbrt": "hairs with similar absorption",
        "*_brows_and_lashes_*.pbrt": "brows and lashes with similar absorption",
        "*.pbrt": "scene with camera, lights and materials; millimetres",
        "*.ply": "triangles of one material",
    }
    limitations = (
        "Diffusion assumes a plane at every point, so thin parts and folds are wrong. Specular reflection "
        "cannot be reduced, as the material has no such parameter. Colours of eyes are omitted. "
        "Colours become smooth spectra. The scene must stay in millimetres: the parameter scale multiplies "
        "mfp here, but in media given by sigma it multiplies sigma. " + HAIR_LIMITATIONS
    )
    part_limitations = (
        "Parts that are not skin do not emit light, and green of their normal maps is inverted where uv is "
        "mirrored."
    )

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return the steps that render the scene."""
        return (
            "Build pbrt-v4, and keep the files together.",
            f"Render in this folder: `pbrt {shlex.quote(files[0].name)}`.",
            "Convert the OpenEXR picture with `imgtool convert`.",
        )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the reflectance, and the mean free paths that bring pbrt's profile closest to the skin's."""
        path = fit_radius_scale(subject.curve, _unit_profile(subject.albedo))
        return _material_parameters(subject, path, "1 / (sigma_a + sigma_s); a unit is 1 mm")

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the skin's colour as reflectance, and published diffuse mean free paths as parameter mfp."""
        return _material_parameters(
            subject, published_mean_free_path_mm(subject), "as published, 1 / sigma_tr"
        )

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile that pbrt tabulates for the reflectance and mean free paths."""
        reflectance = np.array(get_numbers(parameters, _REFLECTANCE_NAME))
        curve = scale_radii(_unit_profile(reflectance), get_numbers(parameters, _MFP_NAME))
        return subject.rescale_energy(curve)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the scene, a PLY mesh for each material, and the maps."""
        file = self.main_file(output, subject)
        prefix = file_prefix(file, subject)
        scene = subject.scene or _ball_scene(subject.head_or_ball)
        lines, files = _scene_directives(subject, parameters, scene, prefix)
        file.write_text("\n".join([*lines, ""]), encoding="ascii")
        return [file, *write_files(file.parent, files.items())]


def _unit_profile(reflectance: Floats) -> CumulativeProfile:
    """Return pbrt's cumulative profile for reflectances (3,), with radii in mean free paths."""
    table = diffusion_table(SKIN_ETA)
    total = np.array(
        [table.interpolate_reflectance_within(table.radius[-1], float(one)) for one in reflectance],
        np.float64,
    )

    def fraction_within(radius: Floats) -> Floats:
        columns = [table.interpolate_reflectance_within(radius, float(one)) for one in reflectance]
        return np.asarray(np.clip(np.stack(columns, axis=-1) / np.maximum(total, 1e-9), 0.0, 1.0))

    return CumulativeProfile.from_function(fraction_within, total)


def _material_parameters(subject: Subject, mean_free_path_mm: Floats, mfp_meaning: str) -> Parameters:
    skin, colour = subject.skin, flat_tuple(subject.clipped_albedo())
    return (
        Parameter(_REFLECTANCE_NAME, colour, "-", "of the light that enters, or a texture"),
        Parameter(_MFP_NAME, flat_tuple(mean_free_path_mm), "mm", mfp_meaning),
        Parameter("scale", 1.0, "-", "factor of mfp; must not be changed"),
        Parameter("g", 0.0, "-", "the mean free paths are reduced ones"),
        Parameter("eta", SKIN_ETA, "-", "index of refraction of the skin"),
        Parameter(
            "roughness", skin.roughness * skin.roughness_factor, "-", "GGX's alpha: Beckmann's m, or its map"
        ),
        Parameter("remaproughness", False, "-", "the roughness is alpha itself"),
    )


def _ball_scene(ball: Head) -> Scene:
    """Return a scene that shows a ball in the middle of the picture, for a skin without a head."""
    x, y, z = (float(one) for one in -np.array(ball.centre_mm))
    size = float(ball.mesh.size_mm[1])
    camera = Camera(
        position=(x, y, z + _RELATIVE_CAMERA_DISTANCE * size),
        target=(x, y, z),
        frame_mm=_RELATIVE_FRAME_HEIGHT * size,
    )
    return Scene(ball, camera=camera)


def _scene_directives(
    subject: Subject, parameters: Parameters, scene: Scene, file_prefix: str
) -> tuple[Lines, dict[str, bytes]]:
    """Return the directives of the scene, and a dictionary from name to content of mesh and image files.

    file_prefix : prefix of the names of mesh and image files
    """
    head = scene.head
    textures = skin_textures(subject, file_prefix)
    lines = ["# Written by dermis; lengths in mm relative to the head's centre"]
    lines += [*camera_directives(scene.camera, f"{file_prefix}picture.exr"), "WorldBegin"]
    part_lines, part_files = _part_textures(subject, file_prefix)
    lines += [*light_directives(scene.lights, scene.environment), *textures.lines, *part_lines]
    files = textures.files | part_files
    for index in np.unique(head.mesh.material).tolist():
        material, name = head.mesh.materials[index], f"{file_prefix}part_{index}.ply"
        files[name] = mesh_ply(head.mesh, head.mesh.material == index, head.centre_mm, is_v_upwards=True)
        roles = subject.part_pictures.needed_roles(material) if subject.part_pictures else set()
        if material.kind == "skin":
            texts = [_skin_material_directive(parameters, textures.material_textures)]
        else:
            texts = _part_material_directives(material, roles, f"part_{index}", file_prefix)
        alpha = {"texture alpha": "parts_opacity"} if "opacity" in roles else {}
        shape = format_directive("Shape", "plymesh", {"string filename": name, **alpha})
        lines += ["AttributeBegin", *texts, shape, "AttributeEnd"]
    for group in curve_groups(head):
        name = f"{file_prefix}{group.name}.pbrt"
        files[name] = "\n".join([*hair_directives(group), ""]).encode("ascii")
        lines.append(f'Include "{name}"')
    return lines, files


def _skin_material_directive(parameters: Parameters, material_textures: dict[str, tuple[str, str]]) -> str:
    """Return the directive of the skin's material, in which maps replace the values of some parameters.

    material_textures : for each parameter that a map sets, pbrt's type of the parameter, and the name of the
        texture or image file
    """
    types = {_REFLECTANCE_NAME: "rgb", _MFP_NAME: "rgb", "remaproughness": "bool"}
    values: dict[str, ArrayLike] = {}
    for one in parameters:
        input_type, value = material_textures.get(one.name, (types.get(one.name, "float"), one.value))
        values[f"{input_type} {one.name}"] = value
    if "normalmap" in material_textures:
        values["string normalmap"] = material_textures["normalmap"][1]
    return format_directive("Material", "subsurface", values)


def _part_material_directives(
    material: Material, image_roles: set[PartRole], material_name: str, file_prefix: str
) -> Lines:
    """Return the material directives for a part of the head that is not skin.

    image_roles : roles of the texture images that the part uses, such as "colour"
    material_name : prefix of the names of the two materials that a metalness map mixes; unused for a part
        without such a map
    file_prefix : prefix of the names of the image files
    """
    values: dict[str, ArrayLike | Sequence[str]] = {"rgb reflectance": material.colour}
    if "colour" in image_roles:
        values = {"texture reflectance": "parts_colour"}
    if "alpha" in image_roles:
        values["texture roughness"] = "parts_alpha"
    else:
        values["float roughness"] = _OPAQUE_PART_ROUGHNESS
    values["bool remaproughness"] = False
    if "normal" in image_roles:
        values["string normalmap"] = f"{file_prefix}{PART_PREFIX}normal.png"
    if "metalness" not in image_roles:
        return [format_directive("Material", "coateddiffuse", values)]
    names = {f"{material_name}_{kind}": kind for kind in ("coateddiffuse", "conductor")}
    mix: dict[str, ArrayLike | Sequence[str]] = {"string materials": [*names]}
    mixed = format_directive("Material", "mix", {**mix, "texture amount": "parts_metalness"})
    named = [
        format_directive("MakeNamedMaterial", one, {"string type": names[one], **values}) for one in names
    ]
    return [*named, mixed]


def _part_textures(subject: Subject, file_prefix: str) -> tuple[Lines, dict[str, bytes]]:
    """Return the texture directives for parts that are not skin, and a dictionary of image files by name.

    file_prefix : prefix of the names of the image files
    """
    lines, files = Lines(), dict[str, bytes]()
    if subject.part_pictures is not None:
        for role, data in subject.part_pictures.encode([*_PART_TEXTURES, "normal"]).items():
            file = f"{file_prefix}{PART_PREFIX}{role}.png"
            files[file] = data
            if role in _PART_TEXTURES:
                lines.append(_image_directive(f"{PART_PREFIX}{role}", *_PART_TEXTURES[role], file))
    return lines, files


def _image_directive(texture_name: str, texture_type: str, encoding: str, file_name: str) -> str:
    options = {"string filename": file_name, "string encoding": encoding, "string wrap": "clamp"}
    return format_directive(f'Texture "{texture_name}" "{texture_type}"', "imagemap", options)


class SkinTextures(NamedTuple):
    """Textures of the skin in a pbrt scene.

    lines : directives that define the textures
    files : dictionary from the name of each image file to its content
    material_textures : for each parameter of the skin's material that a map sets, pbrt's type of the
        parameter, and the name of the texture or image file
    """

    lines: Lines
    files: dict[str, bytes]
    material_textures: dict[str, tuple[str, str]]


def skin_textures(subject: Subject, file_prefix: str) -> SkinTextures:
    """Return the textures for the maps of the subject's head; a skin without a head has none.

    file_prefix : prefix of the names of the image files
    """
    textures = SkinTextures([], {}, {})
    if subject.head is None:
        return textures
    arrays = open_pbr_maps(subject.head.maps, subject.skin, relief_slopes(subject.head))
    arrays.pop("specular", None)
    if "roughness" in arrays:
        arrays["roughness"] = arrays["roughness"] ** 2  # pbrt expects alpha, OpenPBR its square root
    for role, data in encode_map_files(arrays).items():
        file = f"{file_prefix}{role}.png"
        textures.files[file] = data
        if role == "normal":
            textures.material_textures["normalmap"] = "string", file
            continue
        texture_type, encoding, parameter = _TEXTURES_BY_ROLE[role]
        textures.lines.append(_image_directive(role, texture_type, encoding, file))
        textures.material_textures[parameter] = "texture", role
    return textures


TARGET = Pbrt()
