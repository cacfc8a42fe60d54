"""Specular lobes of the shader against the exact functions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import frontal, head_of, probe, run_frame, scene_of
from tolerances import LOBE_TWIN, TABLE_LOBE

from dermis.frame.features.surface import record as surface
from dermis.frame.renderer import Renderer
from dermis.gpu.textures import texture_from_array
from dermis.mesh.primitives import plane
from dermis.scene.lights import DirectionalLight
from dermis.scene.skin import Skin
from dermis.specular.beckmann import beckmann
from dermis.specular.cosines import cosines
from dermis.specular.fresnel import ENERGY_SCHEMES, FRESNEL
from dermis.specular.kelemen import kelemen
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
SIZE = 64
Z = np.array([0.0, 0.0, 1.0])
COMPUTED = [name for name in MODELS if name != "kelemen"]


def directions(seed: int) -> Floats:
    """Return (n, n, 3) unit vectors over the hemisphere, as float32 values."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.02, 1.0, (SIZE, SIZE)), rng.uniform(0, 2 * np.pi, (SIZE, SIZE))
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).astype(np.float32).astype(float)


def shader(renderer: Renderer, light: Floats, view: Floats, m: float, rho_s: float, **skin: Any) -> Any:
    """Return (n, n) results of the lobe's functions: reflectance, slopes, BRDF and transmitted fractions."""
    scene = scene_of(head_of(plane(50.0)), frontal(), **skin)
    lit = run_frame(renderer, scene).bindings
    flat = np.ones((SIZE, SIZE, 1))
    textures = {
        "to_light": texture_from_array(renderer.device, np.dstack([light, m * flat]), "rgba32float"),
        "to_eye": texture_from_array(renderer.device, np.dstack([view, rho_s * flat]), "rgba32float"),
    }
    outputs, chosen = ["reflected", "passed"], surface.surface_constants(Skin(**skin))
    made = probe(renderer.device, "lobe_probe", (SIZE, SIZE), outputs, chosen, **lit, **textures)
    return [texture[..., k] for texture in made for k in range(3)]


def worst(made: Floats, exact: Floats) -> float:
    """Return the largest error relative to the largest value."""
    return float(np.abs(made - exact).max() / np.abs(exact).max())


def near_the_mirror(seed: int) -> tuple[Floats, Floats]:
    """Return light and view directions whose half vectors are within ten degrees of the normal."""
    light = directions(seed)
    tilt = np.random.default_rng(seed + 1).normal(0, 0.08, (SIZE, SIZE, 2))
    half = np.dstack([tilt, np.ones((SIZE, SIZE))])
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    view = (2 * (light * half).sum(-1, keepdims=True) * half - light).astype(np.float32).astype(float)
    ok = ((view[..., 2] > 0.05) & (light[..., 2] > 0.05))[..., None]
    return np.where(ok, light, Z), np.where(ok, view, Z)


@pytest.mark.parametrize("m", [0.1, 0.3, 0.9])
@pytest.mark.parametrize("fresnel", FRESNEL)
@pytest.mark.parametrize("model", COMPUTED)
def test_each_model_matches_numpy(renderer: Renderer, model: str, fresnel: str, m: float) -> None:
    for light, view in (directions(1), directions(2)), near_the_mirror(3):
        light[0, 0] = view[0, 0] = Z  # the peak itself
        reflectance, _, lobe, *_ = shader(renderer, light, view, m, 0.18, specular=model, fresnel=fresnel)
        exact = MODELS[model].lobe(cosines(Z, light, view), m, FRESNEL[fresnel])
        assert worst(reflectance, FRESNEL[fresnel](light[..., 2])) < LOBE_TWIN
        assert worst(lobe, exact) < LOBE_TWIN


@pytest.mark.parametrize("m", [0.1, 0.2, 0.3, 0.5, 0.9])
def test_tabulated_kelemen_matches_the_formula(renderer: Renderer, m: float) -> None:
    """Compare with the table in float64, and with the lobe that the table approximates."""
    light, view = directions(1), directions(2)
    light[0, 0] = view[0, 0] = Z
    _, slopes, lobe, *_ = shader(renderer, light, view, m, 0.18, specular="kelemen")
    assert worst(slopes, twins.beckmann_by_table(light[..., 2], m)) < LOBE_TWIN
    assert worst(slopes, beckmann(light[..., 2], m)) < TABLE_LOBE
    assert worst(lobe, kelemen(cosines(Z, light, view), m)) < TABLE_LOBE


