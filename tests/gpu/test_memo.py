"""The cache of function results."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from dermis.gpu import Memo
from dermis.gpu.memo import are_equal


class Log:
    """A function that logs its calls."""

    def __init__(self) -> None:
        self.made = ""

    def make(self, key: str) -> str:
        self.made += key
        return key.upper()

    def asked(self, memo: Memo, keys: str) -> str:
        """Return the keys for which the function is called when all of these are requested."""
        self.made = ""
        assert "".join(memo.get(self.make, key) for key in keys) == keys.upper()
        return self.made


@pytest.mark.parametrize(
    ("depth", "keys", "expected"),
    [(1, "aabba", "aba"), (2, "abab", "ab"), (2, "abcab", "abcab"), (2, "abacab", "abcb")],
)
def test_most_recently_used_results_are_kept(depth: int, keys: str, expected: str) -> None:
    assert Log().asked(Memo(depth), keys) == expected


def test_memory_is_freed_before_a_new_result_is_computed() -> None:
    """Check that an old result is dropped before a new one is computed, to limit memory."""
    memo, log, left = Memo(2), Log(), list[Any]()

    def make(key: str) -> str:
        left[:] = [made.value for made in memo._results[make, ""]]
        return log.make(key)

    for key, others in (("a", []), ("b", ["A"]), ("c", ["B"]), ("b", ["B"])):
        memo.get(make, key)
        assert left == others
    assert log.made == "abc"


@pytest.mark.parametrize(("depth", "asked", "rounds"), [(1, 1, 1), (2, 1, 4), (1, 3, 3), (2, 3, 4)])
def test_unused_results_expire(depth: int, asked: int, rounds: int) -> None:
    memo, log = Memo(depth, asked), Log()
    for more, expected in ((0, ""), (rounds, "a")):
        log.asked(memo, "a")
        for _ in range(more + 1):
            memo.end_frame()
        assert log.asked(memo, "a") == expected


def test_inputs_of_used_results_are_kept() -> None:
    """Check that nested results stay cached while only the outer result is requested."""
    memo, log = Memo(), Log()

    def whole() -> str:
        return memo.get(log.make, "a")

    for _ in range(5):
        assert memo.get(whole) == "A"
        memo.end_frame()
    assert log.asked(memo, "a") == ""


def test_inputs_of_used_results_count_as_recently_used() -> None:
    """Check that using a result marks its nested results as recently used."""
    memo, log = Memo(2), Log()

    def whole(key: str) -> str:
        return memo.get(log.make, key)

    for key in "abac":
        assert memo.get(whole, key) == key.upper()
    assert log.asked(memo, "acb") == "b"


def test_clearing_recomputes_everything() -> None:
    memo, log = Memo(3), Log()
    log.asked(memo, "abc")
    memo.clear()
    assert log.asked(memo, "abc") == "abc"


def test_owners_have_separate_results() -> None:
    memo, log = Memo(), Log()
    for owner, key in (("left", "a"), ("right", "b"), ("left", "a"), ("right", "b")):
        assert memo.get(log.make, key, caller_name=owner) == key.upper()
    assert log.made == "ab"


def test_arguments_without_effect_are_not_compared() -> None:
    memo = Memo()
    assert [memo.get(max, 1, untracked_arguments=(more,)) for more in (5, 7)] == [5, 5]


@dataclass(frozen=True)
class Value:
    number: int
    array: Any


@dataclass(eq=False)
class Thing:
    """An object that is compared by identity, like a texture."""

    number: int = 0


def test_arguments_are_compared_by_value() -> None:
    thing = Thing()
    ones = np.ones(3)
    alike: list[tuple[Any, Any]] = [
        (1, 1),
        ("a", "a"),
        ((1, (2, thing)), (1, (2, thing))),
        (ones, ones.copy()),
        (Value(1, ones), Value(1, ones.copy())),
        ([Value(1, ones), None], [Value(1, ones.copy()), None]),
    ]
    others: list[tuple[Any, Any]] = [
        (1, 2),
        (1, 1.0),
        (Thing(), Thing()),
        ((1, 2), (1, 2, 3)),
        (ones, ones.astype(np.float32)),
        (ones, ones[:, None]),
        (ones, 2 * ones),
        (Value(1, ones), Value(1, 2 * ones)),
        ([Value(1, ones)], [Value(1, 2 * ones)]),
        ([1, 2], (1, 2)),
    ]
    assert [are_equal(a, b) for a, b in alike] == [True] * len(alike)
    assert [are_equal(a, b) for a, b in others] == [False] * len(others)


@pytest.fixture
def executor() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(2) as made:
        yield made


def test_failures_are_not_cached(executor: ThreadPoolExecutor) -> None:
    memo, tries = Memo(), list[int]()

    def fail() -> int:
        tries.append(1)
        if len(tries) < 3:
            raise MemoryError("no more of it")
        return 7

    for _ in range(2):
        with pytest.raises(MemoryError, match="no more of it"):
            memo.result(memo.submit(executor, fail))
    assert [memo.result(memo.submit(executor, fail)) for _ in range(2)] == [7, 7]
    assert len(tries) == 3


def test_equal_arguments_are_compared_by_value_once() -> None:
    """Check that an equal copy of an argument is compared by value only the first time."""

    class Counted:
        compared = 0

        def __eq__(self, other: object) -> bool:
            Counted.compared += 1
            return isinstance(other, Counted)

        __hash__ = None  # type: ignore[assignment]

    memo, one, other = Memo(), Counted(), Counted()
    assert memo.get(id, one) == memo.get(id, other) == id(one)
    assert Counted.compared == 1
    assert memo.get(id, other) == id(one) and Counted.compared == 1
