"""Chains of blurs with intermediate levels: as accurate as a single blur, at a lower cost."""

from __future__ import annotations

import numpy as np
import pytest
from setups import resting
from test_diffuse_stage import point_of_light
from tolerances import SPREAD_ENERGY, SPREAD_PEAK

from dermis.atlas.build import build_atlas
from dermis.frame.features.atlas.textures import AtlasMip, _upload_coarser
from dermis.frame.features.diffusion import blur as diffuse
from dermis.frame.features.diffusion import combine
from dermis.frame.features.diffusion.kernels import add_intermediate_levels, blur_chain_cost
from dermis.frame.features.diffusion.pyramid import Blur, choose_halvings, make_levels
from dermis.frame.programs import FLOAT_TEXEL_FORMAT
from dermis.gpu import CommandList, Device, download, make_texture, upload
from dermis.mesh.primitives import plane
from dermis.optics.profiles import load_profile

MOST = 3
SIX = load_profile("gpu-gems-3").variance_mm2[1:]


@pytest.mark.parametrize("texels_per_mm", [1.5, 3.0, 6.0])
def test_one_gaussian_costs_less_than_six(texels_per_mm: float) -> None:
    """Compare the number of texel reads; a single blur costs two to five times as much."""
    six, at_once = (blur_chain_cost(list(v), texels_per_mm, MOST) for v in (SIX, SIX[-1:]))
    led, steps = add_intermediate_levels(SIX[-1:], texels_per_mm, MOST)
    assert blur_chain_cost(list(led), texels_per_mm, MOST) < min(six, 0.5 * at_once)
    assert led[-1] == SIX[-1] and steps == tuple(range(1, len(led)))


@pytest.mark.parametrize("texels_per_mm", [0.1, 0.75, 1.5, 3.0, 6.0])
def test_six_gaussians_need_no_intermediate_steps(texels_per_mm: float) -> None:
    led, steps = add_intermediate_levels(SIX, texels_per_mm, MOST)
    assert np.array_equal(led, SIX) and steps == ()


def test_intermediate_steps_are_separate_from_profile_levels() -> None:
    blur = Blur(np.array([1.0, 2.0, 3.0]), np.zeros((3, 3)), (0, 0, 1, 2), intermediate_levels=(1, 3))
    assert blur.profile_levels == (0, 2)


@pytest.mark.parametrize("texels_per_mm", [1.5, 3.0, 6.0])
def test_wide_gaussian_in_steps_equals_one_blur(device: Device, texels_per_mm: float) -> None:
    """Compare a blurred point of light with the analytic peak."""
    atlas = build_atlas(plane(256 / texels_per_mm), 256)
    coarser = _upload_coarser(
        device, AtlasMip(atlas.coverage, atlas.lit_mask, atlas.edge_distance, atlas.gutter, atlas.source)
    )
    textures, wanted = resting(device, atlas, coarser=coarser, median_texels_per_mm=texels_per_mm), SIX[-1:]
    source, _, r2, area = point_of_light(atlas)
    led, steps = add_intermediate_levels(wanted, textures.median_texels_per_mm, len(textures.coarser))
    halvings = choose_halvings(led, textures.median_texels_per_mm, len(textures.coarser))
    assert len(steps) > 0 and max(halvings) > 0
    weight = np.zeros((len(led), 3))
    weight[-1] = 1.0
    blur = Blur(led, weight, halvings, intermediate_levels=steps)
    space, into = (
        make_levels(device, 256, (halvings,), FLOAT_TEXEL_FORMAT),
        make_texture(device, (256, 256), FLOAT_TEXEL_FORMAT),
    )
    upload(device, space.stacks[0], np.dstack([source, np.ones((256, 256))]))
    frame = CommandList(device)
    diffuse.draw(frame, space, textures, blur)
    combine.draw(frame, space, blur, into)
    frame.submit()
    made = download(device, into)[..., 0].astype(float)
    exact = np.exp(-r2 / (2 * wanted[0])) / (2 * np.pi * wanted[0]) * area
    assert np.abs(made - exact).max() < SPREAD_PEAK * exact.max()
    assert made.sum() == pytest.approx(1.0, rel=SPREAD_ENERGY)
