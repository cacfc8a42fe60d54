"""Blender scene written by dermis: a head or a ball with a skin material, lights and a camera, in metres.

    blender --python THIS_FILE                   # or open it in the text editor and run it
    blender -b --python THIS_FILE -- --render picture.png --samples 64 --save scene.blend

A Python with the module bpy can run it too: python THIS_FILE -- --render picture.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import bpy  # type: ignore[import-not-found,unused-ignore]
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found,unused-ignore]

from dermis.apps.truths.cycles_script import add_light, add_object, set_camera, set_world

EXPORT: dict[str, Any] = {}


def main(arguments: list[str]) -> None:
    """Build the scene of this export, then save and render the scene as the arguments request."""
    options = parse_options(arguments)
    check_version()
    if bpy.app.background:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    else:
        bpy.ops.scene.new(type="EMPTY")
    set_units(bpy.context.scene)
    place_head()
    for light in EXPORT["lights"]:
        add_light(light)
    panorama = EXPORT["world"].get("panorama")
    set_world(EXPORT["world"], panorama and np.load(find_data_folder() / panorama, allow_pickle=False))
    set_camera(EXPORT["camera"])
    set_render_settings(bpy.context.scene)
    save_and_render(options)


def parse_options(arguments: list[str]) -> argparse.Namespace:
    """Return the options after -- on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--render", type=Path, help="picture to render: .png or .exr")
    parser.add_argument("--samples", type=int, default=128, help="samples per pixel")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random numbers")
    parser.add_argument("--save", type=Path, help="Blender file to save, with all data packed into it")
    return parser.parse_args(arguments[arguments.index("--") + 1 :] if "--" in arguments else [])


def check_version() -> None:
    """Exit with an error if the parameters are not valid in the running version of Blender."""
    (first, end), version = EXPORT["versions"], bpy.app.version[:2]
    if version < tuple(first) or (end is not None and version >= tuple(end)):
        until = "" if end is None else f" and before {end[0]}.{end[1]}"
        major, minor = version
        raise SystemExit(
            f"this file: expected Blender from {first[0]}.{first[1]}{until}, but {major}.{minor} runs it. "
            f"Export it again with --version {major}.{minor}: the radius has another meaning there."
        )


def find_data_folder() -> Path:
    """Return the folder that contains the files of the head and the panorama."""
    texts = [Path(bpy.path.abspath(text.filepath)) for text in bpy.data.texts if text.filepath]
    folders = [Path(__file__).resolve().parent, *(file.parent for file in texts)]
    name = EXPORT["head"] or EXPORT["world"].get("panorama")
    return next((folder for folder in folders if name and (folder / name).is_file()), folders[0])


def set_units(scene: Any) -> None:
    """Name the scene, and set the unit of length of the scene to metres."""
    scene.name = EXPORT["name"]
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = 1.0


