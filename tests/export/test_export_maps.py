"""Baked maps against frames of the same skin."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import load_subject
from dermis.apps.export.targets.maps import check_map_side, orient_normal_map, resample_map
from dermis.base.errors import DermisError
from dermis.frame.baking import BakedMaps, bake
from dermis.frame.renderer import Renderer
from dermis.images.colour import decode_srgb_levels
from dermis.images.io import read_image
from dermis.mesh.maps import Maps
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

SIDE = 512
LIGHT, PAINT, DRAWN = 0.03, 0.012, 0.03
"""Root mean square of the difference over that of the values: texels hold the mean of what lies in them, and
light leaves towards the eye as along the normal only where the skin faces it. Measured .019, .011, .02."""
SETTINGS = Settings(atlas=512, size=(192, 192), samples=1, strands=False)
OUTPUTS = "diffuse", "irradiance", "albedo", "melanin", "thickness", "uv"


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene("human:7")


@pytest.fixture(scope="module")
def baked(renderer: Renderer, scene: Scene) -> BakedMaps:
    return bake(renderer, scene, SETTINGS, SIDE)


def sample_bilinear(values: NDArray[Any], uv: NDArray[Any]) -> NDArray[Any]:
    """Return bilinear samples of a map."""
    position = uv * len(values) - 0.5
    low = np.clip(np.floor(position).astype(int), 0, len(values) - 2)
    x, y = low.T
    fx, fy = (part if values.ndim == 2 else part[:, None] for part in (position - low).T)
    rows = [values[y + k, x] * (1 - fx) + values[y + k, x + 1] * fx for k in (0, 1)]
    return np.asarray(rows[0] * (1 - fy) + rows[1] * fy)


def relative_rmse(found: NDArray[Any], expected: NDArray[Any]) -> float:
    return float(np.sqrt(((found - expected) ** 2).mean() / (expected**2).mean()))


def test_maps_equal_the_rendered_frame(renderer: Renderer, scene: Scene, baked: BakedMaps) -> None:
    drawn = renderer.draw(scene, SETTINGS, outputs=OUTPUTS)
    seen = {name: drawn.output(name) for name in OUTPUTS}
    skin = seen["thickness"] > 0
    uv = seen["uv"][skin]
    for name, of, factor, most in (
        ("scattered", "diffuse", np.pi, LIGHT),
        ("irradiance", "irradiance", 1.0, LIGHT),
        ("albedo", "albedo", 1.0, PAINT),
        ("melanin", "melanin", 1.0, 2 * PAINT),
        ("thickness", "thickness", 1.0, PAINT),
    ):
        found = sample_bilinear(baked.maps[name], uv)
        assert relative_rmse(found / factor, seen[of][skin]) < most, name


def test_a_head_drawn_with_the_maps_looks_the_same(
    renderer: Renderer, scene: Scene, baked: BakedMaps
) -> None:
    before = renderer.draw(scene, SETTINGS).linear()
    normal, area = baked.maps["normal"], baked.maps["stretch"][..., :2].prod(axis=-1)
    slopes = np.ascontiguousarray(-normal[..., :2] / normal[..., 2:], np.float32)
    rho_s = baked.maps["rho_s"]
    maps = Maps(colour=baked.maps["albedo"], normal=slopes, specular=rho_s, roughness=baked.maps["roughness"])
    mean = float(np.average(rho_s[baked.covered], weights=area[baked.covered]))
    skin = scene.skin.model_copy(update={"rho_s": mean})
    after = renderer.draw(scene.replace(head=replace(scene.head, maps=maps), skin=skin), SETTINGS).linear()
    assert relative_rmse(after, before) < DRAWN


def test_texels_outside_the_skin_are_not_black(baked: BakedMaps) -> None:
    assert 0.4 < baked.covered.mean() < 0.95
    albedo = baked.maps["albedo"]
    assert albedo.min() > 0.0
    assert albedo[~baked.covered].min() >= albedo[baked.covered].min()
    np.testing.assert_allclose(np.linalg.norm(baked.maps["normal"], axis=-1), 1.0, atol=1e-5)


def test_missing_pigments_and_thin_parts_are_noted(renderer: Renderer, scene: Scene) -> None:
    plain = replace(scene.head, maps=Maps())
    small = SETTINGS.model_copy(update={"transmission": "none"})
    found = bake(renderer, scene.replace(head=plain, skin={"profile": "gpu-gems-3"}), small, 256)
    assert set(found.absent) == {"melanin", "blood", "thickness"}
    assert not set(found.absent) & set(found.maps)


def test_files_read_back_with_the_range_stated_in_json(tmp_path: Path) -> None:
    folder = tmp_path / "maps"
    report = export_skin("human:7", "maps", folder, side=256, adapter="cpu", variant="directx")
    content = json.loads((folder / "maps.json").read_text("utf-8"))
    assert content["size"] == 256
    assert content["normal_green"].startswith("down")
    assert {file.name for file in report.files} >= {"albedo.exr", "albedo.png", "scattered.exr", "height.png"}
    for name, info in content["maps"].items():
        linear = read_image(folder / f"{name}.exr")
        assert linear.shape[:2] == (256, 256)
        if "png" not in info:
            continue
        levels = read_image(folder / f"{name}.png")
        decoded = _decode_png(levels, info)
        clipped = np.clip(linear, 0.0, info.get("white", np.inf)) if info["png"] == "sRGB" else linear
        step = 0.0065 * max(float(np.abs(clipped).max()), 1e-9)
        assert np.abs(decoded - clipped).max() < step, name


def _decode_png(levels: NDArray[Any], info: dict[str, Any]) -> NDArray[Any]:
    if info["png"] == "sRGB":
        return decode_srgb_levels(levels) * info.get("white", 1.0)
    fraction = levels / 65535
    rules = {"value = 2 level / 65535 - 1": 2 * fraction - 1, "value = (level / 65535)^2": fraction**2}
    if "black" in info:
        return np.asarray(info["black"] + fraction * (info["white"] - info["black"]))
    return np.asarray(rules.get(info["png"], fraction))


def test_green_channel_is_inverted_for_directx() -> None:
    normal = np.array([[[0.1, 0.2, 0.97]]], np.float32)
    np.testing.assert_array_equal(orient_normal_map(normal, "up"), normal)
    np.testing.assert_allclose(orient_normal_map(normal, "down"), [[[0.1, -0.2, 0.97]]])


def test_resampling_keeps_ramps() -> None:
    ramp = np.tile((np.arange(64, dtype=np.float32) + 0.5) / 64, (64, 1))
    np.testing.assert_allclose(resample_map(ramp, 16)[0], (np.arange(16) + 0.5) / 16, atol=1e-6)
    np.testing.assert_allclose(
        resample_map(ramp, 128)[0, 8:-8], ((np.arange(128) + 0.5) / 128)[8:-8], atol=1e-6
    )


def test_odd_sizes_and_skins_without_a_head_are_refused(tmp_path: Path) -> None:
    for side in (0, 300, 2**20, True):
        with pytest.raises(DermisError, match="power of two"):
            check_map_side(side)
    with pytest.raises(DermisError, match="a head"):
        export_skin(load_subject("skin1"), "maps", tmp_path / "maps")
    assert not (tmp_path / "maps").exists()
