"""Connections of the server: only so many, and none that says nothing."""

from __future__ import annotations

import asyncio
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

MOST_CONNECTIONS = 64
"""At the same time, sockets of pages among them."""

HEADERS_S = 10.0
"""Within which the headers of a request come [s]."""


class LimitedConnection(H11Protocol):  # type: ignore[misc]
    """uvicorn's HTTP protocol with limits that it lacks."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Drop one too many."""
        super().connection_made(transport)
        if len(self.connections) > MOST_CONNECTIONS:
            transport.abort()
        else:
            self._expect_headers()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the deadline."""
        self._expect_nothing()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Watch the time while headers are on their way."""
        super().handle_events()
        if self.conn.their_state is not h11.IDLE or self.timeout_keep_alive_task is not None:
            self._expect_nothing()
        elif self._deadline is None:
            self._expect_headers()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Leave a socket to its own protocol, which pings it."""
        self._expect_nothing()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """Close on who does not speak HTTP."""
        self.transport.abort()

    def _expect_headers(self) -> None:
        self._deadline = self.loop.call_later(HEADERS_S, self.transport.abort)

    def _expect_nothing(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
