"""Landmarks of published sets, from curves and extreme points of the average human's face."""

from __future__ import annotations

import numpy as np
from human_landmark_candidates import Doubles, Surface, points_along

from dermis.mesh.eyeball import CORNEA_MM, IRIS_DEPTH_MM, SCLERA_MM, apex_mm

Anchor = tuple[int, float]
"""Index of a candidate, and depth below the surface."""
Anchors = dict[str, Anchor]

_REFRACTION = 1.336  # index of refraction of cornea and aqueous humour, as in the frame
_SEEN_MM = 1.0 / (_REFRACTION / IRIS_DEPTH_MM - (_REFRACTION - 1.0) / CORNEA_MM)
PUPIL = _SEEN_MM / (apex_mm() + SCLERA_MM)
"""Apparent position of the pupil, as a fraction of the way from the apex to the back of the eyeball."""
_NASION_Y, _TIP_Y, _SUBNASALE_Y = 0.2, -36.3, -47.6  # on the average human [mm]
# x, y on the front plane [mm]
_WING, _NOSTRIL, _ALA = (14.6, -42.6), (8.0, -46.2), (17.6, -37.5)
_OVAL_MM = (69.0, -15.0, 54.0)  # half its width, height of the largest width, and height of the top


def ibug(surface: Surface) -> Anchors:
    """Return the 68 landmarks of iBUG, numbered from 0."""
    left = _half(surface)
    both = {name: (left[name], surface.opposite(left[name])) for name in left}
    order = [
        *[("R", f"jaw {k}") for k in range(8)],
        *[("L", f"jaw {k}") for k in range(8, -1, -1)],
        *[("R", f"brow {k}") for k in range(4, -1, -1)],
        *[("L", f"brow {k}") for k in range(5)],
        *[("L", f"bridge {k}") for k in range(4)],
        *[("R", "wing"), ("R", "nostril"), ("L", "subnasale"), ("L", "nostril"), ("L", "wing")],
        *[("R", f"eye {k}") for k in ("outer", "up 2", "up 1", "inner", "down 1", "down 2")],
        *[("L", f"eye {k}") for k in ("inner", "up 1", "up 2", "outer", "down 2", "down 1")],
        *[("R", "lips"), ("R", "up side"), ("R", "up peak"), ("L", "up middle"), ("L", "up peak")],
        *[("L", "up side"), ("L", "lips"), ("L", "low 1"), ("L", "low 2"), ("L", "low middle")],
        *[("R", "low 2"), ("R", "low 1"), ("R", "lips"), ("R", "in up"), ("L", "in up middle")],
        *[("L", "in up"), ("L", "lips"), ("L", "in low"), ("L", "in low middle"), ("R", "in low")],
    ]
    return {str(k): (both[name][side == "R"], 0.0) for k, (side, name) in enumerate(order)}


def face_synthetics(surface: Surface) -> Anchors:
    """Return the 70 landmarks of FaceSynthetics: the 68 of iBUG, then the pupils."""
    left, right = (surface.apex(name) for name in ("left eye", "right eye"))
    return ibug(surface) | {"68": (right, PUPIL), "69": (left, PUPIL)}


def _half(surface: Surface) -> dict[str, int]:
    """Return the indices of the candidates of the left side and of the midline, by name of the landmark."""
    found = {
        f"jaw {k}": surface.nearest(p) for k, p in enumerate(points_along(surface.jaw(), np.arange(9) / 8))
    }
    found["jaw 8"] = surface.midline(float(surface.jaw()[-1, 1]))
    found |= {f"brow {k}": surface.nearest(p) for k, p in enumerate(_brow(surface, 0.0, 5))}
    heights = np.linspace(_NASION_Y, _TIP_Y, 4)
    found |= {f"bridge {k}": surface.midline(y) for k, y in enumerate(heights)}
    found |= {"subnasale": surface.midline(_SUBNASALE_Y)}
    found |= {"wing": surface.frontmost(*_WING), "nostril": surface.frontmost(*_NOSTRIL)}
    upper, lower = (points_along(surface.lid(up), np.arange(4) / 3) for up in (True, False))
    for name, place in zip(("inner", "up 1", "up 2", "outer"), upper, strict=True):
        found[f"eye {name}"] = surface.on_lid(place)
    for name, place in zip(("down 1", "down 2"), lower[1:3], strict=True):
        found[f"eye {name}"] = surface.on_lid(place)
    return found | _lips(surface)


