"""Images of a scene by Blender's Cycles, with random-walk or Burley subsurface scattering.

The scene is written to a folder. `cycles_script.py`, which Blender's Python runs in a separate process, reads
it and writes the images there.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.blender_process import PYTHON_VARIABLE as PYTHON_VARIABLE
from dermis.apps.truths.blender_process import BlenderTask, blender_python, run_blender
from dermis.apps.truths.half_space import diffuse_albedo
from dermis.apps.truths.lights import cycles_lamp
from dermis.apps.truths.mitsuba_scene import Lambertian
from dermis.apps.truths.path_traced import PathTraced
from dermis.apps.truths.scene_description import (
    CYCLES_UNIT_MM,
    SceneDict,
    check_camera,
    cycles_look_at,
    cycles_world,
)
from dermis.base.errors import DermisError, refuse
from dermis.images.io import read_image
from dermis.mesh.head import Head
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.specular.fresnel import SKIN_ETA

Floats = NDArray[np.float32]
NumericArray = NDArray[np.generic]
SubsurfaceMethod = Literal["random-walk", "burley"]
_PASS_COUNT = 4
_CYCLES_SCRIPT = Path(__file__).with_name("cycles_script.py")
_CYCLES_TASK = BlenderTask(
    "Cycles", "to render the scene", "Try bpy 5.0, the version that this is tested with"
)
_MAX_STARTUP_S, _MAX_SECONDS_PER_PATH = 300.0, 5e-4
"""Time limits for the start of Blender and for each path: a hundred times those measured on two cores."""


@dataclass(frozen=True, eq=False)
class CyclesPass:
    """Image rendered by Cycles with a given number of paths per pixel, black outside the head.

    image : (h, w, 3) radiance, linear Rec. 709
    coverage : (h, w) fraction of each pixel's area that is covered by the head
    samples : paths per pixel
    seconds : elapsed time; for the first pass, it includes the construction of the scene [s]
    core_seconds : CPU time, summed over all cores [s]
    version : version of Blender
    """

    image: Floats
    coverage: Floats
    samples: int
    seconds: float
    core_seconds: float
    version: str


def cycles_render(
    scene: Scene,
    medium: SkinMaterial,
    samples: int = 64,
    settings: Settings | None = None,
    *,
    method: SubsurfaceMethod = "random-walk",
    python: str | Path | None = None,
) -> PathTraced:
    """Return the scene rendered by Cycles on the CPU: the mean of 4 passes, and its variance.

    The parameters are those of `cycles_passes`, except:

    samples : smallest number of paths per pixel, summed over all passes
    """
    _check_samples(samples)
    samples_per_pass = -(-int(samples) // _PASS_COUNT)
    samples_by_pass = [samples_per_pass] * _PASS_COUNT
    passes = cycles_passes(scene, medium, samples_by_pass, settings, method=method, python=python)
    images = np.stack([p.image for p in passes]).astype(np.float64)
    coverage = np.stack([p.coverage for p in passes]).astype(np.float64)
    return PathTraced(
        images.mean(axis=0).astype(np.float32),
        (images.var(axis=0, ddof=1) / _PASS_COUNT).astype(np.float32),
        coverage.mean(axis=0).astype(np.float32),
        samples_per_pass * _PASS_COUNT,
        sum(p.seconds for p in passes),
    )


def cycles_passes(
    scene: Scene,
    medium: SkinMaterial,
    samples: Sequence[int],
    settings: Settings | None = None,
    *,
    method: SubsurfaceMethod = "random-walk",
    seed: int = 0,
    python: str | Path | None = None,
) -> list[CyclesPass]:
    """Render the scene by Cycles on the CPU, once for each number of samples, in one process.

    Radiance is not clamped, and images are not denoised. Media and `Lambertian` have no surface reflection.

    medium : material of the skin: a `Lambertian`, `BeckmannSurface` or `PrincipledSkin`, or a medium with a
        single layer. The medium's index of refraction is ignored, because Cycles' random walks cross the
        surface without refraction. Cycles gets the medium's diffuse reflectance as subsurface colour, and
        its mean free path times 4 pi as subsurface radius
    samples : paths per pixel of each pass
    settings : settings of the frame, of which only the size is used
    method : subsurface method of Cycles
    seed : random seed of the first pass; each further pass uses the next number
    python : path of a Python with `bpy`; by default from the environment variable DERMIS_BLENDER_PYTHON

    Raises DermisError when there is no such Python, when Cycles fails, and when the medium has several
    layers.
    """
    for sample_count in samples:
        _check_samples(sample_count)
    if method not in CYCLES_METHOD_NAMES:
        refuse("method", f"one of {', '.join(CYCLES_METHOD_NAMES)}", f"got {method!r}", "Correct it")
    size = (settings or Settings()).size
    scene_dict, arrays = describe_scene(scene, medium, method, size)
    scene_dict["passes"] = [{"samples": int(n), "seed": seed + k} for k, n in enumerate(samples)]
    interpreter = blender_python(python)
    with tempfile.TemporaryDirectory(prefix="dermis-cycles-") as name:
        folder = Path(name)
        _write_scene(folder, scene_dict, arrays)
        timeout_s = _MAX_STARTUP_S + _MAX_SECONDS_PER_PATH * size[0] * size[1] * sum(samples)
        run_blender(interpreter, _CYCLES_SCRIPT, [str(folder)], timeout_s, _CYCLES_TASK)
        return read_passes(folder, samples, size)


def _check_samples(samples: int) -> None:
    if not (isinstance(samples, int | np.integer) and samples >= 1):
        refuse("samples", "a whole number from 1", f"got {samples}", "Correct it")


def _write_scene(folder: Path, scene_dict: SceneDict, arrays: Mapping[str, NumericArray]) -> None:
    (folder / "scene.json").write_text(json.dumps(scene_dict), encoding="utf-8")
    np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]  # its parameter allow_pickle is no array


def read_passes(folder: Path, samples: Sequence[int], picture_size: tuple[int, int]) -> list[CyclesPass]:
    """Return the passes that Cycles wrote to a folder.

    samples : paths per pixel of each pass
    picture_size : width and height [pixel]

    Raises DermisError when a file is missing or an image has another size.
    """
    try:
        report = json.loads((folder / "done.json").read_text(encoding="utf-8"))
        files = [folder / f"pass_{k}.exr" for k in range(len(samples))]
        pixels = [read_image(file).astype(np.float32, copy=False) for file in files]
        if any(p.shape != (picture_size[1], picture_size[0], 4) or not np.isfinite(p).all() for p in pixels):
            raise ValueError("a pass of another size, or with values that are not finite")
        version = str(report["version"])
        results = zip(pixels, samples, report["times"], strict=True)
        return [
            CyclesPass(p[..., :3], p[..., 3], int(count), float(clock), float(cores), version)
            for p, count, (clock, cores) in results
        ]
    except (OSError, ValueError, KeyError, TypeError, DermisError) as fault:
        actual = f"its files are unusable ({str(fault) or type(fault).__name__})"
        refuse(_CYCLES_TASK.renderer, _CYCLES_TASK.goal, actual, _CYCLES_TASK.advice)


@dataclass(frozen=True)
class BeckmannSurface:
    """Skin that only reflects light at its surface, by Beckmann facets with an index of refraction of 1.4.

    Light that enters the skin is absorbed. The head's normal map is applied.

    roughness : Beckmann roughness m [-]
    """

    roughness: float


@dataclass(frozen=True, eq=False)
class PrincipledSkin:
    """Skin as Blender users model it: a Principled BSDF with random-walk subsurface scattering.

    The surface consists of GGX facets with an index of refraction of 1.4. Light that is not reflected enters
    the skin. The head's normal map is applied.

    colour : (h, w, 3) diffuse reflectance, linear Rec. 709 [-]
    radius_mm : (3,) subsurface radius of Cycles: the mean free path times 4 pi [mm]
    roughness : GGX roughness m of the surface [-]
    """

    colour: NDArray[np.float32]
    radius_mm: tuple[float, float, float]
    roughness: float


SkinMaterial = Medium | Lambertian | BeckmannSurface | PrincipledSkin
CYCLES_METHOD_NAMES = {"random-walk": "RANDOM_WALK", "burley": "BURLEY"}
"""Cycles' names of the subsurface methods, by their names here."""


