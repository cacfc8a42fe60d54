"""Light that enters the skin, texel by texel, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import AnyLight, entered_light, head_of, place, run_frame, scene_of
from tolerances import TWIN

from dermis.atlas.build import cached_atlas
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import uv_sphere
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight
from dermis.scene.model import Scene

SPHERE = uv_sphere(40.0, 24, 12)
PLAIN = head_of(SPHERE)
SIZE = 64


def at(*position: float) -> dict[str, tuple[float, float, float]]:
    return {"position": place(PLAIN, position), "target": place(PLAIN, (5.0, 3.0, 0.0))}


LIGHTS: dict[str, AnyLight] = {
    "point": PointLight(**at(60, 90, 150), irradiance=(3.0, 2.0, 1.0), shadows=False),
    "near point": PointLight(**at(0, 0, 60), shadows=False),
    "spot": SpotLight(**at(-100, 20, 120), inner_degrees=6, outer_degrees=14, shadows=False),
    "directional": DirectionalLight(direction=(3, -2, -4), irradiance=(0.5, 1.5, 2.5), shadows=False),
}


def entered(renderer: Renderer, scene: Scene) -> NDArray[np.float64]:
    """Return level 0, the result of the irradiance pass."""
    return entered_light(renderer, run_frame(renderer, scene, atlas=SIZE))


@pytest.mark.parametrize("rho_s", [0.0, 0.18, 1.0])
@pytest.mark.parametrize("names", [(name,) for name in LIGHTS] + [tuple(LIGHTS)], ids="+".join)
def test_irradiance_of_lights_on_a_sphere_matches_numpy(
    renderer: Renderer, names: tuple[str, ...], rho_s: float, close: float
) -> None:
    scene = scene_of(PLAIN, *(LIGHTS[name] for name in names), rho_s=rho_s, roughness=0.35, mix=0.5)
    atlas = cached_atlas(SPHERE, SIZE)
    twin = twins.entering(scene, *twins.surface(atlas, PLAIN)) * twins.DEFAULT_COLOUR**0.5
    made = entered(renderer, scene)
    assert twin.max() > 0.1
    assert np.abs(made[..., :3] - np.where(atlas.lit_mask[..., None], twin, 0.0)).max() < close * twin.max()
    assert np.array_equal(made[..., 3] > 0, atlas.lit_mask)


@pytest.mark.parametrize("mix", [0.0, 0.5, 1.0])
def test_colour_map_factor_follows_the_mix(renderer: Renderer, mix: float, close: float) -> None:
    """The texel centres of a map of the size of the atlas are those of the atlas."""
    v, u = (np.mgrid[:SIZE, :SIZE] + 0.5) / SIZE
    wave = np.stack([0.5 + 0.3 * np.cos(2 * np.pi * u), 0.4 + 0.2 * np.sin(3 * v), 0.3 + 0 * u], axis=-1)
    wave = wave.astype(np.float16).astype(float)
    head = head_of(SPHERE, colour=wave)
    scene = scene_of(head, LIGHTS["directional"], mix=mix)
    atlas = cached_atlas(SPHERE, SIZE)
    rows = slice(6, SIZE - 6)  # away from the poles, where texels lie beside their triangles
    twin = (twins.entering(scene, *twins.surface(atlas, head)) * wave**mix)[rows]
    assert np.abs(entered(renderer, scene)[rows, :, :3] - twin).max() < 5 * close * twin.max()


def test_profile_colour_uses_no_map(renderer: Renderer, close: float) -> None:
    head = head_of(SPHERE, colour=np.full((4, 4, 3), 0.2))
    scene = scene_of(head, LIGHTS["point"], albedo="profile")
    atlas = cached_atlas(SPHERE, SIZE)
    twin = np.where(atlas.lit_mask[..., None], twins.entering(scene, *twins.surface(atlas, head)), 0.0)
    assert np.abs(entered(renderer, scene)[..., :3] - twin).max() < close * twin.max()


def test_specular_map_is_a_factor_with_mean_one(renderer: Renderer) -> None:
    """A constant map changes nothing, whatever its grey."""
    scenes = [
        scene_of(head, LIGHTS["directional"], rho_s=0.5)
        for head in (PLAIN, head_of(SPHERE, specular=np.full((8, 8), 0.37)))
    ]
    plain, even = (entered(renderer, scene) for scene in scenes)
    assert np.abs(plain - even).max() < 1e-3 * plain.max()  # the factor is stored as a half


@pytest.mark.parametrize(("constant", "same"), [(0.3, 0.5), (0.15, 0.25)])
def test_roughness_scales_its_map(renderer: Renderer, constant: float, same: float) -> None:
    """The default roughness leaves the map unchanged."""
    rough = head_of(SPHERE, roughness=np.full((8, 8), 0.5))
    mapped = scene_of(rough, LIGHTS["directional"], roughness=constant)
    plain = scene_of(PLAIN, LIGHTS["directional"], roughness=same)
    assert np.abs(entered(renderer, mapped) - entered(renderer, plain)).max() < TWIN


def test_no_light_gives_zero_irradiance(renderer: Renderer) -> None:
    made = entered(renderer, scene_of(PLAIN, DirectionalLight(direction=(0, 0, -1), irradiance=(0, 0, 0))))
    assert not made[..., :3].any()
