"""Stages of the camera model against statistics, exactly interpolated pictures, rays and fixed points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_head import write_head

import dermis
from dermis.apps.batch.lighting import blackbody_colour, light_colour
from dermis.apps.batch.sensor.colour_filter_array import DEMOSAICING, mosaic
from dermis.apps.batch.sensor.noise import noisy_signal
from dermis.apps.batch.sensor.tone_curve import compress_highlights, phone_levels
from dermis.base.errors import DermisError
from dermis.dataset import Sensor, photograph
from dermis.images.colour import encode_srgb, encode_srgb8

GREY = 0.18


def picture(height: int = 24, width: int = 36, seed: int = 0) -> Any:
    return np.random.default_rng(seed).uniform(0, 1, (height, width, 3)).astype(np.float32)


def card(colour: Any, level: float = GREY, size: tuple[int, int] = (8, 8)) -> Any:
    """Return a picture of a grey card in light of a colour."""
    return np.full((*size, 3), level, np.float32) * np.asarray(colour, np.float32)


def test_defaults_leave_pictures_unchanged() -> None:
    seen = picture()
    found = photograph(seen, Sensor())
    levels = encode_srgb8(seen)
    assert np.abs(found.picture.astype(int) - levels).max() <= 1  # two matrices in single precision
    assert (found.picture != levels).mean() < 0.01
    assert found.clipped_fraction == 0
    np.testing.assert_allclose(found.white, 1, atol=1e-9)


@pytest.mark.parametrize(("electrons", "read_noise"), [(2000.0, 0.0), (2000.0, 8.0), (300.0, 3.0)])
def test_variance_and_mean_are_on_the_photon_transfer_line(electrons: float, read_noise: float) -> None:
    """Check at all exposures that the variance is the mean plus the squared read noise, in electrons."""
    levels = np.linspace(0.02, 0.9, 12)
    rng = np.random.default_rng(1)
    samples = noisy_signal(np.tile(levels, (40_000, 1)), 2.0, electrons, read_noise, rng) * electrons / 2.0
    means, variances = samples.mean(axis=0), samples.var(axis=0)
    np.testing.assert_allclose(means, levels * electrons / 2.0, rtol=0.02)
    np.testing.assert_allclose(variances, means + read_noise**2, rtol=0.04)


def test_noise_grows_with_the_iso_by_the_number_of_electrons() -> None:
    """Four times the ISO measures a quarter of the electrons, so shot noise doubles."""
    grey = card(1, size=(128, 128))
    deviations = []
    for iso in (400, 1600):
        levels = photograph(grey, Sensor(iso=iso, read_noise_electrons=0), seed=5).picture
        deviations.append(levels[..., 1].std())
    assert deviations[1] / deviations[0] == pytest.approx(2, rel=0.05)


def test_equal_seeds_give_equal_noise() -> None:
    seen, sensor = picture(), Sensor(iso=1600, demosaicing="malvar", jpeg_quality=80)
    first, again, other = (photograph(seen, sensor, seed=seed).picture for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert (first != other).mean() > 0.5


@pytest.mark.parametrize("method", sorted(DEMOSAICING))
def test_demosaicing_is_exact_for_constant_and_linear_pictures(method: str) -> None:
    colours = np.array([0.7, 0.3, 0.1], np.float32)
    flat = np.broadcast_to(colours, (9, 12, 3)).astype(np.float32)
    np.testing.assert_allclose(DEMOSAICING[method](mosaic(flat)), flat, atol=1e-6)
    y, x = np.mgrid[:11, :14].astype(np.float32)
    ramp = np.stack([0.02 * x + 0.03 * y + offset for offset in (0.1, 0.1, 0.1)], axis=-1)
    np.testing.assert_allclose(DEMOSAICING[method](mosaic(ramp))[2:-2, 2:-2], ramp[2:-2, 2:-2], atol=1e-6)


def test_linear_channels_with_different_slopes_are_exact() -> None:
    """The gradients that correct other colours are second differences, which are 0 in linear pictures."""
    y, x = np.mgrid[:12, :12].astype(np.float32)
    ramp = np.stack([0.02 * x, 0.5 - 0.01 * y, 0.03 * (x + y)], axis=-1)
    for demosaic in DEMOSAICING.values():
        np.testing.assert_allclose(demosaic(mosaic(ramp))[2:-2, 2:-2], ramp[2:-2, 2:-2], atol=1e-6)


def test_malvar_interpolates_fine_grey_patterns_better() -> None:
    """By 4 dB or more; the publication finds 5.5 dB for photographs."""
    y, x = np.mgrid[:64, :64]
    pattern = (0.5 + 0.2 * np.sin(0.9 * x + 0.3 * y) + 0.2 * np.cos(0.5 * x - 0.8 * y)).astype(np.float32)
    grey = np.repeat(pattern[..., None], 3, axis=2)
    errors = {name: ((one(mosaic(grey)) - grey) ** 2).mean() for name, one in DEMOSAICING.items()}
    assert 10 * np.log10(errors["bilinear"] / errors["malvar"]) > 4


def test_pixels_keep_the_colour_of_their_own_filter() -> None:
    seen = picture()
    for demosaic in DEMOSAICING.values():
        np.testing.assert_array_equal(mosaic(demosaic(mosaic(seen))), mosaic(seen))


@pytest.mark.parametrize("kelvin", [1700, 1800, 2800, 6500, 15_000])
def test_a_grey_card_in_balanced_light_is_grey(kelvin: float) -> None:
    light = blackbody_colour(kelvin)
    for sensor in (Sensor(white_balance="lights"), Sensor(white_kelvin=kelvin)):
        found = photograph(card(light), sensor, light_colour=light)
        assert np.unique(found.picture).tolist() == [int(encode_srgb8(GREY))]
        np.testing.assert_allclose(found.white, light, atol=1e-6)


def test_errors_of_the_white_balance_have_the_stated_directions() -> None:
    bluer, redder, greener = (
        photograph(card(1), sensor).picture[0, 0].astype(int)
        for sensor in (
            Sensor(white_error_mired=40),
            Sensor(white_error_mired=-40),
            Sensor(tint_error_stops=0.3),
        )
    )
    assert bluer[2] > bluer[0] + 10 and redder[0] > redder[2] + 10
    assert greener[1] > greener[[0, 2]].max() + 5


def test_overexposed_white_in_warm_light_is_white_and_is_counted() -> None:
    light = np.array(blackbody_colour(1800))
    seen = card(light, 0.2)
    seen[:2] = 6 * light
    found = photograph(seen, Sensor(white_balance="lights"), light_colour=light)
    assert (found.picture[:2] == 255).all() and found.clipped_fraction == pytest.approx(0.25)


def test_vignetting_is_the_fourth_power_of_the_cosine_of_rays() -> None:
    """Rays are those of a camera's inverse projection, in three dimensions."""
    camera = dermis.Camera(position=(0, 0, 300), frame_mm=400, principal_point=(0.4, 0.6))
    K = camera.to_opencv((48, 32)).K
    y, x = np.mgrid[:32, :48]
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(K).T
    cosines = rays[..., 2] / np.linalg.norm(rays, axis=-1)
    for strength in (1.0, 2.5):
        found = photograph(np.ones((32, 48, 3)), Sensor(vignetting=strength), K=K).picture[..., 1]
        expected = encode_srgb8(cosines ** (4 * strength))
        assert np.abs(found.astype(int) - expected).max() <= 1
        assert found.min() < 200


