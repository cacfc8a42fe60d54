"""The script that Blender runs: a text that stays the same, with the numbers of one export in it."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path
from pprint import pformat
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps import truths as reference
from dermis.apps.export.lights import known_lights
from dermis.apps.export.subject import BALL_MM, Subject
from dermis.apps.export.target import Rows
from dermis.apps.truths.blender_process import Errand, blender_python, run_blender
from dermis.apps.truths.cycles_scene import camera_of
from dermis.apps.truths.described import UNIT_MM, world
from dermis.apps.truths.lights import CYCLES, lamp
from dermis.mesh.head import Head
from dermis.scene.camera import Camera
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

_EMPTY = "DESCRIBED: dict[str, Any] = {}\n"
_IMPORT = "from dermis.apps.truths.cycles_script import add_light, add_object, set_camera, set_world\n"
_INSTEAD = "from mathutils import Matrix\n"
_END = 'if __name__ == "__main__":'
_BORROWED = (
    "set_camera",
    "set_world",
    "packed_image",
    "add_light",
    "paint_stripe",
    "connected",
    "add_object",
)
"""Functions of the script by which Cycles renders scenes for comparison, and those that they call."""


def script_text(described: Mapping[str, Any]) -> str:
    """The script for what is described: plain numbers, words, lists and tables of them.

    Words become literals as Python writes them, so that no name can be code.
    """
    text = _read(Path(__file__).with_name("blender_script.py"))
    borrowed = _functions(_read(Path(*reference.__path__) / "cycles_script.py"), _BORROWED)
    told = pformat(dict(described), width=110, sort_dicts=False)
    text = text.replace(_IMPORT, _INSTEAD).replace(_END, f"{borrowed}\n\n\n{_END}")
    return text.replace("  # type: ignore[import-not-found,unused-ignore]", "").replace(
        _EMPTY, f"DESCRIBED: dict[str, Any] = {told}\n"
    )


def _functions(source: str, names: tuple[str, ...]) -> str:
    """The text of some functions of a module, in that order."""
    found = {
        node.name: ast.get_source_segment(source, node)
        for node in ast.parse(source).body
        if isinstance(node, ast.FunctionDef)
    }
    return "\n\n\n".join(str(found[name]) for name in names)


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


Floats = NDArray[np.float64]
M = 1e-3
"""Of a millimetre."""
PANORAMA = "panorama.npy"
_UNIT_M = UNIT_MM * M
_UPRIGHT = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
_AWAY_MM, _FRAME_MM = 1100.0, 140.0  # of the camera before a ball
_LENGTHS = ("shadow_soft_size", "size", "size_y")


def before_ball(ball: Head) -> Scene:
    """Studio light and a camera before a ball."""
    return Scene(ball, camera=Camera(position=(0.0, 0.0, _AWAY_MM), frame_mm=_FRAME_MM))


def surroundings(scene: Scene, centre_mm: Any) -> tuple[dict[str, Any], NDArray[Any] | None]:
    """Lights, camera and world for the script, and the panorama that goes with them.

    centre_mm : (3,) where they are placed around

    Raises DermisError for lights and cameras that Blender has not.
    """
    centre = np.array(centre_mm) * M
    known = known_lights(scene.lights, CYCLES, "Blender")
    lights = [_light(lamp(light, number), centre) for number, light in enumerate(known, start=1)]
    camera = camera_of(scene)
    around, panorama = world(scene.environment)
    if "turn" in around:
        around["turn"] = (np.array(around["turn"]) @ _UPRIGHT[:3, :3].T).tolist()
        around["panorama"] = PANORAMA
    told = {
        "lights": lights,
        "camera": camera | {"to_world": _placed(camera["to_world"], centre)},
        "world": around,
    }
    return told, panorama.get("panorama")


def skin_slots(head: Head) -> list[int]:
    """Which materials of the written file are skin: it has only those that triangles use."""
    used = np.unique(head.mesh.material)
    return [slot for slot, kind in enumerate(used) if head.mesh.materials[kind].kind == "skin"]


def _placed(to_world: Any, centre: Floats) -> list[list[float]]:
    """A matrix of Cycles' scenes around the head's centre, for the upright head in metres."""
    matrix = np.array(to_world, np.float64)
    matrix[:3, 3] = matrix[:3, 3] * _UNIT_M + centre
    return [[float(value) for value in row] for row in _UPRIGHT @ matrix]


def _light(described: dict[str, Any], centre: Floats) -> dict[str, Any]:
    fields = dict(described["set"])
    fields |= {name: fields[name] * _UNIT_M for name in _LENGTHS if name in fields}
    if described["type"] != "SUN":
        fields["energy"] *= _UNIT_M**2  # power, which spreads over squares of lengths
    made = described | {"set": fields, "to_world": _placed(described["to_world"], centre)}
    if "stripe" in described:
        stripe = described["stripe"]
        axes = {name: _UPRIGHT[:3, :3] @ np.array(stripe[name]) for name in ("forward", "across", "along")}
        made["stripe"] = stripe | {name: axis.tolist() for name, axis in axes.items()}
    return made


SCRIPT, HEAD = "skin.py", "head.glb"
"""Names of the files in a folder."""
_ERRAND = Errand(
    "Blender",
    "to make the scene",
    "Name a Python whose bpy is of the version asked for, or write a folder and run its script in Blender",
)
_LONGEST_S = 600.0
_GGX = 0.5
"""Roughness of GGX's facets over that of our two lobes, by least squares of the roots of the lobes."""
_SHORT = 60  # characters of a name, of which Blender keeps 63


