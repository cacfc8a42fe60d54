"""Serves the canvas to web pages, behind a guard."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from dermis.apps.viewer.browser.canvas import PageCanvas
from dermis.apps.viewer.browser.guard import Guard, is_local
from dermis.apps.viewer.browser.uploads import Uploads
from dermis.base.errors import refuse

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
"""Of every response: the page runs its own files alone, in no frame, and nothing of it is kept."""

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


def server(address: Address, canvas: PageCanvas, folder: Path) -> Any:
    """A uvicorn server of rendercanvas' application with our own page, behind the guard.

    folder : an empty one for files that pages send
    """
    import uvicorn
    from rendercanvas.http import asgi, resources

    from dermis.apps.viewer.browser.connections import LimitedConnection

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


def run_until(pages: Any, listener: socket.socket, begin: Callable[[], Coroutine[Any, Any, T]]) -> T | None:
    """Run a server until it is told to exit, and something beside it: what that returned, if it has ended.

    Raises what it raises.
    """

    async def run() -> T | None:
        beside = asyncio.create_task(begin())
        await pages.serve(sockets=[listener])
        if beside.done():  # not awaited: after Ctrl+C that would be an interrupt again
            return beside.result()
        beside.cancel()
        return None

    return asyncio.run(run())
