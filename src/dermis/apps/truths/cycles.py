"""The same head by Cycles, as a Blender user would render it: by random walk or with Burley's profile.

Blender's Python runs `cycles_script.py` as a process of its own on a folder with the described scene.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.blender_process import PYTHON_VARIABLE as PYTHON_VARIABLE
from dermis.apps.truths.blender_process import BlenderTask, blender_python, run_blender
from dermis.apps.truths.scene_description import UNIT_MM, SceneDict, check_camera, cycles_look_at, cycles_world
from dermis.apps.truths.half_space import diffuse_albedo
from dermis.apps.truths.lights import cycles_lamp
from dermis.apps.truths.mitsuba_scene import Lambertian
from dermis.apps.truths.path_traced import PathTraced
from dermis.base.errors import DermisError, refuse
from dermis.images.io import read_image
from dermis.mesh.head import Head
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.specular.fresnel import SKIN_ETA

Floats = NDArray[np.float32]
Numbers = NDArray[np.generic]
Method = Literal["random-walk", "burley"]
_PASS_COUNT = 4
_TASK = BlenderTask("Cycles", "to render the scene", "Try bpy 5.0, which this was made with")
_MAX_START_S, _MAX_PATH_S = 300.0, 5e-4
"""Time limits for the start and for each path: a hundred times what two cores took."""


@dataclass(frozen=True, eq=False)
class CyclesPass:
    """One rendering by Cycles, black where there is no head.

    image : (h, w, 3) radiance, linear Rec. 709
    coverage : (h, w) share of the pixel that the head fills
    samples : paths through each pixel
    seconds : by the clock; for the first pass with building the scene and the acceleration structure
    core_seconds : summed over all cores
    version : Blender's
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
    method: Method = "random-walk",
    python: str | Path | None = None,
) -> PathTraced:
    """Return the scene by Cycles on the CPU, as the mean of 4 passes; arguments as of `cycles_passes`.

    samples : at least this many paths through each pixel
    """
    _check_samples(samples)
    each = -(-int(samples) // _PASS_COUNT)
    passes = cycles_passes(scene, medium, [each] * _PASS_COUNT, settings, method=method, python=python)
    images = np.stack([one.image for one in passes]).astype(np.float64)
    coverage = np.stack([one.coverage for one in passes]).astype(np.float64)
    return PathTraced(
        images.mean(axis=0).astype(np.float32),
        (images.var(axis=0, ddof=1) / _PASS_COUNT).astype(np.float32),
        coverage.mean(axis=0).astype(np.float32),
        each * _PASS_COUNT,
        sum(one.seconds for one in passes),
    )


def cycles_passes(
    scene: Scene,
    medium: SkinMaterial,
    samples: Sequence[int],
    settings: Settings | None = None,
    *,
    method: Method = "random-walk",
    seed: int = 0,
    python: str | Path | None = None,
) -> list[CyclesPass]:
    """Render the scene by Cycles on the CPU, once for each number of samples, in one process.

    There is no clamping, denoising or surface reflection.

    medium : of one layer; its eta is ignored, because Cycles' walks end at an index-matched surface. Its
        colour in Cycles is its diffuse reflectance, its radius 4 pi mean free paths. Or a `Lambertian`
        or `Facets`
    samples : paths through each pixel, for each pass
    settings : only the size counts
    seed : of the first pass; each further pass takes the next
    python : of an environment with `bpy`; by default the one that DERMIS_BLENDER_PYTHON names

    Raises DermisError when there is no such Python, when Cycles fails, and for more than one layer.
    """
    for count in samples:
        _check_samples(count)
    if method not in FALLOFFS:
        refuse("method", f"one of {', '.join(FALLOFFS)}", f"{method!r} came", "Correct it")
    size = (settings or Settings()).size
    described, arrays = describe_scene(scene, medium, method, size)
    described["passes"] = [{"samples": int(n), "seed": seed + k} for k, n in enumerate(samples)]
    interpreter = blender_python(python)
    with tempfile.TemporaryDirectory(prefix="dermis-cycles-") as name:
        folder = Path(name)
        _write_scene(folder, described, arrays)
        _run_cycles(interpreter, folder, paths=size[0] * size[1] * sum(samples))
        return read_passes(folder, samples, size)


def _check_samples(samples: int) -> None:
    if not (isinstance(samples, int | np.integer) and samples >= 1):
        refuse("samples", "a whole number from 1", f"{samples} came", "Correct it")


def _write_scene(folder: Path, described: SceneDict, arrays: Mapping[str, Numbers]) -> None:
    (folder / "scene.json").write_text(json.dumps(described), encoding="utf-8")
    np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]  # its last parameter is no array


def _run_cycles(python: Path, folder: Path, paths: int) -> None:
    """Render the scene in a folder.

    paths : to be traced, which sets the time limit
    """
    script = Path(__file__).with_name("cycles_script.py")
    run_blender(python, script, [str(folder)], _MAX_START_S + _MAX_PATH_S * paths, _TASK)


def read_passes(folder: Path, samples: Sequence[int], size: tuple[int, int]) -> list[CyclesPass]:
    """Return the passes that Cycles left in a folder.

    samples : of each pass
    size : width and height [pixel]

    Raises DermisError when they are not what was asked for.
    """
    try:
        done = json.loads((folder / "done.json").read_text(encoding="utf-8"))
        files = [folder / f"pass_{k}.exr" for k in range(len(samples))]
        pixels = [read_image(file).astype(np.float32, copy=False) for file in files]
        if any(one.shape != (size[1], size[0], 4) or not np.isfinite(one).all() for one in pixels):
            raise ValueError("a pass of another size, or with values that are not finite")
        found = zip(pixels, samples, done["times"], strict=True)
        return [
            CyclesPass(
                one[..., :3], one[..., 3], int(count), float(clock), float(cores), str(done["version"])
            )
            for one, count, (clock, cores) in found
        ]
    except (OSError, ValueError, KeyError, TypeError, DermisError) as fault:
        _refuse_render(f"it left something else ({str(fault) or type(fault).__name__})")


