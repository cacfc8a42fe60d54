"""Worker that renders shards with a renderer, a scene builder and encoder processes."""

from __future__ import annotations

import gc
import itertools
import os
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from dermis.apps.batch.child_processes import LostProcessError
from dermis.apps.batch.encoder_pool import EncodedImage, EncoderPool
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.shards import Shard, ShardWriter, is_intact
from dermis.apps.batch.spec import Spec
from dermis.base.errors import DermisError, DermisWarning
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.gpu.failures import DeviceError
from dermis.images.skin_tone import SkinTone, skin_tone
from dermis.mesh.head import Head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

_CACHED_FRAMES = 16  # occlusion stays cached for this many images without an environment


class Failure(NamedTuple):
    """Image that could not be rendered, with the reason."""

    number: int
    reason: str


@dataclass(frozen=True)
class RunOptions:
    """Options of a run, shared by all of its workers.

    spec : spec of the data set
    out : folder of the data set
    encoders : number of encoder processes per worker; with 0, the worker encodes itself
    keep_going : whether images that cannot be rendered are omitted and recorded, instead of ending the run
    """

    spec: Spec
    out: Path
    encoders: int = 0
    keep_going: bool = False


@dataclass(frozen=True)
class WorkerSlot:
    """Adapter and thread count with which one worker renders.

    adapter : name or number of the adapter, as for `Renderer`
    threads : threads of a software adapter; 0 for its default
    """

    adapter: str
    threads: int = 0


@dataclass(frozen=True)
class WorkerEvent:
    """Progress event sent by a worker; only one of the fields is set, and `failed` comes with `shard`.

    images : number of images rendered since the last event
    shard : shard that was completed
    failed : images of that shard that could not be rendered
    note : warning for the user
    retry : reason for which the worker exits and another one must render its shard
    refusal : reason for which the run ends
    """

    images: int = 0
    shard: Shard | None = None
    failed: tuple[Failure, ...] = ()
    note: str = ""
    retry: str = ""
    refusal: str = ""


class _PlannedImage(NamedTuple):
    """Image to render, with the scene of the preceding image of the same person, if there is one.

    previous : scene relative to which motion vectors are computed; None if there is none
    """

    number: int
    parameters: Parameters
    scene: Scene
    settings: Settings
    previous: Scene | None


