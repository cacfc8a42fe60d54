"""The curve of pbrt's material "subsurface": photon beam diffusion, in a table of albedos and radii."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.export.fitting import nearest_size, resized
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, floats, numbers_of, write_files
from dermis.apps.export.targets.openpbr.materials import drawn_maps, encoded_maps, prefix_of
from dermis.apps.export.targets.openpbr.target import typed_mm
from dermis.apps.export.targets.pbrt.scene import Lines, directive, lights_of, part_of, view_of
from dermis.human.person_file import relief_slopes
from dermis.mesh.head import Head
from dermis.optics.curve import Curve
from dermis.optics.diffusion.boundary import fresnel, internal_moment
from dermis.optics.media import SKIN_ETA
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

Floats = NDArray[np.float64]

_ALBEDOS, _RADII, _DEPTHS = 100, 64, 100
_FIRST, _GROWTH = 2.5e-3, 1.2  # of the radii [mean free paths]
_DENSE = 8.0
_FROM = {"colour": ("spectrum", "sRGB", "reflectance"), "roughness": ("float", "linear", "roughness")}
_REFLECTANCE, _PATH = "reflectance", "mfp"
_ROUGH_ELSE = 0.3  # of what is not skin
_FAR, _ROOM = 10.0, 1.4  # of a ball's picture, by its size


class Table(NamedTuple):
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
        at = np.interp(reflectance, self.reflectance, np.arange(_ALBEDOS))
        low = int(min(at, _ALBEDOS - 2))
        share = self.within[low] + (at - low) * (self.within[low + 1] - self.within[low])
        return np.asarray(np.interp(np.asarray(radius, np.float64), self.radius, share))


@cache
def diffusion_table(eta: float) -> Table:
    """pbrt's table for isotropic scattering in a medium with an index of refraction.

    Source: [Habel2013] in the form of [Pharr2023]; the moments of the reflectance are exact here.
    """
    radius = np.concatenate([[0.0], _FIRST * _GROWTH ** np.arange(_RADII - 1)])
    albedo = np.expm1(-_DENSE * np.arange(_ALBEDOS) / (_ALBEDOS - 1)) / np.expm1(-_DENSE)
    several = np.stack([_scattered_often(radius, one, eta) for one in albedo])
    profile = 2.0 * np.pi * radius * (several + albedo[:, None] * _scattered_once(radius, eta))
    within = _integrated(radius, profile)
    return Table(albedo, radius, within[:, -1], within)


def _scattered_often(radius: Floats, albedo: float, eta: float) -> Floats:
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


def _scattered_once(radius: Floats, eta: float) -> Floats:
    """(m,) radiant exitance of light scattered once, over the albedo, at an extinction of 1."""
    least = radius * np.sqrt(eta**2 - 1.0)  # under which all is reflected back inside
    depth = least + _depths()[:, None]
    way = np.hypot(radius, depth)
    cosine = depth / way
    leaves = 1.0 - fresnel(cosine, 1.0 / eta)
    return np.asarray((np.exp(-way - least) / way**2 * leaves * cosine).mean(axis=0) / (4.0 * np.pi))


def _depths() -> Floats:
    return np.asarray(-np.log1p(-(np.arange(_DEPTHS) + 0.5) / _DEPTHS))


def _integrated(x: Floats, values: Floats) -> Floats:
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
    not_run = True
    wrong = (
        "Diffusion as on a plane, at every point: thin parts and folds are not like skin. The surface "
        "reflects all that Fresnel says, for the material has no strength of reflection; hairs and the eyes' "
        "colours are left out; colours become smooth spectra. The scene must stay in millimetres: scale "
        "multiplies mfp here, but sigma, which is its inverse, where a medium is stated by that."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the reflectance and mean free path whose table is nearest."""
        path = nearest_size(subject.curve, _unit(subject.albedo))
        return _rows(subject, path, "1 / (sigma_a + sigma_s); a unit is 1 mm")

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return the skin's colour, and published diffuse mean free paths as mean free paths."""
        return _rows(subject, typed_mm(subject), "as published, 1 / sigma_tr")

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return pbrt's table at these numbers."""
        reflectance = np.array(numbers_of(rows, _REFLECTANCE))
        return subject.scaled(resized(_unit(reflectance), numbers_of(rows, _PATH)))

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the scene, a mesh for each material, and the maps."""
        file = self.file_in(place, subject)
        prefix = prefix_of(file, subject)
        scene = subject.scene or _ball(subject.shape)
        text, files = _text(subject, rows, scene, prefix)
        file.write_text("\n".join([*text, ""]), encoding="ascii")
        return [file, *write_files(file.parent, files.items())]


def _unit(reflectance: Floats) -> Curve:
    """Return the curve of media of these reflectances, in mean free paths."""
    table = diffusion_table(SKIN_ETA)
    total = np.array([table.curve(table.radius[-1], float(one)) for one in reflectance], np.float64)

    def within(radius: Floats) -> Floats:
        columns = [table.curve(radius, float(one)) for one in reflectance]
        return np.asarray(np.clip(np.stack(columns, axis=-1) / np.maximum(total, 1e-9), 0.0, 1.0))

    return Curve.of(within, total)


def _rows(subject: Subject, path_mm: Floats, meaning: str) -> Rows:
    skin, colour = subject.skin, floats(subject.colour())
    return (
        Row(_REFLECTANCE, colour, "-", "of light that enters; a texture where there is a map"),
        Row(_PATH, floats(path_mm), "mm", meaning),
        Row("scale", 1.0, "-", "of mfp; not to be changed"),
        Row("g", 0.0, "-", "the paths are those of isotropic scattering"),
        Row("eta", SKIN_ETA, "-", "index of the skin"),
        Row("roughness", skin.roughness * skin.smoothing, "-", "GGX's alpha, as Beckmann's m, or its map"),
        Row("remaproughness", False, "-", "the roughness is alpha itself"),
    )


def _ball(ball: Head) -> Scene:
    """Return a ball in the middle of the picture."""
    x, y, z = (float(one) for one in -np.array(ball.centre_mm))
    size = float(ball.mesh.size_mm[1])
    camera = Camera(position=(x, y, z + _FAR * size), target=(x, y, z), frame_mm=_ROOM * size)
    return Scene(ball, camera=camera)


def _text(subject: Subject, rows: Rows, scene: Scene, prefix: str) -> tuple[Lines, dict[str, bytes]]:
    """Return the scene's lines, and the files beside it by name."""
    head = scene.head
    textures = textures_of(subject, prefix)
    lines = [
        "# Millimetres from the head's centre, by dermis",
        *view_of(scene.camera, f"{prefix}picture.exr"),
    ]
    lines += ["WorldBegin", *lights_of(scene.lights, scene.environment), *textures.lines]
    files = dict(textures.files)
    for kind in np.unique(head.mesh.material).tolist():
        one = head.mesh.materials[kind]
        name = f"{prefix}part_{kind}.ply"
        files[name] = part_of(head.mesh, head.mesh.material == kind, head.centre_mm)
        material = _skin(rows, textures.driven) if one.kind == "skin" else _plain(one.colour)
        lines += ["AttributeBegin", material, directive("Shape", "plymesh", {"string filename": name})]
        lines.append("AttributeEnd")
    return lines, files


