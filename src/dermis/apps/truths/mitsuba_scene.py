"""Mitsuba scenes with a dermis scene's head, lights and camera, and with a medium inside the skin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.lights import mitsuba_emitter
from dermis.apps.truths.mitsuba_solid import ClosedSurface, closed_skin, offset_inwards
from dermis.apps.truths.scene_description import (
    Mitsuba,
    MitsubaObject,
    SceneDict,
    check_camera,
    mitsuba_environment,
    mitsuba_rgb,
)
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.mesh.head import Head
from dermis.optics.media import Layer, Medium
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

Doubles = NDArray[np.float64]
NumericArray = NDArray[np.generic]
RUSSIAN_ROULETTE_DEPTH = 100
"""Scattering events before Russian roulette. Earlier roulette leaves few paths of high weight: red on skin2
then has nearly twice the variance in the same time, and with few samples its mean is 1 % low."""
_DIRECT_LIGHT_DEPTH = 2
_RELATIVE_INTERFACE_GAP = 0.97
"""Distance between the two surfaces of an interface, divided by the offset that Mitsuba adds to rays [-].

The offset moves the start of a ray, so that the ray does not hit the same surface again. On a head, it skips
0.01 mm of the medium. With a single surface, this makes skin with a mean free path of 1 mm up to 1 % darker.
With two surfaces, an inward ray hits the upper surface and skips the lower one, and an outward ray hits the
lower surface and skips the upper one, so that only the gap between them is skipped.
"""
_MIN_REPORTED_FOLDED_FRACTION = 1e-3  # folded fraction of a surface above which a note reports it


@dataclass(frozen=True)
class Lambertian:
    """Lambertian skin without subsurface scattering or interreflection, to be used in place of a medium.

    albedo : diffuse reflectance, linear Rec. 709 [-]
    """

    albedo: tuple[float, float, float]


def load_mitsuba() -> Mitsuba:
    """Return the module `mitsuba`, without a variant set.

    Raises DermisError when it is not installed.
    """
    return import_extra("mitsuba", "path tracing")


@contextmanager
def mitsuba_variant(mi: Mitsuba, variant_name: str) -> Iterator[None]:
    """Set a variant of Mitsuba inside a `with` block, and restore the previous variant afterwards."""
    before = mi.variant()
    mi.set_variant(variant_name)
    try:
        yield
    finally:
        if before is not None:
            mi.set_variant(before)


def check_traceable(medium: Medium | Lambertian) -> None:
    """Raise DermisError for a medium that has a refracting surface or does not have three channels.

    Paths cannot connect to a point light through a refracting surface.
    """
    if isinstance(medium, Medium) and medium.eta != 1.0:
        actual = f"its index is {medium.eta:g}"
        refuse(medium.name, "an index-matched medium, for path tracing", actual, "Trace medium.with_eta(1.0)")
    if isinstance(medium, Medium) and medium.channels != 3:
        actual = f"it has {medium.channels}"
        refuse(medium.name, "three channels, for path tracing", actual, "Give red, green and blue")


def radiance_scene(
    mi: Mitsuba, scene: Scene, medium: Medium | Lambertian, picture_size: tuple[int, int]
) -> tuple[MitsubaObject, tuple[str, ...]]:
    """Return the Mitsuba scene that renders radiance, and notes for the user on changes made to the head."""
    shapes, notes = _head_shapes(mi, scene.head, medium)
    depth_limit = {"max_depth": _DIRECT_LIGHT_DEPTH} if isinstance(medium, Lambertian) else {}
    # Spectral MIS, because sampling by the extinction of one channel makes the others noisy.
    integrator = {
        "type": "volpathmis",
        "rr_depth": RUSSIAN_ROULETTE_DEPTH,
        "hide_emitters": True,
        **depth_limit,
    }
    return mitsuba_scene(mi, scene, integrator, shapes, picture_size), notes


def mitsuba_scene(
    mi: Mitsuba, scene: Scene, integrator: SceneDict, shapes: SceneDict, picture_size: tuple[int, int]
) -> MitsubaObject:
    """Return a Mitsuba scene of given shapes, with the lights, environment and camera of a dermis scene."""
    lights = {f"light_{k}": mitsuba_emitter(mi, light, k) for k, light in enumerate(scene.lights, start=1)}
    if scene.environment is not None:
        lights["environment"] = mitsuba_environment(mi, scene.environment)
    sensor = mitsuba_sensor(mi, scene.camera, picture_size)
    return mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **shapes, **lights})


def coverage_scene(
    mi: Mitsuba, camera: Camera, picture_size: tuple[int, int], shapes: SceneDict
) -> MitsubaObject:
    """Return a Mitsuba scene whose image is the fraction of each pixel's area that is covered by skin.

    shapes : head whose skin emits radiance 1, see `emissive_skin`
    """
    sensor = mitsuba_sensor(mi, camera, picture_size, sampler="multijitter")
    integrator = {"type": "path", "max_depth": 1}
    return mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **shapes})


def mitsuba_sensor(
    mi: Mitsuba, camera: Camera, picture_size: Sequence[int], sampler: str = "independent"
) -> SceneDict:
    """Return Mitsuba's description of a camera, with a box filter over each pixel."""
    width, height = picture_size
    check_camera(camera, "Mitsuba")
    view = ([float(c) for c in v] for v in (camera.position, camera.target, camera.up))
    film = {"width": width, "height": height, "pixel_format": "rgb", "component_format": "float32"}
    return {
        "type": "perspective",
        "fov_axis": "y",
        "fov": float(2.0 * np.degrees(np.arctan(camera.half_view_tangent))),
        "to_world": mi.ScalarTransform4f().look_at(*view),
        "near_clip": 0.5,
        "far_clip": 1e7,
        "film": {"type": "hdrfilm", "rfilter": {"type": "box"}, **film},
        "sampler": {"type": sampler},
    }