class Worker:
    """Renderer of shards on one device; each image depends on the spec and its number only.

    adapter : name or number of the adapter, as for `Renderer`
    """

    def __init__(self, adapter: str, options: RunOptions) -> None:
        self._options = options
        self._renderer = Renderer(adapter, cache_ttl=_CACHED_FRAMES)
        self._builder = SceneBuilder(options.spec)
        self._encoders = EncoderPool(options.encoders, partial(_encode, options.spec))
        gc.freeze()  # excludes the objects created so far from collections, which would scan them each time

    def render_shard(self, shard: Shard, on_image: Callable[[], None] = lambda: None) -> tuple[Failure, ...]:
        """Render and write a shard unless it is intact, and return the images that failed.

        Without the option `keep_going`, a failed image raises DermisError.

        on_image : function called after each image

        Raises DermisError for errors of the spec or the disk, DeviceError if the device was lost twice, and
        LostProcessError if an encoder process died.
        """
        options = self._options
        if is_intact(options.out, shard, options.spec):
            return ()
        failed: list[Failure] = []
        adapter = self._renderer.device.adapter.name
        with ShardWriter(options.out, shard, options.spec, adapter) as writer:
            for number, files in self._encoders.encode_all(self._encoder_jobs(shard, failed)):
                writer.add(number, files)
                on_image()
            for failure in sorted(failed):
                writer.leave_out(*failure)
        return tuple(sorted(failed))

    def close(self) -> None:
        """Kill the encoder processes."""
        self._encoders.close()

    def _encoder_jobs(
        self, shard: Shard, failed: list[Failure]
    ) -> Iterator[tuple[int, Observation, Parameters, SkinTone | None]]:
        """Yield number, observation, parameters and tone of each image that can be rendered, in order.

        failed : list to which images that cannot be rendered are appended
        """
        groups = deque([deque(range(shard.first, shard.stop))])
        while groups:
            numbers, in_flight = groups.popleft(), deque[_PlannedImage]()
            try:
                for observation in self._render_images(self._plan_images(numbers, in_flight, failed)):
                    done = in_flight.popleft()
                    yield done.number, observation, done.parameters, _head_tone(done.scene.head)
            except DeviceError:
                raise
            except DermisError as fault:
                if not self._options.keep_going:
                    raise
                if len(in_flight) == 1:
                    failed.append(Failure(in_flight[0].number, str(fault)))
                    single = []
                else:  # it is unknown which one failed: render them again one by one
                    single = [deque([plan.number]) for plan in in_flight]
                groups.extendleft(reversed([*single, numbers]))

    def _plan_images(
        self, numbers: deque[int], in_flight: deque[_PlannedImage], failed: list[Failure]
    ) -> Iterator[_PlannedImage]:
        """Yield the next image that can be rendered, and append it to `in_flight`.

        numbers : numbers of the images still to plan, which are removed
        failed : list to which images that cannot be rendered are appended
        """
        while numbers:
            number = numbers.popleft()
            parameters = self._options.spec.parameters(number)
            try:
                scene, settings = self._builder.build(parameters)
                plan = _PlannedImage(number, parameters, scene, settings, self._previous_scene(number))
            except DermisError as fault:
                if not self._options.keep_going:
                    raise DermisError(f"image {number}: {fault}") from fault
                failed.append(Failure(number, str(fault)))
                continue
            in_flight.append(plan)
            yield plan

    def _render_images(self, plans: Iterable[_PlannedImage]) -> Iterator[Observation]:
        """Render the planned images and yield their pictures with outputs.

        Images without a background get an alpha channel.
        """
        spec = self._options.spec
        for alpha, group in itertools.groupby(plans, lambda plan: plan.settings.background == "none"):
            each = itertools.tee(group, 3)
            yield from self._renderer.observe(
                (plan.scene for plan in each[0]),
                (plan.settings for plan in each[1]),
                alpha=alpha,
                # motion is relative to these scenes, not to the frame rendered before
                previous=(plan.previous for plan in each[2]),
                outputs=spec.outputs,
                landmarks=spec.landmark_tables.values(),
            )

    def _previous_scene(self, number: int) -> Scene | None:
        """Return the previous image's scene, for motion vectors, if it shows the same person; else None."""
        spec = self._options.spec
        if "motion" not in spec.outputs or number % spec.images_per_person == 0:
            return None
        try:
            return self._builder.build(spec.parameters(number - 1))[0]
        except DermisError:  # that image is left out of the data set
            return None


def run_worker(pipe: Connection, slot: WorkerSlot, options: RunOptions) -> None:
    """Render the shards that arrive through a pipe and send events back; this runs in a worker process."""
    if slot.threads:
        os.environ["LP_NUM_THREADS"] = str(slot.threads)  # read when the driver is loaded
    with warnings.catch_warnings():
        _forward_notes(lambda text: pipe.send(WorkerEvent(note=text)))
        try:
            with closing(Worker(slot.adapter, options)) as worker:
                while True:
                    shard = pipe.recv()
                    failed = worker.render_shard(shard, lambda: pipe.send(WorkerEvent(images=1)))
                    pipe.send(WorkerEvent(shard=shard, failed=failed))
        except (DeviceError, LostProcessError) as fault:
            pipe.send(WorkerEvent(retry=str(fault).removesuffix(".")))  # the pool appends text
        except DermisError as fault:
            pipe.send(WorkerEvent(refusal=str(fault)))


def _forward_notes(forward: Callable[[str], None]) -> None:
    """Redirect the package's warnings to a function; other warnings are shown as usual."""
    default = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
        if issubclass(category, DermisWarning):
            forward(str(message))
        else:
            default(message, category, *more, **named)

    warnings.simplefilter("default", DermisWarning)
    warnings.showwarning = show


def _head_tone(head: Head) -> SkinTone | None:
    """Return the description of the mean colour of a head's skin, None without a colour."""
    colour = head.maps.mean_colour
    return None if colour is None else skin_tone(colour)


def _encode(
    spec: Spec, number: int, observation: Observation, parameters: Parameters, tone: SkinTone | None
) -> EncodedImage:
    return number, encode_record(number, observation, parameters, spec, tone)
