"""Half-space skin against path tracing, on a ball, which does not shadow itself."""

from __future__ import annotations

import os

import pytest

from dermis.apps.validation.comparisons.compare import Comparison, compare
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene.settings import Settings

BALL = Head("ball", uv_sphere(100.0, 256, 128), Maps())
ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
SETTINGS = Settings(size=(32, 32), atlas=256, shadow_size=512)


def against_paths(direction: str) -> Comparison:
    """Return a comparison with path tracing; paths are cached, so that they are traced once."""
    return compare(
        BALL,
        "path-traced",
        ("none",),
        light="back",
        region="ear",
        settings=SETTINGS,
        direction=direction,  # type: ignore[arg-type]
        samples=64,
        adapter=ADAPTER,
    )


@pytest.fixture(scope="module")
def both() -> tuple[Comparison, Comparison]:
    pytest.importorskip("mitsuba")
    return against_paths("lambertian"), against_paths("half-space")


def test_half_space_is_closer_to_path_tracing(both: tuple[Comparison, Comparison]) -> None:
    """Scattering along the surface is disabled; it hardly matters on such a large ball."""
    (lambertian,), (turned,) = (result.rows for result in both)
    assert lambertian.relrmse > 0.2
    assert turned.relrmse + turned.relrmse_se < 0.4 * lambertian.relrmse


def test_half_space_conserves_energy(both: tuple[Comparison, Comparison]) -> None:
    """Light comes from behind, so most of it enters and leaves at grazing angles."""
    (lambertian,), (turned,) = (result.rows for result in both)
    assert lambertian.energy_ratio < 0.8
    assert turned.energy_ratio == pytest.approx(1.0, abs=0.05)


def test_report_states_the_comparison(both: tuple[Comparison, Comparison]) -> None:
    assert ", half-space skin, profile by photons" in both[1].title and ", lambertian skin" in both[0].title
