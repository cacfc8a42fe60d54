"""Report of the differences between detected landmarks and the truth, and the geometry of crops."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from dermis.apps.validation.detectors import report
from dermis.apps.validation.detectors.detection import Detection
from dermis.apps.validation.detectors.dlib_models import Dlib
from dermis.apps.validation.detectors.mediapipe_models import MediaPipe, _anchors, _Crop
from dermis.apps.validation.detectors.report import LabelledPicture, compare, report_lines
from dermis.base.arrays import Bytes
from dermis.base.errors import DermisError


class Shifted:
    """Detector that returns the truth, moved along the eyes and downwards, and misses dark pictures."""

    name, landmark_set, licence, normaliser = "shifted", "ibug-68", "none", ("36", "45")

    def __init__(self, truth: dict[str, np.ndarray]) -> None:
        self.truth = truth

    def detect(self, picture: Bytes) -> Detection | None:
        if picture.max() == 0:
            return None
        moved = {name: np.add(place, [6.0, 8.0 * (int(name) >= 60)]) for name, place in self.truth.items()}
        middle = 0.5 * (self.truth["36"] + self.truth["45"])
        return Detection((*(middle - 50.0), *(middle + 50.0)), moved)


def truth() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    points = {str(k): rng.uniform(0, 200, 2) for k in range(68)}
    return points | {"36": np.array([50.0, 80.0]), "45": np.array([150.0, 80.0])}


def test_errors_and_offsets_are_relative_to_the_eyes() -> None:
    places = truth()
    images = [
        LabelledPicture(np.full((4, 4, 3), level, np.uint8), {"ibug-68": places}) for level in (255, 0, 9)
    ]
    found = compare(Shifted(places), images)
    assert (found.pictures, found.found) == (3, 2)
    assert found.mean_error(range(17)) == pytest.approx(0.06)
    assert found.mean_error(range(60, 68)) == pytest.approx(0.1)
    offsets = {name: (along, down) for name, along, down in found.mean_offsets()}
    assert offsets["61"] == pytest.approx((0.06, 0.08)) and offsets["3"] == pytest.approx((0.06, 0.0))
    text = "\n".join(report_lines(Shifted(places), found))
    assert "found 2 of 3 faces" in text and "inner lips      10.0 %" in text and "+8.0 %" in text


def test_offsets_turn_with_the_face() -> None:
    turned = {name: np.array([300 - place[1], place[0]]) for name, place in truth().items()}
    (along, down) = list(
        compare(
            Shifted(turned), [LabelledPicture(np.full((4, 4, 3), 9, np.uint8), {"ibug-68": turned})]
        ).mean_offsets()
    )[3][1:]
    assert (along, down) == pytest.approx((0.0, -0.06))


def test_crops_and_their_positions_agree() -> None:
    y, x = np.mgrid[0:100, 0:120]
    picture = np.stack([x, y, 0 * x], axis=-1).astype(np.uint8)
    for flip in (False, True):
        crop = _Crop((60.0, 45.0), 40.0, 0.3)
        pixels = crop.pixels(picture, 80, flip) * 255
        rows, columns = np.array([20, 40, 55]), np.array([10, 40, 66])
        places = crop.to_picture(np.stack([columns + 0.5, rows + 0.5], axis=1).astype(np.float32), 80, flip)
        assert pixels[rows, columns, :2] == pytest.approx(places, abs=1.0)


def test_anchors_are_those_of_the_model() -> None:
    assert _anchors().shape == (896, 2) and _anchors()[:3].tolist() == [[0.03125] * 2] * 2 + [
        [0.09375, 0.03125]
    ]


def test_without_detectors_the_command_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(report, "installed_detectors", lambda weights: iter(()))
    monkeypatch.setattr(report, "_labelled_images", lambda folder, count: iter(()))
    with pytest.raises(DermisError, match=r"detectors --help"):
        report.print_detector_report(tmp_path)


@pytest.fixture
def detectors() -> Iterator[object]:
    kinds = [kind for kind in (MediaPipe, Dlib) if kind.default_weights() is not None]
    if not kinds:
        pytest.skip("no face detector is installed")
    yield [kind(kind.default_weights()) for kind in kinds]  # type: ignore[arg-type]


def test_detectors_find_no_face_in_noise(detectors: list[MediaPipe | Dlib]) -> None:
    noise = np.random.default_rng(0).integers(100, 140, (256, 256, 3), np.uint8)
    assert all(one.detect(noise) is None for one in detectors)
