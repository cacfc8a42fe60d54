"""The curve of pbrt's material "subsurface": photon beam diffusion, in a table of albedos and radii."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.export.fitting import fit_scale, scale_lengths
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, floats, person_numbers, write_files
from dermis.apps.export.targets.openpbr.materials import map_arrays, encode_map_files, file_prefix
from dermis.apps.export.targets.openpbr.target import published_path_mm
from dermis.apps.export.targets.pbrt.scene import Lines, directive, light_lines, mesh_ply, camera_lines
from dermis.human.person_file import relief_slopes
from dermis.mesh.head import Head
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.diffusion.boundary import fresnel, internal_moment
from dermis.optics.media import SKIN_ETA
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

Floats = NDArray[np.float64]

_ALBEDO_COUNT, _RADIUS_COUNT, _DEPTH_COUNT = 100, 64, 100
_FIRST_RADIUS, _GROWTH = 2.5e-3, 1.2  # of the radii [mean free paths]
_DENSE = 8.0
_TEXTURES = {"colour": ("spectrum", "sRGB", "reflectance"), "roughness": ("float", "linear", "roughness")}
_REFLECTANCE, _PATH = "reflectance", "mfp"
_OPAQUE_ROUGHNESS = 0.3  # of what is not skin
_BALL_DISTANCE, _BALL_FRAME = 10.0, 1.4  # of a ball's picture, by its size


class DiffusionTable(NamedTuple):
    """What pbrt computes for an index of refraction.

    albedo : (n,) [-]
    radius : (m,) [mean free paths]
    reflectance : (n,) of each albedo [-]
    within : (n, m) share of what enters that leaves within the radii [-]
    """

    albedo: Floats
    radius: Floats
    reflectance: Floats
    within: Floats

    def reflectance_of(self, albedo: float) -> float:
        """All that leaves a medium of an albedo of single scattering, per light that enters [-]."""
        return float(np.interp(albedo, self.albedo, self.reflectance))

    def curve(self, radius: ArrayLike, reflectance: float) -> Floats:
        """Share of what enters that leaves within radii, for the albedo that pbrt finds for a reflectance."""
        at = np.interp(reflectance, self.reflectance, np.arange(_ALBEDO_COUNT))
        low = int(min(at, _ALBEDO_COUNT - 2))
        share = self.within[low] + (at - low) * (self.within[low + 1] - self.within[low])
        return np.asarray(np.interp(np.asarray(radius, np.float64), self.radius, share))


@cache
def diffusion_table(eta: float) -> DiffusionTable:
    """pbrt's table for isotropic scattering in a medium with an index of refraction.

    Source: [Habel2013] in the form of [Pharr2023]; the moments of the reflectance are exact here.
    """
    radius = np.concatenate([[0.0], _FIRST_RADIUS * _GROWTH ** np.arange(_RADIUS_COUNT - 1)])
    albedo = np.expm1(-_DENSE * np.arange(_ALBEDO_COUNT) / (_ALBEDO_COUNT - 1)) / np.expm1(-_DENSE)
    several = np.stack([_multiple_scattering(radius, one, eta) for one in albedo])
    profile = 2.0 * np.pi * radius * (several + albedo[:, None] * _single_scattering(radius, eta))
    within = _integrate_spline(radius, profile)
    return DiffusionTable(albedo, radius, within[:, -1], within)


def _multiple_scattering(radius: Floats, albedo: float, eta: float) -> Floats:
    """(m,) radiant exitance of light scattered more than once, at an extinction of 1."""
    D = (2.0 - albedo) / 3.0
    decay = np.sqrt((1.0 - albedo) / D)
    first, second = internal_moment(1, eta), internal_moment(2, eta)
    mirror = -2.0 * D * (1.0 + 3.0 * second) / (1.0 - 2.0 * first)
    real = _depths()[:, None]
    image = 2.0 * mirror - real
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
    """(m,) radiant exitance of light scattered once, over the albedo, at an extinction of 1."""
    least = radius * np.sqrt(eta**2 - 1.0)  # under which all is reflected back inside
    depth = least + _depths()[:, None]
    way = np.hypot(radius, depth)
    cosine = depth / way
    leaves = 1.0 - fresnel(cosine, 1.0 / eta)
    return np.asarray((np.exp(-way - least) / way**2 * leaves * cosine).mean(axis=0) / (4.0 * np.pi))


def _depths() -> Floats:
    return np.asarray(-np.log1p(-(np.arange(_DEPTH_COUNT) + 0.5) / _DEPTH_COUNT))


def _integrate_spline(x: Floats, values: Floats) -> Floats:
    """(n, m) integrals from the first of x, by Catmull's and Rom's splines through values (n, m)."""
    slope = np.empty_like(values)
    slope[:, 1:-1] = (values[:, 2:] - values[:, :-2]) / (x[2:] - x[:-2])
    slope[:, 0] = (values[:, 1] - values[:, 0]) / (x[1] - x[0])
    slope[:, -1] = (values[:, -1] - values[:, -2]) / (x[-1] - x[-2])
    width = np.diff(x)
    part = width * (0.5 * (values[:, 1:] + values[:, :-1]) + width * (slope[:, :-1] - slope[:, 1:]) / 12.0)
    return np.concatenate([np.zeros((len(values), 1)), np.cumsum(part, axis=1)], axis=1)


class Pbrt(Target):
    """A scene in text, with geometry and pictures beside it; millimetres."""

    name = "pbrt"
    title = "pbrt"
    suffixes = (".pbrt", "")
    versions = ("4",)
    needs_maps = True
    untested = True
    limitations = (
        "Diffusion as on a plane, at every point: thin parts and folds are not like skin. The surface "
        "reflects all that Fresnel says, for the material has no strength of reflection; hairs and the eyes' "
        "colours are left out; colours become smooth spectra. The scene must stay in millimetres: scale "
        "multiplies mfp here, but sigma, which is its inverse, where a medium is stated by that."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the reflectance and mean free path whose table is nearest."""
        path = fit_scale(subject.curve, _unit_curve(subject.albedo))
        return _parameters(subject, path, "1 / (sigma_a + sigma_s); a unit is 1 mm")

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the skin's colour, and published diffuse mean free paths as mean free paths."""
        return _parameters(subject, published_path_mm(subject), "as published, 1 / sigma_tr")

    def predicted_curve(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return pbrt's table at these numbers."""
        reflectance = np.array(person_numbers(parameters, _REFLECTANCE))
        return subject.rescale_energy(scale_lengths(_unit_curve(reflectance), person_numbers(parameters, _PATH)))

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the scene, a mesh for each material, and the maps."""
        file = self.main_file(output,  subject)
        prefix = file_prefix(file, subject)
        scene = subject.scene or _ball_scene(subject.head_or_ball)
        text, files = _scene_lines(subject, parameters, scene, prefix)
        file.write_text("\n".join([*text, ""]), encoding="ascii")
        return [file, *write_files(file.parent, files.items())]


def _unit_curve(reflectance: Floats) -> CumulativeProfile:
    """Return the curve of media of these reflectances, in mean free paths."""
    table = diffusion_table(SKIN_ETA)
    total = np.array([table.curve(table.radius[-1], float(one)) for one in reflectance], np.float64)

    def within(radius: Floats) -> Floats:
        columns = [table.curve(radius, float(one)) for one in reflectance]
        return np.asarray(np.clip(np.stack(columns, axis=-1) / np.maximum(total, 1e-9), 0.0, 1.0))

    return CumulativeProfile.from_function(within, total)


def _parameters(subject: Subject, path_mm: Floats, meaning: str) -> Parameters:
    skin, colour = subject.skin, floats(subject.clipped_albedo())
    return (
        Parameter(_REFLECTANCE, colour, "-", "of light that enters; a texture where there is a map"),
        Parameter(_PATH, floats(path_mm), "mm", meaning),
        Parameter("scale", 1.0, "-", "of mfp; not to be changed"),
        Parameter("g", 0.0, "-", "the paths are those of isotropic scattering"),
        Parameter("eta", SKIN_ETA, "-", "index of the skin"),
        Parameter("roughness", skin.roughness * skin.smoothing, "-", "GGX's alpha, as Beckmann's m, or its map"),
        Parameter("remaproughness", False, "-", "the roughness is alpha itself"),
    )


def _ball_scene(ball: Head) -> Scene:
    """Return a ball in the middle of the picture."""
    x, y, z = (float(one) for one in -np.array(ball.centre_mm))
    size = float(ball.mesh.size_mm[1])
    camera = Camera(position=(x, y, z + _BALL_DISTANCE * size), target=(x, y, z), frame_mm=_BALL_FRAME * size)
    return Scene(ball, camera=camera)


def _scene_lines(subject: Subject, parameters: Parameters, scene: Scene, prefix: str) -> tuple[Lines, dict[str, bytes]]:
    """Return the scene's lines, and the files beside it by name."""
    head = scene.head
    textures = skin_textures(subject, prefix)
    lines = [
        "# Millimetres from the head's centre, by dermis",
        *camera_lines(scene.camera, f"{prefix}picture.exr"),
    ]
    lines += ["WorldBegin", *light_lines(scene.lights, scene.environment), *textures.lines]
    files = dict(textures.files)
    for kind in np.unique(head.mesh.material).tolist():
        one = head.mesh.materials[kind]
        name = f"{prefix}part_{kind}.ply"
        files[name] = mesh_ply(head.mesh, head.mesh.material == kind, head.centre_mm)
        material = _skin_material(parameters, textures.bindings) if one.kind == "skin" else _opaque_material(one.colour)
        lines += ["AttributeBegin", material, directive("Shape", "plymesh", {"string filename": name})]
        lines.append("AttributeEnd")
    return lines, files


def _skin_material(parameters: Parameters, bindings: dict[str, tuple[str, str]]) -> str:
    """Return the skin's material; an input with a map has its texture's name."""
    kinds = {_REFLECTANCE: "rgb", _PATH: "rgb", "remaproughness": "bool"}
    values: dict[str, ArrayLike] = {}
    for row in parameters:
        if row.name in bindings:
            kind, name = bindings[row.name]
            values[f"{kind} {row.name}"] = name
        else:
            values[f"{kinds.get(row.name, 'float')} {row.name}"] = row.value
    if "normalmap" in bindings:
        values["string normalmap"] = bindings["normalmap"][1]
    return directive("Material", "subsurface", values)


def _opaque_material(colour: tuple[float, float, float]) -> str:
    rough = {"float roughness": _OPAQUE_ROUGHNESS, "bool remaproughness": False}
    return directive("Material", "coateddiffuse", {"rgb reflectance": colour, **rough})


class Textures(NamedTuple):
    """Maps of a scene.

    lines : that make them
    files : by name
    driven : type of parameter, and texture or file, by the skin's parameters
    """

    lines: Lines
    files: dict[str, bytes]
    bindings: dict[str, tuple[str, str]]


def skin_textures(subject: Subject, prefix: str) -> Textures:
    """Return the textures of a head; none for a skin by itself.

    prefix : of the files' names
    """
    made = Textures([], {}, {})
    if subject.head is None:
        return made
    found = map_arrays(subject.head.maps, subject.skin, relief_slopes(subject.head))
    if "roughness" in found:
        found["roughness"] = found["roughness"] ** 2  # pbrt takes alpha itself, OpenPBR its root
    for role, data in encode_map_files({role: found[role] for role in found if role != "specular"}).items():
        file = f"{prefix}{role}.png"
        made.files[file] = data
        if role == "normal":
            made.bindings["normalmap"] = "string", file
            continue
        kind, encoding, parameter = _TEXTURES[role]
        given = {"string filename": file, "string encoding": encoding, "string wrap": "clamp"}
        made.lines.append(directive(f'Texture "{role}" "{kind}"', "imagemap", given))
        made.bindings[parameter] = "texture", role
    return made


TARGET = Pbrt()