def write_scene(subject: Subject, rows: Rows, place: Path, method: str, versions: Any) -> list[Path]:
    """The files of a subject, where `Target.write` wants them.

    method : of Principled BSDF, or EEVEE
    versions : the first that the numbers hold for, and the first that they no longer hold for, or None
    """
    described = _described(subject, rows, method, versions)
    if place.suffix == ".blend":
        python = blender_python()
        with TemporaryDirectory(prefix="dermis-blender-") as name:
            script = _write(subject, described, Path(name) / SCRIPT, HEAD)[0]
            run_blender(python, script, ["--", "--save", str(place)], _LONGEST_S, _ERRAND)
        return [place]
    if place.suffix == ".py":
        return _write(subject, described, place, f"{place.stem}.glb")
    return _write(subject, described, place / SCRIPT, HEAD)


def _described(subject: Subject, rows: Rows, method: str, versions: Any) -> dict[str, Any]:
    skin = Skin() if subject.scene is None else subject.scene.skin
    inputs = {row.name: _plain(row.value) for row in rows if row.name != "Subsurface Method"}
    inputs["Specular IOR Level"] = 0.5 * skin.strength
    rough = float(np.sqrt(skin.smoothing * _GGX))
    return {
        "name": _printable(Path(subject.name).name),
        "versions": versions,
        "method": method,
        "inputs": inputs,
        "colour": [float(part) for part in np.clip(subject.albedo, 0.0, 1.0)],
        "roughness": float(np.sqrt(skin.roughness)),
        "smoother": rough,
        "ball_m": BALL_MM * M,
        "head": None,
        "skin_slots": skin_slots(subject.shape),
        "size": list(Settings().size),
    }


def _write(subject: Subject, described: dict[str, Any], script: Path, head: str) -> list[Path]:
    """The script and what it reads from beside it."""
    files = [script]
    scene = subject.scene
    if scene is None:
        around, panorama = surroundings(before_ball(subject.shape), np.zeros(3))
    else:
        around, panorama = surroundings(scene, scene.head.centre_mm)
    told = described | around
    if subject.head is not None:
        told["head"] = head
        files.append(script.with_name(head))
        files[-1].write_bytes(_glb(subject.head, subject.scene))
    if panorama is not None:
        files.append(script.with_name(PANORAMA))
        np.save(files[-1], panorama)
    script.write_text(script_text(told), encoding="utf-8")
    return files


def _glb(head: Head, scene: Scene | None) -> bytes:
    """The head with all that moves it, its eyes and its hairs."""
    from dermis.formats.gltf.write import encode_head
    from dermis.frame.passes.painting.eye_pictures import eye_pictures
    from dermis.gpu.failures import on_device
    from dermis.human.head_file import relief_slopes

    assert scene is not None
    pose, eyes = scene.pose, head.eyes
    pictures = None if eyes is None else on_device("auto", lambda device: eye_pictures(device, eyes.look))
    weights = {} if pose is None else dict(pose.weights)
    rough = scene.skin.roughness
    return encode_head(head, roughness=rough, weights=weights, slopes=relief_slopes(head), eyes=pictures)


def _plain(value: Any) -> Any:
    return [float(one) for one in value] if isinstance(value, tuple) else value


def _printable(name: str) -> str:
    """A name without what no name in Blender may hold."""
    return "".join(one if one.isprintable() else " " for one in name)[:_SHORT] or "skin"
