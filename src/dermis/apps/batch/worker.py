"""Worker that renders parts of shards with a renderer, a scene builder and encoder processes."""

from __future__ import annotations

import gc
import os
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property, partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from dermis.apps.batch.atomic_files import remove_path
from dermis.apps.batch.child_processes import LostProcessError
from dermis.apps.batch.encoder_pool import EncodedImage, EncoderPool
from dermis.apps.batch.finishing import finished_image
from dermis.apps.batch.image_facts import ImageFacts
from dermis.apps.batch.observed_frames import PlannedImage, observe_images
from dermis.apps.batch.parts import KeptImages, copy_images, join_parts, kept_images
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.shards import (
    Part,
    Shard,
    ShardWriter,
    is_intact,
    list_parts,
    shard_at,
    shard_exists,
    shard_path,
)
from dermis.apps.batch.spec import Spec
from dermis.base.errors import DermisError, DermisWarning
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.gpu.failures import DeviceError
from dermis.images.skin_tone import SkinTone, skin_tone
from dermis.mesh.head import Head
from dermis.scene.model import Scene

_MAX_CACHED_FRAMES = 16  # occlusion stays cached for this many images without an environment


class Failure(NamedTuple):
    """Image that could not be rendered, with the reason."""

    number: int
    reason: str


@dataclass(frozen=True)
class RunOptions:
    """Options of a run, shared by all workers of the run.

    spec : spec of the data set
    out : folder of the data set
    encoders : number of encoder processes per worker; if 0, the worker encodes the images
    keep_going : whether images that cannot be rendered are omitted and recorded, instead of ending the run
    """

    spec: Spec
    out: Path
    encoders: int = 0
    keep_going: bool = False


@dataclass(frozen=True)
class WorkerSlot:
    """Graphics adapter and number of threads of one worker.

    adapter : name or number of the graphics adapter, as for `Renderer`
    threads : number of threads if the adapter is a software renderer; 0 for the adapter's default
    """

    adapter: str
    threads: int = 0


@dataclass(frozen=True)
class WorkerEvent:
    """Progress event sent by a worker; only one of `images`, `done`, `note`, `retry` and `refusal` is set.

    images : number of images rendered since the last event
    done : part that is complete, or shard that was verified
    rendered : number of images of the part `done` that were rendered, rather than found on the disk
    failed : images of the part `done` that could not be rendered
    missing : damaged parts that must be rendered again; for a damaged shard, all parts of the shard
    note : warning for the user
    retry : reason why the worker exits; another worker must continue the tasks of this worker
    refusal : reason why the run must end
    """

    images: int = 0
    done: Shard | None = None
    rendered: int = 0
    failed: tuple[Failure, ...] = ()
    missing: tuple[Part, ...] = ()
    note: str = ""
    retry: str = ""
    refusal: str = ""


_ObservedImage = tuple[int, Observation, Parameters, SkinTone | None, ImageFacts]


