"""Messages of pages to the viewer's server: requests, events and files."""

from __future__ import annotations

import asyncio
import json
import logging
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

from adversity.case import WRONG, FoundError, Input, Plan
from adversity.hostile import name
from adversity.kind import Kind
from offscreen_input import SETTINGS, InputDriver
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
    {"type": "_framefeedback", "index": 3, "localtime": 1.0},
)
_TICKET = "ticket"
_SIZE = 400, 480
_COUNT = 8  # events for one viewer


def _texts(rng: Random, count: int) -> dict[str, bytes]:
    return {f"{k}.json": json.dumps({"timestamp": 1.0} | rng.choice(_EVENTS)).encode() for k in range(count)}


def _message(rng: Random) -> Input:
    return Input(_texts(rng, 1), {"error_subjects": []})


def _take_message(plan: Plan) -> None:
    """Check that the request filter accepts a valid message after a damaged one."""
    sound = {"timestamp": 1.0, **_EVENTS[1], "x": 321.0}
    passed = _passed([*_damaged(), json.dumps(sound)])
    if not passed or passed[-1].get("x") != sound["x"]:
        raise FoundError(WRONG, "a sound message was lost after this one")


def _damaged() -> list[str]:
    found = sorted(Path().glob("*.json"))
    return [one.read_bytes().decode("utf-8", "replace") for one in found]


def _passed(texts: list[str]) -> list[dict[str, Any]]:
    """Return the events that the request filter accepts."""
    from dermis.apps.viewer.browser.request_filter import RequestFilter

    got = list[dict[str, Any]]()
    coming = [{"type": "websocket.receive", "text": text} for text in texts]
    coming.append({"type": "websocket.disconnect", "text": ""})

    async def app(scope: Any, receive: Any, send: Any) -> None:
        while (message := await receive())["type"] != "websocket.disconnect":
            got.append(json.loads(message["text"]))

    headers = [(b"host", b"127.0.0.1:8765")]
    scope = {"type": "websocket", "scheme": "ws", "path": "/", "headers": headers}
    asyncio.run(RequestFilter(app, "")(scope, _receiver(coming), _ignore))
    return got


def _events(rng: Random) -> Input:
    return Input(_texts(rng, _COUNT), {"error_subjects": [], "outputs": ["head.obj"]})


def _take_events(plan: Plan) -> None:
    """Check that a viewer reports no error for the events and shows the same picture afterwards."""
    from rendercanvas.http import HttpRenderCanvas
    from rendercanvas.offscreen import OffscreenRenderCanvas

    from dermis.apps.viewer.state import ViewerState
    from dermis.apps.viewer.viewer import Viewer
    from dermis.scene.heads import load_head
    from dermis.scene.model import Scene

    Path("head.obj").write_text(obj_text())
    canvas = OffscreenRenderCanvas(size=_SIZE)
    canvas._active_client = 0
    driver, errors = InputDriver(None, canvas), _Errors()
    logging.getLogger().addHandler(errors)
    state = ViewerState(Scene(load_head("head.obj")), SETTINGS, {"name": "head.obj"})
    driver.viewer = Viewer(state, canvas, "cpu", clock=lambda: driver.now)
    driver.settled()
    for event in _passed(_damaged()):
        if not event["type"].startswith("_"):
            HttpRenderCanvas._on_event(canvas, event, 0)
            driver.frame()
    canvas._size_info.set_physical_size(*_SIZE, 1.0)
    shown = driver.settled()
    if errors.told or shown.shape[:2] != _SIZE[::-1] or not shown.any():
        raise FoundError(WRONG, f"viewer: {errors.told or 'nothing is shown'}")


class _Errors(logging.Handler):
    """Log handler that collects errors."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.told: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Store an error."""
        self.told.append(record.getMessage())


def _upload(rng: Random) -> Input:
    headers = {"host": "127.0.0.1:8765", "x-dermis-ticket": _TICKET, "content-length": str(len(obj_text()))}
    request = {"path": "/upload/head.obj", "method": "POST", "headers": headers}
    files = {"request.json": json.dumps(request).encode(), "head.obj": obj_text().encode()}
    if rng.random() < 0.5:
        request["path"] = f"/upload/{name(rng)}.obj"
        files["request.json"] = json.dumps(request).encode()
    return Input(files, {"error_subjects": [], "outputs": ["files"]}, ("request.json",))


def _take_upload(plan: Plan) -> None:
    """Check that an accepted file is stored in the server's folder only."""
    from dermis.apps.viewer.browser.request_filter import RequestFilter
    from dermis.apps.viewer.browser.uploads import Uploads

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

    canvas = SimpleNamespace(ticket=_TICKET, on_file=lambda path, *_: got.append(path))
    coming = [{"type": "http.request", "body": Path("head.obj").read_bytes()}]
    asyncio.run(RequestFilter(Uploads(app, canvas, folder), "")(scope, _receiver(coming), send))
    outside = [path for path in got if not path.resolve().is_relative_to(folder.resolve())]
    if outside or not answers:
        raise FoundError(WRONG, f"files outside: {outside}" if outside else "no answer")


def _scope(request: Any) -> dict[str, Any]:
    """Return a request as ASGI scope: bytes for headers, text for the rest."""
    headers = [(str(key).encode(), str(value).encode()) for key, value in request["headers"].items()]
    return {
        "type": "http",
        "scheme": "http",
        "path": str(request["path"]),
        "method": str(request["method"]),
        "headers": headers,
    }


def _receiver(coming: list[Any]) -> Any:
    async def receive() -> Any:
        return coming.pop(0) if coming else {"type": "http.disconnect"}

    return receive


async def _ignore(message: Any) -> None:
    """Ignore messages to the page."""


KINDS = (
    Kind("message", _message, _take_message, share=10),
    Kind("upload", _upload, _take_upload, share=4),
    Kind("viewer", _events, _take_events, share=1, cpu_s=40.0, opens_device=True),
)
