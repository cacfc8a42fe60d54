"""A worker that begins no other shard while there is a whole one, until a file says that it may."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any
from unittest.mock import patch

from dermis.apps.batch import worker_pool
from dermis.apps.batch.worker import Worker

GATE = "HELD_UNTIL"
"""Variable: the file."""


def run_worker(pipe: Any, slot: Any, options: Any) -> None:
    """Serve as a worker does, but hold."""
    gate, usual = Path(os.environ[GATE]), Worker.render_shard

    def render_shard(worker: Worker, *given: Any) -> Any:
        while any(options.out.glob("shard-*.tar")) and not gate.exists():
            time.sleep(0.01)
        return usual(worker, *given)

    with patch.object(Worker, "render_shard", render_shard):
        worker_pool.run_worker(pipe, slot, options)


def main() -> None:
    """Run the command with such workers."""
    from dermis.cli import main as command

    with patch.object(worker_pool, "run_worker", run_worker):
        command()
