"""Files of an export to Blender: a Python script with a .glb file of the head, or a .blend file.

Scenes are in metres with Z up.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from pprint import pformat
from tempfile import TemporaryDirectory
from typing import NamedTuple
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps import truths
from dermis.apps.export.scene_parts import supported_lights
from dermis.apps.export.subject import BALL_DIAMETER_MM, Subject
from dermis.apps.export.target import Parameters, flat_tuple
from dermis.apps.truths.blender_process import BlenderTask, blender_python, run_blender
from dermis.apps.truths.cycles import cycles_camera
from dermis.apps.truths.lights import CYCLES_LIGHTS, cycles_lamp
from dermis.apps.truths.scene_description import CYCLES_UNIT_MM, SceneDict, cycles_world
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.formats.gltf.hair_colours import hair_albedo
from dermis.formats.gltf.materials import skin_material_names
from dermis.formats.gltf.write import encode_head
from dermis.human.person_file import relief_slopes
from dermis.mesh.head import Head
from dermis.mesh.strand_groups import SCALP_HAIR, strand_groups, sufficient_knots
from dermis.scene.camera import Camera
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.specular.hair import AZIMUTHAL_ROUGHNESS, KERATIN_ETA, LONGITUDINAL_ROUGHNESS

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
VersionRange = tuple[list[int], list[int] | None]
"""First version of Blender for which parameters are valid, and first later version for which they are
invalid; the latter is None if they are valid for all later versions."""
SCRIPT_FILE, HEAD_FILE, PANORAMA_FILE = "skin.py", "head.glb", "panorama.npy"
_HAIR_SUFFIX = ".npz"  # of the file of scalp hair, whose name is that of the head
"""Names of the files in an output folder."""
METRES_PER_MM = 1e-3
_CYCLES_UNIT_M = CYCLES_UNIT_MM * METRES_PER_MM
_Y_UP_TO_Z_UP = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
_BALL_CAMERA_DISTANCE_MM, _BALL_FRAME_HEIGHT_MM = 1100.0, 140.0  # camera distance from a ball; visible height
_LAMP_LENGTH_FIELDS = ("shadow_soft_size", "size", "size_y")
_BLENDER_TASK = BlenderTask(
    "Blender",
    "to create the scene",
    "Set it to a Python whose bpy has the requested version, or export a folder and run the script in it",
)
_BLENDER_TIMEOUT_S = 600.0
_GGX_PER_BECKMANN_ROUGHNESS = 0.5
"""Ratio of GGX roughness to Beckmann roughness, from a least squares fit of the lobes' square roots [-]."""
_MAX_KNOT_DEVIATION_MM, _MAX_KNOT_COUNT = 0.3, 40  # of a curve from a hair; knots of a curve
_MAX_FILE_NAME_LENGTH = 60  # characters; Blender truncates names to 63
_EXPORT_DATA_LINE = "EXPORT: dict[str, Any] = {}\n"
_HELPER_IMPORT_PATTERN = re.compile(r"from dermis\.apps\.truths\.cycles_script import (.*)\n")
_BPY_TYPE_COMMENT = "  # type: ignore[import-not-found,unused-ignore]"
_MAIN_GUARD = 'if __name__ == "__main__":'


def write_scene(
    subject: Subject,
    parameters: Parameters,
    output: Path,
    subsurface_method: str,
    valid_versions: VersionRange,
) -> list[Path]:
    """Write a subject as a Python script or a .blend file, and return the paths of all written files.

    output : path that `Target.write` receives
    subsurface_method : subsurface method of the Principled BSDF, or "EEVEE"
    valid_versions : versions of Blender for which the parameters are valid, see `VersionRange`
    """
    skin = _describe_skin(subject, parameters, subsurface_method, valid_versions)
    if output.suffix == ".blend":
        python = blender_python()
        with TemporaryDirectory(prefix="dermis-blender-") as name:
            script = _write_script_files(subject, skin, Path(name) / SCRIPT_FILE, HEAD_FILE)[0]
            run_blender(python, script, ["--", "--save", str(output)], _BLENDER_TIMEOUT_S, _BLENDER_TASK)
        return [output]
    if output.suffix == ".py":
        return _write_script_files(subject, skin, output, f"{output.stem}.glb")
    return _write_script_files(subject, skin, output / SCRIPT_FILE, HEAD_FILE)


