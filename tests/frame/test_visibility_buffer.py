"""The visibility buffer in compute, compared with NumPy, and the absence of traces of the last frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, scene_of, settings_of

from dermis.frame.features.shape import shape
from dermis.frame.features.visibility import layers as visibility_buffer
from dermis.frame.features.visibility.layers import ViewLayers, draw_layers, make_layers
from dermis.frame.projection import parallel_shadow_view
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download
from dermis.mesh.head import Head
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane, uv_sphere
from dermis.scene.camera import Camera

Floats = NDArray[np.float64]
SIZE = (150, 100)
GRAZING = 1e-3  # samples this near an edge, as a share of the triangle, are left out
STEEP = 1e-5  # rounding of depths that change by most of their range within a pixel


def soup(count: int, seed: int = 3) -> Head:
    """Return triangles from far below a pixel to half of the picture, each with its own part of the maps."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform((-70, -45, -40), (70, 45, 40), (count, 1, 3))
    side = np.exp(rng.uniform(np.log(0.2), np.log(70.0), (count, 1, 1)))
    cells = int(np.ceil(np.sqrt(count)))
    cell = np.column_stack(np.divmod(np.arange(count), cells))[:, None]
    uv = np.add(cell, [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9)]) / cells
    positions = (middle + side * rng.uniform(-0.5, 0.5, (count, 3, 3))).reshape(-1, 3)
    corners = np.arange(3 * count).reshape(-1, 3)
    return head_of(build_mesh(positions, uv.reshape(-1, 2), corners, np.zeros(count), SKIN_MATERIALS))


@dataclass(frozen=True)
class Truth:
    """Depth of each sample (0 for nothing), triangle + 1, and whether both are unambiguous."""

    depth: Floats
    triangle: NDArray[np.int64]
    sure: NDArray[np.bool_]


@cache
def truth_of_soup(numbers: bytes) -> Truth:
    """Return the nearest of all triangles at the centre of every pixel, for a matrix."""
    head, clip = SOUP, np.frombuffer(numbers).reshape(4, 4)
    corners = np.c_[head.mesh.positions.astype(float), np.ones(len(head.mesh.positions))] @ clip.T
    width, height = SIZE
    y, x = np.mgrid[:height, :width] + 0.5
    at = np.stack((2 * x / width - 1, 1 - 2 * y / height, np.ones_like(x)), axis=-1)
    depths, close = [np.zeros_like(x)], np.zeros(x.shape, bool)
    for triangle in corners[head.mesh.triangles]:
        weights = at @ np.linalg.inv(triangle[:, [0, 1, 3]])
        shares = weights * triangle[:, 3]
        depth = weights @ triangle[:, 2]
        depths.append(np.where((shares >= 0).all(axis=-1), depth, 0.0))
        close |= (np.abs(shares) < GRAZING).any(axis=-1) & (shares > -GRAZING).all(axis=-1)
    every = np.stack(depths)
    second, first = np.sort(every, axis=0)[-2:]
    sure = ~close & ((first == 0) | (first - second > 2 * STEEP))
    return Truth(first, np.where(first > 0, every.argmax(axis=0), 0), sure)


def shown(layers: ViewLayers, renderer: Renderer, head: Head, camera: Camera, samples: int) -> Any:
    """Draw a view, and return its layers and matrices."""
    settings = settings_of(size=SIZE, samples=samples)
    inputs = renderer.prepare(scene_of(head, frontal(), camera=camera), settings)
    frame = CommandList(renderer.device)
    shape.draw(frame, inputs.resources.shape.shape, inputs.pose_bytes)
    draw_layers(frame, "nearest", layers, inputs.camera_views, inputs.resources.head)
    frame.submit()
    made = [download(renderer.device, layers.texture, layer=k) for k in range(layers.count)]
    return made, inputs.camera_views.clip_matrices_of_samples(SIZE)


SOUP = soup(600)
TURNED = Camera(position=(60, 50, 280), target=(3, 2, 0), up=(0.2, 1, 0), frame_mm=110)


