"""The place of a worker among those of its host, which is the number of its GPU among those of the host."""

from __future__ import annotations

import itertools
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager

from dermis.base.private import cache_folder, make_private


@contextmanager
def taken_rank() -> Iterator[int]:
    """The least number from 0 on that no other process of this user has on this host, while the block runs.

    Held by a lock on a file, which the system releases when its process ends, however it does. Where there
    are no such locks, or no place for them, it is 0.
    """
    folder = cache_folder() / "ranks"
    try:
        import fcntl

        make_private(folder)
    except (ImportError, OSError):
        yield 0
        return
    for rank in itertools.count():
        name = folder / f"{socket.gethostname()}-{rank}.lock"
        place = os.open(name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(place)
            continue
        try:
            yield rank
        finally:
            os.close(place)
        return
