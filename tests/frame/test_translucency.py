"""Translucency compared with NumPy twins, and on slabs, wedges, a rolled rim and spheres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import head_of, run_frame, scene_of
from tolerances import SLAB_THROUGH, TWIN
from translucency_truth import hook, straight
from translucency_twins import (
    Lie,
    Points,
    along,
    decoded,
    far_of,
    giving,
    lie,
    pairs_on,
    passed,
    passes,
    surface_of,
    taking,
)

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.atlas.translucency.cells import Cells, divide_into_cells
from dermis.frame.features.translucency import passes as translucency_weights
from dermis.frame.features.translucency.build import (
    make_pair_buffers,
    make_translucency_buffers,
    with_profile_weights,
)
from dermis.frame.features.translucency.pair_search.search import search_pairs
from dermis.frame.features.translucency.resources import PairBuffers, Translucency
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, Device, download
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere, wedge
from dermis.optics.diffusion.models import gaussian_transmittance
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene.lights import DirectionalLight

Floats = NDArray[np.float64]
Index = NDArray[np.int64]
PROFILE = load_profile("gpu-gems-3")
BLURRED = GaussianSum("blurred levels", PROFILE.variance_mm2[1:], PROFILE.weight[1:])
SIGMA = float(np.sqrt(PROFILE.variance_mm2[-1]))
BEHIND = DirectionalLight(direction=(0, 0, 1), irradiance=(1.0, 1.0, 1.0), shadows=False)


@dataclass(frozen=True)
class Thin:
    """Thin parts with their pairs on a device, and the same pairs in NumPy.

    lie : geometry of all receivers and sources of the twin
    receiver, source : (l,) indices of each pair in the twin
    """

    mesh: Mesh
    atlas: Atlas
    pairs: PairBuffers
    taken: Points
    given: Points
    lie: Lie
    receiver: Index
    source: Index
    translucency: Translucency
    offset: NDArray[np.int64]

    @property
    def cells(self) -> Cells:
        return self.pairs.cells

    def of_pairs(self) -> Lie:
        return Lie(*(part[self.receiver, self.source] for part in vars(self.lie).values()))


@pytest.fixture(scope="module")
def thin(device: Device) -> Thin:
    """Return the translucent pairs of a small wedge."""
    mesh = wedge(12.0, 1.0, 4.0, cells_per_side=2)
    atlas = build_atlas(mesh, 64, "stitched")
    surface = surface_of(device, mesh, atlas)
    pairs = pairs_on(device, surface, atlas, divide_into_cells(atlas, SIGMA))
    found = weighed(device, pairs, surface)
    side = pairs.cells.side
    taken, given = taking(mesh, atlas, side), giving(mesh, atlas, side)
    receiver_cell = read(device, pairs.receivers[0]).reshape(-1, 4)[:, 2]
    number = np.full((side, side), -1)
    number[taken.cell[:, 1], taken.cell[:, 0]] = np.arange(len(taken.cell))
    source_number = np.full((side, side), -1)
    source_number[given.cell[:, 1], given.cell[:, 0]] = np.arange(len(given.cell))
    source_cell = read(device, pairs.sources[0])
    words = read(device, pairs.pairs).reshape(-1, 3)
    return Thin(
        mesh,
        atlas,
        pairs,
        taken,
        given,
        lie(taken, given),
        number[receiver_cell >> 16, receiver_cell & 0xFFFF][words[:, 1]],
        source_number[source_cell >> 16, source_cell & 0xFFFF][words[:, 0]],
        found,
        words[:, 2].astype(np.int64),
    )


def weighed(device: Device, pairs: PairBuffers, surface: dict[str, Any]) -> Translucency:
    """Return pairs on a surface with the weights of a profile."""
    made = with_profile_weights(
        device, make_translucency_buffers(device, surface, pairs), BLURRED.variance_mm2, BLURRED.weight
    )
    frame = CommandList(device)
    translucency_weights.draw_weights(frame, made)
    frame.submit()
    return made


def read(device: Device, buffer: Any) -> NDArray[np.uint32]:
    return np.frombuffer(device.handle.queue.read_buffer(buffer), np.uint32)


def test_cells_represent_the_whole_surface(device: Device, thin: Thin) -> None:
    corners = thin.mesh.positions[thin.mesh.triangles].astype(float)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    ).sum()
    assert abs(thin.given.area_mm2.sum() / (area / 2) - 1) < 0.05
    assert (thin.receiver >= 0).all() and (thin.source >= 0).all()
    for count, kind in ((thin.pairs.receivers[1], thin.receiver), (thin.pairs.sources[1], thin.source)):
        assert len(np.unique(kind)) == count > 100


def test_cells_match_numpy(device: Device, thin: Thin) -> None:
    """Compare the positions, areas, normals and the metric of cells."""
    words = read(device, thin.pairs.pairs).reshape(-1, 3)
    taken, given = (np.zeros(count, np.int64) for count in (thin.pairs.receivers[1], thin.pairs.sources[1]))
    taken[words[:, 1]], given[words[:, 0]] = thin.receiver, thin.source
    receivers = read(device, thin.translucency.receiver_points).reshape(-1, 12)
    sources = read(device, thin.translucency.source_points).reshape(-1, 8)
    for made, twin in ((receivers, thin.taken.chosen(taken)), (sources, thin.given.chosen(given))):
        assert np.abs(made[:, :3].view(np.float32) - twin.position).max() < TWIN * 12
        assert np.abs(made[:, 4:7].view(np.float32) - twin.normal).max() < TWIN
    x, y = thin.taken.texel[taken].T
    assert (receivers[:, 3] == x | (y << 16)).all()
    assert (sources[:, 7] == [x | (y << 16) for x, y in thin.given.texel[given].tolist()]).all()
    area = thin.given.area_mm2[given]
    assert np.abs(sources[:, 3].view(np.float32) - area).max() < TWIN * area.max()
    by = np.random.default_rng(3).normal(size=(2, len(taken)))
    e, g, f = receivers[:, 8:11].view(np.float32).astype(float).T
    square = e * by[0] ** 2 + g * by[1] ** 2 + 2 * f * by[0] * by[1]
    twin = far_of(thin.atlas, thin.taken.chosen(taken), *by) ** 2
    assert np.abs(square / twin - 1).max() < 5e-3  # halves in the stretch map


def test_pairs_match_numpy(thin: Thin) -> None:
    """Compare with a search by brute force: all relevant pairs are found once."""
    light = passes(thin.lie, thin.given.area_mm2, thin.cells)
    made = np.zeros(light.shape, np.int64)
    np.add.at(made, (thin.receiver, thin.source), 1)
    assert made.max() == 1
    sure = np.abs(thin.lie.square / thin.cells.radius_mm**2 - 1) > 1e-5
    assert made[(light > 1.001) & sure].all()
    assert not made[(light < 0.999) & sure].any()
    assert 1000 < made.sum() < 0.5 * made.size


def test_surface_distances_match_numpy(thin: Thin) -> None:
    """Compare the distances to the nearest copy in a chart or gutter."""
    by = (np.stack([thin.offset & 0xFFFF, thin.offset >> 16]).astype(np.uint16)).view(np.int16) / 8.0
    made = far_of(thin.atlas, thin.taken.chosen(thin.receiver), *by)
    nowhere = thin.offset == 0x80008000
    low, high = (along(thin.atlas, thin.taken, thin.given, same) for same in (1.6, 0.4))
    low, high = (far[thin.receiver, thin.source] for far in (low, high))
    texel = 1.0 / thin.atlas.stretch[thin.atlas.lit_mask].astype(float).min()
    near, radius = high < thin.cells.radius_mm - 2 * texel, thin.cells.radius_mm
    assert near.mean() > 0.1 and (~near).mean() > 0.1
    assert not nowhere[near].any()
    assert (np.abs(made - high)[near & (low > high - texel)] < 1.5 * texel).mean() > 0.98
    reached = ~nowhere & (made < radius)
    closer = (low - made)[reached] / texel
    assert closer.max() < 2.0 and (closer < 0.25).mean() > 0.995  # middles of patches, and not their edges


def test_transmitted_light_matches_numpy(device: Device, thin: Thin) -> None:
    words = read(device, thin.translucency.weights).reshape(-1, 2)
    assert (words[:, 0] == read(device, thin.pairs.pairs).reshape(-1, 3)[:, 0]).all()
    by = (np.stack([thin.offset & 0xFFFF, thin.offset >> 16]).astype(np.uint16)).view(np.int16) / 8.0
    far = far_of(thin.atlas, thin.taken.chosen(thin.receiver), *by)
    far[thin.offset == 0x80008000] = np.inf
    area = thin.given.area_mm2[thin.source]
    twin = passed(thin.of_pairs(), far, area, thin.cells, BLURRED.variance_mm2, BLURRED.weight)
    error = np.abs(decoded(words[:, 1]) - twin)
    assert twin.max() > 1e-3
    near = np.abs(far / thin.cells.radius_mm - 1) > 1e-3
    # nine bits of the brightest, and halves in the stretch map
    assert (error <= twin.max(axis=1, keepdims=True) / 400 + 2e-5)[near].all()


def test_equal_searches_give_equal_pairs(device: Device, thin: Thin) -> None:
    surface = surface_of(device, thin.mesh, thin.atlas)
    again = pairs_on(device, surface, thin.atlas, divide_into_cells(thin.atlas, SIGMA))
    for name in ("pairs", "receiver_ranges"):
        assert (read(device, getattr(again, name)) == read(device, getattr(thin.pairs, name))).all()
    weights = read(device, weighed(device, again, surface).weights)
    assert (weights == read(device, thin.translucency.weights)).all()


def test_a_narrow_profile_has_no_pairs(device: Device) -> None:
    mesh = uv_sphere(100.0, 8)
    atlas = build_atlas(mesh, 64, "stitched")
    pairs = pairs_on(device, surface_of(device, mesh, atlas), atlas, divide_into_cells(atlas, 0.01))
    assert pairs.count == 0 and pairs.cells.side == 64


@pytest.mark.parametrize("layout", ["mesh", "stitched", "unwrapped"])
def test_a_ball_smaller_than_the_profile_spreads_has_pairs(device: Device, layout: str) -> None:
    """The search works if blurs read nearly all texels, gutters included."""
    mesh = uv_sphere(3.0, 48, 24)
    atlas = build_atlas(mesh, 64, layout)
    pairs = pairs_on(device, surface_of(device, mesh, atlas), atlas, divide_into_cells(atlas, SIGMA))
    source, receiver, _ = read(device, pairs.pairs).reshape(-1, 3).T
    assert len(source) == pairs.count > 1000
    assert source.max() == pairs.sources[1] - 1 and receiver.max() == pairs.receivers[1] - 1
    cell, first, end = read(device, pairs.receiver_ranges).reshape(-1, 3).T
    assert len(np.unique(cell)) == len(cell) and (end - first).sum() == pairs.count


def test_cells_are_enlarged_when_pairs_exceed_memory(
    device: Device, thin: Thin, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(device, "max_storage_bytes", 12 * thin.pairs.count - 1)
    fewer = pairs_on(device, surface_of(device, thin.mesh, thin.atlas), thin.atlas, thin.cells)
    assert 0 < fewer.count < thin.pairs.count
    assert fewer.cells.cell_mm == pytest.approx(1.5 * thin.cells.cell_mm, rel=0.1)
    assert fewer.cells.radius_mm == thin.cells.radius_mm


def test_pairs_follow_a_surface_that_moves(device: Device, thin: Thin) -> None:
    """Pairs found at rest transmit as much light as pairs found on the moved surface."""
    head = head_of(thin.mesh)
    x, y, z = head.positions_mm.T.astype(float)
    moved = np.stack([1.1 * x, y + 0.02 * x * x, 0.8 * z + 0.1 * x], axis=-1).astype(np.float32)
    surface = surface_of(device, thin.mesh, thin.atlas, moved)
    there = search_pairs(device, surface, thin.cells)
    assert there is not None
    totals = []
    for pairs in (thin.pairs, make_pair_buffers(device, thin.cells, there)):
        share = decoded(read(device, weighed(device, pairs, surface).weights).reshape(-1, 2)[:, 1])
        cell, first, _ = read(device, pairs.receiver_ranges).reshape(-1, 3).T
        total = np.zeros((thin.cells.side, thin.cells.side, 3))
        order = np.argsort(first)
        total[cell[order] >> 16, cell[order] & 0xFFFF] = np.add.reduceat(share, first[order])
        totals.append(total)
    resting = decoded(read(device, thin.translucency.weights).reshape(-1, 2)[:, 1]).sum(axis=0)
    follow, anew = totals
    assert abs(anew.sum(axis=(0, 1)) / resting - 1).min() > 0.05
    assert np.sqrt(((follow - anew) ** 2).mean() / (anew**2).mean()) < 0.01


def scattered(
    renderer: Renderer, mesh: Mesh, *lights: DirectionalLight, atlas: int = 128, **given: str
) -> tuple[Floats, Floats, Floats]:
    """Return (n, 3) positions and normals of the texels with surface, and the light that leaves them.

    The profile has its own colour, and the unblurred level is left out.
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
    """Return the positions of the texels on the front of a wedge, and their light."""
    points, normals, light = scattered(renderer, mesh, *lights, **given)
    facing = normals[:, 2] > 0.9
    return points[facing], light[facing]