def _skin(rows: Rows, driven: dict[str, tuple[str, str]]) -> str:
    """Return the skin's material; an input with a map has its texture's name."""
    kinds = {_REFLECTANCE: "rgb", _PATH: "rgb", "remaproughness": "bool"}
    values: dict[str, ArrayLike] = {}
    for row in rows:
        if row.name in driven:
            kind, name = driven[row.name]
            values[f"{kind} {row.name}"] = name
        else:
            values[f"{kinds.get(row.name, 'float')} {row.name}"] = row.value
    if "normalmap" in driven:
        values["string normalmap"] = driven["normalmap"][1]
    return directive("Material", "subsurface", values)


def _plain(colour: tuple[float, float, float]) -> str:
    rough = {"float roughness": _ROUGH_ELSE, "bool remaproughness": False}
    return directive("Material", "coateddiffuse", {"rgb reflectance": colour, **rough})


class Textures(NamedTuple):
    """Maps of a scene.

    lines : that make them
    files : by name
    driven : type of parameter, and texture or file, by the skin's parameters
    """

    lines: Lines
    files: dict[str, bytes]
    driven: dict[str, tuple[str, str]]


def textures_of(subject: Subject, prefix: str) -> Textures:
    """Return the textures of a head; none for a skin by itself.

    prefix : of the files' names
    """
    made = Textures([], {}, {})
    if subject.head is None:
        return made
    found = drawn_maps(subject.head.maps, subject.skin, relief_slopes(subject.head))
    if "roughness" in found:
        found["roughness"] = found["roughness"] ** 2  # pbrt takes alpha itself, OpenPBR its root
    for role, data in encoded_maps({role: found[role] for role in found if role != "specular"}).items():
        file = f"{prefix}{role}.png"
        made.files[file] = data
        if role == "normal":
            made.driven["normalmap"] = "string", file
            continue
        kind, encoding, parameter = _FROM[role]
        given = {"string filename": file, "string encoding": encoding, "string wrap": "clamp"}
        made.lines.append(directive(f'Texture "{role}" "{kind}"', "imagemap", given))
        made.driven[parameter] = "texture", role
    return made


TARGET = Pbrt()
