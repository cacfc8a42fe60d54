"""The three windows of the one viewer."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from typing import Any

from dermis.errors import refuse
from dermis.viewer.state import ViewerState, named_state
from dermis.viewer.viewer import Viewer

Size = tuple[int, int]
_TITLE = "dermis"
_MOST_FPS = 60
_VIEWER = 'Install it: pip install "dermis[viewer]"'
_NOTEBOOK = 'Install it: pip install "dermis[notebook]"'


def show_window(state: ViewerState, adapter: str, size: Size) -> None:
    """Open a window on the desk and return when it is closed.

    Raises DermisError without a display, a device or the extra `viewer`.
    """
    backend = _backend("glfw", ("glfw",), _VIEWER)
    _find_display(backend.glfw)
    try:
        canvas = backend.RenderCanvas(size=size, title=_TITLE, max_fps=_MOST_FPS)
    except Exception as error:  # whatever glfw makes of a missing display
        came = f"none opens ({error})"
        refuse("window", "a display to open it on", came, "Set DISPLAY, or use --browser")
    viewer = Viewer(state, canvas, adapter)
    backend.loop.run()
    _raise_failure(viewer)


def _find_display(glfw: Any) -> None:
    """Refuse without a display: glfw only warns of it, and ends the process once a window is asked for."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        opens = glfw.init()
    if not opens:
        came = f"none opens ({'; '.join(str(one.message) for one in told)})"
        refuse("window", "a display to open it on", came, "Set DISPLAY, or use --browser")


def serve(
    state: ViewerState,
    adapter: str,
    size: Size,
    host: str,
    port: int,
    announce: Callable[[str, bool], None],
    *,
    secret: bool = False,
) -> None:
    """Serve web pages until interrupted.

    size : of the canvas until a page has told its own
    port : 0 for any that is free
    announce : told the page's address, and whether others than this machine can reach it
    secret : whether the page's address has a token even where only this machine can reach it

    Raises DermisError when nothing can listen there, without a device or the extra `viewer`.
    """
    _backend("http", ("uvicorn", "websockets"), _VIEWER)
    from dermis.viewer.browser.canvas import PageCanvas
    from dermis.viewer.browser.guard import is_local
    from dermis.viewer.browser.server import bind, server

    listener, address = bind(host, port, secret=secret)
    with listener:
        viewer = Viewer(state, PageCanvas(size=size, title=_TITLE, max_fps=_MOST_FPS), adapter)
        viewer.canvas._size_info.set_physical_size(*size, 1.0)
        announce(address.url, not is_local(host))
        pages = server(address)
        # Ctrl+C comes to rendercanvas, which closes the canvas and would leave the server running.
        viewer.canvas.add_event_handler(lambda event: setattr(pages, "should_exit", True), "close")
        pages.run(sockets=[listener])
    _raise_failure(viewer)


def notebook_viewer(
    shown: ViewerState | str = "bust", adapter: str = "auto", size: Size = (720, 540)
) -> Viewer:
    """A viewer that a notebook's cell displays.

    shown : a state, or what `dermis view` takes: the built-in bust, a sample, a mesh file, a scene in TOML

    Raises DermisError for what is none of these, and without the packages that a notebook takes.
    """
    _backend("anywidget", ("anywidget",), _NOTEBOOK)
    from dermis.viewer.notebook import CellCanvas

    state = shown if isinstance(shown, ViewerState) else named_state(shown)
    return Viewer(state, CellCanvas(size=size, max_fps=_MOST_FPS), adapter)


def _backend(name: str, needed: tuple[str, ...], remedy: str) -> Any:
    """rendercanvas' module of that name, when the packages that it needs are there."""
    for package in (*needed, "imgui_bundle", "rendercanvas"):
        try:
            importlib.import_module(package)
        except ImportError:
            refuse("viewer", f"the package {package.replace('_', '-')}", "it is not installed", remedy)
    return importlib.import_module(f"rendercanvas.{name}")


def _raise_failure(viewer: Viewer) -> None:
    if viewer.failure:
        raise viewer.failure
