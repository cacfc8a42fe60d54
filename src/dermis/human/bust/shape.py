"""The whole bust as one field, part upon part, and the landmarks upon it."""

from __future__ import annotations

import numpy as np

from dermis.human.bust import ears, eyes, face, lips, neck, nose, skull
from dermis.human.bust.anatomy import INSIDE, LANDMARKS, nominal
from dermis.human.bust.fields import Doubles, gradient
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.warp import make_warp


def symmetric(points: Doubles, parameters: BustParameters) -> Doubles:
    """About the distance (n,) [mm] to the bust before its `warp`, negative inside; points (n, 3) [mm]."""
    p = fold(points)
    distance = skull.head(p, parameters) - face.modelling(p, parameters)
    distance = neck.add_neck(distance, p)
    distance = eyes.add_lids(distance, p)
    distance = nose.add_nose(distance, p, parameters)
    distance = distance - lips.relief(p, parameters)
    distance = ears.add_ears(distance, p, parameters)
    return neck.cut(distance, p)


def fold(points: Doubles) -> Doubles:
    """The points (n, 3) with the right half laid on the left one, x >= 0."""
    return np.column_stack((np.abs(points[:, 0]), points[:, 1:]))


def landmarks(parameters: BustParameters) -> dict[str, Doubles]:
    """Places (3,) of this bust [mm] by name, with "left" or "right" before those that are twofold.

    The names are those of `anatomy.LANDMARKS`; all but the centres of the eyes lie on the skin.
    """
    warp = make_warp(parameters)
    found = {}
    for name in LANDMARKS:
        place = _on_skin(name, parameters)
        if place[0] == 0:
            found[name] = warp.apply(place[None])[0]
        else:
            found[f"left {name}"] = warp.apply(place[None])[0]
            found[f"right {name}"] = warp.apply(place[None] * (-1, 1, 1))[0]
    return found


def _on_skin(name: str, parameters: BustParameters) -> Doubles:
    """The landmark (3,) before the warp, sized as its part is and moved onto the skin."""
    place = nominal(name)
    if name.startswith(("nose", "nostril", "subnasale")):
        place = nose.BASE + (place - nose.BASE) * nose.growth(parameters)
    elif name.startswith("ear"):
        place = ears.CENTRE + (place - ears.CENTRE) * parameters.ears
    if name in INSIDE:
        return place
    point = place[None].copy()
    for _ in range(8):
        slope = gradient(lambda p: symmetric(p, parameters), point)
        slope[point[:, 0] == 0, 0] = 0
        point -= slope * (symmetric(point, parameters) / max(float((slope**2).sum()), 0.05)) * 0.8
    return np.asarray(point[0])
