"""Skin in Blender, written by dermis: a head or a ball of it with its material, lights and camera, in metres.

    blender --python THIS_FILE                   # or open it in the text editor and run it
    blender -b --python THIS_FILE -- --render picture.png --samples 64 --save scene.blend

A Python with the module bpy takes it too: python THIS_FILE -- --render picture.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import bpy  # type: ignore[import-not-found,unused-ignore]
import numpy as np

from dermis.apps.truths.cycles_script import add_light, add_object, set_camera, set_world

DESCRIBED: dict[str, Any] = {}


def main(words: list[str]) -> None:
    asked = options(words)
    check_version()
    if bpy.app.background:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    else:
        bpy.ops.scene.new(type="EMPTY")
    set_units(bpy.context.scene)
    place_head()
    for light in DESCRIBED["lights"]:
        add_light(light)
    panorama = DESCRIBED["world"].get("panorama")
    set_world(DESCRIBED["world"], panorama and np.load(folder() / panorama, allow_pickle=False))
    set_camera(DESCRIBED["camera"])
    set_render(bpy.context.scene)
    finish(asked)


def options(words: list[str]) -> argparse.Namespace:
    """What stands after -- in the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--render", type=Path, help="picture to render: .png or .exr")
    parser.add_argument("--samples", type=int, default=128, help="paths through each pixel")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    parser.add_argument("--save", type=Path, help="Blender file to save, with all it needs packed into it")
    return parser.parse_args(words[words.index("--") + 1 :] if "--" in words else [])


def check_version() -> None:
    """Refuse a Blender in which the numbers mean something else."""
    (least, below), now = DESCRIBED["versions"], bpy.app.version[:2]
    if now < tuple(least) or (below is not None and now >= tuple(below)):
        until = "" if below is None else f" and before {below[0]}.{below[1]}"
        raise SystemExit(
            f"this file: expected Blender from {least[0]}.{least[1]}{until}, but {now[0]}.{now[1]} runs it. "
            f"Export it again with --version {now[0]}.{now[1]}: the radius means something else there."
        )


def folder() -> Path:
    """Where the files beside this one are; the text editor runs a copy without a place."""
    opened = [Path(bpy.path.abspath(text.filepath)) for text in bpy.data.texts if text.filepath]
    places = [Path(__file__).resolve().parent, *(file.parent for file in opened)]
    wanted = DESCRIBED["head"] or DESCRIBED["world"].get("panorama")
    return next((place for place in places if wanted and (place / wanted).is_file()), places[0])


def set_units(scene: Any) -> None:
    scene.name = DESCRIBED["name"]
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = 1.0


def place_head() -> None:
    """The head of the file beside this one, its skin with the numbers above, or a ball."""
    if DESCRIBED["head"] is None:
        add_ball(DESCRIBED["ball_m"])
        return
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(folder() / DESCRIBED["head"]))
    added = [one for one in bpy.data.objects if one not in before and one.type == "MESH"]
    head = max((one for one in added if one.users_scene), key=lambda one: len(one.data.vertices))
    for slot in DESCRIBED["skin_slots"]:
        material = head.material_slots[slot].material
        set_skin(next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED"))


def add_ball(diameter: float) -> None:
    import bmesh  # type: ignore[import-not-found,unused-ignore]  # which is there once bpy is

    mesh, shape = bpy.data.meshes.new("ball"), bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=192, v_segments=96, radius=0.5 * diameter)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    mesh.materials.append(make_skin())
    add_object("ball", mesh)


def make_skin() -> Any:
    """Skin of one colour."""
    material = bpy.data.materials.new("skin")
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*DESCRIBED["colour"], 1.0)
    shader.inputs["Roughness"].default_value = DESCRIBED["roughness"]
    set_skin(shader)
    return material


def set_skin(shader: Any) -> None:
    """Subsurface scattering and the surface's strength; maps stay, the roughness for Blender's facets."""
    if DESCRIBED["method"] != "EEVEE":
        shader.subsurface_method = DESCRIBED["method"]
    for name, value in DESCRIBED["inputs"].items():
        shader.inputs[name].default_value = value
    rough = shader.inputs["Roughness"]
    rough.default_value *= DESCRIBED["smoother"]
    if rough.links:
        tree = shader.id_data
        factor = tree.nodes.new("ShaderNodeMath")
        factor.operation, factor.inputs[1].default_value = "MULTIPLY", DESCRIBED["smoother"]
        tree.links.new(rough.links[0].from_socket, factor.inputs[0])
        tree.links.new(factor.outputs[0], rough)


def set_render(scene: Any) -> None:
    known = {item.identifier for item in scene.render.bl_rna.properties["engine"].enum_items}
    eevee = "BLENDER_EEVEE_NEXT" if "BLENDER_EEVEE_NEXT" in known else "BLENDER_EEVEE"
    scene.render.engine = eevee if DESCRIBED["method"] == "EEVEE" else "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = DESCRIBED["size"]
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"


def finish(asked: argparse.Namespace) -> None:
    """Save and render what was asked for."""
    scene = bpy.context.scene
    if scene.render.engine == "CYCLES":
        cycles = scene.cycles
        cycles.samples, cycles.seed, cycles.use_adaptive_sampling = asked.samples, asked.seed, False
        cycles.pixel_filter_type = "BOX"
        # Its defaults trade a biased, darker picture for less noise.
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
        cycles.use_denoising = False
    if asked.save is not None:
        bpy.ops.file.pack_all()
        bpy.ops.wm.save_as_mainfile(filepath=str(asked.save.resolve()))
    if asked.render is not None:
        linear = asked.render.suffix.lower() == ".exr"
        scene.render.image_settings.file_format = "OPEN_EXR" if linear else "PNG"
        scene.render.image_settings.color_mode = "RGBA"
        scene.render.image_settings.color_depth = "32" if linear else "8"
        scene.render.filepath = str(asked.render.resolve())
        bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main(sys.argv)
