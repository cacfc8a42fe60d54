"""Diffusion on a moving surface: the light of the rest pose, the width of the moved surface, never stale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from atlas_reading import shown
from cut_meshes import cut_sphere
from numpy.typing import NDArray
from setups import head_of, scene_of, settings_of
from test_shape import bent, rebuilt, words
from tolerances import FLAT, HARMONIC, POSED

from dermis import Pose
from dermis.apps.validation.benchmarks.cases import pose_at_moment, with_test_rig
from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.frame.features.atlas.passes import draw_stretch
from dermis.frame.features.atlas.textures import upload_atlas
from dermis.frame.features.diffusion import blur as diffuse
from dermis.frame.features.diffusion.pyramid import Blur, choose_halvings, make_levels
from dermis.frame.features.shape import shape
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import PoseBytes, make_shape, shape_tables
from dermis.frame.programs import FLOAT_TEXEL_FORMAT
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, Device, download, upload
from dermis.mesh.head import Head
from dermis.optics.profiles import load_profile
from dermis.scene.lights import DirectionalLight

Floats = NDArray[np.float64]
SIDE, RADIUS = 256, 30.0
BLURRED = load_profile("gpu-gems-3").variance_mm2[1:]


@pytest.fixture(scope="module")
def head() -> Head:
    return head_of(cut_sphere(RADIUS, 20))


@pytest.fixture(scope="module")
def atlas(head: Head) -> Atlas:
    return build_atlas(head.mesh, SIDE, "stitched")


def spread(device: Device, head: Head, atlas: Atlas, pose_bytes: PoseBytes, light: Floats) -> list[Floats]:
    """Return the levels of (n, n, 1) light on a head in motion, each at its resolution."""
    made, textures = make_shape(device, shape_tables(device, head)), upload_atlas(device, atlas)
    most = len(textures.mips_for_blurs("repeated")) - 1
    halvings = choose_halvings(BLURRED, textures.median_texels_per_mm, most)
    space = make_levels(device, SIDE, (halvings,), FLOAT_TEXEL_FORMAT)
    upload(device, space.stacks[0], np.dstack([light, light, light, atlas.lit_mask[..., None]]))
    frame = CommandList(device)
    shape.draw(frame, made, pose_bytes)
    draw_stretch(frame, upload_geometry(device, head.mesh, atlas, made), textures)
    diffuse.draw(frame, space, textures, Blur(BLURRED, np.zeros((len(BLURRED), 3)), halvings))
    frame.submit()
    return [
        download(device, space.stacks[times], layer=k - space.first[times])[..., :1].astype(float)
        for k, times in enumerate(halvings)
        if k
    ]


@pytest.mark.parametrize("moment", range(0, 21, 5))
def test_uniform_light_stays_uniform_in_every_pose(
    device: Device, head: Head, atlas: Atlas, moment: int
) -> None:
    moving = with_test_rig(head, 12)
    pose_arrays = pose_at_moment(moving, moment).to_arrays(moving.control_rig)
    held = PoseBytes(
        words(pose_arrays.positions_mm), words(40 * pose_arrays.weights), words(pose_arrays.matrices)
    )
    light = np.ones((SIDE, SIDE, 1)) * atlas.lit_mask[..., None]
    for level in spread(device, moving, atlas, held, light):
        covered = level[..., 0] > 0
        assert covered.any() and np.abs(level[covered] - 1).max() < FLAT


@pytest.mark.parametrize("scale", [0.5, 0.8, 1.25, 2.0])
def test_scaled_ball_spreads_light_as_a_ball_of_that_size(
    device: Device, head: Head, atlas: Atlas, scale: float
) -> None:
    """A Gaussian of variance v reduces light that is linear in x by exp(-v / r^2)."""
    light = np.nan_to_num(shown(atlas, head.mesh, own=True))[..., :1] / RADIUS
    levels = spread(device, head, atlas, PoseBytes(words(scale * head.positions_mm)), light)
    area = atlas.lit_mask[..., None] / np.maximum(
        atlas.stretch.astype(float).prod(axis=-1, keepdims=True), 1e-6
    )
    for variance, level in zip(BLURRED, levels, strict=True):
        if len(level) == SIDE:  # the others are read between their texels
            left = (area * level * light).sum() / (area * light**2).sum()
            assert left == pytest.approx(np.exp(-variance / (scale * RADIUS) ** 2), abs=HARMONIC)


LIGHT = DirectionalLight(direction=(-1, -0.5, -1), irradiance=(3, 3, 3))


def picture(renderer: Renderer, head: Head, pose: Pose | None = None, **given: object) -> Floats:
    settings = settings_of(size=(96, 96), atlas=SIDE, samples=4, shadow_size=512, seams="stitch", **given)
    return renderer.draw(replace(scene_of(head, LIGHT), pose=pose), settings).linear().astype(float)


def apart(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).mean() / (b**2).mean()))


@pytest.mark.parametrize("technique", ["texture-space", "screen-space", "pre-integrated", "none"])
def test_a_posed_head_looks_like_one_loaded_in_that_shape(
    renderer: Renderer, head: Head, technique: str
) -> None:
    points = bent(head.positions_mm.astype(float)).astype(np.float32)
    posed = picture(renderer, head, Pose(positions_mm=points), technique=technique)
    other = replace(head, mesh=rebuilt(head.mesh, points.astype(float)))
    vars(other)["centre_mm"] = head.centre_mm
    assert apart(posed, picture(renderer, other, technique=technique)) < POSED
    assert apart(posed, picture(renderer, head, technique=technique)) > 10 * POSED


def test_rest_pose_equals_no_pose(renderer: Renderer, head: Head) -> None:
    moving = with_test_rig(head, 4)
    assert np.array_equal(picture(renderer, moving, Pose()), picture(renderer, moving))


def test_pose_reruns_dependent_stages_and_returning_is_exact(renderer: Renderer, head: Head) -> None:
    moving = with_test_rig(head, 4)
    first = picture(renderer, moving, pose_at_moment(moving, 1))
    picture(renderer, moving, pose_at_moment(moving, 2))
    ran = set(renderer.graph.executed_stages)
    assert {"shape", "shadows", "stretch", "surface", "irradiance", "visibility", "shade"} <= ran
    assert np.array_equal(picture(renderer, moving, pose_at_moment(moving, 1)), first)
    picture(renderer, moving, pose_at_moment(moving, 1))
    assert renderer.graph.executed_stages == []


def test_alternating_people_keep_their_gutters(head: Head) -> None:
    """Pairs of several people are cached, and the gutters that they share are rewritten for each."""
    alone, together = Renderer("cpu"), Renderer("cpu", cache_size=2)
    poses = [
        Pose(positions_mm=head.positions_mm * np.array(by, np.float32)) for by in ((1.2, 1, 1), (1, 0.8, 1))
    ]
    expected = [picture(alone, head, pose) for pose in poses]
    for turn in range(4):
        assert np.array_equal(picture(together, head, poses[turn % 2]), expected[turn % 2])
    assert "gutters" in together.graph.executed_stages
    assert apart(*expected) > POSED
