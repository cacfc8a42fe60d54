"""Nearest depths in squares of shadow maps; skipped squares do not change the light."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import head_of, joined, place, run_frame, scene_of

from dermis.frame.features.irradiance import irradiance
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download, upload
from dermis.mesh.primitives import plane, uv_sphere
from dermis.scene.lights import DirectionalLight, RectangleLight, SphereLight

BALLS = head_of(
    joined((plane(120.0, 4), (0, 0, -40), (0, 0, 0.6)), (uv_sphere(20.0, 48, 24), (5, 5, 10), (0.65, 0, 0.3)))
)
AIM = {"position": place(BALLS, (150, 200, 400)), "target": place(BALLS, (0, 0, 0))}
LIGHTS: dict[str, Any] = {
    "sun": DirectionalLight(direction=(-1, -1, -2), angle_degrees=1.0),
    "wide sun": DirectionalLight(direction=(-1, -1, -2), angle_degrees=12.0),
    "rectangle": RectangleLight(**AIM, width_mm=60, height_mm=90),
    "sphere": SphereLight(**AIM, radius_mm=15),
}


def squares(depth: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """Return the nearest depth in squares of a map, whose side is a multiple of theirs."""
    count = len(depth) // side
    return np.asarray(depth.reshape(count, side, count, side).max(axis=(1, 3)))


@pytest.mark.parametrize("size", [128, 320])
def test_each_level_stores_the_nearest_depth_of_its_cells(renderer: Renderer, size: int) -> None:
    maps = run_frame(
        renderer, scene_of(BALLS, LIGHTS["sun"]), atlas=64, shadow_size=size
    ).resources.shadow_maps
    depth = download(renderer.device, maps.texture)
    bounds = download(renderer.device, maps.bounds)
    height = len(bounds)
    assert (depth > 0).any() and (depth == 0).any()
    assert np.array_equal(bounds[: size // 4, : size // 4], squares(depth, 4))
    for level, side in enumerate((8, 16, 32, 64), start=1):
        top, count = height - 2 * (height >> level), size // side
        assert np.array_equal(bounds[top : top + count, height : height + count], squares(depth, side))


@pytest.mark.parametrize("shadow_size", [256, 1000])
@pytest.mark.parametrize("name", LIGHTS)
def test_skipped_cells_contain_no_occluder(renderer: Renderer, name: str, shadow_size: int) -> None:
    """Bounds without any empty square give the same light, bit for bit."""
    inputs = run_frame(renderer, scene_of(BALLS, LIGHTS[name]), atlas=256, shadow_size=shadow_size)

    def light() -> Any:
        frame, into = CommandList(renderer.device), inputs.resources.scattered
        irradiance.draw(frame, inputs.layouts[0], inputs.light_constants, into, 256)
        frame.submit()
        return download(renderer.device, into)[..., :3]

    bounded = light()
    bounds = inputs.resources.shadow_maps.bounds
    upload(renderer.device, bounds, np.ones((bounds.size[1], bounds.size[0]), np.float32))
    everywhere = light()
    renderer.graph.invalidate()  # it knows nothing of this
    lit = bounded.max(axis=-1)
    assert (lit > 0.5 * lit.max()).any() and (lit[lit > 0] < 0.2 * lit.max()).any()
    assert np.array_equal(bounded, everywhere)