@pytest.mark.parametrize("thickness", [0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 20.0])
def test_slab_transmits_as_the_profile_states(renderer: Renderer, thickness: float) -> None:
    """Far from its rim, a slab transmits exp(-d^2 / 2v) of each Gaussian."""
    points, light = front(renderer, wedge(60.0, thickness, thickness))
    inner = light[np.abs(points[:, :2]).max(axis=1) < 14.0]
    assert len(inner) > 100
    exact = gaussian_transmittance(BLURRED, thickness)
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
    """From 0.5 to 20 mm, light never increases with thickness and stays close to that of a slab."""
    points, light = front(renderer, wedge(60.0, 0.5, 20.0, cells_per_side=8), atlas=256)
    middle = np.abs(points[:, 1]) < 15.0
    order = np.argsort(points[middle, 0])
    x, row = points[middle, 0][order] + 30.0, light[middle][order]
    half = np.arctan(19.5 / 120.0)
    thickness = (0.5 + x / 60.0 * 19.5) * np.cos(2 * half)
    exact = np.cos(half) * gaussian_transmittance(BLURRED, thickness)
    away = (x > 8.0) & (x < 52.0)
    assert np.abs(row - exact)[away].max() < 0.03 * BLURRED.albedo.max()
    bins = np.array([row[(x >= k) & (x < k + 1), 0].mean() for k in range(4, 58)])  # a millimetre each
    assert (np.diff(bins) < 1e-3).all()
    assert np.abs(np.diff(bins, n=2)).max() < 0.02
    assert bins[-1] < 1e-3


