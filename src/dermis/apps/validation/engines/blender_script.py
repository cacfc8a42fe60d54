"""Script for Blender's Python that renders a plane of exported skin in Cycles, lit where x > 0.

Its argument is a folder with skin.py, as written by `dermis export --to blender`, and passes.json. The script
adds done.json: Blender's version and, for each pass, the mean radiance of each column of pixels.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

with suppress(ImportError):  # only Blender's Python has these modules
    import bpy  # type: ignore[import-not-found,unused-ignore]
    from mathutils import Matrix  # type: ignore[import-not-found,unused-ignore]

PLANE_HALF_SIDE_M, CARD_HEIGHT_M = (
    1.0,
    0.002,
)  # half side of the plane, and height of the card that shades half of it


def main(folder: Path) -> None:
    """Render the passes listed in passes.json; write the mean radiance of each pixel column to done.json."""
    spec = importlib.util.spec_from_file_location("skin", folder / "skin.py")
    skin = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
    spec.loader.exec_module(skin)  # type: ignore[union-attr]
    skin.check_version()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    material = skin.make_skin_material()
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Specular IOR Level"].default_value = 0.0  # light below the surface only
    add_rectangle(skin, material, -PLANE_HALF_SIDE_M, PLANE_HALF_SIDE_M, 0.0)
    card = add_rectangle(skin, black_material(), -PLANE_HALF_SIDE_M, 0.0, CARD_HEIGHT_M)
    card.visible_camera = False
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = 1.0, 0.0
    skin.add_object("sun", sun)
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.sensor_fit = "ORTHO", "HORIZONTAL"
    camera.clip_start = 1e-4
    camera_object = skin.add_object("camera", camera)
    camera_object.matrix_world = Matrix.Translation((0.0, 0.0, 0.1))
    scene = bpy.context.scene
    scene.camera = camera_object
    skin.set_render_settings(scene)
    passes = json.loads((folder / "passes.json").read_text(encoding="utf-8"))
    columns = []
    for k, one in enumerate(passes):
        isolate_channel(shader, skin.EXPORT, one.pop("channel"))
        columns.append(column_radiance(skin, camera, folder / f"{k}.exr", **one))
    report = {"version": bpy.app.version_string, "columns": columns}
    (folder / "done.json").write_text(json.dumps(report), encoding="utf-8")


def isolate_channel(shader: Any, subsurface_parameters: dict[str, Any], channel: int) -> None:
    """Give all three channels the albedo and subsurface radius of one channel.

    Each path then contributes to the measurement of this channel.

    subsurface_parameters : subsurface parameters of the exported skin, with values for all channels
    """
    shader.inputs["Base Color"].default_value = (*[subsurface_parameters["colour"][channel]] * 3, 1.0)
    radius = subsurface_parameters["inputs"]["Subsurface Radius"][channel]
    shader.inputs["Subsurface Radius"].default_value = [radius] * 3


def add_rectangle(skin_script: Any, material: Any, left_m: float, right_m: float, height_m: float) -> Any:
    """Add a horizontal rectangle between two x coordinates, at a height; return its object.

    skin_script : exported script, imported as a module
    """
    mesh = bpy.data.meshes.new("rectangle")
    corners = [
        (left_m, -PLANE_HALF_SIDE_M),
        (right_m, -PLANE_HALF_SIDE_M),
        (right_m, PLANE_HALF_SIDE_M),
        (left_m, PLANE_HALF_SIDE_M),
    ]
    mesh.from_pydata([(x, y, height_m) for x, y in corners], [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    return skin_script.add_object("rectangle", mesh)


def black_material() -> Any:
    """Return a black material without specular reflection."""
    material = bpy.data.materials.new("black")
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return material


def column_radiance(
    skin_script: Any, camera: Any, path: Path, width_m: float, picture_size: Any, **parameters: int
) -> Any:
    """Render the edge of the lit half of the plane, and return the mean radiance of each pixel column.

    skin_script : exported script, imported as a module
    path : file to which the picture is written
    width_m : width of the visible area [m]
    picture_size : width and height of the picture [pixel]
    parameters : values of options of the exported script, such as `samples` and `seed`
    """
    camera.ortho_scale = width_m
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = picture_size
    arguments = [word for name, value in parameters.items() for word in (f"--{name}", str(value))]
    skin_script.finish(skin_script.parse_options(["--", "--render", str(path), *arguments]))
    picture = bpy.data.images.load(str(path))
    pixels = np.empty(picture_size[0] * picture_size[1] * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    return pixels.reshape(picture_size[1], picture_size[0], 4)[..., :3].mean(axis=0).tolist()


if __name__ == "__main__":
    main(Path(sys.argv[-1]))
