"""Light through thin parts: twins, slabs and wedges lit from behind, spheres that let nothing through."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import thin_twins
import twins
from numpy.typing import NDArray
from setups import head_of, run_frame, scene_of
from tolerances import SLAB_THROUGH, TWIN

from dermis.assets.atlas import build_atlas
from dermis.assets.mesh import Mesh
from dermis.assets.primitives import uv_sphere, wedge
from dermis.assets.smooth_normals import smooth_normals
from dermis.gpu import Device, Frame, download, make_texture, upload
from dermis.gpu.textures import texture_from
from dermis.optics.diffusion.transmission import through_gaussians
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.rendering.atlas_textures import upload_atlas
from dermis.rendering.frame import Stages
from dermis.rendering.geometry import upload_geometry
from dermis.rendering.renderer import Renderer
from dermis.rendering.stages.transmission import Thin
from dermis.scene.lights import DirectionalLight

Floats = NDArray[np.float64]
PROFILE = load_profile("gpu-gems-3")
BLURRED = GaussianSum("blurred levels", PROFILE.variance_mm2[1:], PROFILE.weight[1:])
SIGMA = float(np.sqrt(PROFILE.variance_mm2[-1]))
BEHIND = DirectionalLight(direction=(0, 0, 1), irradiance=(1.0, 1.0, 1.0), shadows=False)


def unpacked(words: NDArray[np.uint32]) -> Floats:
    """What the shader stores: place, thickness, distances to the rim."""
    place = np.stack([words[..., 0] & 0xFFFF, words[..., 0] >> 16], axis=-1) / 65535.0
    return np.concatenate([place, np.ascontiguousarray(words[..., 1:]).view(np.float32)], axis=-1)


@pytest.mark.parametrize("thick", [(2.0, 2.0), (0.5, 14.0)])
def test_twin_of_what_lies_opposite(device: Device, stages: Stages, thick: tuple[float, float]) -> None:
    mesh = wedge(30.0, *thick, cells=2)
    atlas = build_atlas(mesh, 64)
    texels = upload_atlas(device, atlas).resources["atlas"]
    found = stages.opposite.find(mesh, upload_geometry(device, mesh, atlas), texels, 64, SIGMA)
    made = unpacked(download(device, found))
    assert (made[~atlas.own, 2] < 0).all()
    points, _ = twins.surface(atlas, head_of(mesh))
    normals = atlas.interpolate(mesh, smooth_normals(mesh, 1.0))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    inner = atlas.own & (np.abs(points[..., :2]).max(axis=-1) < 14.5)  # rays along an edge fall either way
    made, twin = made[inner], thin_twins.opposite(mesh, atlas, points[inner], normals[inner], SIGMA)
    thin = np.isfinite(twin[:, 2])
    assert np.mean(thin == (made[:, 2] < 1e5)) > 0.999
    both = thin & (made[:, 2] < 1e5)
    assert 0.5 < both.mean() <= 1.0
    error = np.abs(made - twin)[both]
    for column, close in enumerate((1e-3, 1e-3, 0.01, 0.01, 0.01)):
        assert np.mean(error[:, column] < close) > 0.99  # some rays meet an edge


def test_twin_of_what_comes_through(device: Device, stages: Stages) -> None:
    rng = np.random.default_rng(8)
    size, k = 32, len(BLURRED.weight)
    space = stages.diffuse.make_levels(size, k)
    levels = rng.random((k, size, size, 3)).astype(np.float32)
    for layer, level in enumerate(levels, start=1):
        upload(device, space.stack, np.dstack([level, np.ones((size, size))]), layer=layer)
    place = rng.integers(0, 1 << 16, (size, size, 2)).astype(np.uint32)
    shape = rng.uniform(0.0, 8.0, (size, size, 3)).astype(np.float32)
    shape[..., 2] = np.minimum(shape[..., 1], shape[..., 2])
    words = np.dstack([place[..., 0] | (place[..., 1] << 16), shape.view(np.uint32)])
    thin = Thin(texture_from(device, words, "rgba32uint"), make_texture(device, (size, size), "rgba32float"))
    frame = Frame(device)
    stages.transmission.draw(frame, space, thin, BLURRED.variance_mm2, BLURRED.weight)
    frame.submit()
    found = np.dstack([place / 65535.0, shape.astype(float)])
    twin = thin_twins.transmitted(levels.astype(float), found, BLURRED.variance_mm2, BLURRED.weight)
    assert twin.max() > 0.3
    assert np.abs(download(device, thin.light)[..., :3] - twin).max() < TWIN * twin.max()


def scattered(
    renderer: Renderer, mesh: Mesh, *lights: DirectionalLight, atlas: int = 128, **given: str
) -> tuple[Floats, Floats, Floats]:
    """(n, 3) places and normals of the texels that own surface, and the light that leaves them.

    The profile has its own colour; the level that is lit again is left out.
    """
    head = head_of(mesh)
    scene = scene_of(head, *(lights or (BEHIND,)), albedo="profile", rho_s=0.0)
    inputs = run_frame(renderer, scene, atlas=atlas, **given)
    texels = download(renderer.device, inputs.layouts[0].atlas.resources["atlas"])
    light = download(renderer.device, inputs.scattered)[..., :3].astype(float)
    own = texels[..., 0] > 0
    w = np.stack([texels[own][:, 1] & 0xFFFF, texels[own][:, 1] >> 16], axis=-1) / 65535.0
    w = np.column_stack([1 - w.sum(axis=1), w])
    corners = mesh.triangles[texels[own][:, 0].astype(int) - 1]
    points, normals = (np.einsum("nk,nkc->nc", w, a[corners]) for a in (mesh.positions, mesh.normals))
    return points, normals, light[own]


def front(renderer: Renderer, mesh: Mesh, *lights: DirectionalLight, **given: Any) -> tuple[Floats, Floats]:
    """Places of the texels of a wedge's front, and their light."""
    points, normals, light = scattered(renderer, mesh, *lights, **given)
    facing = normals[:, 2] > 0.9
    return points[facing], light[facing]


