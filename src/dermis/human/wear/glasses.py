"""Glasses: parametric frames that are fitted to nose, brows and ears of each person."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.wear.skin_sheet import SkinSheet, head_sheet
from dermis.human.wear.skull import ear_mask
from dermis.human.wear.tubes import Solid, disc, ring, tube


class Frame(NamedTuple):
    """Proportions of a frame for a head of average width [mm].

    lens : width and height of a lens
    bridge : distance between the lenses
    exponent : superellipse exponents of the upper and the lower half of the outline; 2 is an ellipse, 4 a
        rounded square
    droop : extent to which the lower half of the outline is longer and shifted outwards, 0 to 1
    rim : half width of the rim in the plane of the lens, and its half depth
    temple : half thickness and half height of the temples at the hinge
    is_metal : whether the frame is of metal, with nose pads
    is_dark : whether the lenses are dark
    """

    lens: tuple[float, float]
    bridge: float
    exponent: tuple[float, float]
    droop: float
    rim: tuple[float, float]
    temple: tuple[float, float]
    is_metal: bool = False
    is_dark: bool = False


FRAMES: Mapping[str, Frame] = {
    "round": Frame((49.0, 46.0), 19.0, (2.1, 2.1), 0.0, (0.9, 1.1), (0.8, 1.4), is_metal=True),
    "square": Frame((52.0, 39.0), 17.0, (3.9, 3.0), 0.0, (1.8, 1.8), (1.5, 3.2)),
    "aviator": Frame(
        (57.0, 46.0), 15.0, (3.2, 2.2), 1.0, (0.8, 0.9), (0.7, 1.2), is_metal=True, is_dark=True
    ),
    "rimless": Frame((51.0, 34.0), 18.0, (3.2, 2.5), 0.0, (0.35, 1.0), (0.7, 1.1), is_metal=True),
    "sunglasses": Frame((55.0, 44.0), 16.0, (3.3, 2.5), 0.3, (2.0, 2.0), (1.9, 4.6), is_dark=True),
}
"""Frames by name."""
_OUTLINE_SIZE = 56
_REFERENCE_HALF_WIDTH_MM = 70.3  # half distance of the tragi on the average person
_LENS_Y_MM, _TILT_DEGREES, _WRAP_RADIUS_MM = -4.5, 7.0, 210.0
_CLEARANCE_MM = 1.2  # distance of the frame from the skin behind it
_MIN_FRONT_Z_MM = 27.0  # least z of the frame, which keeps lenses in front of the lashes
_NEIGHBOURS = 5  # nearest points of skin, of which the outermost is used
_EAR_POINTS = {1.0: (4597, 4603), -1.0: (2176, 2182)}  # control points at the top and the back of each ear
_PAD_WIRE_BEND_MM = np.array([0.0, -1.0, -4.0])
_TRAGI = 4618, 2197  # control points in front of the left and the right ear


class _Fit(NamedTuple):
    """Measurements of a person's head to which glasses are fitted.

    front : k-d tree over x and y of the points of skin that face forwards, and z of these points
    sides : k-d tree over y and z of the points beside the head without ears, and |x| of these points, by
        side: 1 for left, -1 for right
    control_mm : (p, 3) control points
    scale : width of the head relative to the average
    """

    front: tuple[Any, Doubles]
    sides: Mapping[float, tuple[Any, Doubles]]
    control_mm: Doubles
    scale: float

    def front_z(self, x: Doubles, y: Doubles) -> Doubles:
        """Return the largest z (n,) of the skin near positions (n,) seen from the front [mm]."""
        tree, z = self.front
        return np.asarray(z[tree.query(np.stack([x, y], axis=-1), k=_NEIGHBOURS)[1]].max(axis=-1))

    def side_x(self, side: float, y: Doubles, z: Doubles) -> Doubles:
        """Return the largest |x| (n,) of the skin near positions (n,) seen from one side [mm]."""
        tree, x = self.sides[side]
        return np.asarray(x[tree.query(np.stack([y, z], axis=-1), k=_NEIGHBOURS)[1]].max(axis=-1))


def glasses_solids(style: str, control_mm: Doubles) -> list[Solid]:
    """Return the parts of glasses that fit a person; triangles depend only on the style.

    control_mm : (p, 3) control points of the person at rest
    """
    frame, fit = FRAMES[style], _measure(head_sheet(), control_mm)
    outlines = {side: _outline(frame, side, fit.scale) for side in (1.0, -1.0)}
    z = _front_depth_mm(frame, fit, outlines)
    solids = list[Solid]()
    for side, flat in outlines.items():
        rim = _on_front(flat, z)
        outward = _on_front(1.02 * (flat - flat.mean(axis=0)) + flat.mean(axis=0), z) - rim
        solids.append(ring(rim, outward, *frame.rim, "frame"))
        if frame.is_dark:
            solids.append(disc(rim, np.array([0.0, 0.0, 1.6]), "lens"))
        solids.append(_temple(frame, fit, side, flat, z))
        if frame.is_metal:
            solids += _nose_pad(fit, side, flat, z)
    return [*solids, *_bridges(frame, outlines, z)]


def _measure(sheet: SkinSheet, control_mm: Doubles) -> _Fit:
    from scipy.spatial import cKDTree

    points, normals = sheet.fit(control_mm)
    faces_front = (normals[:, 2] > 0.05) & (points[:, 2] > -45.0)
    front = points[faces_front]
    sides = {}
    for side in (1.0, -1.0):
        own = points[(side * points[:, 0] > 38.0) & ~ear_mask()]
        sides[side] = cKDTree(own[:, 1:]), np.abs(own[:, 0])
    width = np.abs(control_mm[list(_TRAGI), 0]).mean()
    scale = float(np.clip(width / _REFERENCE_HALF_WIDTH_MM, 0.9, 1.15))
    return _Fit((cKDTree(front[:, :2]), front[:, 2]), sides, control_mm, scale)


def _outline(frame: Frame, side: float, scale: float) -> Doubles:
    """Return the outline (n, 2) of a lens in the frame's plane, counter-clockwise from the front [mm]."""
    (width, height), (upper, lower) = frame.lens, frame.exponent
    angle = np.arange(_OUTLINE_SIZE) * 2.0 * np.pi / _OUTLINE_SIZE
    exponent = np.where(np.sin(angle) > 0.0, upper, lower)
    x, y = (np.sign(part) * np.abs(part) ** (2.0 / exponent) for part in (np.cos(angle), np.sin(angle)))
    below = np.maximum(-y, 0.0) * frame.droop
    y = y * (1.0 + 0.14 * below) + 0.1 * frame.droop
    x = x * (1.0 - 0.16 * below) + 0.16 * below
    middle = 0.5 * (width + frame.bridge)
    flat = np.stack([side * (middle + 0.5 * width * x), 0.5 * height * y], axis=1) * scale
    return flat if side > 0 else flat[::-1]


