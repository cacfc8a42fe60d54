"""Outputs of a frame agree with the mesh, with the camera and with each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, place, scene_of, settings_of
from strand_setups import hairy

from dermis.base.errors import DermisError
from dermis.frame import allocation
from dermis.frame.limits import frame_bytes
from dermis.frame.rendered_frame import RenderedFrame
from dermis.frame.renderer import Renderer
from dermis.frame.request import FrameRequest
from dermis.gpu.graph import FrameListing
from dermis.mesh.pose import Pose
from dermis.mesh.primitives import uv_sphere
from dermis.scene.camera import Camera
from dermis.scene.model import Scene
from dermis.scene.opencv import OpenCvCamera
from dermis.scene.outputs import OUTPUTS

Floats = NDArray[np.float64]
STAGES = "geometry", "surface", "motion", "alpha"
NAMES = tuple(name for name, one in OUTPUTS.items() if one.stage in STAGES)
SIZE = 44, 36
BALL = head_of(uv_sphere(30.0, 48, 24), colour=np.full((8, 8, 3), 0.5))
CAMERA = Camera(
    position=place(BALL, (90.0, 120.0, 200.0)),
    target=place(BALL, (0.0, 0.0, 0.0)),
    up=(0.2, 1, 0),
    frame_mm=80.0,
    principal_point=(0.4, 0.55),
    pixel_aspect=1.1,
)
SCENE = scene_of(BALL, frontal(), camera=CAMERA)
PIXEL = 0.01
"""How near to the centre of its pixel a position projects [pixel]."""


def drawn(
    renderer: Renderer, scene: Scene = SCENE, previous: Scene | None = None, **given: Any
) -> RenderedFrame:
    return renderer.draw(scene, settings_of(**{"size": SIZE} | given), outputs=NAMES, previous=previous)


def centres() -> Floats:
    """Return the (h, w, 2) centres of pixels in OpenCV's coordinates."""
    return np.dstack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))).astype(float)


def projected(camera: OpenCvCamera, points: NDArray[Any]) -> Floats:
    seen = (points.astype(float) @ camera.R.T + camera.t) @ camera.K.T
    return np.asarray(seen[..., :2] / seen[..., 2:])


@pytest.fixture(scope="module")
def found(renderer: Renderer) -> dict[str, NDArray[Any]]:
    rendered = drawn(renderer)
    return {name: rendered.output(name) for name in NAMES}


