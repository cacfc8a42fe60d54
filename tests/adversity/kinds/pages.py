"""What pages send to the viewer's server: requests, events and files."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

from adversity.case import WRONG, FoundError, Input, Plan
from adversity.hostile import name
from adversity.kind import Kind
from small_head import obj_text

_EVENTS: tuple[dict[str, Any], ...] = (
    {"type": "resize", "width": 400.0, "height": 300.0, "pwidth": 800, "pheight": 600, "ratio": 2.0},
    {
        "type": "pointer_down",
        "x": 10,
        "y": 20,
        "button": 1,
        "buttons": [1],
        "modifiers": ["Shift"],
        "touches": {},
    },
    {"type": "pointer_move", "x": 10, "y": 20, "button": 0, "buttons": [], "modifiers": [], "touches": {}},
    {"type": "wheel", "x": 10, "y": 20, "dx": 0.0, "dy": 100.0, "buttons": [], "modifiers": []},
    {"type": "key_down", "key": "Tab", "modifiers": []},
    {"type": "char", "data": "a", "is_composing": False},
    {"type": "_framefeedback", "index": 3, "timestamp": 1.0, "localtime": 1.0},
)
_TICKET = "ticket"


def _message(rng: Random) -> Input:
    return Input({"message.json": json.dumps(rng.choice(_EVENTS)).encode()}, {"culprits": []})


def _take_message(plan: Plan) -> None:
    """Through the guard to a canvas, as the server gives it on; the next sound message still gets through."""
    from dermis.viewer.browser.guard import Guard

    sound, got = json.dumps(_EVENTS[1]), list[str]()
    text = Path("message.json").read_bytes().decode("utf-8", "replace")
    coming = [{"type": "websocket.receive", "text": one} for one in (text, sound)]
    coming.append({"type": "websocket.disconnect", "text": ""})

    async def app(scope: Any, receive: Any, send: Any) -> None:
        while (message := await receive())["type"] != "websocket.disconnect":
            got.append(message["text"])

    scope = {"type": "websocket", "path": "/", "headers": [(b"host", b"127.0.0.1:8765")]}
    asyncio.run(Guard(app, "")(scope, _receiver(coming), _ignore))
    if got[-1:] != [sound]:
        raise FoundError(WRONG, "a sound message was lost after this one")


def _upload(rng: Random) -> Input:
    headers = {"host": "127.0.0.1:8765", "x-dermis-ticket": _TICKET, "content-length": str(len(obj_text()))}
    request = {"path": "/upload/head.obj", "method": "POST", "headers": headers}
    files = {"request.json": json.dumps(request).encode(), "head.obj": obj_text().encode()}
    if rng.random() < 0.5:
        request["path"] = f"/upload/{name(rng)}.obj"
        files["request.json"] = json.dumps(request).encode()
    return Input(files, {"culprits": [], "outputs": ["files"]}, ("request.json",))


def _take_upload(plan: Plan) -> None:
    """A file that is taken lies in the server's folder and nowhere else."""
    from dermis.viewer.browser.guard import Guard
    from dermis.viewer.browser.uploads import Uploads

    folder, got, answers = Path("files"), list[Path](), list[Any]()
    folder.mkdir()
    try:
        scope = _scope(json.loads(Path("request.json").read_text()))
    except (ValueError, RecursionError, UnicodeError, TypeError, KeyError, AttributeError):
        return  # no server would make a scope of this

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 404, "headers": []})

    async def send(message: Any) -> None:
        answers.append(message)

    canvas = SimpleNamespace(ticket=_TICKET, on_file=got.append)
    coming = [{"type": "http.request", "body": Path("head.obj").read_bytes()}]
    asyncio.run(Guard(Uploads(app, canvas, folder), "")(scope, _receiver(coming), send))
    outside = [path for path in got if not path.resolve().is_relative_to(folder.resolve())]
    if outside or not answers:
        raise FoundError(WRONG, f"files outside: {outside}" if outside else "no answer")


def _scope(request: Any) -> dict[str, Any]:
    """A request as a server tells it: bytes for headers, text for the rest."""
    headers = [(str(key).encode(), str(value).encode()) for key, value in request["headers"].items()]
    return {
        "type": "http",
        "path": str(request["path"]),
        "method": str(request["method"]),
        "headers": headers,
    }


def _receiver(coming: list[Any]) -> Any:
    async def receive() -> Any:
        return coming.pop(0) if coming else {"type": "http.disconnect"}

    return receive


async def _ignore(message: Any) -> None:
    """What a page would be sent."""


KINDS = (Kind("message", _message, _take_message, share=10), Kind("upload", _upload, _take_upload, share=4))
