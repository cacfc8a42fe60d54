"""Coated skin: a rough white surface that reflects, and a medium below that light reaches unbent."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.scene_description import SceneDict, Mitsuba, MitsubaObject, rgb
from dermis.apps.truths.mitsuba_scene import interface_gap_mm, mesh_shape, interface_mesh
from dermis.apps.truths.mitsuba_solid import ClosedSurface, offset_inwards, closed_skin
from dermis.apps.truths.person.medium import COAT_INDEX, COAT_TRANSMITTANCE
from dermis.apps.truths.person.person import HairFibres, SkinTextures, Person
from dermis.mesh.eyeball import (
    LIMBUS_MM,
    SCLERA_MM,
    cornea_centre_mm,
    iris_mm,
    profile_mm,
)


def mitsuba_texture(mi: Mitsuba, values: NDArray[np.floating]) -> SceneDict:
    """Return a picture (h, w) or (h, w, 3) of plain numbers as Mitsuba's texture."""
    bitmap = mi.Bitmap(np.ascontiguousarray(values, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}


def coat_bsdf(mi: Mitsuba, paint: SkinTextures) -> MitsubaObject:
    """Return the surface: reflection of a dielectric of skin's index with painted roughness, over a hole.

    Through a refracting surface no ray to a light finds its way. So light passes this one unbent, but for a
    small share that meets a mirror as many times brighter as the share is small.
    """
    share = 1.0 - COAT_TRANSMITTANCE
    mirror = {
        "type": "roughconductor",
        "distribution": "beckmann",
        "alpha": mitsuba_texture(mi, paint.roughness),
        "eta": COAT_INDEX,
        "k": 0.0,  # an index alone reflects as a dielectric does
        "specular_reflectance": 1.0 / share,
    }
    raised = {"type": "bumpmap", "relief": mitsuba_texture(mi, paint.height_mm), "bsdf": mirror}
    return mi.load_dict({"type": "mask", "opacity": share, "bsdf": raised})


def skin_shapes(mi: Mitsuba, person: Person, medium: MitsubaObject) -> tuple[SceneDict, tuple[str, ...]]:
    """Return two surfaces around the medium, as `mitsuba_scene` has them, the upper one coated; and notes."""
    solid = closed_skin(person.mesh, person.name)
    notes = (f"{solid.caps} openings shut, {solid.cap_area:.0f} mm2",) if solid.caps else ()
    gap = interface_gap_mm(mi, solid)
    upper, _ = offset_inwards(solid, -gap, person.name)
    lower, _ = offset_inwards(solid, np.zeros(len(gap)), person.name)
    inside = {"exterior": None, "interior": medium}
    shapes = {"skin_lower": interface_mesh(mi, lower, inside), "skin": _coated_mesh(mi, person, upper, medium)}
    skin = int(_skin_mask(person).sum())
    if len(solid.triangles) > skin:
        fans = replace(upper, triangles=solid.triangles[skin:])
        shapes["skin_openings"] = interface_mesh(mi, fans, inside)
    return shapes, notes


def _skin_mask(person: Person) -> NDArray[np.bool_]:
    mesh = person.mesh
    return np.asarray(np.array([material.kind == "skin" for material in mesh.materials])[mesh.material])


def _coated_mesh(mi: Mitsuba, person: Person, upper: ClosedSurface, medium: MitsubaObject) -> MitsubaObject:
    """Return the outer surface with the mesh's own normals and uv."""
    mesh, triangles = person.mesh, person.mesh.triangles[_skin_mask(person)]
    vertices, corners = np.unique(triangles, return_inverse=True)
    points = np.unique(mesh.point[triangles])
    places = upper.positions[np.searchsorted(points, mesh.point[vertices])]
    given = {"bsdf": coat_bsdf(mi, person.paint), "interior": medium}
    uv, normals = mesh.uv[vertices], mesh.normals[vertices]
    return mesh_shape(mi, places, corners.reshape(-1, 3), normals, uv, **given)


Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

CORNEA_INDEX = 1.336
"""Of the cornea's front and what is behind it, as one refracting surface: that of the aqueous humour [-]."""
TEAR_ROUGHNESS = 0.06
"""Roughness of the film over the white of the eye [-]."""
LIMBUS_HALF_WIDTH_MM = 0.55
"""Half of the width over which the white turns clear [mm]."""
UV_RADIUS = 0.49
"""Distance from the middle of the layout for half a turn from the axis."""
_STEPS_AROUND, _CORNEA_STEPS, _SCLERA_STEPS = 192, 96, 96  # steps around the axis, and from the apex over cornea and white
_TEXTURE_SIDE = 1024
_IRIS_GAP_MM = 0.02  # by which the disc ends inside the ball [mm]


def eyeball_mesh() -> tuple[Doubles, Index, Doubles, Doubles]:
    """Return places of an eyeball in its own space [mm], triangles, normals, and uv by its layout."""
    edge = np.arctan2(LIMBUS_MM + 2 * LIMBUS_HALF_WIDTH_MM, np.sqrt(SCLERA_MM**2 - LIMBUS_MM**2))
    angle = np.concatenate([np.linspace(0.0, edge, _CORNEA_STEPS, endpoint=False), np.linspace(edge, np.pi, _SCLERA_STEPS)])
    turn = 2.0 * np.pi * np.arange(_STEPS_AROUND + 1) / _STEPS_AROUND
    a, t = (part.ravel() for part in np.meshgrid(angle, turn, indexing="ij"))
    along = np.stack([np.sin(a) * np.cos(t), np.sin(a) * np.sin(t), np.cos(a)], axis=-1)
    places = profile_mm(a)[:, None] * along
    cornea = places - [0.0, 0.0, cornea_centre_mm()]
    cornea /= np.linalg.norm(cornea, axis=1, keepdims=True)
    clear = cornea_weight(np.hypot(places[:, 0], places[:, 1]), places[:, 2])[:, None]
    normals = along + clear * (cornea - along)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uv = 0.5 + UV_RADIUS * (a / np.pi)[:, None] * np.stack([np.cos(t), -np.sin(t)], axis=-1)
    return places, _grid_triangles(len(angle), _STEPS_AROUND + 1), normals, uv


def _grid_triangles(rows: int, columns: int) -> Index:
    """Return triangles of a grid of points whose rows go away from +z and columns around it."""
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = first, first + columns, first + columns + 1, first + 1
    return np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])


