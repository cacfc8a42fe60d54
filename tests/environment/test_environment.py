"""Panoramas: texel directions, sun-like peaks, and prefiltering compared with direct sums."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tolerances import PREFILTERED

from dermis.base.errors import DermisError, DermisWarning
from dermis.environment.harmonics import analyse_panorama, synthesise_panoramas, zonal_factors
from dermis.environment.panorama import (
    load_panorama,
    mean_radiance,
    panorama_file,
    resample_panorama,
    split_suns,
    texel_directions,
    texel_solid_angles,
)
from dermis.environment.prefilter import (
    LAYER_HEIGHT,
    LAYER_ROUGHNESSES,
    isotropic_lobe,
    isotropic_lobe_factors,
    prefilter,
)
from dermis.images.colour import luminance
from dermis.images.io import write_exr, write_png

Floats = NDArray[np.float64]


def room(height: int = 128) -> Floats:
    """Return a dim room with a bright window and a coloured floor."""
    towards = texel_directions(height, 2 * height)
    radiance = 0.3 + 0.2 * towards * [1, 0.5, -0.5]
    radiance[towards[..., 0] > 0.9] += [4.0, 5.0, 6.0]
    radiance[towards[..., 1] < -0.5] *= [1.5, 0.8, 0.4]
    return radiance


def with_lamp(radiance: Floats, towards: tuple[float, float, float], strength: float) -> Floats:
    """Return the panorama with a lamp of 2 degrees radius."""
    unit = np.array(towards) / np.linalg.norm(towards)
    lit = radiance.copy()
    lit[texel_directions(*radiance.shape[:2]) @ unit > np.cos(np.radians(2.0))] += strength * np.array(
        [1.0, 0.8, 0.5]
    )
    return lit


def summed(radiance: Floats, normal: Floats, weight: Floats) -> Floats:
    """Return the integral (3,) of radiance times a weight per texel."""
    area = texel_solid_angles(*radiance.shape[:2])
    return np.asarray((radiance * (weight * area)[..., None]).sum(axis=(0, 1)))


def test_the_middle_lies_behind_the_head_and_the_right_at_its_left() -> None:
    towards = texel_directions(64, 128)
    assert np.allclose(np.linalg.norm(towards, axis=-1), 1.0)
    assert np.allclose(towards[31:33, 63:65].mean(axis=(0, 1)), [0, 0, -1], atol=1e-3)
    assert towards[32, 96] @ [1, 0, 0] > 0.999 and towards[0, 0, 1] > 0.999
    assert texel_solid_angles(64, 128).sum() * 128 == pytest.approx(4 * np.pi)


@pytest.mark.parametrize("height", [64, 100, 128, 300])
def test_resampling_keeps_the_light(height: int) -> None:
    """Check the mean radiance and the mean of radiance times direction."""
    radiance = with_lamp(room(), (0.3, 0.8, 0.2), 50.0)
    made = resample_panorama(radiance.astype(np.float32), height)
    assert made.shape == (height, 2 * height, 3)
    assert np.allclose(mean_radiance(made), mean_radiance(radiance), rtol=1e-6)
    for axis in range(3):
        pull, exact = (
            mean_radiance(part * texel_directions(*part.shape[:2])[..., axis, None])
            for part in (made, radiance)
        )
        assert np.abs(pull - exact).max() < 2e-3 * mean_radiance(radiance).max()
    assert np.array_equal(resample_panorama(made, height), made)


@pytest.mark.parametrize(("height", "kept"), [(1, 256), (127, 256), (300, 300), (521, 512)])
def test_any_size_is_accepted(tmp_path: Path, height: int, kept: int) -> None:
    """Check a prime number of rows, and two texels."""
    pixels = np.random.default_rng(height).uniform(0, 2, (height, 2 * height, 3)).astype(np.float32)
    write_exr(tmp_path / "sky.exr", pixels)
    made = load_panorama(str(tmp_path / "sky.exr"))
    assert made.shape == (kept, 2 * kept, 3)
    assert np.allclose(mean_radiance(made), mean_radiance(pixels.astype(float)), rtol=1e-6)


def test_a_lamp_becomes_a_sun_and_no_light_is_lost() -> None:
    radiance = with_lamp(with_lamp(room(), (0.3, 0.8, 0.2), 5000.0), (-1, 0.5, 1), 900.0)
    rest, suns = split_suns(radiance)
    assert len(suns) == 2
    assert suns[0].irradiance.sum() > suns[1].irradiance.sum()
    for sun, towards in zip(suns, [(0.3, 0.8, 0.2), (-1, 0.5, 1)], strict=True):
        assert sun.direction @ towards / np.linalg.norm(towards) > np.cos(np.radians(0.5))
        assert np.degrees(sun.radius) == pytest.approx(2.0, abs=0.5)
    whole, left = (4 * np.pi * mean_radiance(part) for part in (radiance, rest))
    assert np.allclose(left + sum(sun.irradiance for sun in suns), whole, rtol=1e-9)
    assert rest.min() > 0 and (rest <= radiance + 1e-12).all()
    assert luminance(rest).max() < luminance(radiance).max() / 10


def test_bright_stars_do_not_prevent_a_sun() -> None:
    """Check that suns are selected by irradiance, not by radiance."""
    towards = np.array([0.3, 0.8, 0.2]) / np.linalg.norm([0.3, 0.8, 0.2])
    radiance = with_lamp(room(), (0.3, 0.8, 0.2), 900.0)
    spots = np.random.default_rng(2).integers(20, 100, (40, 2))
    radiance[spots[:, 0], 2 * spots[:, 1]] = 1200.0
    _, suns = split_suns(radiance)
    assert suns and suns[0].direction @ towards > np.cos(np.radians(0.5))
    assert [sun.irradiance.sum() for sun in suns] == sorted((s.irradiance.sum() for s in suns), reverse=True)


def test_a_glow_around_the_sun_does_not_widen_it() -> None:
    """Check that the radius is that of the disc with most of the light."""
    radiance = with_lamp(np.full((512, 1024, 3), 0.5), (0.3, 0.8, 0.2), 20000.0)
    angle = np.degrees(
        np.arccos(texel_directions(512, 1024) @ [0.3, 0.8, 0.2] / np.linalg.norm([0.3, 0.8, 0.2]))
    )
    _, (sun,) = split_suns(radiance + 400.0 * np.exp(-((angle / 4.0) ** 2))[..., None])
    assert np.degrees(sun.radius) == pytest.approx(2.0, rel=0.15)


def test_a_soft_room_has_no_sun() -> None:
    rest, suns = split_suns(room())
    assert suns == [] and np.array_equal(rest, room())


def test_harmonics_round_trip() -> None:
    """Check analysis and synthesis of a picture of low degree."""
    x, y, z = np.moveaxis(texel_directions(256, 512), -1, 0)
    picture = np.stack([1 + x * y, z**3 - 0.2 * z, x**2 - z**2 + 0.1 * y], axis=-1)
    (again,) = synthesise_panoramas(analyse_panorama(picture, 12), np.ones((1, 13)), 256)
    assert np.abs(again - picture).max() < PREFILTERED


def test_cosine_kernel_matches_the_published_factors() -> None:
    """Check the factors pi, 2 pi / 3, pi / 4, 0, -pi / 24 [RamamoorthiHanrahan2001]."""
    expected = [np.pi, 2 * np.pi / 3, np.pi / 4, 0, -np.pi / 24]
    assert np.allclose(zonal_factors(np.cos, 4), expected, atol=1e-6)


@pytest.fixture(scope="module")
def lamps(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Floats]:
    """Return the file of a room with a lamp too weak for a sun, and its radiance."""
    path = tmp_path_factory.mktemp("environment") / "room.exr"
    radiance = with_lamp(room(256), (0.2, 0.9, -0.3), 8.0).astype(np.float32)
    write_exr(path, radiance)
    return str(path), radiance.astype(np.float64)


def test_irradiance_matches_direct_summation(lamps: tuple[str, Floats]) -> None:
    name, radiance = lamps
    made = prefilter(name)
    assert made.suns == ()
    towards, normals = texel_directions(256, 512), texel_directions(LAYER_HEIGHT, 2 * LAYER_HEIGHT)
    for y, x in [(0, 3), (20, 70), (64, 128), (90, 200), (127, 250)]:
        exact = summed(radiance, normals[y, x], np.maximum(towards @ normals[y, x], 0))
        assert np.allclose(made.layers[0, y, x], exact, rtol=PREFILTERED)


@pytest.mark.parametrize("layer", [1, 4, 7, 10])
def test_reflections_match_direct_averaging(lamps: tuple[str, Floats], layer: int) -> None:
    name, radiance = lamps
    made, m = prefilter(name), float(LAYER_ROUGHNESSES[layer - 1])
    towards, mirror = texel_directions(256, 512), texel_directions(LAYER_HEIGHT, 2 * LAYER_HEIGHT)
    for y, x in [(0, 3), (20, 70), (64, 128), (90, 200)]:
        cosine = np.clip(towards @ mirror[y, x], -1, 1)
        weight = np.where(cosine > 0, isotropic_lobe(np.arccos(np.maximum(cosine, 0)), m), 0.0)
        total = summed(np.ones_like(radiance), mirror[y, x], weight)
        exact = summed(radiance, mirror[y, x], weight) / total
        assert (
            np.abs(made.layers[layer, y, x] - exact).max()
            < PREFILTERED * radiance.mean() + 2e-3 * exact.max()
        )


def test_uniform_light_is_uniform() -> None:
    made = prefilter("uniform")
    assert made.suns == ()
    assert np.allclose(made.layers[0], np.pi, rtol=PREFILTERED)
    assert np.allclose(made.layers[1:], 1.0, rtol=2 * PREFILTERED)


def test_kernels_are_too_smooth_to_ring() -> None:
    for m in LAYER_ROUGHNESSES:
        factors = isotropic_lobe_factors(float(m))
        assert (
            factors[0] == pytest.approx(1.0) and abs(factors[-1]) < 1e-3 and np.abs(factors).max() < 1 + 1e-9
        )


def test_sample_environments_are_available(sample_folder: Path) -> None:
    made = prefilter("royal_esplanade")
    assert len(made.suns) == 3 and made.layers.max() < 40  # its brightest texel is 49,664
    assert all(sun.direction[1] > 0.8 for sun in made.suns)  # lamps in the ceiling
    assert prefilter("lebombo").suns == ()


@pytest.mark.parametrize(
    ("odd", "mended", "said"),
    [
        (-1.0, 0.0, "1 negative"),
        (np.nan, 0.0, "1 infinite or NaN"),
        (np.inf, 1.0, "infinite values become 1"),
    ],
)
def test_a_few_odd_pixels_of_a_panorama_are_mended(
    tmp_path: Path, odd: float, mended: float, said: str
) -> None:
    pixels = np.ones((256, 512, 3), np.float32)
    pixels[3, 4] = odd
    write_exr(tmp_path / "odd.exr", pixels)
    with pytest.warns(DermisWarning, match=rf"odd\.exr: .*{said}"):
        radiance = load_panorama(str(tmp_path / "odd.exr"))
    assert np.allclose(radiance[3, 4], mended) and np.allclose(
        np.delete(radiance.reshape(-1, 3), 3 * 512 + 4, 0), 1
    )


def test_a_grey_panorama_is_white_light(tmp_path: Path) -> None:
    import OpenEXR

    grey = np.full((256, 512), 0.5, np.float32)
    OpenEXR.File({}, {"Y": grey}).write(str(tmp_path / "grey.exr"))
    with pytest.warns(DermisWarning, match="it is grey"):
        assert np.allclose(load_panorama(str(tmp_path / "grey.exr")), 0.5)


def test_files_that_are_not_panoramas_are_refused(tmp_path: Path) -> None:
    square, bytes_ = tmp_path / "square.exr", tmp_path / "grey.png"
    write_exr(square, np.ones((8, 8, 3), np.float32))
    write_png(bytes_, np.full((8, 16, 3), 100, np.uint8))
    for path, said in ((square, "twice as wide"), (bytes_, "uint8")):
        with pytest.raises(DermisError, match=said):
            load_panorama(str(path))
    pixels = np.ones((8, 16, 3), np.float32)
    pixels[3, 4] = 2e12
    write_exr(tmp_path / "odd.exr", pixels)
    with pytest.raises(DermisError, match=r"radiance up to 1e\+12, but it is up to 2e"):
        load_panorama(str(tmp_path / "odd.exr"))
    with pytest.raises(DermisError, match="royal_esplanade"):
        panorama_file("nowhere.hdr")
    with pytest.raises(DermisError, match="an environment"):
        panorama_file("lee_perry_smith")
