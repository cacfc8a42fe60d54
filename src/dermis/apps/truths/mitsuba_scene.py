"""A scene as Mitsuba has it: the same head, lights, camera and pixels, with a medium inside the skin."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.scene_description import SceneDict, Mitsuba, MitsubaObject, check_camera, rgb, mitsuba_environment
from dermis.apps.truths.lights import mitsuba_emitter
from dermis.apps.truths.mitsuba_solid import ClosedSurface, offset_inwards, closed_skin
from dermis.base.errors import refuse
from dermis.base.extras import needed
from dermis.mesh.head import Head
from dermis.optics.media import Layer, Medium
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

Doubles = NDArray[np.float64]
Numbers = NDArray[np.generic]
ROULETTE_DEPTH = 100
"""Scatterings before Russian roulette. Earlier, it leaves few paths that carry much: red on skin2 then has
nearly twice the variance in the same time, and with few samples its mean is 1 % low."""
_DIRECT_DEPTH = 2
_GAP_STEPS = 0.97
"""Distance between the two surfaces that stand for a face, over the step by which Mitsuba moves a ray past a
surface so as not to hit it again. That step skips 0.01 mm of medium on a head, which makes skin with a mean
free path of 1 mm up to 1 % darker. With two surfaces a ray inwards passes the upper one and steps over the
lower one, a ray outwards passes the lower one and steps over the upper one: only the gap is skipped."""
_REPORTED_FOLD = 1e-3


@dataclass(frozen=True)
class Lambertian:
    """Skin without depth, lit by the lights alone and not by itself: what a render without scattering shows.

    albedo : linear Rec. 709 [-]
    """

    albedo: tuple[float, float, float]


def load_mitsuba() -> Mitsuba:
    """Return the module `mitsuba` with no variant set.

    Raises DermisError when it is not installed.
    """
    return needed("mitsuba", "path tracing")


@contextmanager
def mitsuba_variant(mi: Mitsuba, name: str) -> Iterator[None]:
    """Set a variant of Mitsuba; afterwards the caller's own is set again, if there was one."""
    before = mi.variant()
    mi.set_variant(name)
    try:
        yield
    finally:
        if before is not None:
            mi.set_variant(before)


def check_traceable(medium: Medium | Lambertian) -> None:
    """Raises DermisError for a refracting surface, through which no ray to a point light finds its way."""
    if isinstance(medium, Medium) and medium.eta != 1.0:
        came = f"its index is {medium.eta:g}"
        refuse(medium.name, "an index-matched medium, for path tracing", came, "Trace medium.with_eta(1.0)")
    if isinstance(medium, Medium) and medium.channels != 3:
        came = f"it has {medium.channels}"
        refuse(medium.name, "three channels, for path tracing", came, "Give red, green and blue")


def radiance_scene(
    mi: Mitsuba, scene: Scene, medium: Medium | Lambertian, size: tuple[int, int]
) -> tuple[MitsubaObject, tuple[str, ...]]:
    """Return Mitsuba's scene whose image is the radiance, and notes on changes to the head."""
    shapes, notes = _head_shapes(mi, scene.head, medium)
    direct = {"max_depth": _DIRECT_DEPTH} if isinstance(medium, Lambertian) else {}
    # Spectral MIS: extinction differs between channels, and sampling one of them makes the others noisy.
    integrator = {"type": "volpathmis", "rr_depth": ROULETTE_DEPTH, "hide_emitters": True, **direct}
    return mitsuba_scene(mi, scene, integrator, shapes, size), notes


def mitsuba_scene(
    mi: Mitsuba, scene: Scene, integrator: SceneDict, shapes: SceneDict, size: tuple[int, int]
) -> MitsubaObject:
    """Return Mitsuba's scene of some shapes, in the lights and surroundings of ours and before its camera."""
    lights = {f"light_{k}": mitsuba_emitter(mi, light, k) for k, light in enumerate(scene.lights, start=1)}
    if scene.environment is not None:
        lights["environment"] = mitsuba_environment(mi, scene.environment)
    sensor = mitsuba_sensor(mi, scene.camera, size)
    return mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **shapes, **lights})


def coverage_scene(mi: Mitsuba, camera: Camera, size: tuple[int, int], shapes: SceneDict) -> MitsubaObject:
    """Return Mitsuba's scene whose image is the share of each pixel that shapes of radiance 1 fill."""
    sensor = mitsuba_sensor(mi, camera, size, sampler="multijitter")
    return mi.load_dict(
        {"type": "scene", "integrator": {"type": "path", "max_depth": 1}, "sensor": sensor, **shapes}
    )


def mitsuba_sensor(mi: Mitsuba, camera: Camera, size: tuple[int, int], sampler: str = "independent") -> SceneDict:
    """Return Mitsuba's description of a camera whose pixels are even squares."""
    width, height = size
    check_camera(camera, "Mitsuba")
    view = ([float(c) for c in v] for v in (camera.position, camera.target, camera.up))
    film = {"width": width, "height": height, "pixel_format": "rgb", "component_format": "float32"}
    return {
        "type": "perspective",
        "fov_axis": "y",
        "fov": float(2.0 * np.degrees(np.arctan(camera.half_tangent))),
        "to_world": mi.ScalarTransform4f().look_at(*view),
        "near_clip": 0.5,
        "far_clip": 1e7,
        "film": {"type": "hdrfilm", "rfilter": {"type": "box"}, **film},
        "sampler": {"type": sampler},
    }