def _refuse_render(came: str) -> NoReturn:
    refuse(_TASK.who, _TASK.task, came, _TASK.remedy)


@dataclass(frozen=True)
class BeckmannSurface:
    """A surface alone, over black: a boundary of index 1.4 cut into Beckmann's facets.

    The head's normal map is on it.

    roughness : Beckmann's m [-]
    """

    roughness: float


@dataclass(frozen=True, eq=False)
class PrincipledSkin:
    """Skin as a Blender user makes it: Principled, a random walk under a rough boundary of index 1.4.

    The head's normal map is on it. Cycles has GGX's facets there; what they reflect does not enter.

    colour : (h, w, 3) of the light that comes back from below, linear Rec. 709 [-]
    radius_mm : (3,) Cycles' radius, 4 pi mean free paths [mm]
    roughness : m [-]
    """

    colour: NDArray[np.float32]
    radius_mm: tuple[float, float, float]
    roughness: float


SkinMaterial = Medium | Lambertian | BeckmannSurface | PrincipledSkin
FALLOFFS = {"random-walk": "RANDOM_WALK", "burley": "BURLEY"}
"""Our names of Cycles' methods of subsurface scattering."""


def describe_scene(
    scene: Scene, medium: SkinMaterial, method: str, size: tuple[int, int]
) -> tuple[SceneDict, dict[str, Numbers]]:
    """Return the contents of scene.json without the passes, and the arrays beside it."""
    around, panorama = cycles_world(scene.environment)
    described = {
        "materials": _materials(scene.head, medium, method),
        "lights": [cycles_lamp(light, number) for number, light in enumerate(scene.lights, start=1)],
        "world": around,
        "camera": cycles_camera(scene),
        "size": list(size),
        "direct": isinstance(medium, Lambertian | BeckmannSurface),
    }
    mesh = scene.head.mesh
    arrays: dict[str, Numbers] = {
        "positions": ((mesh.positions - np.array(scene.head.centre_mm)) / UNIT_MM).astype(np.float32),
        "normals": mesh.normals,
        "triangles": mesh.triangles,
        "material": mesh.material,
    }
    if isinstance(medium, BeckmannSurface | PrincipledSkin) and scene.head.maps.normal is not None:
        arrays |= {"uv": mesh.uv, "normal_map": _normal_map(scene.head.maps.normal)}
    if isinstance(medium, PrincipledSkin):
        arrays |= {"uv": mesh.uv, "colour_map": medium.colour}
    return described, arrays | panorama


def _normal_map(slopes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (h, w, 3) normals in tangent space as colours, of slopes (h, w, 2)."""
    normal = np.dstack([-slopes, np.ones(slopes.shape[:2], np.float32)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.asarray(0.5 + 0.5 * normal, np.float32)


def _materials(head: Head, medium: SkinMaterial, method: str) -> list[SceneDict]:
    skin = _skin_material(medium, method)
    return [
        {"name": material.name, **(skin if material.kind == "skin" else _diffuse_material(material.colour))}
        for material in head.mesh.materials
    ]


def _diffuse_material(colour: Sequence[float]) -> SceneDict:
    return {"method": "DIFFUSE", "colour": [float(part) for part in colour]}


def _skin_material(medium: SkinMaterial, method: str) -> SceneDict:
    """Return skin with the diffuse reflectance of a half-space as colour, 4 pi mean free paths as radius.

    Cycles divides radii by 4 pi, and finds the walk's albedo from the colour by a fit whose inverse is
    `diffuse_albedo` within 1 %, so that its random walk is through this medium; but it enters and leaves as
    off a Lambertian surface. Its other method is the profile of [ChristensenBurley2015] for the same two. A
    ball under even light returns its colour within 3 % by the walk, within 0.5 % by the profile.
    """
    if isinstance(medium, Lambertian):
        return _diffuse_material(medium.albedo)
    if isinstance(medium, BeckmannSurface):
        # Blender's number is the root of Beckmann's
        return {"method": "FACETS", "roughness": float(np.sqrt(medium.roughness)), "ior": SKIN_ETA}
    if isinstance(medium, PrincipledSkin):
        radius = [part / UNIT_MM for part in medium.radius_mm]
        return {
            "method": "COATED",
            "roughness": float(np.sqrt(medium.roughness)),
            "ior": SKIN_ETA,
            "radius": radius,
        }
    if len(medium.layers) != 1:
        came = f"it has {len(medium.layers)}"
        refuse(medium.name, "one layer, for Cycles", came, "Take a medium of one layer, such as skin1")
    (layer,) = medium.layers
    walk = 4.0 * np.pi * layer.mean_free_path_mm / UNIT_MM
    colour = [diffuse_albedo(float(alpha)) for alpha in layer.alpha_prime]
    return {"method": FALLOFFS[method], "colour": colour, "radius": walk.tolist()}


def cycles_camera(scene: Scene) -> SceneDict:
    """Return the camera in Cycles' units.

    Raises DermisError for lenses that Cycles has not.
    """
    camera = scene.camera
    check_camera(camera, "Cycles")
    path = np.subtract(camera.target, camera.position)
    return {
        "to_world": cycles_look_at(camera.position, path, camera.up),
        "half_tangent": camera.half_tangent,
    }
