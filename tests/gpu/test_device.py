"""A device lets go of its threads."""

from __future__ import annotations

import os
import threading

from dermis.gpu import Device, open_device


def test_a_device_that_is_dropped_begins_nothing_more(device: Device) -> None:
    """What is compiled for nobody would hold memory and cores, and the end of the process up."""
    gate = threading.Event()
    dropped = open_device(device.adapter.name)
    busy = [dropped.executor.submit(gate.wait) for _ in range(os.cpu_count() or 1)]
    waiting = dropped.executor.submit(int)
    try:
        del dropped
        assert waiting.cancelled()
    finally:
        gate.set()
    assert all(one.result(timeout=60) for one in busy)
