"""Worker that waits, once a part is complete, until a file allows it to start another."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

from dermis.apps.batch import worker, worker_pool

GATE = "HELD_UNTIL"
"""Environment variable with the path of the file."""


def run_worker(pipe: Any, slot: Any, options: Any) -> None:
    """Run a worker that waits before each part."""
    gate, original = Path(os.environ[GATE]), worker.available_tasks

    def available_tasks(pipe: Any) -> Iterator[Any]:
        for task in original(pipe):
            while any(options.out.glob("[ps]*-*.tar")) and not gate.exists():
                time.sleep(0.01)
            yield task

    with patch.object(worker, "available_tasks", available_tasks):
        worker.run_worker(pipe, slot, options)


def main() -> None:
    """Run the command with such workers."""
    from dermis.cli import main as command

    with patch.object(worker_pool, "run_worker", run_worker):
        command()