def _head_shapes(mi: Mitsuba, head: Head, medium: Medium | Lambertian) -> tuple[SceneDict, tuple[str, ...]]:
    """Return the shapes of skin and opaque materials, and notes for the user on changes made to the head.

    Positions are relative to the head's centre.
    """
    opaque = {}
    for k in _materials_of_kind(head, "opaque"):
        colour = mitsuba_rgb(head.mesh.materials[k].colour)
        opaque[f"material_{k}"] = _material_mesh(mi, head, k, bsdf=_diffuse_bsdf(mi, colour))
    if isinstance(medium, Lambertian):
        diffuse = _diffuse_bsdf(mi, mitsuba_rgb(medium.albedo))
        skin_materials = _materials_of_kind(head, "skin")
        skin = {f"skin_{k}": _material_mesh(mi, head, k, bsdf=diffuse) for k in skin_materials}
        return {**skin, **opaque}, ()
    bodies, notes = layer_interfaces(mi, head, medium)
    return {**bodies, **opaque}, notes


def emissive_skin(mi: Mitsuba, head: Head) -> SceneDict:
    """Return the head's shapes with skin that emits radiance 1 and with all other materials black."""
    shapes = {}
    for k, material in enumerate(head.mesh.materials):
        attributes = {"bsdf": _diffuse_bsdf(mi, 0.0)}
        if material.kind == "skin":
            attributes["emitter"] = mi.load_dict({"type": "area", "radiance": 1.0})
        if (head.mesh.material == k).any():
            shapes[f"part_{k}"] = _material_mesh(mi, head, k, **attributes)
    return shapes


def _materials_of_kind(head: Head, material_kind: str) -> list[int]:
    kinds = [material.kind for material in head.mesh.materials]
    return [k for k in np.unique(head.mesh.material).tolist() if kinds[k] == material_kind]


def _diffuse_bsdf(mi: Mitsuba, reflectance: SceneDict | float) -> MitsubaObject:
    return mi.load_dict({"type": "diffuse", "reflectance": reflectance})


def _material_mesh(
    mi: Mitsuba, head: Head, material_index: int, **attributes: MitsubaObject
) -> MitsubaObject:
    """Return the head's triangles of one material as a Mitsuba mesh with the head's normals.

    material_index : index of the material in the head's mesh
    attributes : BSDF, emitter and media of the Mitsuba mesh
    """
    mesh = head.mesh
    used, corners = np.unique(mesh.triangles[mesh.material == material_index], return_inverse=True)
    vertices = mesh.positions[used] - np.array(head.centre_mm)
    return mesh_shape(mi, vertices, corners.reshape(-1, 3), mesh.normals[used], **attributes)


def layer_interfaces(mi: Mitsuba, head: Head, medium: Medium) -> tuple[SceneDict, tuple[str, ...]]:
    """Return closed surfaces around and between the skin's layers, and notes on changes made to the head.

    The notes are shown to the user.
    """
    skin = closed_skin(head.mesh, head.name)
    skin = replace(skin, positions=(skin.positions - np.array(head.centre_mm)).astype(np.float32))
    notes = [f"{skin.caps} openings closed, {skin.cap_area:.0f} mm2"] if skin.caps else []
    media = [mi.load_dict(homogeneous_medium(layer)) for layer in medium.layers]
    gap, sides = interface_gap_mm(mi, skin), {"exterior": None, "interior": media[0]}
    surfaces = {"upper": -gap, "lower": np.zeros(len(gap))}
    outermost = {
        f"skin_{side}": interface_mesh(mi, offset_inwards(skin, depth, head.name)[0], sides)
        for side, depth in surfaces.items()
    }
    inner, inner_notes = inner_interfaces(mi, skin, medium, media, head.name)
    return outermost | inner, (*notes, *inner_notes)


