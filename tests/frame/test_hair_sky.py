"""Light of the sky on skin under hair."""

from __future__ import annotations

import os

import numpy as np

from dermis.apps.validation.comparisons.person_views import VIEWS, view_scene
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.human.person import Human
from dermis.mesh.strands import Roots, hair_cover_of_points
from dermis.scene.environment import Environment
from dermis.scene.settings import Settings


def test_cover_is_the_area_of_strands_per_area_of_skin() -> None:
    from strand_setups import SIDE_MM, sheet

    mesh = sheet()
    quads = len(mesh.quads)
    roots = Roots(np.arange(quads, dtype=np.int32), np.full((quads, 2), 0.5, np.float32))
    cover = hair_cover_of_points(mesh, roots, np.full(quads, 10.0))
    area = 0.5 * 10.0  # half of the area from the side [mm2]
    assert cover.shape == (len(mesh.points_mm),)
    inner = np.abs(mesh.points_mm[:, :2]).max(axis=1) < 0.49 * SIDE_MM
    np.testing.assert_allclose(cover[inner], area * quads / SIDE_MM**2, rtol=1e-6)


def test_skin_below_hair_gets_less_of_the_sky() -> None:
    renderer, head = Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu")), Human().head(subdivide=0)
    scene = view_scene(head, VIEWS["portrait"])
    scene = scene.replace(lights=(), environment=Environment(name="uniform"))
    maps = []
    for strands in (True, False):
        inputs = renderer.prepare(
            scene, Settings(size=(16, 16), atlas=128, strands=strands, occlusion="rest")
        )
        maps.append(download(renderer.device, inputs.bindings["occlusion_map"]))
    haired, bald = maps
    vertices = haired[haired.shape[1] + 1 :].ravel()[: len(head.mesh.positions)]
    unoccluded = bald[bald.shape[1] + 1 :].ravel()[: len(head.mesh.positions)]
    crown, nose = head.mesh.positions[:, 1].argmax(), head.mesh.positions[:, 2].argmax()
    assert vertices[crown] < 0.5 * unoccluded[crown]
    assert vertices[nose] == unoccluded[nose]
    atlas = haired[: haired.shape[1]] / np.maximum(bald[: bald.shape[1]], 1e-6)
    assert atlas.min() < 0.3 and np.median(atlas) == 1.0
