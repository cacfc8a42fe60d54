"""Rendering of planned images, some of which need several frames: flow of clips."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

from dermis.apps.batch.clips.flow import FLOW_INPUTS, flow_outputs
from dermis.apps.batch.image_facts import ImageFacts
from dermis.apps.batch.observed_photographs import rendered_outputs
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.spec import Spec
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.scene.model import Scene
from dermis.scene.settings import Settings


class PlannedImage(NamedTuple):
    """Image to render, with its scene and settings.

    facts : properties of the person, gaze errors and boxes, for the record
    previous : scene of the preceding image, from which motion vectors are computed; None if no motion vectors
        can be computed
    following : scene of the next frame for flow; None if the spec requests none
    """

    number: int
    parameters: Parameters
    facts: ImageFacts
    scene: Scene
    settings: Settings
    previous: Scene | None
    following: Scene | None = None


class _Role(Enum):
    """Purpose of a frame: neighbour of an image's frame, the image itself, or its flow to the next frame."""

    BEFORE = 0
    IMAGE = 1
    FORWARD = 2
    AFTER = 3


class _Frame(NamedTuple):
    role: _Role
    scene: Scene
    settings: Settings
    previous: Scene | None


@dataclass
class _Pending:
    """Observation of an image that lacks the depth of the next frame, and the depth of the previous one."""

    image: Observation
    before: Observation
    forward: Observation | None = None


def observe_images(renderer: Renderer, spec: Spec, plans: Iterable[PlannedImage]) -> Iterator[Observation]:
    """Render the planned images; yield the picture and the output arrays of each.

    Images without a background get an alpha channel.
    """
    make_frames = _flow_frames if _has_flow(spec) else _image_frames
    for alpha, group in itertools.groupby(plans, lambda plan: plan.settings.background == "none"):
        frames = make_frames(group, spec)
        copies = itertools.tee(frames, 4)
        observations = renderer.observe(
            (frame.scene for frame in copies[0]),
            (frame.settings for frame in copies[1]),
            alpha=alpha,
            linear=spec.sensor is not None,
            # motion is relative to these scenes, not to the frame rendered before
            previous=(frame.previous for frame in copies[2]),
            outputs=rendered_frame_outputs(spec),
            landmarks=spec.landmark_tables.values(),
        )
        if _has_flow(spec):
            yield from _with_flow(zip((frame.role for frame in copies[3]), observations, strict=True))
        else:
            yield from observations


def rendered_frame_outputs(spec: Spec) -> tuple[str, ...]:
    """Return the outputs to render for the frames of a spec."""
    flow = FLOW_INPUTS if _has_flow(spec) else ()
    return tuple(dict.fromkeys((*rendered_outputs(spec), *flow)))


def _has_flow(spec: Spec) -> bool:
    return spec.clip is not None and bool(spec.clip.flow)


def _image_frames(plans: Iterable[PlannedImage], spec: Spec) -> Iterator[_Frame]:
    yield from map(_image_frame, plans)


def _image_frame(plan: PlannedImage) -> _Frame:
    return _Frame(_Role.IMAGE, plan.scene, plan.settings, plan.previous)


def _flow_frames(plans: Iterable[PlannedImage], spec: Spec) -> Iterator[_Frame]:
    """Yield the frames from which images with flow are made.

    Consecutive images of a clip share their frames; others are preceded and followed by a frame of their own.
    """
    latest: PlannedImage | None = None
    for plan in plans:
        assert plan.previous is not None and plan.following is not None
        starts = plan.number % spec.sequence.frames == 0
        if latest is None or starts or latest.number != plan.number - 1:
            if latest is not None and latest.following is not None:
                yield _Frame(_Role.AFTER, latest.following, latest.settings, None)
            yield _Frame(_Role.BEFORE, plan.previous, plan.settings, None)
        yield _image_frame(plan)
        yield _Frame(_Role.FORWARD, plan.scene, plan.settings, plan.following)
        latest = plan
    if latest is not None and latest.following is not None:
        yield _Frame(_Role.AFTER, latest.following, latest.settings, None)


def _with_flow(frames: Iterable[tuple[_Role, Observation]]) -> Iterator[Observation]:
    """Yield the observation of each image with its flow, from the observations of `_flow_frames`."""
    before: Observation | None = None
    pending: _Pending | None = None
    for role, observation in frames:
        if role is _Role.FORWARD:
            assert pending is not None
            pending.forward = observation
            continue
        if pending is not None:  # this is the frame after it
            yield _finished(pending, observation)
            before, pending = pending.image, None
        if role is _Role.BEFORE:
            before = observation
        elif role is _Role.IMAGE:
            assert before is not None
            pending = _Pending(observation, before)


def _finished(pending: _Pending, after: Observation) -> Observation:
    image, forward = pending.image, pending.forward
    assert forward is not None
    flow = flow_outputs("backward", image.outputs, pending.before.outputs["depth"])
    flow |= flow_outputs("forward", forward.outputs, after.outputs["depth"])
    return replace(image, outputs={**image.outputs, **flow})