def cornea_weight(off_mm: Doubles, z_mm: Doubles) -> Doubles:
    """Return the clear share of a ball's surface by distance from the axis and place along it."""
    t = np.clip((off_mm - LIMBUS_MM + LIMBUS_HALF_WIDTH_MM) / (2 * LIMBUS_HALF_WIDTH_MM), 0.0, 1.0)
    return np.where(z_mm > 0.0, 1.0 - t * t * (3.0 - 2.0 * t), 0.0)


def cornea_weight_map() -> Doubles:
    """Return (n, n) of `clearness` by the layout's uv."""
    u = (np.arange(_TEXTURE_SIDE) + 0.5) / _TEXTURE_SIDE - 0.5
    angle = np.minimum(np.hypot(*np.meshgrid(u, u)) / UV_RADIUS, 1.0) * np.pi
    radius = profile_mm(angle)
    return cornea_weight(radius * np.sin(angle), radius * np.cos(angle))


def iris_disc() -> tuple[Doubles, Index, float]:
    """Return places of the plane of the iris up to the ball, triangles, and its radius [mm]."""
    radius = float(np.sqrt(SCLERA_MM**2 - iris_mm() ** 2)) - _IRIS_GAP_MM
    turn = 2.0 * np.pi * np.arange(_STEPS_AROUND) / _STEPS_AROUND
    rim = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(_STEPS_AROUND, iris_mm())], axis=-1)
    k = np.arange(_STEPS_AROUND)
    triangles = np.stack([np.full(_STEPS_AROUND, _STEPS_AROUND), k, (k + 1) % _STEPS_AROUND], axis=-1)
    return np.concatenate([rim, [[0.0, 0.0, iris_mm()]]]), triangles, radius


def eye_bsdfs(mi: Mitsuba, paint: SkinTextures) -> tuple[MitsubaObject, MitsubaObject]:
    """Return the materials of the ball and of the iris."""
    white = {
        "type": "roughplastic",
        "distribution": "beckmann",
        "alpha": TEAR_ROUGHNESS,
        "int_ior": CORNEA_INDEX,
        "diffuse_reflectance": mitsuba_texture(mi, paint.white),
    }
    clear = {"type": "dielectric", "int_ior": CORNEA_INDEX, "ext_ior": 1.0}
    both = {
        "type": "blendbsdf",
        "weight": mitsuba_texture(mi, cornea_weight_map()),
        "white": white,
        "clear": clear,
    }
    iris = {"type": "diffuse", "reflectance": mitsuba_texture(mi, paint.iris)}
    return mi.load_dict(both), mi.load_dict({"type": "twosided", "bsdf": iris})


