"""Script that renders a scene with Cycles; Blender's Python runs it as cycles_script.py FOLDER.

FOLDER contains scene.json and arrays.npz, written by the module `cycles`. The script adds pass_K.exr
(radiance and coverage) for each pass K, and finally done.json (Blender's version, times of the passes). It
does not import dermis, which Blender's Python does not have.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import bpy  # type: ignore[import-not-found,unused-ignore]
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found,unused-ignore]


def main(folder: Path) -> None:
    """Render the scene described in a folder and write the passes into that folder."""
    description = json.loads((folder / "scene.json").read_text(encoding="utf-8"))
    with np.load(folder / "arrays.npz") as stored:
        arrays = dict(stored)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    maps = {name: arrays[name] for name in ("normal_map", "colour_map") if name in arrays}
    materials = [make_material(one, maps) for one in description["materials"]]
    add_mesh(arrays, materials)
    for light in description["lights"]:
        add_light(light)
    set_world(description["world"], arrays.get("panorama"))
    set_camera(description["camera"])
    set_render_options(description)
    times = [render_pass(folder / f"pass_{k}.exr", **one) for k, one in enumerate(description["passes"])]
    done = {"version": bpy.app.version_string, "times": times}
    (folder / "done.json").write_text(json.dumps(done), encoding="utf-8")


def add_mesh(arrays: dict[str, Any], materials: list[Any]) -> None:
    """Add the head's mesh with its materials, normals and texture coordinates to the scene."""
    positions, corners = arrays["positions"], arrays["triangles"]
    mesh = bpy.data.meshes.new("head")
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", positions.ravel())
    mesh.loops.add(corners.size)
    mesh.loops.foreach_set("vertex_index", corners.ravel())
    mesh.polygons.add(len(corners))
    mesh.polygons.foreach_set("loop_start", np.arange(0, corners.size, 3, dtype=np.int32))
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", arrays["material"])
    if "uv" in arrays:
        uv = arrays["uv"][corners.ravel()] * [1, -1] + [0, 1]  # Blender's first row is the lowest
        mesh.uv_layers.new(name="uv").uv.foreach_set("vector", uv.astype(np.float32).ravel())
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    mesh.normals_split_custom_set_from_vertices(arrays["normals"].tolist())
    add_object("head", mesh)


def make_material(material_description: dict[str, Any], maps: dict[str, Any]) -> Any:
    """Return a new Blender material with the shader and the parameters of a description.

    material_description : shader and parameters of the material
    maps : dictionary from name to image array
    """
    material = bpy.data.materials.new(material_description["name"])
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    if material_description["method"] == "BECKMANN":
        shader = nodes.new("ShaderNodeBsdfGlass")  # transmitted light is lost, as there is one bounce
        shader.distribution = "BECKMANN"
        shader.inputs["Roughness"].default_value = material_description["roughness"]
        shader.inputs["IOR"].default_value = material_description["ior"]
        connect_normal_map(nodes, links, maps, shader)
    elif material_description["method"] == "PRINCIPLED":
        shader = principled_shader(nodes, links, maps, material_description)
        connect_normal_map(nodes, links, maps, shader)
    elif material_description["method"] == "DIFFUSE":
        shader = nodes.new("ShaderNodeBsdfDiffuse")
    else:
        shader = nodes.new("ShaderNodeSubsurfaceScattering")
        shader.falloff = material_description["method"]
        shader.inputs["Scale"].default_value = 1.0
        shader.inputs["Radius"].default_value = material_description["radius"]
        if "Roughness" in shader.inputs:
            shader.inputs["Roughness"].default_value = 1.0
    if "Color" in shader.inputs:
        shader.inputs["Color"].default_value = (*material_description.get("colour", (1.0, 1.0, 1.0)), 1.0)
    links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def principled_shader(
    nodes: Any, links: Any, maps: dict[str, Any], material_description: dict[str, Any]
) -> Any:
    """Return a new Principled BSDF node with random-walk subsurface scattering and a colour map.

    nodes, links : collections of nodes and links of the material's node tree
    maps : dictionary from name to image array
    material_description : parameters of the material
    """
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    shader.distribution = "GGX"
    shader.subsurface_method = "RANDOM_WALK"
    numbers = {"Subsurface Weight": 1.0, "Subsurface Scale": 1.0, "Specular IOR Level": 0.5}
    numbers |= {"IOR": material_description["ior"], "Roughness": material_description["roughness"]}
    for name, value in numbers.items():
        shader.inputs[name].default_value = value
    shader.inputs["Subsurface Radius"].default_value = material_description["radius"]
    texture, node = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeUVMap")
    node.uv_map = "uv"
    links.new(node.outputs["UV"], texture.inputs["Vector"])
    texture.image = pack_image("colours", maps["colour_map"])
    links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return shader


def connect_normal_map(nodes: Any, links: Any, maps: dict[str, Any], shader: Any) -> None:
    """Connect the normal map, if there is one, to a shader node.

    nodes, links : collections of nodes and links of the material's node tree
    maps : dictionary from name to image array
    """
    if "normal_map" not in maps:
        return
    texture, node = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeNormalMap")
    texture.image = pack_image("normals", maps["normal_map"])
    links.new(texture.outputs["Color"], node.inputs["Color"])
    node.uv_map = "uv"
    links.new(node.outputs["Normal"], shader.inputs["Normal"])