def inner_interfaces(
    mi: Mitsuba, skin_surface: ClosedSurface, medium: Medium, media: Sequence[MitsubaObject], head_name: str
) -> tuple[SceneDict, tuple[str, ...]]:
    """Return the closed surfaces below each layer of finite thickness, and notes on folded surfaces.

    skin_surface : closed skin surface relative to the head's centre
    media : Mitsuba's media of the layers of `medium`
    head_name : name of the head, for messages
    """
    gap, shapes, notes = interface_gap_mm(mi, skin_surface), {}, []
    depth = np.zeros(len(gap))
    for k, (layer, (above, below)) in enumerate(zip(medium.layers, pairwise([*media, None]), strict=True)):
        if np.isinf(layer.thickness_mm):
            break
        depth = depth + layer.thickness_mm
        for side, offset_mm in (("upper", depth), ("lower", depth + gap)):
            surface, folded = offset_inwards(skin_surface, offset_mm, head_name)
            shapes[f"below_{k}_{side}"] = interface_mesh(mi, surface, {"exterior": above, "interior": below})
        depth = depth + gap
        if folded > _MIN_REPORTED_FOLDED_FRACTION:
            notes.append(f"{folded:.1%} of the face under layer {k} is folded")
    return shapes, tuple(notes)


def interface_gap_mm(mi: Mitsuba, skin_surface: ClosedSurface) -> Doubles:
    """Return for each point the distance (p,) between the two surfaces of an interface [mm].

    Each interface between two media consists of an upper and a lower surface, which are copies of the skin.

    skin_surface : closed skin surface of p points, relative to the head's centre
    """
    return np.asarray(
        _RELATIVE_INTERFACE_GAP * (1.0 + np.abs(skin_surface.positions).max(axis=1)) * mi.math.RayEpsilon
    )


def homogeneous_medium(layer: Layer) -> SceneDict:
    """Return Mitsuba's description of a homogeneous, isotropically scattering medium."""
    extinction = layer.sigma_t_prime
    # Textures are limited to 1, so the scale is the largest extinction.
    return {
        "type": "homogeneous",
        "albedo": mitsuba_rgb(layer.alpha_prime),
        "sigma_t": mitsuba_rgb(extinction / extinction.max()),
        "scale": float(extinction.max()),
        "phase": {"type": "isotropic"},
    }


def interface_mesh(mi: Mitsuba, closed_surface: ClosedSurface, media: SceneDict) -> MitsubaObject:
    """Return a closed surface as an invisible Mitsuba mesh between two media.

    media : dictionary with the media on the two sides, "exterior" and "interior"; the value None is vacuum
    """
    non_vacuum = {side: medium for side, medium in media.items() if medium is not None}
    invisible = mi.load_dict({"type": "null"})
    return mesh_shape(
        mi, closed_surface.positions, closed_surface.triangles, None, bsdf=invisible, **non_vacuum
    )


def mesh_shape(
    mi: Mitsuba,
    vertices: NumericArray,
    triangles: NumericArray,
    normals: NumericArray | None = None,
    uv: NumericArray | None = None,
    **attributes: MitsubaObject,
) -> MitsubaObject:
    """Return triangles as a Mitsuba mesh.

    vertices : (v, 3) positions of the vertices
    triangles : (f, 3) vertex indices
    normals : (v, 3) normals of the vertices; None for flat shading
    uv : (v, 2) texture coordinates of the vertices; None if there are no textures
    attributes : BSDF, emitter and media
    """
    properties = mi.Properties()
    for name, value in attributes.items():
        properties[name] = value
    flags = {"has_vertex_normals": normals is not None, "has_vertex_texcoords": uv is not None}
    mesh = mi.Mesh("", len(vertices), len(triangles), props=properties, **flags)
    parameters = mi.traverse(mesh)
    arrays = {"vertex_positions": vertices, "vertex_normals": normals, "vertex_texcoords": uv}
    for name, values in arrays.items():
        if values is not None:
            parameters[name] = _flatten_array(values, np.float32)
    parameters["faces"] = _flatten_array(triangles, np.uint32)
    parameters.update()
    return mesh


def _flatten_array(array: NumericArray, number_type: type[np.generic]) -> NumericArray:
    return np.ascontiguousarray(array, dtype=number_type).ravel()