def _on_front(flat: Doubles, front_z_mm: float) -> Doubles:
    """Return the points (n, 3) on the curved and tilted front of a frame, from points in its plane [mm].

    flat : (n, 2) points in the plane of the frame
    front_z_mm : z of the middle of the front
    """
    x, y = flat.T
    lean = np.tan(np.radians(_TILT_DEGREES))
    return np.stack([x, y + _LENS_Y_MM, front_z_mm - x * x / (2.0 * _WRAP_RADIUS_MM) + lean * y], axis=1)


def _front_depth_mm(frame: Frame, fit: _Fit, outlines: Mapping[float, Doubles]) -> float:
    """Return the least z of the middle of the front at which rims and bridge are not in the skin [mm]."""
    half_width, half_depth = frame.rim
    needed = [_MIN_FRONT_Z_MM]
    for flat in outlines.values():
        middle = flat.mean(axis=0)
        size = np.linalg.norm(flat - middle, axis=1, keepdims=True)
        for step in (-half_width, 0.0, half_width):
            rim = _on_front(flat + step * (flat - middle) / size, 0.0)
            needed.append(float((fit.front_z(rim[:, 0], rim[:, 1]) - rim[:, 2]).max()))
    bridge = _on_front(np.stack([np.linspace(-6.0, 6.0, 7), np.full(7, 0.12 * frame.lens[1])], axis=1), 0.0)
    needed.append(float((fit.front_z(bridge[:, 0], bridge[:, 1]) - bridge[:, 2]).max()))
    return max(needed) + half_depth + _CLEARANCE_MM


