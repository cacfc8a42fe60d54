"""The shader's surface lobe against the exact functions."""

from __future__ import annotations

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import frontal, head_of, probe, run_frame, scene_of
from tolerances import TABLE_LOBE, TWIN

from dermis.assets.primitives import plane
from dermis.gpu.textures import texture_from
from dermis.rendering.renderer import Renderer
from dermis.specular.beckmann import beckmann
from dermis.specular.fresnel import schlick
from dermis.specular.kelemen import kelemen

Floats = NDArray[np.float64]
SIZE = 64
Z = np.array([0.0, 0.0, 1.0])


def directions(seed: int) -> Floats:
    """(n, n, 3) unit vectors over the hemisphere, float32 values."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.02, 1.0, (SIZE, SIZE)), rng.uniform(0, 2 * np.pi, (SIZE, SIZE))
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).astype(np.float32).astype(float)


def shader(renderer: Renderer, light: Floats, view: Floats, m: float, rho_s: float) -> list[Floats]:
    """Schlick, Beckmann, Kelemen and the share that passes, each (n, n)."""
    lit = run_frame(renderer, scene_of(head_of(plane(50.0)), frontal())).lit
    flat = np.ones((SIZE, SIZE, 1))
    textures = {
        "to_light": texture_from(renderer.device, np.dstack([light, m * flat]), "rgba32float"),
        "to_eye": texture_from(renderer.device, np.dstack([view, rho_s * flat]), "rgba32float"),
    }
    (lobe,) = probe(renderer.device, "lobe_probe", (SIZE, SIZE), ["lobe"], **lit, **textures)
    return [lobe[..., k] for k in range(4)]


def worst(made: Floats, exact: Floats) -> float:
    """Largest error, of the largest value."""
    return float(np.abs(made - exact).max() / np.abs(exact).max())


@pytest.mark.parametrize("m", [0.1, 0.2, 0.3, 0.5, 0.9])
def test_functions_over_the_hemisphere(renderer: Renderer, m: float) -> None:
    light, view = directions(1), directions(2)
    light[0, 0] = view[0, 0] = Z  # the peak itself
    fresnel, slopes, lobe, entering = shader(renderer, light, view, m, 0.18)
    assert worst(fresnel, schlick(light[..., 2])) < TWIN
    assert worst(slopes, beckmann(light[..., 2], m)) < TABLE_LOBE
    assert worst(entering, twins.passes(light[..., 2], m, 0.18)) < TWIN
    assert worst(lobe, kelemen(Z, light, view, m)) < TABLE_LOBE


@pytest.mark.parametrize("m", [0.1, 0.3, 0.5])
def test_lobe_near_the_mirror_direction(renderer: Renderer, m: float) -> None:
    """Where highlights are: half vectors within ten degrees of the normal."""
    light = directions(3)
    rng = np.random.default_rng(4)
    tilt = rng.normal(0, 0.08, (SIZE, SIZE, 2))
    half = np.dstack([tilt, np.ones((SIZE, SIZE))])
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    view = 2 * (light * half).sum(-1, keepdims=True) * half - light
    ok = (view[..., 2] > 0.05) & (light[..., 2] > 0.05)
    light, view = np.where(ok[..., None], light, Z), np.where(ok[..., None], view, Z)
    _, _, lobe, _ = shader(renderer, light, view, m, 1.0)
    exact = kelemen(Z, light, view, m)
    # at every angle of incidence by itself: the lobe at grazing light is a hundred times that at the front
    assert (np.abs(lobe - exact) / exact)[exact > 0.1 * exact.max()].max() < 2 * TABLE_LOBE
    assert worst(lobe, exact) < TABLE_LOBE


def test_nothing_enters_beyond_all_of_the_light(renderer: Renderer) -> None:
    """At rho_s = 1 and grazing light the table passes 1 for fine lobes: the share must stop at 0."""
    _, _, _, entering = shader(renderer, directions(5), directions(6), 0.06, 1.0)
    assert entering.min() >= 0.0
