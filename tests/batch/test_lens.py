"""Lens distortion against OpenCV, its inverse, and resampling of pictures and labels."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.batch.sensor.lens import view_scale
from dermis.apps.batch.sensor.warping import find_neighbours, sample_bilinear, sample_nearest
from dermis.base.errors import DermisError
from dermis.dataset import Lens

LENS = Lens(k1=-0.31, k2=0.12, p1=0.0021, p2=-0.0035, k3=-0.027)
POINTS = [[0.31, -0.22], [-0.45, 0.4], [0.05, 0.6], [0.0, 0.0]]
OPENCV = [[0.29540015, -0.20969429], [-0.40939068, 0.36353629], [0.04394513, 0.54332782], [0.0, 0.0]]
"""cv2.projectPoints of these points at depth 1 with these coefficients, by OpenCV 5.0."""
K = np.array([[90.0, 0.0, 31.5], [0.0, 90.0, 23.5], [0.0, 0.0, 1.0]])
SIZE = 64, 48


def test_distortion_is_that_of_opencv() -> None:
    np.testing.assert_allclose(LENS.distort(POINTS), OPENCV, atol=1e-8)


@pytest.mark.parametrize(
    "lens", [LENS, Lens(k1=0.4, k2=0.3), Lens(k1=-0.6), Lens(p1=0.02, p2=-0.03), Lens(k3=3.0, k2=0.5)]
)
def test_the_maps_are_inverse(lens: Lens) -> None:
    pixels = np.stack(np.meshgrid(np.arange(64.0), np.arange(48.0)), axis=-1)
    pinhole = lens.undistort_pixels(pixels, K)
    assert np.abs(pinhole - pixels).max() > 0.5
    np.testing.assert_allclose(lens.distort_pixels(pinhole, K), pixels, atol=1e-6)
    np.testing.assert_allclose(lens.undistort(lens.distort(POINTS)), POINTS, atol=1e-8)


def test_a_picture_is_not_folded() -> None:
    """Of r - r³, the largest value is at 1 / sqrt(3)."""
    lens = Lens(k1=-1.0)
    assert lens.fold_radius == pytest.approx(3**-0.5)
    assert np.isnan(lens.distort([[0.6, 0.0], [0.0, -2.0]])).all()
    assert np.isnan(lens.undistort([[0.4, 0.0]])).all()
    assert lens.undistort([[0.3, 0.0]])[0, 0] == pytest.approx(0.3389369, abs=1e-6)  # root of r - r³ = 0.3
    assert view_scale(lens, K * [[4, 1, 1], [1, 4, 1], [1, 1, 1]], SIZE) > 1
    with pytest.raises(DermisError, match=r"lens: expected a lens that images the corners .* at r = 0\.577"):
        view_scale(lens, K, SIZE)


def test_the_pinhole_picture_contains_all_that_the_lens_shows() -> None:
    for lens in (LENS, Lens(k1=0.4), Lens(k1=-0.5, p1=0.01)):
        scale = view_scale(lens, K, SIZE)
        wide = K / [[scale, 1, 1], [1, scale, 1], [1, 1, 1]]
        corners = [[-0.5, -0.5], [63.5, -0.5], [-0.5, 47.5], [63.5, 47.5], [31.5, -0.5], [-0.5, 23.5]]
        seen = lens.undistort_pixels(corners, K)
        in_wide = (seen - K[:2, 2]) * np.diag(wide)[:2] / np.diag(K)[:2] + wide[:2, 2]
        assert (in_wide >= -0.5).all() and (in_wide <= [63.5, 47.5]).all()
        edges = np.abs(in_wide - wide[:2, 2]) / [32, 24]
        assert edges.max() > 0.95  # and little more


def test_linear_pictures_are_sampled_exactly() -> None:
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:48, :64].astype(np.float64)
    positions = rng.uniform(0, 47, (48, 64, 2))
    picture = np.stack([2 * x - y, 0.5 * x + 3 * y + 1], axis=-1)
    u, v = np.moveaxis(positions, -1, 0)
    expected = np.stack([2 * u - v, 0.5 * u + 3 * v + 1], axis=-1)
    found = sample_bilinear(picture, find_neighbours(positions))
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_values_of_different_classes_are_not_mixed() -> None:
    y, x = np.mgrid[:16, :16]
    classes = (x + y > 14).astype(np.int64)
    depth = np.where(classes == 1, 600.0, 0.0).astype(np.float32)
    positions = np.stack([x + 0.3, y + 0.4], axis=-1).astype(np.float64)
    neighbours = find_neighbours(positions)
    assert set(np.unique(sample_bilinear(depth, neighbours, classes))) == {0.0, 600.0}
    assert len(np.unique(sample_bilinear(depth, neighbours))) > 2
    labels = sample_nearest(classes, neighbours)
    np.testing.assert_array_equal(labels, sample_bilinear(depth, neighbours, classes) > 0)
