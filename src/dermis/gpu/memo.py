"""Cache of what the CPU prepares for frames, such as uploaded maps, fitted tables and empty textures."""

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
FunctionKey = tuple[Callable[..., object], str]
"""A function, and the name of its caller, see `Memo.get`."""


@dataclass(eq=False, slots=True)
class CachedResult:
    """Cached result of a function call.

    args : arguments of the call, which are compared with the arguments of later calls
    value : return value
    parts : results that the function itself took from the cache; the parts count as used whenever this result
        is used
    keys : keys of this result and of all its parts
    """

    args: tuple[object, ...]
    value: Any = None  # its type is that of the function's return value
    parts: list[tuple[FunctionKey, CachedResult]] = field(default_factory=list)
    keys: set[FunctionKey] = field(default_factory=set)


class Memo:
    """Cache of function results: a function is called again only when an argument has changed.

    cache_size : number of results to keep for each function, for callers that alternate between a few sets of
        arguments
    cache_ttl : number of frames after which the results of an unused function are dropped; if this number is
        smaller than the square of `cache_size`, the square is used instead
    """

    def __init__(self, cache_size: int = 1, cache_ttl: int = 1) -> None:
        self._cache_size = cache_size
        self._larger_sizes: dict[FunctionKey, int] = {}  # of functions for which more results are kept
        # The results of each function, the most recently used first.
        self._results: dict[FunctionKey, list[CachedResult]] = {}
        self._recent_keys: deque[set[FunctionKey]] = deque(
            [set()], maxlen=max(cache_ttl, cache_size * cache_size)
        )
        self._pending: list[CachedResult] = []  # the function calls that are running, innermost last
        # The results used in this frame, without the parts of other results.
        self._hits: list[tuple[FunctionKey, CachedResult]] = []

    @overload
    def get(
        self, function: Callable[[*Ts], T], *args: *Ts, caller_name: str = "", min_cache_size: int = 1
    ) -> T: ...

    @overload
    def get(
        self,
        function: Callable[..., T],
        *args: object,
        untracked_arguments: tuple[object, ...],
        caller_name: str = "",
        min_cache_size: int = 1,
    ) -> T: ...

    def get(
        self,
        function: Callable[..., T],
        *args: object,
        untracked_arguments: tuple[object, ...] = (),
        caller_name: str = "",
        min_cache_size: int = 1,
    ) -> T:
        """Return `function(*args, *untracked_arguments)`, or the cached result of a call with equal `args`.

        untracked_arguments : further arguments that do not affect the result and are not compared
        caller_name : name of the caller, such as a feature, if several callers use the same function; their
            results are cached separately
        min_cache_size : least number of results to keep for this function
        """
        key = function, caller_name
        results = self._results.setdefault(key, [])
        if min_cache_size > self._cache_size:
            self._larger_sizes[key] = min_cache_size
        for found in results:
            if are_equal(found.args, args):
                found.args = args  # these may be equal copies, which are recognised faster from now on
                break
        else:
            self._mark_hits_used(key)
            results[:] = results[: self._size(key) - 1]  # before the call, which may need the space
            found = self._call_function(function, args, untracked_arguments)
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
        self, executor: Executor, function: Callable[[*Ts], T], *args: *Ts, caller_name: str = ""
    ) -> Future[T]:
        """Return a future of `function(*args)`, which runs on a thread of `executor`; futures are cached.

        caller_name : name of the caller, if several callers use the same function, see `get`
        """
        return self.get(_submit_to_executor, executor, function, args, caller_name=caller_name)

    def result(self, future: Future[T]) -> T:
        """Wait for a future from `submit` and return its result; clear the cache if the function failed."""
        try:
            return future.result()
        except Exception:
            self.clear()
            raise

    def end_frame(self) -> None:
        """End a frame: drop results of functions that were not called in the last `cache_ttl` frames."""
        if self._cache_size > 1 or self._larger_sizes:
            self._mark_hits_used()
        self._recent_keys[-1].update(*(result.keys for _, result in self._hits))
        self._hits.clear()
        used = set().union(*self._recent_keys)
        if len(used) < len(self._results):
            self._results = {key: results for key, results in self._results.items() if key in used}
        self._recent_keys.append(set())

    def _size(self, function_key: FunctionKey) -> int:
        """Return the number of results to keep for a function."""
        return self._larger_sizes.get(function_key, self._cache_size)

    def clear(self) -> None:
        """Drop all cached results."""
        self._results.clear()
        self._hits.clear()

    def _call_function(
        self,
        function: Callable[..., object],
        args: tuple[object, ...],
        untracked_arguments: tuple[object, ...],
    ) -> CachedResult:
        result = CachedResult(args)
        self._pending.append(result)
        try:
            result.value = function(*args, *untracked_arguments)
        finally:
            self._pending.pop()
        return result

    def _mark_hits_used(self, function_key: FunctionKey | None = None) -> None:
        """Move to the front of the cache all results that this frame used.

        function_key : key of a function, to move only its results and those computed from them; None to move
            all of them
        """
        for one, result in self._hits:
            if function_key is None or function_key in result.keys:
                self._mark_used(one, result)

    def _mark_used(self, function_key: FunctionKey, result: CachedResult) -> None:
        """Move a result and its parts to the front of the cache, as most recently used."""
        self._recent_keys[-1].add(function_key)
        results = self._results.setdefault(function_key, [])
        if not results or results[0] is not result:
            results[:] = [result, *(one for one in results if one is not result)][: self._size(function_key)]
        for part in result.parts:
            self._mark_used(*part)


def _submit_to_executor(executor: Executor, function: Callable[[*Ts], T], args: tuple[*Ts]) -> Future[T]:
    return executor.submit(function, *args)


def are_equal(first: Any, second: Any) -> bool:
    """Return whether two arguments are equal: arrays and dataclasses by value, other objects by identity."""
    if first is second:
        return True
    if type(first) is not type(second):
        return False
    if isinstance(first, tuple | list):
        if len(first) != len(second):
            return False
        for x, y in zip(first, second, strict=True):  # noqa: SIM110 most items are identical, which needs no call
            if x is not y and not are_equal(x, y):
                return False
        return True
    if isinstance(first, np.ndarray):
        return bool(
            first.shape == second.shape
            and first.dtype == second.dtype
            and first.tobytes() == second.tobytes()
        )
    if not has_value_equality(first):
        return False
    kind: Any = type(first)  # mypy takes no type of Any for hashable
    names = dataclass_field_names(kind)
    if names is None:
        return bool(first == second)
    for name in names:
        x, y = getattr(first, name), getattr(second, name)
        if x is not y and not are_equal(x, y):
            return False
    return True


@cache
def dataclass_field_names(object_type: type) -> tuple[str, ...] | None:
    """Return the field names of a dataclass; None for other types."""
    return tuple(one.name for one in fields(object_type)) if is_dataclass(object_type) else None


def has_value_equality(value: object) -> bool:
    """Return whether an object is compared by value; resources on the device are compared by identity."""
    return type(value).__eq__ is not object.__eq__
