"""Files that a page sends: one at a time, of bounded size and number, into a temporary folder."""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from dermis.apps.viewer.browser.canvas import PageCanvas
from dermis.apps.viewer.browser.guard import App, Message, Receive, Send
from dermis.apps.viewer.session import HEAD_FILES
from dermis.base.errors import DermisError, refuse

MOST_BYTES = 1 << 28
"""Largest size of one file."""

MOST_BYTES_IN_ALL = 1 << 30
"""Largest size of all files of a server."""

MOST_FILES = 200
"""Largest number of files of a server."""

IDLE_S = 20.0
"""Within which the next piece of a file comes [s]."""

TICKET_HEADER = b"x-dermis-ticket"
_FOLDER = "upload"
_MOST_LETTERS = 80


class Uploads:
    """ASGI middleware that takes files at upload/NAME from the page that has control.

    app : answers everything else
    canvas : a `PageCanvas`, whose ticket the page must send, and which gets each file's path and name
    folder : where files go, by numbers: what a page calls them is shown and no more
    """

    def __init__(self, app: App, canvas: PageCanvas, folder: Path) -> None:
        self._app, self._canvas, self._folder = app, canvas, folder
        self._count = self._bytes = 0
        self._is_busy = False

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """The ASGI entry point."""
        parts = str(scope.get("path", "")).split("/")
        if scope["type"] != "http" or scope["method"] != "POST" or _FOLDER not in parts[-2:-1]:
            await self._app(scope, receive, send)
            return
        headers, name = dict(scope["headers"]), _shown(parts[-1])
        status, answer = 200, ""
        content = [(b"content-type", b"text/plain; charset=utf-8")]
        try:
            kind, take = self._accepted(name, headers)
            take(await self._store(name, kind, receive), name)
        except DermisError as error:
            status, answer = 400, str(error)
            content.append((b"connection", b"close"))  # whatever of the file is still to come
        await send({"type": "http.response.start", "status": status, "headers": content})
        await send({"type": "http.response.body", "body": answer.encode()})

    def _accepted(self, name: str, headers: dict[bytes, bytes]) -> tuple[str, Callable[[Path, str], None]]:
        """Return the file's kind, one of `HEAD_FILES`, and what takes it, when it may come."""
        ticket = headers.get(TICKET_HEADER, b"")
        if not self._canvas.ticket or not hmac.compare_digest(ticket, self._canvas.ticket.encode()):
            refuse("upload", "the page that has control", "another one sent this", "Close the other page")
        kind = next((one for one in HEAD_FILES if name.lower().endswith(one)), None)
        if kind is None:
            kinds = ", ".join(HEAD_FILES)
            refuse(name, f"a mesh, a person or a scene ({kinds})", "it ends otherwise", "Convert it")
        if (take := self._canvas.on_file) is None:
            refuse(name, "a page that shows a head", "the first one is being prepared", "Send it again soon")
        if self._is_busy:
            refuse(name, "one file at a time", "another one is on its way", "Wait for it")
        if self._count >= MOST_FILES:
            refuse(name, f"at most {MOST_FILES} files", "this is one more", "Start the viewer again")
        length = headers.get(b"content-length", b"0")
        self._check_size(name, int(length) if length.isdigit() and len(length) < 16 else 0)
        return kind, take

    def _check_size(self, name: str, size: int) -> None:
        if size > MOST_BYTES:
            refuse(name, f"at most {MOST_BYTES >> 20} MB", "it is larger", "Make it smaller")
        if self._bytes + size > MOST_BYTES_IN_ALL:
            most = f"at most {MOST_BYTES_IN_ALL >> 20} MB of files in all"
            refuse(name, most, "this one would be too much", "Start the viewer again")

    async def _store(self, name: str, kind: str, receive: Receive) -> Path:
        """The path of what comes, whole; nothing is left of one that is refused."""
        self._count += 1
        folder = self._folder / str(self._count)  # of its own, as a scene may name files beside it
        path = folder / f"upload{kind}"
        with self._busy(name):
            folder.mkdir(mode=0o700)
            try:
                with path.open("xb") as file:
                    await self._copy(name, receive, file)
            except BaseException:
                path.unlink(missing_ok=True)
                folder.rmdir()
                raise
            self._bytes += path.stat().st_size
        return path

    @contextmanager
    def _busy(self, name: str) -> Iterator[None]:
        self._is_busy = True
        try:
            yield
        except OSError as fault:
            refuse(name, "room for it on the server", f"it cannot be kept ({fault.strerror})", "Free some")
        finally:
            self._is_busy = False

    async def _copy(self, name: str, receive: Receive, file: BinaryIO) -> None:
        more, size = True, 0
        while more:
            try:
                message = await asyncio.wait_for(receive(), IDLE_S)
            except TimeoutError:
                refuse(name, "a whole file", f"nothing came for {IDLE_S:g} s", "Send it again")
            if message["type"] != "http.request":
                refuse(name, "a whole file", "the connection ended before", "Send it again")
            size += len(message.get("body", b""))
            self._check_size(name, size)
            file.write(message.get("body", b""))
            more = message.get("more_body", False)


def _shown(name: str) -> str:
    """Return a file's name as it is shown."""
    return "".join(letter if letter.isprintable() else "_" for letter in name)[-_MOST_LETTERS:]