def describe_scene(
    scene: Scene, medium: SkinMaterial, subsurface_method: str, picture_size: tuple[int, int]
) -> tuple[SceneDict, dict[str, NumericArray]]:
    """Return the contents of the files scene.json and arrays.npz, from which Cycles renders the scene.

    The first result has the entries of scene.json except the list of passes. The second result is a
    dictionary from name to array.

    medium : material of the skin
    subsurface_method : subsurface method of Cycles, "random-walk" or "burley"
    picture_size : width and height of the picture [pixel]
    """
    world, panorama = cycles_world(scene.environment)
    scene_dict = {
        "materials": _materials(scene.head, medium, subsurface_method),
        "lights": [cycles_lamp(light, number) for number, light in enumerate(scene.lights, start=1)],
        "world": world,
        "camera": cycles_camera(scene),
        "size": list(picture_size),
        "direct": isinstance(medium, Lambertian | BeckmannSurface),
    }
    mesh = scene.head.mesh
    arrays: dict[str, NumericArray] = {
        "positions": ((mesh.positions - np.array(scene.head.centre_mm)) / CYCLES_UNIT_MM).astype(np.float32),
        "normals": mesh.normals,
        "triangles": mesh.triangles,
        "material": mesh.material,
    }
    if isinstance(medium, BeckmannSurface | PrincipledSkin) and scene.head.maps.normal is not None:
        arrays |= {"uv": mesh.uv, "normal_map": _normal_map(scene.head.maps.normal)}
    if isinstance(medium, PrincipledSkin):
        arrays |= {"uv": mesh.uv, "colour_map": medium.colour}
    return scene_dict, arrays | panorama


