"""A worker whose device is lost while it draws, and the one that is opened after it too."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from unittest.mock import patch

from dermis.apps.batch.worker import run_worker as draw
from dermis.frame import renderer as renderer_module
from dermis.gpu import CommandList, Device, open_device

LOSSES = 2  # of a worker's devices
FOLDER, WORKERS = "LOSING_FOLDER", "LOSING_WORKERS"
"""Variables: where each such worker leaves a file, and how many of them there are."""


def run_worker(pipe: Any, *given: Any) -> None:
    """What a worker does, whose first two devices are lost unless there were enough such workers."""
    folder = Path(os.environ[FOLDER])
    number = len(list(folder.iterdir()))
    if number >= int(os.environ[WORKERS]):
        draw(pipe, *given)
        return
    (folder / str(number)).touch()
    opened: list[Device] = []
    usual = CommandList.submit

    def open_noted(adapter: str) -> Device:
        opened.append(open_device(adapter))
        return opened[-1]

    def submit(frame: CommandList) -> None:
        if len(opened) <= LOSSES:
            opened[-1].handle.destroy()
        usual(frame)

    with (
        patch.object(renderer_module, "open_device", open_noted),
        patch.object(CommandList, "submit", submit),
    ):
        draw(pipe, *given)
