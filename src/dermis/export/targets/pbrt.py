"""pbrt (version 4): a scene whose skin is the material "subsurface", photon beam diffusion from a table."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.export.curve import Curve
from dermis.export.sized import nearest_size, resized
from dermis.export.subject import Subject
from dermis.export.target import Row, Rows, Target, numbers_of
from dermis.export.targets.openpbr_files import place_of, skin_of
from dermis.export.targets.openpbr_fit import lowest, typed_mm
from dermis.export.targets.pbrt_diffusion import diffusion_table
from dermis.export.targets.pbrt_scene import (
    Lines,
    directive,
    lights_of,
    part_of,
    view_of,
)
from dermis.export.targets.pbrt_textures import textures_of
from dermis.optics.media import SKIN_ETA, Floats
from dermis.scene.model import Scene

_REFLECTANCE, _PATH, _ABSORBS, _SCATTERS = "reflectance", "mfp", "sigma_a", "sigma_s"
_ROUGH_ELSE = 0.3  # of what is not skin


class Pbrt(Target):
    """A scene in text, with geometry and pictures beside it; millimetres."""

    name: ClassVar[str] = "pbrt"
    title: ClassVar[str] = "pbrt"
    suffixes: ClassVar[tuple[str, ...]] = (".pbrt", "")
    versions: ClassVar[tuple[str, ...]] = ("4",)
    needs_maps: ClassVar[bool] = True
    not_run: ClassVar[bool] = True
    wrong: ClassVar[str] = (
        "Diffusion as on a plane, at every point: thin parts and folds are not like skin. A smooth surface reflects "
        "all that Fresnel says, for the material has no strength of reflection; hairs and the eyes' colours are "
        "left out. Scenes must stay in millimetres: scale multiplies mfp in one way of stating a medium, and "
        "sigma, which is its inverse, in another."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Reflectance and mean free path whose table is nearest."""
        path = nearest_size(subject.curve, _unit(subject.albedo))
        told = ((_REFLECTANCE, subject.albedo, "-", "of light that enters; a texture where there is a map"),)
        return _rows(subject, (*told, (_PATH, path, "mm", "1 / (sigma_a + sigma_s); 1 unit is 1 mm at scale 1")))

    def naive(self, subject: Subject, version: str) -> Rows:
        """The skin's colour, and the diffuse mean free paths of published tables as mean free paths."""
        told = ((_REFLECTANCE, subject.albedo, "-", "the skin's colour"),)
        return _rows(subject, (*told, (_PATH, typed_mm(subject), "mm", "as published, 1 / sigma_tr")))

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """pbrt's table at these numbers."""
        reflectance = np.array(numbers_of(rows, _REFLECTANCE))
        found = resized(_unit(reflectance), numbers_of(rows, _PATH))
        return found.with_energy(subject.curve.energy * found.energy / np.maximum(subject.albedo, 1e-9))

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The scene, a mesh for each material, and the maps."""
        file, prefix = place_of(place, subject, ".pbrt")
        scene = subject.scene or Scene(subject.shape)
        text, files = _text(subject, rows, scene, prefix)
        for name, data in files.items():
            (file.parent / name).write_bytes(data)
        file.write_text("\n".join([*text, ""]), encoding="ascii")
        return [file, *(file.parent / name for name in files)]


def _unit(reflectance: Floats) -> Curve:
    """The curve of media of these reflectances, in mean free paths."""
    table = diffusion_table(SKIN_ETA)
    total = np.array([float(table.curve(table.radius[-1], float(one))) for one in reflectance])

    def within(radius: Floats) -> Floats:
        columns = [table.curve(radius, float(one)) for one in reflectance]
        return np.clip(np.stack(columns, axis=-1) / np.maximum(total, 1e-9), 0.0, 1.0)

    return Curve.of(within, total)


def _rows(subject: Subject, medium: tuple[tuple[str, Floats, str, str], ...]) -> Rows:
    skin = skin_of(subject)
    told = [Row(name, tuple(map(float, value)), unit, meaning) for name, value, unit, meaning in medium]
    return (
        *told,
        Row("scale", 1.0, "-", "of mfp; not to be changed"),
        Row("g", 0.0, "-", "the paths are those of isotropic scattering"),
        Row("eta", SKIN_ETA, "-", "index of the skin"),
        Row("roughness", skin.roughness * skin.smoothing, "-", "GGX's alpha, as Beckmann's m, or its map"),
        Row("remaproughness", False, "-", "the roughness is alpha itself"),
    )


def _text(subject: Subject, rows: Rows, scene: Scene, prefix: str) -> tuple[Lines, dict[str, bytes]]:
    """The scene's lines, and the files beside it by name."""
    head = scene.head
    textures = textures_of(subject, prefix)
    lines = ["# Millimetres from the head's centre, by dermis", *view_of(scene.camera, f"{prefix}picture.exr")]
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
    """The skin's material; what a map drives is a texture's name in place of the row's numbers."""
    kinds = {_REFLECTANCE: "rgb", _PATH: "rgb", "remaproughness": "bool"}
    told = {}
    for row in rows:
        if row.name in driven:
            kind, name = driven[row.name]
            told[f"{kind} {row.name}"] = name
        else:
            told[f"{kinds.get(row.name, 'float')} {row.name}"] = row.value
    if "normalmap" in driven:
        told["string normalmap"] = driven["normalmap"][1]
    return directive("Material", "subsurface", told)


def _plain(colour: tuple[float, float, float]) -> str:
    told = {"rgb reflectance": colour, "float roughness": _ROUGH_ELSE, "bool remaproughness": False}
    return directive("Material", "coateddiffuse", told)


TARGET = Pbrt()
