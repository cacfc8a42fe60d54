"""Worker that renders shards: a renderer, the maker of its scenes and encoder processes."""

from __future__ import annotations

import gc
import itertools
import os
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple, Self

from dermis.apps.batch.child_processes import LostProcessError
from dermis.apps.batch.encoder_pool import EncodedImage, EncoderPool
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.shards import Shard, ShardWriter, is_whole
from dermis.apps.batch.spec import Spec
from dermis.base.errors import DermisError, DermisWarning
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.gpu.failures import DeviceError
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

_CACHE_FRAMES = 16  # images between two with an environment, whose occlusion is kept


class Failure(NamedTuple):
    """Image that was left out, and the reason."""

    number: int
    reason: str


@dataclass(frozen=True)
class RunOptions:
    """What a run asks of all its workers.

    out : folder of the data set
    encoders : encoder processes of each worker; 0 encodes in the worker
    keep_going : leave out images that cannot be made, and record them
    """

    spec: Spec
    out: Path
    encoders: int = 0
    keep_going: bool = False


@dataclass(frozen=True)
class WorkerSlot:
    """Place of one worker on an adapter.

    adapter : as of `Renderer`
    threads : of a software adapter; 0 is its own default
    """

    adapter: str
    threads: int = 0


@dataclass(frozen=True)
class WorkerEvent:
    """Progress event sent by a worker: one field at a time.

    images : number rendered since the last event
    shard : that was completed
    failed : images that were left out of it
    note : warning for the user
    retry : why the worker ends and another one has to render its shard
    refusal : why the run ends
    """

    images: int = 0
    shard: Shard | None = None
    failed: tuple[Failure, ...] = ()
    note: str = ""
    retry: str = ""
    refusal: str = ""


class _PlannedImage(NamedTuple):
    """Image to be rendered; motion is relative to the scene `before`."""

    number: int
    parameters: Parameters
    scene: Scene
    settings: Settings
    before: Scene | None


class Worker:
    """Renders shards one after another on one device; an image depends on its number alone.

    adapter : as of `Renderer`
    """

    def __init__(self, adapter: str, work: RunOptions) -> None:
        self._work = work
        self._renderer = Renderer(adapter, rounds=_CACHE_FRAMES)
        self._maker = SceneBuilder(work.spec)
        self._encoders = EncoderPool(work.encoders, partial(_encode, work.spec))
        gc.freeze()  # scanning the objects that exist now took a tenth of an image's time

    def render_shard(self, shard: Shard, rendered: Callable[[], None] = lambda: None) -> tuple[Failure, ...]:
        """Write a shard unless it is whole, and return the images left out: always () without keep_going.

        rendered : called after each image

        Raises DermisError for faults of the spec or the disk, DeviceError for a device that was lost twice,
        LostProcessError where an encoder process ended.
        """
        work = self._work
        if is_whole(work.out, shard, work.spec):
            return ()
        failed: list[Failure] = []
        adapter = self._renderer.device.adapter.name
        with ShardWriter(work.out, shard, work.spec, adapter) as writer:
            for number, files in self._encoders.encoded(self._jobs(shard, failed)):
                writer.add(number, files)
                rendered()
            for failure in sorted(failed):
                writer.leave_out(*failure)
        return tuple(sorted(failed))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._encoders.close()

    def _jobs(self, shard: Shard, failed: list[Failure]) -> Iterator[tuple[int, Observation, Parameters]]:
        """Yield number, observation and parameters of each image that can be rendered, in order."""
        groups = deque([deque(range(shard.first, shard.stop))])
        while groups:
            numbers, sent = groups.popleft(), deque[_PlannedImage]()
            try:
                for observation in self._observed(self._plans(numbers, sent, failed)):
                    done = sent.popleft()
                    yield done.number, observation, done.parameters
            except DeviceError:
                raise
            except DermisError as fault:
                if not self._work.keep_going:
                    raise
                if len(sent) == 1:
                    failed.append(Failure(sent[0].number, str(fault)))
                    alone = []
                else:  # any of those in flight: render them again one by one
                    alone = [deque([plan.number]) for plan in sent]
                groups.extendleft(reversed([*alone, numbers]))

    def _plans(self, numbers: deque[int], sent: deque[_PlannedImage], failed: list[Failure]) -> Iterator[_PlannedImage]:
        """Take numbers, and append what is sent to be rendered."""
        while numbers:
            number = numbers.popleft()
            parameters = self._work.spec.parameters(number)
            try:
                plan = _PlannedImage(number, parameters, *self._maker.scene(parameters), self._before(number))
            except DermisError as fault:
                if not self._work.keep_going:
                    raise DermisError(f"image {number}: {fault}") from fault
                failed.append(Failure(number, str(fault)))
                continue
            sent.append(plan)
            yield plan

    def _observed(self, plans: Iterable[_PlannedImage]) -> Iterator[Observation]:
        """Yield the observation of each plan, frames in flight; those without a background have alpha."""
        spec = self._work.spec
        for alpha, group in itertools.groupby(plans, lambda plan: plan.settings.background == "none"):
            each = itertools.tee(group, 3)
            yield from self._renderer.observe(
                (plan.scene for plan in each[0]),
                (plan.settings for plan in each[1]),
                alpha=alpha,
                previous=(plan.before for plan in each[2]),  # and never what was rendered before by chance
                outputs=spec.outputs,
                landmarks=spec.landmark_tables.values(),
            )

    def _before(self, number: int) -> Scene | None:
        """Return the scene that an image's motion is relative to: the image before, of the same person."""
        spec = self._work.spec
        if "motion" not in spec.outputs or number % spec.images_per_person == 0:
            return None
        try:
            return self._maker.scene(spec.parameters(number - 1))[0]
        except DermisError:  # it is left out of the data set
            return None


def serve(pipe: Connection, slot: WorkerSlot, work: RunOptions) -> None:
    """Render the shards that come through a pipe and send events, in a worker process."""
    if slot.threads:
        os.environ["LP_NUM_THREADS"] = str(slot.threads)  # before its driver is loaded
    with warnings.catch_warnings():
        _forward_notes(lambda text: pipe.send(WorkerEvent(note=text)))
        try:
            with Worker(slot.adapter, work) as worker:
                while True:
                    shard = pipe.recv()
                    failed = worker.render_shard(shard, lambda: pipe.send(WorkerEvent(images=1)))
                    pipe.send(WorkerEvent(shard=shard, failed=failed))
        except (DeviceError, LostProcessError) as fault:
            pipe.send(WorkerEvent(retry=str(fault).removesuffix(".")))  # the message continues after it
        except DermisError as fault:
            pipe.send(WorkerEvent(refusal=str(fault)))


def _forward_notes(forward: Callable[[str], None]) -> None:
    """Send the package's warnings elsewhere; others are shown as usual."""
    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
        if issubclass(category, DermisWarning):
            forward(str(message))
        else:
            usual(message, category, *more, **named)

    warnings.simplefilter("default", DermisWarning)
    warnings.showwarning = show


def _encode(spec: Spec, number: int, observation: Observation, parameters: Parameters) -> EncodedImage:
    return number, encode_record(number, observation, parameters, spec)
