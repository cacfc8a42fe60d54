"""Worker that loses two devices in turn while it draws."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from unittest.mock import patch

from dermis.apps.batch.worker import run_worker as draw
from dermis.frame import renderer as renderer_module
from dermis.gpu import CommandList, Device, open_device

LOSSES = 2  # devices that each worker loses
FOLDER, WORKERS = "LOSING_FOLDER", "LOSING_WORKERS"
"""Environment variables: folder in which each such worker writes a file, and their maximum number."""


def run_worker(pipe: Any, *arguments: Any) -> None:
    """Run a worker that loses its first two devices, unless enough workers have."""
    folder = Path(os.environ[FOLDER])
    number = len(list(folder.iterdir()))
    if number >= int(os.environ[WORKERS]):
        draw(pipe, *arguments)
        return
    (folder / str(number)).touch()
    opened: list[Device] = []
    original = CommandList.submit

    def open_recorded(adapter: str) -> Device:
        opened.append(open_device(adapter))
        return opened[-1]

    def submit(frame: CommandList) -> None:
        if len(opened) <= LOSSES:
            opened[-1].handle.destroy()
        original(frame)

    with (
        patch.object(renderer_module, "open_device", open_recorded),
        patch.object(CommandList, "submit", submit),
    ):
        draw(pipe, *arguments)
