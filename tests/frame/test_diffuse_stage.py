"""Diffusion over the atlas: NumPy twin, analytic solutions, and constants that stay constant."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import bent_plane, resting
from tolerances import FLAT, SHEARED_PEAK, SHEARED_VARIANCE, SPREAD_ENERGY, SPREAD_PEAK, SPREAD_VARIANCE, TWIN

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion import blur as diffuse
from dermis.frame.features.diffusion import combine
from dermis.frame.features.diffusion.pyramid import Blur, choose_halvings, make_levels
from dermis.frame.programs import FLOAT_TEXEL_FORMAT
from dermis.gpu import CommandList, Device, download, make_texture, upload
from dermis.mesh.primitives import plane, uv_sphere
from dermis.optics.profiles import load_profile

Floats = NDArray[np.float64]
PROFILE = load_profile("gpu-gems-3")
BLURRED = PROFILE.variance_mm2[1:]


def blur(
    device: Device, source: Floats, atlas: AtlasTextures, variances: Floats = BLURRED, **edge: Any
) -> list[Floats]:
    """Return the blurred levels of (n, n, 3) light, or of (n, n, 4) light with its coverage."""
    size = len(source)
    most = len(atlas.mips_for_blurs(edge.get("edge", "repeated"))) - 1
    halvings = choose_halvings(variances, atlas.median_texels_per_mm, most)
    space = make_levels(device, size, (halvings,), FLOAT_TEXEL_FORMAT)
    upload(device, space.stacks[0], np.dstack([source, np.ones((size, size))])[..., :4])
    frame = CommandList(device)
    diffuse.draw(frame, space, atlas, Blur(variances, np.zeros((len(variances), 3)), halvings, **edge))
    frame.submit()
    return [
        download(device, space.stacks[0], layer=k + 1)[..., :3].astype(float) for k in range(len(variances))
    ]


def random_atlas(size: int, shear: float) -> Atlas:
    """Return an atlas of varying stretch with empty texels, whose charts end at random."""
    rng = np.random.default_rng(11)
    stretch = np.exp(rng.uniform(np.log(0.2), np.log(12.0), (size, size, 2))).astype(np.float16)
    triangle = np.where(rng.random((size, size)) < 0.05, -1, 0).astype(np.int32)
    stretch[triangle < 0] = 0
    y, x = np.indices((size, size))
    room = np.stack([x, size - 1 - x, y, size - 1 - y], axis=-1)
    return replace(
        build_atlas(plane(40.0), size),
        triangle=triangle,
        stretch=stretch,
        shear=rng.uniform(-shear, shear, (size, size)).astype(np.float16),
        edge_distance=np.minimum(room, rng.integers(0, 40, room.shape)).astype(np.uint16),
    )


def metric(atlas: Atlas) -> Floats:
    return np.dstack([atlas.stretch, atlas.shear]).astype(float)


@pytest.mark.parametrize("shear", [0.0, 0.8])
@pytest.mark.parametrize("edge", ["repeated", "skipped"])
def test_blur_matches_numpy(device: Device, shear: float, edge: str) -> None:
    atlas = random_atlas(64, shear)
    source = np.random.default_rng(2).random((64, 64, 3)).astype(np.float32).astype(float)
    made = blur(device, source, resting(device, atlas), edge=edge)
    reach = atlas.edge_distance if edge == "repeated" else None
    for level, twin in zip(made, twins.levels(source, metric(atlas), reach, BLURRED), strict=True):
        assert np.abs(level - twin).max() < TWIN


def test_empty_texels_show_the_clear_colour(device: Device) -> None:
    """Black empty texels darken their surroundings; with the colour of constant light they do not."""
    atlas = build_atlas(plane(60.0, 2, uv_scale=0.7), 64)
    source, resources = atlas.coverage[..., None] * np.ones(4), resting(device, atlas)
    black, white = (
        blur(device, source, resources, edge="cleared", clear=(level,) * 3)[-1] for level in (0.0, 1.0)
    )
    assert black[atlas.coverage].min() < 0.8
    assert np.abs(white[atlas.coverage] - 1).max() < FLAT


def test_combined_blur_matches_numpy(device: Device) -> None:
    rng = np.random.default_rng(4)
    space = make_levels(device, 64, ((0,) * 6,), FLOAT_TEXEL_FORMAT)
    values = rng.random((5, 64, 64, 4)).astype(np.float32)
    for k, value in enumerate(values):
        upload(device, space.stacks[0], value, layer=k + 1)
    weight = rng.random((5, 3))
    into, frame = make_texture(device, (64, 64), "rgba32float"), CommandList(device)
    combine.draw(frame, space, Blur(np.arange(1.0, 6.0), weight, (0,) * 6), into)
    frame.submit()
    twin = np.einsum("kyxc,kc->yxc", values[..., :3].astype(float), weight)
    assert np.abs(download(device, into)[..., :3] - twin).max() < TWIN * twin.max()


UNIFORM = {"1 texel per mm": (256.0, 1.0), "2": (128.0, 1.0), "3": (256 / 3, 1.0), "6": (128 / 3, 1.0)}
UNEVEN = {"2 : 1": (128.0, 0.5), "4 : 1": (64.0, 0.25)}  # v takes that part of the map
# At 4 : 1 texels are 1 mm high: the narrow levels are finer than that, and only their moments mean something.


def patch(size_mm: float, v_scale: float) -> Atlas:
    return build_atlas(bent_plane(size_mm, [[1, 0, 0], [0, v_scale, 0]]), 256)


def point_of_light(atlas: Atlas) -> tuple[Floats, tuple[int, int], Floats, float]:
    """Return a lit texel of power 1 in the middle, its index, squared distances and its area [mm2]."""
    y, x = int(np.argwhere(atlas.coverage[:, 128])[:, 0].max()) // 2, 128
    source = np.zeros((256, 256, 3))
    source[y, x] = 1.0
    per_mm = atlas.stretch[y, x].astype(float)
    rows, columns = np.indices((256, 256))
    r2 = ((columns - x) / per_mm[0]) ** 2 + ((rows - y) / per_mm[1]) ** 2
    return source, (y, x), r2, 1.0 / float(per_mm.prod())


@pytest.mark.parametrize("name", [*UNIFORM, "2 : 1"])
def test_impulse_response_is_the_sum_of_gaussians(device: Device, name: str) -> None:
    """A lit texel of power 1 receives R(r) times its area; the unblurred level is left out."""
    atlas = patch(*(UNIFORM | UNEVEN)[name])
    source, (y, x), r2, area = point_of_light(atlas)
    parts = blur(device, source, resting(device, atlas))
    image = sum(weight * part for weight, part in zip(PROFILE.weight[1:], parts, strict=True))
    exact = twins.gaussian_sum(PROFILE, 1, r2) * area
    rows, columns = np.indices((256, 256))
    outside = (np.hypot(rows - y, columns - x) > 1.5) & (atlas.triangle >= 0)
    peak = np.minimum(exact[y, x], image[y, x])
    assert (np.abs(image - exact)[outside].max(axis=0) < SPREAD_PEAK * peak).all()
    assert np.allclose(image[atlas.coverage].sum(axis=0), PROFILE.weight[1:].sum(axis=0), rtol=SPREAD_ENERGY)


@pytest.mark.parametrize("name", UNIFORM | UNEVEN)
def test_impulse_response_is_round_with_the_given_variance(device: Device, name: str) -> None:
    """Compare the second moments along x and y [mm2] at every level."""
    atlas = patch(*(UNIFORM | UNEVEN)[name])
    source, (y, x), _, _ = point_of_light(atlas)
    per_mm = atlas.stretch[y, x].astype(float)
    rows, columns = np.indices((256, 256))
    parts = blur(device, source, resting(device, atlas))
    for variance, part in zip(BLURRED, parts, strict=True):
        image = np.where(atlas.coverage, part[..., 0], 0.0)
        along_x = (image * (columns - x) ** 2).sum() / per_mm[0] ** 2
        along_y = (image * (rows - y) ** 2).sum() / per_mm[1] ** 2
        assert along_x == pytest.approx(variance, rel=SPREAD_VARIANCE)
        assert along_y == pytest.approx(variance, rel=SPREAD_VARIANCE)


@pytest.mark.parametrize("size", [64, 200])
@pytest.mark.parametrize("mesh", [uv_sphere(40.0, 24, 12), plane(60.0, 2, uv_scale=0.7)])
def test_uniform_light_stays_uniform(device: Device, mesh: Any, size: int) -> None:
    """Constant light stays constant up to the edges of charts and in the gutter."""
    atlas = build_atlas(mesh, size)
    colour = np.array([1.0, 0.3, 2.7])
    source = atlas.coverage[..., None] * colour
    for level in blur(device, source, resting(device, atlas)):
        assert np.abs(level[atlas.coverage] / colour - 1).max() < FLAT
        assert not level[~atlas.coverage].any()


def test_axis_order_does_not_matter(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """With uniform stretch, blurring along v first gives the same result."""
    atlas = build_atlas(plane(40.0), 64)
    source = np.random.default_rng(9).random((64, 64, 3))
    resources, along = resting(device, atlas), diffuse._axis_program
    first = blur(device, source, resources)
    monkeypatch.setattr(diffuse, "_axis_program", lambda *given: along(*given[:2], 1 - given[2], *given[3:]))
    swapped = blur(device, source, resources)
    assert max(np.abs(a - b).max() for a, b in zip(first, swapped, strict=True)) < TWIN


def test_a_symmetric_patch_stays_symmetric(device: Device) -> None:
    atlas = build_atlas(plane(40.0), 64)
    source = np.random.default_rng(9).random((64, 64, 3))
    source = source + source.transpose(1, 0, 2)
    for level in blur(device, source, resting(device, atlas)):
        assert np.abs(level - level.transpose(1, 0, 2)).max() < TWIN * level.max()


@pytest.mark.parametrize("texels_per_mm", [1.0, 3.0, 6.0])
def test_single_wide_gaussian_is_smooth(device: Device, texels_per_mm: float) -> None:
    """Without a narrower level before it, the source must not be sampled sparsely."""
    atlas = build_atlas(plane(256 / texels_per_mm), 256)
    source, _, r2, area = point_of_light(atlas)
    (image,) = blur(device, source, resting(device, atlas), np.array([7.41]))
    exact = np.exp(-r2 / (2 * 7.41)) / (2 * np.pi * 7.41) * area
    assert np.abs(image[..., 0] - exact).max() < SPREAD_PEAK * exact.max()
    assert image[..., 0].sum() == pytest.approx(1.0, rel=SPREAD_ENERGY)


# u and v by the patch's places (x, y) from 0 to 1.
SHEARED = {
    "sheared 45": [[0.5, 0.5, 0.0], [0.0, 1.0, 0.0]],
    "sheared -45": [[0.5, -0.5, 0.5], [0.0, 1.0, 0.0]],
    "rotated 30": [[0.63, -0.36, 0.36], [0.36, 0.63, 0.0]],
    "4 : 1 sheared": [[0.8, 0.2, 0.0], [0.0, 0.25, 0.0]],
}


@pytest.mark.parametrize("name", SHEARED)
def test_sheared_maps_spread_light_in_circles(device: Device, name: str) -> None:
    """Compare with the sum of Gaussians by distance on the surface, in all directions."""
    mesh = bent_plane(60.0, SHEARED[name])
    atlas = build_atlas(mesh, 256)
    position = atlas.interpolate(mesh, mesh.positions)
    y, x = np.unravel_index(
        np.argmin(np.where(atlas.coverage, (position**2).sum(axis=-1), np.inf)), atlas.coverage.shape
    )
    source = np.zeros((256, 256, 3))
    source[y, x] = 1.0
    matrix = np.array(SHEARED[name])[:, :2]
    area = (60.0 / 256) ** 2 / abs(np.linalg.det(matrix))
    away = position - position[y, x]
    for variance, level in zip(BLURRED, blur(device, source, resting(device, atlas)), strict=True):
        if variance * 256**2 / 60**2 * np.linalg.eigvalsh(matrix @ matrix.T)[0] < 2.0:
            continue  # finer than the texels are wide
        image = np.where(atlas.coverage, level[..., 0], 0.0)
        exact = np.exp(-(away**2).sum(axis=-1) / (2 * variance)) / (2 * np.pi * variance) * area
        assert np.abs(image - exact)[atlas.coverage].max() < SHEARED_PEAK * exact.max()
        moments = np.einsum("yx,yxi,yxj->ij", image, away[..., :2], away[..., :2]) / image.sum()
        assert np.allclose(moments, variance * np.eye(2), atol=SHEARED_VARIANCE * variance)
