"""Options of spectra and lamps: combinations that are refused, and the bands that follow from them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.cli.spectral_options import SpectralOptions

EXR, PNG = Path("cube.exr"), Path("face.png")


def check(
    options: SpectralOptions, output: Path = EXR, outputs: bool = False, json: bool = False, **given: Any
) -> None:
    options.check(output, given, outputs, json)


def test_bands_by_number_and_by_wavelength(tmp_path: Path) -> None:
    assert SpectralOptions("31").bands == 31 and SpectralOptions("730,805").bands == [730.0, 805.0]
    assert SpectralOptions(light_spectrum="A").bands == 31
    night = tmp_path / "night.csv"
    night.write_text("".join(f"{nm},1,1,{float(nm < 800)}\n" for nm in range(400, 1001, 10)))
    assert SpectralOptions(light_spectrum="A", camera_sensitivity=night).bands == 61


@pytest.mark.parametrize(
    ("options", "extra", "message"),
    [
        (SpectralOptions("31"), {"output": PNG}, "an .exr file with --spectral"),
        (SpectralOptions("31"), {"outputs": True}, "--outputs"),
        (SpectralOptions("31"), {"json": True}, "--json"),
        (SpectralOptions("61"), {}, "up to 780 nm"),
        (SpectralOptions("62", "A"), {}, "from 1 to 61"),
        (SpectralOptions("red"), {}, "a number of bands"),
        (SpectralOptions("500,400"), {}, "wavelengths that increase"),
        (SpectralOptions(light_spectrum="D50"), {"output": PNG}, "one of D65, A, FL11, LED-B3, E"),
        (SpectralOptions(light_spectrum="A"), {"output": PNG, "tone": "filmic"}, "--tone"),
        (SpectralOptions("31", None, Path("camera.csv")), {}, "--camera-sensitivity is given too"),
    ],
)
def test_combinations_that_are_refused(options: SpectralOptions, extra: dict[str, Any], message: str) -> None:
    with pytest.raises(DermisError, match=message):
        check(options, **extra)


def test_damaged_sensitivities_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "camera.csv"
    for text in (
        "400,1,1\n500,1,1\n",
        "500,1,1,1\n400,1,1,1\n",
        "400,-1,1,1\n500,1,1,1\n",
        "",
        "400,0,0,0\n600,0,0,0\n",
    ):
        file.write_text(text)
        with pytest.raises(DermisError, match=r"camera\.csv"):
            check(SpectralOptions(camera_sensitivity=file), PNG)
    rng = np.random.default_rng(0).random((31, 3))
    file.write_text("".join(f"{400 + 10 * k},{r},{g},{b}\n" for k, (r, g, b) in enumerate(rng)))
    check(SpectralOptions(camera_sensitivity=file), PNG)