@pytest.mark.parametrize(("contrast", "shoulder"), [(1.0, 0.0), (1.3, 0.5), (0.7, 0.9), (2.0, 0.2)])
def test_the_phone_curve_is_smooth_increasing_and_complete(contrast: float, shoulder: float) -> None:
    light = np.linspace(0, 4, 40_001)
    levels = phone_levels(light, contrast, shoulder, 4.0).astype(np.float64)
    assert (np.diff(levels) >= -1e-7).all()
    assert levels[0] == 0 and levels[-1] == pytest.approx(1, abs=1e-6)
    assert phone_levels(np.array([GREY]), contrast, min(shoulder, 0.8), 4.0) == pytest.approx(
        float(encode_srgb(GREY)), abs=1e-6
    )
    if contrast == 1.0:
        np.testing.assert_allclose(levels, encode_srgb(np.minimum(light, 1.0)), atol=1e-6)


def test_the_shoulder_begins_with_the_slope_of_the_light_and_ends_at_saturation() -> None:
    light = np.array([0.4999, 0.5, 0.5001, 3.9999, 4.0, 9.0])
    found = compress_highlights(light, 0.5, 4.0)
    assert np.diff(found)[1] / np.diff(light)[1] == pytest.approx(1, abs=1e-3)
    np.testing.assert_allclose(found[[0, 1, 4, 5]], [0.4999, 0.5, 1, 1], atol=1e-9)