def place_head() -> None:
    """Import the exported head and set the head's skin material; if no head was exported, add a ball."""
    if EXPORT["head"] is None:
        add_ball(EXPORT["ball_m"])
        return
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(find_data_folder() / EXPORT["head"]))
    meshes = [added for added in bpy.data.objects if added not in before and added.type == "MESH"]
    slots = [slot for mesh in meshes if mesh.users_scene for slot in mesh.material_slots]
    for material in {slot.material for slot in slots if is_skin_name(slot.material.name)}:
        set_skin_inputs(next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED"))
    if EXPORT["hair"] is not None:
        armatures = [added for added in bpy.data.objects if added not in before and added.type == "ARMATURE"]
        add_hair(EXPORT["hair"], armatures)


def add_hair(description: dict[str, Any], armatures: list[Any]) -> None:
    """Add scalp hair as hair curves, which follow a bone.

    description : name of the file of hair, and of the bone
    armatures : imported armatures, one or none
    """
    with np.load(find_data_folder() / description["file"], allow_pickle=False) as stored:
        arrays = dict(stored)
    points = arrays["points_m"]
    hair = bpy.data.hair_curves.new("hair")
    hair.add_curves([points.shape[1]] * len(points))
    hair.points.foreach_set("position", points.ravel())
    hair.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", arrays["radius_m"].ravel())
    for name in ("absorption", "colour"):
        attribute = hair.attributes.new(name, "FLOAT_VECTOR", "CURVE")
        attribute.data.foreach_set("vector", arrays[name].ravel())
    hair.materials.append(make_hair_material(description))
    curves = add_object("hair", hair)
    if armatures and description["bone"]:
        curves.parent, curves.parent_type = armatures[0], "BONE"
        curves.parent_bone = description["bone"]
        bpy.context.view_layer.update()
        curves.matrix_world = Matrix()


def make_hair_material(description: dict[str, Any]) -> Any:
    """Return a material of hair, whose absorption or colour is an attribute of the curves.

    Cycles uses the absorption coefficient times the radius in the Principled Hair BSDF of [Chiang2016]; EEVEE
    uses the colour in a Principled BSDF.

    description : roughness along and around the hairs, and their index of refraction
    """
    material = bpy.data.materials.new("hair")
    material.use_nodes = True
    tree, is_eevee = material.node_tree, EXPORT["method"] == "EEVEE"
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "colour" if is_eevee else "absorption"
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    if not is_eevee:
        tree.nodes.remove(shader)
        shader = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
        shader.model, shader.parametrization = "CHIANG", "ABSORPTION"
        along, around = description["roughness"]
        values = {"Roughness": along, "Radial Roughness": around, "IOR": description["ior"]}
        for name, value in values.items():
            shader.inputs[name].default_value = value
    target = shader.inputs["Base Color" if is_eevee else "Absorption Coefficient"]
    tree.links.new(attribute.outputs["Vector"], target)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def is_skin_name(material_name: str) -> bool:
    """Return whether an imported material is skin; Blender appends a number such as .001 to a used name."""
    return material_name in EXPORT["skin_materials"] or material_name[:-4] in EXPORT["skin_materials"]


def add_ball(diameter_m: float) -> None:
    """Add a ball with the skin material.

    diameter_m : diameter of the ball [m]
    """
    import bmesh  # type: ignore[import-not-found,unused-ignore]  # exists after bpy is imported

    mesh, shape = bpy.data.meshes.new("ball"), bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=192, v_segments=96, radius=0.5 * diameter_m)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    mesh.materials.append(make_skin_material())
    add_object("ball", mesh)


def make_skin_material() -> Any:
    """Return a new skin material of uniform colour, for the ball that is shown if no head was exported."""
    material = bpy.data.materials.new("skin")
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*EXPORT["colour"], 1.0)
    shader.inputs["Roughness"].default_value = EXPORT["roughness"]
    set_skin_inputs(shader)
    return material


def set_skin_inputs(bsdf_node: Any) -> None:
    """Set the exported inputs of a Principled BSDF node, and convert the roughness from Beckmann to GGX.

    If a roughness map is connected, the map is multiplied by the conversion factor.

    bsdf_node : Principled BSDF node
    """
    if EXPORT["method"] != "EEVEE":
        bsdf_node.subsurface_method = EXPORT["method"]
    for name, value in EXPORT["inputs"].items():
        bsdf_node.inputs[name].default_value = value
    roughness = bsdf_node.inputs["Roughness"]
    roughness.default_value *= EXPORT["smoother"]
    if roughness.links:
        tree = bsdf_node.id_data
        factor = tree.nodes.new("ShaderNodeMath")
        factor.operation, factor.inputs[1].default_value = "MULTIPLY", EXPORT["smoother"]
        tree.links.new(roughness.links[0].from_socket, factor.inputs[0])
        tree.links.new(factor.outputs[0], roughness)


def set_render_settings(scene: Any) -> None:
    """Set the render engine, the resolution and the colour management of the scene."""
    known = {item.identifier for item in scene.render.bl_rna.properties["engine"].enum_items}
    eevee = "BLENDER_EEVEE_NEXT" if "BLENDER_EEVEE_NEXT" in known else "BLENDER_EEVEE"
    scene.render.engine = eevee if EXPORT["method"] == "EEVEE" else "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = EXPORT["size"]
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"


def save_and_render(options: argparse.Namespace) -> None:
    """Save and render the scene as the options request."""
    scene = bpy.context.scene
    if scene.render.engine == "CYCLES":
        cycles = scene.cycles
        cycles.samples, cycles.seed, cycles.use_adaptive_sampling = options.samples, options.seed, False
        cycles.pixel_filter_type = "BOX"
        # The defaults reduce noise at the cost of a biased, darker picture.
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
        cycles.use_denoising = False
    if options.save is not None:
        bpy.ops.file.pack_all()
        bpy.ops.wm.save_as_mainfile(filepath=str(options.save.resolve()), compress=True)
    if options.render is not None:
        linear = options.render.suffix.lower() == ".exr"
        scene.render.image_settings.file_format = "OPEN_EXR" if linear else "PNG"
        scene.render.image_settings.color_mode = "RGBA"
        scene.render.image_settings.color_depth = "32" if linear else "8"
        scene.render.filepath = str(options.render.resolve())
        bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main(sys.argv)
