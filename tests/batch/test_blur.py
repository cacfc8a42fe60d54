"""Depth of field and motion blur of data sets: points in focus, circles of confusion, and averages."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_set import drawn_here, write_spec

import dermis
from dermis.apps.batch.blur.samples import (
    Aperture,
    aperture_points,
    camera_at,
    shutter_times_ms,
    thin_lens,
)
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.spec import Spec, parse_spec
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.images.colour import encode_srgb8

SIZE = 96, 64
CAMERA = dermis.Camera(position=(300.0, 100.0, 700.0), target=(10.0, 0.0, 0.0), frame_mm=300.0)


def projected(camera: dermis.Camera, points: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    K, R, t = camera.to_opencv(SIZE)
    image = (points @ R.T + t) @ K.T
    return image[:, :2] / image[:, 2:]


def test_points_in_focus_are_sharp_and_others_are_discs_of_a_thin_lens() -> None:
    """The diameter of the disc is A f |1/F - 1/Z| for an aperture A, a focal length f, and depths F and Z."""
    _, R, t = CAMERA.to_opencv(SIZE)
    aperture, rng = Aperture(40.0, 650.0), np.random.default_rng(1)
    for depth in (650.0, 500.0, 900.0):
        seen = np.column_stack([rng.uniform(-60, 60, (5, 2)), np.full(5, depth)])  # in camera axes
        points = (seen - t) @ R
        pixels = np.array(
            [projected(camera_at(CAMERA, aperture, p, SIZE), points) for p in aperture_points(400)]
        )
        K = CAMERA.to_opencv(SIZE).K
        diameter = 40.0 * K[0, 0] * abs(1 / 650 - 1 / depth)
        radii = np.linalg.norm(pixels - projected(CAMERA, points), axis=2)
        assert radii.max() == pytest.approx(diameter / 2, rel=2e-3, abs=1e-9)
        assert (radii**2).mean() == pytest.approx(diameter**2 / 8, rel=1e-2, abs=1e-12)  # of a uniform disc


def test_the_lens_focuses_on_the_nearest_point() -> None:
    axis = np.subtract(CAMERA.target, CAMERA.position) / np.linalg.norm(
        np.subtract(CAMERA.target, CAMERA.position)
    )
    points = np.array(CAMERA.position) + np.outer([700.0, 620.0], axis)
    found = thin_lens(points, CAMERA, 2.0, 30.0)
    assert found.focus_depth_mm == pytest.approx(650.0)
    tangent = 150.0 / np.linalg.norm(np.subtract(CAMERA.target, CAMERA.position))
    assert found.diameter_mm == pytest.approx(12.0 / tangent / 2.0)
    with pytest.raises(DermisError, match="blur: focus_mm: expected a plane in focus farther"):
        thin_lens(points, CAMERA, 2.0, -620.0)


def test_times_are_the_middles_of_equal_parts_of_the_exposure() -> None:
    assert shutter_times_ms(4, 20.0).tolist() == [-7.5, -2.5, 2.5, 7.5]
    points = aperture_points(64)
    assert np.abs(points.mean(axis=0)).max() < 0.02
    correlation = np.corrcoef(np.linalg.norm(points, axis=1), np.arange(64))[0, 1]
    assert abs(correlation) < 0.2  # places are not related to times


def spec_of(folder: Path, **values: Any) -> Spec:
    write_spec(folder)
    table = tomllib.loads((folder / "spec.toml").read_text())
    return parse_spec(table | {"count": 2, "outputs": ["depth", "label"]} | values, folder)


def test_pictures_are_averages_in_linear_light_and_labels_those_of_sharp_pictures(tmp_path: Path) -> None:
    blur = {"f_number": 0.5, "focus_mm": 20, "samples": 5}
    spec, sharp = spec_of(tmp_path, blur=blur), spec_of(tmp_path)
    images = []
    for name, one in (("blurred", spec), ("sharp", sharp)):
        assert drawn_here(one, tmp_path / name).is_complete
        images.append(list(dermis.read_dataset(tmp_path / name)))
    builder, renderer = SceneBuilder(spec), Renderer("cpu")
    for number, (blurred, other) in enumerate(zip(*images, strict=True)):
        for name in ("depth", "label"):
            np.testing.assert_array_equal(blurred[name], other[name])
        assert (blurred["landmarks"]["points.csv"].pixels == other["landmarks"]["points.csv"].pixels).all()
        parameters = spec.parameters(number)
        scene, settings = builder.build(parameters)
        lens = Aperture(
            *(blurred["parameters"][f"blur.{name}"] for name in ("aperture_mm", "focus_depth_mm"))
        )
        total = np.zeros((*other["picture"].shape[:2], 3))
        for point in aperture_points(5):
            one = scene.replace(camera=camera_at(scene.camera, lens, point, spec.size))
            total += renderer.draw(one, settings).linear()
        difference = np.abs(blurred["picture"].astype(int) - encode_srgb8(total / 5))
        assert difference.max() <= 1
        assert np.abs(blurred["picture"].astype(int) - other["picture"]).max() > 10


def test_the_aperture_is_that_of_the_lens_and_not_of_a_wider_pinhole() -> None:
    """The distortion needs a wider picture before it is applied, which has another focal length."""
    blur = {"f_number": 2.0}
    sharp = {"seed": 4, "count": 1, "blur": blur, "person": {"head": "human"}}
    distorted = parse_spec(sharp | {"lens": {"k1": -0.6}, "sensor": {}})
    found = []
    for spec in (parse_spec(sharp), distorted):
        builder, parameters = SceneBuilder(spec), spec.parameters(0)
        scene, _ = builder.build(parameters)
        found.append(builder.facts(parameters, scene))
        K = found[-1].picture_K
        assert K is not None
        focal_mm = 24.0 * K[1, 1] / spec.size[1]
        assert found[-1].blur["blur.aperture_mm"] == pytest.approx(focal_mm / 2, rel=1e-5)
    assert found[0].blur == pytest.approx(found[1].blur, rel=1e-5)


def test_moving_people_are_averaged_over_the_exposure() -> None:
    clip = {"frames": 4, "rate_hz": 25, "head_motion_deg": 8}
    render = {"atlas": 64, "samples": 1, "shadow_size": 64, "transmission": "none"}
    spec = parse_spec({"count": 4, "clip": clip, "blur": {"shutter_ms": 40, "samples": 4}, "render": render})
    builder = SceneBuilder(spec)
    scene, _ = builder.build(spec.parameters(2))
    scenes = builder.blur_scenes(2, spec.parameters(2), scene)
    times = [spec.neighbour_parameters(2, offset)["clip.time_s"] for offset in (-0.375, -0.125, 0.125, 0.375)]
    np.testing.assert_allclose(times, 0.08 + np.array([-0.015, -0.005, 0.005, 0.015]), atol=1e-6)
    yaws = [
        spec.neighbour_parameters(2, offset)["clip.head_yaw_deg"] for offset in (-0.375, -0.125, 0.125, 0.375)
    ]
    for one, offset in zip(scenes, (-0.375, -0.125, 0.125, 0.375), strict=True):
        expected, _ = builder.build(spec.neighbour_parameters(2, offset))
        assert one.pose is not None and expected.pose is not None
        assert one.pose.bones == expected.pose.bones and one.camera == scene.camera
    assert len({round(float(yaw), 6) for yaw in yaws}) == 4


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"blur": {"shutter_ms": 10}}, "blur: shutter_ms: expected a table \\[clip\\]"),
        ({"blur": {"f_number": -1}}, "^blur: f_number: expected numbers from 0 to 64"),
        ({"blur": 3}, "^blur: expected a table with samples"),
        ({"f_number": 2}, r"^spec: f_number: expected this key in \[blur\]"),
        ({"blur": {}}, "blur: expected f_number or shutter_ms above 0"),
        (
            {"blur": {"f_number": 2}, "render": {"tone": "filmic"}},
            "render: tone: expected 'none' with \\[blur\\]|tone",
        ),
    ],
)
def test_invalid_tables_are_refused(tables: dict[str, Any], message: str) -> None:
    with pytest.raises(DermisError, match=message):
        parse_spec(tables)


def test_without_the_table_specs_are_unchanged() -> None:
    plain, blurred = parse_spec({"seed": 3}), parse_spec({"seed": 3, "blur": {"f_number": 2}})
    assert "[blur]" not in plain.to_toml()
    for number in range(5):
        others = {k: v for k, v in blurred.parameters(number).items() if not k.startswith("blur.")}
        assert others == plain.parameters(number)
