"""Sums of Gaussians: the published one, their energy, and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tolerances import PUBLISHED

from dermis.errors import DermisError
from dermis.optics.gaussians import GaussianSum, load_profile, preset_names

HEADER = "variance_mm2,red,green,blue\n"


def gaussians(variance: list[float], weight: list[list[float]]) -> GaussianSum:
    return GaussianSum("test", np.array(variance, float), np.array(weight, float))


def test_published_weights_sum_to_one() -> None:
    """They are printed to three digits, and white light stays white."""
    assert np.allclose(load_profile("gpu-gems-3").albedo, 1.0, atol=1e-12)


def test_published_profile_at_every_radius(sample_folder: Path) -> None:
    path = sample_folder / "reference" / "data" / "gpugems3_six_gaussian_profile.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    assert len(table) > 100
    computed = load_profile("gpu-gems-3").radiant_exitance(table[:, 0])
    assert np.allclose(computed, table[:, 1:], rtol=PUBLISHED, atol=1e-14)


@pytest.mark.parametrize("name", preset_names())
def test_integral_over_the_plane_is_the_albedo(name: str) -> None:
    profile = load_profile(name)
    s = (np.arange(4000) + 0.5) / 4000
    radius = 25.0 * s**2  # close together where the profile is steep
    rings = 2 * np.pi * radius * (50.0 * s) / 4000
    assert np.allclose(rings @ profile.radiant_exitance(radius), profile.albedo, rtol=1e-5)


def test_one_gaussian_by_hand() -> None:
    one = gaussians([4.0], [[1.0, 0.5, 0.25]])
    peak = 1 / (8 * np.pi)
    assert np.allclose(one.radiant_exitance(0.0), peak * np.array([1.0, 0.5, 0.25]))
    assert np.allclose(one.radiant_exitance([[0.0], [2.0]])[1, 0, 0], peak * np.exp(-0.5))


@pytest.mark.parametrize(
    ("variance", "weight", "said"),
    [
        ([1.0, 0.5], [[1, 1, 1], [1, 1, 1]], "increase"),
        ([1.0, 1.0], [[1, 1, 1], [1, 1, 1]], "increase"),
        ([0.0], [[1, 1, 1]], "above 0"),
        ([-1.0], [[1, 1, 1]], "above 0"),
        ([np.nan], [[1, 1, 1]], "finite"),
        ([1.0], [[1, np.inf, 1]], "finite"),
        ([1.0], [[1, -0.1, 1]], "weights of 0 or more"),
        ([1.0], [[1, 0, 1]], "weights of 0 or more"),
        ([1.0, 2.0], [[1, 1, 1]], "k x 3"),
        ([1.0], [[1, 1]], "k x 3"),
        ([], [], "k x 3"),
    ],
)
def test_impossible_sums_are_refused(variance: list[float], weight: list[list[float]], said: str) -> None:
    with pytest.raises(DermisError, match=said):
        gaussians(variance, weight)


def test_file_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    path.write_text(f"# unit: mm2\n{HEADER}\n0.25, 0.5, 0.25, 0.125\n 1e0,0.5,0.75,0.875\n")
    profile = load_profile(path)
    assert profile.variance_mm2.tolist() == [0.25, 1.0]
    assert profile.weight.tolist() == [[0.5, 0.25, 0.125], [0.5, 0.75, 0.875]]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "# only a comment\n",
        HEADER,
        "r,g,b\n1,2,3\n",
        "0.5,1,1,1\n",
        f"{HEADER}0.5,1,1\n",
        f"{HEADER}0.5,1,1,1,1\n",
        f"{HEADER}0.5,1,1,1\n0.6,1\n",
        f"{HEADER}0.5,one,1,1\n",
        f"{HEADER}nan,1,1,1\n",
        f"{HEADER}2,1,1,1\n1,1,1,1\n",
    ],
)
def test_bad_files_name_themselves(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(DermisError, match=r"bad\.csv"):
        load_profile(path)


def test_a_binary_file_is_no_profile(tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_bytes(b"\xff\xfe\x00\x80" * 20)
    with pytest.raises(DermisError, match=r"bad\.csv"):
        load_profile(path)


def test_unknown_names_list_the_presets(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match=r"no-such-skin.*gpu-gems-3"):
        load_profile("no-such-skin")
    with pytest.raises(DermisError, match="preset"):
        load_profile(tmp_path)


def test_more_gaussians_than_the_frame_takes_are_refused(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.1 * k},0.1,0.1,0.1" for k in range(1, 18))
    (tmp_path / "many.csv").write_text(f"variance_mm2,red,green,blue\n{rows}\n", encoding="utf-8")
    with pytest.raises(DermisError, match="at most 16 Gaussians"):
        load_profile(tmp_path / "many.csv")
