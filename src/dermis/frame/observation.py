"""A picture with what is known of what it shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.summary import Summarised
from dermis.frame.features.outputs.planes import PlaneArray
from dermis.frame.features.outputs.readback import Readback
from dermis.gpu.memo import same
from dermis.scene.head_pose import gaze, head_pose
from dermis.scene.model import Scene
from dermis.scene.opencv import OpenCvCamera
from dermis.scene.settings import Settings

_MISSING: Any = object()


class Landmarks(NamedTuple):
    """Landmarks of a set in a picture.

    names : as the set has them, in order
    positions_mm : (n, 3) in the world, from the head's centre [mm]
    pixels : (n, 2) x to the right, y down; the middle of the upper left pixel is at (0, 0)
    visible : (n,) whether the mesh leaves them free; hairs hide none
    """

    names: tuple[str, ...]
    positions_mm: NDArray[np.float32]
    pixels: NDArray[np.float64]
    visible: NDArray[np.bool_]


@dataclass(frozen=True, repr=False)
class Observation(Summarised):
    """A picture with what is known of what it shows.

    picture : (h, w, 3), or with alpha (h, w, 4): sRGB bytes, or linear floats where these are asked
    outputs : by name, (h, w) or (h, w, c) with row 0 at the top; see `dermis.scene.outputs`
    camera : K, R and t; places of the scene are in mm from the head's centre
    landmarks : by the name of their set
    head_pose : (3, 4) rotation and shift [mm] from the head at rest to the camera, see `scene.head_pose`
    gaze : (2, 3) unit vectors along which the left and the right eye look, in the camera's axes: x right,
        y down, z forward; None for a head without eyes of true shape
    """

    picture: NDArray[np.uint8 | np.float32]
    outputs: Mapping[str, PlaneArray]
    camera: OpenCvCamera
    landmarks: Mapping[str, Landmarks]
    head_pose: NDArray[np.float64]
    gaze: NDArray[np.float64] | None


def observed_frames(
    send: Callable[..., Readback],
    scenes: Iterable[Scene],
    previous: Scene | Iterable[Scene | None] | None,
    settings: Iterable[Settings],
) -> Iterator[tuple[Callable[[], Readback], Callable[[Readback], Observation]]]:
    """What submits the frame of each scene, and what takes what has arrived of it, for `arriving`.

    send : submits the frame of a scene after another, with `settings`
    previous : as of `with_previous`
    settings : of each
    """
    for (scene, before), chosen in zip(with_previous(scenes, previous), settings, strict=False):
        yield partial(send, scene, before, settings=chosen), partial(_observed, scene, chosen)


def _observed(scene: Scene, settings: Settings, readback: Readback) -> Observation:
    picture, outputs, found = readback.all()
    camera = scene.camera.to_opencv(settings.size)
    landmarks = {name: _landmarks(camera, *one) for name, one in found.items()}
    return Observation(picture, outputs, camera, landmarks, head_pose(scene), gaze(scene))


def _landmarks(camera: OpenCvCamera, names: tuple[str, ...], rows: NDArray[np.float32]) -> Landmarks:
    seen = (rows[:, :3].astype(np.float64) @ camera.R.T + camera.t) @ camera.K.T
    with np.errstate(divide="ignore", invalid="ignore"):  # in the plane of the eye
        pixels = seen[:, :2] / seen[:, 2:]
    return Landmarks(names, rows[:, :3].copy(), pixels, rows[:, 3] > 0)


def with_previous(
    scenes: Iterable[Scene], previous: Scene | Iterable[Scene | None] | None
) -> Iterator[tuple[Scene, Scene | None]]:
    """Each scene with the one that its motion is counted from, None for none.

    previous : that of the first scene, where each follows the one before it unless the head is another; or
        those of all scenes
    """
    if isinstance(previous, Iterable):
        for given, told in zip_longest(scenes, previous, fillvalue=_MISSING):
            if given is _MISSING or told is _MISSING:
                refuse("previous", "one for each scene", "there are fewer or more", "Write None for none")
            yield Scene.of(given), told and Scene.of(told)
        return
    before = previous
    for given in scenes:
        scene = Scene.of(given)
        follows = before is not None and same(before.head.bare, scene.head.bare)
        yield scene, before if follows else None
        before = scene
