"""Light through thin parts: twins; slabs, wedges and a rolled rim lit from behind; spheres let none pass."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import translucency_twins
from numpy.typing import NDArray
from setups import head_of, run_frame, scene_of
from tolerances import SLAB_THROUGH
from translucency_truth import hook, straight

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.atlas.translucency.pairs import TranslucentPairs, _in_cells, find_pairs
from dermis.atlas.translucency.samples import Samples, giving, surface, taking, texels
from dermis.frame.passes.translucency_weights import upload_pairs, weigh
from dermis.frame.renderer import Renderer
from dermis.gpu import Device, download
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere, wedge
from dermis.optics.diffusion.models import through_gaussians
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene.lights import DirectionalLight

Floats = NDArray[np.float64]
Found = tuple[Mesh, Atlas, TranslucentPairs]
PROFILE = load_profile("gpu-gems-3")
BLURRED = GaussianSum("blurred levels", PROFILE.variance_mm2[1:], PROFILE.weight[1:])
SIGMA = float(np.sqrt(PROFILE.variance_mm2[-1]))
BEHIND = DirectionalLight(direction=(0, 0, 1), irradiance=(1.0, 1.0, 1.0), shadows=False)


@pytest.fixture(scope="module")
def found() -> Found:
    """The translucent pairs of a small wedge."""
    mesh = wedge(12.0, 1.0, 4.0, cells=2)
    atlas = build_atlas(mesh, 64, "stitched")
    return mesh, atlas, find_pairs(mesh, atlas, SIGMA)


def given_by(mesh: Mesh, atlas: Atlas, side: int) -> Samples:
    """All places that give light, paired or not."""
    return giving(mesh, atlas, texels(atlas), side, np.ones(len(mesh.triangles), bool))


def test_the_places_stand_for_all_of_the_surface(found: Found) -> None:
    mesh, atlas, table = found
    given = given_by(mesh, atlas, len(table.receiver))
    corners = mesh.positions[mesh.triangles].astype(float)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    ).sum()
    assert abs(given.area_mm2.sum() / (area / 2) - 1) < 0.05
    assert atlas.own[given.texel[:, 1], given.texel[:, 0]].all()
    assert len(np.unique(given.cell, axis=0)) == len(given.cell)


def test_twin_of_the_pairs(found: Found) -> None:
    mesh, atlas, table = found
    given = given_by(mesh, atlas, len(table.receiver))
    held = surface(atlas, texels(atlas), given.side)
    taken = taking(mesh, atlas, held, np.ones(len(mesh.triangles), bool))
    radius = float(table.radius_mm)
    shape = translucency_twins.lie(taken, given, radius)
    far = np.stack([translucency_twins.along(atlas, taken, given, radius, same) for same in (1.6, 0.4)])
    far[1] += 2.0 / atlas.stretch[atlas.own].min()  # what nine texels' mean may add
    receiver = table.receiver[taken.cell[:, 1], taken.cell[:, 0]]
    assert (receiver > 0).all()
    texel = {tuple(t): j for j, t in enumerate(given.texel)}
    names = np.array([texel[tuple(t)] for t in table.texel])
    unit = np.array([radius, radius, radius, 1.0]) / 65535.0
    wrong = 0
    for i, r in enumerate(receiver):
        part = slice(table.first[r], table.first[r + 1])
        j = names[table.source[part]]
        assert abs(len(j) - np.count_nonzero(shape[i, :, 2])) <= 2  # at the very edge of a ball
        made, (low, high) = table.geometry[part] * unit, np.minimum(far[:, i, j], radius)
        wrong += np.count_nonzero(np.abs(made[:, [0, 1, 3]] - shape[i, j]) > 2e-3)
        wrong += np.count_nonzero((made[:, 2] < low - 2e-3) | (made[:, 2] > high + 2e-3))
    assert wrong == 0


def test_a_narrow_profile_asks_for_no_more_cells_than_memory_holds() -> None:
    mesh = uv_sphere(100.0, 8)
    atlas = build_atlas(mesh, 64, "stitched")
    sources = _in_cells(given_by(mesh, atlas, 64), 0.01)
    assert sources.size.prod() < 2**22
    assert len(find_pairs(mesh, atlas, 0.01).source) == 0


@pytest.mark.parametrize("layout", ["mesh", "stitched", "unwrapped"])
def test_a_ball_smaller_than_the_profile_spreads_has_pairs(layout: str) -> None:
    """Its blurs read nearly all texels, gutters included, which show more than nine times its places."""
    mesh = uv_sphere(3.0, 48, 24)
    table = find_pairs(mesh, build_atlas(mesh, 64, layout), SIGMA)
    assert len(table.source) == table.first[-1] > 1000
    assert table.source.max() < len(table.texel)


def test_twin_of_what_passes(device: Device, found: Found) -> None:
    table = found[2]
    pairs = upload_pairs(device, table)
    words = read_buffer(device, weigh(device, pairs, BLURRED.variance_mm2, BLURRED.weight))
    assert (words.reshape(-1, 2)[:, 0] == table.source).all()
    radius, cell = pairs.radius_mm, pairs.spacing_mm
    unit = np.array([radius, radius, radius, 1.0]) / 65535.0
    depth, aside, far, share = (table.geometry * unit).T
    far[table.geometry[:, 2] == 65535] = np.inf
    shape, area = np.column_stack([depth, aside, share]), table.area_mm2.astype(float)[table.source]
    twin = translucency_twins.passed(shape, far, area, radius, cell, BLURRED.variance_mm2, BLURRED.weight)
    error = np.abs(translucency_twins.decoded(words.reshape(-1, 2)[:, 1]) - twin)
    assert twin.max() > 1e-3
    assert (error <= twin.max(axis=1, keepdims=True) / 400 + 1e-6).all()  # nine bits of the brightest


def test_what_passes_is_the_same_from_disk(
    device: Device,
    found: Found,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    variance, weight, made = BLURRED.variance_mm2, BLURRED.weight, 0
    plain = read_buffer(device, weigh(device, upload_pairs(device, found[2]), variance, weight))
    assert not list(tmp_path.rglob("*.arrays"))
    for key, factor in (("a", 1.0), ("a", 1.0), ("b", 1.0), ("b", 0.5)):
        words = weigh(device, upload_pairs(device, found[2], key), variance, factor * weight)
        assert np.array_equal(read_buffer(device, words), plain) == (factor == 1.0)
        made = len(list(tmp_path.rglob("*.arrays")))
    assert made == (3 if device.adapter.kind == "CPU" else 0)


def read_buffer(device: Device, buffer: Any) -> NDArray[np.uint32]:
    return np.frombuffer(device.handle.queue.read_buffer(buffer), np.uint32)


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
    light = download(renderer.device, inputs.resources.scattered)[..., :3].astype(float)
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


def test_a_rolled_rim_glows_evenly(renderer: Renderer) -> None:
    """No dark spots, no bright chains, and nearly all of the light that straight lines bring."""
    mesh = hook()
    points, normals, light = scattered(renderer, mesh, atlas=256)
    dark = (normals[:, 2] > 0.1) & (np.abs(points[:, 1]) < 5.0) & (points[:, 0] > -7.0)
    places, red = points[dark][::7], light[dark][::7, 0]
    exact = straight(mesh, places, BLURRED)
    assert 0.9 < red.sum() / exact.sum() < 1.05
    assert np.sqrt(((red - exact) ** 2).mean() / (exact**2).mean()) < 0.15
    bright = exact > 0.2 * exact.max()
    assert 0.7 < (red[bright] / exact[bright]).min() < (red[bright] / exact[bright]).max() < 1.4


@pytest.mark.parametrize("angle", [10.0, 45.0])
def test_a_wedge_lets_through_what_straight_lines_bring(renderer: Renderer, angle: float) -> None:
    mesh = wedge(60.0, 0.01, 120.0 * float(np.tan(np.radians(angle / 2))), cells=16)
    points, normals, light = scattered(renderer, mesh, atlas=512)
    half = np.radians(angle / 2)
    dark = normals @ [-np.sin(half), 0.0, np.cos(half)] > 0.99
    dark &= (points[:, 0] < -15.0) & (np.abs(points[:, 1]) < 15.0)
    exact = straight(mesh, points[dark][::9], BLURRED)
    assert abs(light[dark][::9, 0].sum() / exact.sum() - 1) < 0.06