def _lips(surface: Surface) -> dict[str, int]:
    upper, lower = surface.lip_border(True), surface.lip_border(False)
    peak = int(upper[:, 1].argmax())
    wanted = {"up side": points_along(upper[: peak + 1], np.array([0.5]))[0], "up peak": upper[peak]}
    wanted |= {"up middle": upper[-1], "low middle": lower[-1]}
    wanted |= dict(zip(("low 1", "low 2"), points_along(lower, np.array([1, 2]) / 3), strict=True))
    found = {name: surface.nearest(place) for name, place in wanted.items()}
    found |= {"lips": surface.mouth_corner()}
    for word, up in (("up", True), ("low", False)):
        inner = surface.inner_lip(up)
        found[f"in {word}"] = surface.on_inner_lip(points_along(inner, np.array([0.5]))[0], up)
        found[f"in {word} middle"] = surface.on_inner_lip(inner[-1], up)
    return found


def _brow(surface: Surface, across: float, count: int) -> Doubles:
    return points_along(surface.brow(across), np.linspace(0.0, 1.0, count))


def mediapipe(surface: Surface) -> Anchors:
    """Return the landmarks of face outline, brows, eyes, lips, nose ridge and irises."""
    left = {**_oval(surface), **_eye(surface), **_brows(surface), **_mouth(surface), **_nose(surface)}
    found = {name: (candidate, 0.0) for name, (candidate, _) in left.items()}
    found |= {other: (surface.opposite(candidate), 0.0) for candidate, other in left.values() if other}
    apexes = surface.apex("right eye"), surface.apex("left eye")
    found |= {name: (apex, PUPIL) for name, apex in zip(("468", "473"), apexes, strict=True)}
    return dict(sorted(found.items(), key=lambda one: int(one[0])))


Pairs = dict[str, tuple[int, str]]  # candidate, and number on the right or "", by number on the left


def _pairs(left: str, right: str, candidates: list[int]) -> Pairs:
    words = left.split(), right.split()
    return {a: (c, "" if a == b else b) for a, b, c in zip(*words, candidates, strict=True)}


def _oval(surface: Surface) -> Pairs:
    half, middle, top = _OVAL_MM
    angle = np.linspace(np.pi / 2, 0.0, 9)
    x, y = half * np.cos(angle), middle + (top - middle) * np.sin(angle)
    above = [
        surface.midline(top),
        *(surface.frontmost(0.97 * a, b) for a, b in zip(x[1:], y[1:], strict=True)),
    ]
    below = [surface.nearest(p) for p in points_along(surface.jaw()[2:], np.arange(1, 11) / 10)]
    left = "10 338 297 332 284 251 389 356 454 323 361 288 397 365 379 378 400 377 152"
    right = "10 109 67 103 54 21 162 127 234 93 132 58 172 136 150 149 176 148 152"
    return _pairs(left, right, [*above, *below])


def _eye(surface: Surface) -> Pairs:
    upper, lower = (points_along(surface.lid(up), np.arange(9) / 8) for up in (True, False))
    up = _pairs("362 398 384 385 386 387 388 466 263", "133 173 157 158 159 160 161 246 33",
                [surface.on_lid(p) for p in upper])  # fmt: skip
    return up | _pairs("382 381 380 374 373 390 249", "155 154 153 145 144 163 7",
                       [surface.on_lid(p) for p in lower[1:-1]])  # fmt: skip


def _brows(surface: Surface) -> Pairs:
    above, below = ([surface.nearest(place) for place in _brow(surface, across, 5)] for across in (0.9, -0.9))
    return _pairs("336 296 334 293 300", "107 66 105 63 70", above) | _pairs(
        "285 295 282 283 276", "55 65 52 53 46", below
    )


def _mouth(surface: Surface) -> Pairs:
    upper, lower = surface.lip_border(True), surface.lip_border(False)
    peak = int(upper[:, 1].argmax())
    above = [*points_along(upper[: peak + 1], np.arange(1, 5) / 4), upper[-1]]
    found = _pairs("409 270 269 267 0", "185 40 39 37 0", [surface.nearest(p) for p in above])
    below = points_along(lower, np.arange(1, 6) / 5)
    found |= _pairs("375 321 405 314 17", "146 91 181 84 17", [surface.nearest(p) for p in below])
    corner = surface.mouth_corner()
    found |= _pairs("291 308", "61 78", [corner, corner])
    for up, left, right in ((True, "415 310 311 312 13", "191 80 81 82 13"),
                            (False, "324 318 402 317 14", "95 88 178 87 14")):  # fmt: skip
        inner = points_along(surface.inner_lip(up), np.arange(1, 6) / 5)
        found |= _pairs(left, right, [surface.on_inner_lip(p, up) for p in inner])
    return found


def _nose(surface: Surface) -> Pairs:
    heights = [*np.linspace(_NASION_Y, _TIP_Y, 6), _TIP_Y - 3.0, _SUBNASALE_Y]
    numbers = "168 6 197 195 5 4 1 2"
    middle = _pairs(numbers, numbers, [surface.midline(y) for y in heights])
    return middle | _pairs("327 358", "98 129", [surface.frontmost(*_WING), surface.frontmost(*_ALA)])
