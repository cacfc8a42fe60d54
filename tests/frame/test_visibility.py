"""Each sample sees the first triangle that a ray through it hits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, joined, place, run_frame, scene_of

from dermis.frame.features.visibility.layers import draw_layers, make_layers
from dermis.frame.projection import pixel_sample_positions
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download
from dermis.mesh.head import Head
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane, uv_sphere
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
SIZE = (36, 20)
GRAZING = 3e-3  # rays this near an edge, as a share of the triangle: corners snap to 1/256 of a pixel


def rays(scene: Scene, offset: Floats) -> tuple[Floats, Floats]:
    """Return the eye, and (h, w, 3) directions through an offset (0 to 1) in each pixel."""
    camera: Camera = scene.camera
    eye = np.add(camera.position, scene.head.centre_mm)
    forward = np.subtract(camera.target, camera.position)
    distance = np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward) / distance
    width, height = SIZE
    y, x = np.mgrid[:height, :width]
    per_pixel = camera.frame_mm / height
    sideways = (x + offset[0] - width / 2) * per_pixel
    upward = (height / 2 - y - offset[1]) * per_pixel
    return eye, forward + sideways[..., None] * right + upward[..., None] * up


def first_hit(head: Head, eye: Floats, ray: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return index + 1 of the nearest triangle on each ray, and whether no edge is close."""
    a, b, c = np.moveaxis(head.mesh.positions[head.mesh.triangles].astype(float), 1, 0)
    flat = ray.reshape(-1, 1, 3)
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((a - eye) * normal).sum(-1) / (flat * normal).sum(-1)
        place = eye + t[..., None] * flat
        area = (normal**2).sum(-1)
        weights = [(np.cross(q - p, place - p) * normal).sum(-1) / area for p, q in ((a, b), (b, c), (c, a))]
        least = np.min(weights, axis=0)
        t = np.where((least >= 0) & (t > 0), t, np.inf)
        sure = ~(np.abs(least) < GRAZING).any(axis=1)
    hit = np.where(np.isfinite(t.min(axis=1)), t.argmin(axis=1) + 1, 0)
    shape = ray.shape[:2]
    return hit.reshape(shape), sure.reshape(shape)


HEADS = {
    "sphere": head_of(uv_sphere(30.0, 12, 8)),
    "one before the other": head_of(
        joined((plane(60.0, 2), (0, 0, 0), (0, 0, 0.5)), (plane(30.0, 2), (10, 5, 40), (0.5, 0.5, 0.5)))
    ),
}


def view_of(head: Head, turned: bool) -> Scene:
    """Return a front view without pixel centres on edges, or a rolled view from the upper right."""
    camera = front_camera(head, (0.7, 0.4, 0))
    if turned:
        eye, target = place(head, (120, 80, 240)), place(head, (5, 0, 0))
        camera = Camera(position=eye, target=target, up=(0.3, 1, 0), frame_mm=70)
    return scene_of(head, frontal(), camera=camera)


def nearest(
    renderer: Renderer, scene: Scene, *, triangles: bool, compute: bool, samples: int
) -> list[NDArray[Any]]:
    """Return the layers for the samples of a pixel by one of the two implementations."""
    inputs = run_frame(renderer, scene, size=SIZE, samples=samples)
    layers = make_layers(renderer.device, SIZE, samples, store_triangles=triangles, use_compute_pass=compute)
    frame = CommandList(renderer.device)
    draw_layers(frame, "nearest", layers, inputs.camera_views, inputs.resources.head)
    frame.submit()
    return [download(renderer.device, layers.texture, layer=k) for k in range(samples)]


