"""Rendering of planned images, some of which need several frames, for the flow of clips or for blur."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from dermis.apps.batch.clips.flow import FLOW_INPUTS, flow_outputs
from dermis.apps.batch.image_facts import ImageFacts
from dermis.apps.batch.observed_photographs import rendered_outputs
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.spec import Spec
from dermis.base.arrays import Doubles
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

_COVERAGE = "alpha"
"""Output that is averaged like the picture, because backgrounds are blended with it."""


class PlannedImage(NamedTuple):
    """Image to render, with its scene and settings.

    facts : properties of the person, gaze errors and boxes, for the record
    previous : scene of the preceding image, from which motion vectors are computed; None if no motion vectors
        can be computed
    following : scene of the next frame for flow; None if the spec requests none
    blurred : scenes whose average is the picture; empty for a sharp picture
    """

    number: int
    parameters: Parameters
    facts: ImageFacts
    scene: Scene
    settings: Settings
    previous: Scene | None
    following: Scene | None = None
    blurred: tuple[Scene, ...] = ()


class _Role(Enum):
    """Purpose of a frame."""

    BEFORE = "frame before an image, whose depth shows which points it hides"
    IMAGE = "image itself"
    FORWARD = "image again, with its motion relative to the next frame"
    SAMPLE = "frame whose picture is a part of a blurred one"
    AFTER = "frame after an image"


class _Frame(NamedTuple):
    """Frame to render.

    completes : whether the frame completes its image; images with flow are completed by the frame after them
    """

    role: _Role
    scene: Scene
    settings: Settings
    previous: Scene | None = None
    completes: bool = False


@dataclass
class _Pending:
    """Observations of an image that is not complete.

    image : observation of the image
    before : observation of the frame before it, for flow
    forward : observation with the motion relative to the next frame
    picture_sum, alpha_sum, count : sums of the pictures and alpha outputs of blurred frames, and their number
    """

    image: Observation
    before: Observation | None
    forward: Observation | None = None
    picture_sum: Doubles | None = None
    alpha_sum: Doubles | None = None
    count: int = 0

    def add_sample(self, sample: Observation) -> None:
        """Add the linear picture of a frame to the blurred picture."""
        picture, alpha = sample.picture.astype(np.float64), sample.outputs.get(_COVERAGE)
        self.picture_sum = picture if self.picture_sum is None else self.picture_sum + picture
        if alpha is not None:
            self.alpha_sum = alpha.astype(np.float64) if self.alpha_sum is None else self.alpha_sum + alpha
        self.count += 1

    def finished(self, after: Observation | None) -> Observation:
        """Return the observation of the image.

        after : observation of the frame after it, for flow
        """
        outputs, picture = dict(self.image.outputs), self.image.picture
        if self.forward is not None:
            assert self.before is not None and after is not None
            outputs |= flow_outputs("backward", outputs, self.before.outputs["depth"])
            outputs |= flow_outputs("forward", self.forward.outputs, after.outputs["depth"])
        if self.picture_sum is not None:
            picture = np.asarray(self.picture_sum / self.count, np.float32)
        if self.alpha_sum is not None:
            outputs[_COVERAGE] = np.asarray(self.alpha_sum / self.count, np.float32)
        return replace(self.image, picture=picture, outputs=outputs)


def observe_images(renderer: Renderer, spec: Spec, plans: Iterable[PlannedImage]) -> Iterator[Observation]:
    """Render the planned images; yield the picture and the output arrays of each.

    Images without a background get an alpha channel. Pictures are linear for a spec with [sensor] or [blur].
    """
    for alpha, group in itertools.groupby(plans, lambda plan: plan.settings.background == "none"):
        copies = itertools.tee(_frames(group, spec), 4)
        observations = renderer.observe(
            (frame.scene for frame in copies[0]),
            (frame.settings for frame in copies[1]),
            alpha=alpha,
            linear=spec.sensor is not None or spec.blur is not None,
            # motion is relative to these scenes, not to the frame rendered before
            previous=(frame.previous for frame in copies[2]),
            outputs=_frame_outputs(spec),
            landmarks=spec.landmark_tables.values(),
        )
        yield from _combined(zip(copies[3], observations, strict=True))


def _frame_outputs(spec: Spec) -> tuple[str, ...]:
    """Return the outputs to render for the frames of a spec."""
    flow = FLOW_INPUTS if _has_flow(spec) else ()
    return tuple(dict.fromkeys((*rendered_outputs(spec), *flow)))


def _has_flow(spec: Spec) -> bool:
    return spec.clip is not None and bool(spec.clip.flow)


def _frames(plans: Iterable[PlannedImage], spec: Spec) -> Iterator[_Frame]:
    """Yield the frames from which images are made.

    For flow, consecutive images of a clip share their frames; others are preceded and followed by a frame of
    their own.
    """
    latest: PlannedImage | None = None
    for plan in plans:
        if plan.following is not None:
            starts = plan.number % spec.sequence.frames == 0
            if latest is None or starts or latest.number != plan.number - 1:
                if latest is not None and latest.following is not None:
                    yield _Frame(_Role.AFTER, latest.following, latest.settings)
                assert plan.previous is not None
                yield _Frame(_Role.BEFORE, plan.previous, plan.settings)
        is_alone = plan.following is None and not plan.blurred
        yield _Frame(_Role.IMAGE, plan.scene, plan.settings, plan.previous, is_alone)
        if plan.following is not None:
            yield _Frame(_Role.FORWARD, plan.scene, plan.settings, plan.following)
        for k, scene in enumerate(plan.blurred, 1):
            completes = plan.following is None and k == len(plan.blurred)
            yield _Frame(_Role.SAMPLE, scene, plan.settings, None, completes)
        latest = plan
    if latest is not None and latest.following is not None:
        yield _Frame(_Role.AFTER, latest.following, latest.settings)


def _combined(frames: Iterable[tuple[_Frame, Observation]]) -> Iterator[Observation]:
    """Yield the observation of each image, from the observations of `_frames`."""
    before: Observation | None = None
    pending: _Pending | None = None
    for (role, *_, completes), observation in frames:
        if role is _Role.FORWARD:
            assert pending is not None
            pending.forward = observation
        elif role is _Role.SAMPLE:
            assert pending is not None
            pending.add_sample(observation)
        else:
            if pending is not None:
                yield pending.finished(observation)
                before, pending = pending.image, None
            if role is _Role.BEFORE:
                before = observation
            elif role is _Role.IMAGE:
                pending = _Pending(observation, before)
        if completes and pending is not None:
            yield pending.finished(None)
            pending = None
