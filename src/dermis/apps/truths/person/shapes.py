"""Mitsuba shapes of a person: coated skin around a medium, refracting eyes and hair fibres."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.mitsuba_scene import (
    inner_interfaces,
    interface_gap_mm,
    interface_mesh,
    mesh_shape,
)
from dermis.apps.truths.mitsuba_solid import ClosedSurface, closed_skin, offset_inwards
from dermis.apps.truths.person.medium import COAT_IOR, COAT_TRANSMITTANCE
from dermis.apps.truths.person.person import HairFibres, Person, SkinTextures
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject, SceneDict, mitsuba_rgb
from dermis.mesh.eyeball import LIMBUS_MM, SCLERA_MM, cornea_centre_mm, iris_plane_mm, surface_distance_mm
from dermis.optics.media import Medium
from dermis.specular.two_lobe import MAX_ROUGHNESS, MIN_ROUGHNESS, NARROW_FACTOR, NARROW_WEIGHT, WIDE_FACTOR

_REFLECTION_PATH_FRACTION = 0.1
"""Fraction of the paths that meet the rough lobes of a refracting surface."""
_NEARLY_SMOOTH_ROUGHNESS = 0.02
_ROUGHNESS_RANGE = MIN_ROUGHNESS, MAX_ROUGHNESS


def mitsuba_texture(mi: Mitsuba, texels: NDArray[np.floating]) -> SceneDict:
    """Return Mitsuba's description of a texture from linear texels (h, w) or (h, w, 3)."""
    bitmap = mi.Bitmap(np.ascontiguousarray(texels, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}


def coat_bsdf(mi: Mitsuba, textures: SkinTextures) -> MitsubaObject:
    """Return the BSDF of skin with the two specular lobes of the real-time renderer, without refraction.

    Most paths pass the surface undeflected, so that they can connect to point lights. A small fraction of the
    paths meets the lobes instead. The reflectance of the lobes is divided by this fraction, which gives the
    reflection its full strength. The light that leaves the skin is reduced by the same small fraction.
    """
    mirror_fraction = 1.0 - COAT_TRANSMITTANCE
    coat = {
        "type": "mask",
        "opacity": mirror_fraction,
        "bsdf": _reflection_lobes_bsdf(mi, textures, mirror_fraction),
    }
    return mi.load_dict(coat)


def _reflection_lobes_bsdf(mi: Mitsuba, textures: SkinTextures, path_fraction: float) -> SceneDict:
    """Return the BSDF of the skin's surface: a bump map with the two specular lobes of `specular.two_lobe`.

    path_fraction : fraction of the paths that meet this BSDF; the reflectance is divided by it [-]
    """
    lobe = {
        "distribution": "beckmann",
        "type": "roughconductor",
        "eta": COAT_IOR,
        "k": 0.0,  # with a real index it reflects like a dielectric
        "specular_reflectance": mitsuba_texture(mi, textures.strength / path_fraction),
    }
    narrow, wide = (
        lobe | {"alpha": mitsuba_texture(mi, np.clip(factor * textures.roughness, *_ROUGHNESS_RANGE))}
        for factor in (NARROW_FACTOR, WIDE_FACTOR)
    )
    both = {"type": "blendbsdf", "weight": 1.0 - NARROW_WEIGHT, "narrow": narrow, "wide": wide}
    return {"type": "bumpmap", "relief": mitsuba_texture(mi, textures.height_mm), "bsdf": both}


def refracting_bsdfs(mi: Mitsuba, textures: SkinTextures) -> tuple[MitsubaObject, MitsubaObject]:
    """Return the BSDFs of skin with a refracting surface, for light from outside and from inside.

    From outside, a fraction of the paths is reflected by the rough lobes of `coat_bsdf`, and the rest meets a
    smooth dielectric that transmits only. From inside, all paths meet a smooth dielectric. The light that is
    transmitted does not depend on the specular strength. Lights must have a size, because paths cannot
    connect to a point light through this boundary.
    """
    indices = {"int_ior": COAT_IOR, "ext_ior": 1.0}
    # A blend with a perfectly smooth dielectric would be up to 20 % too bright in Mitsuba 3.9.
    below = {"type": "roughdielectric", "distribution": "beckmann", "alpha": _NEARLY_SMOOTH_ROUGHNESS}
    below |= {"specular_reflectance": 0.0, "specular_transmittance": 1.0 / (1.0 - _REFLECTION_PATH_FRACTION)}
    mirror = _reflection_lobes_bsdf(mi, textures, _REFLECTION_PATH_FRACTION)
    outside = {
        "type": "blendbsdf",
        "weight": _REFLECTION_PATH_FRACTION,
        "below": indices | below,
        "mirror": mirror,
    }
    return mi.load_dict(outside), mi.load_dict({"type": "dielectric"} | indices)


def lambertian_skin_bsdf(mi: Mitsuba, textures: SkinTextures) -> MitsubaObject:
    """Return the BSDF of skin: two specular lobes over a Lambertian base, whose albedo is the colour map."""
    fraction = 1.0 - COAT_TRANSMITTANCE
    base = {
        "type": "diffuse",
        "reflectance": mitsuba_texture(mi, np.clip(textures.colour / COAT_TRANSMITTANCE, 0.0, 1.0)),
    }
    mirror = _reflection_lobes_bsdf(mi, textures, fraction)
    return mi.load_dict({"type": "blendbsdf", "weight": fraction, "base": base, "mirror": mirror})


def diffuse_skin_shapes(mi: Mitsuba, person: Person) -> SceneDict:
    """Return the skin as an open surface with the BSDF `lambertian_skin_bsdf`, without a medium inside."""
    triangles = person.mesh.triangles[_skin_mask(person)]
    vertices, corners = np.unique(triangles, return_inverse=True)
    positions, normals, uv = (
        values[vertices] for values in (person.mesh.positions, person.mesh.normals, person.mesh.uv)
    )
    bsdf = lambertian_skin_bsdf(mi, person.textures)
    return {"skin": mesh_shape(mi, positions, corners.reshape(-1, 3), normals, uv, bsdf=bsdf)}


def skin_shapes(
    mi: Mitsuba, person: Person, medium: Medium, media: Sequence[MitsubaObject]
) -> tuple[SceneDict, tuple[str, ...]]:
    """Return closed surfaces around the layers of the skin, and notes for the user on changes to the head.

    Each interface consists of an upper and a lower surface, as in `mitsuba_scene`. The upper surface of the
    outermost interface reflects like skin. If the medium has an index of refraction above 1, both surfaces of
    this interface refract: the upper one light from outside, the lower one light from inside.

    medium : layers of the skin
    media : Mitsuba's media of these layers
    """
    solid = closed_skin(person.mesh, person.name)
    notes = [f"{solid.caps} openings closed, {solid.cap_area:.0f} mm2"] if solid.caps else []
    gap, top = interface_gap_mm(mi, solid), {"exterior": None, "interior": media[0]}
    upper, _ = offset_inwards(solid, -gap, person.name)
    lower, _ = offset_inwards(solid, np.zeros(len(gap)), person.name)
    textures, refracts = person.textures, medium.eta != 1.0
    outer, inner = refracting_bsdfs(mi, textures) if refracts else (coat_bsdf(mi, textures), None)
    shapes = {"skin": _textured_skin_mesh(mi, person, upper, outer, media[0])}
    fans = solid.triangles[int(_skin_mask(person).sum()) :]
    if refracts:
        shapes["skin_lower"] = _textured_skin_mesh(mi, person, lower, inner, media[0])
        if len(fans):
            shapes["openings_lower"] = interface_mesh(mi, replace(lower, triangles=fans), top)
    else:
        shapes["skin_lower"] = interface_mesh(mi, lower, top)
    if len(fans):
        shapes["openings"] = interface_mesh(mi, replace(upper, triangles=fans), top)
    deeper, deeper_notes = inner_interfaces(mi, solid, medium, media, person.name)
    return shapes | deeper, (*notes, *deeper_notes)


def _skin_mask(person: Person) -> NDArray[np.bool_]:
    mesh = person.mesh
    return np.asarray(np.array([material.kind == "skin" for material in mesh.materials])[mesh.material])


def _textured_skin_mesh(
    mi: Mitsuba, person: Person, surface: ClosedSurface, bsdf: MitsubaObject, medium: MitsubaObject
) -> MitsubaObject:
    """Return the skin as a Mitsuba mesh at the positions of a closed surface, with the head's normals and uv.

    surface : closed surface of the head, from `closed_skin` and `offset_inwards`
    bsdf : BSDF of the mesh
    medium : Mitsuba's medium inside the surface
    """
    mesh, triangles = person.mesh, person.mesh.triangles[_skin_mask(person)]
    vertices, corners = np.unique(triangles, return_inverse=True)
    points = np.unique(mesh.point[triangles])
    positions = surface.positions[np.searchsorted(points, mesh.point[vertices])]
    attributes = {"bsdf": bsdf, "interior": medium}
    uv, normals = mesh.uv[vertices], mesh.normals[vertices]
    return mesh_shape(mi, positions, corners.reshape(-1, 3), normals, uv, **attributes)


Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

CORNEA_IOR = 1.336
"""Index of refraction of the aqueous humour, used behind the cornea's front surface [-]."""
TEAR_ROUGHNESS = 0.06
"""Roughness of the tear film over the white of the eye [-]."""
LIMBUS_BLUR_MM = 0.55
"""Half the width of the transition from white to cornea [mm]."""
EYE_UV_RADIUS = 0.49
"""Distance in uv from the middle of the texture that corresponds to 180 degrees from the eye's axis."""
_EYEBALL_STEPS_AROUND, _CORNEA_STEPS, _SCLERA_STEPS = 192, 96, 96
"""Number of steps of the eyeball mesh: around the axis, from the apex to the limbus, and on to the back."""
_CORNEA_TEXTURE_SIDE = 1024
_IRIS_GAP_MM = 0.02  # between the edge of the disc and the eyeball [mm]


def eyeball_mesh() -> tuple[Doubles, Index, Doubles, Doubles]:
    """Return an eyeball mesh in the space of the eye: positions [mm], triangles, normals and polar uv."""
    limbus = np.arctan2(LIMBUS_MM + 2 * LIMBUS_BLUR_MM, np.sqrt(SCLERA_MM**2 - LIMBUS_MM**2))
    angle = np.concatenate(
        [np.linspace(0.0, limbus, _CORNEA_STEPS, endpoint=False), np.linspace(limbus, np.pi, _SCLERA_STEPS)]
    )
    azimuth = 2.0 * np.pi * np.arange(_EYEBALL_STEPS_AROUND + 1) / _EYEBALL_STEPS_AROUND
    a, t = (grid.ravel() for grid in np.meshgrid(angle, azimuth, indexing="ij"))
    outwards = np.stack([np.sin(a) * np.cos(t), np.sin(a) * np.sin(t), np.cos(a)], axis=-1)
    positions = surface_distance_mm(a)[:, None] * outwards
    cornea = positions - [0.0, 0.0, cornea_centre_mm()]
    cornea /= np.linalg.norm(cornea, axis=1, keepdims=True)
    clear = cornea_weight(np.hypot(positions[:, 0], positions[:, 1]), positions[:, 2])[:, None]
    normals = outwards + clear * (cornea - outwards)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uv = 0.5 + EYE_UV_RADIUS * (a / np.pi)[:, None] * np.stack([np.cos(t), -np.sin(t)], axis=-1)
    return positions, _grid_triangles(len(angle), _EYEBALL_STEPS_AROUND + 1), normals, uv


def _grid_triangles(row_count: int, column_count: int) -> Index:
    """Return the triangles between rings of points on a surface of revolution.

    row_count : number of rings around the axis
    column_count : number of points in each ring
    """
    first = (np.arange(row_count - 1)[:, None] * column_count + np.arange(column_count - 1)).ravel()
    a, b, c, d = first, first + column_count, first + column_count + 1, first + 1
    return np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])


