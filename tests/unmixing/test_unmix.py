"""Melanin and blood of known skins are recovered on the device and in float64."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.apps.inverse.unmixing.device_unmixer import Unmixer
from dermis.apps.inverse.unmixing.skin_model import (
    ExtraUnknown,
    inverse_variances,
    skin_model,
    solve_pigments,
)
from dermis.apps.inverse.unmixing.unmix import FractionChange, PigmentChange, parse_fraction_change, unmix
from dermis.base.errors import DermisError
from dermis.gpu import failures
from dermis.gpu.device import Device
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.optics.pigments.skin import spectral_medium
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

Floats = NDArray[np.float64]
Pixels = NDArray[np.float32]
SIDE = 48


def random_fractions(count: int, seed: int = 3) -> tuple[Floats, Floats]:
    random = np.random.default_rng(seed)
    return 10.0 ** random.uniform(-2.3, -0.5, count), 10.0 ** random.uniform(-2.7, -1.2, count)


def exact(melanin: float, blood: float) -> Floats:
    """Return the colour by diffusion at each wavelength, without a table."""
    medium = spectral_medium("dj2006", replace(DEFAULT_SKIN, melanin=melanin, blood=blood))
    total = diffusion_profile(medium, "layered", "layer").total
    return np.asarray((1.0 - normal_reflectance(1.4)) * total @ rgb_weights(WAVELENGTHS_NM).T)


@pytest.fixture(scope="module")
def colours() -> Pixels:
    """Return a synthetic colour map of skin."""
    m, b = random_fractions(SIDE * SIDE)
    return skin_model().colours(m, b).reshape(SIDE, SIDE, 3).astype(np.float32)


def test_known_skins_are_recovered_without_noise() -> None:
    m, b = random_fractions(24)
    found = solve_pigments(
        skin_model(), np.stack([exact(x, y) for x, y in zip(m, b, strict=True)]), relative_noise=1e-3
    )
    np.testing.assert_allclose(found.melanin, m, rtol=0.01)
    np.testing.assert_allclose(found.blood, b, rtol=0.02)
    np.testing.assert_allclose(found.residual, 1.0, atol=5e-3)


def test_errors_with_noise_match_the_stated_deviations() -> None:
    m, b = random_fractions(40)
    plain = skin_model().colours(m, b)
    random = np.random.default_rng(0)
    noisy = plain * (1.0 + 0.01 * random.standard_normal((60, *plain.shape)))
    found = solve_pigments(skin_model(), noisy.reshape(-1, 3), relative_noise=0.01)
    for known, one, sd in ((m, found.melanin, found.melanin_sd), (b, found.blood, found.blood_sd)):
        off = np.sqrt(((one.reshape(60, -1) - known) ** 2).mean(axis=0))
        ratio = np.median(off / np.median(sd.reshape(60, -1), axis=0))
        assert 0.75 < ratio < 1.25


def test_jacobian_matches_the_colours() -> None:
    for third in ("none", "oxygen", "shade"):
        model = skin_model(extra_unknown=third)
        x = np.random.default_rng(1).uniform(0.11, 0.89, (30, 3))
        log_colours, slopes = model.evaluate(x)
        for k in range(3):
            step = np.where(np.arange(3) == k, 1e-7, 0.0)
            off = (model.evaluate(x + step)[0] - log_colours) / 1e-7 - slopes[:, :, k]
            assert np.abs(off).max() < 1e-4 or (third == "none" and k == 2)


@pytest.mark.parametrize("third", ["none", "oxygen"])
def test_device_result_matches_float64(device: Device, colours: Pixels, third: ExtraUnknown) -> None:
    noisy = colours * (1.0 + 0.01 * np.random.default_rng(2).standard_normal(colours.shape))
    noisy = noisy.astype(np.float32)
    model = skin_model(extra_unknown=third)
    estimate, sd, residual = Unmixer(device, model, 0.01).unmix(noisy)
    twin = solve_pigments(model, noisy.reshape(-1, 3).astype(np.float64), 0.01)
    pairs = [
        (estimate[..., 0], twin.melanin),
        (estimate[..., 1], twin.blood),
        (estimate[..., 2], twin.extra_value),
    ]
    pairs += [(sd[..., 0], twin.melanin_sd), (sd[..., 1], twin.blood_sd)]
    for got, wanted in pairs:
        assert np.percentile(np.abs(got.ravel() - wanted) / (np.abs(wanted) + 1e-4), 99.0) < 2e-3
    cost = (inverse_variances(noisy.reshape(-1, 3), 0.01) * np.log(residual.reshape(-1, 3)) ** 2).sum(axis=1)
    least = (inverse_variances(noisy.reshape(-1, 3), 0.01) * np.log(twin.residual) ** 2).sum(axis=1)
    assert np.mean(cost > least + 0.1) < 2e-3


def test_invisible_blood_stays_at_its_prior() -> None:
    thick = replace(DEFAULT_SKIN, epidermis_mm=0.25)
    found = solve_pigments(skin_model(thick), skin_model(thick).colours(np.array([0.4]), np.array([0.1])))
    assert 0.005 < found.blood[0] < 0.03 and found.blood_sd[0] > found.blood[0]
    assert found.melanin[0] == pytest.approx(0.4, rel=0.02)


def test_oxygen_is_recovered_where_blood_is_visible() -> None:
    pale = replace(DEFAULT_SKIN, oxygen=0.4)
    colour = skin_model(pale).colours(np.array([0.01]), np.array([0.03]))
    fixed, free = (solve_pigments(skin_model(extra_unknown=one), colour) for one in ("none", "oxygen"))
    assert 0.35 < free.extra_value[0] < 0.6
    assert abs(np.log(free.residual)).max() < 0.3 * abs(np.log(fixed.residual)).max()


def test_recolouring_and_unmixing_are_inverse(
    colours: Pixels,
) -> None:
    found = unmix(colours, adapter="cpu")
    np.testing.assert_allclose(found.recoloured(PigmentChange(), "cpu"), colours, atol=1e-5)
    darker = unmix(found.recoloured(PigmentChange(melanin=FractionChange(2.0)), "cpu"), adapter="cpu")
    ratio = darker.melanin / found.melanin
    assert np.median(ratio) == pytest.approx(2.0, rel=0.01)
    assert np.median(darker.blood / found.blood) == pytest.approx(1.0, rel=0.02)
    cold = found.recoloured(PigmentChange(oxygen=0.2), "cpu")
    assert (cold[..., 0] < colours[..., 0]).mean() > 0.99  # blood without oxygen absorbs more red light


def test_recolouring_opens_no_further_device(colours: Pixels, monkeypatch: pytest.MonkeyPatch) -> None:
    found = unmix(colours[:4, :4], adapter="cpu")
    monkeypatch.setattr(failures, "open_device", None)
    assert found.recoloured(PigmentChange(), "cpu").shape == (4, 4, 3)


def test_a_larger_median_adds_and_a_smaller_one_multiplies() -> None:
    change = PigmentChange(melanin=FractionChange(median=0.2), blood=FractionChange(median=0.005))
    factors, added = change.scales_and_offsets(0.05, 0.01)
    np.testing.assert_allclose(factors, [1.0, 0.5, 1.0])
    np.testing.assert_allclose(added, [0.15, 0.0, 0.0])
    assert parse_fraction_change("--melanin", "x2") == FractionChange(factor=2.0) and parse_fraction_change(
        "--blood", "0.1"
    ) == FractionChange(median=0.1)
    for wrong in ("", "x", "2", "-0.1", "nan", "xnan", "x1e9"):
        with pytest.raises(DermisError, match="--melanin: expected"):
            parse_fraction_change("--melanin", wrong)


def test_residual_is_kept(colours: Pixels) -> None:
    painted = colours.copy()
    painted[10:20, 10:20] = (0.05, 0.4, 0.1)
    found = unmix(painted, adapter="cpu")
    again = found.recoloured(PigmentChange(blood=FractionChange(0.5)), "cpu")
    assert (again[12:18, 12:18, 1] > 3.0 * again[12:18, 12:18, 0]).all()
    assert found.summary()["skin"] < 1.0 - 90.0 / SIDE**2


def test_shading_is_estimated_and_removed() -> None:
    m, b = random_fractions(128 * 128)
    plain = skin_model().colours(0.02 + 0.2 * m, 0.01 + 0.1 * b).reshape(128, 128, 3)
    across = np.linspace(-0.3, 0.3, 128)
    light = np.exp(across[:, None] * np.cos(across))
    found = unmix(plain * light[..., None], shading=True, adapter="cpu")
    assert found.shading is not None
    off = np.log(found.shading / light)
    assert (off - off.mean()).std() < 0.25 * np.log(light).std()
    kept = unmix(plain * light[..., None], adapter="cpu")
    true = (0.02 + 0.2 * m).reshape(128, 128)
    error, before = (np.median(np.abs(one.melanin / true - 1.0)) for one in (found, kept))
    assert error < 0.5 * before


@pytest.mark.parametrize(
    ("picture", "expected"),
    [
        (np.zeros((4, 4)), "floats \\(h, w, 3\\)"),
        (np.zeros((4, 4, 3), np.uint8), "floats \\(h, w, 3\\)"),
        (np.full((4, 4, 3), 2.0), "reflectances from 0 to 1"),
        (np.full((4, 4, 3), np.nan), "reflectances from 0 to 1"),
    ],
)
def test_other_pictures_are_refused(picture: NDArray[np.float64], expected: str) -> None:
    with pytest.raises(DermisError, match=f"colours: expected {expected}"):
        unmix(picture, adapter="cpu")


def test_black_maps_have_no_skin() -> None:
    found = unmix(np.zeros((8, 8, 3)), adapter="cpu")
    assert found.summary() == {"texels": 64, "skin": 0.0}
    assert all(np.isfinite(one).all() for one in found.maps().values())
