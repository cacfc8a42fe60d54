"""Path tracing against closed forms and Monte Carlo, its statistics and its cache."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from half_spaces import mean_and_error, pan, traced
from tolerances import STANDARD_ERRORS

from dermis.apps.truths.half_space import directional_albedo, reflected_radiance
from dermis.apps.truths.path_traced import Lambertian, path_trace
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.base.errors import DermisError
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import plane, uv_sphere
from dermis.optics.media import Layer, Medium, published_media
from dermis.scene.camera import Camera
from dermis.scene.lights import PointLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

ALBEDO = np.array([0.5, 0.8, 0.95])
SKIN1 = published_media()["skin1"].with_eta(1.0)


@pytest.fixture
def mitsuba() -> None:
    pytest.importorskip("mitsuba")


def ball_scene(**light: object) -> Scene:
    head = Head("ball", uv_sphere(20.0, 48, 24), Maps())
    middle = -np.array(head.centre_mm)
    camera = Camera(position=tuple(np.add(middle, (0, 0, 200))), target=tuple(middle), frame_mm=50.0)
    given = {"position": tuple(np.add(middle, (100, 80, 150))), "target": tuple(middle)} | light
    return Scene(head, lights=(PointLight(**given),), camera=camera)


SMALL = Settings(size=(24, 16))


@pytest.mark.usefixtures("mitsuba")
@pytest.mark.parametrize("degrees", [0.0, 60.0, 80.0])
def test_half_space_reflects_by_the_h_function(degrees: float) -> None:
    layer = Layer(1.0 - ALBEDO, ALBEDO)
    mean, error = mean_and_error(traced(pan(300.0, 150.0), (layer,), 256, degrees=degrees))
    exact = [float(reflected_radiance(1.0, np.cos(np.radians(degrees)), one)) for one in ALBEDO]
    assert np.all(np.abs(mean - exact) < STANDARD_ERRORS * error)
    assert np.all(error < 0.006 * mean)


@pytest.mark.usefixtures("mitsuba")
def test_dense_medium_is_not_thinned_by_the_steps_off_its_surface() -> None:
    # With ten scatterings per mm, skipping 0.01 mm would cost 6 % of the first channel.
    mean, error = mean_and_error(traced(pan(40.0, 20.0), (Layer(10 * (1 - ALBEDO), 10 * ALBEDO),), 256))
    exact = np.array([float(reflected_radiance(1.0, 1.0, one)) for one in ALBEDO])
    assert np.all(np.abs(mean / exact - 1.0) < 0.003 + STANDARD_ERRORS * error / exact)


@pytest.mark.usefixtures("mitsuba")
def test_total_reflectance_agrees_with_photons_and_published_values() -> None:
    # By reciprocity, uniform light seen along the normal equals light along the normal seen from all sides.
    mean, error = mean_and_error(traced(pan(300.0, 150.0), (Layer(1.0 - ALBEDO, ALBEDO),), 256, around=True))
    published = np.array([0.1152, 0.2853, 0.5355])  # adding-doubling, to four digits
    assert np.all(np.abs(mean - published) < STANDARD_ERRORS * error + 5e-5)
    assert published == pytest.approx([float(directional_albedo(1.0, one)) for one in ALBEDO], abs=1e-4)
    for channel, albedo in enumerate(ALBEDO):
        slab = trace_slab([ScatteringLayer(1 - albedo, albedo, eta=1.0)], photons=100_000)
        together = np.hypot(error[channel], slab.total_reflectance_se)
        assert abs(mean[channel] - slab.total_reflectance) < STANDARD_ERRORS * together


@pytest.mark.usefixtures("mitsuba")
def test_layers_inside_one_another_agree_with_photons_through_layers() -> None:
    upper = Layer(np.array([0.1, 0.3, 2.0]), np.array([3.0, 4.0, 3.0]), 0.3)
    lower = Layer(np.array([0.02, 0.5, 0.4]), np.array([1.0, 0.5, 3.0]))
    mean, error = mean_and_error(traced(pan(300.0, 150.0), (upper, lower), 256, around=True))
    for k in range(3):
        stack = [
            ScatteringLayer(one.sigma_a[k], one.sigma_s_prime[k], one.thickness_mm, eta=1.0)
            for one in (upper, lower)
        ]
        slab = trace_slab(stack, photons=100_000)
        together = np.hypot(error[k], slab.total_reflectance_se)
        assert abs(mean[k] - slab.total_reflectance) < STANDARD_ERRORS * together


@pytest.mark.usefixtures("mitsuba")
def test_pixel_variance_predicts_another_trial() -> None:
    first = path_trace(ball_scene(), SKIN1, 160, SMALL)
    both = path_trace(ball_scene(), SKIN1, 320, SMALL)
    second = 2.0 * both.image.astype(np.float64) - first.image  # mean of the 160 added samples
    seen = first.mask > 0.99
    apart = (second - first.image)[seen].astype(np.float64)
    expected = 4.0 * both.variance[seen].astype(np.float64)
    assert np.mean(apart**2 / expected.mean(axis=0)) == pytest.approx(1.0, abs=0.2)


@pytest.mark.usefixtures("mitsuba")
def test_more_samples_add_to_those_there_are() -> None:
    scene = ball_scene(irradiance=(1, 2, 3))
    steps: list[tuple[int, int]] = []
    few = path_trace(scene, SKIN1, 8, SMALL, progress=lambda *step: steps.append(step))
    more = path_trace(scene, SKIN1, 15, SMALL, progress=lambda *step: steps.append(step))
    assert (few.samples, more.samples) == (8, 16)
    assert steps == [(1, 2), (2, 2), (3, 4), (4, 4)]
    again = path_trace(scene, SKIN1, 8, SMALL, progress=lambda *step: steps.append(step))
    assert len(steps) == 4 and again.samples == 16
    assert np.array_equal(again.image, more.image) and again.seconds == more.seconds


@pytest.mark.usefixtures("mitsuba")
def test_cached_passes_equal_those_traced_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path_trace(ball_scene(), SKIN1, 8, SMALL)
    grown = path_trace(ball_scene(), SKIN1, 24, SMALL)
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    at_once = path_trace(ball_scene(), SKIN1, grown.samples, SMALL)
    assert np.array_equal(at_once.image, grown.image) and np.array_equal(at_once.variance, grown.variance)


@pytest.mark.usefixtures("mitsuba")
def test_without_cache_passes_are_neither_read_nor_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    alone = path_trace(ball_scene(), SKIN1, 8, SMALL, use_cache=False)
    assert not list(tmp_path.iterdir())
    path_trace(ball_scene(), SKIN1, 16, SMALL)
    again = path_trace(ball_scene(), SKIN1, 8, SMALL, use_cache=False)
    assert again.samples == 8 and np.array_equal(again.image, alone.image)


@pytest.mark.usefixtures("mitsuba")
def test_damaged_file_is_traced_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    first = path_trace(ball_scene(), SKIN1, 8, SMALL)
    (file,) = (tmp_path / "path-traced").iterdir()
    file.write_bytes(file.read_bytes()[:100])
    assert np.array_equal(path_trace(ball_scene(), SKIN1, 8, SMALL).image, first.image)


@pytest.mark.usefixtures("mitsuba")
def test_interrupted_passes_are_cached() -> None:
    scene = ball_scene(irradiance=(2, 2, 2))

    def stop(done: int, of: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        path_trace(scene, SKIN1, 40, SMALL, progress=stop)
    assert path_trace(scene, SKIN1, 8, SMALL).samples == 12


@pytest.mark.usefixtures("mitsuba")
def test_other_scenes_have_other_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    scenes = [ball_scene(), ball_scene(irradiance=(1, 1, 1))]
    for scene in scenes:
        path_trace(scene, SKIN1, 8, Settings(size=(4, 4)))
        path_trace(scene, Lambertian((0.5, 0.5, 0.5)), 8, Settings(size=(4, 4)))
    path_trace(scenes[0], published_media()["skin2"].with_eta(1.0), 8, Settings(size=(4, 4)))
    path_trace(scenes[0], SKIN1, 8, Settings(size=(4, 5)))
    assert len(list((tmp_path / "path-traced").iterdir())) == 6


@pytest.mark.usefixtures("mitsuba")
def test_caller_keeps_the_variant() -> None:
    import mitsuba

    mitsuba.set_variant("scalar_spectral")
    path_trace(ball_scene(irradiance=(3, 1, 1)), SKIN1, 8, Settings(size=(4, 4)))
    assert mitsuba.variant() == "scalar_spectral"


def test_missing_mitsuba_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(DermisError, match=r"package mitsuba.*dermis\[truth\]"):
        path_trace(ball_scene(), SKIN1, 8, SMALL)


@pytest.mark.usefixtures("mitsuba")
def test_invalid_options_are_refused() -> None:
    scene = ball_scene()
    with pytest.raises(DermisError, match=r"index-matched .*with_eta\(1.0\)"):
        path_trace(scene, published_media()["skin1"], 8, SMALL)
    with pytest.raises(DermisError, match="three channels"):
        path_trace(scene, SKIN1.channel(0), 8, SMALL)
    with pytest.raises(DermisError, match="samples: expected a whole number"):
        path_trace(scene, SKIN1, 0, SMALL)
    with pytest.raises(DermisError, match="light 1: expected a light with shadows"):
        path_trace(ball_scene(shadows=False), SKIN1, 8, SMALL)
    sheet = Scene(Head("sheet", plane(50.0, 4), Maps()), lights=scene.lights, camera=scene.camera)
    with pytest.raises(DermisError, match="sheet: expected a surface with a volume behind it"):
        path_trace(sheet, SKIN1, 8, SMALL)
    deep = Medium("deep", (Layer(*np.ones((2, 3)), 30.0), Layer(*np.ones((2, 3)))), eta=1.0)
    with pytest.raises(DermisError, match="a body deeper than its layers"):
        path_trace(scene, deep, 8, SMALL)
