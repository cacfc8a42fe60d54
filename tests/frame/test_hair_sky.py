"""Light of the sky on skin under hair."""

from __future__ import annotations

import os

import numpy as np
import pytest

from dermis.apps.validation.comparisons.person import VIEWS, view_scene
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.mesh.strands import Roots, Strands, cover_of_points
from dermis.scene.environment import Environment


def test_cover_is_the_area_of_strands_per_area_of_skin() -> None:
    from strand_setups import SIDE_MM, sheet

    mesh = sheet()
    quads = len(mesh.quads)
    roots = Roots(np.arange(quads, dtype=np.int32), np.full((quads, 2), 0.5, np.float32))
    knots = np.zeros((quads, 3, 3), np.float32)
    knots[:, :, 2] = [0.0, 5.0, 10.0]
    strands = Strands(roots, knots, np.full((quads, 3), 0.5, np.float32), np.ones((quads, 3), np.float32))
    cover = cover_of_points(mesh, strands)
    area = 0.5 * 10.0 * 1.0  # half of length times width [mm2]
    assert cover.shape == (len(mesh.points_mm),)
    inner = np.abs(mesh.points_mm[:, :2]).max(axis=1) < 0.49 * SIDE_MM
    np.testing.assert_allclose(cover[inner], area * quads / SIDE_MM**2, rtol=1e-6)


def test_skin_below_hair_gets_less_of_the_sky() -> None:
    renderer, head = Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu")), Human().head(subdivide=0)
    scene = view_scene(head, VIEWS["portrait"])
    scene = scene.replace(lights=(), environment=Environment(name="uniform"))
    options = {"size": (32, 32), "atlas": 128, "samples": 1, "parts": "diffuse"}
    haired, bald = (renderer.render(scene, strands=strands, **options) for strands in (True, False))
    rows = np.nonzero(bald.sum(axis=(1, 2)))[0]
    scalp, face = slice(rows[0], rows[0] + 3), slice(rows[0] + 12, rows[0] + 16)
    assert haired[scalp, 12:20].sum() < 0.5 * bald[scalp, 12:20].sum()
    assert haired[face, 13:19].sum() == pytest.approx(bald[face, 13:19].sum(), rel=0.1)
