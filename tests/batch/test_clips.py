"""Clips of data sets: motion, flow against landmarks and texture coordinates, captures, and movies."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_head import CAPTURE, write_moving_head
from small_head import obj_text
from small_set import drawn_here

import dermis
from dermis.apps.batch.clips.flow import hidden_points
from dermis.apps.batch.clips.motion import motion_at, pulse_time_s
from dermis.apps.batch.goodness_of_fit import fit_tests
from dermis.apps.batch.movie_files import _on_black
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.spec import Spec, parse_spec
from dermis.apps.batch.worker import RunOptions, Worker
from dermis.base.errors import DermisError

FRAMES = 4
SMALL: dict[str, Any] = {
    "seed": 5,
    "size": [72, 72],
    "render": {"atlas": 128, "samples": 1, "shadow_size": 128, "transmission": "none"},
}
CLIP: dict[str, Any] = {
    "frames": FRAMES,
    "rate_hz": 8,
    "flow": True,
    "speech": 1,
    "head_motion_deg": 4,
    "pulse_per_min": 72,
}
QUIET = {"blinks_per_min": 0.0, "gaze_shifts_per_min": 0.0, "gaze_spread_deg": 5.0, "head_motion_deg": 2.0}
QUIET |= {"head_motion_hz": 0.25, "speech": 0.0, "syllables_per_s": 4.5}


@pytest.fixture(scope="module")
def spec() -> Spec:
    outputs = ["depth", "uv", "motion"]
    return parse_spec({**SMALL, "count": FRAMES + 2, "encoding": "npy", "outputs": outputs, "clip": CLIP})


@pytest.fixture(scope="module")
def folder(spec: Spec, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("clips") / "out"
    assert drawn_here(spec, made).is_complete
    return made


@pytest.fixture(scope="module")
def images(folder: Path) -> list[dict[str, Any]]:
    return list(dermis.read_dataset(folder))


def test_frames_share_the_person_and_the_camera_and_move(images: list[dict[str, Any]]) -> None:
    frames = images[:FRAMES]
    for name in ("K", "R", "t"):
        assert all(
            (getattr(one["camera"], name) == getattr(frames[0]["camera"], name)).all() for one in frames
        )
    assert {one["parameters"]["person.seed"] for one in frames} != {
        images[FRAMES]["parameters"]["person.seed"]
    }
    assert [one["parameters"]["clip.frame"] for one in images] == [0, 1, 2, 3, 0, 1]
    assert [one["parameters"]["clip.time_s"] for one in frames] == [0, 0.125, 0.25, 0.375]
    poses = [one["head_pose"] for one in frames]
    assert all(np.abs(a - b).max() > 1e-3 for a, b in itertools.pairwise(poses))
    assert all(np.abs(one["motion"]).max() > 0.05 for one in frames)  # also in the first frame


def test_flow_is_that_of_landmarks(images: list[dict[str, Any]]) -> None:
    """The pixels of landmarks come from the shape of each frame, not from two shapes at once."""
    errors = []
    for one, other in itertools.pairwise(images[:FRAMES]):
        for source, target, direction in ((one, other, "forward"), (other, one, "backward")):
            points, moved = source["landmarks"]["ibug-68"], target["landmarks"]["ibug-68"]
            seen = points.visible & moved.visible
            x, y = np.rint(points.pixels[seen]).astype(int).T
            flow = source[f"flow_{direction}"][y, x]
            on_face = source["depth"][y, x] > 0
            error = np.linalg.norm(flow - (moved.pixels - points.pixels)[seen], axis=1)[on_face]
            errors.append(np.median(error))
            np.testing.assert_array_equal(source["flow_backward"], -source["motion"])
    assert max(errors) < 0.03, errors


def test_masks_are_those_of_texture_coordinates(images: list[dict[str, Any]]) -> None:
    """Where a point is seen, the other frame shows its texture coordinates nearby; hidden ones are absent."""
    agreements, hidden_count = [], 0
    for one, other in itertools.pairwise(images[:FRAMES]):
        y, x = np.nonzero(one["depth"] > 0)
        place = np.stack([x, y], -1) + one["flow_forward"][y, x]
        inside = ((place >= 0) & (place <= 71)).all(axis=1)
        corner = np.floor(place[inside]).astype(int)
        distances = []
        for dx, dy in itertools.product(range(-1, 3), repeat=2):
            column, row = np.clip(corner[:, 0] + dx, 0, 71), np.clip(corner[:, 1] + dy, 0, 71)
            found = np.where(other["depth"][row, column, None] > 0, other["uv"][row, column], np.inf)
            distances.append(np.linalg.norm(found - one["uv"][y, x][inside], axis=1))
        nearest = np.min(distances, axis=0)
        hidden = one["hidden_forward"][y, x][inside] == 1
        hidden_count += int(hidden.sum())
        agreements.append(((nearest > 0.02) == hidden).mean())
    assert min(agreements) > 0.97 and hidden_count >= 3, (agreements, hidden_count)


def test_points_behind_a_nearer_surface_and_outside_are_hidden() -> None:
    depth, other = np.full((4, 6), 100.0), np.full((4, 6), 100.0)
    other[:, 3:] = 50.0
    depth[0] = 0.0  # background
    flow = np.zeros((4, 6, 2), np.float32)
    flow[1, 0] = -1.0, 0.0
    found = hidden_points(flow, depth, depth, other)
    assert found[0].tolist() == [1] * 6  # the surface of the other frame is before the background
    assert found[1].tolist() == [1, 0, 0, 1, 1, 1]
    assert found[2].tolist() == [0, 0, 0, 1, 1, 1]


def test_each_frame_depends_on_its_number_only(spec: Spec, images: list[dict[str, Any]]) -> None:
    worker = Worker("cpu", RunOptions(spec, Path()))
    ((number, observation, *_),) = worker.observe(iter([2]))
    worker.close()
    assert number == 2
    for name in ("flow_backward", "flow_forward", "hidden_backward", "hidden_forward"):
        np.testing.assert_array_equal(observation.outputs[name], images[2][name])
    np.testing.assert_array_equal(observation.picture, images[2]["picture"])


def test_clips_have_the_moments_of_single_pictures(spec: Spec) -> None:
    """With the table, clip k has the parameters of image k without it, except for the motion."""
    plain = parse_spec(SMALL)
    for k in range(3):
        clip = parse_spec({**SMALL, "clip": CLIP}).parameters(k * FRAMES)
        expected = {
            name: value for name, value in plain.parameters(k).items() if not name.startswith("pose.")
        }
        assert expected.items() <= clip.items()
    assert "[clip]" not in plain.to_toml() and "images_per_person = 1\n" in plain.to_toml()
    assert (
        parse_spec({**SMALL, "clip": CLIP}).to_toml()
        == parse_spec({**SMALL, "clip": CLIP, "images_per_person": FRAMES}).to_toml()
    )


def test_rates_of_blinks_and_shifts_are_those_of_the_spec() -> None:
    values = QUIET | {"blinks_per_min": 17.0, "gaze_shifts_per_min": 40.0}
    times = np.arange(0, 600, 0.02)
    samples = [motion_at(3, 600.0, values, time_s) for time_s in times]
    blinks = np.array([one.blink for one in samples])
    begins = int(((blinks[1:] > 0.5) & (blinks[:-1] <= 0.5)).sum())
    assert begins / 10 == pytest.approx(17, abs=3)  # 3 standard deviations of a count of 170 are 3.9
    gaze = np.array([one.gaze_deg for one in samples])
    speeds = np.linalg.norm(np.diff(gaze, axis=0), axis=1) / 0.02
    assert 10 / 0.06 < speeds.max() < 900  # saccades, within the speeds of people [degrees / s]
    moving = speeds > 5
    assert int((moving[1:] & ~moving[:-1]).sum()) / 10 == pytest.approx(40, abs=6)
    head = np.array([one.head_deg for one in samples])
    np.testing.assert_allclose(np.sqrt((head**2).mean(axis=0)), [2.0, 1.2, 0.8], rtol=0.2)


def test_motion_late_in_long_clips_is_as_exact_and_as_fast() -> None:
    """Times with six digits would be multiples of 10 ms after 1,000 s."""
    spec = parse_spec({**SMALL, "clip": CLIP | {"frames": 90_000, "rate_hz": 30}, "count": 90_000})
    for number in (70_001, 70_002):
        time_s = spec.parameters(number)["clip.time_s"]
        assert time_s == pytest.approx(number / 30, abs=1e-6)
    speech = {"speech": 1.0, "syllables_per_s": 4.0}
    long, short = (motion_at(9, duration, QUIET | speech, 0.4).speech for duration in (3600.0, 2.0))
    assert long == short and long["jawOpen"] > 0


def test_weights_above_1_are_those_of_the_spec() -> None:
    clip = parse_spec({**SMALL, "pose": {"mouthSmileLeft": 1.4}, "clip": CLIP | {"speech": 0}})
    assert clip.parameters(2)["pose.mouthSmileLeft"] == 1.4


def test_still_people_stay_still_and_the_motion_continues_before_the_clip() -> None:
    still = QUIET | {"head_motion_deg": 0.0}
    assert motion_at(1, 2.0, still, 0.7) == motion_at(1, 2.0, still, 1.9)
    before, first = motion_at(1, 2.0, QUIET, -0.04), motion_at(1, 2.0, QUIET, 0.0)
    assert 0 < max(abs(a - b) for a, b in zip(before.head_deg, first.head_deg, strict=True)) < 0.5


def test_the_record_has_the_pulse_of_the_picture(spec: Spec) -> None:
    parameters = spec.parameters(1)
    scene, _ = SceneBuilder(spec).build(parameters)
    seed = int(parameters["clip.pulse_seed"])
    time_s = pulse_time_s(seed, {"pulse_per_min": 72.0}, 0.125)
    truth = dermis.Pulse(rate_per_min=72, seed=seed).truth_at(time_s)[1]
    assert parameters["clip.pulse_blood"] == pytest.approx(truth, rel=1e-5)
    assert scene.state is not None and scene.state.blood is not None
    assert scene.state.blood[0] == pytest.approx(truth, rel=1e-5)


def test_captures_move_the_face(tmp_path: Path) -> None:
    lines = ["time,jawOpen,eyeBlinkLeft,headYaw"]
    lines += [f"{k / 10:.1f},{k / 100:.2f},0.5,{0.1 * k / 30:.5f}" for k in range(31)]
    (tmp_path / "take.csv").write_text("\n".join(lines))
    clip = {"frames": 10, "rate_hz": 10, "motion": "take.csv", "motion_start": 0.5}
    spec = parse_spec({**SMALL, "count": 10, "clip": clip}, tmp_path)
    assert set(spec.files) == {"take.csv"}
    builder = SceneBuilder(spec)
    for number in (0, 7):
        parameters = spec.parameters(number)
        assert "clip.blink" not in parameters and "clip.blinks_per_min" not in parameters
        scene, _ = builder.build(parameters)
        start_s = 0.1 + 0.5 * (3.0 - 1.0 - 0.1)  # half of the spare time after the frame before the clip
        assert scene.pose is not None
        assert scene.pose.weights["jawOpen"] == pytest.approx((start_s + number / 10) / 10, abs=1e-6)
        captured = builder.facts(parameters, scene).captured
        assert captured["pose.jawOpen"] == pytest.approx(scene.pose.weights["jawOpen"], rel=1e-5)
    long = parse_spec({**SMALL, "count": 40, "clip": clip | {"frames": 40}}, tmp_path)
    with pytest.raises(DermisError, match=r"clip: motion: expected captures of 4\.1 s or more"):
        SceneBuilder(long).build(long.parameters(0))


def test_clips_are_exported_as_movies(folder: Path, images: list[dict[str, Any]], tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    dermis.dataset.export_movies(folder, tmp_path / "movies", crf=0)
    assert sorted(one.name for one in (tmp_path / "movies").iterdir()) == ["000000000.mp4", "000000004.mp4"]
    with av.open(str(tmp_path / "movies" / "000000000.mp4")) as movie:
        frames = [frame.to_ndarray(format="rgb24") for frame in movie.decode(video=0)]
        assert movie.streams.video[0].average_rate == 8
    assert len(frames) == FRAMES
    for frame, image in zip(frames, images, strict=False):
        assert np.abs(frame.astype(float) - image["picture"]).mean() < 3
    with pytest.raises(DermisError, match="expected a folder that does not exist"):
        dermis.dataset.export_movies(folder, tmp_path / "movies")


def test_movies_of_pictures_without_a_background_are_over_black() -> None:
    """Half of white in linear light is 188 in sRGB; uncovered pixels become black."""
    picture = np.array([[[255, 255, 255, 255], [255, 255, 255, 128], [9, 90, 200, 0]]], np.uint8)
    assert _on_black(picture).tolist() == [[[255] * 3, [188] * 3, [0] * 3]]
    np.testing.assert_array_equal(_on_black(picture[..., :3]), picture[..., :3])


def test_a_pulse_of_a_mesh_is_refused_as_such(tmp_path: Path) -> None:
    """The mesh has neither painted skin nor the bone that a pulse nods."""
    (tmp_path / "head.obj").write_text(obj_text())
    spec = parse_spec({**SMALL, "person": {"head": "head.obj"}, "landmarks": [], "clip": CLIP}, tmp_path)
    with pytest.raises(DermisError, match="state: expected a person whose skin is painted"):
        SceneBuilder(spec).build(spec.parameters(0))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"frames": 1}, "^clip: frames: expected"),
        ({"frames": 4, "motion": "none.csv"}, 'clip: motion: expected "generated", or captures'),
        ({"frames": 4, "pulse_per_min": 5}, "clip: pulse_per_min: expected 0 or 20 and more"),
        (
            {"frames": 4, "pulse_per_min": {"uniform": [0, 90]}},
            "clip: pulse_per_min: expected 0 or 20 and more",
        ),
        ({"frames": 4, "speech": 2}, "^clip: speech: expected numbers from 0 to 1"),
    ],
)
def test_invalid_tables_are_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises(DermisError, match=message):
        parse_spec({"clip": table})
    with pytest.raises(DermisError, match=message):  # the table is named also with a given number
        parse_spec({"clip": table, "images_per_person": 4})
    with pytest.raises(DermisError, match="images_per_person: expected a multiple of 4"):
        parse_spec({"clip": {"frames": 4}, "images_per_person": 6})


def test_records_have_the_weights_of_captures(tmp_path: Path) -> None:
    write_moving_head(tmp_path / "moving.glb")
    (tmp_path / "take.csv").write_text(CAPTURE)  # jawOpen: 0, 1, 0 in half a second
    clip = {"frames": 4, "rate_hz": 16, "motion": "take.csv", "motion_start": 0, "flow": True}
    tables = {"person": {"head": "moving.glb"}, "landmarks": [], "outputs": ["depth"], "clip": clip}
    spec = parse_spec({**SMALL, **tables, "count": 4, "size": [32, 32]}, tmp_path)
    assert drawn_here(spec, tmp_path / "out").is_complete
    images = list(dermis.read_dataset(tmp_path / "out"))
    opened = [image["parameters"]["pose.jawOpen"] for image in images]
    np.testing.assert_allclose(opened, [0.25, 0.5, 0.75, 1.0], atol=1e-5)
    assert all(np.abs(image["flow_backward"]).max() > 0.2 for image in images)
    assert np.abs(images[2]["flow_backward"]).max() == pytest.approx(
        np.abs(images[1]["flow_forward"]).max(), abs=0.1
    )


def test_moments_count_once_in_tests_of_the_fit(tmp_path: Path) -> None:
    """Otherwise, equal frames of a clip would make all distributions differ from the spec."""
    tables = {"clip": {"frames": 20}, "rig": {"kind": "orbit", "count": 2}}
    spec = parse_spec({**SMALL, **tables, "count": 12_000, "head": {"yaw_deg": {"uniform": [-20, 20]}}})
    rows = [{"number": k, **spec.parameters(k)} for k in range(0, spec.count, 10)]
    columns = {name: [row[name] for row in rows] for name in ("number", "person.number", "head.yaw_deg")}
    pyarrow = pytest.importorskip("pyarrow")
    pytest.importorskip("pyarrow.parquet").write_table(pyarrow.table(columns), tmp_path / "index.parquet")
    (found,) = fit_tests(tmp_path, spec)
    assert found.sample_count == 300 and found.p_value > 1e-3
