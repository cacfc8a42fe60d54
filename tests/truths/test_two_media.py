"""Light across the border of two media: the known result of a single medium, and reciprocity."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths.slab_mc import trace_medium
from dermis.apps.truths.two_media import strip_transfer
from dermis.optics.media import Layer, Medium

EDGES = np.linspace(-6.0, 6.0, 25)


def test_equal_media_reduce_to_one_medium() -> None:
    sigma_a, sigma_s = np.full(2, 0.3), np.full(2, 2.0)
    left = strip_transfer(sigma_a, sigma_s, EDGES, 4000)[10:14].sum(axis=1)
    layer = Layer(sigma_a[:1], sigma_s[:1], float("inf"), "half-space")
    true = trace_medium(Medium("one", (layer,)), 20_000)[0]
    assert left.mean() == pytest.approx(true.total_reflectance / (1.0 - true.specular), rel=0.03)


def test_transfer_between_the_media_is_nearly_reciprocal() -> None:
    transfer = strip_transfer(np.array([0.05, 0.4]), np.array([2.0, 2.0]), EDGES, 20_000)
    there, back = transfer[:12, 12:].sum(), transfer[12:, :12].sum()
    assert there == pytest.approx(back, rel=0.12)
    assert transfer[:12].sum() > 1.5 * transfer[12:].sum()
