"""Light that reaches teeth and tongue through the opening between the lips."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import probe

from dermis import Human
from dermis.frame.renderer import Renderer
from dermis.gpu.textures import texture_from_array
from dermis.human.expressions import expression
from dermis.human.labels.classes import class_number
from dermis.human.lips import mouth_edge
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene import Camera, Scene, Settings
from dermis.scene.environment import Environment

Floats = NDArray[np.float64]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SETTINGS = Settings(size=(96, 96), atlas=256, samples=4, strands=False)
MOUTH_CAMERA = Camera(position=(0, -50, 900), target=(0, -50, 90), frame_mm=75)


@pytest.fixture(scope="module")
def head() -> Head:
    return Human().head()


def ring(half_width_mm: float, half_height_mm: float) -> Floats:
    """Return an elliptic opening (38, 4) in the plane z = 0, counter-clockwise as seen from behind."""
    turn = np.pi / 2 - np.arange(38) / 38 * 2 * np.pi
    x, y = half_width_mm * np.cos(turn), half_height_mm * np.sin(turn)
    return np.column_stack([x, y, 0 * x, np.full(38, np.pi * half_width_mm * half_height_mm)])


def open_fractions(
    renderer: Renderer, lips: Floats, points: Floats, normals: Floats, teeth_mm: float = 0.0
) -> Floats:
    """Return the fractions (n,) by the shader.

    teeth_mm : length of teeth below the upper lip
    """
    count = len(points)
    bound = {
        name: texture_from_array(renderer.device, np.column_stack([one, np.ones(count)])[None], "rgba32float")
        for name, one in (("points", points), ("normals", normals))
    }
    shade = {"lips": lips.astype(np.float32), "teeth_below_lip": (0.0, -teeth_mm, 0.0)}
    (found,) = probe(renderer.device, "lips_probe", (count, 1), ["open"], shade=shade, **bound)
    return np.asarray(found)[0, :, 0]


def integrated(lips: Floats, point: Floats, normal: Floats) -> float:
    """Return the fraction by 40,000 cosine-weighted directions that are tested against the ellipse."""
    n = 200
    u, v = ((one.ravel() + 0.5) / n for one in np.meshgrid(np.arange(n), np.arange(n)))
    radius, turn = np.sqrt(u), 2 * np.pi * v
    across = np.cross(normal, [0.3, 1.0, 0.2])
    across /= np.linalg.norm(across)
    frame = np.stack([across, np.cross(normal, across), normal])
    d = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - u)]) @ frame
    forward = d[:, 2] > 1e-9
    at = point[:2] - point[2] * d[:, :2] / np.where(forward, d[:, 2], 1.0)[:, None]
    axes = np.abs(lips[:, :2]).max(axis=0)
    return float((forward & (((at / axes) ** 2).sum(axis=1) < 1)).mean())


def test_open_fraction_matches_numerical_integration(renderer: Renderer) -> None:
    """The form factor of an ellipse from its axis, from beside it, and where the horizon cuts it."""
    lips = ring(24.0, 6.0)
    z, y = (0.0, 0.0, 1.0), (0.0, 1.0, 0.2)
    points = np.array(
        [(0, 0, -4), (0, 0, -15), (0, 5, -4), (18, 0, -8), (0, -10, -20), (12, 2, -3), (0, 9, -3)]
    )
    normals = np.array([z, z, z, (0.6, 0, 0.8), y, (0, -0.6, 0.8), z])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found = open_fractions(renderer, lips, points, normals)
    expected = [integrated(lips, p, n) for p, n in zip(points, normals, strict=True)]
    np.testing.assert_allclose(found, expected, atol=0.02)
    assert found[0] > 0.5 > found[1] > 0.1


def test_teeth_narrow_the_opening(renderer: Renderer) -> None:
    points, normals = np.array([[0.0, -4.0, -15.0]]), np.array([[0.0, 0.0, 1.0]])
    lips = ring(24.0, 6.0)
    free, hidden = (open_fractions(renderer, lips, points, normals, one)[0] for one in (0.0, 8.0))
    assert 0.3 * free < hidden < 0.7 * free


def test_points_before_the_lips_see_the_whole_sky(renderer: Renderer) -> None:
    points, normals = np.array([[0.0, 0.0, 2.0]]), np.array([[0.0, 0.0, 1.0]])
    assert open_fractions(renderer, ring(24.0, 6.0), points, normals)[0] == pytest.approx(1.0, abs=1e-3)


def test_unknown_lips_leave_the_visibility_of_the_mesh(renderer: Renderer) -> None:
    points, normals = np.array([[0.0, 0.0, -5.0]]), np.array([[0.0, 0.0, 1.0]])
    assert open_fractions(renderer, np.zeros((38, 4)), points, normals)[0] == 0.25


def test_mouth_edge_surrounds_the_teeth_of_a_smile(head: Head) -> None:
    """In joy the lips open by several millimetres, and the edge is clockwise as seen from the front."""
    rig = head.control_rig
    assert rig.mouth_edge is not None
    np.testing.assert_array_equal(rig.mouth_edge[:-1], mouth_edge())
    *points, biting_edge = rig.mouth_edge_mm(Pose(expression("joy")).to_arrays(rig))
    edge = np.array(points)
    assert abs(biting_edge[0]) < 5.0 and 4.0 < edge[0, 1] - biting_edge[1] < 10.0
    area = 0.5 * np.cross(edge, np.roll(edge, -1, axis=0)).sum(axis=0)
    assert area[2] < -150.0
    closed = rig.mouth_edge_mm(rig.rest)[:-1]
    assert edge[:, 1].max() - edge[19, 1] > 6.0
    assert abs(0.5 * np.cross(closed, np.roll(closed, -1, axis=0)).sum(axis=0)[2]) < 30.0


def mouth_luminances(renderer: Renderer, scene: Scene) -> dict[str, Floats]:
    """Return the luminance of the pixels of each part of a mouth and of the skin around it."""
    frame = renderer.draw(scene, SETTINGS, outputs=("label",))
    labels, y = np.asarray(frame.output("label")), frame.linear()[..., :3] @ LUMINANCE
    return {name: y[labels == class_number(name)] for name in ("teeth", "tongue", "skin")}


@pytest.mark.parametrize("lights", ["studio", "portrait"])
def test_teeth_of_a_smile_are_darker_than_skin(renderer: Renderer, head: Head, lights: str) -> None:
    """Their luminance is 0.4 to 0.8 of that of the skin, as lips and cavity shade them."""
    scene = Scene(head, lights=lights, camera=MOUTH_CAMERA, pose=expression("joy"))
    found = mouth_luminances(renderer, scene)
    assert 0.4 < np.median(found["teeth"]) / np.median(found["skin"]) < 0.8


def test_open_mouths_are_not_black_in_uniform_light(renderer: Renderer, head: Head) -> None:
    """The albedo of teeth is 2.4 times that of this skin, and lips shade them."""
    scene = Scene(
        head,
        lights=(),
        camera=MOUTH_CAMERA,
        pose=expression("laugh"),
        environment=Environment(name="uniform"),
    )
    found = mouth_luminances(renderer, scene)
    tongue, teeth = (np.median(found[name]) / np.median(found["skin"]) for name in ("tongue", "teeth"))
    assert 0.02 < tongue < 0.3 and 0.4 < teeth < 1.8
