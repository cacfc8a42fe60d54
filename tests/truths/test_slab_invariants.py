"""Invariants of Monte Carlo in any stack (energy, limits, reproducibility), and invalid input."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields

import child_process
import numba
import numpy as np
import pytest
from scipy.stats import chi2
from tolerances import CHANCE, STANDARD_ERRORS

from dermis.apps.truths.slab_mc import (
    ScatteringLayer,
    SlabResult,
    default_ring_edges,
    trace_medium,
    trace_slab,
)
from dermis.base.errors import DermisError
from dermis.optics.diffusion.boundary import fresnel, normal_reflectance
from dermis.optics.media import Layer, Medium

SKIN = (
    ScatteringLayer(0.21, 24.0, 0.25, 0.8),
    ScatteringLayer(0.016, 3.2, 0.2, 0.0, 1.34),
    ScatteringLayer(0.0085, 0.45),
)
GLASS = ScatteringLayer(0.0, 0.0, 0.4, eta=1.5)
CONSERVATIVE = ScatteringLayer(0.0, 1.0)


def accounted(run: SlabResult) -> float:
    scattered = run.total_reflectance + run.total_transmittance
    unscattered = run.unscattered_reflectance + run.unscattered_transmittance
    return float(run.specular + scattered + unscattered + run.absorbed.sum() + run.unfinished)


def same(a: SlabResult, b: SlabResult) -> bool:
    return all(np.array_equal(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))


@pytest.mark.parametrize(
    "layers",
    [
        SKIN,
        (GLASS, *SKIN),
        (ScatteringLayer(0.1, 0.9, 2.0, -0.3), GLASS, ScatteringLayer(0.5, 0.5, 1.0, eta=1.0)),
        (CONSERVATIVE,),
        (ScatteringLayer(0.0, 1.0, 3.0, eta=1.0),),
        (GLASS,),
    ],
)
def test_no_light_is_lost(layers: tuple[ScatteringLayer, ...]) -> None:
    run = trace_slab(layers, 3000, edges_mm=np.array([0.0, 0.5, 1.0]))
    assert accounted(run) == pytest.approx(1.0, abs=1e-12)
    assert accounted(run.relative_to_entering) == pytest.approx(1.0, abs=1e-12)
    areas = np.pi * np.diff(run.edges_mm**2)
    for face in ("reflectance", "transmittance"):
        rings = getattr(run, face) @ areas + getattr(run, f"overflow_{face}")
        assert rings == pytest.approx(getattr(run, f"total_{face}"), abs=1e-12)


def test_light_in_a_half_space_without_absorption_comes_back() -> None:
    """All light would return after unbounded walks; the few dropped photons are counted."""
    run = trace_slab([CONSERVATIVE], 2000)
    assert run.absorbed.tolist() == [0.0]
    assert 0.0 < run.unfinished < 0.03
    assert not trace_slab([ScatteringLayer(1e-3, 1.0)], 2000).unfinished


def test_fractions_of_entering_light_exclude_the_mirror() -> None:
    run = trace_slab(SKIN, 2000)
    assert run.specular == pytest.approx(normal_reflectance(1.4), abs=1e-15)
    entered = 1.0 - run.specular
    assert np.allclose(run.relative_to_entering.reflectance * entered, run.reflectance)
    assert np.allclose(run.relative_to_entering.reflectance_se * entered, run.reflectance_se)
    assert run.relative_to_entering.specular == 0.0


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_absorber_alone_obeys_beer_and_lambert_between_two_mirrors(eta: float) -> None:
    run = trace_slab([ScatteringLayer(0.7, 0.0, 1.0, eta=eta)], 400_000)
    F, fade = normal_reflectance(eta), np.exp(-0.7)
    through = (1.0 - F) ** 2 * fade / (1.0 - (F * fade) ** 2)
    back = F * fade * through
    for computed, expected in (
        (run.unscattered_transmittance, through),
        (run.unscattered_reflectance, back),
    ):
        error = np.sqrt(expected * (1.0 - F - expected) / run.photons)
        assert abs(computed - expected) <= STANDARD_ERRORS * error
    assert run.total_reflectance == run.total_transmittance == 0.0


def test_glass_plate_mirrors_as_two_faces_do() -> None:
    run = trace_slab([GLASS], 400_000)
    F = normal_reflectance(1.5)
    through = (1.0 - F) / (1.0 + F)
    error = np.sqrt(through * (1.0 - F - through) / run.photons)
    assert abs(run.unscattered_transmittance - through) < STANDARD_ERRORS * error


def test_layer_cut_in_two_gives_the_very_same_photons() -> None:
    whole = trace_slab([ScatteringLayer(0.1, 9.0, 1.0, 0.8)], 20_000)
    halves = trace_slab([ScatteringLayer(0.1, 9.0, 0.5, 0.8)] * 2, 20_000)
    assert np.array_equal(halves.reflectance, whole.reflectance)
    assert np.array_equal(halves.transmittance, whole.transmittance)
    assert halves.absorbed.sum() == pytest.approx(whole.absorbed[0], abs=1e-12)


def test_thin_scatterer_lights_a_cone_in_glass() -> None:
    """Light scattered once above a plate leaves it at odd multiples of the tangent of its angle inside."""
    plate = ScatteringLayer(0.0, 0.0, 1.0, eta=1.4)
    edges = np.array([0.0, 0.3, 0.5, 0.7, 0.85, 0.95, 1.0 / np.sqrt(0.96), 2.5])
    run = trace_slab([ScatteringLayer(0.0, 1e3, 1e-6, eta=1.0), plate], 6_000_000, edges_mm=edges)
    cosine = (np.arange(100_000) + 0.5) / 100_000
    F = fresnel(cosine, 1.4)
    sine2 = (1.0 - cosine**2) / 1.96
    radius = np.outer(2.0 * np.arange(20) + 1.0, np.sqrt(sine2 / (1.0 - sine2)))
    light = (1.0 - F) ** 2 * F ** (2.0 * np.arange(20)[:, None])
    expected = np.histogram(radius, np.append(edges, np.inf), weights=light / light.sum())[0]
    rings = run.transmittance * np.pi * np.diff(edges**2)
    counted = np.append(rings, run.overflow_transmittance) * run.photons
    assert counted.sum() > 2000
    scatter = (counted - expected * counted.sum()) ** 2 / (expected * counted.sum())
    assert chi2.sf(scatter.sum(), len(scatter) - 1) > CHANCE


def test_gap_of_air_above_changes_only_what_is_called_specular() -> None:
    """The reflecting face is then inside the stack, and photons leave it upwards."""
    plain = trace_slab(SKIN, 400_000)
    below = trace_slab([ScatteringLayer(0.0, 0.0, 0.1, eta=1.0), *SKIN], 400_000, seed=1)
    assert below.specular == 0.0
    error = np.sqrt(plain.specular / below.photons)
    assert abs(below.unscattered_reflectance - plain.specular) < STANDARD_ERRORS * error
    error = np.hypot(plain.total_reflectance_se, below.total_reflectance_se)
    assert abs(below.total_reflectance - plain.total_reflectance) < STANDARD_ERRORS * error
    assert np.allclose(below.absorbed[1:], plain.absorbed, atol=STANDARD_ERRORS * 1.5e-3)


def test_results_scale_with_length() -> None:
    """With eight times the lengths and an eighth of the coefficients, the photons are only farther apart."""
    small = trace_slab([ScatteringLayer(1.0, 9.0, 0.5, 0.5)], 20_000)
    large = trace_slab([ScatteringLayer(0.125, 1.125, 4.0, 0.5)], 20_000, edges_mm=8.0 * small.edges_mm)
    assert np.allclose(64.0 * large.reflectance, small.reflectance, rtol=1e-12)


def test_standard_errors_are_the_scatter_of_many_runs() -> None:
    many = [trace_slab([ScatteringLayer(0.1, 0.9)], 2000, seed) for seed in range(100)]
    for name in ("total_reflectance", "absorbed"):
        values = np.array([getattr(run, name) for run in many])
        stated = np.mean([getattr(run, f"{name}_se") for run in many])
        assert 0.8 < values.std(ddof=1) / stated < 1.22  # 100 runs determine it within 7 %


@pytest.mark.parametrize("threads", [1, 3])
def test_result_depends_on_the_seed_and_not_on_the_threads(
    threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = trace_slab(SKIN, 5000, seed=7)
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", threads)
    assert same(trace_slab(SKIN, 5000, seed=7), before)
    assert not same(trace_slab(SKIN, 5000, seed=8), before)


@pytest.mark.parametrize("photons", [1, 63, 64, 1001])
def test_any_number_of_photons_is_traced(photons: int) -> None:
    run = trace_slab(SKIN, photons)
    assert run.photons == photons
    assert accounted(run) == pytest.approx(1.0, abs=1e-12)


def test_channels_of_a_medium_are_slabs_of_their_own() -> None:
    top = Layer(np.array([0.5, 0.2]), np.array([4.0, 5.0]), 0.5)
    medium = Medium("two layers", (top, Layer(np.array([0.05, 0.1]), np.array([1.0, 2.0]))), 1.3)
    calls: list[tuple[int, int]] = []
    first, second = trace_medium(
        medium, 2000, 3, 0.8, progress=lambda done, total: calls.append((done, total))
    )
    assert calls == [(done, 128) for done in range(1, 129)]
    by_hand = [
        ScatteringLayer(0.2, 5.0 / 0.2, 0.5, 0.8, 1.3),
        ScatteringLayer(0.1, 2.0 / 0.2, np.inf, 0.8, 1.3),
    ]
    assert np.allclose(second.reflectance, trace_slab(by_hand, 2000, 4).reflectance)
    assert first.specular == pytest.approx(normal_reflectance(1.3), abs=1e-15)
    assert not np.allclose(first.absorbed, second.absorbed)


def test_rings_cover_the_plane_from_the_axis() -> None:
    edges = default_ring_edges()
    assert edges[0] == 0.0 and edges[1] == 1e-3 and edges[-1] == pytest.approx(40.0)
    assert np.allclose(edges[2:] / edges[1:-1], edges[2] / edges[1])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: ScatteringLayer(-0.1, 1.0), "coefficients of 0 or more"),
        (lambda: ScatteringLayer(0.1, float("nan")), "coefficients of 0 or more"),
        (lambda: ScatteringLayer(0.1, float("inf")), "coefficients of 0 or more"),
        (lambda: ScatteringLayer(0.1, 1.0, 0.0), "thickness above 0"),
        (lambda: ScatteringLayer(0.1, 1.0, float("nan")), "thickness above 0"),
        (lambda: ScatteringLayer(0.0, 0.0), "infinite layer"),
        (lambda: ScatteringLayer(0.1, 1.0, g=1.0), "mean cosine"),
        (lambda: ScatteringLayer(0.1, 1.0, eta=0.9), "index of refraction"),
        (lambda: trace_slab([]), "at least one layer"),
        (lambda: trace_slab([CONSERVATIVE, GLASS]), "an infinite last layer only"),
        (lambda: trace_slab(SKIN, 0), "photons: expected a whole number"),
        (lambda: trace_slab(SKIN, 10**10 + 1), "photons: expected a whole number"),
        (lambda: trace_slab(SKIN, 1e6 + 0.5), "photons: expected a whole number"),
        (lambda: trace_slab(SKIN, 10, seed=-1), "seed: expected a whole number"),
        (lambda: trace_slab(SKIN, 10, edges_mm=[0.1, 1.0]), "increasing edges of rings"),
        (lambda: trace_slab(SKIN, 10, edges_mm=[0.0, 1.0, 1.0]), "increasing edges of rings"),
        (lambda: trace_slab(SKIN, 10, edges_mm=[0.0]), "increasing edges of rings"),
        (lambda: trace_slab(SKIN, 10, edges_mm=[0.0, float("inf")]), "increasing edges of rings"),
        (lambda: trace_medium(Medium("m", (Layer(np.ones(1), np.ones(1)),)), 10, g=1.0), "mean cosine"),
    ],
)
def test_bad_input_is_refused(wrong: Callable[[], object], message: str) -> None:
    with pytest.raises(DermisError, match=message):
        wrong()


def test_keys_stop_photons_of_many_hours() -> None:
    code = """
import os, signal, threading
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
trace_slab([ScatteringLayer(0.01, 0.99)], 1)  # compiles
threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
trace_slab([ScatteringLayer(0.01, 0.99)], 10**10)
"""
    with child_process.start([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True) as run:
        _, message = run.communicate(timeout=60)
    assert run.returncode != 0 and "KeyboardInterrupt" in message


def test_importing_the_module_leaves_the_compiler_alone() -> None:
    code = "import sys, dermis.apps.truths.slab_mc; print('numba' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
