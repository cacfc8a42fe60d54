"""Numbers packed for one gzip: differences from row to row, byte column by byte column, see packed.js."""

from __future__ import annotations

import gzip
import hashlib
import zlib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Run = tuple[int, int, int, int, int, tuple[float, ...]]
"""Where a run of bytes begins, how many it has, bytes of a word, words of a row, how often rows are
subtracted, and of floats the step of each word of a row. Words of no bytes: numbers of runs to join."""
_FORBIDDEN = frozenset({0, 13, ord("<")})  # letters that a script element would change, or end at
_ROWS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
_ORDERS = (0, 1, 2)
_TRIED, _PLACES = 3 << 15, 3  # bytes by which a way is chosen, a multiple of all rows, and how often
_WHOLE = 192  # bytes: a multiple of all rows of words
_FAST = 4  # of zlib's levels, to compare ways
_WORDS = {1: np.uint8, 2: np.uint16, 4: np.uint32}


class Packer:
    """Gathers runs of bytes; the same bytes come once."""

    def __init__(self) -> None:
        self.runs: list[Run] = []
        self._known: dict[bytes, int] = {}
        self._data: list[bytes] = []
        self._end = 0

    def add(self, data: Bytes | bytes, ways: Iterable[tuple[int, int, int]] | None = None) -> int:
        """The number of a run of bytes.

        ways : bytes of a word, words of a row, how often rows are subtracted; the best is taken
        """
        raw = np.frombuffer(data, np.uint8)
        return self._add(raw, list(ways or _all_ways(len(raw))), ())

    def add_parts(self, parts: Iterable[Bytes]) -> int:
        """The number of a run of bytes that is joined from others, each packed its own way."""
        numbers = tuple(self.add(one) for one in parts)
        self.runs.append((0, sum(self.runs[k][1] for k in numbers), 0, 0, 0, numbers))
        return len(self.runs) - 1

    def add_floats(self, values: NDArray[np.float32], steps: tuple[float, ...]) -> int:
        """The number of (n, c) floats that are multiples of steps, c powers of two; see `stepped`."""
        words = np.rint(values / np.array(steps)).astype(np.int32)
        ways = [(4, len(steps), order) for order in _ORDERS]
        return self._add(words.view(np.uint8).reshape(-1), ways, steps)

    def _add(self, raw: Bytes, ways: list[tuple[int, int, int]], steps: tuple[float, ...]) -> int:
        key = hashlib.sha256(raw.tobytes()).digest() + repr(steps).encode()
        if key not in self._known:
            self._known[key] = len(self.runs)
            way = _best(raw, ways)
            packed = planes(raw, *way)
            self.runs.append((self._end, len(packed), *way, steps))
            self._data.append(packed)
            self._end += len(packed)
        return self._known[key]

    def packed(self) -> bytes:
        """All of it."""
        return gzip.compress(b"".join(self._data), 9, mtime=0)


def stepped(values: NDArray[np.float32], steps: tuple[float, ...]) -> NDArray[np.float32]:
    """(n, c) floats as multiples of steps."""
    return np.asarray(np.rint(values / np.array(steps)) * np.array(steps), np.float32)


def seven_bits(data: bytes) -> str:
    """Bytes as letters of seven bits, those that cannot stand in a page 256 higher, see packed.js."""
    bits = np.unpackbits(np.frombuffer(data, np.uint8))
    bits = np.concatenate([bits, np.zeros(-len(bits) % 7, np.uint8)])
    sevens = np.packbits(bits.reshape(-1, 7), axis=1)[:, 0] >> 1
    return sevens.tobytes().decode("ascii").translate({one: one + 256 for one in _FORBIDDEN})


def planes(raw: Bytes, word: int, row: int, order: int) -> bytes:
    """Of rows of words, or their differences, all the first bytes before all the second, and so on."""
    words = raw.view(_WORDS[word]).copy()
    for _ in range(order):
        words[row:] -= words[:-row].copy()
    return words.view(np.uint8).reshape(-1, word * row).T.tobytes()


def _all_ways(size: int) -> Iterable[tuple[int, int, int]]:
    yield 1, 1, 0
    for word, row in ((word, row) for word in _WORDS for row in _ROWS if size % (word * row) == 0):
        yield from ((word, row, order) for order in _ORDERS)


def _best(raw: Bytes, ways: list[tuple[int, int, int]]) -> tuple[int, int, int]:
    """The way that packs some of the bytes best."""
    tried = raw
    if len(raw) > _PLACES * _TRIED:
        starts = [k * (len(raw) - _TRIED) // (_PLACES - 1) // _WHOLE * _WHOLE for k in range(_PLACES)]
        tried = np.concatenate([raw[start : start + _TRIED] for start in starts])
    return min(ways, key=lambda way: len(zlib.compress(planes(tried, *way), _FAST)))