def _describe_skin(
    subject: Subject, parameters: Parameters, subsurface_method: str, valid_versions: VersionRange
) -> SceneDict:
    skin = subject.skin
    values = {one.name: one.value for one in parameters if one.name != "Subsurface Method"}
    inputs = {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}
    name = "".join(letter if letter.isprintable() else " " for letter in Path(subject.name).name)
    return {
        "name": name[:_MAX_FILE_NAME_LENGTH] or "skin",
        "versions": list(valid_versions),
        "method": subsurface_method,
        "inputs": inputs | {"Specular IOR Level": 0.5 * skin.specular_strength},
        "colour": list(flat_tuple(subject.clipped_albedo())),
        "roughness": float(np.sqrt(skin.roughness)),
        "smoother": float(np.sqrt(skin.roughness_factor * _GGX_PER_BECKMANN_ROUGHNESS)),
        "ball_m": BALL_DIAMETER_MM * METRES_PER_MM,
        "head": None,
        "hair": None,
        "skin_materials": skin_material_names(subject.head_or_ball),
        "size": list(Settings().size),
    }


def _write_script_files(
    subject: Subject, skin_description: SceneDict, script_path: Path, head_name: str
) -> list[Path]:
    """Write the script, and beside it the files of the head and the panorama; return all written paths.

    skin_description : data of the skin for the script, such as the inputs of the Principled BSDF
    head_name : name of the file of the head
    """
    files, scene = [script_path], subject.scene
    if scene is None:
        scene_dict, panorama = describe_scene(_ball_scene(subject.head_or_ball), np.zeros(3))
    else:
        scene_dict, panorama = describe_scene(scene, scene.head.centre_mm)
        scene_dict["head"] = head_name
        files.append(script_path.with_name(head_name))
        files[-1].write_bytes(_encode_head(subject, scene))
        if (hair := _scalp_hair(scene.head)) is not None:
            files.append(files[-1].with_suffix(_HAIR_SUFFIX))
            hair.write(files[-1])
            scene_dict["hair"] = {
                "file": files[-1].name,
                "bone": hair.bone,
                "roughness": [LONGITUDINAL_ROUGHNESS, AZIMUTHAL_ROUGHNESS],
                "ior": KERATIN_ETA,
            }
    if panorama is not None:
        files.append(script_path.with_name(PANORAMA_FILE))
        np.save(files[-1], panorama)
    script_path.write_text(blender_script_text(skin_description | scene_dict), encoding="utf-8")
    return files


class _ScalpHair(NamedTuple):
    """Scalp hair for Blender.

    arrays : points_m (n, k, 3) with Z up and radius_m (n, k) [m] of n hairs, absorption (n, 3), which is the
        absorption coefficient times the radius [-], and colour (n, 3) of many such hairs [-]
    bone : name of the bone that the hair follows; empty without bones
    """

    arrays: dict[str, Floats32]
    bone: str

    def write(self, path: Path) -> None:
        """Write the arrays as a compressed NumPy archive."""
        with ZipFile(path, "w", ZIP_DEFLATED) as archive:
            for name, values in self.arrays.items():
                with archive.open(f"{name}.npy", "w") as member:
                    np.save(member, values, allow_pickle=False)


def _scalp_hair(head: Head) -> _ScalpHair | None:
    strands, deformable = strand_groups(head).get(SCALP_HAIR), DeformableMesh(head)
    if strands is None:
        return None
    kept = sufficient_knots(strands, _MAX_KNOT_DEVIATION_MM, _MAX_KNOT_COUNT)
    points_mm = replace(head.mesh, positions=deformable.positions_mm).points_mm
    knots_mm = strands.knot_positions_mm(head.mesh, points_mm)[:, kept]
    radius_mm = strands.radius_mm[:, kept]
    arrays = {
        "points_m": METRES_PER_MM * knots_mm @ _Y_UP_TO_Z_UP[:3, :3].T,
        "radius_m": METRES_PER_MM * radius_mm,
        "absorption": strands.absorption * radius_mm.max(axis=1, keepdims=True),
        "colour": hair_albedo(strands),
    }
    skeleton = deformable.rig.skeleton
    bone = "" if skeleton is None else skeleton.names[deformable.root_bone(strands.roots)]
    return _ScalpHair({name: values.astype(np.float32) for name, values in arrays.items()}, bone)


def _encode_head(subject: Subject, scene: Scene) -> bytes:
    """Return a .glb file of the head with morph targets, bones, eyes, brows, lashes and beard."""
    return encode_head(
        scene.head,
        roughness=scene.skin.roughness,
        weights={} if scene.pose is None else dict(scene.pose.weights),
        slopes=relief_slopes(scene.head),
        eyes=subject.eye_pictures(),
        compact=True,
        scalp_hair=False,
    )


