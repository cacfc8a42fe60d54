"""Worker that waits, once a shard is complete, until a file allows it to start another."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any
from unittest.mock import patch

from dermis.apps.batch import worker_pool
from dermis.apps.batch.worker import Worker

GATE = "HELD_UNTIL"
"""Environment variable with the path of the file."""


def run_worker(pipe: Any, slot: Any, options: Any) -> None:
    """Run a worker that waits before each shard."""
    gate, original = Path(os.environ[GATE]), Worker.render_shard

    def render_shard(worker: Worker, *arguments: Any) -> Any:
        while any(options.out.glob("shard-*.tar")) and not gate.exists():
            time.sleep(0.01)
        return original(worker, *arguments)

    with patch.object(Worker, "render_shard", render_shard):
        worker_pool.run_worker(pipe, slot, options)


def main() -> None:
    """Run the command with such workers."""
    from dermis.cli import main as command

    with patch.object(worker_pool, "run_worker", run_worker):
        command()
