"""Eyes whose cornea refracts: a coated ball, clear in front, and a disc for the iris behind it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.mitsuba_scene import mesh_shape
from dermis.apps.truths.person.skin import picture
from dermis.apps.truths.person.subject import Paint, Person
from dermis.mesh.eyeball import (
    LIMBUS_MM,
    SCLERA_MM,
    cornea_centre_mm,
    iris_mm,
    profile_mm,
)

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

INDEX = 1.336
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
    """Places of an eyeball in its own space [mm], triangles, normals, and uv by its layout."""
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
    """Triangles of a grid of points, counter-clockwise where rows go away from +z and columns around it."""
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = first, first + columns, first + columns + 1, first + 1
    return np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])


def clearness(off_mm: Doubles, z_mm: Doubles) -> Doubles:
    """Share of a ball's surface that is clear, by its distance from the axis and its place along it."""
    t = np.clip((off_mm - LIMBUS_MM + SOFT_MM) / (2 * SOFT_MM), 0.0, 1.0)
    return np.where(z_mm > 0.0, 1.0 - t * t * (3.0 - 2.0 * t), 0.0)


def clear_picture() -> Doubles:
    """(n, n) of `clearness` by the layout's uv."""
    u = (np.arange(_PICTURE) + 0.5) / _PICTURE - 0.5
    angle = np.minimum(np.hypot(*np.meshgrid(u, u)) / RIM, 1.0) * np.pi
    radius = profile_mm(angle)
    return clearness(radius * np.sin(angle), radius * np.cos(angle))


def disc() -> tuple[Doubles, Index, float]:
    """Places of the plane of the iris up to the ball, triangles, and its radius [mm]."""
    radius = float(np.sqrt(SCLERA_MM**2 - iris_mm() ** 2)) - _FLAT
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    rim = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(_AROUND, iris_mm())], axis=-1)
    k = np.arange(_AROUND)
    triangles = np.stack([np.full(_AROUND, _AROUND), k, (k + 1) % _AROUND], axis=-1)
    return np.concatenate([rim, [[0.0, 0.0, iris_mm()]]]), triangles, radius


def materials(mi: Any, paint: Paint) -> tuple[Any, Any]:
    """Of the ball and of the iris."""
    white = {
        "type": "roughplastic",
        "distribution": "beckmann",
        "alpha": TEARS,
        "int_ior": INDEX,
        "diffuse_reflectance": picture(mi, paint.white),
    }
    clear = {"type": "dielectric", "int_ior": INDEX, "ext_ior": 1.0}
    both = {
        "type": "blendbsdf",
        "weight": picture(mi, clear_picture()),
        "white": white,
        "clear": clear,
    }
    iris = {"type": "diffuse", "reflectance": picture(mi, paint.iris)}
    return mi.load_dict(both), mi.load_dict({"type": "twosided", "bsdf": iris})


def eye_shapes(mi: Any, person: Person) -> dict[str, Any]:
    """All eyes of a person, from the head's centre."""
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
