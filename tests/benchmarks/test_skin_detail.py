"""`benchmarks/skin_detail.py`: deviations in bands of spatial wavelengths, exposure and the page."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.images.colour import lab, linear_of_lab

SIDE = 240


@pytest.fixture
def detail(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(sys, "path", [*sys.path, str(Path(__file__).parents[2] / "benchmarks")])
    import skin_detail

    return skin_detail


@pytest.mark.parametrize(("wavelength_mm", "inside"), [(0.8, True), (0.25, False), (3.0, False)])
def test_band_holds_only_its_wavelengths(detail: Any, wavelength_mm: float, inside: bool) -> None:
    x = (np.arange(SIDE) + 0.5) * detail.PIXEL_MM
    wave = np.broadcast_to(np.sin(2 * np.pi * x / wavelength_mm), (SIDE, SIDE))
    found = detail.band_deviation(wave, 0.4, 1.6)
    assert found == pytest.approx(np.sqrt(0.5), rel=0.03) if inside else found < 0.02


def test_shading_of_a_curved_face_is_no_detail(detail: Any) -> None:
    y, x = np.mgrid[:SIDE, :SIDE] / SIDE
    assert detail.band_deviation(60.0 + 8.0 * x - 5.0 * y + 4.0 * x * x - 3.0 * x * y, 1.6, 6.4) < 1e-6


def test_figures_do_not_depend_on_the_exposure(detail: Any) -> None:
    rng = np.random.default_rng(1)
    colours = np.array([60.0, 12.0, 14.0]) + rng.normal(0.0, 0.5, (SIDE, SIDE, 3))
    linear = linear_of_lab(colours)
    dark, bright = (detail.crop_figures(factor * linear) for factor in (0.2, 1.0))
    for name, value in bright.items():
        assert dark[name] == pytest.approx(value, rel=1e-3), name
    assert lab(detail.with_mean_lightness(0.2 * linear))[..., 0].mean() == pytest.approx(60.0, abs=0.01)
    assert bright["hue"] == pytest.approx(np.degrees(np.arctan2(14.0, 12.0)), abs=0.5)


def test_page_states_the_figures(detail: Any) -> None:
    figures = {"hue": 50.0, "chroma": 18.0, **dict.fromkeys(detail.BANDS, 0.5)}
    other = figures | {detail.COMPARED_BANDS[0]: 0.4}
    results = {"adapter": "device", "atlas": 4096, "heads": {"human": other, detail.SCAN: figures}}
    texts = detail.page_texts(results)
    assert texts["figures"].count("| 0.50 | 0.50 |") == len(detail.BANDS) - 1
    assert texts["difference"] == "20 %"