def _normal_map(uv_slopes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a normal map for Cycles: tangent-space normals (h, w, 3) encoded as colours.

    uv_slopes : (h, w, 2) slopes of the surface along u and v
    """
    normal = np.dstack([-uv_slopes, np.ones(uv_slopes.shape[:2], np.float32)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.asarray(0.5 + 0.5 * normal, np.float32)


def _materials(head: Head, medium: SkinMaterial, subsurface_method: str) -> list[SceneDict]:
    skin = _skin_material(medium, subsurface_method)
    return [
        {"name": material.name, **(skin if material.kind == "skin" else _diffuse_material(material.colour))}
        for material in head.mesh.materials
    ]


def _diffuse_material(colour: Sequence[float]) -> SceneDict:
    return {"method": "DIFFUSE", "colour": [float(part) for part in colour]}


def _skin_material(medium: SkinMaterial, subsurface_method: str) -> SceneDict:
    """Return the description of the skin's material for Cycles, with colour and subsurface radius.

    The colour is the diffuse reflectance of the medium, and the radius is its mean free path times 4 pi.
    From these, Cycles' random walk computes the mean free path and, by a fit that is accurate within 1 %, the
    single-scattering albedo. The method "burley" uses the profile of [ChristensenBurley2015] for the same
    colour and radius.

    In Cycles, light enters and leaves through a Lambertian surface. The reflectance of a ball under uniform
    light differs from the given colour by up to 3 % with the random walk, and by up to 0.5 % with "burley".
    """
    if isinstance(medium, Lambertian):
        return _diffuse_material(medium.albedo)
    if isinstance(medium, BeckmannSurface):
        # Blender's roughness is the square root of Beckmann's m.
        return {"method": "BECKMANN", "roughness": float(np.sqrt(medium.roughness)), "ior": SKIN_ETA}
    if isinstance(medium, PrincipledSkin):
        radius = [part / CYCLES_UNIT_MM for part in medium.radius_mm]
        roughness = float(np.sqrt(medium.roughness))
        return {"method": "PRINCIPLED", "roughness": roughness, "ior": SKIN_ETA, "radius": radius}
    if len(medium.layers) != 1:
        actual = f"it has {len(medium.layers)}"
        refuse(medium.name, "one layer, for Cycles", actual, "Take a medium of one layer, such as skin1")
    (layer,) = medium.layers
    radius_cycles = 4.0 * np.pi * layer.mean_free_path_mm / CYCLES_UNIT_MM
    colour = [diffuse_albedo(float(alpha)) for alpha in layer.alpha_prime]
    return {
        "method": CYCLES_METHOD_NAMES[subsurface_method],
        "colour": colour,
        "radius": radius_cycles.tolist(),
    }


def cycles_camera(scene: Scene) -> SceneDict:
    """Return Cycles' description of the scene's camera, in Cycles' units.

    Raises DermisError for lenses that Cycles does not support.
    """
    camera = scene.camera
    check_camera(camera, "Cycles")
    to_world = cycles_look_at(camera.position, np.subtract(camera.target, camera.position), camera.up)
    return {"to_world": to_world, "half_tangent": camera.half_view_tangent}
