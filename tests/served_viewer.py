"""A viewer that is served to pages by this process."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from offscreen_input import ADAPTER

from dermis.apps.viewer.state import ViewerState


@contextmanager
def served(state: ViewerState, size: tuple[int, int] = (400, 300)) -> Iterator[Any]:
    """Yield the viewer, served by a thread; `viewer.url` is its page."""
    from rendercanvas.http import asgi

    from dermis.apps.viewer.browser.canvas import PageCanvas
    from dermis.apps.viewer.browser.server import bind, make_server
    from dermis.apps.viewer.viewer import Viewer

    listener, address = bind("127.0.0.1", 0)
    made: list[Any] = []

    def run() -> None:  # in whose event loop the canvas belongs
        one: Any = Viewer(state, PageCanvas(size=size, max_fps=60), ADAPTER)
        one.folder = folder
        one.url, running = address.url, make_server(address, one.canvas, Path(folder))
        made.extend((one, running))
        running.run(sockets=[listener])

    with listener, TemporaryDirectory() as folder:
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        while not (made and made[1].started):
            assert thread.is_alive()
            time.sleep(0.05)
        yield made[0]
        made[1].should_exit = True
        thread.join(20.0)
        asgi._websockets.clear()
        made[0].canvas.close()  # when it is collected, it would close the pages of the next one
