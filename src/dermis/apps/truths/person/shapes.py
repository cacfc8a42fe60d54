"""Coated skin: a rough white surface that reflects, and a medium below that light reaches unbent."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.scene_description import Described, Mitsuba, MitsubaObject, rgb
from dermis.apps.truths.mitsuba_scene import gap_of, mesh_shape, shell
from dermis.apps.truths.mitsuba_solid import Solid, inwards, skin_solid
from dermis.apps.truths.person.medium import INDEX, PASSED
from dermis.apps.truths.person.person import Hairs, Paint, Person
from dermis.mesh.eyeball import (
    LIMBUS_MM,
    SCLERA_MM,
    cornea_centre_mm,
    iris_mm,
    profile_mm,
)


def picture(mi: Mitsuba, values: NDArray[np.floating]) -> Described:
    """Return a picture (h, w) or (h, w, 3) of plain numbers as Mitsuba's texture."""
    bitmap = mi.Bitmap(np.ascontiguousarray(values, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}


def coat(mi: Mitsuba, paint: Paint) -> MitsubaObject:
    """Return the surface: reflection of a dielectric of skin's index with painted roughness, over a hole.

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


def skin_shapes(mi: Mitsuba, person: Person, medium: MitsubaObject) -> tuple[Described, tuple[str, ...]]:
    """Return two surfaces around the medium, as `mitsuba_scene` has them, the upper one coated; and notes."""
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


def _skin(person: Person) -> NDArray[np.bool_]:
    mesh = person.mesh
    return np.asarray(np.array([material.kind == "skin" for material in mesh.materials])[mesh.material])


def _coated(mi: Mitsuba, person: Person, upper: Solid, medium: MitsubaObject) -> MitsubaObject:
    """Return the outer surface with the mesh's own normals and uv."""
    mesh, triangles = person.mesh, person.mesh.triangles[_skin(person)]
    vertices, corners = np.unique(triangles, return_inverse=True)
    points = np.unique(mesh.point[triangles])
    places = upper.positions[np.searchsorted(points, mesh.point[vertices])]
    given = {"bsdf": coat(mi, person.paint), "interior": medium}
    uv, normals = mesh.uv[vertices], mesh.normals[vertices]
    return mesh_shape(mi, places, corners.reshape(-1, 3), normals, uv, **given)


Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

CORNEA_INDEX = 1.336
"""Of the cornea's front and what is behind it, as one refracting surface: that of the aqueous humour [-]."""
TEARS = 0.06
"""Roughness of the film over the white of the eye [-]."""
SOFT_MM = 0.55
"""Half of the width over which the white turns clear [mm]."""
RIM = 0.49
"""Distance from the middle of the layout for half a turn from the axis."""
_AROUND, _CLEAR, _BACK = 192, 96, 96  # steps around the axis, and from the apex over cornea and white
_PICTURE = 1024
_FLAT = 0.02  # by which the disc ends inside the ball [mm]


def ball() -> tuple[Doubles, Index, Doubles, Doubles]:
    """Return places of an eyeball in its own space [mm], triangles, normals, and uv by its layout."""
    edge = np.arctan2(LIMBUS_MM + 2 * SOFT_MM, np.sqrt(SCLERA_MM**2 - LIMBUS_MM**2))
    angle = np.concatenate([np.linspace(0.0, edge, _CLEAR, endpoint=False), np.linspace(edge, np.pi, _BACK)])
    turn = 2.0 * np.pi * np.arange(_AROUND + 1) / _AROUND
    a, t = (part.ravel() for part in np.meshgrid(angle, turn, indexing="ij"))
    along = np.stack([np.sin(a) * np.cos(t), np.sin(a) * np.sin(t), np.cos(a)], axis=-1)
    places = profile_mm(a)[:, None] * along
    cornea = places - [0.0, 0.0, cornea_centre_mm()]
    cornea /= np.linalg.norm(cornea, axis=1, keepdims=True)
    clear = clearness(np.hypot(places[:, 0], places[:, 1]), places[:, 2])[:, None]
    normals = along + clear * (cornea - along)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uv = 0.5 + RIM * (a / np.pi)[:, None] * np.stack([np.cos(t), -np.sin(t)], axis=-1)
    return places, _grid(len(angle), _AROUND + 1), normals, uv


def _grid(rows: int, columns: int) -> Index:
    """Return triangles of a grid of points whose rows go away from +z and columns around it."""
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = first, first + columns, first + columns + 1, first + 1
    return np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])


def clearness(off_mm: Doubles, z_mm: Doubles) -> Doubles:
    """Return the clear share of a ball's surface by distance from the axis and place along it."""
    t = np.clip((off_mm - LIMBUS_MM + SOFT_MM) / (2 * SOFT_MM), 0.0, 1.0)
    return np.where(z_mm > 0.0, 1.0 - t * t * (3.0 - 2.0 * t), 0.0)


def clear_picture() -> Doubles:
    """Return (n, n) of `clearness` by the layout's uv."""
    u = (np.arange(_PICTURE) + 0.5) / _PICTURE - 0.5
    angle = np.minimum(np.hypot(*np.meshgrid(u, u)) / RIM, 1.0) * np.pi
    radius = profile_mm(angle)
    return clearness(radius * np.sin(angle), radius * np.cos(angle))