@pytest.fixture(scope="module")
def seen(found: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    mask = found["triangle"] >= 0
    assert 200 < mask.sum() < 1200
    return mask


def test_each_output_has_its_shape_and_dtype(found: dict[str, NDArray[Any]]) -> None:
    for name, output in ((name, OUTPUTS[name]) for name in NAMES):
        shape = SIZE[::-1] if output.channels == 1 else (*SIZE[::-1], output.channels)
        assert found[name].shape == shape and found[name].dtype == output.kind


def test_empty_pixels_have_background_values(found: dict[str, NDArray[Any]], seen: NDArray[np.bool_]) -> None:
    for name, output in ((name, OUTPUTS[name]) for name in NAMES):
        assert (found[name][~seen] == output.background).all(), name


def test_positions_project_to_the_centres_of_their_pixels(
    found: dict[str, NDArray[Any]], seen: NDArray[np.bool_]
) -> None:
    off = projected(CAMERA.to_opencv(SIZE), found["position"])[seen] - centres()[seen]
    assert np.abs(off).max() < PIXEL


def test_edge_on_triangles_are_hit_at_their_nearest_point(renderer: Renderer) -> None:
    """At the rim of a ball rasterisers hit triangles slightly outside, and rays their plane far away."""
    fine, size = head_of(uv_sphere(30.0, 200, 100)), (256, 256)
    scene = scene_of(fine, frontal(), camera=CAMERA)
    rendered = renderer.draw(scene, settings_of(size=size), outputs=("position", "triangle"))
    places, mask = projected(CAMERA.to_opencv(size), rendered.output("position")), rendered.output("triangle")
    off = (places - np.dstack(np.meshgrid(*map(np.arange, size))))[mask >= 0]
    assert len(off) > 20_000 and np.abs(off).max() < PIXEL


def test_depth_is_along_the_optical_axis(found: dict[str, NDArray[Any]], seen: NDArray[np.bool_]) -> None:
    camera = CAMERA.to_opencv(SIZE)
    along = (found["position"].astype(float) @ camera.R.T + camera.t)[..., 2]
    assert found["depth"][seen] == pytest.approx(along[seen], abs=1e-3)


def test_barycentrics_refer_to_the_triangle_corners(
    found: dict[str, NDArray[Any]], seen: NDArray[np.bool_]
) -> None:
    corners, weights = BALL.mesh.triangles[found["triangle"][seen]], found["barycentric"][seen]
    places = np.einsum("nc,nck->nk", weights, BALL.mesh.positions[corners]) - BALL.centre_mm
    assert np.abs(places - found["position"][seen]).max() < 1e-4
    assert np.abs(np.einsum("nc,nck->nk", weights, BALL.mesh.uv[corners]) - found["uv"][seen]).max() < 1e-5
    assert weights.min() >= 0 and weights.sum(axis=1) == pytest.approx(1, abs=1e-5)


def test_normals_are_those_of_the_surface(found: dict[str, NDArray[Any]], seen: NDArray[np.bool_]) -> None:
    """Normals of a ball without relief point away from its middle, those of flat triangles nearly so."""
    outward = found["position"] + np.subtract(BALL.centre_mm, BALL.mesh.positions.mean(axis=0))
    outward /= np.maximum(np.linalg.norm(outward, axis=-1, keepdims=True), 1e-6)
    for name, least in (("normal", 0.9999), ("normal_geometric", 0.99)):
        assert np.linalg.norm(found[name][seen], axis=-1) == pytest.approx(1, abs=1e-5)
        assert (found[name] * outward).sum(axis=-1)[seen].min() > least
    a, b, c = np.moveaxis(BALL.mesh.positions[BALL.mesh.triangles[found["triangle"][seen]]], 1, 0)
    flat = np.cross(b - a, c - a)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.abs(found["normal_geometric"][seen] - flat).max() < 1e-4
    turned = found["normal"].astype(float) @ CAMERA.to_opencv(SIZE).R.T
    assert np.abs(found["normal_camera"] - turned)[seen].max() < 1e-5


def test_relief_bends_one_normal_only(renderer: Renderer, found: dict[str, NDArray[Any]]) -> None:
    height = np.random.default_rng(0).random((64, 64))
    rough = scene_of(head_of(BALL.mesh, height=height), frontal(), camera=CAMERA)
    rendered = drawn(renderer, rough)
    assert np.array_equal(rendered.output("normal_geometric"), found["normal_geometric"])
    assert np.abs(rendered.output("normal") - found["normal"]).max() > 0.05
    assert np.array_equal(rendered.output("depth"), found["depth"])


@pytest.mark.parametrize("change", [{}, {"samples": 2}, {"samples": 7}, {"atlas": 128, "exposure": 3.0}])
def test_equal_frames_have_identical_outputs(
    renderer: Renderer, found: dict[str, NDArray[Any]], change: dict[str, Any]
) -> None:
    """Outputs do not depend on the samples of the picture, except for coverage."""
    rendered = drawn(renderer, **change)
    for name in set(NAMES) - {"alpha"}:
        assert rendered.output(name).tobytes() == found[name].tobytes(), name


def test_alpha_equals_that_of_the_picture_with_hair(renderer: Renderer) -> None:
    head = hairy([[-10, 0, 5], [0, -10, 30]], [[30, 30, 40], [-60, 60, 50]], 1.0)
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=200.0))
    rendered = drawn(renderer, scene, samples=4)
    alpha = rendered.output("alpha")
    assert np.array_equal(np.rint(255 * alpha), rendered.rgba8()[..., 3])
    depth = rendered.output("depth")
    bald = drawn(renderer, scene, samples=4, strands=False)
    assert alpha.sum() > bald.output("alpha").sum() + 1
    assert np.array_equal(depth, bald.output("depth"))


