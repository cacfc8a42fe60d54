"""Uploads of a page: heads and scenes from the page that has control, of limited size."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rendercanvas", reason="the extra `viewer` is not installed")

from dermis.apps.viewer.browser import uploads
from dermis.apps.viewer.browser.request_filter import RequestFilter
from dermis.apps.viewer.browser.uploads import Uploads


async def _app(scope: Any, receive: Any, send: Any) -> None:
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body", "body": b""})


class Server:
    def __init__(self, folder: Path) -> None:
        self.got: list[Path] = []
        self.names: list[str] = []
        self.canvas = canvas = SimpleNamespace(ticket="secret", on_file=self._take)
        self.app = RequestFilter(Uploads(_app, canvas, folder), "")

    def _take(self, path: Path, name: str) -> None:
        self.got.append(path)
        self.names.append(name)

    def send(
        self,
        name: str,
        *pieces: bytes,
        ticket: str = "secret",
        whole: bool = True,
        then: Any = None,
        **headers: str,
    ) -> tuple[int, str]:
        """Return status and text of the answer."""
        count = len(pieces)
        coming: list[Any] = [
            {"type": "http.request", "body": piece, "more_body": k + 1 < count or not whole}
            for k, piece in enumerate(pieces)
        ]
        coming.append({"type": "http.disconnect"})
        answers: list[Any] = []

        async def receive() -> Any:
            return coming.pop(0) if then is None or len(coming) > 1 else await then()

        async def send(message: Any) -> None:
            answers.append(message)

        told = {"host": "127.0.0.1:8765", "x-dermis-ticket": ticket} | headers
        listed = [(key.replace("_", "-").encode(), value.encode()) for key, value in told.items()]
        scope = {"type": "http", "method": "POST", "path": f"/upload/{name}", "headers": listed}
        scope |= {"scheme": "http", "query_string": b""}
        asyncio.run(self.app(scope, receive, send))
        return answers[0]["status"], answers[1]["body"].decode()


@pytest.fixture
def server(tmp_path: Path) -> Server:
    return Server(tmp_path)


def test_uploaded_file_is_complete_and_its_name_has_no_path(server: Server, tmp_path: Path) -> None:
    assert server.send("a head.obj", b"v 0 0", b" 0\n") == (200, "")
    assert server.got == [tmp_path / "1" / "upload.obj"] and server.names == ["a head.obj"]
    assert server.got[0].read_bytes() == b"v 0 0 0\n"
    assert server.got[0].parent.stat().st_mode & 0o777 == 0o700
    for name in (
        "..%2f.obj",
        "..\\..\\b.OBJ",
        "nul\0.obj",
        "\n" + "x" * 5000 + ".glb",
        "~root.toml",
        "con.ply",
    ):
        assert server.send(name, b"x")[0] == 200
    assert [path.relative_to(tmp_path).parts for path in server.got[1:]] == [
        (str(number), f"upload{kind}")
        for number, kind in enumerate((".obj",) * 3 + (".glb", ".toml", ".ply"), 2)
    ]
    assert all(name.isprintable() and len(name) <= 80 for name in server.names)


@pytest.mark.parametrize("name", ["a.exe", "a.zip", "a", "a.obj.py", ".obj/../b.html"])
def test_other_files_are_refused_with_a_message(name: str, server: Server) -> None:
    status, said = server.send(name, b"x")
    assert status != 200 and server.got == []
    if status == 400:
        assert ".glb, .vrm, .usdz, .obj, .ply, .stl, .json, .toml" in said


@pytest.mark.parametrize("ticket", ["", "other", "secret2"])
def test_only_the_page_that_has_control_may_send(ticket: str, server: Server, tmp_path: Path) -> None:
    status, said = server.send("a.obj", b"x", ticket=ticket)
    assert status == 400 and "control" in said and not any(tmp_path.iterdir())


def test_other_sites_may_not_send(server: Server) -> None:
    assert server.send("a.obj", b"x", origin="http://evil.example")[0] == 403
    assert server.send("a.obj", b"x", origin="null")[0] == 403
    assert server.got == []


def test_large_files_are_refused_before_and_during_upload(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(uploads, "MAX_FILE_BYTES", 1 << 20)
    assert server.send("a.obj", b"x", content_length=str(1 << 21)) == (400, server.send("a.obj", *_MUCH)[1])
    assert "at most 1 MB" in server.send("a.obj", *_MUCH)[1]
    monkeypatch.setattr(uploads, "MAX_TOTAL_BYTES", 1 << 20)
    for status in (200, 400):
        assert server.send("a.obj", bytes(600_000))[0] == status
    assert [path.stat().st_size for path in tmp_path.rglob("*.obj")] == [600_000]


_MUCH = [bytes(1 << 19)] * 3


def test_truncated_upload_leaves_nothing(server: Server, tmp_path: Path) -> None:
    status, said = server.send("a.obj", b"v 0", whole=False)
    assert status == 400 and "complete" in said and server.got == [] and not list(tmp_path.rglob("*.obj"))
    assert server.send("a.obj", b"v")[0] == 200


def test_stalled_upload_is_cancelled(server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "UPLOAD_IDLE_TIMEOUT_S", 0.05)

    async def never() -> Any:
        await asyncio.sleep(60.0)

    status, said = server.send("a.obj", b"v 0", whole=False, then=never)
    assert status == 400 and "got no data" in said and not list(tmp_path.rglob("*.obj"))
    monkeypatch.undo()
    assert server.send("a.obj", b"v")[0] == 200


def test_number_of_uploads_is_limited(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MAX_FILES", 2)
    assert [server.send("a.obj", b"v")[0] for _ in range(3)] == [200, 200, 400]


def test_full_disk_is_reported(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any, **__: Any) -> Any:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "open", full)
    status, said = server.send("a.obj", b"v")
    assert status == 400 and "No space left" in said
    monkeypatch.undo()
    assert server.send("a.obj", b"v")[0] == 200


def test_uploads_before_the_viewer_starts_are_refused(server: Server, tmp_path: Path) -> None:
    server.canvas.on_file = None
    status, said = server.send("a.obj", b"v")
    assert status == 400 and "being prepared" in said and not any(tmp_path.iterdir())