def disc() -> tuple[Doubles, Index, float]:
    """Return places of the plane of the iris up to the ball, triangles, and its radius [mm]."""
    radius = float(np.sqrt(SCLERA_MM**2 - iris_mm() ** 2)) - _FLAT
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    rim = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(_AROUND, iris_mm())], axis=-1)
    k = np.arange(_AROUND)
    triangles = np.stack([np.full(_AROUND, _AROUND), k, (k + 1) % _AROUND], axis=-1)
    return np.concatenate([rim, [[0.0, 0.0, iris_mm()]]]), triangles, radius


def materials(mi: Mitsuba, paint: Paint) -> tuple[MitsubaObject, MitsubaObject]:
    """Return the materials of the ball and of the iris."""
    white = {
        "type": "roughplastic",
        "distribution": "beckmann",
        "alpha": TEARS,
        "int_ior": CORNEA_INDEX,
        "diffuse_reflectance": picture(mi, paint.white),
    }
    clear = {"type": "dielectric", "int_ior": CORNEA_INDEX, "ext_ior": 1.0}
    both = {
        "type": "blendbsdf",
        "weight": picture(mi, clear_picture()),
        "white": white,
        "clear": clear,
    }
    iris = {"type": "diffuse", "reflectance": picture(mi, paint.iris)}
    return mi.load_dict(both), mi.load_dict({"type": "twosided", "bsdf": iris})


def eye_shapes(mi: Mitsuba, person: Person) -> Described:
    """Return all eyes of a person, from the head's centre."""
    covered, iris = materials(mi, person.paint)
    places, triangles, normals, uv = ball()
    flat, fans, _ = disc()
    on_iris = 0.5 + 0.5 * flat[:, :2] / person.paint.reach_mm
    shapes = {}
    for k, frame in enumerate(person.eyes):
        back = np.linalg.inv(frame)
        turned = normals @ (back[:3, :3] / np.cbrt(np.linalg.det(back[:3, :3]))).T
        shapes[f"eye_{k}"] = mesh_shape(mi, _moved(back, places), triangles, turned, uv, bsdf=covered)
        shapes[f"iris_{k}"] = mesh_shape(mi, _moved(back, flat), fans, None, on_iris, bsdf=iris)
    return shapes


def _moved(matrix: Doubles, places: Doubles) -> Doubles:
    return np.asarray(places @ matrix[:3, :3].T + matrix[:3, 3])


KERATIN_INDEX = 1.55
"""Of refraction of keratin [Marschner2003]."""
TILT_DEGREES = 2.0
"""By which the scales of the cuticle rise."""
ROUGH_ALONG, ROUGH_AROUND = 0.22, 0.5
"""As artists give it [Chiang2016]."""
COLOURS = 12
"""Different absorptions at most: curves of one file share theirs."""
_LEAST_MM = 1e-3


def hair_shapes(mi: Mitsuba, hairs: Hairs, name: str = "hairs") -> Described:
    """Return the hairs in groups of nearly the same absorption, each a shape of that name and a number."""
    shapes = {}
    depth = hairs.absorption * hairs.radius_mm.max(axis=1, keepdims=True)  # Mitsuba's unit is the radius
    with tempfile.TemporaryDirectory() as folder:
        for k, group in enumerate(groups(depth)):
            file = Path(folder) / f"{k}.txt"
            write_curves(file, hairs.knots_mm[group], hairs.radius_mm[group])
            fibre = {
                "type": "hair",
                "sigma_a": rgb(depth[group].mean(axis=0)),
                "longitudinal_roughness": ROUGH_ALONG,
                "azimuthal_roughness": ROUGH_AROUND,
                "scale_tilt": TILT_DEGREES,
                "int_ior": KERATIN_INDEX,
            }
            shapes[f"{name}_{k}"] = mi.load_dict(
                {"type": "bsplinecurve", "filename": str(file), "bsdf": fibre}
            )
    return shapes


def groups(depth: NDArray[np.floating]) -> list[NDArray[np.int64]]:
    """Return rows (n, 3) in at most `COLOURS` groups by their sum."""
    order = np.argsort(depth.sum(axis=1), kind="stable")
    return [part for part in np.array_split(order, min(COLOURS, len(order))) if len(part)]


def write_curves(path: Path, knots_mm: Doubles, radius_mm: NDArray[np.floating]) -> None:
    """Write a file of curves for Mitsuba: a line for each control point, an empty one after each curve."""
    rows = np.concatenate([knots_mm, radius_mm[..., None].astype(np.float64)], axis=-1)
    points = control_points(rows)
    points[..., 3] = np.maximum(points[..., 3], _LEAST_MM)
    with path.open("w", encoding="ascii") as file:
        for curve in points:
            np.savetxt(file, curve, "%.5f")
            file.write("\n")


def control_points(knots: Doubles) -> Doubles:
    """Return (n, k + 2, c) of uniform cubic B-splines through knots (n, k, c), straight at both ends."""
    count = knots.shape[1]
    matrix = np.eye(count)
    inner = np.arange(1, count - 1)
    matrix[inner, inner] = 4 / 6
    matrix[inner, inner - 1] = matrix[inner, inner + 1] = 1 / 6
    found = np.einsum("jk,nkc->njc", np.linalg.inv(matrix), knots)
    ends = 2 * found[:, [0, -1]] - found[:, [1, -2]]
    return np.concatenate([ends[:, :1], found, ends[:, 1:]], axis=1)
