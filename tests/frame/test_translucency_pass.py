"""The sum over pairs compared with its twin: by single invocations and teams, in few and many workgroups."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tolerances import TWIN
from translucency_twins import decoded, pairs_on, share_of, surface_of

from dermis.apps.viewer.views import draw_thickness
from dermis.atlas.build import build_atlas
from dermis.atlas.translucency.cells import divide_into_cells
from dermis.frame import programs
from dermis.frame.features.diffusion.pyramid import Blur, make_levels
from dermis.frame.features.translucency import passes as translucency
from dermis.frame.features.translucency import passes as translucency_weights
from dermis.frame.features.translucency.build import make_translucency_buffers, with_profile_weights
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.programs import FLOAT_TEXEL_FORMAT
from dermis.gpu import CommandList, Constants, Device, download, make_texture, upload
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere, wedge

Floats = NDArray[np.float64]
Index = NDArray[np.int64]
VARIANCE, WEIGHT = np.array([0.5, 7.0]), np.array([[0.1, 0.3, 0.4], [0.5, 0.2, 0.1]])
BLUR = Blur(VARIANCE, WEIGHT, (0, 0, 0))
ALONE: Constants = (("TEAM", 1), ("ROUND", 1))


@dataclass(frozen=True)
class Weighed:
    """Thin parts with the weights of their pairs, and the data that the sum reads.

    source, texel : (l,) source of each pair, and (n, 2) texel of each source
    share : (l, 3) fraction of a source's light that a pair transmits
    cell, first, end : (m,) packed x and y of each receiver, and the range of its pairs
    """

    thin: Translucency
    source: Index
    texel: Index
    share: Floats
    cell: Index
    first: Index
    end: Index


@pytest.fixture(scope="module")
def weighed(device: Device) -> Weighed:
    """Return the pairs of a small wedge with their weights."""
    return weighed_of(device, wedge(12.0, 1.0, 4.0, cells_per_side=2))


def weighed_of(device: Device, mesh: Mesh) -> Weighed:
    atlas = build_atlas(mesh, 64, "stitched")
    surface = surface_of(device, mesh, atlas)
    pairs = pairs_on(device, surface, atlas, divide_into_cells(atlas, float(np.sqrt(VARIANCE[-1]))))
    thin = with_profile_weights(device, make_translucency_buffers(device, surface, pairs), VARIANCE, WEIGHT)
    frame = CommandList(device)
    translucency_weights.draw_weights(frame, thin)
    frame.submit()
    words = read(device, thin.weights).reshape(-1, 2)[: pairs.count]
    texel = read(device, thin.source_points).reshape(-1, 8)[:, 7]
    sums = read(device, pairs.receiver_ranges).reshape(-1, 3)[: pairs.receivers[1]].astype(np.int64).T
    source = words[:, 0].astype(np.int64)
    return Weighed(thin, source, unpacked(texel), decoded(words[:, 1]), *sums)


def read(device: Device, buffer: Any) -> NDArray[np.uint32]:
    return np.frombuffer(device.handle.queue.read_buffer(buffer), np.uint32)


def unpacked(words: NDArray[Any]) -> Index:
    return np.stack([words & 0xFFFF, words >> 16], axis=-1).astype(np.int64)


def summed(
    device: Device, weighed: Weighed, levels: NDArray[np.float32], constants: Constants
) -> tuple[Floats, Floats]:
    """Return the (n, n, 3) light of the twin, and the (n, n, 4) light of the shader with its coverage.

    levels : (2, 64, 64, 3) blurred light
    """
    thin, side = weighed.thin, weighed.thin.pairs.cells.side
    space = make_levels(device, 64, (BLUR.halvings,), FLOAT_TEXEL_FORMAT)
    for layer, level in enumerate(levels, start=1):
        upload(device, space.stacks[0], np.dstack([level, np.ones((64, 64))]), layer=layer)
    frame = CommandList(device)
    translucency.draw(frame, space, BLUR, thin, constants)
    frame.submit()
    x, y = weighed.texel[weighed.source].T
    light = weighed.share * levels[thin.source_level, y, x]
    sums = np.zeros((side, side, 3))
    column, row = unpacked(weighed.cell).T
    for k in range(len(weighed.cell)):
        sums[row[k], column[k]] = light[weighed.first[k] : weighed.end[k]].sum(axis=0)
    return sums, download(device, thin.pairs.transmitted).astype(float)


@pytest.mark.parametrize("row", [1, 1024])
@pytest.mark.parametrize(("team", "at_once"), [(1, 1), (1, 4), (8, 2), (32, 4), (128, 1)])
def test_transmitted_light_matches_numpy(
    device: Device,
    weighed: Weighed,
    team: int,
    at_once: int,
    row: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(programs, "_WORKGROUPS_PER_ROW", row)
    levels = np.random.default_rng(8).random((2, 64, 64, 3)).astype(np.float32)
    twin, made = summed(device, weighed, levels, (("SIZE", 128), ("TEAM", team), ("ROUND", at_once)))
    assert twin.max() > 0.1
    assert np.abs(made[..., :3] - twin).max() < TWIN * twin.max()
    assert ((made[..., 3] == 1) == weighed.thin.pairs.cells.receiver_mask).all()


def test_bright_and_dim_light_have_equal_precision(device: Device, weighed: Weighed) -> None:
    """Sources from 1e-6 to 1e6 keep a relative precision of 14 bits."""
    powers = np.random.default_rng(9).uniform(-6, 6, (2, 64, 64, 3))
    twin, made = summed(device, weighed, (10**powers).astype(np.float32), ALONE)
    assert twin.max() > 1e4
    assert (np.abs(made[..., :3] - twin) <= 2.0**-14 * twin * 1.01).all()


def test_head_without_thin_parts_transmits_nothing(device: Device) -> None:
    ball = weighed_of(device, uv_sphere(30.0, 24, 12))
    assert ball.thin.pairs.count == 0
    frame = CommandList(device)
    translucency.draw(frame, make_levels(device, 64, (BLUR.halvings,), FLOAT_TEXEL_FORMAT), BLUR, ball.thin)
    frame.submit()
    light = download(device, ball.thin.pairs.transmitted)
    assert (light[..., :3] == 0).all()
    assert ((light[..., 3] == 1) == ball.thin.pairs.cells.receiver_mask).all()
    assert light[..., 3].any()


def test_thickness_view_shows_the_smallest_depth(device: Device, weighed: Weighed) -> None:
    thin = weighed.thin
    side, radius = thin.pairs.cells.side, thin.pairs.cells.radius_mm
    into = make_texture(device, (side, side), "r32float")
    upload(device, into, np.full((side, side), radius, np.float32))
    made = download(device, draw_thickness(device, thin, into)).astype(float)
    receiver = read(device, thin.pairs.pairs).reshape(-1, 3)[:, 1]
    points = [
        read(device, buffer).reshape(-1, words).view(np.float32).astype(float)
        for buffer, words in ((thin.receiver_points, 12), (thin.source_points, 8))
    ]
    one, other = points[0][receiver], points[1][weighed.source]
    to, normal, its_normal = other[:, :3] - one[:, :3], one[:, 4:7], other[:, 4:7]
    depth, apart = (to * its_normal).sum(axis=1), np.linalg.norm(to, axis=1)
    inward = 0.5 * (depth - (to * normal).sum(axis=1)) / apart
    share = share_of((normal * its_normal).sum(axis=1), inward)
    depth = np.where((share > 0) & (apart < radius), np.abs(depth), radius)
    expected = np.full((side, side), radius)
    column, row = unpacked(weighed.cell).T
    for k in range(len(weighed.cell)):
        expected[row[k], column[k]] = depth[weighed.first[k] : weighed.end[k]].min()
    assert np.abs(made - expected).max() < 1e-5 * radius
    assert made.min() < 0.5 * radius
