"""A picture with what is known of what it shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from numpy.typing import NDArray

from dermis.frame.passes.pack import Leaving
from dermis.gpu.memo import same
from dermis.scene.model import Scene
from dermis.scene.opencv import OpenCvCamera
from dermis.scene.settings import Settings
from dermis.summary import Summarised


@dataclass(frozen=True, repr=False)
class Observation(Summarised):
    """A picture with what is known of what it shows.

    picture : (h, w, 3), or with alpha (h, w, 4): sRGB bytes, or linear floats where these are asked
    outputs : by name, (h, w) or (h, w, c) with row 0 at the top; see `dermis.frame.outputs`
    camera : K, R and t; places of the scene are in mm from the head's centre
    """

    picture: NDArray[Any]
    outputs: Mapping[str, NDArray[Any]]
    camera: OpenCvCamera


def observed_frames(
    send: Callable[..., Leaving],
    scenes: Iterable[Scene],
    previous: Scene | Iterable[Scene | None] | None,
    settings: Iterable[Settings],
) -> Iterator[tuple[Callable[[], Leaving], Callable[[Leaving], Observation]]]:
    """What submits the frame of each scene, and what takes what has arrived of it, for `arriving`.

    send : submits the frame of a scene after another, with `settings`
    previous : as of `with_previous`
    settings : of each
    """
    for (scene, before), chosen in zip(with_previous(scenes, previous), settings, strict=False):
        yield partial(send, scene, before, settings=chosen), partial(_observed, scene, chosen)


def _observed(scene: Scene, settings: Settings, leaving: Leaving) -> Observation:
    return Observation(*leaving.all(), scene.camera.to_opencv(settings.size))


def with_previous(
    scenes: Iterable[Scene], previous: Scene | Iterable[Scene | None] | None
) -> Iterator[tuple[Scene, Scene | None]]:
    """Each scene with the one that its motion is counted from, None for none.

    previous : that of the first scene, where each follows the one before it unless the head is another; or
        those of all scenes
    """
    if isinstance(previous, Iterable):
        yield from zip(map(Scene.of, scenes), previous, strict=True)
        return
    before = previous
    for given in scenes:
        scene = Scene.of(given)
        follows = before is not None and same(before.head.bare, scene.head.bare)
        yield scene, before if follows else None
        before = scene
