"""Damaged cached machine code: it is not run, and compiled again."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from types import FunctionType

from adversity.campaign import caches
from adversity.case import WRONG, FoundError, Input, Plan
from adversity.damage import scarred
from adversity.kind import Kind

_FOLDER = "cache"
_COUNT = 1000


def _harmonic(count: int) -> float:
    total = 0.0
    for k in range(count):
        total += 1.0 / (k + 1)
    return total


def _computed() -> float:
    """Return the result of cached or compiled machine code, as in a new process."""
    from dermis.base.compiled import compiled

    return float(compiled(FunctionType(_harmonic.__code__, globals()))(_COUNT))


@cache
def _stored() -> dict[str, bytes]:
    with TemporaryDirectory() as folder, caches(Path(folder) / _FOLDER):
        _computed()
        found = [one for one in Path(folder).rglob("*") if one.is_file()]
        return {str(one.relative_to(folder)): one.read_bytes() for one in found}


def _sound(rng: Random) -> Input:
    return Input(_stored(), {"error_subjects": []})


def _take(plan: Plan) -> None:
    with caches(Path.cwd() / _FOLDER):
        for _ in range(2):
            if _computed() != _harmonic(_COUNT):
                raise FoundError(WRONG, f"machine code gives {_computed()}")


KINDS = (Kind("machine code", _sound, _take, scarred, share=3),) if find_spec("numba") else ()
