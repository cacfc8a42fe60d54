"""Report of the differences between detected landmarks and the ground truth of a data set."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.apps.batch.reader import read_dataset
from dermis.apps.validation.detectors.detection import Detection, Detector
from dermis.apps.validation.detectors.dlib_models import Dlib
from dermis.apps.validation.detectors.mediapipe_models import MediaPipe
from dermis.base.arrays import Bytes, Doubles
from dermis.base.console import print_lines, print_note
from dermis.base.errors import refuse
from dermis.base.quantities import checked_integer
from dermis.base.tables import read_rows

_MIN_LISTED_OFFSET = 0.02  # of the distance of the outer eye corners
_IBUG_PARTS = {
    "outline": range(17),
    "brows": range(17, 27),
    "nose": range(27, 36),
    "eyes": range(36, 48),
    "outer lips": range(48, 60),
    "inner lips": range(60, 68),
    "inner points": range(17, 68),
}
_MEDIAPIPE_PARTS: Mapping[str, Sequence[int]] = {
    "outline": (
        *(10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148),
        *(176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109),
    ),
    "brows": (336, 296, 334, 293, 300, 107, 66, 105, 63, 70, 285, 295, 282, 283, 276, 55, 65, 52, 53, 46),
    "eyes": (
        *(362, 398, 384, 385, 386, 387, 388, 466, 263, 133, 173, 157, 158, 159, 160, 161, 246, 33),
        *(382, 381, 380, 374, 373, 390, 249, 155, 154, 153, 145, 144, 163, 7),
    ),
    "lips": (
        *(409, 270, 269, 267, 0, 185, 40, 39, 37, 375, 321, 405, 314, 17, 146, 91, 181, 84, 291, 61, 308, 78),
        *(415, 310, 311, 312, 13, 191, 80, 81, 82, 324, 318, 402, 317, 14, 95, 88, 178, 87),
    ),
    "nose": (168, 6, 197, 195, 5, 4, 1, 2, 327, 358, 98, 129),
    "irises": (468, 473),
}
_PARTS: Mapping[str, Mapping[str, Sequence[int]]] = {"ibug-68": _IBUG_PARTS, "mediapipe": _MEDIAPIPE_PARTS}


class LabelledPicture(NamedTuple):
    """Picture with its true landmarks: for each set, positions (2,) by name [pixel]."""

    picture: Bytes
    landmarks: Mapping[str, Mapping[str, Doubles]]


class Comparison(NamedTuple):
    """Differences of a detector's landmarks from the truth, in pictures in which it finds the face.

    pictures : number of pictures
    found : number of pictures in which the middle of the true eyes is in the detected box, which is enlarged
        on each side by a third of the distance of the outer eye corners
    offsets : (found, n, 2) offsets along the line of the eyes and downwards, relative to the distance of the
        outer eye corners [-]
    names : names of the n landmarks
    """

    pictures: int
    found: int
    offsets: Doubles
    names: tuple[str, ...]

    def mean_error(self, numbers: Iterable[int] | None = None) -> float:
        """Return the normalised mean error of landmarks by number; of all landmarks by default [-]."""
        chosen = slice(None) if numbers is None else [self.names.index(str(number)) for number in numbers]
        return float(np.linalg.norm(self.offsets[:, chosen], axis=2).mean())

    def mean_offsets(self) -> Iterator[tuple[str, float, float]]:
        """Yield the name of each landmark, and its mean offsets along the eye line and downwards [-]."""
        for name, (along, down) in zip(self.names, self.offsets.mean(axis=0).tolist(), strict=True):
            yield name, along, down


def print_detector_report(dataset: Path, /, *, count: int = 200, dlib_weights: Path | None = None) -> int:
    """Run the installed face detectors on a data set, and print how their landmarks differ from the truth.

    Parameters
    ----------
    dataset:
        Folder of a data set of square pictures with the landmarks ibug-68 and mediapipe.
    count:
        Number of images.
    dlib_weights:
        File shape_predictor_68_face_landmarks.dat. [default: that of Debian's libdlib-data]
    """
    images = list(_labelled_images(dataset, checked_integer("count", count, 1, 10**6)))
    detectors = list(installed_detectors(dlib_weights))
    if not detectors:
        actual = "neither MediaPipe's models nor dlib are installed"
        refuse(
            "detectors", "a face detector", actual, "See python -m dermis.apps.validation.detectors --help"
        )
    for detector in detectors:
        if any(detector.landmark_set not in image.landmarks for image in images):
            missing = detector.landmark_set
            print_note(f"note: {detector.name} is skipped: the data set has no landmarks {missing}")
            continue
        print_lines(*report_lines(detector, compare(detector, images)))
    return 0


def installed_detectors(dlib_weights: Path | None = None) -> Iterator[Detector]:
    """Yield the detectors whose packages and weights are installed; a note names those that are not."""
    for kind, weights in (
        (MediaPipe, MediaPipe.default_weights()),
        (Dlib, dlib_weights or Dlib.default_weights()),
    ):
        if weights is None:
            print_note(f"note: {kind.name} is not installed")
        else:
            yield kind(weights)


def compare(detector: Detector, images: Iterable[LabelledPicture]) -> Comparison:
    """Return the differences of a detector's landmarks from the truth."""
    pictures, rows, names = 0, list[Doubles](), tuple[str, ...]()
    for image in images:
        pictures += 1
        truth = image.landmarks[detector.landmark_set]
        names = tuple(truth)
        right, left = (truth[name] for name in detector.normaliser)
        distance = float(np.linalg.norm(left - right))
        found = detector.detect(image.picture)
        if found is None or not _is_same_face(found, 0.5 * (left + right), distance):
            continue
        along = (left - right) / distance
        axes = np.array([along, [-along[1], along[0]]])
        offsets = np.stack([found.points[name] - truth[name] for name in names])
        rows.append(offsets @ axes.T / distance)
    return Comparison(pictures, len(rows), np.array(rows).reshape(len(rows), len(names), 2), names)


def report_lines(detector: Detector, comparison: Comparison) -> Iterator[str]:
    """Yield the lines of the report: number of found faces, error of each part, mean offsets above 2 %."""
    yield f"{detector.name}; weights: {detector.licence}"
    yield f"  found {comparison.found} of {comparison.pictures} faces"
    if not comparison.found:
        return
    yield "  normalised mean error (by the distance of the outer eye corners)"
    for part, numbers in _PARTS[detector.landmark_set].items():
        yield f"    {part:14s}{100 * comparison.mean_error(numbers):6.1f} %"
    yield f"    {'all':14s}{100 * comparison.mean_error():6.1f} %"
    yield "  mean offsets of detected points above 2 % (along the line of the eyes, downwards)"
    for name, along, down in comparison.mean_offsets():
        if np.hypot(along, down) > _MIN_LISTED_OFFSET:
            yield f"    {name:6s}{100 * along:+6.1f} %{100 * down:+6.1f} %"


def _is_same_face(found: Detection, eyes_middle: Doubles, distance: float) -> bool:
    left, top, right, bottom = found.box
    x, y = eyes_middle.tolist()
    margin = distance / 3
    return bool(left - margin < x < right + margin and top - margin < y < bottom + margin)


def _labelled_images(dataset_folder: Path, count: int) -> Iterator[LabelledPicture]:
    for image, _ in zip(read_dataset(dataset_folder), range(count), strict=False):
        landmarks = {
            name: dict(zip(_set_names(name), points.pixels, strict=True))
            for name, points in image["landmarks"].items()
            if name in _PARTS
        }
        yield LabelledPicture(np.ascontiguousarray(image["picture"][..., :3]), landmarks)


def _set_names(set_name: str) -> list[str]:
    return [row["landmark"] for row in read_rows("dermis.human.landmarks", set_name)]
