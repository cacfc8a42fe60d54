"""Files of an export to Blender: a script with the numbers of one export, the head beside it, or a .blend.

Scenes are in metres with Z upwards.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path
from pprint import pformat
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps import truths
from dermis.apps.export.scene_parts import supported_lights
from dermis.apps.export.subject import BALL_MM, Subject
from dermis.apps.export.target import Parameters, floats
from dermis.apps.truths.blender_process import BlenderTask, blender_python, run_blender
from dermis.apps.truths.cycles import cycles_camera
from dermis.apps.truths.scene_description import UNIT_MM, SceneDict, cycles_world
from dermis.apps.truths.lights import CYCLES, cycles_lamp
from dermis.formats.gltf.write import encode_head
from dermis.human.person_file import relief_slopes
from dermis.mesh.head import Head
from dermis.scene.camera import Camera
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
Versions = tuple[list[int], list[int] | None]
"""First version that numbers hold for, and the first that they no longer hold for, or None."""
SCRIPT, HEAD, PANORAMA = "skin.py", "head.glb", "panorama.npy"
"""Names of the files in a folder."""
M = 1e-3
"""Of a millimetre."""
_UNIT_M = UNIT_MM * M
_UPRIGHT = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
_BALL_DISTANCE_MM, _BALL_FRAME_MM = 1100.0, 140.0  # of the camera before a ball
_LENGTH_FIELDS = ("shadow_soft_size", "size", "size_y")
_PROCESS_PURPOSE = BlenderTask(
    "Blender",
    "to make the scene",
    "Name a Python whose bpy is of the version asked for, or write a folder and run its script in Blender",
)
_TIMEOUT_S = 600.0
_GGX_RATIO = 0.5
"""Roughness of GGX's facets over that of our two lobes, by least squares of the roots of the lobes."""
_MAX_NAME_LENGTH = 60  # characters of a name, of which Blender keeps 63
_DATA_LINE = "DESCRIBED: dict[str, Any] = {}\n"
_COPIED_IMPORT = "from dermis.apps.truths.cycles_script import add_light, add_object, set_camera, set_world\n"
_IMPORT_REPLACEMENT = "from mathutils import Matrix\n"
_TYPE_COMMENT = "  # type: ignore[import-not-found,unused-ignore]"
_MAIN_GUARD = 'if __name__ == "__main__":'
_COPIED_FUNCTIONS = [
    "set_camera",
    "set_world",
    "packed_image",
    "add_light",
    "paint_stripe",
    "connected",
    "add_object",
]
"""Functions of the script by which Cycles renders scenes for comparison, and those that they call."""


def write_scene(subject: Subject, parameters: Parameters, output: Path, method: str, versions: Versions) -> list[Path]:
    """Write the files of a subject to the place that `Target.write` gets; return their paths.

    method : of Principled BSDF, or EEVEE
    """
    description = _describe_skin(subject, parameters, method, versions)
    if place.suffix == ".blend":
        python = blender_python()
        with TemporaryDirectory(prefix="dermis-blender-") as name:
            script = _write(subject, description, Path(name) / SCRIPT, HEAD)[0]
            run_blender(python, script, ["--", "--save", str(place)], _TIMEOUT_S, _PROCESS_PURPOSE)
        return [output]
    if place.suffix == ".py":
        return _write(subject, description, place, f"{place.stem}.glb")
    return _write(subject, description, place / SCRIPT, HEAD)


def _describe_skin(subject: Subject, parameters: Parameters, method: str, versions: Versions) -> SceneDict:
    skin = subject.skin
    values = {row.name: row.value for row in parameters if row.name != "Subsurface Method"}
    inputs = {name: list(one) if isinstance(one, tuple) else one for name, one in values.items()}
    name = "".join(one if one.isprintable() else " " for one in Path(subject.name).name)
    return {
        "name": name[:_MAX_NAME_LENGTH] or "skin",
        "versions": list(versions),
        "method": method,
        "inputs": inputs | {"Specular IOR Level": 0.5 * skin.strength},
        "colour": list(floats(subject.clipped_albedo())),
        "roughness": float(np.sqrt(skin.roughness)),
        "smoother": float(np.sqrt(skin.smoothing * _GGX_RATIO)),
        "ball_m": BALL_MM * M,
        "head": None,
        "skin_slots": skin_slots(subject.head_or_ball),
        "size": list(Settings().size),
    }