def cornea_weight(axis_distance_mm: Doubles, z_mm: Doubles) -> Doubles:
    """Return the weight of the cornea, from 1 (clear cornea), smoothly across the limbus, to 0 (sclera) [-].

    axis_distance_mm : distance from the eye's axis [mm]
    z_mm : position along the axis [mm]
    """
    t = np.clip((axis_distance_mm - LIMBUS_MM + LIMBUS_BLUR_MM) / (2 * LIMBUS_BLUR_MM), 0.0, 1.0)
    return np.where(z_mm > 0.0, 1.0 - t * t * (3.0 - 2.0 * t), 0.0)


def cornea_weight_map() -> Doubles:
    """Return `cornea_weight` as a texture (n, n) over the polar uv of the eyeball."""
    u = (np.arange(_CORNEA_TEXTURE_SIDE) + 0.5) / _CORNEA_TEXTURE_SIDE - 0.5
    angle = np.minimum(np.hypot(*np.meshgrid(u, u)) / EYE_UV_RADIUS, 1.0) * np.pi
    radius = surface_distance_mm(angle)
    return cornea_weight(radius * np.sin(angle), radius * np.cos(angle))


def iris_disc() -> tuple[Doubles, Index, float]:
    """Return the iris as a disc: positions [mm], triangles, and its radius [mm].

    The rim of the disc nearly touches the eyeball.
    """
    radius = float(np.sqrt(SCLERA_MM**2 - iris_plane_mm() ** 2)) - _IRIS_GAP_MM
    azimuth = 2.0 * np.pi * np.arange(_EYEBALL_STEPS_AROUND) / _EYEBALL_STEPS_AROUND
    rim = np.stack(
        [radius * np.cos(azimuth), radius * np.sin(azimuth), np.full(_EYEBALL_STEPS_AROUND, iris_plane_mm())],
        axis=-1,
    )
    k = np.arange(_EYEBALL_STEPS_AROUND)
    triangles = np.stack(
        [np.full(_EYEBALL_STEPS_AROUND, _EYEBALL_STEPS_AROUND), k, (k + 1) % _EYEBALL_STEPS_AROUND], axis=-1
    )
    return np.concatenate([rim, [[0.0, 0.0, iris_plane_mm()]]]), triangles, radius


