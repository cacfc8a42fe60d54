"""Frames on their way: submitted one after the other, each taken while the next ones are drawn."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from dermis.frame.passes.pack import Leaving
from dermis.gpu import Device
from dermis.gpu.failures import ReopeningDevice

T = TypeVar("T")
IN_FLIGHT = 3
"""Frames submitted and not done: Python and the device overlap, with little latency."""

Send = Callable[[], Leaving]
Take = Callable[[Leaving], T]


def arriving(
    kept_open: ReopeningDevice, device: Callable[[], Device], frames: Iterable[tuple[Send, Take[T]]]
) -> Iterator[T]:
    """What is taken of each frame in turn; it is sent again where its device was lost meanwhile.

    device : the one of now
    frames : what submits each of them, and what takes what has arrived of it
    """
    sent: deque[tuple[Leaving, Send, Take[T]]] = deque()

    def arrived() -> T:
        leaving, send, take = sent.popleft()
        return kept_open.run(lambda: take(leaving if leaving.fetched.device is device() else send()))

    for send, take in frames:
        sent.append((kept_open.run(send), send, take))
        if len(sent) >= IN_FLIGHT:
            yield arrived()
    while sent:
        yield arrived()
