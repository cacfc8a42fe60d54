"""A page is served before the first picture, and shows the progress or the reason of a failure."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import child_process
import pytest
from offscreen_input import ADAPTER
from page_client import PATIENCE_S, SIZE, Page, visit

from dermis.apps.viewer.state import ViewerState
from dermis.base.errors import DermisError, refuse

pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")

from dermis.apps.viewer.browser import server
from dermis.apps.viewer.windows import serve

Start = Callable[[Callable[[], Any]], Any]


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Return a function that starts to serve in a thread; `url` is the page, `ended` waits for the end."""
    made, threads, told = list[Any](), list[threading.Thread](), list[str]()
    usual, begun = server.make_server, SimpleNamespace(error=None)
    monkeypatch.setattr(server, "make_server", lambda *given: made.append(usual(*given)) or made[0])

    def run(load: Callable[[], Any]) -> None:
        try:
            serve(load, ADAPTER, SIZE, "127.0.0.1", 0, lambda url, _: told.append(url))
        except DermisError as error:
            begun.error = error

    def begin(load: Callable[[], Any]) -> Any:
        threads.append(threading.Thread(target=run, args=(load,), daemon=True))
        threads[0].start()
        end = time.monotonic() + PATIENCE_S
        while not told and time.monotonic() < end:
            time.sleep(0.02)
        begun.url, begun.ended = told[0], lambda: threads[0].join(PATIENCE_S)
        return begun

    yield begin
    made[0].should_exit = True
    threads[0].join(PATIENCE_S)
    assert not threads[0].is_alive()


def heard(socket: Any, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    while True:
        message = socket.recv(timeout=PATIENCE_S)
        if isinstance(message, str) and (told := json.loads(message))["type"] == kind:
            return dict(told)


def test_page_shows_loading_stages_while_a_head_is_read(start: Start, state: ViewerState) -> None:
    gate = threading.Event()

    def load() -> Any:
        assert gate.wait(PATIENCE_S)
        return state, None

    shown = start(load)
    with urllib.request.urlopen(shown.url, timeout=PATIENCE_S) as response:
        assert response.status == 200
    with visit(shown) as one, visit(shown) as other:
        for socket in (one, other):
            told = heard(socket, "stage")
            assert (told["text"], told["number"], told["total"]) == (
                "reading the head",
                1,
                len(server.PREPARATION_STAGES),
            )
        one.send('{"type": "pointer_down", "timestamp": 1, "x": 5, "y": 5, "button": 1}')  # harms nothing
        gate.set()
        stages = dict[int, str]()  # some come twice, as a page that comes hears the stage of now
        while len(server.PREPARATION_STAGES) not in stages:
            told = heard(one, "stage")
            stages[told["number"]] = told["text"]
        assert list(stages.items()) == list(enumerate(server.PREPARATION_STAGES, 1))
        page = Page(one)
        page.show()
        assert page.still().max() > 50


def test_startup_failure_is_shown_in_the_page_and_ends_the_server(start: Start) -> None:
    gate = threading.Event()

    def load() -> Any:
        assert gate.wait(PATIENCE_S)
        refuse("head.obj", "a head", "it is a hat", "Take it off")

    shown = start(load)
    with visit(shown) as socket:
        heard(socket, "stage")
        gate.set()
        assert "it is a hat" in heard(socket, "failure")["text"]
        shown.ended()
    assert "it is a hat" in str(shown.error)


def command(*words: str) -> subprocess.Popen[str]:
    line = [sys.executable, "-m", "dermis", "view", *words, "--browser", "--port", "0", "--adapter", "cpu"]
    return child_process.start(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_command_ends_with_one_error_line(tmp_path: Path) -> None:
    broken = tmp_path / "broken.obj"
    broken.write_text("v 1 2\nf 1 2 3\n")
    with command(str(broken)) as ended:
        out, errors = ended.communicate(timeout=PATIENCE_S)
    assert ended.returncode == 2 and out.startswith("http://127.0.0.1:")
    assert errors.startswith("dermis: ") and "broken.obj" in errors and errors.count("\n") == 1


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 143)])
def test_signal_during_preparation_ends_cleanly(
    number: signal.Signals, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    with command("human") as served:
        try:
            assert served.stdout is not None
            url = served.stdout.readline().split()[0]
            (folder,) = tmp_path.iterdir()
            assert folder.stat().st_mode & 0o777 == 0o700
            urllib.request.urlopen(url, timeout=PATIENCE_S).close()
            served.send_signal(number)
            _, errors = served.communicate(timeout=PATIENCE_S)
            assert served.returncode == code and "Traceback" not in errors and list(tmp_path.iterdir()) == []
        finally:
            served.kill()