@pytest.mark.parametrize("samples", [1, 3])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize("compute", [False, True])
def test_visible_triangles_match_ray_casting(
    renderer: Renderer, compute: bool, name: str, turned: bool, samples: int
) -> None:
    scene = view_of(HEADS[name], turned)
    made = nearest(renderer, scene, triangles=True, compute=compute, samples=samples)
    for layer, offset in zip(made, pixel_sample_positions(samples), strict=True):
        expected, sure = first_hit(scene.head, *rays(scene, offset))
        assert sure.mean() > 0.9 and 0.1 < (expected > 0).mean() < 1
        assert np.array_equal(layer[sure], expected[sure])
        assert ((layer > 0) == (expected > 0)).mean() > 0.99


@pytest.mark.parametrize("name", HEADS)
def test_both_methods_give_the_same_depth(renderer: Renderer, name: str) -> None:
    scene = view_of(HEADS[name], True)
    by_raster, by_compute = (
        nearest(renderer, scene, triangles=False, compute=way, samples=1)[0] for way in (False, True)
    )
    _, sure = first_hit(scene.head, *rays(scene, pixel_sample_positions(1)[0]))
    assert by_raster.max() < 1 and (by_raster > 0).any()
    # corners that snap to 1/256 of a pixel move the rasteriser's depth by a little of its slope
    assert np.abs(by_raster - by_compute)[sure].max() < 2e-3


@pytest.mark.parametrize("compute", [False, True])
def test_frame_has_no_holes(renderer: Renderer, compute: bool) -> None:
    """All pixels of a closed ball are covered, those on shared edges too."""
    head = head_of(uv_sphere(30.0, 64, 32))
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=24.0))
    for layer in nearest(renderer, scene, triangles=True, compute=compute, samples=4):
        assert (layer > 0).all()


@pytest.mark.parametrize("compute", [False, True])
def test_triangles_crossing_the_camera_plane_are_clipped(renderer: Renderer, compute: bool) -> None:
    """A floor below the camera is visible in front of it."""
    floor = plane(400.0)
    head = head_of(
        build_mesh(
            floor.positions[:, [0, 2, 1]] * [1, 1, -1],
            floor.uv,
            floor.triangles,
            floor.material,
            SKIN_MATERIALS,
        )
    )
    camera = Camera(position=place(head, (0, 30, 0)), target=place(head, (0, 0, -60)), frame_mm=60)
    (layer,) = nearest(
        renderer, scene_of(head, frontal(), camera=camera), triangles=True, compute=compute, samples=1
    )
    assert (layer[-5:] > 0).all()


@pytest.mark.parametrize("triangles", [False, True])
def test_previous_view_leaves_no_trace(renderer: Renderer, triangles: bool) -> None:
    """Layers that are drawn again hold only the new view."""
    options = {"store_triangles": triangles, "use_compute_pass": True}
    used, fresh = (make_layers(renderer.device, SIZE, 2, **options) for _ in range(2))
    for turned, layers in ((False, used), (True, used), (True, fresh)):
        inputs = run_frame(renderer, view_of(HEADS["sphere"], turned), size=SIZE, samples=2)
        frame = CommandList(renderer.device)
        draw_layers(frame, "nearest", layers, inputs.camera_views, inputs.resources.head)
        frame.submit()
    for layer in range(2):
        left, right = (download(renderer.device, layers.texture, layer=layer) for layers in (used, fresh))
        assert (right > 0).any() and np.array_equal(left, right)


@pytest.mark.parametrize("count", [1, 2, 5, 8, 64])
def test_samples_are_even_in_both_axes(count: int) -> None:
    """Each of `count` columns and rows of the pixel has one sample, and their mean is close to the centre."""
    places = pixel_sample_positions(count)
    assert places.shape == (count, 2) and (places >= 0).all() and (places < 1).all()
    assert sorted((places[:, 0] * count).astype(int)) == list(range(count))
    assert len({tuple(p) for p in places}) == count
    assert np.abs(places.mean(axis=0) - 0.5).max() < 0.5 / count + 1e-12


def test_one_sample_is_the_centre() -> None:
    assert pixel_sample_positions(1).tolist() == [[0.5, 0.5]]
