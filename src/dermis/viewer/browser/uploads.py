"""Files that a page sends: one at a time, of bounded size, into a folder that the server removes."""

from __future__ import annotations

import hmac
import re
from pathlib import Path
from typing import Any, BinaryIO

from dermis.errors import DermisError, refuse
from dermis.viewer.browser.guard import App, Message, Receive, Send
from dermis.viewer.heads import HEAD_FILES

MOST_BYTES = 1 << 28
"""Of one file."""

MOST_BYTES_IN_ALL = 1 << 30
"""Of all files of a server."""

TICKET_HEADER = b"x-dermis-ticket"
_FOLDER = "upload"
_MOST_LETTERS = 80


class Uploads:
    """ASGI middleware that takes files at upload/NAME from the page that has control.

    app : answers everything else
    canvas : a `PageCanvas`, whose ticket the page must send, and which gets the paths
    folder : where files go
    """

    def __init__(self, app: App, canvas: Any, folder: Path) -> None:
        self._app, self._canvas, self._folder = app, canvas, folder
        self._count = self._bytes = 0
        self._is_busy = False

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """The ASGI entry point."""
        parts = str(scope.get("path", "")).split("/")
        if scope["type"] != "http" or scope["method"] != "POST" or _FOLDER not in parts[-2:-1]:
            await self._app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        status, answer = 200, ""
        try:
            self._check(parts[-1], headers)
            self._canvas.on_file(await self._store(parts[-1], receive))
        except DermisError as error:
            status, answer = 400, str(error)
        content = [(b"content-type", b"text/plain; charset=utf-8")]
        await send({"type": "http.response.start", "status": status, "headers": content})
        await send({"type": "http.response.body", "body": answer.encode()})

    def _check(self, name: str, headers: dict[bytes, bytes]) -> None:
        ticket = headers.get(TICKET_HEADER, b"")
        if not self._canvas.ticket or not hmac.compare_digest(ticket, self._canvas.ticket.encode()):
            refuse("upload", "the page that has control", "another one sent this", "Close the other page")
        if Path(name).suffix.lower() not in HEAD_FILES:
            kinds = ", ".join(HEAD_FILES)
            refuse(name, f"a mesh, a person or a scene ({kinds})", "it ends otherwise", "Convert it")
        if self._is_busy:
            refuse(name, "one file at a time", "another one is on its way", "Wait for it")
        length = headers.get(b"content-length", b"0")
        self._check_size(name, int(length) if length.isdigit() else 0)

    def _check_size(self, name: str, size: int) -> None:
        if size > MOST_BYTES:
            refuse(name, f"at most {MOST_BYTES >> 20} MB", "it is larger", "Make it smaller")
        if self._bytes + size > MOST_BYTES_IN_ALL:
            most = f"at most {MOST_BYTES_IN_ALL >> 20} MB of files in all"
            refuse(name, most, "this one would be too much", "Start the viewer again")

    async def _store(self, name: str, receive: Receive) -> Path:
        """The path of what comes, whole; nothing is left of one that is refused."""
        self._count += 1
        path = self._folder / str(self._count) / _plain(name)
        path.parent.mkdir()
        self._is_busy = True
        try:
            with path.open("wb") as file:
                await self._copy(name, receive, file)
        except BaseException:
            path.unlink()
            raise
        finally:
            self._is_busy = False
        self._bytes += path.stat().st_size
        return path

    async def _copy(self, name: str, receive: Receive, file: BinaryIO) -> None:
        more, size = True, 0
        while more:
            message = await receive()
            if message["type"] != "http.request":
                refuse(name, "a whole file", "the connection ended before", "Send it again")
            size += len(message.get("body", b""))
            self._check_size(name, size)
            file.write(message.get("body", b""))
            more = message.get("more_body", False)


def _plain(name: str) -> str:
    """A file's name without letters that a path could mean something by."""
    return re.sub(r"[^\w.-]|^\.+", "_", name)[-_MOST_LETTERS:]
