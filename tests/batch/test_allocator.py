"""Processes that were told to give memory back at once keep it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from dermis.batch.allocator import keep_freed_memory

COUNT = """
import os, resource, sys
import numpy as np
from dermis.batch.allocator import keep_freed_memory

if sys.argv[1] == "keep":
    assert keep_freed_memory()
    assert "MALLOC_TRIM_THRESHOLD_" not in os.environ
np.ones(1 << 17)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(10):
    np.ones(1 << 17)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(what: str) -> int:
    """Pages that ten arrays of 1 MiB fault in, in a process of dask's."""
    environment = {**os.environ, "MALLOC_TRIM_THRESHOLD_": "65536"}
    done = subprocess.run(
        [sys.executable, "-c", COUNT, what], env=environment, capture_output=True, text=True, check=True
    )
    return int(done.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="glibc's allocator")
def test_arrays_take_memory_that_was_freed() -> None:
    given_back = faults("leave")
    if given_back < 10 * 256:
        pytest.skip("another allocator, or larger pages")
    assert faults("keep") < 0.1 * given_back


def test_elsewhere_nothing_is_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MALLOC_TRIM_THRESHOLD_", raising=False)
    assert not keep_freed_memory()
