"""Cover by hair: soft alpha, labels behind hair, and occlusion of landmarks by a beard."""

from __future__ import annotations

import numpy as np
import pytest
from observed import around, labelled

from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

HAIRS = "right_brow", "left_brow", "hair", "beard", "lashes"
SETTINGS = Settings(size=160, atlas=128, shadow_size=64, samples=1)


@pytest.fixture(scope="module")
def bearded(renderer: Renderer) -> tuple[Observation, Observation]:
    """Return a man without and with a long beard."""
    looks = HairLook(), HairLook(style="short", beard_mm=60.0)
    heads = [Human(sex=1.0, hair=look).head(hairs=0.3) for look in looks]
    scenes = [Scene(head, camera=around(head)) for head in heads]
    outputs = "label", "label_amodal", "hair_alpha", "alpha"
    shaved, covered = renderer.observe(scenes, SETTINGS, outputs=outputs, landmarks=["ibug-68"])
    return shaved, covered


def test_labels_are_those_of_hairs_where_they_cover_half(bearded: tuple[Observation, Observation]) -> None:
    for one in bearded:
        cover, hairs = one.outputs["hair_alpha"], labelled(one, *HAIRS)
        strips = np.isin(one.outputs["label_amodal"], (7, 8))  # skin of the brows has their class, too
        assert (cover[hairs & ~strips] > 0.49).all() and (cover[~hairs] < 0.51).all()
        assert ((cover > 0.02) & (cover < 0.98)).any(), "soft edges"
        assert (cover <= one.outputs["alpha"] + 0.6).all()


def test_amodal_labels_ignore_hair(bearded: tuple[Observation, Observation]) -> None:
    shaved, covered = bearded
    np.testing.assert_array_equal(shaved.outputs["label_amodal"], covered.outputs["label_amodal"])
    assert not np.isin(covered.outputs["label_amodal"], (17, 18, 19)).any()
    seen = ~labelled(covered, *HAIRS)
    np.testing.assert_array_equal(covered.outputs["label"][seen], covered.outputs["label_amodal"][seen])


def test_a_beard_occludes_landmarks_of_the_chin_only(bearded: tuple[Observation, Observation]) -> None:
    shaved, covered = (one.landmarks["ibug-68"] for one in bearded)
    np.testing.assert_array_equal(shaved.occlusion, np.where(shaved.visible, 0, 2))
    np.testing.assert_array_equal(covered.visible, shaved.visible)
    assert (covered.occlusion[5:12] >= 1).all() and (covered.occlusion[5:12] == 2).any(), "jaw"
    assert (covered.occlusion[[*range(17, 31), *range(36, 48)]] == 0).all(), "brows, bridge, eyes"
    row, column = np.round(covered.pixels[8]).astype(int)[::-1]
    assert bearded[1].outputs["hair_alpha"][row - 1 : row + 2, column - 1 : column + 2].max() > 0.1
