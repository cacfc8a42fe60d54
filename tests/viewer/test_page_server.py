"""Who gets through to the canvas, and what a page may send; slow pages drop frames."""

from __future__ import annotations

import asyncio
import json
import socket
from typing import Any

import numpy as np
import pytest

from dermis.errors import DermisError
from dermis.viewer.browser.guard import Guard, acceptable, is_local
from dermis.viewer.browser.server import Address, bind

HOST = "127.0.0.1:8765"


async def _app(scope: Any, receive: Any, send: Any) -> None:
    """Answers "in", or echoes what a socket receives."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        await send({"type": "websocket.send", "text": (await receive())["text"]})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"in"})


def ask(
    guard: Guard,
    path: str = "/",
    kind: str = "http",
    host: str = HOST,
    texts: tuple[str, ...] = (),
    **headers: str,
) -> list[Any]:
    """What the guard answers to a request."""
    answers: list[Any] = []
    incoming = [{"type": "websocket.receive", "text": text} for text in texts]
    incoming.append({"type": "websocket.disconnect", "text": ""})

    async def receive() -> Any:
        return incoming.pop(0)

    async def send(message: Any) -> None:
        answers.append(message)

    all_headers = [(name.encode(), value.encode()) for name, value in {"host": host, **headers}.items()]
    asyncio.run(guard({"type": kind, "path": path, "headers": all_headers}, receive, send))
    return answers


def status(answers: list[Any]) -> Any:
    return answers[0].get("status", answers[0].get("code", answers[0]["type"]))


def test_this_machine_needs_no_token() -> None:
    guard = Guard(_app, "")
    assert status(ask(guard)) == 200
    assert status(ask(guard, host="localhost:8765")) == 200
    assert status(ask(guard, host="[::1]:8765")) == 200
    assert status(ask(guard, kind="websocket")) == "websocket.accept"


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize("path", ["/", "/wrong/", "/index.html", "/secre", "/secrets/", "//secret/"])
def test_without_the_token_nothing_is_there(kind: str, path: str) -> None:
    refused = status(ask(Guard(_app, "secret"), path, kind))
    assert refused == (404 if kind == "http" else 1008)


@pytest.mark.parametrize("path", ["/secret/", "/secret/renderview.js"])
def test_the_token_opens_page_and_socket(path: str) -> None:
    guard = Guard(_app, "secret")
    assert status(ask(guard, path, host="gpu.example:8765")) == 200
    assert status(ask(guard, path, "websocket", host="gpu.example:8765")) == "websocket.accept"


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_pages_of_other_sites_are_refused(kind: str) -> None:
    guard = Guard(_app, "")
    assert status(ask(guard, kind=kind, origin="http://evil.example")) in (404, 1008)
    assert status(ask(guard, kind=kind, host="evil.example:8765")) in (404, 1008)
    assert status(ask(guard, kind=kind, origin=f"http://{HOST}")) in (200, "websocket.accept")


def test_with_the_token_a_proxy_may_call_the_host_otherwise() -> None:
    answers = ask(Guard(_app, "secret"), "/secret/", "websocket", HOST, origin="https://skin.example")
    assert status(answers) == "websocket.accept"


@pytest.mark.parametrize(
    ("event", "passes"),
    [
        ({"type": "pointer_down", "x": 1, "y": 2}, True),
        ({"type": "_framefeedback", "index": 3}, True),
        ({"type": "_framefeedback", "index": "3"}, False),
        ({"type": "_framefeedback"}, False),
        ({"type": "resize", "pwidth": 1920, "pheight": 1080, "ratio": 1}, True),
        ({"type": "resize", "pwidth": 100000, "pheight": 100000, "ratio": 1}, False),
        ({"type": "resize", "pwidth": "many", "pheight": 1, "ratio": 1}, False),
        ({"type": "close"}, False),
        ({"type": "_clients_change", "ids": [7]}, False),
        ({"type": 3}, False),
        ({"x": 1}, False),
        ([1, 2], False),
        ({"type": "char", "data": "x" * 5000}, False),
    ],
)
def test_a_page_may_send_events_only(event: Any, passes: bool) -> None:
    assert acceptable(json.dumps(event)) is passes


@pytest.mark.parametrize("text", ["", "{", "hello", None, b"{}"])
def test_what_is_no_event_is_dropped(text: Any) -> None:
    assert not acceptable(text)


def test_bad_messages_do_not_reach_the_canvas() -> None:
    good = '{"type": "show"}'
    answers = ask(Guard(_app, ""), kind="websocket", texts=('{"type": "close"}', "{", good))
    assert answers[1]["text"] == good


@pytest.mark.parametrize(
    ("host", "local"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("localhost", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("192.168.1.4", False),
        ("localhost.evil.example", False),
        ("", False),
    ],
)
def test_only_this_machine_is_local(host: str, local: bool) -> None:
    assert is_local(host) is local


def test_other_hosts_get_a_token_that_is_new_each_time() -> None:
    tokens = set()
    for _ in range(2):
        listener, address = bind("0.0.0.0", 0)
        with listener:
            assert len(address.token) >= 20 and address.url.endswith(f"/{address.token}/")
            tokens.add(address.token)
    assert len(tokens) == 2
    listener, address = bind("127.0.0.1", 0)
    with listener:
        assert address.token == "" and address.url == f"http://127.0.0.1:{address.port}/"


def test_this_machine_gets_a_token_when_asked() -> None:
    listener, address = bind("127.0.0.1", 0, secret=True)
    with listener:
        assert len(address.token) >= 20 and address.url.endswith(f"/{address.token}/")


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_server_that_listens_everywhere_goes_by_the_machine_s_name(host: str) -> None:
    assert Address(host, 80, "secret").url == f"http://{socket.gethostname()}:80/secret/"


def test_addresses_of_version_six_are_bracketed() -> None:
    assert Address("::1", 80, "").url == "http://[::1]:80/"


def test_a_port_in_use_is_refused() -> None:
    listener, address = bind("127.0.0.1", 0)
    with listener:
        listener.listen()
        with pytest.raises(DermisError, match="--port"):
            bind("127.0.0.1", address.port)


def test_frames_are_jpeg_while_moving_and_exact_when_still() -> None:
    import io

    from PIL import Image

    pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
    from dermis.viewer.browser.canvas import encoded

    array = np.random.default_rng(1).integers(0, 255, (8, 12, 4), dtype=np.uint8)
    exact = np.array(Image.open(io.BytesIO(encoded(array, lossless=True))))
    assert (exact == array[..., :3]).all()
    assert Image.open(io.BytesIO(encoded(array, lossless=False))).format == "JPEG"
    shades = np.linspace(0.0, 255.0, 40)
    smooth = np.stack(np.broadcast_arrays(shades[:, None], shades, 90.0, 7.0), axis=-1).astype(np.uint8)
    for one in (smooth, smooth[3:, 5:]):  # of which the last one has gaps between its rows
        close = np.array(Image.open(io.BytesIO(encoded(one, lossless=False))), dtype=int)
        assert np.abs(close - one[..., :3]).max() < 12
