"""What takes long before the first picture, told to whoever listens to the logger "dermis"."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

LOGGER = logging.getLogger("dermis")


@contextmanager
def preparing(what: str) -> Iterator[None]:
    """Around what may take seconds: INFO when it begins, DEBUG with the time when it ends.

    what : is done, as "fitting the eyes"
    """
    began = time.perf_counter()
    LOGGER.info(what)
    try:
        yield
    finally:
        LOGGER.debug("%s: %.2f s", what, time.perf_counter() - began)
