"""Options of spectra and lamps: combinations that are refused, and the bands that follow from them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dermis
from dermis.base.errors import DermisError, DermisWarning
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
    assert SpectralOptions("660,").bands == [660.0]


def test_bands_end_where_the_camera_sees_nothing_or_the_lamp_is_unknown(tmp_path: Path) -> None:
    """A tail at 741 nm needs a band at 750 nm; D65 is known to 780 nm."""
    camera = tmp_path / "camera.csv"
    for last, count, notes in ((720, 31, 0), (741, 36, 0), (780, 39, 0), (900, 39, 1)):
        camera.write_text("".join(f"{nm},1,1,{float(nm <= last)}\n" for nm in range(400, last + 1)))
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            options = SpectralOptions(camera_sensitivity=camera)
            assert options.bands == count
        assert len(found) == notes, last
        if notes:
            assert "the power of D65 is known from 380 to 780 nm only" in str(found[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DermisWarning)
        check(options, PNG)


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


def test_a_tone_curve_of_a_scene_file_is_refused() -> None:
    """Before anything is rendered; it would be left out silently."""
    settings = dermis.Settings(tone="filmic")
    with pytest.raises(
        DermisError, match=r"--tone: expected none with spectra, but got filmic\. Add --tone none"
    ):
        SpectralOptions(light_spectrum="A").render(None, None, settings, PNG)  # type: ignore[arg-type]


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