class Worker:
    """Worker that renders parts of shards on one device.

    Each image depends only on the spec and on the image's number.

    The device is opened when the first image is rendered.

    adapter : name or number of the graphics adapter, as for `Renderer`
    freezes_objects : whether to exclude all objects of the process from garbage collection once the renderer
        exists, which saves time in processes that only render
    """

    def __init__(self, adapter: str, options: RunOptions, *, freezes_objects: bool = True) -> None:
        self._options, self._adapter, self._freezes_objects = options, adapter, freezes_objects
        self._builder = SceneBuilder(options.spec)
        self._encoders = EncoderPool(options.encoders, partial(_encode_image, options.spec))

    @cached_property
    def _renderer(self) -> Renderer:
        renderer = Renderer(self._adapter, cache_ttl=_MAX_CACHED_FRAMES)
        if self._freezes_objects:  # otherwise each garbage collection scans the objects created so far
            gc.freeze()
        return renderer

    def run_tasks(self, tasks: Iterable[Shard], send_event: Callable[[WorkerEvent], None]) -> None:
        """Process the tasks: render each part, join the parts of complete shards, and verify each shard.

        The next task is requested while frames of the previous task are still being rendered. Without the
        option `keep_going`, a failed image raises DermisError.

        send_event : function called with each event

        Raises DermisError for errors of the spec or the disk, DeviceError if the device was lost twice, and
        LostProcessError if an encoder process died.
        """
        planned, failed = deque[tuple[Part, KeptImages]](), list[Failure]()
        numbers = self._image_numbers(tasks, planned, send_event)
        images = self._encoders.encode_all(self._encoder_jobs(numbers, failed))
        image = next(images, None)
        while planned:
            part, kept = planned.popleft()
            adapter = self._renderer.device.adapter.name if kept.stop < part.stop else ""
            rendered = 0
            with ShardWriter(self._options.out, part, self._options.spec, adapter) as writer:
                if kept.path:
                    copy_images(writer, kept.path, part.first, kept.stop)
                while image is not None and part.first <= image[0] < part.stop:
                    writer.add(*image)
                    rendered += 1
                    send_event(WorkerEvent(images=1))
                    image = next(images, None)  # all failures before it are known then
                part_failures = tuple(sorted(one for one in failed if part.first <= one.number < part.stop))
                for failure in part_failures:
                    writer.leave_out(*failure)
            send_event(
                WorkerEvent(
                    done=part, rendered=rendered, failed=part_failures, missing=self._join_shard(part)
                )
            )

    def observe(self, image_numbers: Iterator[int]) -> Iterator[_ObservedImage]:
        """Render images without writing files; yield number, observation, parameters, skin tone and facts.

        For a spec with [sensor], the pictures are linear, and are the arguments of `as_photograph`.

        Raises DermisError for images that cannot be rendered.
        """
        return self._encoder_jobs(image_numbers, [])

    def close(self) -> None:
        """Kill the encoder processes."""
        self._encoders.close()

    def _image_numbers(
        self,
        tasks: Iterable[Shard],
        unwritten_parts: deque[tuple[Part, KeptImages]],
        send_event: Callable[[WorkerEvent], None],
    ) -> Iterator[int]:
        """Yield the numbers of the images to render, and send the events of tasks that need no rendering.

        unwritten_parts : queue that receives each part to write, together with the existing images to copy
            into the part
        """
        out, spec = self._options.out, self._options.spec
        for task in tasks:
            if not isinstance(task, Part):
                intact = is_intact(out, task, spec)
                if not intact:
                    remove_path(shard_path(out, task, spec))
                send_event(WorkerEvent(done=task, missing=() if intact else tuple(list_parts(task, spec))))
            elif is_intact(out, task, spec) or shard_exists(out, shard_at(task.index, spec), spec):
                send_event(WorkerEvent(done=task, missing=self._join_shard(task)))
            else:
                kept = kept_images(out, task, spec)
                unwritten_parts.append((task, kept))
                yield from range(kept.stop, task.stop)

    def _join_shard(self, part: Part) -> tuple[Part, ...]:
        """Join all parts of the shard that contains `part`, if all exist; return the damaged parts."""
        spec = self._options.spec
        return join_parts(self._options.out, shard_at(part.index, spec), spec)

    def _encoder_jobs(
        self, image_numbers: Iterator[int], failures: list[Failure]
    ) -> Iterator[_ObservedImage]:
        """Render images; yield the number, observation, parameters, skin tone and facts of each, in order.

        An observation holds the picture and the output arrays of an image.

        image_numbers : numbers of the images to render
        failures : list that receives the images that could not be rendered
        """
        groups = deque([image_numbers])
        while groups:
            image_numbers, in_flight = groups.popleft(), deque[PlannedImage]()
            plans = self._plan_images(image_numbers, in_flight, failures)
            try:
                for observation in observe_images(self._renderer, self._options.spec, plans):
                    done = in_flight.popleft()
                    tone = _head_skin_tone(done.scene.head)
                    yield done.number, observation, done.parameters, tone, done.facts
            except DeviceError:
                raise
            except DermisError as fault:
                if not self._options.keep_going:
                    raise
                if len(in_flight) == 1:
                    failures.append(Failure(in_flight[0].number, str(fault)))
                    single = []
                else:  # it is unknown which one failed: render them again one by one
                    single = [iter([plan.number]) for plan in in_flight]
                groups.extendleft(reversed([*single, image_numbers]))

    def _plan_images(
        self, image_numbers: Iterator[int], images_in_flight: deque[PlannedImage], failures: list[Failure]
    ) -> Iterator[PlannedImage]:
        """Yield each image whose scene can be built, after appending the image to `images_in_flight`.

        image_numbers : numbers of the images still to plan
        images_in_flight : queue of the images that are being rendered
        failures : list that receives the images whose scenes could not be built
        """
        for number in image_numbers:
            parameters = self._options.spec.parameters(number)
            try:
                scene, settings = self._builder.build(parameters)
                facts = self._builder.facts(parameters, scene)
                neighbours = self._neighbour_scenes(number)
                blurred = self._builder.blur_scenes(number, parameters, scene)
                plan = PlannedImage(number, parameters, facts, scene, settings, *neighbours, blurred)
            except DermisError as fault:
                if not self._options.keep_going:
                    raise DermisError(f"image {number}: {fault}") from fault
                failures.append(Failure(number, str(fault)))
                continue
            images_in_flight.append(plan)
            yield plan

    def _neighbour_scenes(self, image_number: int) -> tuple[Scene | None, Scene | None]:
        """Return the scenes of the frames before and after an image, as far as outputs need them.

        Frames of clips have neighbours in motion also before the first and after the last frame. The scene
        before another image is that of the same camera in the preceding moment; it is None if this shows
        another person, or if the scene cannot be built.
        """
        spec, sequence = self._options.spec, self._options.spec.sequence
        has_flow = spec.clip is not None and bool(spec.clip.flow)
        if not has_flow and not {"motion", "motion_depth"} & {*spec.outputs}:
            return None, None
        if spec.clip is not None:
            before, after = (spec.neighbour_parameters(image_number, offset) for offset in (-1, 1))
            return self._builder.build(before)[0], self._builder.build(after)[0] if has_flow else None
        if image_number % spec.images_per_person < sequence.images:
            return None, None
        try:
            return self._builder.build(spec.parameters(image_number - sequence.images))[0], None
        except DermisError:  # that image is left out of the data set
            return None, None


