"""Script for Blender's Python: open, move and render a .glb file, and write the results to a folder."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import bpy  # type: ignore[import-not-found]
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]

MOVED, TURNED, DEGREES = "mouthSmileLeft", "head", 25.0


def main(file: str, folder: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=file)
    face = next(one for one in bpy.data.objects if one.type == "MESH" and one.data.shape_keys)
    armature = next(one for one in bpy.data.objects if one.type == "ARMATURE")
    keys = face.data.shape_keys.key_blocks
    found = {"rest": places(face)}
    keys[MOVED].value = 1.0
    found["moved"] = places(face)
    keys[MOVED].value = 0.0
    turn(armature.pose.bones[TURNED])
    found["turned"] = places(face)
    np.savez(folder / "places.npz", **found)
    told = {
        "version": bpy.app.version_string,
        "keys": [key.name for key in keys],
        "bones": [bone.name for bone in armature.data.bones],
        "materials": [slot.material.name for slot in face.material_slots],
        "uv": [layer.name for layer in face.data.uv_layers],
    }
    (folder / "told.json").write_text(json.dumps(told))
    render(folder / "picture.png", (0.0, -1.0, 0.0), 85.0)
    face.parent.data.pose_position = "REST"
    x, _, z = armature.data.bones["eye.L"].head_local
    render(folder / "eye.png", (x, -1.0, z), 1300.0)


def places(face: object) -> np.ndarray:
    """Return the vertices (v, 3) as Blender draws them, in Blender's axes [m]."""
    bpy.context.view_layer.update()
    seen = face.evaluated_get(bpy.context.evaluated_depsgraph_get())
    found = np.empty(3 * len(seen.data.vertices), np.float32)
    seen.data.vertices.foreach_get("co", found)
    return found.reshape(-1, 3) @ np.array(seen.matrix_world)[:3, :3].T


def turn(bone: object) -> None:
    """Rotate a bone about the upward axis through its rest position."""
    there = Matrix.Translation(bone.bone.head_local)
    bone.matrix = there @ Matrix.Rotation(math.radians(DEGREES), 4, "Z") @ there.inverted() @ bone.matrix


def render(path: Path, place: tuple[float, float, float], lens: float) -> None:
    """Render a small picture from the front, under uniform white light."""
    bpy.ops.preferences.addon_enable(module="cycles")
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = place, (math.pi / 2, 0.0, 0.0)
    scene.camera, camera.data.lens = camera, lens
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 8, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
