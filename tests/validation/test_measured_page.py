"""The page about measured people agrees with the measurements."""

from __future__ import annotations

import numpy as np
from figures_in_text import differences

from dermis.apps.validation.accuracy.measured.page import PAGE, PEOPLE_FILE, RESULT_FILE, measured_page_texts
from dermis.apps.validation.accuracy.measured.probe import lit_fraction
from dermis.apps.validation.pages import read_results, template_path


def test_the_page_is_that_of_the_figures() -> None:
    parts = measured_page_texts(read_results(RESULT_FILE)) | read_results(PEOPLE_FILE)
    text = template_path(PAGE).read_text("utf-8").format(**parts)
    assert differences(text, PAGE.read_text("utf-8")) == []


def test_circles_within_the_lit_disc_are_lit() -> None:
    near, crossing, far = lit_fraction(np.array([1e-6, 2.0, 20.0]), 4.0, 5.5)
    assert near == 1.0 and 0.8 < crossing < 1.0 and far == 0.0
    points = np.random.default_rng(0).uniform(-4.0, 4.0, (200_000, 2))
    points = points[np.hypot(*points.T) < 4.0]
    angle = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, len(points))
    ends = points + 2.0 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    assert abs(crossing - (np.hypot(*ends.T) < 5.5).mean()) < 0.004
