"""Web server of the viewer; pages can connect while a thread prepares the first picture."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import NamedTuple, TypeVar

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from dermis.apps.viewer.browser.canvas import PageCanvas
from dermis.apps.viewer.browser.request_filter import RequestFilter, is_local_host
from dermis.apps.viewer.browser.uploads import Uploads
from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.view_renderer import ViewRenderer
from dermis.apps.viewer.viewer import Viewer
from dermis.base.background import run_in_thread
from dermis.base.errors import refuse

MAX_CONNECTIONS = 64
"""Maximum number of open connections, including WebSockets."""

HEADER_TIMEOUT_S = 10.0
"""Maximum time until the headers of a request are complete [s]."""


class LimitedConnection(H11Protocol):  # type: ignore[misc]
    """HTTP protocol of uvicorn with a connection limit and a timeout for request headers."""

    def __init__(self, *args: object, **kwargs: object) -> None:
        super().__init__(*args, **kwargs)
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Accept a connection, or drop it if too many connections are open."""
        super().connection_made(transport)
        if len(self.connections) > MAX_CONNECTIONS:
            transport.abort()
        else:
            self._start_header_timeout()

    def connection_lost(self, exc: Exception | None) -> None:
        """Cancel the header timeout of a closed connection."""
        self._cancel_header_timeout()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Handle received data, and limit how long the headers of a request may take to arrive."""
        super().handle_events()
        if self.conn.their_state is not h11.IDLE or self.timeout_keep_alive_task is not None:
            self._cancel_header_timeout()
        elif self._deadline is None:
            self._start_header_timeout()

    def handle_websocket_upgrade(self, event: object) -> None:
        """Cancel the header timeout of a WebSocket, which has its own keep-alive."""
        self._cancel_header_timeout()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """Close the connection of a client that does not speak HTTP."""
        self.transport.abort()

    def _start_header_timeout(self) -> None:
        self._deadline = self.loop.call_later(HEADER_TIMEOUT_S, self.transport.abort)

    def _cancel_header_timeout(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


StateLoader = Callable[[], tuple[ViewerState, MotionFile | None]]

PREPARATION_STAGES = (
    "reading the head",
    "opening the graphics device",
    "preparing the atlas and the maps",
    "compiling shaders",
    "rendering the first picture",
)
"""Stages of preparation, in this order."""

_FAILURE_DISPLAY_S = 0.7  # time for pages to receive the reason of a failure


async def prepare_viewer(
    http_server: uvicorn.Server, canvas: PageCanvas, load_state: StateLoader, adapter: str
) -> Viewer:
    """Prepare the first frame in a thread and return the viewer; pages display the progress.

    If the preparation fails, pages show the reason and the server stops.

    http_server : running server of the pages
    load_state : function that loads the initial state and motion, called in a thread

    Raises every exception of `load_state`, and DermisError if no device can be opened.
    """
    loop, stages = asyncio.get_running_loop(), iter(enumerate(PREPARATION_STAGES, 1))

    def begin_preparation_stage() -> None:
        if http_server.should_exit:
            raise InterruptedError  # the server has stopped
        number, stage = next(stages)
        loop.call_soon_threadsafe(canvas.send_progress, stage, number, len(PREPARATION_STAGES))

    def prepare_first_frame() -> tuple[ViewerState, ViewRenderer, MotionFile | None]:
        begin_preparation_stage()
        state, motion = load_state()
        begin_preparation_stage()
        view_renderer = ViewRenderer(adapter)
        begin_preparation_stage()
        view_renderer.prepare(state, begin_preparation_stage)
        return state, view_renderer, motion

    try:
        state, view_renderer, motion = await asyncio.wrap_future(run_in_thread(prepare_first_frame))
        canvas.send_progress(PREPARATION_STAGES[-1], len(PREPARATION_STAGES), len(PREPARATION_STAGES))
        return Viewer(state, canvas, adapter, motion=motion, view_renderer=view_renderer)
    except Exception as error:
        canvas.send_failure(str(error))
        await asyncio.sleep(_FAILURE_DISPLAY_S)
        http_server.should_exit = True
        raise


T = TypeVar("T")
_ACCESS_TOKEN_BYTES = 18
_MAX_MESSAGE_BYTES = 1 << 16
_SHUTDOWN_TIMEOUT_S = 1
_PAGE_FILES = {"page.css": "css", "page.js": "javascript", "files.js": "javascript", "stage.js": "javascript"}
RESPONSE_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""Headers of every response. They forbid scripts of other sites, display in frames, and caching."""

_ALL_INTERFACES = "0.0.0.0", "::"


class Address(NamedTuple):
    """Address at which the page is served.

    token : secret part of the URL, empty for a URL without a secret
    """

    host: str
    port: int
    token: str

    @property
    def url(self) -> str:
        """Return the URL of the page, with this machine's name if all network interfaces are served."""
        name = socket.gethostname() if self.host in _ALL_INTERFACES else self.host
        host = f"[{name}]" if ":" in name else name
        return f"http://{host}:{self.port}/" + (f"?token={self.token}" if self.token else "")


def bind(host: str, port: int, *, require_token: bool = False) -> tuple[socket.socket, Address]:
    """Return a listening socket and its address, which includes a token if the host is not local.

    port : port number; 0 for any free port
    require_token : whether the address includes a token even if the host is local

    Raises DermisError if the address cannot be used.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen()  # connections are queued until the server runs
    except OSError as error:
        listener.close()
        refuse(f"{host}:{port}", "an address to listen on", f"{error.strerror}", "Choose another --port")
    token = "" if is_local_host(host) and not require_token else secrets.token_urlsafe(_ACCESS_TOKEN_BYTES)
    return listener, Address(host, int(listener.getsockname()[1]), token)


def make_server(address: Address, canvas: PageCanvas, upload_folder: Path) -> uvicorn.Server:
    """Return a uvicorn server that serves the canvas and its page, validates requests and accepts uploads.

    upload_folder : empty folder for uploaded files
    """
    from rendercanvas.http import asgi, resources

    package_folder = Path(__file__).parent
    page = (package_folder / "page.html").read_text(encoding="utf-8")
    resources["index.html"] = "text/html; charset=utf-8", page
    for name, content_type in _PAGE_FILES.items():
        text = (package_folder / name).read_text(encoding="utf-8")
        resources[name] = f"text/{content_type}; charset=utf-8", text
    config = uvicorn.Config(
        RequestFilter(Uploads(asgi, canvas, upload_folder), address.token, f"dermis-{address.port}"),
        http=LimitedConnection,
        headers=list(RESPONSE_HEADERS.items()),
        log_level="warning",
        ws_max_size=_MAX_MESSAGE_BYTES,
        ws_per_message_deflate=False,  # images are already compressed
        timeout_graceful_shutdown=_SHUTDOWN_TIMEOUT_S,
        server_header=False,
    )
    return uvicorn.Server(config)


def run_server(
    http_server: uvicorn.Server,
    listener: socket.socket,
    start_coroutine: Callable[[], Coroutine[None, None, T]],
) -> T | None:
    """Run the server until it exits, together with a coroutine; return the coroutine's result.

    start_coroutine : function that returns the coroutine

    If the server exits before the coroutine ends, the result is None. Exceptions of the coroutine are raised.
    """

    async def serve_and_run() -> T | None:
        task = asyncio.create_task(start_coroutine())
        await http_server.serve(sockets=[listener])
        if task.done():  # not awaited: after Ctrl+C that would raise another interrupt
            return task.result()
        task.cancel()
        return None

    return asyncio.run(serve_and_run())
