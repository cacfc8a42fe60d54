"""The sum over pairs against its twin: alone and in teams, in one row of workgroups and in many."""

from __future__ import annotations

import numpy as np
import pytest
import translucency_twins
from numpy.typing import NDArray
from tolerances import TWIN

from dermis.atlas.build import build_atlas
from dermis.atlas.translucency.pairs import TranslucentPairs, find_pairs
from dermis.frame.levels import FLOATS, Blur, make_levels
from dermis.frame.passes import translucency
from dermis.frame.passes.translucency_weights import upload_pairs
from dermis.frame.translucency import translucency_from
from dermis.gpu import Constants, Device, Frame, download, upload
from dermis.mesh.primitives import uv_sphere, wedge
from dermis.viewer.views import thickness_mm

Floats = NDArray[np.float64]
VARIANCE, WEIGHT = np.array([0.5, 7.0]), np.array([[0.1, 0.3, 0.4], [0.5, 0.2, 0.1]])
BLUR = Blur(VARIANCE, WEIGHT, (0, 0, 0))
ALONE: Constants = (("TEAM", 1), ("ROUND", 1))


@pytest.fixture(scope="module")
def table() -> TranslucentPairs:
    """The translucent pairs of a small wedge."""
    mesh = wedge(12.0, 1.0, 4.0, cells=2)
    return find_pairs(mesh, build_atlas(mesh, 64, "stitched"), float(np.sqrt(VARIANCE[-1])))


def summed(
    device: Device, table: TranslucentPairs, levels: NDArray[np.float32], constants: Constants
) -> tuple[Floats, Floats]:
    """(n, n, 3) and (n, n, 4) the twin's light, and the shader's with 1 where there is surface.

    levels : (2, 64, 64, 3) blurred light
    """
    space = make_levels(device, 64, 2, FLOATS)
    for layer, level in enumerate(levels, start=1):
        upload(device, space.stack, np.dstack([level, np.ones((64, 64))]), layer=layer)
    thin = translucency_from(device, upload_pairs(device, table), VARIANCE, WEIGHT)
    words = np.frombuffer(device.handle.queue.read_buffer(thin.weights), np.uint32).reshape(-1, 2)
    frame = Frame(device)
    translucency.draw(frame, space, BLUR, thin, constants)
    frame.submit()
    x, y = table.texel[table.source].astype(int).T
    light = translucency_twins.decoded(words[:, 1]) * levels[thin.layer, y, x]
    sums = np.stack([part.sum(axis=0) for part in np.split(light, table.first[1:-1].astype(int))])
    return sums[table.receiver], download(device, thin.light).astype(float)


@pytest.mark.parametrize("row", [1, 1024])
@pytest.mark.parametrize(("team", "at_once"), [(1, 1), (1, 4), (8, 2), (32, 4), (128, 1)])
def test_twin_of_what_comes_through(
    device: Device,
    table: TranslucentPairs,
    team: int,
    at_once: int,
    row: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(translucency, "_ROW", row)
    levels = np.random.default_rng(8).random((2, 64, 64, 3)).astype(np.float32)
    twin, made = summed(device, table, levels, (("SIZE", 128), ("TEAM", team), ("ROUND", at_once)))
    assert twin.max() > 0.1
    assert np.abs(made[..., :3] - twin).max() < TWIN * twin.max()
    assert ((made[..., 3] == 1) == (table.receiver > 0)).all()


def test_bright_and_dim_light_are_kept_alike(device: Device, table: TranslucentPairs) -> None:
    """Sources from a millionth to a million: 14 bits of each, over the whole range of floats."""
    powers = np.random.default_rng(9).uniform(-6, 6, (2, 64, 64, 3))
    twin, made = summed(device, table, (10**powers).astype(np.float32), ALONE)
    assert twin.max() > 1e4
    assert (np.abs(made[..., :3] - twin) <= 2.0**-14 * twin * 1.01).all()


def test_a_head_without_thin_parts_gets_nothing(device: Device) -> None:
    mesh = uv_sphere(30.0, 24, 12)
    table = find_pairs(mesh, build_atlas(mesh, 64, "stitched"), float(np.sqrt(VARIANCE[-1])))
    pairs = upload_pairs(device, table)
    thin = translucency_from(device, pairs, VARIANCE, WEIGHT)
    frame = Frame(device)
    translucency.draw(frame, make_levels(device, 64, 2, FLOATS), BLUR, thin)
    frame.submit()
    light = download(device, thin.light)
    assert len(table.source) == 0
    assert (light[..., :3] == 0).all()
    assert ((light[..., 3] == 1) == (table.receiver > 0)).all()
    assert light[..., 3].any()


def test_the_view_of_thickness_shows_the_least_depth(device: Device, table: TranslucentPairs) -> None:
    pairs = upload_pairs(device, table)
    depth = table.geometry[:, 0] * pairs.radius_mm / 65535
    least = [min(part, default=pairs.radius_mm) for part in np.split(depth, table.first[1:-1].astype(int))]
    assert (
        np.abs(thickness_mm(device, pairs) - np.array(least)[table.receiver]).max() < 1e-6 * pairs.radius_mm
    )
    assert min(least) < 0.5 * pairs.radius_mm