@pytest.mark.parametrize("thickness", [0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 20.0])
def test_a_slab_lets_through_what_the_profile_says(renderer: Renderer, thickness: float) -> None:
    """Far from its rim, in amount and colour: exp(-d^2 / 2v) of each Gaussian."""
    points, light = front(renderer, wedge(60.0, thickness, thickness))
    inner = light[np.abs(points[:, :2]).max(axis=1) < 14.0]
    assert len(inner) > 100
    exact = through_gaussians(BLURRED, thickness)
    assert np.abs(inner - exact).max() < SLAB_THROUGH * BLURRED.albedo.max()
    if thickness <= 3:
        assert np.abs(inner / exact - 1)[:, 0].max() < 5 * SLAB_THROUGH


def test_light_of_several_sources_adds_up(renderer: Renderer) -> None:
    mesh = wedge(40.0, 2.0, 2.0)
    slanting = DirectionalLight(direction=(1, 0.5, 1), irradiance=(0.2, 0.9, 0.4), shadows=False)
    before = DirectionalLight(direction=(0.3, 0, -1), irradiance=(0.7, 0.5, 0.4), shadows=False)
    lights = (BEHIND, slanting, before)
    apart = sum(front(renderer, mesh, light)[1] for light in lights)
    points, together = front(renderer, mesh, *lights)
    inner = np.abs(points[:, :2]).max(axis=1) < 10.0  # nearer the rim both sides' light is taken apart
    assert np.abs(together - apart)[inner].max() < 1e-3 * together.max()


def test_a_wedge_fades_without_a_step(renderer: Renderer) -> None:
    """From 0.5 to 20 mm: never brighter where thicker, and near what a slab lets through."""
    points, light = front(renderer, wedge(60.0, 0.5, 20.0, cells=8), atlas=256)
    middle = np.abs(points[:, 1]) < 15.0
    order = np.argsort(points[middle, 0])
    x, row = points[middle, 0][order] + 30.0, light[middle][order]
    half = np.arctan(19.5 / 120.0)
    thickness = (0.5 + x / 60.0 * 19.5) * np.cos(2 * half)
    exact = np.cos(half) * through_gaussians(BLURRED, thickness)
    away = (x > 8.0) & (x < 52.0)
    assert np.abs(row - exact)[away].max() < 0.03 * BLURRED.albedo.max()
    bins = np.array([row[(x >= k) & (x < k + 1), 0].mean() for k in range(4, 58)])  # a millimetre each
    assert (np.diff(bins) < 1e-3).all()
    assert np.abs(np.diff(bins, n=2)).max() < 0.02
    assert bins[-1] < 1e-3


def test_a_sphere_lets_nothing_through(renderer: Renderer) -> None:
    """Nothing doubles at the terminator."""
    ball = uv_sphere(20.0, 48, 24)
    on, off = (scattered(renderer, ball, transmission=t)[2] for t in ("thin", "none"))
    assert off.max() > 0.5
    assert np.abs(on - off).max() < 0.01 * off.max()


def test_nothing_comes_through_when_it_is_switched_off(renderer: Renderer) -> None:
    mesh = wedge(40.0, 2.0, 2.0)
    points, light = front(renderer, mesh, transmission="none")
    assert light[np.abs(points[:, :2]).max(axis=1) < 5.0].max() < 1e-3


def test_light_counts_once_where_both_sides_meet(renderer: Renderer) -> None:
    """Lit alike all around, a thin slab has no bright line along its rim."""
    mesh = wedge(40.0, 0.4, 0.4)
    everywhere = (BEHIND, DirectionalLight(direction=(0, 0, -1), irradiance=(1, 1, 1), shadows=False))
    points, light = front(renderer, mesh, *everywhere, atlas=256)
    inner = light[np.abs(points[:, :2]).max(axis=1) < 8.0]
    assert (light.max(axis=0) < 1.05 * inner.mean(axis=0)).all()
