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
_BROW_EDGE = 0.9  # across the brow: just inside its upper edge
# Positions in MediaPipe's canonical face model (canonical_face_model.obj, Apache-2.0) [cm]. The outer corner
# of the left eye of the model is mapped to that of the average human [mm], with a scale for each axis
# [mm/cm]: from the distance of these corners, their height above the chin, and the depths of chin and
# forehead.
_EYE_CORNER_CM, _EYE_CORNER_MM = np.array([4.446, 2.664, 3.173]), np.array([40.5, -1.1, 7.3])
_MODEL_SCALE = np.array([9.11, 8.76, 9.0])
_OVAL_CM = {
    "10": (0.0, 8.262, 4.482), "338": (1.891, 8.236, 4.275), "297": (3.524, 8.006, 3.729),
    "332": (5.133, 7.486, 2.660), "284": (6.279, 6.615, 1.426), "251": (7.088, 5.435, 0.100),
    "389": (7.556, 4.107, -0.992), "356": (7.743, 2.365, -2.005), "454": (7.664, 0.673, -2.436),
    "323": (7.542, -1.049, -2.431), "361": (7.271, -2.891, -2.252), "288": (6.720, -4.789, -1.745),
    "397": (5.941, -6.224, -0.631), "365": (5.085, -7.179, 0.715), "379": (4.069, -7.993, 1.925),
    "378": (3.211, -8.533, 2.802), "400": (2.309, -8.974, 3.609), "377": (1.293, -9.296, 4.094),
}  # fmt: skip
_MOUTH_CORNER_CM, _INNER_CORNER_CM = 2.456, 2.153  # x of 291 and 308
_INNER_UPPER_CM = {"415": 1.845, "310": 1.469, "311": 1.024, "312": 0.533, "13": 0.0}  # x by name
_INNER_LOWER_CM = {"324": 1.827, "318": 1.537, "402": 1.099, "317": 0.583, "14": 0.0}
_UPPER_BROW_SHARES = 0.0, 0.315, 0.599, 0.829, 1.0  # x of 336, 296, 334, 293, 300, from the inner end
_LOWER_BROW_SHARES = 0.0, 0.289, 0.541, 0.738, 0.892  # x of 285, 295, 282, 283, 276, from the inner end
_NOSE_SHARES = 0.0, 0.214, 0.413, 0.592, 0.778, 1.0  # y of 168, 6, 197, 195, 5, 4, from the first to the last
# Landmarks 168, 1 and 327 on the average human [mm].
_MODEL_NASION_Y, _BELOW_TIP_Y, _MODEL_WING = 4.2, -40.9, (12.8, -45.0)
# Silhouette: inner ends of the lines of candidates, which start at the outline of the face; x, y [mm]
_INNER_END_MM = [(47.0, -4.0), (30.0, -21.0), (24.0, -42.0), (27.0, -60.0), (22.0, -76.0), (16.0, -88.0),
                 (12.0, -96.0), (7.0, -101.0)]  # fmt: skip
_CANDIDATES = 12


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
        *[("R", "low 2"), ("R", "low 1"), ("R", "in corner"), ("R", "in up"), ("L", "in up middle")],
        *[("L", "in up"), ("L", "in corner"), ("L", "in low"), ("L", "in low middle"), ("R", "in low")],
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
    brow = surface.brow(_BROW_EDGE)
    found |= {f"brow {k}": surface.nearest(p) for k, p in enumerate(points_along(brow, np.arange(5) / 4))}
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
    found |= {"in corner": _on_inner_lip(surface, True, _INNER_CORNER_CM / _MOUTH_CORNER_CM)}
    peak_share = float(upper[peak, 0] / upper[0, 0])  # inner points are in line with the peaks
    for word, up in (("up", True), ("low", False)):
        found[f"in {word}"] = _on_inner_lip(surface, up, peak_share)
        found[f"in {word} middle"] = _on_inner_lip(surface, up, 0.0)
    return found


def _on_inner_lip(surface: Surface, upper: bool, share: float) -> int:
    """Return the index of the candidate on the inner edge of a lip.

    share : distance from the middle, as a fraction of the distance of the corner
    """
    corner_x = float(surface.at_mm[surface.mouth_corner(), 0])
    return surface.on_inner_lip(_at_x(surface.inner_lip(upper), share * corner_x), upper)


