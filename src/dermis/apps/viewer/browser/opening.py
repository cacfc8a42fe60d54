"""Prepares what a page is to show in a thread; the page is served meanwhile, and told how far it is."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from dermis.apps.viewer.browser.canvas import PageCanvas
from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.preparing import begun
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.studio import Studio
from dermis.apps.viewer.viewer import Viewer

Load = Callable[[], tuple[ViewerState, MotionFile | None]]

STAGES = (
    "reading the head",
    "opening the graphics device",
    "preparing the atlas and the maps",
    "compiling shaders",
    "drawing the first picture",
)
"""In this order."""

_LAST_WORDS_S = 0.7  # in which pages hear why there is nothing to see


async def shown(pages: Any, canvas: PageCanvas, load: Load, adapter: str) -> Viewer:
    """The viewer on the canvas, when all is prepared; whatever stops that is told in the pages and ends them.

    pages : the server, which runs
    load : reads what is shown first, in the thread

    Raises whatever `load` does, and DermisError without a device.
    """
    loop, stages = asyncio.get_running_loop(), iter(enumerate(STAGES, 1))

    def go_on() -> None:
        if pages.should_exit:
            raise InterruptedError  # nobody waits for it any more
        number, text = next(stages)
        loop.call_soon_threadsafe(canvas.tell_stage, text, number, len(STAGES))

    def prepare() -> tuple[ViewerState, Studio, MotionFile | None]:
        go_on()
        state, motion = load()
        go_on()
        studio = Studio(adapter)
        go_on()
        studio.prepare(state, go_on)
        return state, studio, motion

    try:
        state, studio, motion = await asyncio.wrap_future(begun(prepare))
        canvas.tell_stage(STAGES[-1], len(STAGES), len(STAGES))
        return Viewer(state, canvas, adapter, motion=motion, studio=studio)
    except Exception as error:
        canvas.tell_failure(str(error))
        await asyncio.sleep(_LAST_WORDS_S)
        pages.should_exit = True
        raise
