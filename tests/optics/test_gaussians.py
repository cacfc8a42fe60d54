"""Sums of Gaussians: the published one, their energy, and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, trapezoid
from scipy.special import j0
from tolerances import CLOSED_FORM, PUBLISHED

from dermis.base.errors import DermisError
from dermis.optics.gaussians import MAX_GAUSSIANS, GaussianSum
from dermis.optics.profiles import load_profile

STEADY = settings(derandomize=True, max_examples=40, deadline=None, database=None)
HEADER = "variance_mm2,red,green,blue\n"


def gaussians(variance: list[float], weight: list[list[float]]) -> GaussianSum:
    return GaussianSum("test", np.array(variance, float), np.array(weight, float))


@st.composite
def sums(draw: st.DrawFn, most: int = 4) -> GaussianSum:
    """Draw sums of a few Gaussians, 1e-4 to 100 mm2 wide, in two channels."""
    log_variance = draw(st.lists(st.integers(-40, 20), min_size=1, max_size=most, unique=True))
    weight = st.floats(0.0, 1.0, allow_subnormal=False)
    rows = [[draw(weight), draw(weight)] for _ in log_variance]
    rows[0] = [value + 0.01 for value in rows[0]]
    return gaussians([10.0 ** (x / 10.0) for x in sorted(log_variance)], rows)


def test_published_weights_sum_to_one() -> None:
    """Weights are printed to three digits, and white light stays white."""
    assert np.allclose(load_profile("gpu-gems-3").albedo, 1.0, atol=1e-12)


def test_published_profile_at_every_radius(sample_folder: Path) -> None:
    path = sample_folder / "reference" / "data" / "gpugems3_six_gaussian_profile.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    assert len(table) > 100
    computed = load_profile("gpu-gems-3").radiant_exitance(table[:, 0])
    assert np.allclose(computed, table[:, 1:], rtol=PUBLISHED, atol=1e-14)


def test_integral_over_the_plane_is_the_albedo() -> None:
    profile = load_profile("gpu-gems-3")
    s = (np.arange(4000) + 0.5) / 4000
    radius = 25.0 * s**2  # close together where the profile is steep
    rings = 2 * np.pi * radius * (50.0 * s) / 4000
    assert np.allclose(rings @ profile.radiant_exitance(radius), profile.albedo, rtol=1e-5)


@STEADY
@given(sums(), st.floats(1e-3, 30.0))
def test_light_within_a_radius_is_the_integral(profile: GaussianSum, radius: float) -> None:
    # Logarithmic steps: the narrowest Gaussian is a thousand times narrower than the widest.
    r = np.geomspace(1e-6, radius, 3000)
    rate = 2 * np.pi * r[:, None] ** 2 * profile.radiant_exitance(r)
    assert np.allclose(trapezoid(rate, np.log(r), axis=0), profile.energy_within(radius), atol=1e-5)


@STEADY
@given(sums())
def test_all_light_leaves_somewhere(profile: GaussianSum) -> None:
    assert np.allclose(profile.energy_within(1e4), profile.albedo, rtol=1e-12)
    assert np.allclose(profile.hankel(0.0), profile.albedo, rtol=1e-12)


def test_inner_product_and_transform_by_quadrature() -> None:
    a = gaussians([0.1, 2.0], [[0.3, 0.1], [0.5, 0.2]])
    b = gaussians([0.5], [[0.7, 0.9]])
    for i in range(2):
        product = quad(lambda r, i=i: r * a.radiant_exitance(r)[i] * b.radiant_exitance(r)[i], 0, 20)[0]
        assert a.inner_product(b)[i] == pytest.approx(product, rel=CLOSED_FORM)
        wave = quad(
            lambda r, i=i: 2 * np.pi * r * a.radiant_exitance(r)[i] * j0(1.5 * r), 0, 20, epsabs=1e-10
        )[0]
        assert a.hankel(1.5)[i] == pytest.approx(wave, rel=CLOSED_FORM)


def test_more_than_a_frame_takes_is_refused() -> None:
    with pytest.raises(DermisError, match="at most 24"):
        gaussians([0.1 * (1 + k) for k in range(25)], [[0.1]] * 25)


def test_one_gaussian_by_hand() -> None:
    one = gaussians([4.0], [[1.0, 0.5, 0.25]])
    peak = 1 / (8 * np.pi)
    assert np.allclose(one.radiant_exitance(0.0), peak * np.array([1.0, 0.5, 0.25]))
    assert np.allclose(one.radiant_exitance([[0.0], [2.0]])[1, 0, 0], peak * np.exp(-0.5))


@pytest.mark.parametrize(
    ("variance", "weight", "message"),
    [
        ([1.0, 0.5], [[1, 1, 1], [1, 1, 1]], "increase"),
        ([1.0, 1.0], [[1, 1, 1], [1, 1, 1]], "increase"),
        ([0.0], [[1, 1, 1]], "from 1e-12 mm2"),
        ([-1.0], [[1, 1, 1]], "from 1e-12 mm2"),
        ([np.nan], [[1, 1, 1]], "finite"),
        ([1.0], [[1, np.inf, 1]], "finite"),
        ([1.0], [[1, -0.1, 1]], "weights of 0 or more"),
        ([1.0], [[1, 0, 1]], "weights of 0 or more"),
        ([1.0, 2.0], [[1, 1, 1]], "k x c"),
        ([1.0], [[]], "k x c"),
        ([], [], "k x c"),
    ],
)
def test_impossible_sums_are_refused(variance: list[float], weight: list[list[float]], message: str) -> None:
    with pytest.raises(DermisError, match=message):
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
    with pytest.raises(DermisError, match="is not a regular file"):
        load_profile(tmp_path)


def test_more_gaussians_than_the_frame_takes_are_refused(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.1 * k},0.1,0.1,0.1" for k in range(1, MAX_GAUSSIANS + 2))
    (tmp_path / "many.csv").write_text(f"variance_mm2,red,green,blue\n{rows}\n", encoding="utf-8")
    with pytest.raises(DermisError, match="at most 24 Gaussians"):
        load_profile(tmp_path / "many.csv")
