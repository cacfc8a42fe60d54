"""Hair fibres as curves of Mitsuba: knots, radii and absorption."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from dermis.apps.truths.mitsuba_scene import load_mitsuba, mitsuba_variant
from dermis.apps.truths.person.person import HairFibres
from dermis.apps.truths.person.shapes import (
    MAX_HAIR_GROUPS,
    bspline_control_points,
    group_by_optical_depth,
    hair_shapes,
    write_curves,
)
from dermis.specular.hair import fibre_parameters, fibre_scattering

pytest.importorskip("mitsuba")
STEPS = 400


def straight(radius_mm: float, absorption: tuple[float, float, float]) -> HairFibres:
    """Return a straight hair along x."""
    knots = np.zeros((1, 5, 3))
    knots[0, :, 0] = np.linspace(-20.0, 20.0, 5)
    radius = np.full((1, 5), radius_mm, np.float32)
    return HairFibres(knots, radius, np.array([absorption], np.float32))


def test_curves_go_through_their_knots() -> None:
    knots = np.random.default_rng(2).normal(size=(4, 9, 3))
    points = bspline_control_points(knots)
    through = (points[:, :-2] + 4 * points[:, 1:-1] + points[:, 2:]) / 6
    np.testing.assert_allclose(through, knots, atol=1e-12)


def test_files_contain_a_block_for_each_curve(tmp_path: Path) -> None:
    knots = np.arange(3 * 4 * 3, dtype=np.float64).reshape(3, 4, 3)
    write_curves(tmp_path / "a.txt", knots, np.full((3, 4), 0.05, np.float32))
    *curves, minute = (tmp_path / "a.txt").read_text("ascii").strip().split("\n\n")
    assert len(curves) == 3
    assert all(len(block.splitlines()) == 6 for block in curves)
    points = np.loadtxt(minute.splitlines())
    np.testing.assert_allclose(points[:, :3], np.tile(knots[-1, -1], (4, 1)), atol=0.04)
    assert len(points) == 4 and (points[:, 3] < 0.01).all()


def test_hairs_are_grouped_by_absorption() -> None:
    depth = np.random.default_rng(1).random((100, 3))
    parts = group_by_optical_depth(depth)
    assert len(parts) == MAX_HAIR_GROUPS and sorted(np.concatenate(parts)) == list(range(100))
    ends = [(depth[part].sum(axis=1).min(), depth[part].sum(axis=1).max()) for part in parts]
    assert all(first[1] <= second[0] for first, second in itertools.pairwise(ends))
    assert len(group_by_optical_depth(depth[:1])) == 1


@pytest.mark.parametrize("radius_mm", [0.04, 0.5])
def test_hair_in_uniform_light_matches_the_lobe(radius_mm: float) -> None:
    depth = np.array([0.0, 0.2, 1.0])
    mi, r = load_mitsuba(), 0.999 * radius_mm
    with mitsuba_variant(mi, "scalar_rgb"):
        shapes = hair_shapes(mi, straight(radius_mm, tuple(depth / radius_mm)))
        to_world = mi.ScalarTransform4f().look_at([0, 0, 10], [0, 0, 0], [0, 1, 0]).scale([r, r, 1])
        film = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}}
        sensor = {"type": "orthographic", "to_world": to_world, "film": film}
        described = {"type": "scene", "integrator": {"type": "path"}, "all": {"type": "constant"}}
        found = np.array(mi.render(mi.load_dict({**described, "sensor": sensor, **shapes}), spp=4096))
    sines = (np.arange(STEPS) + 0.5) * 2 / STEPS - 1
    around = (np.arange(STEPS) + 0.5) * 2 * np.pi / STEPS
    s, phi = np.meshgrid(sines, around)
    lobe = fibre_scattering(s, 0.0 * s, phi, depth, fibre_parameters())
    expected = lobe.sum(axis=(0, 1)) * (2 / STEPS) * (2 * np.pi / STEPS)
    np.testing.assert_allclose(found[0, 0, :3], expected, rtol=0.04)
