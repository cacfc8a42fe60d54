"""How loops become machine code. Import it inside a function: it loads numba."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from dermis.extras import needed

numba = needed("numba", "ground truth")

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """The function as machine code, kept on disk where numba finds a folder that it may write to."""
    # what is kept is looked up by name, and must not outlive a change of another file that it calls
    function.__qualname__ += "_" + _code(Path(function.__code__.co_filename).parent)
    options = {"nogil": True, "error_model": "numpy"}
    try:
        return cast(Function, numba.njit(cache=True, **options)(function))
    except RuntimeError:  # neither the package's folder nor the user's can be written to
        return cast(Function, numba.njit(**options)(function))


@cache
def _code(folder: Path) -> str:
    """What stands for the text of all files that loops of a folder may take functions and constants from."""
    texts = (file.read_bytes() for file in sorted(folder.rglob("*.py")))
    return hashlib.sha256(b"".join(texts)).hexdigest()[:12]
