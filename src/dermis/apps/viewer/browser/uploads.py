"""Uploads of files from a page to a temporary folder, one at a time and limited in size and number."""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from dermis.apps.viewer.browser.canvas import PageCanvas
from dermis.apps.viewer.browser.request_filter import AsgiApp, Message, Receive, Send
from dermis.apps.viewer.session import HEAD_FILE_SUFFIXES
from dermis.base.errors import DermisError, refuse

MAX_FILE_BYTES = 1 << 28
"""Maximum size of one file [byte]."""

MAX_TOTAL_BYTES = 1 << 30
"""Maximum total size of all files uploaded to a server [byte]."""

MAX_FILES = 200
"""Maximum number of files uploaded to a server."""

UPLOAD_IDLE_TIMEOUT_S = 20.0
"""Maximum time between two received chunks of a file [s]."""

TICKET_HEADER = b"x-dermis-ticket"
_UPLOAD_PATH = "upload"
_MAX_DISPLAYED_NAME_CHARACTERS = 80


class Uploads:
    """ASGI middleware that receives files at upload/NAME from the page that controls the viewer.

    asgi_app : application that handles all other requests
    canvas : canvas of the page; it gives the page the secret that an upload must contain, and opens each
        received file
    upload_folder : folder for the received files; the file names that pages send are only displayed, and not
        used in paths
    """

    def __init__(self, asgi_app: AsgiApp, canvas: PageCanvas, upload_folder: Path) -> None:
        self._app, self._canvas, self._folder = asgi_app, canvas, upload_folder
        self._count = self._bytes = 0
        self._is_busy = False

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Handle a request (ASGI entry point)."""
        parts = str(scope.get("path", "")).split("/")
        if scope["type"] != "http" or scope["method"] != "POST" or _UPLOAD_PATH not in parts[-2:-1]:
            await self._app(scope, receive, send)
            return
        headers, name = dict(scope["headers"]), _printable_name(parts[-1])
        status, answer = 200, ""
        response_headers = [(b"content-type", b"text/plain; charset=utf-8")]
        try:
            suffix, on_file = self._accept_upload(name, headers)
            on_file(await self._store_upload(name, suffix, receive), name)
        except DermisError as error:
            status, answer = 400, str(error)
            response_headers.append((b"connection", b"close"))  # reject the rest of the file
        await send({"type": "http.response.start", "status": status, "headers": response_headers})
        await send({"type": "http.response.body", "body": answer.encode()})

    def _accept_upload(
        self, file_name: str, headers: dict[bytes, bytes]
    ) -> tuple[str, Callable[[Path, str], None]]:
        """Return the suffix of an upload, and the function that opens the received file in the viewer.

        The suffix is one of `HEAD_FILE_SUFFIXES`. The arguments of the function are the path at which the
        upload was stored, and the name of the file on the user's machine.

        Raises DermisError for an upload that is not permitted.
        """
        ticket = headers.get(TICKET_HEADER, b"")
        if not self._canvas.ticket or not hmac.compare_digest(ticket, self._canvas.ticket.encode()):
            refuse("upload", "the page that has control", "another page sent it", "Close that page")
        suffix = next((one for one in HEAD_FILE_SUFFIXES if file_name.lower().endswith(one)), None)
        if suffix is None:
            suffixes = ", ".join(HEAD_FILE_SUFFIXES)
            refuse(
                file_name, f"a mesh, a person or a scene ({suffixes})", "it has another suffix", "Convert it"
            )
        if (on_file := self._canvas.on_file) is None:
            refuse(
                file_name, "a viewer that is ready", "it is still being prepared", "Send the file again later"
            )
        if self._is_busy:
            refuse(
                file_name, "one file at a time", "another upload is in progress", "Wait until it has finished"
            )
        if self._count >= MAX_FILES:
            refuse(file_name, f"at most {MAX_FILES} files", "this is one more", "Restart the viewer")
        length = headers.get(b"content-length", b"0")
        self._check_upload_size(file_name, int(length) if length.isdigit() and len(length) < 16 else 0)
        return suffix, on_file

    def _check_upload_size(self, file_name: str, byte_count: int) -> None:
        if byte_count > MAX_FILE_BYTES:
            refuse(file_name, f"at most {MAX_FILE_BYTES >> 20} MB", "it is larger", "Make it smaller")
        if self._bytes + byte_count > MAX_TOTAL_BYTES:
            limit = f"at most {MAX_TOTAL_BYTES >> 20} MB of files in total"
            refuse(file_name, limit, "this file would exceed it", "Restart the viewer")

    async def _store_upload(self, file_name: str, suffix: str, receive: Receive) -> Path:
        """Receive a file and return its path; a rejected file is deleted.

        file_name : name given by the page, for error messages
        suffix : suffix of the stored file
        """
        self._count += 1
        folder = self._folder / str(self._count)  # separate folders: a scene may refer to files beside it
        path = folder / f"upload{suffix}"
        with self._upload_in_progress(file_name):
            folder.mkdir(mode=0o700)
            try:
                with path.open("xb") as file:
                    await self._copy_request_body(file_name, receive, file)
            except BaseException:
                path.unlink(missing_ok=True)
                folder.rmdir()
                raise
            self._bytes += path.stat().st_size
        return path

    @contextmanager
    def _upload_in_progress(self, file_name: str) -> Iterator[None]:
        self._is_busy = True
        try:
            yield
        except OSError as fault:
            refuse(
                file_name, "space on the server", f"it cannot be stored ({fault.strerror})", "Free some space"
            )
        finally:
            self._is_busy = False

    async def _copy_request_body(self, file_name: str, receive: Receive, file: BinaryIO) -> None:
        more, size = True, 0
        while more:
            try:
                message = await asyncio.wait_for(receive(), UPLOAD_IDLE_TIMEOUT_S)
            except TimeoutError:
                refuse(
                    file_name,
                    "a complete file",
                    f"got no data for {UPLOAD_IDLE_TIMEOUT_S:g} s",
                    "Send it again",
                )
            if message["type"] != "http.request":
                refuse(file_name, "a complete file", "the connection was closed", "Send it again")
            size += len(message.get("body", b""))
            self._check_upload_size(file_name, size)
            file.write(message.get("body", b""))
            more = message.get("more_body", False)


def _printable_name(file_name: str) -> str:
    """Return a file name for messages: shortened, with unprintable characters replaced."""
    return "".join(character if character.isprintable() else "_" for character in file_name)[
        -_MAX_DISPLAYED_NAME_CHARACTERS:
    ]
