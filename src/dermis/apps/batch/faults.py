"""What ends a worker and not the run: its work is done again by another."""

from __future__ import annotations

from dermis.base.errors import DermisError


class LostProcessError(DermisError):
    """A process that ended before its work did."""
