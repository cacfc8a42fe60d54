"""Lids on the device: they slide over the eyes as their twin in float64, and shade them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from setups import settings_of
from tolerances import SHAPE

from dermis import Human
from dermis.frame.features.shape import shape
from dermis.frame.features.shape.shape import PoseBytes, make_shape, shape_tables
from dermis.frame.features.surface.painting.painted_head import with_painted_maps
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, Device
from dermis.human.model import build_head
from dermis.human.skin.surface import lid_rings
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.pose import Pose
from dermis.mesh.subdivide import subdivide_head
from dermis.scene.camera import Camera
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene

Floats = NDArray[np.float64]


def bare(levels: int = 0) -> Head:
    return subdivide_head(build_head(Human().target_weights(), Maps(), "own", EyeLook(redness=0.0)), levels)


def test_lid_sliding_matches_numpy(device: Device) -> None:
    head = bare()
    rig = head.control_rig
    pose = Pose({"eyeBlinkLeft": 0.5, "eyeBlinkRight": 0.3, "eyeLookDownLeft": 0.6}, {"head": (5, 20, 0)})
    pose_arrays = pose.to_arrays(rig)
    made, frame = make_shape(device, shape_tables(device, head)), CommandList(device)
    words = (
        part.astype(np.float32).tobytes()
        for part in (rig.positions_mm, pose_arrays.weights, pose_arrays.matrices)
    )
    shape.draw(frame, made, PoseBytes(*words))
    frame.submit()
    found = np.frombuffer(device.handle.queue.read_buffer(made.surface["points"]), np.float32).reshape(-1, 3)
    assert rig.contact is not None
    expected = rig.posed_points_mm(pose_arrays)
    assert np.abs(found - expected).max() < SHAPE * np.abs(expected).max()
    free = replace(rig, contact=None).posed_points_mm(pose_arrays)
    assert np.abs(free - expected)[rig.contact.point].max() > 0.3  # it matters here


def test_lid_edges_lie_on_the_surface() -> None:
    for levels in (0, 1):
        head = bare(levels)
        pose_arrays = Pose({"eyeWideLeft": 0.8, "jawOpen": 0.3}, {"head": (0, 15, 0)}).to_arrays(
            head.control_rig
        )
        points = replace(head.control_rig, contact=None).posed_points_mm(pose_arrays)
        edges = head.control_rig.lid_edges_mm(pose_arrays)
        np.testing.assert_allclose(edges, points[lid_rings()[..., 1]], atol=1e-3)


def seen_from_front(renderer: Renderer, head: Head, parts: str) -> Floats:
    """Return a front view (256, 512) of the left eye, 20 pixels per mm, centred on the eye."""
    middle = np.array([28.4, 0.0, 14.0]) - head.centre_mm
    near = tuple(float(c) for c in middle)
    camera = Camera(position=(near[0], near[1], near[2] + 400), target=near, frame_mm=12.8)
    lamp = DirectionalLight(direction=(0, -0.5, -1), irradiance=(3, 3, 3))
    settings = settings_of(size=(512, 256), atlas=64, samples=4, parts=parts, shadow_size=2048)
    dark = replace(head, maps=Maps(colour=np.zeros((4, 4, 3), np.float32)))
    return np.asarray(renderer.draw(Scene(dark, lights=(lamp,), camera=camera), settings).linear()[..., 1])


def test_lids_shade_the_white(renderer: Renderer) -> None:
    below = seen_from_front(renderer, bare(1), "diffuse")
    at = 256 + 20 * 8
    lit = below[:, at - 3 : at + 4].mean(axis=1)
    seen = np.flatnonzero(lit > 0.1 * lit.max())
    middle = lit[(seen[0] + seen[-1]) // 2]
    assert lit[seen[0] + 6] < 0.8 * middle  # a third of a millimetre below the upper lid
    assert 0.2 < middle < 0.5  # of 3 / pi: no white of an eye is white


def test_tears_shine_along_the_lower_lid(renderer: Renderer) -> None:
    """Tears shine in a thin line below the middle of the eye."""
    shine = seen_from_front(renderer, bare(1), "specular")[180:, 236:277].max(axis=1)
    bright = np.flatnonzero(shine > 0.04)
    assert 2 <= len(bright) <= 16 and bright[-1] - bright[0] < 16


def test_the_caruncle_is_pink_and_wet(device: Device) -> None:
    head = Human(caucasian=0, asian=0).head(subdivide=0)
    maps = with_painted_maps(device, head, 1024).maps
    assert maps.colour is not None and maps.roughness is not None
    rings = lid_rings()[0]

    def painted(picture: NDArray[np.float32], points: NDArray[np.int64]) -> Floats:
        uv = head.mesh.uv[np.isin(head.mesh.point, points)]
        across, down = (uv * 1024).astype(int).T
        return np.asarray(picture[down, across], np.float64).reshape(len(uv), -1).mean(axis=0)

    inner, skin = (painted(maps.colour, points) for points in (rings[25:, 1], rings[10:20, 3]))
    assert inner[0] > 2.0 * skin[0] and inner[0] > 1.8 * inner[1] > 1.5 * inner[2] > 0.0
    assert (
        painted(maps.roughness, rings[25:, 1])[0] < 0.16 < 0.25 < painted(maps.roughness, rings[10:20, 3])[0]
    )
