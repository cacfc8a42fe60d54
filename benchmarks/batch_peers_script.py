"""Render people with Cycles as for a data set. Run by Blender's Python: batch_peers_script.py FOLDER.

FOLDER contains plan.json (size, settings) and people as .glb. The scene of each person has three lights and a
camera in front of the face; each setting renders it twice with different seeds, with depth, normals and
material indices. The script writes done.json with times and the noise between the two renderings.
"""

from __future__ import annotations

import argparse
import json
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

with suppress(ImportError):  # only Blender's Python has this module
    import bpy  # type: ignore[import-not-found,unused-ignore]
    from mathutils import Vector  # type: ignore[import-not-found,unused-ignore]

_RADIUS_M = (0.0037, 0.0014, 0.0007)  # in the proportions of Blender's default subsurface radius
_LIGHTS = (((-0.8, -1.0, 0.5), 12.0), ((0.9, -0.8, 0.2), 5.0), ((0.3, 0.9, 0.8), 8.0))  # position [m], W
_LIGHT_M, _LENS_MM, _FAR_M = 0.5, 120.0, 0.95
_MIDDLE_M = 0.02  # distance of the face's centre below the midpoint of the eyes


def main(folder: Path) -> None:
    """Render all people with all settings and write done.json."""
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    measured = [measure(folder, person, plan) for person in sorted(folder.glob("*.glb"))]
    done = {"version": bpy.app.version_string, "people": measured}
    (folder / "done.json").write_text(json.dumps(done), encoding="utf-8")


def measure(folder: Path, person: Path, plan: dict[str, Any]) -> dict[str, Any]:
    """Return the time to build the scene of a person, and the times and the noise of each setting."""
    began, worked = time.perf_counter(), time.process_time()
    make_scene(person, plan["size"])
    build_times = time.perf_counter() - began, time.process_time() - worked
    found = {}
    for setting in plan["settings"]:
        both = [render(folder / "out", setting, seed) for seed in (1, 2)]
        (first, times), (second, _) = both
        head = first[..., 3] > 0.99
        apart = float(np.sqrt(np.mean((first[head, :3] - second[head, :3]) ** 2) / 2.0))
        found[setting["name"]] = {"times": times, "noise": apart / float(first[head, :3].mean())}
    return {"person": person.stem, "made": build_times, "settings": found}


def make_scene(person: Path, size: list[int]) -> None:
    """Load a person and set up skin, lights and camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.import_scene.gltf(filepath=str(person))
    for material in bpy.data.materials:
        for node in material.node_tree.nodes:
            if node.type == "BSDF_PRINCIPLED" and "skin" in material.name.lower():
                node.inputs["Subsurface Weight"].default_value = 1.0
                node.inputs["Subsurface Scale"].default_value = 1.0
                node.inputs["Subsurface Radius"].default_value = _RADIUS_M
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.2
    middle = Vector((0.0, 0.0, -_MIDDLE_M))
    for location, watts in _LIGHTS:
        light = bpy.data.lights.new("light", "AREA")
        light.energy, light.size = watts, _LIGHT_M
        aim(add("light", light), Vector(location), middle)
    camera = bpy.data.cameras.new("camera")
    camera.lens, camera.clip_start = _LENS_MM, 0.01
    bpy.context.scene.camera = add("camera", camera)
    aim(bpy.context.scene.camera, Vector((0.0, -_FAR_M, 0.0)), middle)
    set_render_settings(size)


def set_render_settings(size: list[int]) -> None:
    """Set up Cycles, the size of pictures, and their passes."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.cycles.device = "CPU"
    scene.cycles.use_adaptive_sampling = False
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_material_index = True
    for number, material in enumerate(bpy.data.materials):
        material.pass_index = number + 1
    set_file_format("OPEN_EXR_MULTILAYER")


def set_file_format(kind: str) -> None:
    """Set the file format of the pictures."""
    settings = bpy.context.scene.render.image_settings
    if hasattr(settings, "media_type"):  # required since Blender 5.0
        settings.media_type = "MULTI_LAYER_IMAGE" if kind.endswith("MULTILAYER") else "IMAGE"
    settings.file_format = kind


def render(path: Path, setting: dict[str, Any], seed: int) -> tuple[Any, tuple[float, float]]:
    """Return the (h, w, 4) linear picture, and the wall time and CPU time [s]."""
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.seed = setting["samples"], seed
    scene.cycles.use_denoising = setting["denoised"]
    scene.render.filepath = str(path)
    began, worked = time.perf_counter(), time.process_time()
    bpy.ops.render.render(write_still=True)
    times = time.perf_counter() - began, time.process_time() - worked
    return combined(path.with_suffix(".exr")), times


def combined(path: Path) -> Any:
    """Return the combined pass of a multilayer file, loaded by Blender."""
    settings = bpy.context.scene.render.image_settings
    set_file_format("OPEN_EXR")
    settings.color_depth, settings.color_mode = "32", "RGBA"
    flat = path.with_name("flat.exr")
    bpy.data.images["Render Result"].save_render(str(flat))
    set_file_format("OPEN_EXR_MULTILAYER")
    image = bpy.data.images.load(str(flat))
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def aim(item: Any, location: Vector, target: Vector) -> None:
    """Place an object and turn it towards a target."""
    item.location = location
    item.rotation_euler = (target - location).to_track_quat("-Z", "Y").to_euler()


def add(name: str, data: Any) -> Any:
    """Add an object with the given data to the scene and return it."""
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    return made


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    if not (given.folder / "plan.json").is_file() or "bpy" not in globals():
        parser.error(f"expected Blender's Python and a folder with plan.json, but got {given.folder}")
    main(given.folder)
