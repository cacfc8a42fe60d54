"""Small scenes for the tests of the frame, and helpers that run a part of a frame.

Positions are in the coordinates of the mesh; scenes need them relative to the centre of the head.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.atlas.atlas import Atlas
from dermis.frame.features.atlas.passes import draw_coarser_stretch_maps
from dermis.frame.features.atlas.textures import AtlasTextures, upload_atlas
from dermis.frame.frame import draw_frame
from dermis.frame.inputs import FrameInputs
from dermis.frame.programs import shader_folders
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, ComputeProgram, Constants, Device, download, make_texture, upload
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane
from dermis.scene.camera import Camera
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES

Floats = NDArray[np.float64]
AnyLight = PointLight | SpotLight | DirectionalLight


def entered_light(renderer: Renderer, inputs: FrameInputs) -> NDArray[np.float64]:
    """Return (n, n, 4) light that entered the skin, with 1 as alpha on the surface; half floats on GPUs."""
    made = download(renderer.device, inputs.resources.diffusion.levels.stacks[0]).astype(float)
    return made / [*(3 * [inputs.blurs[0].scale]), 1.0]


def head_of(mesh: Mesh, **maps: Any) -> Head:
    """Return a head of a mesh with the given maps."""
    return Head("test", mesh, Maps(**{role: np.asarray(m, np.float32) for role, m in maps.items()}))


def place(head: Head, point: ArrayLike) -> Any:
    """Return a point of the mesh relative to the centre of the head."""
    return tuple(float(c) for c in np.asarray(point, float) - head.centre_mm)


def front_camera(head: Head, centre: ArrayLike = (0, 0, 0), frame_mm: float = 80.0) -> Camera:
    """Return a camera 300 mm before `centre` that looks along -Z."""
    eye = np.add(centre, (0, 0, 300.0))
    return Camera(position=place(head, eye), target=place(head, centre), frame_mm=frame_mm)


def scene_of(head: Head, *lights: AnyLight, camera: Camera | None = None, **skin: Any) -> Scene:
    """Return a scene with Lambertian skin, unless `skin` has a direction: its exitance has a closed form."""
    chosen = Skin(**{"direction": "lambertian", **skin})
    return Scene(head, lights=lights, camera=camera or front_camera(head), skin=chosen)


def frontal(irradiance: float = 3.0, *, shadows: bool = False) -> DirectionalLight:
    """Return light along -Z."""
    return DirectionalLight(direction=(0, 0, -1), irradiance=(irradiance,) * 3, shadows=shadows)


def settings_of(**given: Any) -> Settings:
    """Return settings with small sizes, and an atlas with the layout of the mesh, unless given otherwise."""
    small = {"size": (48, 48), "atlas": 64, "samples": 1, "shadow_size": 64, "seams": "alpha"}
    return Settings(**(small | given))


def resting(device: Device, atlas: Atlas, stretch: str = "full", **more: Any) -> AtlasTextures:
    """Return the textures of an atlas with the stretch of its arrays.

    more : further fields of the textures
    """
    made = replace(upload_atlas(device, atlas, stretch), **more)
    metric = np.dstack([atlas.stretch, atlas.shear * (stretch == "full"), np.zeros_like(atlas.shear)])
    upload(device, made.resources["stretch_map"], metric)
    frame = CommandList(device)
    draw_coarser_stretch_maps(frame, made)
    frame.submit()
    return made


def run_frame(renderer: Renderer, scene: Scene, **given: Any) -> FrameInputs:
    """Render a frame, and return its inputs, from which results of passes can be downloaded."""
    inputs, graph = renderer.prepare(scene, settings_of(**given)), renderer.graph
    graph.begin()
    draw_frame(graph, inputs, TECHNIQUES[inputs.settings.technique])
    graph.submit()
    return inputs


def probe(
    device: Device,
    name: str,
    size: tuple[int, int],
    outputs: Sequence[str],
    constants: Constants = (),
    **bound: Any,
) -> Any:
    """Run a test shader of this folder and download its outputs.

    constants : names and values of the shader's `override`s

    Keyword arguments are bindings; a dict gives the members of the shader's struct of that name.
    """
    path = Path(__file__).parent / f"{name}.wgsl"
    program = ComputeProgram(device, path, shader_folders(), dict(constants))
    made = {output: make_texture(device, size, "rgba32float") for output in outputs}
    records = {
        key: program.make_record(key.title(), **v) if isinstance(v, dict) else v for key, v in bound.items()
    }
    frame = CommandList(device)
    frame.compute(name, program, {**made, **records}, size)
    frame.submit()
    return [download(device, texture).astype(np.float64) for texture in made.values()]


def bent_plane(size_mm: float, uv: Sequence[Sequence[float]], segments: int = 1) -> Mesh:
    """Return a plane whose uv is mapped by the (2, 3) affine matrix `uv`."""
    flat = plane(size_mm, segments)
    matrix = np.asarray(uv, float)
    return build_mesh(
        flat.positions,
        flat.uv @ matrix[:, :2].T + matrix[:, 2],
        flat.triangles,
        flat.material,
        SKIN_MATERIALS,
    )


def joined(*parts: tuple[Mesh, ArrayLike, tuple[float, float, float]], kinds: Sequence[str] = ()) -> Mesh:
    """Join meshes into one: each is moved [mm], and its uv is mapped to the square (left, top, side).

    kinds : material kind of each part, skin by default
    """
    first = np.cumsum([0, *(len(mesh.positions) for mesh, _, _ in parts[:-1])])
    kind = list(kinds) or ["skin"] * len(parts)
    return build_mesh(
        np.vstack([mesh.positions + np.asarray(move, np.float32) for mesh, move, _ in parts]),
        np.vstack([[left, top] + side * mesh.uv for mesh, _, (left, top, side) in parts]),
        np.vstack([mesh.triangles + k for (mesh, _, _), k in zip(parts, first, strict=True)]),
        np.repeat(np.arange(len(parts)), [len(mesh.triangles) for mesh, _, _ in parts]),
        tuple(Material(f"part {k}", one, (0.5, 0.25, 0.125)) for k, one in enumerate(kind)),
        np.vstack([mesh.normals for mesh, _, _ in parts]),
    )
