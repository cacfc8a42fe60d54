"""Validation of requests and messages: which clients may connect, and what a page may send."""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Annotated, Any, Literal
from urllib.parse import parse_qs

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from dermis.base.errors import DermisError
from dermis.base.reading import parse_json

_MAX_MESSAGE_CHARACTERS = 4096  # of a message
_MAX_PAGE_SIDE = 4096  # of a page [pixel]
_MAX_POINTER_COORDINATE = 1e5  # of a pointer, relative to the corner of the picture [logical pixel]

Seconds = Annotated[float, Field(ge=0.0, le=1e12)]
Coordinate = Annotated[float, Field(ge=-_MAX_POINTER_COORDINATE, le=_MAX_POINTER_COORDINATE)]
PixelCount = Annotated[int, Field(ge=0, le=_MAX_PAGE_SIDE)]
Button = Annotated[int, Field(ge=0, le=16)]
ShortText = Annotated[str, Field(max_length=32)]


class _StrictModel(BaseModel):
    """Base class of message models: types are checked, numbers are finite, unknown fields are dropped."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)


class _TimedMessage(_StrictModel):
    timestamp: Seconds


class Touch(_StrictModel):
    """Position and pressure of one finger."""

    x: Coordinate
    y: Coordinate
    pressure: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0


class _InputMessage(_TimedMessage):
    modifiers: Annotated[list[ShortText], Field(max_length=8)] = []


class Pointer(_InputMessage):
    """Event of a mouse, pen or touch screen."""

    type: Literal[
        "pointer_down", "pointer_move", "pointer_up", "pointer_enter", "pointer_leave", "double_click"
    ]
    x: Coordinate
    y: Coordinate
    button: Button = 0
    buttons: Annotated[list[Button], Field(max_length=16)] = []
    ntouches: Annotated[int, Field(ge=0, le=16)] = 0
    touches: Annotated[dict[ShortText, Touch], Field(max_length=16)] = {}


class Wheel(_InputMessage):
    """Event of the mouse wheel: position of the pointer, and scrolled distances [CSS pixel]."""

    type: Literal["wheel"]
    x: Coordinate
    y: Coordinate
    dx: Coordinate
    dy: Coordinate
    buttons: Annotated[list[Button], Field(max_length=16)] = []


class Key(_InputMessage):
    """Event of a key press or release, with the key name used by browsers."""

    type: Literal["key_down", "key_up"]
    key: ShortText


class TextInput(_TimedMessage):
    """Event of typed text."""

    type: Literal["char"]
    data: str | None = None
    is_composing: bool = False
    input_type: ShortText | None = None


class Resize(_TimedMessage):
    """Event of a change of the page's size: logical size, physical size, and ratio of the two."""

    type: Literal["resize"]
    width: Coordinate
    height: Coordinate
    pwidth: PixelCount
    pheight: PixelCount
    ratio: Annotated[float, Field(ge=0.1, le=20.0)]


class VisibilityChange(_TimedMessage):
    """Event sent when the page becomes visible or hidden."""

    type: Literal["show", "hide"]


class FrameFeedback(_TimedMessage):
    """Message with the number of the frame that the page has displayed."""

    type: Literal["_framefeedback"]
    index: Annotated[int, Field(ge=0, le=1 << 53)]
    localtime: Seconds = 0.0


_MESSAGE_PARSER: TypeAdapter[Any] = TypeAdapter(
    Annotated[
        Pointer | Wheel | Key | TextInput | Resize | VisibilityChange | FrameFeedback,
        Field(discriminator="type"),
    ]
)


def checked_message(message_text: object) -> str | None:
    """Return a message from a page without its unknown fields, or None if the message is invalid.

    message_text : untrusted message of any type
    """
    if not isinstance(message_text, str) or len(message_text) > _MAX_MESSAGE_CHARACTERS:
        return None
    try:
        message = _MESSAGE_PARSER.validate_python(parse_json(message_text, "message", "an event"))
        checked_text: str = message.model_dump_json()
    except (DermisError, ValueError):  # invalid JSON, a validation error, or half of a surrogate pair
        return None
    return checked_text


Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
AsgiApp = Callable[[Message, Receive, Send], Awaitable[None]]