def _head_shapes(mi: Mitsuba, head: Head, medium: Medium | Lambertian) -> tuple[SceneDict, tuple[str, ...]]:
    """Return skin and opaque materials of a head, about its centre, by name, and notes on them."""
    opaque = {}
    for k in _materials_of_kind(head, "opaque"):
        colour = rgb(head.mesh.materials[k].colour)
        opaque[f"material_{k}"] = _material_mesh(mi, head, k, bsdf=_diffuse_bsdf(mi, colour))
    if isinstance(medium, Lambertian):
        diffuse = _diffuse_bsdf(mi, rgb(medium.albedo))
        skin = {f"skin_{k}": _material_mesh(mi, head, k, bsdf=diffuse) for k in _materials_of_kind(head, "skin")}
        return {**skin, **opaque}, ()
    bodies, notes = _layer_interfaces(mi, head, medium)
    return {**bodies, **opaque}, notes


def emissive_skin(mi: Mitsuba, head: Head) -> SceneDict:
    """Return the head with skin that shines with radiance 1 and everything else black."""
    shapes = {}
    for k, material in enumerate(head.mesh.materials):
        given = {"bsdf": _diffuse_bsdf(mi, 0.0)}
        if material.kind == "skin":
            given["emitter"] = mi.load_dict({"type": "area", "radiance": 1.0})
        if (head.mesh.material == k).any():
            shapes[f"part_{k}"] = _material_mesh(mi, head, k, **given)
    return shapes


def _materials_of_kind(head: Head, kind: str) -> list[int]:
    kinds = [material.kind for material in head.mesh.materials]
    return [k for k in np.unique(head.mesh.material).tolist() if kinds[k] == kind]


def _diffuse_bsdf(mi: Mitsuba, reflectance: SceneDict | float) -> MitsubaObject:
    return mi.load_dict({"type": "diffuse", "reflectance": reflectance})


def _material_mesh(mi: Mitsuba, head: Head, index: int, **given: MitsubaObject) -> MitsubaObject:
    """Return the triangles of a material with the head's own normals."""
    mesh = head.mesh
    used, corners = np.unique(mesh.triangles[mesh.material == index], return_inverse=True)
    places = mesh.positions[used] - np.array(head.centre_mm)
    return mesh_shape(mi, places, corners.reshape(-1, 3), mesh.normals[used], **given)


def _layer_interfaces(mi: Mitsuba, head: Head, medium: Medium) -> tuple[SceneDict, tuple[str, ...]]:
    """Return surfaces around the skin and around what lies below each interface between its layers."""
    skin = closed_skin(head.mesh, head.name)
    skin = replace(skin, positions=(skin.positions - np.array(head.centre_mm)).astype(np.float32))
    notes = [f"{skin.caps} openings shut, {skin.cap_area:.0f} mm2"] if skin.caps else []
    gap = interface_gap_mm(mi, skin)
    media: list[MitsubaObject] = [None, *(mi.load_dict(_homogeneous_medium(layer)) for layer in medium.layers), None]
    shapes = {}
    depth = -gap
    for k, (above, below) in enumerate(pairwise(media)):
        if np.isinf(depth).any():
            break
        for side, where in (("upper", depth), ("lower", depth + gap)):
            surface, folded = offset_inwards(skin, where, head.name)
            shapes[f"face_{k}_{side}"] = interface_mesh(mi, surface, {"exterior": above, "interior": below})
        if folded > _REPORTED_FOLD:
            notes.append(f"{folded:.1%} of the face under layer {k} is folded")
        if k < len(medium.layers):
            depth = depth + gap + medium.layers[k].thickness_mm
    return shapes, tuple(notes)


def interface_gap_mm(mi: Mitsuba, skin: ClosedSurface) -> Doubles:
    """Return the (p,) distance between the two surfaces of a face of a solid about the origin [mm]."""
    return np.asarray(_GAP_STEPS * (1.0 + np.abs(skin.positions).max(axis=1)) * mi.math.RayEpsilon)


def _homogeneous_medium(layer: Layer) -> SceneDict:
    extinction = layer.sigma_t_prime
    # Textures hold at most 1, so the largest extinction goes into the scale.
    return {
        "type": "homogeneous",
        "albedo": rgb(layer.alpha_prime),
        "sigma_t": rgb(extinction / extinction.max()),
        "scale": float(extinction.max()),
        "phase": {"type": "isotropic"},
    }


def interface_mesh(mi: Mitsuba, solid: ClosedSurface, media: SceneDict) -> MitsubaObject:
    """Return a surface that only separates media: exterior and interior, None for none."""
    filled = {side: medium for side, medium in media.items() if medium is not None}
    return mesh_shape(
        mi, solid.positions, solid.triangles, None, bsdf=mi.load_dict({"type": "null"}), **filled
    )


def mesh_shape(
    mi: Mitsuba,
    places: Numbers,
    triangles: Numbers,
    normals: Numbers | None = None,
    uv: Numbers | None = None,
    **given: MitsubaObject,
) -> MitsubaObject:
    """Return triangles as Mitsuba has them.

    places, normals, uv : (v, 3), (v, 3), (v, 2); None for facets, and for no pictures on them
    given : BSDF, emitter and media
    """
    properties = mi.Properties()
    for name, value in given.items():
        properties[name] = value
    more = {"has_vertex_normals": normals is not None, "has_vertex_texcoords": uv is not None}
    mesh = mi.Mesh("", len(places), len(triangles), props=properties, **more)
    parameters = mi.traverse(mesh)
    arrays = {"vertex_positions": places, "vertex_normals": normals, "vertex_texcoords": uv}
    for name, values in arrays.items():
        if values is not None:
            parameters[name] = _flattened(values, np.float32)
    parameters["faces"] = _flattened(triangles, np.uint32)
    parameters.update()
    return mesh


def _flattened(values: Numbers, kind: type[np.generic]) -> Numbers:
    return np.ascontiguousarray(values, dtype=kind).ravel()