def eye_bsdfs(mi: Mitsuba, textures: SkinTextures) -> tuple[MitsubaObject, MitsubaObject]:
    """Return the Mitsuba BSDFs of the eyeball and of the iris."""
    white = {
        "type": "roughplastic",
        "distribution": "beckmann",
        "alpha": TEAR_ROUGHNESS,
        "int_ior": CORNEA_IOR,
        "diffuse_reflectance": mitsuba_texture(mi, textures.white),
    }
    clear = {"type": "dielectric", "int_ior": CORNEA_IOR, "ext_ior": 1.0}
    weight = mitsuba_texture(mi, cornea_weight_map())
    eyeball = {"type": "blendbsdf", "weight": weight, "white": white, "clear": clear}
    iris = {"type": "diffuse", "reflectance": mitsuba_texture(mi, textures.iris)}
    return mi.load_dict(eyeball), mi.load_dict({"type": "twosided", "bsdf": iris})


def eye_shapes(mi: Mitsuba, person: Person) -> SceneDict:
    """Return the Mitsuba shapes of a person's eyes, relative to the head's centre."""
    eyeball_bsdf, iris_bsdf = eye_bsdfs(mi, person.textures)
    positions, triangles, normals, uv = eyeball_mesh()
    disc, fan, _ = iris_disc()
    iris_uv = 0.5 + 0.5 * disc[:, :2] / person.textures.reach_mm
    shapes = {}
    for k, frame in enumerate(person.eyes):
        to_head = np.linalg.inv(frame)
        eye_normals = normals @ (to_head[:3, :3] / np.cbrt(np.linalg.det(to_head[:3, :3]))).T
        eyeball, iris = (_transform_points(to_head, one) for one in (positions, disc))
        shapes[f"eye_{k}"] = mesh_shape(mi, eyeball, triangles, eye_normals, uv, bsdf=eyeball_bsdf)
        shapes[f"iris_{k}"] = mesh_shape(mi, iris, fan, None, iris_uv, bsdf=iris_bsdf)
    return shapes


