"""Frames in flight: later frames are submitted while earlier ones are read back."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from dermis.frame.features.outputs.readback import Readback
from dermis.gpu import Device
from dermis.gpu.failures import ReopeningDevice

T = TypeVar("T")
FRAMES_IN_FLIGHT = 3
"""Largest number of frames that are submitted but not complete.

With three frames, Python and the device work in parallel, and the latency stays low.
"""

SubmitFrame = Callable[[], Readback]
ReceiveResult = Callable[[Readback], T]


def pipeline_frames(
    reopening_device: ReopeningDevice,
    current_device: Callable[[], Device],
    frames: Iterable[tuple[SubmitFrame, ReceiveResult[T]]],
) -> Iterator[T]:
    """Yield the results of frames in order; while a frame is read back, later frames are already submitted.

    A frame whose device is lost is submitted again.

    reopening_device : object that runs functions, and opens the device again when it is lost
    current_device : function that returns the current device
    frames : for each frame, a function that submits the frame, and a function that returns the result of its
        readback
    """
    pending: deque[tuple[Readback, SubmitFrame, ReceiveResult[T]]] = deque()

    def oldest_result() -> T:
        readback, submit, receive = pending.popleft()
        return reopening_device.run(
            lambda: receive(readback if readback.fetched.device is current_device() else submit())
        )

    for submit, receive in frames:
        pending.append((reopening_device.run(submit), submit, receive))
        if len(pending) >= FRAMES_IN_FLIGHT:
            yield oldest_result()
    while pending:
        yield oldest_result()
