"""Compilation of Python loops to machine code by numba, with a disk cache.

Import this module inside a function, because the import loads numba.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from collections.abc import Callable
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from dermis.base.disk import load_arrays, try_save_arrays
from dermis.base.extras import import_extra

numba = import_extra("numba", "ground truth")
numba_caching = import_extra("numba.core.caching", "ground truth")
numba_compiler = import_extra("numba.core.compiler", "ground truth")
numba_serialize = import_extra("numba.core.serialize", "ground truth")

Function = TypeVar("Function", bound=Callable[..., Any])
_CACHE_FOLDER, _CODE_ARRAY_NAME = "machine-code", "code"


def compiled(function: Function) -> Function:
    """Decorate a function so that numba compiles it and its machine code is cached on disk."""
    dispatcher = numba.njit(nogil=True, error_model="numpy")(function)
    if hasattr(dispatcher, "enable_caching") and function.__closure__ is None:
        dispatcher._cache = _CodeCache(function)
    return cast(Function, dispatcher)


_embeds_addresses = attrgetter("library.has_dynamic_globals")  # memory addresses, valid only in this process


class _CodeCache(numba_caching.NullCache):  # type: ignore[misc, name-defined]
    """Disk cache of compiled functions; replaces numba's cache, which unpickles any file in its folder.

    Cached files are read only from private folders, and the hash of a file is checked before unpickling.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        file = Path(function.__code__.co_filename)
        identity = function.__module__, function.__qualname__, function.__code__.co_firstlineno
        # the key depends on all files of the folder, because the loop may use their functions and constants
        self._source_key = f"{identity} {_source_hash(file.parent)} {numba.__version__} {sys.version}"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the cached machine code for a signature, or None if there is no cached code."""
        target_context.refresh()
        found = load_arrays(_CACHE_FOLDER, self._entry_key(sig, target_context.codegen()), [_CODE_ARRAY_NAME])
        if found is None:
            return None
        return numba_compiler.CompileResult._rebuild(
            target_context, *pickle.loads(found[_CODE_ARRAY_NAME].tobytes())
        )

    def save_overload(self, sig: Any, data: Any) -> None:
        """Cache the machine code for a signature, unless it contains addresses of this process."""
        if data.lifted or _embeds_addresses(data):
            return
        code = np.frombuffer(numba_serialize.dumps(data._reduce()), np.uint8)
        try_save_arrays(_CACHE_FOLDER, self._entry_key(sig, data.codegen), {_CODE_ARRAY_NAME: code})

    def _entry_key(self, signature: Any, codegen: Any) -> str:
        text = f"{self._source_key} {signature} {codegen.magic_tuple()}"
        return hashlib.sha256(text.encode()).hexdigest()[:40]


@cache
def _source_hash(source_folder: Path) -> str:
    """Return a hash of all Python files in a folder; the hash is part of the cache key.

    Compiled loops contain the constants and functions that they import from these files.
    """
    texts = (file.read_bytes() for file in sorted(source_folder.rglob("*.py")))
    return hashlib.sha256(b"".join(texts)).hexdigest()[:12]
