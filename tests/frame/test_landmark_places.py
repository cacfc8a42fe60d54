"""Landmarks lie where annotators and MediaPipe's canonical model place them; outlines on the silhouette."""

from __future__ import annotations

import numpy as np
import pytest
from observed import SETTINGS, around, from_edge, labelled, marks

from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.scene.model import Scene

EYES = ("33", "263")
# x and y of some points of canonical_face_model.obj, relative to the outer corner of the left eye, divided by
# the width between both [-]
MODEL = {
    "454": (0.362, -0.224),
    "323": (0.348, -0.418),
    "361": (0.318, -0.625),
    "332": (0.077, 0.542),
    "284": (0.206, 0.444),
    "251": (0.297, 0.312),
    "10": (-0.5, 0.630),
    "288": (0.256, -0.838),
}


def test_inner_lips_follow_the_markup_of_300_w(seen: dict[str, Observation]) -> None:
    """61 and 63 are below the peaks 50 and 52, 65 and 67 opposite; the corners are inside the mouth."""
    x, y = marks(seen["mean"]).pixels.T
    scale = x[54] - x[48]
    for inner, outer in ((61, 50), (63, 52), (65, 52), (67, 50), (62, 51), (66, 57)):
        assert abs(x[inner] - x[outer]) < 0.03 * scale, inner
    assert 0.02 < (x[60] - x[48]) / scale < 0.1 and 0.02 < (x[54] - x[64]) / scale < 0.1
    assert (y[60:65] > y[50]).all()


def test_brows_lie_at_their_upper_edge(seen: dict[str, Observation]) -> None:
    one = seen["mean"]
    for names, numbers in (("right_brow", range(18, 21)), ("left_brow", range(23, 26))):
        mask = labelled(one, names)
        for number in numbers:
            x, y = marks(one).pixels[number]
            column = np.flatnonzero(mask[:, round(x)])
            assert column.min() - 4 < y < column.mean(), number


def test_the_outline_has_the_proportions_of_the_canonical_model(seen: dict[str, Observation]) -> None:
    points = seen["mean"].landmarks["mediapipe"]
    place = dict(zip(points.names, points.positions_mm[:, :2], strict=True))
    width = place[EYES[1]][0] - place[EYES[0]][0]
    for name, expected in MODEL.items():
        found = (place[name] - place[EYES[1]]) / width
        assert found == pytest.approx(expected, abs=0.07), name


@pytest.fixture(scope="module")
def turned(renderer: Renderer) -> list[Observation]:
    """Return a bald person seen from the front and from 35 degrees to the left."""
    head = Human(sex=0.5, hair=HairLook()).head()
    scenes = [Scene(head, camera=around(head, degrees)) for degrees in (0.0, 35.0)]
    sets = "ibug-68", "ibug-68-silhouette"
    return list(renderer.observe(scenes, SETTINGS, outputs=["label"], landmarks=sets))


def test_the_silhouette_is_the_edge_of_the_face(turned: list[Observation]) -> None:
    front, side = (one.landmarks["ibug-68-silhouette"] for one in turned)
    bodies = [one.landmarks["ibug-68"] for one in turned]
    np.testing.assert_array_equal(front.pixels, bodies[0].pixels)
    assert front.names == bodies[0].names
    np.testing.assert_array_equal(side.pixels[8:], bodies[1].pixels[8:])
    background = labelled(turned[1], "background", "neck")
    for k in range(1, 7):
        assert from_edge(background, side.pixels[k]) < 2.5, k
        assert from_edge(background, bodies[1].pixels[k]) > 4.0, k
        assert side.visible[k] and not bodies[1].visible[k]