def test_contrast_is_the_relative_slope_at_middle_grey() -> None:
    light = np.array([GREY - 1e-4, GREY + 1e-4])
    slopes = [float(np.diff(phone_levels(light, c, 0.0, 1.0).astype(np.float64))[0]) for c in (1.0, 1.5)]
    assert slopes[1] / slopes[0] == pytest.approx(1.5, rel=1e-2)


def test_quality_of_jpeg_limits_the_error() -> None:
    y, x = np.mgrid[:64, :64] / 64
    seen = np.stack([x, y, 0.5 * x + 0.5 * y], axis=-1).astype(np.float32)
    seen[20:40, 20:40] = [0.8, 0.1, 0.1]
    exact = photograph(seen, Sensor()).picture.astype(int)
    errors = [np.abs(photograph(seen, Sensor(jpeg_quality=q)).picture - exact).mean() for q in (100, 75, 20)]
    assert 0 < errors[0] < errors[1] < errors[2] < 20
    np.testing.assert_array_equal(photograph(seen, Sensor(jpeg_quality=0.3)).picture, exact)


def test_light_of_a_scene_is_the_sum_of_its_lights(tmp_path: Path) -> None:
    scene = dermis.Scene(
        dermis.load_head(write_head(tmp_path / "head.obj")),
        lights=(
            dermis.DirectionalLight((0, 0, -1), irradiance=(2, 1, 0)),
            dermis.PointLight((0, 0, 900), irradiance=(0, 1, 2)),
        ),
        camera=dermis.Camera(position=(0, 0, 900)),
    )
    np.testing.assert_allclose(light_colour(scene), 1, atol=1e-9)
    warm = scene.replace(environment=dermis.Environment("uniform"), lights=scene.lights[:1])
    red, green, blue = light_colour(warm)
    expected = (np.array([2, 1]) + np.pi) / np.pi
    np.testing.assert_allclose([red / blue, green / blue], expected, rtol=1e-5)


@pytest.mark.parametrize(
    ("seen", "sensor", "message"),
    [
        (np.zeros((4, 4, 3), np.uint8), Sensor(), "picture: expected a linear picture"),
        (np.zeros((4, 4)), Sensor(), "picture: expected a linear picture"),
        (np.full((4, 4, 3), np.nan), Sensor(), "picture: expected light up to"),
        (np.zeros((1, 4, 3)), Sensor(demosaicing="malvar"), "picture: expected 2 x 2 pixels"),
        (np.zeros((4, 4, 3)), Sensor(vignetting=1), "K: expected the intrinsic matrix"),
        (np.zeros((4, 4, 3)), Sensor(white_balance="lights"), "light_colour: expected the colour"),
    ],
)
def test_missing_and_invalid_arguments_are_refused(seen: Any, sensor: Sensor, message: str) -> None:
    with pytest.raises(DermisError, match=message):
        photograph(seen, sensor)
