"""Memory that a process gives back is kept for its next arrays, also where dask says otherwise."""

from __future__ import annotations

import ctypes
import os

_TRIM, _MMAP = -1, -3  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of glibc's malloc.h
_KEPT_BYTES = 1 << 27
_LARGEST_BYTES = 1 << 25  # that glibc takes from its heap: beyond, it refuses the setting
_VARIABLE = "MALLOC_TRIM_THRESHOLD_"


def keep_freed_memory() -> bool:
    """Undo `MALLOC_TRIM_THRESHOLD_`, by which dask's nannies have workers give all memory back at once.

    Pictures and maps are arrays of megabytes: each new one would fault in page by page, which more than
    doubles the processor time of making a person. Processes that this one starts do not see the variable
    either.

    Returns whether there was something to undo, and it was undone.
    """
    if _VARIABLE not in os.environ:
        return False
    del os.environ[_VARIABLE]
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another system's allocator
        return False
    return bool(mallopt(_TRIM, _KEPT_BYTES)) and bool(mallopt(_MMAP, _LARGEST_BYTES))
