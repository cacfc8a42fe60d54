"""Display of a viewer in a desktop window, a web page or a notebook cell."""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NoReturn

from dermis.apps.viewer.controls import Event
from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.state import ViewerState, make_state
from dermis.apps.viewer.viewer import Viewer
from dermis.base.errors import refuse
from dermis.base.extras import distribution_name, extra_advice
from dermis.base.renamed import renamed_keywords
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.scene.model import Scene

Size = tuple[int, int]
_WINDOW_TITLE = "dermis"
_MAX_FPS = 60


def show_window(
    state: ViewerState, adapter: str, window_size: Size, *, motion: MotionFile | None = None
) -> None:
    """Show the viewer in a desktop window, and return when the window is closed.

    window_size : width and height of the window [logical pixel]
    motion : motion to play; None if there is no motion

    Raises DermisError if there is no display or no device, or if the extra `viewer` is not installed.
    """
    backend = _load_backend("glfw", ("glfw",), "viewer")
    with warnings.catch_warnings(record=True) as caught:  # without a display glfw only warns
        warnings.simplefilter("always")
        if not backend.glfw.init():
            _raise_no_display("; ".join(str(warning.message) for warning in caught))
    try:
        canvas = backend.RenderCanvas(size=window_size, title=_WINDOW_TITLE, max_fps=_MAX_FPS)
    except Exception as error:  # glfw has no exception class for a missing display
        _raise_no_display(error)
    viewer = Viewer(state, canvas, adapter, motion=motion)
    with _without_signal_handlers():
        backend.loop.run()
    _raise_viewer_failure(viewer)


@contextmanager
def _without_signal_handlers() -> Iterator[None]:
    """Disable the signal handlers of rendercanvas; they could close the window in the middle of a frame."""
    loops: Any = importlib.import_module("rendercanvas.core.loop")
    original, loops.HANDLED_SIGNALS = loops.HANDLED_SIGNALS, ()
    try:
        yield
    finally:
        loops.HANDLED_SIGNALS = original


def serve(
    load_state: Callable[[], tuple[ViewerState, MotionFile | None]],
    adapter: str,
    window_size: Size,
    host: str,
    port: int,
    announce_url: Callable[[str, bool], None],
    *,
    require_token: bool = False,
) -> None:
    """Serve the viewer as web pages until interrupted.

    Pages show the progress of the preparation until the first picture.

    load_state : function that loads the initial state and motion, called in a thread
    adapter : "auto", "cpu" or part of an adapter's name
    window_size : width and height of the canvas until a page reports the size of its window [logical pixel]
    host : host name or IP address at which the pages are served
    port : port number; 0 for any free port
    announce_url : function called before serving, with the URL and whether other machines can reach it
    require_token : whether the URL contains a token even if only this machine can reach it

    Raises DermisError if the address cannot be used, if there is no device, or if the extra `viewer` is not
    installed. Exceptions of `load_state` are passed on.
    """
    _load_backend("http", ("uvicorn", "websockets"), "viewer")
    from dermis.apps.viewer.browser.canvas import PageCanvas
    from dermis.apps.viewer.browser.request_filter import is_local_host
    from dermis.apps.viewer.browser.server import bind, make_server, prepare_viewer, run_server

    listener, address = bind(host, port, require_token=require_token)
    with listener, TemporaryDirectory(prefix="dermis-") as folder:
        canvas = PageCanvas(size=window_size, title=_WINDOW_TITLE, max_fps=_MAX_FPS)
        canvas._size_info.set_physical_size(*window_size, 1.0)
        http_server = make_server(address, canvas, Path(folder))
        # rendercanvas handles Ctrl+C by closing the canvas; the server must stop too.
        canvas.add_event_handler(lambda event: setattr(http_server, "should_exit", True), "close")
        announce_url(address.url, not is_local_host(host))
        viewer = run_server(
            http_server, listener, lambda: prepare_viewer(http_server, canvas, load_state, adapter)
        )
    if viewer:
        _raise_viewer_failure(viewer)


@renamed_keywords(shown="subject")
def view(
    subject: Head | Human | Scene | ViewerState | str | os.PathLike[str] = "human",
    adapter: str = "auto",
    size: Size = (720, 540),
    motion: str = "",
) -> Any:
    """Return a notebook widget that shows a head interactively.

    To display the widget (an anywidget), make it the last line of a cell. Its attribute `viewer` is the
    `Viewer`, with the current state in `viewer.session.state`.

    Parameters
    ----------
    subject : Head, Human, Scene, ViewerState, str or path, optional
        What to show: a head, a person, a scene, or a name that `dermis view` accepts (human, a sample, a mesh
        file or a TOML scene). Default: the human.
    adapter : str, optional
        "auto", "cpu" or part of an adapter's name.
    size : (int, int), optional
        Width and height of the widget [logical pixel].
    motion : str, optional
        Motion file that `load_motion` accepts; by default, there is no motion.

    Returns
    -------
    anywidget.AnyWidget
        Widget with the attribute `viewer`.

    Raises
    ------
    DermisError
        If `subject` is of another type or cannot be loaded, or if the extra `notebook` is not installed.

    Examples
    --------
    >>> import dermis
    >>> widget = dermis.view("human", size=(640, 480))  # doctest: +SKIP
    >>> widget.viewer.session.state.view  # doctest: +SKIP
    'picture'
    """
    canvas = _notebook_canvas_class(_load_backend("anywidget", ("anywidget",), "notebook"))
    state = make_state(subject)
    motion_file = MotionFile(motion) if motion else None
    widget = canvas(size=size, max_fps=_MAX_FPS)
    widget.viewer = Viewer(state, widget, adapter, motion=motion_file)
    return widget


def _notebook_canvas_class(backend_module: Any) -> Any:
    """Return the notebook widget class of rendercanvas, with workarounds for two bugs in rendercanvas."""

    class NotebookCanvas(backend_module.AnywidgetRenderCanvas):  # type: ignore[misc]
        def _rfb_handle_msg(self, widget: object, content: Event, buffers: list[bytes]) -> None:
            kind = content.get("type")
            super()._rfb_handle_msg(widget, content, buffers)
            if kind == "resize":
                self.request_draw()  # otherwise a resized cell would be redrawn only when something moves

        def _rc_close(self) -> None:
            if not self.get_closed():  # the base class would recurse infinitely
                self._is_closed = True
                super()._rc_close()

    return NotebookCanvas


def _load_backend(module_name: str, required_packages: tuple[str, ...], extra_name: str) -> Any:
    """Import and return a module of rendercanvas; raise DermisError if packages are missing.

    required_packages : import names of the packages that the module needs
    extra_name : extra of dermis that installs these packages, named in the error message
    """
    for package in (*required_packages, "imgui_bundle", "rendercanvas"):
        try:
            importlib.import_module(package)
        except ImportError:
            name = distribution_name(package)
            refuse("viewer", f"the package {name}", "it is not installed", extra_advice(extra_name))
    return importlib.import_module(f"rendercanvas.{module_name}")


def _raise_no_display(failure_reason: object) -> NoReturn:
    refuse("window", "a display", f"none can be opened ({failure_reason})", "Set DISPLAY, or use --browser")


def _raise_viewer_failure(viewer: Viewer) -> None:
    if viewer.failure:
        raise viewer.failure
