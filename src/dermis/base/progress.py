"""Logging of slow preparation steps to the logger "dermis"."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

LOGGER = logging.getLogger("dermis")


@contextmanager
def logged_step(step_text: str) -> Iterator[None]:
    """Log the start of a slow preparation step with level INFO, and its duration with level DEBUG.

    step_text : description of the step, such as "fitting the eyes"
    """
    start = time.perf_counter()
    LOGGER.info(step_text)
    try:
        yield
    finally:
        LOGGER.debug("%s: %.2f s", step_text, time.perf_counter() - start)