def test_sphere_transmits_no_light(renderer: Renderer) -> None:
    """Light is not counted twice at the terminator."""
    ball = uv_sphere(20.0, 48, 24)
    on, off = (scattered(renderer, ball, transmission=t)[2] for t in ("thin", "none"))
    assert off.max() > 0.5
    assert np.abs(on - off).max() < 0.01 * off.max()


def test_nothing_comes_through_when_it_is_switched_off(renderer: Renderer) -> None:
    mesh = wedge(40.0, 2.0, 2.0)
    points, light = front(renderer, mesh, transmission="none")
    assert light[np.abs(points[:, :2]).max(axis=1) < 5.0].max() < 1e-3


def test_light_counts_once_at_the_rim_of_a_slab(renderer: Renderer) -> None:
    """A thin slab in uniform light has no bright line along its rim."""
    mesh = wedge(40.0, 0.4, 0.4)
    everywhere = (BEHIND, DirectionalLight(direction=(0, 0, -1), irradiance=(1, 1, 1), shadows=False))
    points, light = front(renderer, mesh, *everywhere, atlas=256)
    inner = light[np.abs(points[:, :2]).max(axis=1) < 8.0]
    assert (light.max(axis=0) < 1.05 * inner.mean(axis=0)).all()


def test_a_rolled_rim_glows_evenly(renderer: Renderer) -> None:
    """There are no dark or bright spots, and the sum is close to that by straight lines."""
    mesh = hook()
    points, normals, light = scattered(renderer, mesh, atlas=256, interreflection=False)
    dark = (normals[:, 2] > 0.1) & (np.abs(points[:, 1]) < 5.0) & (points[:, 0] > -7.0)
    places, red = points[dark][::7], light[dark][::7, 0]
    exact = straight(mesh, places, BLURRED)
    assert 0.9 < red.sum() / exact.sum() < 1.05
    assert np.sqrt(((red - exact) ** 2).mean() / (exact**2).mean()) < 0.15
    bright = exact > 0.2 * exact.max()
    assert 0.7 < (red[bright] / exact[bright]).min() < (red[bright] / exact[bright]).max() < 1.4


@pytest.mark.parametrize("angle", [10.0, 45.0])
def test_wedge_transmits_light_along_straight_lines(renderer: Renderer, angle: float) -> None:
    mesh = wedge(60.0, 0.01, 120.0 * float(np.tan(np.radians(angle / 2))), cells_per_side=16)
    points, normals, light = scattered(renderer, mesh, atlas=512)
    half = np.radians(angle / 2)
    dark = normals @ [-np.sin(half), 0.0, np.cos(half)] > 0.99
    dark &= (points[:, 0] < -15.0) & (np.abs(points[:, 1]) < 15.0)
    exact = straight(mesh, points[dark][::9], BLURRED)
    assert abs(light[dark][::9, 0].sum() / exact.sum() - 1) < 0.06
