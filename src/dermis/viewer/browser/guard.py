"""Checks who may connect, and what a page may send."""

from __future__ import annotations

import hmac
import ipaddress
import json
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

_SERVER_EVENTS = ("close", "_clients_change")  # rendercanvas obeys them, whoever sends them
_LARGEST_SIDE = 4096
_MOST_LETTERS = 4096
_NOT_FOUND = {"type": "http.response.start", "status": 404, "headers": [(b"content-type", b"text/plain")]}


class Guard:
    """ASGI middleware: lets only requests through that have the token and come from the server's own page.

    app : rendercanvas' application
    token : the first part of the path, empty for none
    """

    def __init__(self, app: App, token: str) -> None:
        self._app, self._token = app, token

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """The ASGI entry point."""
        if scope["type"] != "lifespan" and not self._may_pass(scope):
            await _refuse(scope, receive, send)
        else:
            checked = _checked(receive) if scope["type"] == "websocket" else receive
            await self._app(scope, checked, send)

    def _may_pass(self, scope: Message) -> bool:
        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        host = headers.get(b"host", "")
        if not self._token and not is_local(_name_of(host)):
            return False  # DNS rebinding: another site's name that resolves to this machine
        origin = headers.get(b"origin")
        if not self._token and origin is not None and origin.partition("://")[2] != host:
            return False  # with a token the origin may differ, as behind a proxy
        given = str(scope["path"]).split("/")[1:2]
        return not self._token or hmac.compare_digest("".join(given).encode(), self._token.encode())


def is_local(host: str) -> bool:
    """Whether a host name or address can be reached from this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _name_of(host: str) -> str:
    """The host of "name:port", "[address]:port" or the name alone."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


def _checked(receive: Receive) -> Receive:
    """The page's messages without those it may not send."""

    async def next_message() -> Message:
        while True:
            message = await receive()
            if message["type"] != "websocket.receive" or acceptable(message.get("text")):
                return message

    return next_message


def acceptable(text: Any) -> bool:
    """Whether the text is an event that a page may send, with a window of reasonable size."""
    if not isinstance(text, str) or len(text) > _MOST_LETTERS:
        return False
    try:
        event = json.loads(text)
    except ValueError:
        return False
    if not isinstance(event, dict) or not isinstance(event.get("type"), str):
        return False
    if event["type"] == "resize":
        sides = [event.get("pwidth"), event.get("pheight")]
        return all(isinstance(side, int) and 0 <= side <= _LARGEST_SIDE for side in sides)
    if event["type"] == "_framefeedback":
        return isinstance(event.get("index"), int)
    return event["type"] not in _SERVER_EVENTS


async def _refuse(scope: Message, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    await send(_NOT_FOUND)
    await send({"type": "http.response.body", "body": b"Not Found"})
