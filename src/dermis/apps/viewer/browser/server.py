"""Serves the canvas to web pages, behind a guard, while a thread prepares the first picture."""

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
from dermis.apps.viewer.browser.guard import Guard, is_local
from dermis.apps.viewer.browser.uploads import Uploads
from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.studio import Studio, begun
from dermis.apps.viewer.viewer import Viewer
from dermis.base.errors import refuse

MOST_CONNECTIONS = 64
"""At the same time, sockets of pages among them."""

HEADERS_S = 10.0
"""Within which the headers of a request come [s]."""


class LimitedConnection(H11Protocol):  # type: ignore[misc]
    """uvicorn's HTTP protocol with limits that it lacks."""

    def __init__(self, *given: object, **named: object) -> None:
        super().__init__(*given, **named)
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Drop one too many."""
        super().connection_made(transport)
        if len(self.connections) > MOST_CONNECTIONS:
            transport.abort()
        else:
            self._expect_headers()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the deadline."""
        self._expect_nothing()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Watch the time while headers are on their way."""
        super().handle_events()
        if self.conn.their_state is not h11.IDLE or self.timeout_keep_alive_task is not None:
            self._expect_nothing()
        elif self._deadline is None:
            self._expect_headers()

    def handle_websocket_upgrade(self, event: object) -> None:
        """Leave a socket to its own protocol, which pings it."""
        self._expect_nothing()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """Close on who does not speak HTTP."""
        self.transport.abort()

    def _expect_headers(self) -> None:
        self._deadline = self.loop.call_later(HEADERS_S, self.transport.abort)

    def _expect_nothing(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


Load = Callable[[], tuple[ViewerState, MotionFile | None]]

STAGES = (
    "reading the head",
    "opening the graphics device",
    "preparing the atlas and the maps",
    "compiling shaders",
    "drawing the first picture",
)
"""Stages of preparation, in this order."""

_LAST_WORDS_S = 0.7  # in which pages hear why there is nothing to see


async def shown(pages: uvicorn.Server, canvas: PageCanvas, load: Load, adapter: str) -> Viewer:
    """Return the viewer on the canvas when all is prepared; a failure is shown in the pages and ends them.

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


T = TypeVar("T")
_TOKEN_BYTES = 18
_MOST_MESSAGE_BYTES = 1 << 16
_SHUTDOWN_S = 1
_OWN = {"page.css": "css", "page.js": "javascript", "files.js": "javascript", "stage.js": "javascript"}
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""Headers of every response: the page runs its own files only, in no frame, and is not cached."""

_EVERYWHERE = "0.0.0.0", "::"


class Address(NamedTuple):
    """Where the page is served.

    token : secret part of the URL, empty for none
    """

    host: str
    port: int
    token: str

    @property
    def url(self) -> str:
        """The page's URL; a server that listens on all interfaces uses the machine's name."""
        name = socket.gethostname() if self.host in _EVERYWHERE else self.host
        host = f"[{name}]" if ":" in name else name
        return f"http://{host}:{self.port}/" + (f"?token={self.token}" if self.token else "")


def bind(host: str, port: int, *, secret: bool = False) -> tuple[socket.socket, Address]:
    """A listening socket and its address, with a token unless the host is local.

    port : 0 for any free one
    secret : whether a local host gets a token too

    Raises DermisError when the address cannot be used.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen()  # a page that connects at once waits for the server
    except OSError as error:
        listener.close()
        refuse(f"{host}:{port}", "an address to listen at", f"{error.strerror}", "Choose another --port")
    token = "" if is_local(host) and not secret else secrets.token_urlsafe(_TOKEN_BYTES)
    return listener, Address(host, int(listener.getsockname()[1]), token)


def server(address: Address, canvas: PageCanvas, folder: Path) -> uvicorn.Server:
    """A uvicorn server of rendercanvas' application with our own page, behind the guard.

    folder : an empty one for files that pages send
    """
    from rendercanvas.http import asgi, resources

    own = Path(__file__).parent
    resources["index.html"] = "text/html; charset=utf-8", (own / "page.html").read_text(encoding="utf-8")
    for name, kind in _OWN.items():
        resources[name] = f"text/{kind}; charset=utf-8", (own / name).read_text(encoding="utf-8")
    config = uvicorn.Config(
        Guard(Uploads(asgi, canvas, folder), address.token, f"dermis-{address.port}"),
        http=LimitedConnection,
        headers=list(HEADERS.items()),
        log_level="warning",
        ws_max_size=_MOST_MESSAGE_BYTES,
        ws_per_message_deflate=False,  # images are already compressed
        timeout_graceful_shutdown=_SHUTDOWN_S,
        server_header=False,
    )
    return uvicorn.Server(config)


def run_until(
    pages: uvicorn.Server, listener: socket.socket, begin: Callable[[], Coroutine[None, None, T]]
) -> T | None:
    """Run a server until it exits, and a coroutine beside it; return the coroutine's result, if it has ended.

    Raises what the coroutine raises.
    """

    async def run() -> T | None:
        beside = asyncio.create_task(begin())
        await pages.serve(sockets=[listener])
        if beside.done():  # not awaited: after Ctrl+C that would be an interrupt again
            return beside.result()
        beside.cancel()
        return None

    return asyncio.run(run())