def eye_shapes(mi: Mitsuba, person: Person) -> SceneDict:
    """Return all eyes of a person, from the head's centre."""
    covered, iris = eye_bsdfs(mi, person.paint)
    places, triangles, normals, uv = eyeball_mesh()
    flat, fans, _ = iris_disc()
    on_iris = 0.5 + 0.5 * flat[:, :2] / person.paint.reach_mm
    shapes = {}
    for k, frame in enumerate(person.eyes):
        back = np.linalg.inv(frame)
        turned = normals @ (back[:3, :3] / np.cbrt(np.linalg.det(back[:3, :3]))).T
        shapes[f"eye_{k}"] = mesh_shape(mi, _transform_points(back, places), triangles, turned, uv, bsdf=covered)
        shapes[f"iris_{k}"] = mesh_shape(mi, _transform_points(back, flat), fans, None, on_iris, bsdf=iris)
    return shapes


def _transform_points(matrix: Doubles, places: Doubles) -> Doubles:
    return np.asarray(places @ matrix[:3, :3].T + matrix[:3, 3])


KERATIN_INDEX = 1.55
"""Of refraction of keratin [Marschner2003]."""
CUTICLE_TILT_DEGREES = 2.0
"""By which the scales of the cuticle rise."""
LONGITUDINAL_ROUGHNESS, AZIMUTHAL_ROUGHNESS = 0.22, 0.5
"""As artists give it [Chiang2016]."""
MAX_HAIR_GROUPS = 12
"""Different absorptions at most: curves of one file share theirs."""
_MIN_RADIUS_MM = 1e-3


def hair_shapes(mi: Mitsuba, hairs: HairFibres, name: str = "hairs") -> SceneDict:
    """Return the hairs in groups of nearly the same absorption, each a shape of that name and a number."""
    shapes = {}
    depth = hairs.absorption * hairs.radius_mm.max(axis=1, keepdims=True)  # Mitsuba's unit is the radius
    with tempfile.TemporaryDirectory() as folder:
        for k, group in enumerate(absorption_groups(depth)):
            file = Path(folder) / f"{k}.txt"
            write_curves(file, hairs.knots_mm[group], hairs.radius_mm[group])
            fibre = {
                "type": "hair",
                "sigma_a": rgb(depth[group].mean(axis=0)),
                "longitudinal_roughness": LONGITUDINAL_ROUGHNESS,
                "azimuthal_roughness": AZIMUTHAL_ROUGHNESS,
                "scale_tilt": CUTICLE_TILT_DEGREES,
                "int_ior": KERATIN_INDEX,
            }
            shapes[f"{name}_{k}"] = mi.load_dict(
                {"type": "bsplinecurve", "filename": str(file), "bsdf": fibre}
            )
    return shapes


def absorption_groups(depth: NDArray[np.floating]) -> list[NDArray[np.int64]]:
    """Return rows (n, 3) in at most `COLOURS` groups by their sum."""
    order = np.argsort(depth.sum(axis=1), kind="stable")
    return [part for part in np.array_split(order, min(MAX_HAIR_GROUPS, len(order))) if len(part)]


def write_curves(path: Path, knots_mm: Doubles, radius_mm: NDArray[np.floating]) -> None:
    """Write a file of curves for Mitsuba: a line for each control point, an empty one after each curve."""
    rows = np.concatenate([knots_mm, radius_mm[..., None].astype(np.float64)], axis=-1)
    points = bspline_control_points(rows)
    points[..., 3] = np.maximum(points[..., 3], _MIN_RADIUS_MM)
    with path.open("w", encoding="ascii") as file:
        for curve in points:
            np.savetxt(file, curve, "%.5f")
            file.write("\n")


def bspline_control_points(knots: Doubles) -> Doubles:
    """Return (n, k + 2, c) of uniform cubic B-splines through knots (n, k, c), straight at both ends."""
    count = knots.shape[1]
    matrix = np.eye(count)
    inner = np.arange(1, count - 1)
    matrix[inner, inner] = 4 / 6
    matrix[inner, inner - 1] = matrix[inner, inner + 1] = 1 / 6
    found = np.einsum("jk,nkc->njc", np.linalg.inv(matrix), knots)
    ends = 2 * found[:, [0, -1]] - found[:, [1, -2]]
    return np.concatenate([ends[:, :1], found, ends[:, 1:]], axis=1)
