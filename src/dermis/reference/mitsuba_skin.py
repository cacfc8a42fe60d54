"""The head as Mitsuba has it: media behind index-matched surfaces, or a plain diffuser."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from dermis.errors import refuse
from dermis.mesh.head import Head
from dermis.optics.media import Layer, Medium
from dermis.reference.described import rgb
from dermis.reference.mitsuba_solid import Solid, inwards, skin_solid

_GAP = 0.97
"""Distance between the two surfaces that stand for a face, as a share of how far Mitsuba moves a ray that has
passed a surface, lest it meet it again. That step skips 0.01 mm of medium on a head, and skin with a mean
free path of 1 mm gets up to 1 % darker. With two surfaces a ray inwards passes the upper one and steps over
the lower one, a ray outwards passes the lower one and steps over the upper one: only the gap is skipped."""
_NOTABLE_FOLD = 1e-3


@dataclass(frozen=True)
class Lambertian:
    """Skin without depth that sees the lights alone, no light from itself: what a dry render computes.

    albedo : linear Rec. 709 [-]
    """

    albedo: tuple[float, float, float]


@dataclass(frozen=True)
class Shapes:
    """Mitsuba's shapes by name, and what a reader must know of them."""

    shapes: dict[str, Any]
    notes: tuple[str, ...] = field(default=())


def check_traceable(medium: Medium | Lambertian) -> None:
    """Refuse media under a surface that refracts: no ray from a point of light would find its way in."""
    if isinstance(medium, Medium) and medium.eta != 1.0:
        came = f"its index is {medium.eta:g}"
        refuse(medium.name, "an index-matched medium, for path tracing", came, "Trace medium.with_eta(1.0)")
    if isinstance(medium, Medium) and medium.channels != 3:
        came = f"it has {medium.channels}"
        refuse(medium.name, "three channels, for path tracing", came, "Give red, green and blue")


def head_shapes(mi: Any, head: Head, medium: Medium | Lambertian) -> Shapes:
    """Skin and plain materials of a head, about its centre."""
    plain = {f"material_{k}": _plain(mi, head, k) for k in _materials(head, "opaque")}
    if isinstance(medium, Lambertian):
        diffuse = mi.load_dict({"type": "diffuse", "reflectance": rgb(medium.albedo)})
        skin = {f"skin_{k}": _sheet(mi, head, k, bsdf=diffuse) for k in _materials(head, "skin")}
        return Shapes({**skin, **plain})
    bodies = _bodies(mi, head, medium)
    return Shapes({**bodies.shapes, **plain}, bodies.notes)


def mask_shapes(mi: Any, head: Head) -> dict[str, Any]:
    """The head with skin that shines with radiance 1 and all else black."""
    black = {"type": "diffuse", "reflectance": 0.0}
    shapes = {}
    for k, material in enumerate(head.mesh.materials):
        given = {"bsdf": mi.load_dict(black)}
        if material.kind == "skin":
            given["emitter"] = mi.load_dict({"type": "area", "radiance": 1.0})
        if (head.mesh.material == k).any():
            shapes[f"part_{k}"] = _sheet(mi, head, k, **given)
    return shapes


def _materials(head: Head, kind: str) -> list[int]:
    kinds = [material.kind for material in head.mesh.materials]
    return [k for k in np.unique(head.mesh.material).tolist() if kinds[k] == kind]


def _plain(mi: Any, head: Head, index: int) -> Any:
    colour = rgb(head.mesh.materials[index].colour)
    return _sheet(mi, head, index, bsdf=mi.load_dict({"type": "diffuse", "reflectance": colour}))


def _sheet(mi: Any, head: Head, index: int, **given: Any) -> Any:
    """The triangles of a material with the head's own normals."""
    mesh = head.mesh
    used, corners = np.unique(mesh.triangles[mesh.material == index], return_inverse=True)
    places = mesh.positions[used] - np.array(head.centre_mm)
    return _mesh(mi, places, corners.reshape(-1, 3), mesh.normals[used], **given)


def _bodies(mi: Any, head: Head, medium: Medium) -> Shapes:
    """Surfaces around the skin and around what lies below each face between its layers."""
    skin = skin_solid(head.mesh, head.name)
    skin = replace(skin, positions=(skin.positions - np.array(head.centre_mm)).astype(np.float32))
    notes = [f"{skin.caps} openings shut, {skin.cap_area:.0f} mm2"] if skin.caps else []
    gap = _GAP * (1.0 + np.abs(skin.positions).max(axis=1)) * mi.math.RayEpsilon
    media: list[Any] = [None, *(mi.load_dict(_homogeneous(layer)) for layer in medium.layers), None]
    shapes = {}
    depth = -gap
    for k, (above, below) in enumerate(pairwise(media)):
        if np.isinf(depth).any():
            break
        for side, where in (("upper", depth), ("lower", depth + gap)):
            surface, folded = inwards(skin, where, head.name)
            given = {"exterior": above, "interior": below}
            shapes[f"face_{k}_{side}"] = _shell(mi, surface, given)
        if folded > _NOTABLE_FOLD:
            notes.append(f"{folded:.1%} of the face under layer {k} is folded")
        if k < len(medium.layers):
            depth = depth + gap + medium.layers[k].thickness_mm
    return Shapes(shapes, tuple(notes))


def _homogeneous(layer: Layer) -> dict[str, Any]:
    extinction = layer.sigma_t_prime
    # Its textures hold at most 1, so that the largest extinction goes into the scale.
    return {
        "type": "homogeneous",
        "albedo": rgb(layer.alpha_prime),
        "sigma_t": rgb(extinction / extinction.max()),
        "scale": float(extinction.max()),
        "phase": {"type": "isotropic"},
    }


def _shell(mi: Any, solid: Solid, media: dict[str, Any]) -> Any:
    filled = {side: medium for side, medium in media.items() if medium is not None}
    return _mesh(mi, solid.positions, solid.triangles, None, bsdf=mi.load_dict({"type": "null"}), **filled)


def _mesh(mi: Any, places: Any, triangles: Any, normals: Any, **given: Any) -> Any:
    properties = mi.Properties()
    for name, value in given.items():
        properties[name] = value
    mesh = mi.Mesh("", len(places), len(triangles), has_vertex_normals=normals is not None, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = _flat(places, np.float32)
    parameters["faces"] = _flat(triangles, np.uint32)
    if normals is not None:
        parameters["vertex_normals"] = _flat(normals, np.float32)
    parameters.update()
    return mesh


def _flat(values: Sequence[Any], kind: Any) -> Any:
    return np.ascontiguousarray(values, dtype=kind).ravel()