def _transform_points(matrix: Doubles, positions: Doubles) -> Doubles:
    return np.asarray(positions @ matrix[:3, :3].T + matrix[:3, 3])


KERATIN_IOR = 1.55
"""Index of refraction of keratin [Marschner2003]."""
CUTICLE_TILT_DEGREES = 2.0
"""Tilt of the cuticle scales."""
LONGITUDINAL_ROUGHNESS, AZIMUTHAL_ROUGHNESS = 0.22, 0.5
"""Roughness in the parametrisation for artists [Chiang2016]."""
MAX_HAIR_GROUPS = 12
"""Largest number of hair groups; all fibres of a group get the group's mean optical depth."""
_MIN_HAIR_RADIUS_MM = 1e-3
_MINUTE_POINT_COUNT, _MINUTE_STEP_MM = 4, 0.01


def hair_shapes(mi: Mitsuba, hairs: HairFibres, shape_name: str = "hairs") -> SceneDict:
    """Return hair fibres as Mitsuba shapes, one for each group of fibres with similar absorption.

    shape_name : prefix of the shapes' names, which end in a number
    """
    shapes = {}
    optical_depth = hairs.absorption * hairs.radius_mm.max(axis=1, keepdims=True)
    with tempfile.TemporaryDirectory() as folder:
        for k, group in enumerate(group_by_optical_depth(optical_depth)):
            file = Path(folder) / f"{k}.txt"
            write_curves(file, hairs.knots_mm[group], hairs.radius_mm[group])
            fibre = fibre_bsdf(optical_depth[group].mean(axis=0))
            curves = {"type": "bsplinecurve", "filename": str(file), "bsdf": fibre}
            shapes[f"{shape_name}_{k}"] = mi.load_dict(curves)
    return shapes


