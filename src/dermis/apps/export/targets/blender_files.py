"""The files of an export to Blender: the script, the head beside it, or the .blend that both make."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from dermis.apps.export.subject import BALL_MM, Subject
from dermis.apps.export.target import Rows
from dermis.apps.export.targets.blender_scene import PANORAMA, M, before_ball, skin_slots, surroundings
from dermis.apps.export.targets.blender_text import script_text
from dermis.apps.validation.truths.blender_process import Errand, blender_python, run_blender
from dermis.mesh.head import Head
from dermis.scene.model import Scene
from dermis.scene.pose import Pose
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

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
    from dermis.frame.passes.painting.eye_pictures import eye_pictures
    from dermis.gpu.failures import on_device
    from dermis.human.head_file import relief_slopes
    from dermis.mesh.gltf.write import encode_head

    assert scene is not None
    pose, eyes = Pose.of(scene.pose), head.eyes
    pictures = None if eyes is None else on_device("auto", lambda device: eye_pictures(device, eyes.look))
    weights = {} if pose is None else dict(pose.weights)
    rough = scene.skin.roughness
    return encode_head(head, roughness=rough, weights=weights, slopes=relief_slopes(head), eyes=pictures)


def _plain(value: Any) -> Any:
    return [float(one) for one in value] if isinstance(value, tuple) else value


def _printable(name: str) -> str:
    """A name without what no name in Blender may hold."""
    return "".join(one if one.isprintable() else " " for one in name)[:_SHORT] or "skin"