def _temple(frame: Frame, fit: _Fit, side: float, flat: Doubles, front_z_mm: float) -> Solid:
    """Return the temple: the arm from the outer side of a lens over the ear and down behind it."""
    top, back = fit.control_mm[list(_EAR_POINTS[side])]
    thick, tall = frame.temple
    outer = flat[np.abs(flat[:, 0]).argmax()] + np.array([0.0, 0.22 * frame.lens[1]])
    start = _on_front(outer[None], front_z_mm)[0]
    hinge = start + np.array([side * (2.2 + thick), 0.0, -5.0])
    over = np.array([0.0, top[1] + tall * 0.5 + 1.0, top[2] - 4.0])
    down = np.array([0.0, back[1] - 22.0, back[2] - 5.0])
    t = np.linspace(0.0, 1.0, 22)[:, None]
    arm = (1.0 - t) * hinge + t * over
    s = np.linspace(0.0, 1.0, 10)[1:, None]
    corner = over + np.array([0.0, -1.0, -11.0])
    tip = (1.0 - s) ** 2 * over + 2.0 * s * (1.0 - s) * corner + s * s * down
    path = np.concatenate([start[None], arm, tip])
    room = fit.side_x(side, path[:, 1], path[:, 2]) + thick + 0.8
    straight = np.interp(path[:, 2], [over[2], hinge[2]], [room[22], abs(hinge[0])])
    x = np.maximum(room, np.where(path[:, 2] >= over[2], straight, room))
    x[:2] = np.maximum(np.abs([start[0], hinge[0]]), room[:2] * (path[:2, 2] < 10.0))
    for _ in range(4):  # smoothed over the bumps of the head
        x[2:-1] = np.maximum(x[2:-1], 0.5 * (x[1:-2] + x[3:]))
    path[:, 0] = side * x
    height = np.interp(
        np.arange(len(path)), [0, 8, 22, len(path) - 1], [tall, 0.8 * tall, 0.6 * tall, 0.8 * tall]
    )
    sideways = np.tile([side, 0.0, 0.0], (len(path), 1))
    sideways[0] = [0.3 * side, 0.0, 1.0]
    return tube(
        path[::-1] if side > 0 else path,
        sideways,
        np.full(len(path), thick),
        height[::-1] if side > 0 else height,
        "frame",
    )


def _nose_pad(fit: _Fit, side: float, flat: Doubles, front_z_mm: float) -> list[Solid]:
    """Return a nose pad on the side of the nose and the wire that holds it."""
    y = _LENS_Y_MM - 4.0
    x = 8.6 * fit.scale
    z = float(fit.front_z(np.array([side * x]), np.array([y]))[0]) + 0.6
    middle = np.array([side * (x + 0.6), y, z])
    axis = np.array([side * 0.25, -1.0, 0.35])
    path = middle + np.linspace(-1.0, 1.0, 7)[:, None] * 5.2 * axis / np.linalg.norm(axis)
    size = np.sqrt(np.maximum(1.0 - np.linspace(-0.98, 0.98, 7) ** 2, 0.0))
    pad = tube(path, np.tile([0.6 * side, 0.0, -0.8], (7, 1)), 2.6 * size, 0.8 * size, "pad")
    inner = flat[np.abs(flat[:, 0]).argmin()]
    start = _on_front(inner[None] + [[0.0, 3.0]], front_z_mm)[0]
    t = np.linspace(0.0, 1.0, 6)[:, None]
    wire = (1.0 - t) ** 2 * start + 2.0 * t * (1.0 - t) * (start + _PAD_WIRE_BEND_MM) + t * t * middle
    thin = np.full(6, 0.45)
    return [pad, tube(wire, np.tile([0.0, 1.0, 0.2], (6, 1)), thin, thin, "frame")]


def _bridges(frame: Frame, outlines: Mapping[float, Doubles], front_z_mm: float) -> list[Solid]:
    """Return the bar between the lenses, and a second one above it for a droop of 1."""
    half_width, half_depth = frame.rim
    half = max(half_width * 0.9, 0.7)
    left = outlines[1.0]
    heights = [0.12 * frame.lens[1]] + ([0.42 * frame.lens[1]] if frame.droop >= 1.0 else [])
    bars = []
    for y in heights:
        near = left[(left[:, 0] < left[:, 0].mean())]
        x = near[np.abs(near[:, 1] - y).argmin(), 0]
        across = np.linspace(-x, x, 13)
        arch = 2.6 * (1.0 - (across / x) ** 2) * (y < 0.3 * frame.lens[1])
        path = _on_front(np.stack([across, y + arch], axis=1), front_z_mm)
        size = np.full(13, half)
        bars.append(tube(path, np.tile([0.0, 1.0, 0.0], (13, 1)), size, np.full(13, half_depth), "frame"))
    return bars
