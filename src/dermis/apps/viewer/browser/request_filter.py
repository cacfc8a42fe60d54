"""Checks of requests and of messages: who may connect, and what a page may send."""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Annotated, Any, Literal
from urllib.parse import parse_qs

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from dermis.base.errors import DermisError
from dermis.base.reading import parse_json

_MOST_LETTERS = 4096
_LARGEST_SIDE = 4096  # of a picture [pixel]
_FARTHEST = 1e5  # that a pointer may be from the picture's corner, logical

Seconds = Annotated[float, Field(ge=0.0, le=1e12)]
Place = Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST)]
Side = Annotated[int, Field(ge=0, le=_LARGEST_SIDE)]
Button = Annotated[int, Field(ge=0, le=16)]
Word = Annotated[str, Field(max_length=32)]


class _Checked(BaseModel):
    """A model that drops fields that are not listed, and takes finite numbers only."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)


class _Message(_Checked):
    timestamp: Seconds


class Touch(_Checked):
    """A finger."""

    x: Place
    y: Place
    pressure: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0


class _Held(_Message):
    modifiers: Annotated[list[Word], Field(max_length=8)] = []


class Pointer(_Held):
    """Event of a mouse, a pen or fingers."""

    type: Literal[
        "pointer_down", "pointer_move", "pointer_up", "pointer_enter", "pointer_leave", "double_click"
    ]
    x: Place
    y: Place
    button: Button = 0
    buttons: Annotated[list[Button], Field(max_length=16)] = []
    ntouches: Annotated[int, Field(ge=0, le=16)] = 0
    touches: Annotated[dict[Word, Touch], Field(max_length=16)] = {}


class Wheel(_Held):
    """Turn of a wheel, in the browser's pixels."""

    type: Literal["wheel"]
    x: Place
    y: Place
    dx: Place
    dy: Place
    buttons: Annotated[list[Button], Field(max_length=16)] = []


class Key(_Held):
    """Key, by its name in browsers."""

    type: Literal["key_down", "key_up"]
    key: Word


class Letters(_Message):
    """Text that is typed."""

    type: Literal["char"]
    data: str | None = None
    is_composing: bool = False
    input_type: Word | None = None


class Resize(_Message):
    """Size of the page: sides in logical and in physical pixels, and their ratio."""

    type: Literal["resize"]
    width: Place
    height: Place
    pwidth: Side
    pheight: Side
    ratio: Annotated[float, Field(ge=0.1, le=20.0)]


class Seen(_Message):
    """Whether the page is visible."""

    type: Literal["show", "hide"]


class Shown(_Message):
    """The number of a frame that the page has shown."""

    type: Literal["_framefeedback"]
    index: Annotated[int, Field(ge=0, le=1 << 53)]
    localtime: Seconds = 0.0


_MESSAGES: TypeAdapter[Any] = TypeAdapter(
    Annotated[Pointer | Wheel | Key | Letters | Resize | Seen | Shown, Field(discriminator="type")]
)


def checked(text: object) -> str | None:
    """Return the message with the fields of its kind only; None for one that no page sends.

    text : untrusted, of any type
    """
    if not isinstance(text, str) or len(text) > _MOST_LETTERS:
        return None
    try:
        message = _MESSAGES.validate_python(parse_json(text, "message", "an event"))
        said: str = message.model_dump_json()
    except (DermisError, ValueError):  # pydantic's, or of half a letter, which no text can hold
        return None
    return said


Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

MOST_PAGES = 8
"""Pages that may be open at the same time."""

_SCHEMES = {"ws": "http", "wss": "https"}
_NO_TOKEN = "This page needs its token: open the whole address that dermis view has printed."
_NOT_HERE = "This page is not served under this name: open the address that dermis view has printed."
_OTHER_SITE = "Only the page's own requests are answered."
_TOO_MANY = "As many pages as may be are open: close one of them."


class Guard:
    """ASGI middleware: lets only requests through that have the token and come from the server's own page.

    app : rendercanvas' application
    token : in the query of the address, then in a cookie; empty for none
    cookie : its name, one for each port, which browsers do not tell apart
    """

    def __init__(self, app: App, token: str, cookie: str = "dermis") -> None:
        self._app, self._token, self._cookie = app, token, cookie
        self._pages = 0

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """The ASGI entry point."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
        elif refusal := self._refusal(scope):
            await _refuse(refusal, scope, receive, send)
        elif scope["type"] == "websocket":
            self._pages += 1
            try:
                await self._app(scope, _checked(receive), send)
            finally:
                self._pages -= 1
        else:
            await self._app(scope, receive, self._with_cookie(send) if self._in_query(scope) else send)

    def _refusal(self, scope: Message) -> str:
        """Why a request is not answered, empty for one that is."""
        host = next(iter(_headers(scope, b"host")), "")
        if not self._token and not is_local(_name_of(host)):
            return _NOT_HERE  # DNS rebinding: another site's name that resolves to this machine
        scheme = _SCHEMES.get(scope["scheme"], scope["scheme"])
        if any(origin != f"{scheme}://{host}" for origin in _headers(scope, b"origin")):
            return _OTHER_SITE
        if self._token and not self._in_query(scope) and not self._in_cookie(scope):
            return _NO_TOKEN
        return _TOO_MANY if scope["type"] == "websocket" and self._pages >= MOST_PAGES else ""

    def _in_query(self, scope: Message) -> bool:
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [])
        return bool(self._token) and any(map(self._is_token, given))

    def _in_cookie(self, scope: Message) -> bool:
        crumbs = (crumb.strip() for line in _headers(scope, b"cookie") for crumb in line.split(";"))
        pairs = (crumb.partition("=") for crumb in crumbs)
        return any(self._is_token(value) for name, _, value in pairs if name == self._cookie)

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(), self._token.encode())

    def _with_cookie(self, send: Send) -> Send:
        """Let the browser keep the token, out of the reach of scripts and of other sites."""
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict".encode()

        async def send_too(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], (b"set-cookie", cookie)]
            await send(message)

        return send_too


def is_local(host: str) -> bool:
    """Return whether a host name or address can be reached from this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _headers(scope: Message, wanted: bytes) -> list[str]:
    return [value.decode("latin-1") for name, value in scope["headers"] if name == wanted]


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
            if message["type"] != "websocket.receive":
                return message
            if (text := checked(message.get("text"))) is not None:
                return {"type": "websocket.receive", "text": text}

    return next_message


async def _refuse(reason: str, scope: Message, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    # Closed, or a body that nobody reads could be sent for ever.
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": reason.encode()})