def blender_script_text(export_data: Mapping[str, object]) -> str:
    """Return the text of the Blender script with the exported parameters and scene as Python literals.

    Text is written as a Python literal, so that a name cannot inject code.

    export_data : numbers, texts, and nested lists and dictionaries of numbers and texts
    """
    text = Path(__file__).with_name("blender_script.py").read_text(encoding="utf-8")
    source = (Path(*truths.__path__) / "cycles_script.py").read_text(encoding="utf-8")
    functions = {node.name: node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}
    imported = _HELPER_IMPORT_PATTERN.search(text)
    assert imported is not None
    names = imported[1].split(", ")
    for name in names:  # the list grows by the functions that these functions call
        called = {node.id for node in ast.walk(functions[name]) if isinstance(node, ast.Name)}
        names += sorted(called & functions.keys() - {*names})
    copied = "\n\n\n".join(str(ast.get_source_segment(source, functions[name])) for name in names)
    literal = pformat(dict(export_data), width=110, sort_dicts=False)
    text = _HELPER_IMPORT_PATTERN.sub("", text).replace(_BPY_TYPE_COMMENT, "")
    text = text.replace(_MAIN_GUARD, f"{copied}\n\n\n{_MAIN_GUARD}")
    return text.replace(_EXPORT_DATA_LINE, f"EXPORT: dict[str, Any] = {literal}\n")


def _ball_scene(ball: Head) -> Scene:
    """Return a scene with a ball, studio lights, and a camera in front of the ball."""
    return Scene(
        ball, camera=Camera(position=(0.0, 0.0, _BALL_CAMERA_DISTANCE_MM), frame_mm=_BALL_FRAME_HEIGHT_MM)
    )


def describe_scene(scene: Scene, centre_mm: ArrayLike) -> tuple[SceneDict, NDArray[np.float32] | None]:
    """Return the lights, camera and world for the script, and the environment's panorama if there is one.

    centre_mm : (3,) position of the head's centre in the exported scene; positions in `scene` are relative to
        this centre [mm]

    Raises DermisError for lights and cameras that Blender does not support.
    """
    centre = np.array(centre_mm) * METRES_PER_MM
    supported = supported_lights(scene.lights, CYCLES_LIGHTS, "Blender")
    lights = [_convert_lamp(cycles_lamp(light, k), centre) for k, light in enumerate(supported, start=1)]
    camera = cycles_camera(scene)
    world, panorama = cycles_world(scene.environment)
    if "turn" in world:
        world["turn"] = (np.array(world["turn"]) @ _Y_UP_TO_Z_UP[:3, :3].T).tolist()
        world["panorama"] = PANORAMA_FILE
    camera |= {"to_world": _convert_transform(camera["to_world"], centre)}
    return {"lights": lights, "camera": camera, "world": world}, panorama.get("panorama")


def _convert_transform(to_world: ArrayLike, origin_m: Floats) -> list[list[float]]:
    """Convert a transformation from Y up, with lengths in `CYCLES_UNIT_MM`, to Blender's Z up, in metres.

    origin_m : (3,) position of the input's origin in the exported scene, in coordinates with Y up [m]
    """
    matrix = np.array(to_world, np.float64)
    matrix[:3, 3] = matrix[:3, 3] * _CYCLES_UNIT_M + origin_m
    return [[float(value) for value in row] for row in _Y_UP_TO_Z_UP @ matrix]


def _convert_lamp(lamp: SceneDict, origin_m: Floats) -> SceneDict:
    """Convert a lamp's description from Y up, with lengths in `CYCLES_UNIT_MM`, to Blender's Z up, in metres.

    origin_m : (3,) position of the input's origin in the exported scene, in coordinates with Y up [m]
    """
    fields = dict(lamp["set"])
    fields |= {name: fields[name] * _CYCLES_UNIT_M for name in _LAMP_LENGTH_FIELDS if name in fields}
    if lamp["type"] != "SUN":
        fields["energy"] *= _CYCLES_UNIT_M**2  # radiant power is irradiance times area
    converted = lamp | {"set": fields, "to_world": _convert_transform(lamp["to_world"], origin_m)}
    if "stripe" in lamp:
        stripe = lamp["stripe"]
        axes = {
            name: _Y_UP_TO_Z_UP[:3, :3] @ np.array(stripe[name]) for name in ("forward", "across", "along")
        }
        converted["stripe"] = stripe | {name: axis.tolist() for name, axis in axes.items()}
    return converted
