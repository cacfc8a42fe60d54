"""Coated skin: a rough white surface that reflects, and a medium below that light reaches unbent."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dermis.apps.truths.mitsuba_scene import gap_of, mesh_shape, shell
from dermis.apps.truths.mitsuba_solid import Solid, inwards, skin_solid
from dermis.apps.truths.person.medium import INDEX, PASSED
from dermis.apps.truths.person.subject import Paint, Person


def picture(mi: Any, values: Any) -> dict[str, Any]:
    """A picture (h, w) or (h, w, 3) of plain numbers as Mitsuba's texture."""
    bitmap = mi.Bitmap(np.ascontiguousarray(values, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}


def coat(mi: Any, paint: Paint) -> Any:
    """The surface: what a dielectric of skin's index reflects, roughened as painted, over a hole.

    Through a refracting surface no ray to a light finds its way. So light passes this one unbent, but for a
    small share that meets a mirror as many times brighter as the share is small.
    """
    share = 1.0 - PASSED
    mirror = {
        "type": "roughconductor",
        "distribution": "beckmann",
        "alpha": picture(mi, paint.roughness),
        "eta": INDEX,
        "k": 0.0,  # an index alone reflects as a dielectric does
        "specular_reflectance": 1.0 / share,
    }
    raised = {"type": "bumpmap", "relief": picture(mi, paint.height_mm), "bsdf": mirror}
    return mi.load_dict({"type": "mask", "opacity": share, "bsdf": raised})


def skin_shapes(mi: Any, person: Person, medium: Any) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Two surfaces around the medium, as `mitsuba_scene` has them, the upper one coated; and notes."""
    solid = skin_solid(person.mesh, person.name)
    notes = (f"{solid.caps} openings shut, {solid.cap_area:.0f} mm2",) if solid.caps else ()
    gap = gap_of(mi, solid)
    upper, _ = inwards(solid, -gap, person.name)
    lower, _ = inwards(solid, np.zeros(len(gap)), person.name)
    inside = {"exterior": None, "interior": medium}
    shapes = {"skin_lower": shell(mi, lower, inside), "skin": _coated(mi, person, upper, medium)}
    skin = int(_skin(person).sum())
    if len(solid.triangles) > skin:
        fans = replace(upper, triangles=solid.triangles[skin:])
        shapes["skin_openings"] = shell(mi, fans, inside)
    return shapes, notes


def _skin(person: Person) -> Any:
    mesh = person.mesh
    return np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]


def _coated(mi: Any, person: Person, upper: Solid, medium: Any) -> Any:
    """The outer surface with the mesh's own normals and uv."""
    mesh, triangles = person.mesh, person.mesh.triangles[_skin(person)]
    vertices, corners = np.unique(triangles, return_inverse=True)
    points = np.unique(mesh.point[triangles])
    places = upper.positions[np.searchsorted(points, mesh.point[vertices])]
    given = {"bsdf": coat(mi, person.paint), "interior": medium}
    uv, normals = mesh.uv[vertices], mesh.normals[vertices]
    return mesh_shape(mi, places, corners.reshape(-1, 3), normals, uv, **given)
