"""Tissue by name and file, and its Gaussians."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.base.reading import read_toml
from dermis.optics.pigments.spectra import WAVELENGTHS_NM
from dermis.optics.profiles import find_gaussians, load_profile, preset_names, write_profile
from dermis.optics.tissue import load_tissue, tissue_names

SKIN = "[skin]\nstructure = 'biospec'\nmelanin = 0.03\n"


def test_names_cover_media_and_skins() -> None:
    assert {"dj3", "skin1", "spectral", "light", "medium", "dark"} <= set(tissue_names())
    assert preset_names()[0] == "gpu-gems-3"


@pytest.mark.parametrize("name", tissue_names())
def test_every_name_gives_a_profile_of_skin_like_size(name: str) -> None:
    profile = load_profile(name)
    assert profile.weight.shape == (6, 3)
    assert load_profile(name) is profile  # computed once
    total = load_tissue(name).profile().total
    assert profile.albedo == pytest.approx(total, rel=0.1)


def test_spectra_become_colour() -> None:
    tissue = load_tissue("light")
    assert tissue.medium.channels == len(WAVELENGTHS_NM) and tissue.rgb is not None
    profile = tissue.profile()
    assert profile.incident and profile.reflectance.shape[1] == 3
    per_wavelength = [load_tissue("light").medium.channel(i) for i in (0, 15, 30)]
    assert [one.channels for one in per_wavelength] == [1, 1, 1]


def test_pigments_replace_those_of_the_name() -> None:
    plain, blushed = (load_tissue("light", pigments=p).profile().total for p in ({}, {"blood": 0.03}))
    assert blushed[1] < 0.9 * plain[1] and blushed[0] > 0.8 * plain[0]


def test_skin_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(SKIN)
    tissue = load_tissue(path, pigments={"blood": 0.02})
    assert tissue.medium.name == "own" and tissue.medium.layers[0].name == "stratum corneum"
    assert tissue.parameters is not None
    assert (tissue.parameters.melanin, tissue.parameters.blood) == (0.03, 0.02)
    assert find_gaussians(path) is None
    assert load_profile(path).weight.shape == (6, 3)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (SKIN + "colour = 1\n", "got colour"),
        (SKIN + "blood = 'red'\n", "blood: expected a number .*got 'red'"),
        (SKIN + "oxygen = true\n", "oxygen: expected a number .*got True"),
        (SKIN.replace("biospec", "bark"), "a structure of dj2006.*got 'bark'"),
        (SKIN.replace("0.03", "3"), "--melanin"),
        ("eta = 1\n" + SKIN, "only a table .skin. and a name"),
        ("skin = 4", "a table .skin."),
    ],
)
def test_skin_files_that_are_refused(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "own.toml"
    path.write_text(text)
    with pytest.raises(DermisError, match=complaint):
        load_tissue(path)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("variances_mm2 = [1.0]\n", "weights: expected n x 3 numbers from 0 to 100"),
        ("variances_mm2 = [1.0]\nweights = 'x'\n", "weights: expected n x 3 numbers from 0 to 100"),
        ("variances_mm2 = [1.0]\nweights = [[1, 1]]\n", "n x 3 numbers"),
        ("variances_mm2 = [1.0, 0.5]\nweights = [[1, 1, 1], [1, 1, 1]]\n", "that increase"),
        ("variances_mm2 = [nan]\nweights = [[1, 1, 1]]\n", "n numbers from 0"),
    ],
)
def test_saved_profiles_that_are_refused(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "own.toml"
    path.write_text(text)
    with pytest.raises(DermisError, match=complaint):
        load_profile(path)


def test_numbers_of_numpy_are_written_as_numbers(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    profile = load_profile("gpu-gems-3")
    write_profile(path, profile, {"eta": np.float64(1.4), "total": profile.albedo, "layers": ["a 'b'"]})
    assert read_toml(path)["eta"] == 1.4 and read_toml(path)["layers"] == ["a 'b'"]
    assert load_profile(path).weight.tolist() == profile.weight.tolist()


def test_pigments_need_a_skin() -> None:
    with pytest.raises(DermisError, match=r"--blood: .*got dj3"):
        load_tissue("dj3", pigments={"blood": 0.1})


def test_wavelengths_add_up_to_the_total() -> None:
    """The colour of the sum is the sum of the colours."""
    tissue = load_tissue("medium")
    assert tissue.rgb is not None
    each = np.array([tissue.medium.channel(i) for i in range(tissue.medium.channels)], dtype=object)
    from dermis.optics.diffusion.boundary import normal_reflectance
    from dermis.optics.diffusion.models import diffusion_profile

    spectrum = np.array([diffusion_profile(one).total[0] for one in each])
    entering = 1.0 - normal_reflectance(1.4)
    assert tissue.profile().total == pytest.approx(entering * tissue.rgb @ spectrum, rel=1e-9)


def test_a_tissue_prints_on_three_lines() -> None:
    lines = repr(load_tissue("dj3")).splitlines()
    assert len(lines) == 3 and lines[0] == "Tissue dj3: red, green, blue, index of refraction 1.4"
    assert lines[1] == "  epidermis 0.25 mm, upper dermis 0.2 mm, bloody dermis (semi-infinite)"
    assert "0.0085 to 2.5 /mm" in lines[2]
    assert repr(load_tissue("light")).startswith("Tissue light: 31 wavelengths")
