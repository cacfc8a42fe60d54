"""Worker that renders shards: a renderer, the maker of its scenes and encoder processes."""

from __future__ import annotations

import gc
import itertools
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

from dermis.apps.batch.encoder_pool import Encoded, Encoders
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.scenes import SceneMaker
from dermis.apps.batch.shards import Shard, ShardWriter, is_whole
from dermis.apps.batch.spec import Spec
from dermis.base.errors import DermisError
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.gpu.failures import DeviceError
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

_ROUNDS = (
    16  # images that may come between two with an environment, whose occlusion takes a second to prepare
)


class Failure(NamedTuple):
    """An image that was left out, and why."""

    number: int
    reason: str


@dataclass(frozen=True)
class Work:
    """What is to be done, alike for all workers.

    out : folder of the data set
    encoders : processes of each worker that encode; 0 encodes between drawing
    keep_going : leave out images that cannot be made, and record them
    """

    spec: Spec
    out: Path
    encoders: int = 0
    keep_going: bool = False


class _Plan(NamedTuple):
    """An image to be drawn."""

    number: int
    parameters: Parameters
    scene: Scene
    settings: Settings
    before: Scene | None


class Worker:
    """Draws shards one after another on one device; an image depends on its number alone.

    adapter : as of `Renderer`
    """

    def __init__(self, adapter: str, work: Work) -> None:
        self._work = work
        self._renderer = Renderer(adapter, rounds=_ROUNDS)
        self._maker = SceneMaker(work.spec)
        self._encoders = Encoders(work.encoders, partial(_encode, work.spec))
        gc.freeze()  # what is there by now stays: looking through it took a tenth of an image's time

    def draw(self, shard: Shard, drawn: Callable[[], None] = lambda: None) -> tuple[Failure, ...]:
        """Write a shard, unless it is there and whole; what was left out, always () without keep_going.

        drawn : called after each image

        Raises DermisError for what the spec or the disk is at fault for, DeviceError for a device that was
        lost twice, LostProcessError where a process that encodes ended.
        """
        work = self._work
        if is_whole(work.out, shard, work.spec):
            return ()
        failed: list[Failure] = []
        adapter = self._renderer.device.adapter.name
        with ShardWriter(work.out, shard, work.spec, adapter) as writer:
            for number, found in self._encoders.encoded(self._jobs(shard, failed)):
                writer.add(number, found)
                drawn()
            for failure in sorted(failed):
                writer.leave_out(*failure)
        return tuple(sorted(failed))

    def close(self) -> None:
        """End the processes that encode."""
        self._encoders.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _jobs(self, shard: Shard, failed: list[Failure]) -> Iterator[tuple[Any, ...]]:
        """Number, observation and parameters of each image that can be drawn, in their order."""
        groups = deque([deque(range(shard.first, shard.stop))])
        while groups:
            numbers, sent = groups.popleft(), deque[_Plan]()
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
                else:  # any of those in flight: once more, one by one
                    alone = [deque([plan.number]) for plan in sent]
                groups.extendleft(reversed([*alone, numbers]))

    def _plans(self, numbers: deque[int], sent: deque[_Plan], failed: list[Failure]) -> Iterator[_Plan]:
        """Take numbers, and note what is sent to be drawn."""
        while numbers:
            number = numbers.popleft()
            parameters = self._work.spec.parameters(number)
            try:
                plan = _Plan(number, parameters, *self._maker.scene(parameters), self._before(number))
            except DermisError as fault:
                if not self._work.keep_going:
                    raise DermisError(f"image {number}: {fault}") from fault
                failed.append(Failure(number, str(fault)))
                continue
            sent.append(plan)
            yield plan

    def _observed(self, plans: Iterable[_Plan]) -> Iterator[Observation]:
        """What is seen of each, frames in flight; those without a background have alpha."""
        spec = self._work.spec
        asked: dict[str, Any] = {"outputs": spec.outputs}
        asked["landmarks"] = spec.landmark_tables.values()
        for alpha, alike in itertools.groupby(plans, lambda plan: plan.settings.background == "none"):
            each = itertools.tee(alike, 3)
            scenes, settings = (plan.scene for plan in each[0]), (plan.settings for plan in each[1])
            before = (plan.before for plan in each[2])  # and never what happened to be drawn before
            yield from self._renderer.observe(scenes, settings, alpha=alpha, previous=before, **asked)

    def _before(self, number: int) -> Any:
        """The scene that an image's motion is counted from: the image before it, of the same person."""
        spec = self._work.spec
        if "motion" not in spec.outputs or number % spec.images_per_person == 0:
            return None
        try:
            return self._maker.scene(spec.parameters(number - 1))[0]
        except DermisError:  # it is left out of the data set
            return None


def _encode(spec: Spec, number: int, observation: Observation, parameters: Parameters) -> Encoded:
    return number, encode_record(number, observation, parameters, spec)


@dataclass(frozen=True)
class WorkerEvent:
    """One of these at a time.

    images : that were drawn since the last time
    shard : that is whole now
    failed : images that were left out of it
    note : for who waits
    again : why the worker ends, and its shard is drawn by another
    refusal : why the run ends
    """

    images: int = 0
    shard: Shard | None = None
    failed: tuple[Failure, ...] = ()
    note: str = ""
    again: str = ""
    refusal: str = ""