def pack_image(image_name: str, texel_rows: Any) -> Any:
    """Return a Blender image that contains an array of linear colours.

    texel_rows : (h, w, 3) colours, top row first
    """
    height, width, _ = texel_rows.shape
    image = bpy.data.images.new(image_name, width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.concatenate((texel_rows, np.ones((height, width, 1))), axis=2)[::-1]
    image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).ravel())
    image.pack()
    return image


def add_light(light_description: dict[str, Any]) -> None:
    """Add a light to the scene.

    light_description : kind and parameters of the light
    """
    light = bpy.data.lights.new("light", light_description["type"])
    for name, value in light_description["set"].items():
        setattr(light, name, value)
    if "stripe" in light_description:
        turn_into_stripe_light(light, light_description["stripe"])
    add_object("light", light).matrix_world = Matrix(light_description["to_world"])


def turn_into_stripe_light(light: Any, stripe: dict[str, Any]) -> None:
    """Turn a distant point light into a stripe light by shader nodes.

    The irradiance is then Gaussian across the stripe and, up to its ends, constant along the stripe.

    light : Blender light
    stripe : direction from the scene to the light ("forward"), distance of the light ("distance"), and
        directions "across" and "along", divided by half the width and by half the length of the stripe
    """
    light.use_nodes = True
    nodes, links = light.node_tree.nodes, light.node_tree.links

    def math_node(operation: str, *inputs: Any) -> Any:
        node = nodes.new("ShaderNodeMath")
        node.operation = operation
        return set_inputs(links, node, inputs)

    def incoming_dot_product(unit_vector: list[float]) -> Any:
        node = nodes.new("ShaderNodeVectorMath")
        node.operation = "DOT_PRODUCT"
        node.inputs[1].default_value = unit_vector
        links.new(nodes.new("ShaderNodeNewGeometry").outputs["Incoming"], node.inputs[0])
        return node.outputs["Value"]

    depth = incoming_dot_product(stripe["forward"])
    across = math_node(
        "MULTIPLY", math_node("DIVIDE", incoming_dot_product(stripe["across"]), depth), stripe["distance"]
    )
    along = math_node(
        "MULTIPLY", math_node("DIVIDE", incoming_dot_product(stripe["along"]), depth), stripe["distance"]
    )
    gaussian = math_node("EXPONENT", math_node("MULTIPLY", math_node("MULTIPLY", across, across), -2.0))
    fade = nodes.new("ShaderNodeMapRange")
    fade.interpolation_type = "SMOOTHSTEP"
    for name, value in zip(("From Min", "From Max", "To Min", "To Max"), (0.95, 1.0, 1.0, 0.0), strict=True):
        fade.inputs[name].default_value = value
    links.new(math_node("ABSOLUTE", along), fade.inputs["Value"])
    emission = next(node for node in nodes if node.type == "EMISSION")
    links.new(math_node("MULTIPLY", gaussian, fade.outputs["Result"]), emission.inputs["Strength"])


def set_inputs(links: Any, node: Any, inputs: Any) -> Any:
    """Set or connect the inputs of a shader node, and return the node's first output.

    inputs : for each input, a number, or the output of another node
    """
    for socket, value in zip(node.inputs, inputs, strict=False):
        if isinstance(value, float):
            socket.default_value = value
        else:
            links.new(value, socket)
    return node.outputs[0]


def set_world(world_description: dict[str, Any], panorama: Any) -> None:
    """Set the world to a uniform environment, or to a panorama with its rotation."""
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(node for node in nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = world_description["strength"]
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    if panorama is None:
        return
    texture, mapping = nodes.new("ShaderNodeTexEnvironment"), nodes.new("ShaderNodeMapping")
    texture.image = pack_image("panorama", panorama)
    mapping.inputs["Rotation"].default_value = Matrix(world_description["turn"]).to_euler()
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], background.inputs["Color"])


def set_camera(camera_description: dict[str, Any]) -> None:
    """Add the camera, and make this camera the active camera of the scene."""
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.sensor_height = 24.0
    camera.lens = 12.0 / camera_description["half_tangent"]
    camera.clip_start, camera.clip_end = 1e-3, 1e5
    camera_object = add_object("camera", camera)
    camera_object.matrix_world = Matrix(camera_description["to_world"])
    bpy.context.scene.camera = camera_object


def set_render_options(scene_description: dict[str, Any]) -> None:
    """Set the resolution, the file format and the settings of Cycles."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = scene_description["size"]
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.image_settings.color_depth = "32"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    # The defaults give less noise but a biased, darker image.
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
    if scene_description["direct"]:
        cycles.max_bounces = 0


def render_pass(path: Path, samples: int, seed: int) -> tuple[float, float]:
    """Render a pass to a file; return the elapsed time, and the CPU time summed over all cores [s]."""
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.seed = samples, seed
    bpy.context.scene.render.filepath = str(path)
    began, worked = time.perf_counter(), time.process_time()
    bpy.ops.render.render(write_still=True)
    return time.perf_counter() - began, time.process_time() - worked


def add_object(object_name: str, data_block: Any) -> Any:
    """Add an object with the given data block to the scene and return it."""
    result = bpy.data.objects.new(object_name, data_block)
    bpy.context.collection.objects.link(result)
    return result


if __name__ == "__main__":
    main(Path(sys.argv[-1]))
