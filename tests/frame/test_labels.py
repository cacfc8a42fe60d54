"""Labels agree with the picture, and landmarks are on their edges."""

from __future__ import annotations

import numpy as np
import pytest
from observed import EDGE, SIDES, SIZE, around, from_edge, labelled, marks

from dermis.frame.features.hair import resources as hair_resources
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.human.labels.classes import class_number, label_classes
from dermis.human.person import Human
from dermis.scene.model import Scene
from dermis.scene.settings import Settings


@pytest.mark.parametrize("who", ["mean", "drawn"])
@pytest.mark.parametrize(("side", "points"), [("right", range(36, 42)), ("left", range(42, 48))])
def test_lids_lie_on_the_edge_of_the_eyes_label(
    seen: dict[str, Observation], who: str, side: str, points: range
) -> None:
    eye = labelled(seen[who], f"{side}_eye", f"{side}_iris")
    assert eye.sum() > 100
    assert max(from_edge(eye, marks(seen[who]).pixels[k]) for k in points) < EDGE


@pytest.mark.parametrize("who", ["mean", "drawn", "shut"])
def test_lips_lie_on_the_edge_of_their_labels(seen: dict[str, Observation], who: str) -> None:
    lips = labelled(seen[who], "upper_lip", "lower_lip")
    outer = marks(seen[who]).pixels[48:60]
    assert max(from_edge(lips, place) for place in outer) < EDGE
    corners = outer[[0, 6]]
    upper = labelled(seen[who], "upper_lip")
    assert max(from_edge(upper, place) for place in corners) < EDGE


def test_an_open_mouth_lies_between_the_inner_lips(seen: dict[str, Observation]) -> None:
    inside = labelled(seen["shut"], "mouth_interior", "teeth", "tongue")
    assert inside.sum() > 400
    inner = marks(seen["shut"]).pixels[[61, 62, 63, 65, 66, 67]]
    assert max(from_edge(inside, place) for place in inner) < 2 * EDGE


def test_labels_cover_the_head_and_nothing_else(seen: dict[str, Observation]) -> None:
    hair = "lashes", "hair", "beard", "right_brow", "left_brow"
    for one in seen.values():
        head = one.outputs["triangle"] >= 0
        labels = one.outputs["label"]
        assert (labels[head] > 0).all() and labels.max() < len(label_classes())
        assert ((labels == 0) | labelled(one, *hair))[~head].all()


def test_left_and_right_are_those_of_the_person(seen: dict[str, Observation]) -> None:
    for part in ("eye", "iris", "brow", "ear"):
        right, left = (np.argwhere(labelled(seen["mean"], f"{side}_{part}"))[:, 1] for side in SIDES)
        assert right.mean() < SIZE / 2 < left.mean(), part


def test_face_synthetics_classes_are_mapped(seen: dict[str, Observation]) -> None:
    table = np.array([one.face_synthetics for one in label_classes()])
    for one in seen.values():
        own, other = one.outputs["label"], one.outputs["label_face_synthetics"]
        plain = ~labelled(one, "lashes")
        assert (other[plain] == table[own[plain]]).all()
        assert not (other == 255).any()


def test_the_pupil_is_in_the_iris(seen: dict[str, Observation]) -> None:
    for who in ("mean", "drawn"):
        for k, side in ((68, "right"), (69, "left")):
            x, y = np.rint(marks(seen[who]).pixels[k]).astype(int)
            assert seen[who].outputs["label"][y, x] == class_number(f"{side}_iris")


def test_hair_is_labelled_where_it_covers_most(renderer: Renderer) -> None:
    head = Human.sampled(1).head(subdivide=0)
    scene = Scene(head, camera=around(head))
    small = Settings(size=96, atlas=128, shadow_size=64, samples=4)
    names = "label", "alpha", "triangle"
    rendered = renderer.draw(scene, small, outputs=names)
    label, alpha, triangle = (rendered.output(name) for name in names)
    hair = label == class_number("hair")
    assert hair.sum() > 300 and np.argwhere(hair)[:, 0].mean() < 40  # the crown
    beyond = hair & (triangle < 0)
    assert beyond.sum() > 20 and alpha[beyond].min() > 0.45
    bald = small.model_copy(update={"strands": False})
    without = renderer.draw(scene, bald, outputs=("label",)).output("label")
    assert not np.isin(without, [class_number(name) for name in ("hair", "beard", "lashes")]).any()


def test_tiles_of_any_size_label_the_same(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Large tiles, as in large pictures, give the same labels."""
    head, shown = Human.sampled(1).head(subdivide=0), []
    small = Settings(size=(75, 93), atlas=128, shadow_size=64, samples=4)  # no whole tiles
    names = "label", "label_face_synthetics"
    for side in (2, 8):
        monkeypatch.setattr(hair_resources, "_tile_side", lambda size, side=side: side)
        renderer.clear_cache()
        drawn = renderer.draw(Scene(head, camera=around(head)), small, outputs=names)
        shown.append([drawn.output(name) for name in names])
    renderer.clear_cache()
    np.testing.assert_array_equal(shown[1], shown[0])
    assert (
        np.isin(shown[0][0], [class_number(name) for name in ("hair", "right_brow", "left_brow")]).sum() > 300
    )
