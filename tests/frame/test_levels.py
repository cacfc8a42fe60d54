"""Levels of lower resolution and of half precision, compared with full resolution in 32-bit floats."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cut_meshes import cut_sphere
from numpy.typing import NDArray
from setups import resting
from tolerances import FLAT, HALVED, HALVES, SPREAD_ENERGY

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.frame.features.atlas.textures import (
    AtlasMip,
    AtlasTextures,
    _upload_coarser,
    halve_mip,
    upload_atlas,
)
from dermis.frame.features.diffusion import blur as diffuse
from dermis.frame.features.diffusion import combine
from dermis.frame.features.diffusion.pyramid import (
    Blur,
    choose_halvings,
    half_precision_scale,
    levels_by_resolution,
    make_levels,
)
from dermis.frame.programs import FLOAT_TEXEL_FORMAT
from dermis.gpu import CommandList, Device, download, make_texture, upload
from dermis.mesh.primitives import plane
from dermis.optics.profiles import load_profile

Floats = NDArray[np.float64]
HALF = "rgba16float"
PROFILE = load_profile("gpu-gems-3")
BLURRED, WEIGHT = PROFILE.variance_mm2[1:], PROFILE.weight[1:]
SPHERE = cut_sphere(12.0, 20)


@pytest.fixture(scope="module")
def atlas() -> Atlas:
    """Return an atlas that is fine enough for light to be halved twice."""
    return build_atlas(SPHERE, 256, "stitched")


@pytest.fixture(scope="module")
def textures(device: Device, atlas: Atlas) -> AtlasTextures:
    return resting(device, atlas)


def test_cached_halvings_equal_computed_ones(
    device: Device, atlas: Atlas, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    first, second = upload_atlas(device, atlas), upload_atlas(device, atlas)
    assert len(list(tmp_path.rglob("*.arrays"))) == 1 and len(first.coarser) == len(second.coarser) == 3
    sheet = AtlasMip(atlas.coverage, atlas.lit_mask, atlas.edge_distance, atlas.gutter, atlas.source)
    for one, other in zip(first.coarser, second.coarser, strict=True):
        sheet = halve_mip(sheet)
        for made in (one, other):
            reach = download(device, made.resources["reach_map"])
            assert np.array_equal(reach & 0x7FFF, sheet.reach)
            assert np.array_equal(reach[..., 0] >> 15, sheet.covered & ~sheet.lit_mask)
        gutters = [device.handle.queue.read_buffer(made.gutter).tobytes() for made in (one, other)]
        words = np.concatenate([sheet.source.view(np.uint32), sheet.gutter], axis=1, dtype=np.uint32)
        assert one.sheared == other.sheared and gutters == [words.tobytes()] * 2


@pytest.fixture(scope="module")
def stripes(atlas: Atlas) -> Floats:
    """Return bands of light with hard edges over the sphere."""
    y = atlas.interpolate(SPHERE, SPHERE.positions)[..., 1]
    light = (np.sin(y / 1.5) > 0)[..., None] * np.array([1.0, 0.6, 0.3]) + 0.01
    return np.dstack([light, np.ones(y.shape)]) * atlas.lit_mask[..., None]


def combined(
    device: Device, texel: str, textures: AtlasTextures, light: Floats, scale: float = 1.0
) -> tuple[Floats, tuple[int, ...]]:
    """Return the sum of the blurred levels, and how often each was halved."""
    side, halvings = (
        len(light),
        choose_halvings(BLURRED, textures.median_texels_per_mm, len(textures.coarser)),
    )
    blur = Blur(BLURRED, WEIGHT, halvings, scale)
    space = make_levels(device, side, (halvings,), texel)
    into = make_texture(device, (side, side), FLOAT_TEXEL_FORMAT)
    upload(device, space.stacks[0], light * [scale, scale, scale, 1.0])
    frame = CommandList(device)
    diffuse.draw(frame, space, textures, blur)
    combine.draw(frame, space, blur, into)
    frame.submit()
    return download(device, into)[..., :3].astype(float), halvings


def error(made: Floats, exact: Floats, own: NDArray[np.bool_]) -> float:
    """Return the relative RMSE."""
    return float(np.sqrt(((made - exact)[own] ** 2).mean() / (exact[own] ** 2).mean()))


@pytest.mark.parametrize("texel", [FLOAT_TEXEL_FORMAT, HALF])
def test_coarser_levels_show_the_same(
    device: Device, atlas: Atlas, textures: AtlasTextures, stripes: Floats, texel: str
) -> None:
    whole, once = combined(device, FLOAT_TEXEL_FORMAT, replace(textures, coarser=()), stripes)
    made, halvings = combined(device, texel, textures, stripes)
    assert max(once) == 0 and max(halvings) == 2
    assert error(made, whole, atlas.lit_mask) < HALVED
    assert made[atlas.lit_mask].sum() == pytest.approx(whole[atlas.lit_mask].sum(), rel=SPREAD_ENERGY)


@pytest.mark.parametrize("texel", [FLOAT_TEXEL_FORMAT, HALF])
def test_constant_light_stays_constant_at_every_resolution(
    device: Device, atlas: Atlas, textures: AtlasTextures, texel: str
) -> None:
    made, _ = combined(device, texel, textures, np.ones((256, 256, 4)) * atlas.lit_mask[..., None])
    close = FLAT if texel == FLOAT_TEXEL_FORMAT else HALVES
    assert np.abs(made[atlas.lit_mask] / WEIGHT.sum(axis=0) - 1).max() < close


def test_excess_variance_of_halving_is_subtracted_from_the_next_level(device: Device) -> None:
    """With texels of 1 mm halving adds more than 0.4 mm2 to the second level; the third compensates."""
    atlas = build_atlas(plane(256.0), 256)
    coarser = _upload_coarser(
        device, AtlasMip(atlas.coverage, atlas.lit_mask, atlas.edge_distance, atlas.gutter, atlas.source)
    )
    textures = resting(device, atlas, coarser=coarser, median_texels_per_mm=2.0)
    variances = np.array([0.5, 0.9, 3.0])
    halvings = choose_halvings(variances, 2.0, len(coarser))
    space, light = make_levels(device, 256, (halvings,), FLOAT_TEXEL_FORMAT), np.zeros((256, 256, 4))
    light[..., 3], light[128, 128, :3] = 1.0, 1.0
    upload(device, space.stacks[0], light)
    frame = CommandList(device)
    diffuse.draw(frame, space, textures, Blur(variances, np.zeros((3, 3)), halvings))
    frame.submit()
    assert halvings == (0, 0, 1, 1)
    for level, variance in ((2, 0.5 + 1.0), (3, 3.0)):
        made = download(device, space.stacks[1], layer=level - space.first[1])[..., 0].astype(float)
        x = 2 * np.arange(128) + 0.5 - 128  # from the lit texel [mm]
        middle = (made.sum(axis=0) @ x) / made.sum()
        wide = (made.sum(axis=0) @ (x - middle) ** 2) / made.sum()
        assert wide == pytest.approx(variance - 4 * 3 / 16, rel=0.01)  # what reading between texels will add


def test_levels_are_stored_only_at_their_resolutions() -> None:
    """Each resolution stores its levels and the last finer one; several layouts share the union of both."""
    assert levels_by_resolution(((0,),)) == (range(1),)
    assert levels_by_resolution(((0, 0, 0, 1, 1, 2),)) == (range(3), range(2, 5), range(4, 6))
    assert levels_by_resolution(((0, 0, 0, 1, 1, 2), (0, 0, 1, 1, 1, 1))) == (
        range(3),
        range(1, 6),
        range(4, 6),
    )


@pytest.mark.parametrize("brightest", [1.0, 5e5, 3e-6, 1e9])
def test_half_precision_keeps_the_light(
    device: Device, atlas: Atlas, textures: AtlasTextures, stripes: Floats, brightest: float
) -> None:
    """Half precision keeps the amount of light and its position, however bright it is."""
    light = stripes * [brightest, brightest, brightest, 1.0]
    floats, _ = combined(device, FLOAT_TEXEL_FORMAT, textures, light)
    halves, _ = combined(device, HALF, textures, light, half_precision_scale(HALF, brightest))
    assert error(halves, floats, atlas.lit_mask) < HALVES
    assert halves[atlas.lit_mask].sum() == pytest.approx(floats[atlas.lit_mask].sum(), rel=HALVES / 4)


@pytest.mark.parametrize("brightest", [0.0, 5e-324, 1e-40, 1e-30, 0.3, 3.0, 1e12])
def test_scales_are_powers_of_two(brightest: float) -> None:
    """Scales are powers of two that a 32-bit float holds, however little light there is."""
    scale = half_precision_scale(HALF, brightest)
    assert np.frexp(scale)[0] == 0.5 and scale * brightest <= 16
    assert scale < np.finfo(np.float32).max and 1 / scale > np.finfo(np.float32).tiny
    assert half_precision_scale(FLOAT_TEXEL_FORMAT, brightest) == 1.0


@pytest.mark.parametrize(("texels_per_mm", "most"), [(0.5, 3), (3.0, 3), (30.0, 3), (30.0, 1), (1e6, 3)])
def test_resolution_falls_step_by_step(texels_per_mm: float, most: int) -> None:
    found = choose_halvings(BLURRED, texels_per_mm, most)
    assert len(found) == len(BLURRED) + 1 and found[:2] == (0, 0)
    assert set(np.diff(found)) <= {0, 1} and max(found) <= most
    assert (max(found) > 0) == (texels_per_mm > 1.0)


def test_halved_atlas_covers_the_same_surface(device: Device, atlas: Atlas, textures: AtlasTextures) -> None:
    """Stretch and distances to the edge are halved, and gutters copy the same positions."""
    coarse = halve_mip(
        AtlasMip(atlas.coverage, atlas.lit_mask, atlas.edge_distance, atlas.gutter, atlas.source)
    )
    own, made = coarse.lit_mask, textures.coarser[0].resources
    metric = download(device, made["stretch_map"]).astype(np.float64)
    assert np.array_equal(metric[..., 0] > 0, coarse.covered)
    y, x = np.nonzero(own)
    ratio = metric[y, x, :2] / atlas.stretch[2 * y, 2 * x].clip(1e-3)
    assert np.median(ratio) == pytest.approx(0.5, 1e-2)
    assert (2 * coarse.reach[..., 0] <= atlas.edge_distance[::2, ::2, 0].max() + 1).all()
    assert own[atlas.lit_mask[::2, ::2]].all() and len(coarse.gutter) > 50
    assert not own[coarse.gutter[:, 1], coarse.gutter[:, 0]].any()
    sources = np.rint(coarse.source).astype(int)
    assert own[sources[:, 1], sources[:, 0]].mean() > 0.98
    apart = shown_apart(atlas, coarse)
    assert np.percentile(apart, 98) < 1.5  # texels of the whole atlas, between what shows at the same place


def shown_apart(atlas: Atlas, coarse: AtlasMip) -> Any:
    """Return the distance of each halved texel's source from the mean source of its four [texel]."""
    source = np.full((256, 256, 2), np.nan)
    source[atlas.gutter[:, 1], atlas.gutter[:, 0]] = atlas.source
    x, y = 2 * coarse.gutter.astype(int).T
    four = np.stack([source[y + j, x + i] for j in (0, 1) for i in (0, 1)])
    whole = np.isfinite(four).all(axis=(0, 2)) & (np.ptp(four, axis=0).max(axis=-1) < 3)
    return np.linalg.norm(four[:, whole].mean(axis=0) - (2 * coarse.source[whole] + 0.5), axis=-1)
