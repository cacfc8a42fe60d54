"""Access to the canvas, and the address at which it is served."""

from __future__ import annotations

import asyncio
import socket
from typing import Any

import numpy as np
import pytest

from dermis.apps.viewer.browser.request_filter import MAX_PAGES, RequestFilter, is_local_host
from dermis.apps.viewer.browser.server import Address, bind
from dermis.base.errors import DermisError

HOST = "127.0.0.1:8765"


async def _app(scope: Any, receive: Any, send: Any) -> None:
    """Answer "in", or echo what a socket receives."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        await send({"type": "websocket.send", "text": (await receive())["text"]})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"in"})


def ask(
    request_filter: RequestFilter,
    query: str = "",
    kind: str = "http",
    host: str = HOST,
    texts: tuple[str, ...] = (),
    scheme: str = "",
    **headers: str,
) -> list[Any]:
    """Return the answer of the request filter."""
    answers: list[Any] = []
    incoming = [{"type": "websocket.receive", "text": text} for text in texts]
    incoming.append({"type": "websocket.disconnect", "text": ""})

    async def receive() -> Any:
        return incoming.pop(0)

    async def send(message: Any) -> None:
        answers.append(message)

    all_headers = [(name.encode(), value.encode()) for name, value in {"host": host, **headers}.items()]
    scope = {"type": kind, "path": "/", "query_string": query.encode(), "headers": all_headers}
    usual = {"http": "http", "websocket": "ws"}[kind]
    asyncio.run(request_filter(scope | {"scheme": scheme or usual}, receive, send))
    return answers


def status(answers: list[Any]) -> Any:
    return answers[0].get("status", answers[0].get("code", answers[0]["type"]))


PASSED, REFUSED = (200, "websocket.accept"), (403, 1008)
KINDS = pytest.mark.parametrize("kind", ["http", "websocket"])


def test_local_clients_need_no_token() -> None:
    request_filter = RequestFilter(_app, "")
    assert status(ask(request_filter)) == 200
    assert status(ask(request_filter, host="localhost:8765")) == 200
    assert status(ask(request_filter, host="[::1]:8765")) == 200
    assert status(ask(request_filter, kind="websocket")) == "websocket.accept"


@KINDS
@pytest.mark.parametrize(
    "query", ["", "token=", "token=wrong", "token=secre", "token=secrets", "tokens=secret"]
)
@pytest.mark.parametrize("cookie", ["", "dermis=", "dermis=secrets", "other=secret; a", "dermis", "=secret"])
def test_requests_without_token_are_refused(kind: str, query: str, cookie: str) -> None:
    answers = ask(RequestFilter(_app, "secret"), query, kind, cookie=cookie)
    assert status(answers) in REFUSED
    if kind == "http":
        assert b"dermis view has printed" in answers[1]["body"] and b"secret" not in answers[1]["body"]


def test_url_token_becomes_a_session_cookie() -> None:
    request_filter = RequestFilter(_app, "secret", "dermis-80")
    headers = ask(request_filter, "token=secret", host="gpu.example:8765")[0]["headers"]
    assert headers == [(b"set-cookie", b"dermis-80=secret; Path=/; HttpOnly; SameSite=Strict")]
    for kind in ("http", "websocket"):
        answers = ask(request_filter, kind=kind, host="gpu.example:8765", cookie="a=b; dermis-80=secret")
        assert status(answers) in PASSED and not answers[0].get("headers")
        assert status(ask(request_filter, kind=kind, cookie="dermis-81=secret")) in REFUSED
    assert status(ask(request_filter, "token=secret", "websocket")) == "websocket.accept"


@KINDS
def test_pages_of_other_sites_are_refused(kind: str) -> None:
    request_filter = RequestFilter(_app, "")
    for origin in (
        "http://evil.example",
        f"https://{HOST}",
        f"http://{HOST}1",
        "http://127.0.0.1",
        "null",
        "",
    ):
        assert status(ask(request_filter, kind=kind, origin=origin)) in REFUSED
    assert status(ask(request_filter, kind=kind, host="evil.example:8765")) in REFUSED
    assert status(ask(request_filter, kind=kind, origin=f"http://{HOST}")) in PASSED


@KINDS
def test_other_origins_are_refused_even_with_token(kind: str) -> None:
    request_filter, cookie = RequestFilter(_app, "secret"), "dermis=secret"
    assert status(ask(request_filter, kind=kind, cookie=cookie, origin="http://127.0.0.1:9000")) in REFUSED
    assert status(ask(request_filter, "token=secret", kind=kind, origin="http://evil.example")) in REFUSED


@pytest.mark.parametrize(("kind", "scheme"), [("http", "https"), ("websocket", "wss")])
def test_origin_behind_a_proxy_is_taken_from_its_header(kind: str, scheme: str) -> None:
    request_filter = RequestFilter(_app, "secret")
    given = {"host": "skin.example", "origin": "https://skin.example", "cookie": "dermis=secret"}
    assert status(ask(request_filter, kind=kind, scheme=scheme, **given)) in PASSED
    assert status(ask(request_filter, kind=kind, **given)) in REFUSED


def test_number_of_open_pages_is_limited() -> None:
    request_filter = RequestFilter(_app, "")
    request_filter._pages = MAX_PAGES
    assert status(ask(request_filter, kind="websocket")) == 1008 and status(ask(request_filter)) == 200
    request_filter._pages -= 1
    for _ in range(2):  # it counts those that leave
        assert status(ask(request_filter, kind="websocket")) == "websocket.accept"


def test_bad_messages_do_not_reach_the_canvas() -> None:
    good = '{"timestamp":1.0,"type":"show"}'
    answers = ask(RequestFilter(_app, ""), kind="websocket", texts=('{"type": "close"}', "{", good))
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
def test_only_loopback_addresses_are_local(host: str, local: bool) -> None:
    assert is_local_host(host) is local


def test_remote_hosts_get_a_new_token_each_time() -> None:
    tokens = set()
    for _ in range(2):
        listener, address = bind("0.0.0.0", 0)
        with listener:
            assert len(address.token) >= 20 and address.url.endswith(f"/?token={address.token}")
            tokens.add(address.token)
    assert len(tokens) == 2
    listener, address = bind("127.0.0.1", 0)
    with listener:
        assert address.token == "" and address.url == f"http://127.0.0.1:{address.port}/"


def test_local_host_gets_a_token_on_request() -> None:
    listener, address = bind("127.0.0.1", 0, require_token=True)
    with listener:
        assert len(address.token) >= 20 and address.url.endswith(f"/?token={address.token}")


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_server_on_all_interfaces_shows_the_host_name(host: str) -> None:
    assert Address(host, 80, "secret").url == f"http://{socket.gethostname()}:80/?token=secret"


def test_ipv6_addresses_are_bracketed() -> None:
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
    from dermis.apps.viewer.browser.canvas import encode_image

    array = np.random.default_rng(1).integers(0, 255, (8, 12, 4), dtype=np.uint8)
    exact = np.array(Image.open(io.BytesIO(encode_image(array, is_lossless=True))))
    assert (exact == array[..., :3]).all()
    assert Image.open(io.BytesIO(encode_image(array, is_lossless=False))).format == "JPEG"
    shades = np.linspace(0.0, 255.0, 40)
    smooth = np.stack(np.broadcast_arrays(shades[:, None], shades, 90.0, 7.0), axis=-1).astype(np.uint8)
    for one in (smooth, smooth[3:, 5:]):  # of which the last one has gaps between its rows
        close = np.array(Image.open(io.BytesIO(encode_image(one, is_lossless=False))), dtype=int)
        assert np.abs(close - one[..., :3]).max() < 12