@pytest.mark.parametrize("m", [0.1, 0.3, 0.5])
def test_tabulated_kelemen_matches_near_the_mirror_direction(renderer: Renderer, m: float) -> None:
    light, view = near_the_mirror(3)
    _, _, lobe, *_ = shader(renderer, light, view, m, 1.0, specular="kelemen")
    exact = kelemen(cosines(Z, light, view), m)
    # at every angle of incidence by itself: the lobe at grazing light is a hundred times that at the front
    assert (np.abs(lobe - exact) / exact)[exact > 0.1 * exact.max()].max() < 2 * TABLE_LOBE
    assert worst(lobe, exact) < TABLE_LOBE


@pytest.mark.parametrize("energy", ENERGY_SCHEMES)
@pytest.mark.parametrize("model", ["kelemen", "torrance-sparrow-smith", "phong-plain"])
def test_transmitted_fractions_match_numpy(renderer: Renderer, model: str, energy: str) -> None:
    light, view, m, rho_s = directions(7), directions(8), 0.25, 0.6
    *_, entering, everywhere, leaving = shader(renderer, light, view, m, rho_s, specular=model, energy=energy)
    law = ENERGY_SCHEMES[energy]
    inwards, mean = twins.surface_albedo(light[..., 2], m, model)
    outwards, _ = twins.surface_albedo(view[..., 2], m, model)
    assert worst(entering, law.entering_fraction(inwards, rho_s)) < LOBE_TWIN
    assert worst(everywhere, law.entering_fraction(mean, rho_s)) < LOBE_TWIN
    assert worst(leaving, law.exitance_factor(outwards, mean, rho_s)) < LOBE_TWIN


def test_entering_light_is_never_negative(renderer: Renderer) -> None:
    """The published albedo exceeds 1 for smooth lobes at grazing light: entering light is clamped at 0."""
    *_, entering, _, leaving = shader(renderer, directions(5), directions(6), 0.06, 1.0, energy="published")
    assert entering.min() == 0.0 and leaving.min() == 0.0


def test_back_facing_relief_reflects_as_at_grazing_view(renderer: Renderer) -> None:
    """Light from behind is included, where the lobe of an invisible normal is unbounded."""
    rng = np.random.default_rng(4)
    view = directions(9)
    to_light = np.array([0.1, 0.2, -1.0]) / np.sqrt(1.05)
    view[:8] = Z + rng.normal(0, 0.02, (8, SIZE, 3)) - (to_light + Z)  # straight at the light, nearly
    view /= np.linalg.norm(view, axis=-1, keepdims=True)
    normal = rng.normal(size=(SIZE, SIZE, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    view, normal = (a.astype(np.float32).astype(float) for a in (view, normal))
    light = DirectionalLight(direction=tuple(-to_light), irradiance=(1, 1, 1), shadows=False)
    lit = run_frame(renderer, scene_of(head_of(plane(50.0)), light, specular="kelemen-direct")).bindings
    textures = {
        "normals": texture_from_array(
            renderer.device, np.dstack([normal, 0 * normal[..., :1]]), "rgba32float"
        ),
        "views": texture_from_array(
            renderer.device, np.dstack([view, 0 * normal[..., :1] + 0.3]), "rgba32float"
        ),
    }
    chosen = surface.surface_constants(Skin(specular="kelemen-direct"))
    (made,) = probe(renderer.device, "lighting_probe", (SIZE, SIZE), ["mirror"], chosen, **lit, **textures)
    n_v = (normal * view).sum(-1, keepdims=True)
    seen = normal - np.minimum(n_v, 0) * view
    seen /= np.linalg.norm(seen, axis=-1, keepdims=True)
    angles = cosines(seen, np.broadcast_to(to_light, seen.shape), view)
    angles = replace(angles, n_v=np.maximum(angles.n_v, 1e-6))
    lit_at_all = (normal * to_light).sum(-1) > 0
    exact = np.where(lit_at_all, kelemen(angles, 0.3) * np.maximum(angles.n_l, 0), 0.0)
    assert ((n_v[..., 0] < 0) & (exact > 0)).sum() > 50
    assert np.median(np.abs(made[..., 0] - exact)[exact > 0] / exact[exact > 0]) < LOBE_TWIN
    assert made[..., 0].max() < 1.1 * exact.max()