def run_worker(pipe: Connection, slot: WorkerSlot, options: RunOptions) -> None:
    """Process the tasks that arrive through a pipe and send events back; called in a worker process."""
    if slot.threads:
        os.environ["LP_NUM_THREADS"] = str(slot.threads)  # read when the driver is loaded
    with warnings.catch_warnings():
        _forward_warnings(lambda text: pipe.send(WorkerEvent(note=text)))
        try:
            with closing(Worker(slot.adapter, options)) as worker:
                while True:
                    worker.run_tasks(available_tasks(pipe), pipe.send)
        except (DeviceError, LostProcessError) as fault:
            pipe.send(WorkerEvent(retry=str(fault).removesuffix(".")))  # the pool appends text
        except DermisError as fault:
            pipe.send(WorkerEvent(refusal=str(fault)))


def available_tasks(pipe: Connection) -> Iterator[Shard]:
    """Wait for the next task of a worker and yield it, then yield all further tasks that have arrived."""
    yield pipe.recv()
    while pipe.poll():
        yield pipe.recv()


def _forward_warnings(forward_message: Callable[[str], None]) -> None:
    """Redirect the warnings of this package to a function; other warnings are shown as usual."""
    default = warnings.showwarning

    def forward_or_show(
        message: Warning | str, category: type[Warning], *warning_arguments: Any, **warning_options: Any
    ) -> None:
        if issubclass(category, DermisWarning):
            forward_message(str(message))
        else:
            default(message, category, *warning_arguments, **warning_options)

    warnings.simplefilter("default", DermisWarning)
    warnings.showwarning = forward_or_show


def _head_skin_tone(head: Head) -> SkinTone | None:
    """Return the description of the mean colour of a head's skin; None for a head without a skin colour."""
    colour = head.maps.mean_colour
    return None if colour is None else skin_tone(colour)


def _encode_image(
    spec: Spec,
    image_number: int,
    observation: Observation,
    parameters: Parameters,
    skin_tone: SkinTone | None,
    facts: ImageFacts,
) -> EncodedImage:
    observation, facts = finished_image(observation, parameters, facts, spec)
    return image_number, encode_record(image_number, observation, parameters, spec, skin_tone, facts)