def _write(subject: Subject, description: SceneDict, script: Path, head: str) -> list[Path]:
    """Write the script and the files that it reads beside it."""
    files, scene = [script], subject.scene
    if scene is None:
        world_settings, panorama = describe_scene(_ball_scene(subject.head_or_ball), np.zeros(3))
    else:
        world_settings, panorama = describe_scene(scene, scene.head.centre_mm)
        world_settings["head"] = head
        files.append(script.with_name(head))
        files[-1].write_bytes(_glb(subject, scene))
    if panorama is not None:
        files.append(script.with_name(PANORAMA))
        np.save(files[-1], panorama)
    script.write_text(script_text(description | world_settings), encoding="utf-8")
    return files


def _glb(subject: Subject, scene: Scene) -> bytes:
    """Return the head with all that moves it, its eyes and its hairs."""
    pose = scene.pose
    return encode_head(
        scene.head,
        roughness=scene.skin.roughness,
        weights={} if pose is None else dict(pose.weights),
        slopes=relief_slopes(scene.head),
        eyes=subject.eye_pictures(),
    )


def skin_slots(head: Head) -> list[int]:
    """Return the skin's materials in the written file, which has only those that triangles use."""
    used = np.unique(head.mesh.material)
    return [slot for slot, kind in enumerate(used) if head.mesh.materials[kind].kind == "skin"]


def script_text(description: Mapping[str, object]) -> str:
    """Return the script for what is described: plain numbers, words, lists and tables of them.

    Words become literals as Python writes them, so that no name can be code.
    """
    text = Path(__file__).with_name("blender_script.py").read_text(encoding="utf-8")
    source = (Path(*truths.__path__) / "cycles_script.py").read_text(encoding="utf-8")
    known = {one.name: one for one in ast.parse(source).body if isinstance(one, ast.FunctionDef)}
    borrowed = "\n\n\n".join(str(ast.get_source_segment(source, known[name])) for name in _COPIED_FUNCTIONS)
    literal = pformat(dict(description), width=110, sort_dicts=False)
    text = text.replace(_COPIED_IMPORT, _IMPORT_REPLACEMENT).replace(_MAIN_GUARD, f"{borrowed}\n\n\n{_MAIN_GUARD}").replace(_TYPE_COMMENT, "")
    return text.replace(_DATA_LINE, f"DESCRIBED: dict[str, Any] = {literal}\n")


def _ball_scene(ball: Head) -> Scene:
    """Return studio light and a camera before a ball."""
    return Scene(ball, camera=Camera(position=(0.0, 0.0, _BALL_DISTANCE_MM), frame_mm=_BALL_FRAME_MM))


def describe_scene(scene: Scene, centre_mm: ArrayLike) -> tuple[SceneDict, NDArray[np.float32] | None]:
    """Return lights, camera and world for the script, and their panorama.

    centre_mm : (3,) about which they are placed

    Raises DermisError for lights and cameras that Blender has not.
    """
    centre = np.array(centre_mm) * M
    known = supported_lights(scene.lights, CYCLES, "Blender")
    lights = [_light(cycles_lamp(light, number), centre) for number, light in enumerate(known, start=1)]
    camera = cycles_camera(scene)
    world_settings, panorama = cycles_world(scene.environment)
    if "turn" in world_settings:
        world_settings["turn"] = (np.array(world_settings["turn"]) @ _UPRIGHT[:3, :3].T).tolist()
        world_settings["panorama"] = PANORAMA
    description = {
        "lights": lights,
        "camera": camera | {"to_world": _upright_transform(camera["to_world"], centre)},
        "world": world_settings,
    }
    return description, panorama.get("panorama")


def _upright_transform(to_world: ArrayLike, centre: Floats) -> list[list[float]]:
    """Return a matrix of Cycles' scenes about the head's centre, for the upright head in metres."""
    matrix = np.array(to_world, np.float64)
    matrix[:3, 3] = matrix[:3, 3] * _UNIT_M + centre
    return [[float(value) for value in row] for row in _UPRIGHT @ matrix]


def _light(description: SceneDict, centre: Floats) -> SceneDict:
    fields = dict(description["set"])
    fields |= {name: fields[name] * _UNIT_M for name in _LENGTH_FIELDS if name in fields}
    if description["type"] != "SUN":
        fields["energy"] *= _UNIT_M**2  # power, which spreads over squares of lengths
    made = description | {"set": fields, "to_world": _upright_transform(description["to_world"], centre)}
    if "stripe" in description:
        stripe = description["stripe"]
        axes = {name: _UPRIGHT[:3, :3] @ np.array(stripe[name]) for name in ("forward", "across", "along")}
        made["stripe"] = stripe | {name: axis.tolist() for name, axis in axes.items()}
    return made
