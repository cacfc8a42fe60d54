"""Observation: picture of a scene with its ground truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.summary import ShortRepr
from dermis.frame.features.outputs.output_images import OutputArray
from dermis.frame.features.outputs.readback import Readback
from dermis.gpu.memo import are_equal
from dermis.human.landmarks.sets import LANDMARK_SETS, SILHOUETTE_SUFFIX
from dermis.scene.head_pose import gaze_directions, head_pose
from dermis.scene.model import Scene
from dermis.scene.opencv import OpenCvCamera
from dermis.scene.settings import Settings

OCCLUSION_LEVELS = "real", "partial", "occluded"
"""Names of the levels of `Landmarks.occlusion`, in the order of their numbers."""
_MIN_PARTIAL_COVER, _MIN_OCCLUDED_COVER = 0.1, 0.75
"""Fractions of a pixel that hair and beard cover, from which a landmark is partially or fully occluded."""
_VISIBLE_OFFSET = 2.0  # see landmarks.wgsl
_NO_PREVIOUS_SCENE: Any = object()


class Landmarks(NamedTuple):
    """Landmarks of one set, located in a scene and in its picture.

    names : names of the landmarks, in the order of the set
    positions_mm : (n, 3) world positions relative to the centre of the head [mm]
    pixels : (n, 2) image coordinates, x to the right and y down, (0, 0) at the centre of the upper left pixel
    visible : (n,) whether the landmark is visible: not hidden by the mesh; hair is ignored
    occlusion : (n,) index into `OCCLUSION_LEVELS`: 0 where the landmark is seen, 1 where hair or beard covers
        10 to 75 % of its pixel, 2 where they cover more, where the mesh hides it, and outside the picture
    """

    names: tuple[str, ...]
    positions_mm: NDArray[np.float32]
    pixels: NDArray[np.float64]
    visible: NDArray[np.bool_]
    occlusion: NDArray[np.uint8]


@dataclass(frozen=True, repr=False)
class Observation(ShortRepr):
    """Picture of a scene with its ground truth.

    Attributes
    ----------
    picture : ndarray
        (h, w, 3), or with alpha (h, w, 4), sRGB bytes or linear floats.
    outputs : mapping
        Dictionary from the name of an output to an array (h, w) or (h, w, c) with row 0 at the top, see
        `dermis.scene.outputs`.
    camera : OpenCvCamera
        Intrinsic matrix K and pose R, t as in OpenCV; positions are relative to the head's centre [mm].
    landmarks : mapping
        Dictionary from the name of a set to its landmarks.
    head_pose : ndarray
        (3, 4) rotation and translation [mm] from coordinates of the head in its rest pose to camera
        coordinates.
    gaze : ndarray or None
        (2, 3) unit vectors of the gaze of the left and the right eye in camera axes (x right, y down,
        z forward); None for heads without modelled eyes.

    Examples
    --------
    >>> import dermis
    >>> import numpy as np
    >>> camera = dermis.Camera(position=(0, 0, 600), target=(0, 0, 0)).to_opencv((4, 2))
    >>> observation = dermis.Observation(np.zeros((2, 4, 3), np.uint8), {}, camera, {}, np.eye(3, 4), None)
    >>> observation.picture.shape
    (2, 4, 3)
    """

    picture: NDArray[np.uint8 | np.float32]
    outputs: Mapping[str, OutputArray]
    camera: OpenCvCamera
    landmarks: Mapping[str, Landmarks]
    head_pose: NDArray[np.float64]
    gaze: NDArray[np.float64] | None


def observation_jobs(
    submit_frame: Callable[..., Readback],
    scenes: Iterable[Scene],
    previous: Scene | Iterable[Scene | None] | None,
    settings: Iterable[Settings],
) -> Iterator[tuple[Callable[[], Readback], Callable[[Readback], Observation]]]:
    """Yield two functions for each scene: one submits a frame, the other reads the frame as an observation.

    submit_frame : function that submits a frame, given a scene, the previous scene and `settings`
    previous : previous scenes for motion vectors, see `pair_with_previous`
    settings : settings of each scene
    """
    for (scene, before), chosen in zip(pair_with_previous(scenes, previous), settings, strict=False):
        yield partial(submit_frame, scene, before, settings=chosen), partial(_read_observation, scene, chosen)


def _read_observation(scene: Scene, settings: Settings, readback: Readback) -> Observation:
    picture, outputs, landmark_sets = readback.image_and_outputs()
    camera, pose = scene.camera.to_opencv(settings.size), head_pose(scene)
    landmarks = {name: _project_landmarks(camera, *rows) for name, rows in landmark_sets.items()}
    for name, candidates in landmarks.items():
        if name in LANDMARK_SETS and name.endswith(SILHOUETTE_SUFFIX):
            landmarks[name] = _on_silhouette(candidates, camera.R, pose[:, :3])
    return Observation(picture, outputs, camera, landmarks, pose, gaze_directions(scene))


def _on_silhouette(
    candidates: Landmarks, camera_rotation: NDArray[np.float64], head_rotation: NDArray[np.float64]
) -> Landmarks:
    """Return, of the candidates of each landmark, the one that is farthest outwards in the picture.

    Outwards is the direction from the centre of the landmarks in the frontal view of the head, turned with
    the head in the plane of the picture, but not with its yaw and pitch.

    candidates : landmarks, of which consecutive ones with equal names are candidates, the outermost one first
    camera_rotation : (3, 3) rotation from the world to the camera
    head_rotation : (3, 3) rotation from the head at rest to the camera
    """
    starts = [k for k, name in enumerate(candidates.names) if candidates.names.index(name) == k]
    in_head = candidates.positions_mm @ camera_rotation.T @ head_rotation  # axes of the head
    directions = in_head[starts, :2] - in_head[starts, :2].mean(axis=0)
    up = head_rotation[:2, 1] / max(float(np.linalg.norm(head_rotation[:2, 1])), 1e-9)
    outwards = directions[:, :1] * [-up[1], up[0]] + directions[:, 1:] * up
    chosen = []
    for start, stop, direction in zip(starts, [*starts[1:], len(candidates.names)], outwards, strict=True):
        chosen.append(start + int((candidates.pixels[start:stop] @ direction).argmax()))
    names = tuple(candidates.names[k] for k in starts)
    positions, pixels, visible, occlusion = candidates[1:]
    return Landmarks(names, positions[chosen], pixels[chosen], visible[chosen], occlusion[chosen])


def _project_landmarks(
    camera: OpenCvCamera, landmark_names: tuple[str, ...], landmark_rows: NDArray[np.float32]
) -> Landmarks:
    projected = (landmark_rows[:, :3].astype(np.float64) @ camera.R.T + camera.t) @ camera.K.T
    with np.errstate(divide="ignore", invalid="ignore"):  # points in the plane of the pinhole
        pixels = projected[:, :2] / projected[:, 2:]
    visible = landmark_rows[:, 3] >= _VISIBLE_OFFSET
    cover = landmark_rows[:, 3] - _VISIBLE_OFFSET * visible
    occlusion = np.where(visible, np.digitize(cover, (_MIN_PARTIAL_COVER, _MIN_OCCLUDED_COVER)), 2)
    return Landmarks(landmark_names, landmark_rows[:, :3].copy(), pixels, visible, occlusion.astype(np.uint8))


def pair_with_previous(
    scenes: Iterable[Scene], previous: Scene | Iterable[Scene | None] | None
) -> Iterator[tuple[Scene, Scene | None]]:
    """Yield each scene with its previous scene, from which motion vectors are computed, or with None.

    previous : previous scene (or None) of each scene as an iterable, or a single scene (or None) that
        precedes the first scene. In the latter case, each later scene is paired with the scene before it, or
        with None if the scenes show different heads
    """
    if isinstance(previous, Iterable):
        for one, before in zip_longest(scenes, previous, fillvalue=_NO_PREVIOUS_SCENE):
            if one is _NO_PREVIOUS_SCENE or before is _NO_PREVIOUS_SCENE:
                expected, actual = "one scene or None per scene", "their number is different"
                refuse("previous", expected, actual, "Write None for scenes without a previous one")
            yield Scene.coerce(one), before and Scene.coerce(before)
        return
    latest = previous
    for one in scenes:
        scene = Scene.coerce(one)
        same_head = latest is not None and are_equal(latest.head.without_maps, scene.head.without_maps)
        yield scene, latest if same_head else None
        latest = scene
