"""Serves the canvas to web pages."""

from __future__ import annotations

import secrets
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dermis.errors import refuse
from dermis.viewer.browser.guard import Guard, is_local

_TOKEN_BYTES = 18
_MOST_MESSAGE_BYTES = 1 << 16
_GRACE_S = 1
_EVERYWHERE = "0.0.0.0", "::"


@dataclass(frozen=True)
class Address:
    """Where the page is.

    token : part of its address that others cannot guess, empty where only this machine can ask
    """

    host: str
    port: int
    token: str

    @property
    def url(self) -> str:
        """Of the page; a server that listens everywhere goes by the machine's name."""
        name = socket.gethostname() if self.host in _EVERYWHERE else self.host
        host = f"[{name}]" if ":" in name else name
        return f"http://{host}:{self.port}/" + (f"{self.token}/" if self.token else "")


def bind(host: str, port: int, *, secret: bool = False) -> tuple[socket.socket, Address]:
    """A socket that listens, and the address that leads to it; every host but this machine gets a token.

    port : 0 for any that is free
    secret : whether this machine gets one as well

    Raises DermisError when nothing can listen there.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen()  # so that a page that comes at once waits for the server
    except OSError as error:
        listener.close()
        refuse(f"{host}:{port}", "an address to listen at", f"{error.strerror}", "Choose another --port")
    token = "" if is_local(host) and not secret else secrets.token_urlsafe(_TOKEN_BYTES)
    return listener, Address(host, int(listener.getsockname()[1]), token)


def server(address: Address) -> Any:
    """A uvicorn server of rendercanvas' application with our own page, behind a guard."""
    import uvicorn
    from rendercanvas.http import asgi, resources

    folder = Path(__file__).parent
    resources["index.html"] = "text/html", (folder / "page.html").read_text(encoding="utf-8")
    resources["page.js"] = "text/javascript", (folder / "page.js").read_text(encoding="utf-8")
    config = uvicorn.Config(
        Guard(asgi, address.token),
        log_level="warning",
        ws_max_size=_MOST_MESSAGE_BYTES,
        ws_per_message_deflate=False,  # pictures are compressed already
        timeout_graceful_shutdown=_GRACE_S,
        server_header=False,
    )
    return uvicorn.Server(config)
