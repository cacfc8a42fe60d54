"""Colour of the scalp below cropped hair, in pictures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

import dermis
from dermis.base.arrays import Floats
from dermis.scene import Environment, Scene, Settings

SIDE = 128
OUTLINE_PX, FRONT_PX = (0.9, 3.0), (10.0, 24.0)
"""Distances from the outline of pixels at the outline, and of pixels whose scalp faces the camera."""


def back_of_head(eumelanin: float) -> tuple[Floats, Floats]:
    """Return mean radiances (3,) of cropped hair at the outline and where the scalp faces the camera."""
    hair = dermis.HairLook("cropped", length_mm=6.0, eumelanin=eumelanin)
    head = dermis.Human(sex=1.0, african=0.0, asian=0.0, hair=hair).head(subdivide=0)
    front = dermis.portrait(head)
    x, y, z = np.subtract(front.position, front.target)
    camera = front.replace(position=tuple(np.add(front.target, [x, y + 0.35 * abs(z), -z])))
    scene = Scene(head, camera=camera, lights=(), environment=Environment(name="uniform"))
    settings = Settings(size=(SIDE, SIDE), atlas=256, exposure=1.0)
    (one,) = dermis.Renderer().observe([scene], settings, linear=True, outputs=["label"])
    inside = one.outputs["label"] > 0
    depth = distance_transform_edt(inside)
    top = np.flatnonzero(inside.any(axis=1))[0]
    zone = inside & (np.arange(SIDE)[:, None] < top + 36)
    outline, facing = (
        one.picture[zone & (low < depth) & (depth < high)] for low, high in (OUTLINE_PX, FRONT_PX)
    )
    return outline.mean(axis=0), facing.mean(axis=0)


@pytest.mark.parametrize("eumelanin", [5.0, 1.0, 0.35])
def test_cropped_hair_is_as_bright_in_front_as_at_the_outline(eumelanin: float) -> None:
    """Compare luminances in uniform light, in which radiance is albedo."""
    outline, facing = (np.dot(one, [0.2126, 0.7152, 0.0722]) for one in back_of_head(eumelanin))
    assert facing == pytest.approx(outline, rel=0.1)


def test_scalp_below_dark_hair_is_not_blue() -> None:
    _, facing = back_of_head(5.0)
    assert facing[0] > facing[2]
