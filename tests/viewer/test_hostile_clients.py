"""Clients that send invalid data, send nothing, or open many connections; headers of the responses."""

from __future__ import annotations

import contextlib
import http.client
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from page_client import PATIENCE_S, Page, difference, visit

pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")

from dermis.apps.viewer.browser import server
from dermis.apps.viewer.browser.server import RESPONSE_HEADERS

RESIZE = '{"type": "resize", "timestamp": 1, "width": 1, "height": 1, "pwidth": 400, "pheight": 300, '
BAD = [
    RESIZE + '"ratio": 1e-300}',
    RESIZE + '"ratio": NaN}',
    '{"type": "pointer_down", "timestamp": 1, "x": NaN, "y": 1e400, "button": 1, "buttons": [1]}',
    '{"type": "wheel", "timestamp": 1, "x": 1, "y": 1, "dx": 1e308, "dy": 1e308, "modifiers": []}',
    '{"type": "key_down", "timestamp": 1, "key": ["a"]}',
    '{"a":' * 800,
    "[" * 4096,
    "[" * 60000,
]


def test_invalid_messages_do_not_break_the_page(shown: Any) -> None:
    with visit(shown) as socket:
        page = Page(socket)
        page.show()
        before = page.still()
        for text in BAD:
            socket.send(text)
        socket.send(b"\0" * 1000)
        page.drag(300, 240)
        assert difference(before, page.still()) > 0.5  # it was heard, and drawn
        assert shown.canvas.get_pixel_ratio() == 1.0 and not shown.session.message


def test_oversized_message_closes_its_socket(shown: Any) -> None:
    from websockets.exceptions import ConnectionClosed

    with visit(shown) as one, visit(shown) as other:
        one.send("x" * (1 << 17))
        with pytest.raises(ConnectionClosed):
            Page(one).hear()
        page = Page(other)
        page.show()
        page.still()


def address(shown: Any) -> tuple[str, int]:
    parts = urlsplit(shown.url)
    return str(parts.hostname), int(parts.port or 0)


@contextlib.contextmanager
def answered(shown: Any, method: str, path: str, **headers: str) -> Iterator[http.client.HTTPResponse]:
    connection = http.client.HTTPConnection(*address(shown), timeout=PATIENCE_S)
    connection.request(method, path, headers=headers)
    yield connection.getresponse()
    connection.close()


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/", 200),
        ("GET", "/page.js", 200),
        ("GET", "/page.css", 200),
        ("GET", "/renderview.js", 200),
        ("GET", "/nowhere", 404),
        ("POST", "/upload/a.obj", 400),
    ],
)
def test_every_response_has_security_headers(shown: Any, method: str, path: str, status: int) -> None:
    with answered(shown, method, path) as response:
        assert response.status == status
        assert {name: response.headers.get_all(name) for name in RESPONSE_HEADERS} == {
            name: [value] for name, value in RESPONSE_HEADERS.items()
        }
    policy = RESPONSE_HEADERS["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in policy and "unsafe" not in policy
    assert (
        RESPONSE_HEADERS["Cache-Control"] == "no-store"
        and RESPONSE_HEADERS["X-Content-Type-Options"] == "nosniff"
    )


def test_refused_clients_get_the_same_response_and_are_closed(shown: Any) -> None:
    with answered(shown, "GET", "/", Host="evil.example") as response:
        assert response.status == 403 and response.headers["Connection"] == "close"
        assert response.headers["Content-Security-Policy"] and b"token" not in response.read()


def closes(one: socket.socket) -> bool:
    one.settimeout(PATIENCE_S)
    try:
        while one.recv(4096):
            pass
    except TimeoutError:
        return False
    except ConnectionResetError:
        pass
    return True


ASKED = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.mark.parametrize(
    "said",
    [b"", b"GET / HTTP/1.1\r\nHost:", ASKED + b"GET /page.js HT", b"\x16\x03\x01"],
    ids=["nothing", "half", "one and a half", "another protocol"],
)
def test_incomplete_headers_time_out(shown: Any, said: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "HEADER_TIMEOUT_S", 0.3)
    with socket.create_connection(address(shown)) as one:
        one.sendall(said)
        stop = threading.Event()

        def dribble() -> None:
            with contextlib.suppress(OSError):
                while said and not stop.wait(0.1):
                    one.sendall(b"a")

        slow = threading.Thread(target=dribble)
        slow.start()
        try:
            assert closes(one)
        finally:
            stop.set()
            slow.join()


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return the list of connections that the server accepts."""
    found, usual = list[Any](), server.LimitedConnection.connection_made

    def connection_made(one: Any, transport: Any) -> None:
        usual(one, transport)
        found.append(one)

    monkeypatch.setattr(server.LimitedConnection, "connection_made", connection_made)
    return found


def comes(reached: Callable[[], bool]) -> bool:
    """Return whether a condition becomes true."""
    end = time.monotonic() + PATIENCE_S
    while not reached() and time.monotonic() < end:
        time.sleep(0.01)
    return reached()


def test_silent_page_stays_connected(shown: Any, made: list[Any]) -> None:
    with socket.create_connection(address(shown)):
        assert comes(lambda: len(made) == 1 and made[0]._deadline is not None)
    with visit(shown) as one:
        assert len(made) == 2 and made[1]._deadline is None
        page = Page(one)
        page.show()
        page.still()


def test_number_of_connections_is_limited(
    shown: Any, made: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "MAX_CONNECTIONS", 3)
    with contextlib.ExitStack() as crowd:
        for _ in range(3):
            crowd.enter_context(socket.create_connection(address(shown)))
        assert comes(lambda: len(made) == 3)
        late = crowd.enter_context(socket.create_connection(address(shown)))
        assert closes(late)
    assert comes(lambda: is_answered(shown))


def is_answered(shown: Any) -> bool:
    with contextlib.suppress(ConnectionError), answered(shown, "GET", "/") as response:
        return response.status == 200
    return False


def test_number_of_pages_is_limited(shown: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from websockets.exceptions import InvalidStatus

    monkeypatch.setattr("dermis.apps.viewer.browser.request_filter.MAX_PAGES", 2)
    with contextlib.ExitStack() as crowd:
        for _ in range(2):
            crowd.enter_context(visit(shown))
        with pytest.raises(InvalidStatus):
            crowd.enter_context(visit(shown))
    assert comes(lambda: is_shown(shown))


def is_shown(shown: Any) -> bool:
    from websockets.exceptions import InvalidStatus

    with contextlib.suppress(InvalidStatus), visit(shown) as one:
        return json.loads(one.recv(timeout=PATIENCE_S))["type"] in ("active", "ticket")
    return False