@pytest.mark.parametrize("samples", [1, 4, 5])
@pytest.mark.parametrize("groups", [1, 4096])
@pytest.mark.parametrize("what", ["depth", "triangle", "triangle after depth"])
def test_triangles_of_all_sizes_are_drawn(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, what: str, groups: int, samples: int
) -> None:
    """Workgroups of few and of many triangles agree, with one or two words per sample."""
    monkeypatch.setattr(visibility_buffer, "_TARGET_WORKGROUP_COUNT", groups)
    monkeypatch.setattr(visibility_buffer, "_MAX_DEPTH_STEP_MM", 0.0 if "after" in what else 0.1)
    layers = make_layers(
        renderer.device, SIZE, samples, store_triangles=what != "depth", use_compute_pass=True
    )
    made, clips = shown(layers, renderer, SOUP, TURNED, samples)
    for layer, clip in zip(made, clips, strict=True):
        truth = truth_of_soup(clip.tobytes())
        assert truth.sure.mean() > 0.9 and 0.3 < (truth.depth > 0).mean() < 1
        assert len(np.unique(truth.triangle)) > 90
        if what == "depth":
            assert np.allclose(layer[truth.sure], truth.depth[truth.sure], rtol=0, atol=STEEP)
        else:
            assert np.array_equal(layer[truth.sure], truth.triangle[truth.sure])


def test_more_blocks_than_a_workgroup_list_are_drawn(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A workgroup of 128 triangles with 11 blocks each exceeds its list of 1024."""
    monkeypatch.setattr(visibility_buffer, "_TARGET_WORKGROUP_COUNT", 1)
    monkeypatch.setattr(visibility_buffer, "_CONSECUTIVE_TRIANGLES_PER_WORKGROUP", 128)
    head = head_of(plane(80.0, 8))
    layers = make_layers(renderer.device, SIZE, 1, store_triangles=True, use_compute_pass=True)
    (layer,), _ = shown(layers, renderer, head, front_camera(head, (0, 0, 0.1), frame_mm=31.0), 1)
    assert (layer > 0).all()


BALL = head_of(uv_sphere(12.0, 24, 12))


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("triangles", [False, True])
def test_tiles_are_cleared_between_views(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, triangles: bool, apart: bool
) -> None:
    """A ball that leaves tiles and returns leaves no trace, nor do layers that are no longer drawn."""
    monkeypatch.setattr(visibility_buffer, "_MAX_DEPTH_STEP_MM", 0.0 if apart else 0.1)
    options = {"store_triangles": triangles, "use_compute_pass": True}
    used = make_layers(renderer.device, SIZE, 2, **options)
    for aside, samples in ((40, 2), (-40, 2), (-40, 2), (5, 1), (40, 2), (500, 2)):
        camera = front_camera(BALL, (aside, 0, 0), frame_mm=80.0)
        fresh = make_layers(renderer.device, SIZE, 2, **options)
        left, right = (shown(layers, renderer, BALL, camera, samples)[0] for layers in (used, fresh))
        assert (right[0] > 0).any() == (aside < 500) and (right[1] > 0).any() == (aside < 500 and samples > 1)
        assert np.array_equal(left, right)


def test_depth_is_quantised_as_stated() -> None:
    """The depth range follows from the coarsest step of depth."""
    near, far = 250.0, 640.0
    scale = near / (far - near)
    eye = np.array([[3.3, 0, 0, 0], [0, 5, 0, 0], [0, 0, -scale, scale * (far - 5)], [0, 0, 1, 5]])
    seen, little = 3.0 * eye, 1e-3
    at_far, before = np.array([[1, 2, far - 5, 1], [1, 2, far - 5 - little, 1]])
    step = (seen[2] @ before) / (seen[3] @ before) - (seen[2] @ at_far) / (seen[3] @ at_far)
    assert visibility_buffer._max_distance_per_depth_mm(seen) == pytest.approx(little / step, rel=1e-4)
    parallel = parallel_shadow_view(np.array([0.0, 0.6, -0.8]), BALL.mesh.outline, 64)
    assert visibility_buffer._max_distance_per_depth_mm(parallel.clip) == pytest.approx(
        parallel.far - parallel.near
    )


@pytest.mark.filterwarnings("ignore:camera. expected a position outside the head")
@pytest.mark.parametrize(("eye", "ahead"), [((1, 0, 0), (0, 0, -50)), ((30, 120, 1), (0, -50, 0))])
def test_corners_on_the_camera_plane_are_handled(renderer: Renderer, eye: Any, ahead: Any) -> None:
    """Compare with the silhouettes of the rasteriser for triangles with a corner beside the eye."""
    ball = head_of(uv_sphere(60.0, 24, 12))
    target = tuple(np.add(eye, ahead).tolist())
    camera = Camera(position=eye, target=target, up=(0.1, 1, 0.2), frame_mm=60.0)
    covered = []
    for compute in (True, False):
        layers = make_layers(renderer.device, SIZE, 1, store_triangles=False, use_compute_pass=compute)
        (layer,), _ = shown(layers, renderer, ball, camera, 1)
        covered.append(layer > 0)
    assert 0.1 < covered[1].mean() < 0.95
    assert (covered[0] != covered[1]).mean() < 1e-3