def fibre_bsdf(optical_depth: NDArray[np.floating]) -> SceneDict:
    """Return Mitsuba's description of the material of hair fibres.

    optical_depth : (3,) absorption coefficient times the radius of a fibre, Mitsuba's unit of length [-]
    """
    return {
        "type": "hair",
        "sigma_a": mitsuba_rgb(optical_depth),
        "longitudinal_roughness": LONGITUDINAL_ROUGHNESS,
        "azimuthal_roughness": AZIMUTHAL_ROUGHNESS,
        "scale_tilt": CUTICLE_TILT_DEGREES,
        "int_ior": KERATIN_IOR,
    }


def group_by_optical_depth(optical_depth: NDArray[np.floating]) -> list[NDArray[np.int64]]:
    """Return at most `MAX_HAIR_GROUPS` groups of fibres with similar absorption, each as fibre indices.

    optical_depth : (n, 3) absorption coefficient of each fibre times its radius; fibres are grouped by the
        sum of the channels [-]
    """
    order = np.argsort(optical_depth.sum(axis=1), kind="stable")
    return [group for group in np.array_split(order, min(MAX_HAIR_GROUPS, len(order))) if len(group)]


def write_curves(path: Path, knots_mm: Doubles, radius_mm: NDArray[np.floating]) -> None:
    """Write B-spline curves for Mitsuba to a file, in the format of `curves_text`."""
    path.write_text(curves_text(knots_mm, radius_mm), encoding="ascii")


def curves_text(knots_mm: Doubles, radius_mm: NDArray[np.floating]) -> str:
    """Return B-spline curves for Mitsuba as text: a line per control point, an empty line after each curve.

    The text ends with a curve too small to be hit. For hits near the end of a curve, Mitsuba 3.9.1 reads the
    control points of the next curve; after the last one it would read invalid memory.

    knots_mm : (n, k, 3) points through which the curves pass [mm]
    radius_mm : (n, k) radius at these points [mm]
    """
    rows = np.concatenate([knots_mm, radius_mm[..., None].astype(np.float64)], axis=-1)
    points = bspline_control_points(rows)
    points[..., 3] = np.maximum(points[..., 3], _MIN_HAIR_RADIUS_MM)
    return "".join(f"{_curve_text(curve)}\n" for curve in (*points, _minute_curve(knots_mm[-1])))


def _curve_text(control_points: Doubles) -> str:
    return "".join(f"{x:.5f} {y:.5f} {z:.5f} {r:.5f}\n" for x, y, z, r in control_points.tolist())


def _minute_curve(knots_mm: Doubles) -> Doubles:
    """Return the control points of a minute curve that continues a curve at its tip."""
    step = knots_mm[-1] - knots_mm[-2]
    step *= _MINUTE_STEP_MM / max(float(np.linalg.norm(step)), _MINUTE_STEP_MM)
    positions = knots_mm[-1] + np.arange(_MINUTE_POINT_COUNT)[:, None] * step
    return np.column_stack([positions, np.full(_MINUTE_POINT_COUNT, _MIN_HAIR_RADIUS_MM)])


def bspline_control_points(knots: Doubles) -> Doubles:
    """Return the control points (n, k + 2, c) of uniform cubic B-splines through knots, straight at the ends.

    knots : (n, k, c) points through which the curves pass
    """
    count = knots.shape[1]
    matrix = np.eye(count)
    inner = np.arange(1, count - 1)
    matrix[inner, inner] = 4 / 6
    matrix[inner, inner - 1] = matrix[inner, inner + 1] = 1 / 6
    inner_points = np.einsum("jk,nkc->njc", np.linalg.inv(matrix), knots)
    ends = 2 * inner_points[:, [0, -1]] - inner_points[:, [1, -2]]
    return np.concatenate([ends[:, :1], inner_points, ends[:, 1:]], axis=1)
