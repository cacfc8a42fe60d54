"""A half-lit plane of exported skin in Cycles. Blender's Python runs it by its path: THIS_FILE FOLDER.

FOLDER holds skin.py, as `dermis export --to blender` writes it, and passes.json. The script adds done.json:
Blender's version and, for each pass, the radiance of each column of pixels, lit from x = 0 on.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

with suppress(ImportError):  # which only Blender's Python has
    import bpy  # type: ignore[import-not-found,unused-ignore]
    from mathutils import Matrix  # type: ignore[import-not-found,unused-ignore]

SIDE_M, CARD_HEIGHT_M = 1.0, 0.002  # of the plane, and above it the card that shades half of it


def main(folder: Path) -> None:
    found = importlib.util.spec_from_file_location("skin", folder / "skin.py")
    skin = importlib.util.module_from_spec(found)  # type: ignore[arg-type]
    found.loader.exec_module(skin)  # type: ignore[union-attr]
    skin.check_version()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    material = skin.make_skin()
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Specular IOR Level"].default_value = 0.0  # the edge below the surface alone
    rectangle(skin, material, -SIDE_M, SIDE_M, 0.0)
    card = rectangle(skin, black_material(), -SIDE_M, 0.0, CARD_HEIGHT_M)
    card.visible_camera = False
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = 1.0, 0.0
    skin.add_object("sun", sun)
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.sensor_fit = "ORTHO", "HORIZONTAL"
    camera.clip_start = 1e-4
    placed = skin.add_object("camera", camera)
    placed.matrix_world = Matrix.Translation((0.0, 0.0, 0.1))
    scene = bpy.context.scene
    scene.camera = placed
    skin.set_render(scene)
    asked = json.loads((folder / "passes.json").read_text(encoding="utf-8"))
    columns = []
    for k, one in enumerate(asked):
        set_channel(shader, skin.DESCRIBED, one.pop("channel"))
        columns.append(column_radiance(skin, camera, folder / f"{k}.exr", **one))
    done = {"version": bpy.app.version_string, "columns": columns}
    (folder / "done.json").write_text(json.dumps(done), encoding="utf-8")


def set_channel(shader: Any, described: dict[str, Any], channel: int) -> None:
    """Give all three channels the colour and the radius of one: paths then all serve it."""
    shader.inputs["Base Color"].default_value = (*[described["colour"][channel]] * 3, 1.0)
    shader.inputs["Subsurface Radius"].default_value = [described["inputs"]["Subsurface Radius"][channel]] * 3


def rectangle(skin: Any, material: Any, left: float, right: float, height: float) -> Any:
    mesh = bpy.data.meshes.new("rectangle")
    corners = [(left, -SIDE_M), (right, -SIDE_M), (right, SIDE_M), (left, SIDE_M)]
    mesh.from_pydata([(x, y, height) for x, y in corners], [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    return skin.add_object("rectangle", mesh)


def black_material() -> Any:
    material = bpy.data.materials.new("black")
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return material


def column_radiance(skin: Any, camera: Any, path: Path, width_m: float, size: list[int], **given: int) -> Any:
    """Return mean radiance of each column of a picture of the plane so wide, across the edge of the light."""
    camera.ortho_scale = width_m
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    words = [word for name, value in given.items() for word in (f"--{name}", str(value))]
    skin.finish(skin.options(["--", "--render", str(path), *words]))
    picture = bpy.data.images.load(str(path))
    pixels = np.empty(size[0] * size[1] * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    return pixels.reshape(size[1], size[0], 4)[..., :3].mean(axis=0).tolist()


if __name__ == "__main__":
    main(Path(sys.argv[-1]))
