"""Eyes for path tracing: refraction by the cornea, and the clear part of the eyeball."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from painted_ball import ball, paint

from dermis.apps.truths.mitsuba_scene import load_mitsuba, mesh_shape, mitsuba_sensor, mitsuba_variant
from dermis.apps.truths.person import shapes as eyes
from dermis.apps.truths.person.person import Person
from dermis.mesh.eye_look import EYE_LOOK_RANGES
from dermis.mesh.eyeball import CORNEA_MM, LIMBUS_MM, SCLERA_MM, apex_mm, cornea_centre_mm, iris_plane_mm
from dermis.scene.camera import Camera

pytest.importorskip("mitsuba")
SIDE, FRAME_MM, FAR_MM = 24, 9.0, 300.0


def ramps() -> NDArray[np.float32]:
    """Return a texture whose red increases with x and green with y, with constant blue."""
    along = (np.arange(512, dtype=np.float32) + 0.5) / 512
    return np.stack([*np.meshgrid(along, along), np.ones((512, 512), np.float32)], axis=-1)


def visible_positions(degrees: float) -> Any:
    """Return the positions (n, n, 2) of a glowing iris that a camera sees from the front or the side [mm]."""
    mi, reach = load_mitsuba(), 6.5
    turn = np.radians(degrees)
    middle = np.array([0.0, 0.0, cornea_centre_mm()])
    position = middle + FAR_MM * np.array([np.sin(turn), 0.0, np.cos(turn)])
    camera = Camera(position=tuple(position), target=tuple(middle), frame_mm=FRAME_MM)
    with mitsuba_variant(mi, "scalar_rgb"):
        person = replace(ball(), eyes=np.eye(4)[None], textures=replace(paint(), reach_mm=reach))
        clear = eyes.eye_shapes(mi, person)["eye_0"]
        flat, fans, _ = eyes.iris_disc()
        glow = {"type": "bitmap", "bitmap": mi.Bitmap(ramps()), "raw": True, "wrap_mode": "clamp"}
        shines = mi.load_dict({"type": "area", "radiance": glow})
        iris = mesh_shape(mi, flat, fans, None, 0.5 + 0.5 * flat[:, :2] / reach, emitter=shines)
        described = {"type": "scene", "integrator": {"type": "path"}, "eye": clear, "iris": iris}
        built = mi.load_dict({**described, "sensor": mitsuba_sensor(mi, camera, (SIDE, SIDE))})
        image = np.array(mi.render(built, spp=1024), np.float64)
    rays = pixels(camera)
    return reach * (2.0 * image[..., :2] / np.maximum(image[..., 2:], 1e-9) - 1.0), rays


def pixels(camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where rays through the centres of pixels meet the cornea's sphere, and their directions."""
    eye, target = np.array(camera.position), np.array(camera.target)
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    along = ((np.arange(SIDE) + 0.5) / SIDE - 0.5) * FRAME_MM / FAR_MM
    x, y = np.meshgrid(along, -along)
    directions = ahead + x[..., None] * right + y[..., None] * up
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    off = eye - [0.0, 0.0, cornea_centre_mm()]
    b = directions @ off
    root = b**2 - off @ off + CORNEA_MM**2
    positions = eye + directions * (-b - np.sqrt(np.maximum(root, 0.0)))[..., None]
    return positions, directions


def by_snell(positions: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where refracted rays meet the plane of the iris (n, n, 2) [mm]."""
    n = (positions - [0.0, 0.0, cornea_centre_mm()]) / CORNEA_MM
    cosine = -(directions * n).sum(axis=-1, keepdims=True)
    inner = np.sqrt(1.0 - (1.0 - cosine**2) / eyes.CORNEA_IOR**2)
    bent = directions / eyes.CORNEA_IOR + (cosine / eyes.CORNEA_IOR - inner) * n
    far = (iris_plane_mm() - positions[..., 2:]) / bent[..., 2:]
    return np.asarray((positions + far * bent)[..., :2])


@pytest.mark.parametrize("degrees", [0.0, 40.0])
def test_the_iris_is_refracted_by_snells_law(degrees: float) -> None:
    found, (positions, directions) = visible_positions(degrees)
    expected = by_snell(positions, directions)
    clear = np.hypot(positions[..., 0], positions[..., 1]) < LIMBUS_MM - eyes.LIMBUS_BLUR_MM - 0.5
    clear &= np.hypot(*np.moveaxis(expected, -1, 0)) < 4.5
    assert clear.sum() > 60
    assert np.abs(found - expected)[clear].max() < 0.08  # a fifth of a pixel, for few paths


def test_eyeball_is_closed_and_has_the_published_shape() -> None:
    positions, triangles, normals, uv = eyes.eyeball_mesh()
    assert np.linalg.norm(positions, axis=1).min() >= SCLERA_MM - 1e-9
    assert positions[:, 2].max() == pytest.approx(apex_mm())
    corners = positions[triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((facing * corners.mean(axis=1)).sum(axis=1) >= 0.0).all()
    assert (np.einsum("vc,vc->v", normals, positions) > 0.0).all()
    assert np.linalg.norm(uv - 0.5, axis=1).max() == pytest.approx(eyes.EYE_UV_RADIUS)


def test_the_white_turns_clear_at_the_limbus() -> None:
    found = eyes.cornea_weight_map()
    middle = len(found) // 2
    assert found[middle, middle] == 1.0 and found[0, 0] == 0.0
    row = found[middle, middle:]
    half = np.arcsin(LIMBUS_MM / SCLERA_MM) / np.pi * eyes.EYE_UV_RADIUS * len(found)
    assert abs(int(np.argmin(np.abs(row - 0.5))) - half) < 8


def test_the_iris_reaches_the_ball_and_is_wider_than_a_pupil() -> None:
    flat, _, radius = eyes.iris_disc()
    assert np.linalg.norm(flat, axis=1).max() < SCLERA_MM
    assert radius > LIMBUS_MM - 0.2 > EYE_LOOK_RANGES["pupil_mm"][1]


def test_eyes_stand_where_their_frames_say() -> None:
    mi = load_mitsuba()
    frame = np.eye(4)
    frame[:3, :3] *= 2.0  # an eye of half the size
    frame[:3, 3] = -2.0 * np.array([30.0, 5.0, 60.0])
    with mitsuba_variant(mi, "scalar_rgb"):
        person: Person = replace(ball(), eyes=frame[None])
        box = eyes.eye_shapes(mi, person)["eye_0"].bbox()
    np.testing.assert_allclose(np.array(box.max)[:2], [30.0 + SCLERA_MM / 2, 5.0 + SCLERA_MM / 2], atol=0.02)
    np.testing.assert_allclose(np.array(box.max)[2], 60.0 + apex_mm() / 2, atol=0.02)
