"""Endless stream of rendered images with ground truth, for training without files."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path

from dermis.apps.batch.finishing import finished_image
from dermis.apps.batch.output_encoding import LINEAR_PICTURE
from dermis.apps.batch.reader import record_fields
from dermis.apps.batch.records import make_record
from dermis.apps.batch.spec import MAX_IMAGES, Spec, load_spec, parse_spec
from dermis.apps.batch.training_arrays import ImageArrays, arrays
from dermis.apps.batch.worker import RunOptions, Worker
from dermis.base.quantities import checked_integer

_MAX_PREFETCH = 1000
_STOP_CHECK_INTERVAL_S = 0.1
_ReadyImages = queue.Queue["ImageArrays | BaseException"]


def stream(
    spec: Spec | Mapping[str, object] | str | Path,
    *,
    adapter: str = "auto",
    first: int = 0,
    step: int = 1,
    prefetch: int = 4,
) -> Iterator[ImageArrays]:
    """Return an endless iterator of rendered images with their ground truth, as arrays with fixed keys.

    A thread renders the next images while the caller uses earlier ones. The images are those that `dermis
    batch` writes for the same spec; `count` is ignored. Each array is new and writable, so that DLPack can
    pass it to other libraries without a copy.

    Parameters
    ----------
    spec : Spec, mapping, str or Path
        Spec of a data set: a TOML file, its parsed content, or a `Spec`.
    adapter : str
        "auto", "cpu" or part of the name of an adapter.
    first, step : int
        Number of the first person, and difference between the numbers of successive persons: worker i of n
        takes `first=i, step=n`. Each person has `images_per_person` consecutive images.
    prefetch : int
        Largest number of rendered images that wait for the caller.

    Returns
    -------
    iterator of dict
        Images with the keys of `dermis.dataset.arrays`. Its method `close` ends the thread.

    Raises
    ------
    DermisError
        For an invalid spec or adapter, and for images that cannot be rendered.

    Examples
    --------
    >>> import dermis.dataset
    >>> images = dermis.dataset.stream({"size": [64, 64], "outputs": ["depth"]}, adapter="cpu")
    >>> next(images)["depth"].shape  # doctest: +SKIP
    (64, 64)
    """
    if isinstance(spec, Mapping):
        spec = parse_spec(spec)
    loaded = spec if isinstance(spec, Spec) else load_spec(spec)
    group = loaded.images_per_person
    first = checked_integer("first", first, 0, MAX_IMAGES // group - 1)
    step = checked_integer("step", step, 1, MAX_IMAGES)
    size = checked_integer("prefetch", prefetch, 1, _MAX_PREFETCH)
    endless = loaded.replace(count=MAX_IMAGES)
    return _consume(endless, adapter, _image_numbers(first, step, group), size)


def _image_numbers(first_person: int, step: int, images_per_person: int) -> Iterator[int]:
    """Yield the numbers of all images of every step-th person; after the last person, start again."""
    while True:
        for person in range(first_person, MAX_IMAGES // images_per_person, step):
            yield from range(person * images_per_person, (person + 1) * images_per_person)


def _consume(spec: Spec, adapter: str, numbers: Iterator[int], prefetch: int) -> Iterator[ImageArrays]:
    ready, stop = _ReadyImages(prefetch), threading.Event()
    arguments = spec, adapter, numbers, ready, stop
    thread = threading.Thread(target=_produce, args=arguments, name="dermis stream", daemon=True)
    thread.start()
    try:
        while True:
            image = ready.get()
            if isinstance(image, BaseException):
                raise image
            yield image
    finally:
        stop.set()
        thread.join()


def _produce(
    spec: Spec, adapter: str, numbers: Iterator[int], ready: _ReadyImages, stop: threading.Event
) -> None:
    """Render images and append them to a queue until `stop` is set; append an exception if one is raised."""
    try:
        with closing(Worker(adapter, RunOptions(spec, Path()), freezes_objects=False)) as worker:
            for number, observation, parameters, tone, facts in worker.observe(numbers):
                observation, facts = finished_image(observation, parameters, facts, spec)
                record = make_record(number, observation, parameters, spec, tone, facts)
                names = [*spec.stored_outputs, *([LINEAR_PICTURE] if spec.keep_linear else [])]
                outputs = {name: observation.outputs[name] for name in names}
                fields = record_fields(record, f"image {number}") | outputs
                if not _put(ready, arrays(fields | {"picture": observation.picture}), stop):
                    return
    except BaseException as fault:  # raised again in the thread of the caller
        _put(ready, fault, stop)


def _put(ready: _ReadyImages, item: ImageArrays | BaseException, stop: threading.Event) -> bool:
    """Append an item to the queue; return False if `stop` was set before there was room."""
    while not stop.is_set():
        try:
            ready.put(item, timeout=_STOP_CHECK_INTERVAL_S)
            return True
        except queue.Full:
            continue
    return False