def turned(degrees: float, **parts: Any) -> Scene:
    """Return a scene of the ball turned about the upright axis, as another person of the same mesh."""
    angle = np.radians(degrees)
    turn = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    places = (BALL.positions_mm @ np.transpose(turn)).astype(np.float32)
    return SCENE.replace(pose=Pose(positions_mm=places), **parts)


def expected_motion(rendered: RenderedFrame, now: Scene, before: Scene) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the motion by the corners of the visible triangles, before and now."""
    seen = rendered.output("triangle") >= 0
    corners = BALL.mesh.point[BALL.mesh.triangles[rendered.output("triangle")[seen]]]
    places = []
    for one in (now, before):
        points = BALL.positions_mm if one.pose is None else one.pose.positions_mm
        mixed = np.einsum("nc,nck->nk", rendered.output("barycentric")[seen], points[corners])
        places.append(projected(one.camera.to_opencv(SIZE), mixed - BALL.centre_mm))
    return places[0] - places[1], seen


NEARER = CAMERA.model_copy(update={"frame_mm": 70.0, "position": place(BALL, (70.0, 130.0, 190.0))})


@pytest.mark.parametrize(
    ("now", "before"),
    [
        (turned(8.0), SCENE),
        (SCENE, turned(-11.0)),
        (SCENE, SCENE.replace(camera=NEARER)),
        (turned(5.0), turned(9.0, camera=NEARER)),
    ],
)
def test_motion_is_that_of_projected_points(renderer: Renderer, now: Scene, before: Scene) -> None:
    rendered = drawn(renderer, now, before)
    motion, seen = expected_motion(rendered, now, before)
    assert np.abs(motion).max() > 1
    assert np.abs(rendered.output("motion")[seen] - motion).max() < PIXEL
    assert (rendered.output("motion")[~seen] == 0).all()


def test_static_points_have_zero_motion(renderer: Renderer) -> None:
    for before in (None, turned(7.0), SCENE.replace(camera=NEARER.model_copy())):
        scene = before or SCENE
        assert not drawn(renderer, scene, before).output("motion").any()
        assert drawn(renderer, turned(3.0), before).output("motion").any() == (before is not None)


def test_outputs_of_a_clip_match_single_frames(renderer: Renderer) -> None:
    """Pictures, outputs and motion of a clip are the same with frames in flight and without."""
    clip = [turned(4.0 * k, lights=[frontal(1.0 + k)]) for k in range(5)]
    names, settings = ("depth", "motion", "triangle"), settings_of(size=SIZE)
    found = list(renderer.observe(iter(clip), settings, outputs=names))
    assert len(found) == 5
    for k, one in enumerate(found):
        alone = renderer.draw(clip[k], settings, outputs=names, previous=clip[k - 1] if k else None)
        assert np.array_equal(one.picture, alone.srgb8()) and tuple(one.outputs) == names
        for name in names:
            assert one.outputs[name].tobytes() == alone.output(name).tobytes(), (k, name)
        assert np.array_equal(one.camera.K, CAMERA.to_opencv(SIZE).K)
    assert [bool(one.outputs["motion"].any()) for one in found] == [False, True, True, True, True]


def test_outputs_follow_the_order_of_requests(renderer: Renderer) -> None:
    settings = settings_of(size=SIZE, samples=4)
    for given in ({"alpha": True}, {"linear": True}, {"linear": True, "alpha": True}):
        (one,) = renderer.observe([SCENE], settings, outputs=["alpha"], **given)
        (same,) = renderer.render_many([SCENE], **settings.model_dump(), **given)
        assert np.array_equal(one.picture, same)
    (plain,) = renderer.observe([SCENE], settings)
    assert plain.outputs == {} and "uint8[36, 44, 3]" in repr(plain)


def test_motion_restarts_when_the_head_changes(renderer: Renderer) -> None:
    other = head_of(uv_sphere(25.0, 24, 12))
    cut = scene_of(other, frontal(), camera=front_camera(other))
    clip, settings = [turned(5.0), cut, turned(9.0)], settings_of()
    found = renderer.observe(clip, settings, outputs=["motion"], previous=SCENE)
    assert [bool(one.outputs["motion"].any()) for one in found] == [True, False, False]
    given = renderer.observe([SCENE, SCENE], settings_of(), outputs=["motion"], previous=[None, turned(5.0)])
    assert [bool(one.outputs["motion"].any()) for one in given] == [False, True]
    with pytest.raises(DermisError, match="previous: expected a scene of the same head"):
        drawn(renderer, SCENE, cut)
    for fewer in ([], [None] * 2):
        with pytest.raises(DermisError, match="previous: expected one scene or None per scene"):
            list(renderer.observe([SCENE], settings_of(), outputs=["motion"], previous=fewer))


def test_unrequested_outputs_run_no_passes(renderer: Renderer) -> None:
    """Outputs add passes after those of a frame without outputs, and change none of them."""

    def passes(**given: Any) -> list[str]:
        renderer.graph.listing = listing = FrameListing()
        renderer.draw(SCENE, settings_of(size=SIZE, samples=4), **given)
        return [f"{one.stage} {one.shader} {one.bindings.keys()}" for one in listing.passes]

    bare, depth, most = passes(), passes(outputs=["depth"]), passes(outputs=NAMES)
    assert depth[: len(bare)] == bare == most[: len(bare)] == passes()
    assert all(one.startswith("outputs") for one in (*depth[len(bare) :], *most[len(bare) :]))
    assert 1 < len(depth) - len(bare) < len(most) - len(bare)
    one_sample = renderer.draw(SCENE, settings_of(size=SIZE), outputs=["depth"]).textures.outputs
    assert one_sample is not None and one_sample.centres is None


def test_unchanged_outputs_are_not_recomputed(renderer: Renderer) -> None:
    shapes = ["depth", "uv", "normal_geometric", "motion"]
    renderer.draw(SCENE, settings_of(size=SIZE, samples=2), outputs=shapes)
    renderer.draw(SCENE, settings_of(size=SIZE, samples=2), outputs=shapes)
    assert renderer.graph.executed_stages == []


def test_memory_of_outputs_counts_towards_the_limit(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Outputs count as memory of the frame: 24 bytes per pixel for a normal and its copy."""
    asked: list[FrameRequest] = []
    monkeypatch.setattr(allocation, "check_limits", lambda _, one: asked.append(one))
    for names in ([], ["normal"]):
        renderer.draw(SCENE, settings_of(size=(10, 11)), outputs=names)
    bare, more = (frame_bytes(one)["size"] for one in asked)
    assert more == bare + 24 * 110