MAX_PAGES = 8
"""Maximum number of open pages."""

_HTTP_SCHEMES = {"ws": "http", "wss": "https"}
_NO_TOKEN_REASON = "The token is missing: open the complete URL that dermis view has printed."
_WRONG_HOST_REASON = (
    "This page is not served under this host name: open the URL that dermis view has printed."
)
_OTHER_SITE_REASON = "Requests of other web sites are not answered."
_TOO_MANY_PAGES_REASON = "Too many pages are open: close one of them."


class RequestFilter:
    """ASGI middleware that rejects requests without the token or from other web sites.

    asgi_app : ASGI application of rendercanvas
    token : secret in the query of the URL and later in a cookie; empty if no secret is required
    cookie : name of the cookie, different for each port because browsers share cookies between ports
    """

    def __init__(self, asgi_app: AsgiApp, token: str, cookie: str = "dermis") -> None:
        self._app, self._token, self._cookie = asgi_app, token, cookie
        self._pages = 0

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Handle a request (ASGI entry point)."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
        elif refusal := self._refusal_reason(scope):
            await _send_rejection(refusal, scope, receive, send)
        elif scope["type"] == "websocket":
            self._pages += 1
            try:
                await self._app(scope, _drop_invalid_messages(receive), send)
            finally:
                self._pages -= 1
        else:
            if self._has_query_token(scope):
                send = self._add_cookie(send)
            await self._app(scope, receive, send)

    def _refusal_reason(self, request_scope: Message) -> str:
        """Return the reason why a request is rejected, or an empty string if it is accepted."""
        host = next(iter(_header_values(request_scope, b"host")), "")
        if not self._token and not is_local_host(_host_name(host)):
            return _WRONG_HOST_REASON  # DNS rebinding: the name of another site resolves to this machine
        scheme = _HTTP_SCHEMES.get(request_scope["scheme"], request_scope["scheme"])
        if any(origin != f"{scheme}://{host}" for origin in _header_values(request_scope, b"origin")):
            return _OTHER_SITE_REASON
        if (
            self._token
            and not self._has_query_token(request_scope)
            and not self._has_cookie_token(request_scope)
        ):
            return _NO_TOKEN_REASON
        return (
            _TOO_MANY_PAGES_REASON
            if request_scope["type"] == "websocket" and self._pages >= MAX_PAGES
            else ""
        )

    def _has_query_token(self, request_scope: Message) -> bool:
        tokens = parse_qs(request_scope.get("query_string", b"").decode("latin-1")).get("token", [])
        return bool(self._token) and any(map(self._equals_token, tokens))

    def _has_cookie_token(self, request_scope: Message) -> bool:
        cookies = (
            cookie.strip() for line in _header_values(request_scope, b"cookie") for cookie in line.split(";")
        )
        pairs = (cookie.partition("=") for cookie in cookies)
        return any(self._equals_token(value) for name, _, value in pairs if name == self._cookie)

    def _equals_token(self, received_token: str) -> bool:
        return hmac.compare_digest(received_token.encode(), self._token.encode())

    def _add_cookie(self, send: Send) -> Send:
        """Return a `send` function that also sets the token cookie, invisible to scripts and other sites."""
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict".encode()

        async def send_with_cookie(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], (b"set-cookie", cookie)]
            await send(message)

        return send_with_cookie


def is_local_host(host: str) -> bool:
    """Return whether a host name or address can be reached only from this machine."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _header_values(request_scope: Message, header_name: bytes) -> list[str]:
    return [value.decode("latin-1") for name, value in request_scope["headers"] if name == header_name]


def _host_name(host: str) -> str:
    """Return the host name or address in a text such as "name:port", "[address]:port" or "name"."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


def _drop_invalid_messages(receive: Receive) -> Receive:
    """Return a `receive` function that skips invalid messages from the page."""

    async def next_message() -> Message:
        while True:
            message = await receive()
            if message["type"] != "websocket.receive":
                return message
            if (text := checked_message(message.get("text"))) is not None:
                return {"type": "websocket.receive", "text": text}

    return next_message


async def _send_rejection(rejection_reason: str, scope: Message, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    # Close the connection, otherwise the client could send an endless body.
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": rejection_reason.encode()})
