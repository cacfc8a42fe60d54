"""Where a viewer is shown: a desktop window, a web page, a notebook cell."""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NoReturn

from dermis.apps.viewer.controls import Event
from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.state import ViewerState, state_of
from dermis.apps.viewer.viewer import Viewer
from dermis.base.errors import refuse
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.scene.model import Scene

Size = tuple[int, int]
_TITLE = "dermis"
_MOST_FPS = 60
_SIGNALLED = 128  # plus the signal's number, as shells tell it


def show_window(state: ViewerState, adapter: str, size: Size, *, motion: MotionFile | None = None) -> None:
    """Open a desktop window and return when it is closed.

    motion : played in it

    Raises DermisError without a display, a device or the extra `viewer`.
    """
    backend = _backend("glfw", ("glfw",), "viewer")
    with warnings.catch_warnings(record=True) as caught:  # without a display glfw warns, and exits later
        warnings.simplefilter("always")
        if not backend.glfw.init():
            _refuse_display("; ".join(str(one.message) for one in caught))
    try:
        canvas = backend.RenderCanvas(size=size, title=_TITLE, max_fps=_MOST_FPS)
    except Exception as error:  # glfw has no class of its own for a missing display
        _refuse_display(error)
    viewer = Viewer(state, canvas, adapter, motion=motion)
    with _untouched_signals():
        backend.loop.run()
    _raise_failure(viewer)


@contextmanager
def _untouched_signals() -> Iterator[None]:
    """rendercanvas would close the window at a signal, in the middle of a frame that then fails."""
    loops: Any = importlib.import_module("rendercanvas.core.loop")
    usual, loops.HANDLED_SIGNALS = loops.HANDLED_SIGNALS, ()
    try:
        yield
    finally:
        loops.HANDLED_SIGNALS = usual


def serve(
    load: Callable[[], tuple[ViewerState, MotionFile | None]],
    adapter: str,
    size: Size,
    host: str,
    port: int,
    announce: Callable[[str, bool], None],
    *,
    secret: bool = False,
) -> None:
    """Serve web pages until interrupted; until there is a picture they show the stage of preparation.

    load : reads what is shown first and the motion that is played, in a thread
    size : of the canvas until a page reports its own
    port : 0 for any free one
    announce : called with the page's URL and whether other machines can reach it, before anything is read
    secret : whether the URL has a token even when only this machine can reach it

    Raises what `load` does, and DermisError when the address cannot be used, without a device or the extra
    `viewer`.
    """
    _backend("http", ("uvicorn", "websockets"), "viewer")
    from dermis.apps.viewer.browser.canvas import PageCanvas
    from dermis.apps.viewer.browser.guard import is_local
    from dermis.apps.viewer.browser.server import bind, run_until, server, shown

    listener, address = bind(host, port, secret=secret)
    with _tidy_end(), listener, TemporaryDirectory(prefix="dermis-") as folder:
        canvas = PageCanvas(size=size, title=_TITLE, max_fps=_MOST_FPS)
        canvas._size_info.set_physical_size(*size, 1.0)
        pages = server(address, canvas, Path(folder))
        # rendercanvas handles Ctrl+C by closing the canvas; without this the server would keep running.
        canvas.add_event_handler(lambda event: setattr(pages, "should_exit", True), "close")
        announce(address.url, not is_local(host))
        viewer = run_until(pages, listener, lambda: shown(pages, canvas, load, adapter))
    if viewer:
        _raise_failure(viewer)


def view(
    shown: Head | Human | Scene | ViewerState | str | os.PathLike[str] = "human",
    adapter: str = "auto",
    size: Size = (720, 540),
    motion: str = "",
) -> Any:
    """A widget that shows a head in a notebook, to turn it and to change skin and light.

    shown : a head, a person, a scene, or what `dermis view` takes: human, a sample, a mesh file, a TOML scene
    adapter : "auto", "cpu" or part of an adapter's name
    size : of the widget, logical
    motion : a file that `load_motion` takes, empty for none

    The widget is an anywidget, to be displayed as the last line of a cell, and its `viewer` the `Viewer`
    behind it, with the current state in `viewer.session.state`.

    Raises DermisError for anything else, and without the extra `notebook`.
    """
    canvas = _notebook_canvas(_backend("anywidget", ("anywidget",), "notebook"))
    state = state_of(shown)
    played = MotionFile(motion) if motion else None
    widget = canvas(size=size, max_fps=_MOST_FPS)
    widget.viewer = Viewer(state, widget, adapter, motion=played)
    return widget


def _notebook_canvas(backend: Any) -> Any:
    """rendercanvas' notebook widget with two corrections."""

    class NotebookCanvas(backend.AnywidgetRenderCanvas):  # type: ignore[misc]
        def _rfb_handle_msg(self, widget: object, content: Event, buffers: list[bytes]) -> None:
            kind = content.get("type")
            super()._rfb_handle_msg(widget, content, buffers)
            if kind == "resize":
                self.request_draw()  # otherwise a resized cell would not redraw until something moves

        def _rc_close(self) -> None:
            if not self.get_closed():  # the base class would call itself without end
                self._is_closed = True
                super()._rc_close()

    return NotebookCanvas


def _backend(name: str, needed: tuple[str, ...], extra: str) -> Any:
    """A module of rendercanvas, provided that the packages it needs are installed."""
    for package in (*needed, "imgui_bundle", "rendercanvas"):
        try:
            importlib.import_module(package)
        except ImportError:
            remedy = f'Install it: pip install "dermis[{extra}]"'
            refuse("viewer", f"the package {package.replace('_', '-')}", "it is not installed", remedy)
    return importlib.import_module(f"rendercanvas.{name}")


@contextmanager
def _tidy_end() -> Iterator[None]:
    """Let signals that end the process leave nothing behind, as Ctrl+C does."""
    replaced = {}
    is_main = threading.current_thread() is threading.main_thread()  # which alone may handle them
    for name in ("SIGTERM", "SIGHUP") if is_main else ():
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            replaced[number] = signal.signal(number, _exit)
    try:
        yield
    finally:
        for number, usual in replaced.items():
            signal.signal(number, usual)


def _exit(number: int, _: object) -> None:
    sys.exit(_SIGNALLED + number)


def _refuse_display(reason: object) -> NoReturn:
    refuse("window", "a display to open it on", f"none opens ({reason})", "Set DISPLAY, or use --browser")


def _raise_failure(viewer: Viewer) -> None:
    if viewer.failure:
        raise viewer.failure
