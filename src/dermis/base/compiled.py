"""How loops become machine code. Import it inside a function: it loads numba."""

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

from dermis.base.disk import find, keep
from dermis.base.extras import needed

numba = needed("numba", "ground truth")
caching = needed("numba.core.caching", "ground truth")
compiler = needed("numba.core.compiler", "ground truth")
serialize = needed("numba.core.serialize", "ground truth")

Function = TypeVar("Function", bound=Callable[..., Any])
_FOLDER, _NAME = "machine-code", "code"


def compiled(function: Function) -> Function:
    """The function as machine code, kept on disk like everything else."""
    made = numba.njit(nogil=True, error_model="numpy")(function)
    if hasattr(made, "enable_caching") and function.__closure__ is None:
        made._cache = _KeptCode(function)
    return cast(Function, made)


_HOLDS_ADDRESSES = attrgetter("library.has_dynamic_globals")  # of this process


class _KeptCode(caching.NullCache):  # type: ignore[misc, name-defined]
    """In place of numba's own cache, which unpickles, and so runs, whatever lies in its files.

    Files of `disk` are read whole, and only where nobody else can write; the hash is checked first.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        file = Path(function.__code__.co_filename)
        named = function.__module__, function.__qualname__, function.__code__.co_firstlineno
        # what other files give to it, functions and constants, belongs to what it is made from
        self._made_of = f"{named} {_code(file.parent)} {numba.__version__} {sys.version}"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled for these types, or None."""
        target_context.refresh()
        found = find(_FOLDER, self._key(sig, target_context.codegen()), [_NAME])
        if found is None:
            return None
        return compiler.CompileResult._rebuild(target_context, *pickle.loads(found[_NAME].tobytes()))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, where another process can use it."""
        if data.lifted or _HOLDS_ADDRESSES(data):
            return
        code = np.frombuffer(serialize.dumps(data._reduce()), np.uint8)
        keep(_FOLDER, self._key(sig, data.codegen), {_NAME: code})

    def _key(self, sig: Any, codegen: Any) -> str:
        text = f"{self._made_of} {sig} {codegen.magic_tuple()}"
        return hashlib.sha256(text.encode()).hexdigest()[:40]


@cache
def _code(folder: Path) -> str:
    """What stands for the text of all files that loops of a folder may take functions and constants from."""
    texts = (file.read_bytes() for file in sorted(folder.rglob("*.py")))
    return hashlib.sha256(b"".join(texts)).hexdigest()[:12]
