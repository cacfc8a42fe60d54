"""Parts that are not skin: pictures, metal, emission and opacity that cuts them out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, joined, scene_of, settings_of

from dermis.frame.features.shape import shape
from dermis.frame.features.visibility.layers import draw_layers, make_layers
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download
from dermis.mesh.head import Head
from dermis.mesh.maps import PartMaps
from dermis.mesh.primitives import plane

SIDE = 8


def card(**material: Any) -> Head:
    """Return a square of skin with a card in front of it, red on the left and blue on the right."""
    mesh = joined(
        (plane(80.0), (0.0, 0.0, -40.0), (0.0, 0.0, 1.0)),
        (plane(40.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        kinds=("skin", "opaque"),
    )
    skin, part = mesh.materials
    part = replace(part, **{"has_maps": True, "roughness": 1.0} | material)
    colour = np.ones((SIDE, SIDE, 4), np.float32)
    colour[:, : SIDE // 2, :3], colour[:, SIDE // 2 :, :3] = (0.5, 0.0, 0.0), (0.0, 0.0, 0.5)
    colour[:, SIDE // 2 :, 3] = 0.0
    surface = np.zeros((SIDE, SIDE, 4), np.float32)
    surface[..., 2], surface[..., 3] = 1.0, material.get("metalness", 0.0)
    head = head_of(replace(mesh, materials=(skin, part)))
    return replace(head, maps=replace(head.maps, parts=PartMaps(colour, surface)))


def drawn(renderer: Renderer, head: Head) -> NDArray[np.float32]:
    settings = settings_of(size=(64, 64), atlas=64)
    return renderer.draw(scene_of(head, frontal(), camera=front_camera(head)), settings).linear()


def test_a_part_shows_its_picture(renderer: Renderer) -> None:
    picture = drawn(renderer, card())
    left, right = picture[32, 24], picture[32, 40]
    assert left[0] > 4 * left[2] and right[2] > 4 * right[0]


def test_opacity_cuts_a_part_out(renderer: Renderer) -> None:
    solid, cut = drawn(renderer, card()), drawn(renderer, card(opacity_cutoff=0.5))
    assert np.allclose(solid[32, 24], cut[32, 24], rtol=0.05)
    assert cut[32, 40, 0] > 4 * solid[32, 40, 0]  # skin behind the hole


@pytest.mark.parametrize("compute", [False, True])
def test_both_visibility_methods_cut_the_same_holes(renderer: Renderer, compute: bool) -> None:
    head = card(opacity_cutoff=0.5)
    inputs = renderer.prepare(
        scene_of(head, frontal(), camera=front_camera(head)), settings_of(size=(64, 64), atlas=64)
    )
    layers = make_layers(renderer.device, (64, 64), 1, store_triangles=True, use_compute_pass=compute)
    frame = CommandList(renderer.device)
    shape.draw(frame, inputs.resources.shape.shape, inputs.pose_bytes)
    draw_layers(frame, "nearest", layers, replace_samples(inputs.camera_views), inputs.resources.head)
    frame.submit()
    triangle = download(renderer.device, layers.texture, layer=0)
    is_part = np.append(False, head.mesh.material == 1)[triangle]
    assert is_part[32, 17:31].all() and not is_part[32, 33:].any()


def replace_samples(views: Any) -> Any:
    """Return views with one sample in the middle of each pixel."""
    return type(views)(views.clips, np.array([[0.5, 0.5]], np.float32))


def test_metal_has_no_diffuse_light_and_colours_its_reflection(renderer: Renderer) -> None:
    dull, metal = (drawn(renderer, card(metalness=value)) for value in (0.0, 1.0))
    assert metal[32, 24, 0] != pytest.approx(dull[32, 24, 0], rel=0.1)
    assert metal[32, 24, 1] < 0.05 * metal[32, 24, 0] + 1e-3


def test_emission_is_visible_without_light(renderer: Renderer) -> None:
    head = card(emission=(0.0, 0.25, 0.0), has_maps=False)
    scene = scene_of(head, frontal(0.0), camera=front_camera(head))
    picture = renderer.draw(scene, settings_of(size=(64, 64), atlas=64)).linear()
    assert picture[32, 24] == pytest.approx([0.0, 0.25, 0.0], abs=0.01)
