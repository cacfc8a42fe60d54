"""A cache of what the CPU prepares for frames: uploaded maps, fitted tables, textures to write to."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, TypeVarTuple, overload

import numpy as np

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
Key = tuple[Callable[..., object], str]
"""A function and the owner that it is called for."""


@dataclass(eq=False, slots=True)
class CachedResult:
    """Result of a function for some arguments.

    parts : results that the function itself took from the cache; they stay in use as long as this one
    keys : key of this result and of all its parts
    """

    args: tuple[object, ...]
    value: Any = None  # of the type that the function returns
    parts: list[tuple[Key, CachedResult]] = field(default_factory=list)
    keys: set[Key] = field(default_factory=set)


class Memo:
    """Cache of function results, in which a function is called again only when an argument changes.

    cache_size : number of results that are kept per function, for callers that alternate between a few
    cache_ttl : number of frames after which the results of an unused function are dropped, at least
        `cache_size` squared
    """

    def __init__(self, cache_size: int = 1, cache_ttl: int = 1) -> None:
        self._cache_size = cache_size
        self._results: dict[Key, list[CachedResult]] = {}  # of each function, the most recently used first
        self._recent_keys: deque[set[Key]] = deque([set()], maxlen=max(cache_ttl, cache_size * cache_size))
        self._pending: list[CachedResult] = []  # the function calls that are running, innermost last
        self._hits: list[tuple[Key, CachedResult]] = []  # of this frame, without parts

    @overload
    def get(self, function: Callable[[*Ts], T], *args: *Ts, owner: str = "") -> T: ...

    @overload
    def get(
        self, function: Callable[..., T], *args: object, untracked: tuple[object, ...], owner: str = ""
    ) -> T: ...

    def get(
        self, function: Callable[..., T], *args: object, untracked: tuple[object, ...] = (), owner: str = ""
    ) -> T:
        """Return `function(*args, *untracked)`, from the cache where it was called with equal `args`.

        untracked : further arguments, which do not change the result and are not compared
        owner : name of what the result belongs to, where several are in use in turn
        """
        key = function, owner
        results = self._results.setdefault(key, [])
        for found in results:
            if are_equal(found.args, args):
                found.args = args  # these may be equal copies, which are recognised faster from now on
                break
        else:
            self._mark_hits_used(key)
            results[:] = results[: self._cache_size - 1]  # before the call, which may need the space
            found = self._call(function, args, untracked)
            found.keys.add(key)
            self._mark_used(key, found)
        if self._pending:
            self._pending[-1].parts.append((key, found))
            self._pending[-1].keys |= found.keys
            self._mark_used(key, found)
        else:
            self._hits.append((key, found))
        value: T = found.value
        return value

    def submit(
        self, executor: Executor, function: Callable[[*Ts], T], *args: *Ts, owner: str = ""
    ) -> Future[T]:
        """Return the future of `function(*args)`, which runs on another thread unless it is cached."""
        return self.get(_submit, executor, function, args, owner=owner)

    def result(self, future: Future[T]) -> T:
        """Wait for the result of a future from `submit`; a failed call is dropped from the cache."""
        try:
            return future.result()
        except Exception:
            self.clear()
            raise

    def end_frame(self) -> None:
        """End a frame and drop the results of functions that the most recent frames did not use."""
        if self._cache_size > 1:
            self._mark_hits_used()
        self._recent_keys[-1].update(*(result.keys for _, result in self._hits))
        self._hits.clear()
        used = set().union(*self._recent_keys)
        if len(used) < len(self._results):
            self._results = {key: results for key, results in self._results.items() if key in used}
        self._recent_keys.append(set())

    def clear(self) -> None:
        """Drop all results."""
        self._results.clear()
        self._hits.clear()

    def _call(
        self, function: Callable[..., object], args: tuple[object, ...], untracked: tuple[object, ...]
    ) -> CachedResult:
        result = CachedResult(args)
        self._pending.append(result)
        try:
            result.value = function(*args, *untracked)
        finally:
            self._pending.pop()
        return result

    def _mark_hits_used(self, key: Key | None = None) -> None:
        """Mark the results of this frame as most recently used: all, or those that involve a key."""
        for one, result in self._hits:
            if key is None or key in result.keys:
                self._mark_used(one, result)

    def _mark_used(self, key: Key, result: CachedResult) -> None:
        """Mark a result and its parts as most recently used."""
        self._recent_keys[-1].add(key)
        results = self._results.setdefault(key, [])
        if not results or results[0] is not result:
            results[:] = [result, *(one for one in results if one is not result)][: self._cache_size]
        for part in result.parts:
            self._mark_used(*part)


def _submit(executor: Executor, function: Callable[[*Ts], T], args: tuple[*Ts]) -> Future[T]:
    return executor.submit(function, *args)


def are_equal(a: Any, b: Any) -> bool:
    """Return whether two objects are equal: by value for arrays and dataclasses, else by identity."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, tuple | list):
        if len(a) != len(b):
            return False
        for x, y in zip(a, b, strict=True):  # noqa: SIM110 most items are identical, which needs no call
            if x is not y and not are_equal(x, y):
                return False
        return True
    if isinstance(a, np.ndarray):
        return bool(a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes())
    if not has_value_equality(a):
        return False
    kind: Any = type(a)  # mypy takes no type of Any for hashable
    names = field_names(kind)
    if names is None:
        return bool(a == b)
    for name in names:
        x, y = getattr(a, name), getattr(b, name)
        if x is not y and not are_equal(x, y):
            return False
    return True


@cache
def field_names(kind: type) -> tuple[str, ...] | None:
    """Return the names of a dataclass's fields; None for other types."""
    return tuple(one.name for one in fields(kind)) if is_dataclass(kind) else None


def has_value_equality(value: object) -> bool:
    """Return whether an object's type defines equality by value, as textures for example do not."""
    return type(value).__eq__ is not object.__eq__
