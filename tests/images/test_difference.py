"""CIEDE2000 against the library of colour science."""

from __future__ import annotations

import warnings

import numpy as np

from dermis.images.colour import delta_e_2000, lab


def test_differences_match_the_library() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour

    first, second = np.random.default_rng(0).uniform(0.0, 1.0, (2, 2000, 3))
    second[:20] = first[:20].mean(axis=1, keepdims=True)  # grey
    wanted = colour.difference.delta_E_CIE2000(lab(first), lab(second))
    np.testing.assert_allclose(delta_e_2000(first, second), wanted, atol=1e-9)


def test_lab_values_match_and_equal_colours_do_not_differ() -> None:
    np.testing.assert_allclose(lab([1.0, 1.0, 1.0]), [100.0, 0.0, 0.0], atol=1e-4)
    assert delta_e_2000([0.4, 0.2, 0.1], [0.4, 0.2, 0.1]) == 0.0
    np.testing.assert_allclose(lab([0.18, 0.18, 0.18])[0], 49.496, atol=1e-3)