@pytest.mark.parametrize("names", ["depth", ["depth", "colour"], [3], None])
def test_unknown_output_names_are_refused(renderer: Renderer, names: Any) -> None:
    with pytest.raises(DermisError, match="output") as refused:
        renderer.observe([SCENE], settings_of(), outputs=names)
    with pytest.raises(DermisError, match="output"):
        renderer.draw(SCENE, settings_of(), outputs=names)
    if isinstance(names, list):
        assert "depth, position, normal" in str(refused.value)


def test_unrequested_output_is_refused(renderer: Renderer) -> None:
    rendered = renderer.draw(SCENE, settings_of(), outputs=["depth", "uv"])
    with pytest.raises(DermisError, match=r"output normal: expected .* drawn with depth, uv"):
        rendered.output("normal")
    with pytest.raises(DermisError, match="output: expected one of depth"):
        rendered.output("deep")
    renderer.draw(SCENE, settings_of())
    with pytest.raises(RuntimeError, match="newer frame"):
        rendered.output("depth")


def test_outputs_over_the_buffer_limit_are_refused(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = settings_of(size=(30, 31))
    renderer.draw(SCENE, settings)  # what a frame takes otherwise
    with monkeypatch.context() as patch:
        patch.setattr(renderer.device, "max_storage_bytes", 4 * 3 * 929)
        with pytest.raises(DermisError, match=r"size: expected at most 929 pixels with position at once"):
            renderer.draw(SCENE, settings, outputs=["position"])
    with monkeypatch.context() as patch:
        patch.setattr(renderer.device, "max_buffer_bytes", 15 * 929)
        with pytest.raises(DermisError, match=r"size: expected outputs of at most 92\d pixels .* 930"):
            next(renderer.observe([SCENE], settings, outputs=["position"]))