def _at_x(path: Doubles, x: float) -> Doubles:
    """Return the point (3,) of a path at a distance x from the middle of the face [mm]."""
    order = np.argsort(path[:, 0])
    return np.array([np.interp(x, path[order, 0], column) for column in path[order].T])


def silhouette(surface: Surface) -> list[tuple[str, Anchor]]:
    """Return the names and anchors of iBUG's landmarks, with several candidates for each outline point.

    The candidates lie on a line that runs from the outline inwards over the cheek. The one that is farthest
    outwards in the picture is the point of the visible contour.
    """
    rows = []
    for name, anchor in ibug(surface).items():
        rows.append((name, anchor))
        number = int(name)
        if number > 16 or number == 8:
            continue
        k = min(number, 16 - number)
        outer = surface.at_mm[anchor[0]] * ([1, 1, 1] if number > 8 else [-1, 1, 1])
        for share in np.arange(1, _CANDIDATES) / (_CANDIDATES - 1):
            x, y = (1 - share) * outer[:2] + share * np.array(_INNER_END_MM[k])
            candidate = surface.frontmost(x, y)
            rows.append((name, (candidate if number > 8 else surface.opposite(candidate), 0.0)))
    return rows


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
    """Return the outline: the points of the face that are nearest to those of the scaled model."""
    left = "10 338 297 332 284 251 389 356 454 323 361 288 397 365 379 378 400 377"
    right = "10 109 67 103 54 21 162 127 234 93 132 58 172 136 150 149 176 148"
    wanted = {
        name: _EYE_CORNER_MM + _MODEL_SCALE * (np.array(cm) - _EYE_CORNER_CM) for name, cm in _OVAL_CM.items()
    }
    found = {name: surface.nearest(place) for name, place in wanted.items()}
    found["10"] = surface.midline(float(wanted["10"][1]))
    chin = {"152": (surface.midline(float(surface.jaw()[-1, 1])), "")}
    return chin | _pairs(left, right, [found[name] for name in left.split()])


def _eye(surface: Surface) -> Pairs:
    upper, lower = (points_along(surface.lid(up), np.arange(9) / 8) for up in (True, False))
    up = _pairs("362 398 384 385 386 387 388 466 263", "133 173 157 158 159 160 161 246 33",
                [surface.on_lid(p) for p in upper])  # fmt: skip
    return up | _pairs("382 381 380 374 373 390 249", "155 154 153 145 144 163 7",
                       [surface.on_lid(p) for p in lower[1:-1]])  # fmt: skip


def _brows(surface: Surface) -> Pairs:
    """Return the brows: points on their edges, at the fractions of their width that the model has."""
    upper, lower = surface.brow(_BROW_EDGE), surface.brow(-_BROW_EDGE)
    ends = upper[[0, -1], 0]
    above = [surface.nearest(_at_x(upper, float(ends @ [1 - s, s]))) for s in _UPPER_BROW_SHARES]
    below = [surface.nearest(_at_x(lower, float(ends @ [1 - s, s]))) for s in _LOWER_BROW_SHARES]
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
    inner_corner = _on_inner_lip(surface, True, _INNER_CORNER_CM / _MOUTH_CORNER_CM)
    found |= _pairs("291 308", "61 78", [corner, inner_corner])
    for up, right, model in (
        (True, "191 80 81 82 13", _INNER_UPPER_CM),
        (False, "95 88 178 87 14", _INNER_LOWER_CM),
    ):
        shares = [x / _MOUTH_CORNER_CM for x in model.values()]
        found |= _pairs(" ".join(model), right, [_on_inner_lip(surface, up, share) for share in shares])
    return found


def _nose(surface: Surface) -> Pairs:
    ridge = _MODEL_NASION_Y + np.array(_NOSE_SHARES) * (_TIP_Y - _MODEL_NASION_Y)
    heights = [*ridge.tolist(), _BELOW_TIP_Y, _SUBNASALE_Y]
    numbers = "168 6 197 195 5 4 1 2"
    middle = _pairs(numbers, numbers, [surface.midline(y) for y in heights])
    return middle | _pairs("327 358", "98 129", [surface.frontmost(*_MODEL_WING), surface.frontmost(*_ALA)])
