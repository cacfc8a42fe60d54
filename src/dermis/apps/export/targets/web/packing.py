"""Compression of buffers by gzip, after taking differences between rows and regrouping the bytes.

The script packed.js of the page reverses these steps.
"""

from __future__ import annotations

import gzip
import hashlib
import zlib
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
ByteRun = tuple[int, int, int, int, int, tuple[float, ...]]
"""Byte run: offset, size, bytes per word, words per row, how many times each row was replaced by its
difference from the previous row, and the step of each float in a row. With 0 bytes per word, the run is a
concatenation of other runs, and the last entry has their indices."""
_ESCAPED_CHARACTERS = frozenset({0, 13, ord("<")})
"""Characters that HTML changes in a script element, or that end it."""
_WORDS_PER_ROW_CHOICES = (1, 2, 3, 4, 6, 8, 12, 16, 24)
_DIFFERENCE_ORDERS = (0, 1, 2)
_TRIAL_SAMPLE_BYTES, _TRIAL_SAMPLE_COUNT = 3 << 15, 3  # parts of a run on which layouts are compared
_TRIAL_SAMPLE_ALIGNMENT_BYTES = 192  # bytes; a multiple of the bytes of all rows
_TRIAL_ZLIB_LEVEL = 4  # zlib level for the comparison of layouts
_UNSIGNED_TYPE_BY_WORD_BYTES = {1: np.uint8, 2: np.uint16, 4: np.uint32}


class ByteRunCollector:
    """Collector of byte runs for one compressed file, in which equal runs are stored once.

    A byte run is the data of a buffer, a texture or a uniform struct. `runs` has the position and encoding of
    each run.
    """

    def __init__(self) -> None:
        self.runs: list[ByteRun] = []
        self._run_indices: dict[bytes, int] = {}
        self._data: list[bytes] = []
        self._end = 0

    def add(
        self, raw_bytes: Bytes | bytes, candidate_layouts: Iterable[tuple[int, int, int]] | None = None
    ) -> int:
        """Add a byte run, and return its index in `runs`.

        candidate_layouts : layouts to try, of which the best is used: bytes per word, words per row, and how
            many times each row is replaced by its difference from the previous row; None for all layouts
            that suit the number of bytes
        """
        raw = np.frombuffer(raw_bytes, np.uint8)
        return self._add_run(raw, list(candidate_layouts or _possible_layouts(len(raw))), ())

    def add_parts(self, encoded_parts: Iterable[Bytes]) -> int:
        """Add a byte run that is the concatenation of several parts, and return its index in `runs`.

        encoded_parts : parts in order; the layout of each part is chosen separately
        """
        numbers = tuple(self.add(one) for one in encoded_parts)
        self.runs.append((0, sum(self.runs[k][1] for k in numbers), 0, 0, 0, numbers))
        return len(self.runs) - 1

    def add_floats(self, floats: NDArray[np.float32], quantisation_steps: tuple[float, ...]) -> int:
        """Add a byte run of floats, stored as integer multiples of the steps; return its index in `runs`.

        floats : (n, c) floats that are multiples of the steps
        quantisation_steps : (c,) step of each column, a power of two
        """
        words = np.rint(floats / np.array(quantisation_steps)).astype(np.int32)
        layouts = [(4, len(quantisation_steps), order) for order in _DIFFERENCE_ORDERS]
        return self._add_run(words.view(np.uint8).reshape(-1), layouts, quantisation_steps)

    def _add_run(
        self,
        raw_bytes: Bytes,
        candidate_layouts: list[tuple[int, int, int]],
        quantisation_steps: tuple[float, ...],
    ) -> int:
        key = hashlib.sha256(raw_bytes.tobytes()).digest() + repr(quantisation_steps).encode()
        if key not in self._run_indices:
            self._run_indices[key] = len(self.runs)
            layout = _best_layout(raw_bytes, candidate_layouts)
            planes = byte_planes(raw_bytes, *layout)
            self.runs.append((self._end, len(planes), *layout, quantisation_steps))
            self._data.append(planes)
            self._end += len(planes)
        return self._run_indices[key]

    def compress(self) -> bytes:
        """Return the data of all byte runs, one after another, as one gzip file."""
        return gzip.compress(b"".join(self._data), 9, mtime=0)


def quantise(floats: NDArray[np.float32], quantisation_steps: tuple[float, ...]) -> NDArray[np.float32]:
    """Return floats (n, c) with each column rounded to multiples of a step.

    quantisation_steps : (c,) step of each column
    """
    return np.asarray(
        np.rint(floats / np.array(quantisation_steps)) * np.array(quantisation_steps), np.float32
    )


def encode_seven_bits(raw_bytes: bytes) -> str:
    """Return bytes as text with 7 bits per character, which HTML can contain.

    Code points that HTML would change are increased by 256.
    """
    bits = np.unpackbits(np.frombuffer(raw_bytes, np.uint8))
    bits = np.concatenate([bits, np.zeros(-len(bits) % 7, np.uint8)])
    codes = np.packbits(bits.reshape(-1, 7), axis=1)[:, 0] >> 1
    return codes.tobytes().decode("ascii").translate({code: code + 256 for code in _ESCAPED_CHARACTERS})


def byte_planes(raw_bytes: Bytes, bytes_per_word: int, words_per_row: int, difference_order: int) -> bytes:
    """Return the bytes of a table of words, with rows replaced by differences and the bytes transposed.

    The result compresses better, as it contains the first byte of all rows, then the second, and so on.

    raw_bytes : bytes of the table, row by row
    bytes_per_word, words_per_row : number of bytes per word, and number of words per row
    difference_order : number of times that each row is replaced by its difference from the previous row
    """
    words = raw_bytes.view(_UNSIGNED_TYPE_BY_WORD_BYTES[bytes_per_word]).copy()
    for _ in range(difference_order):
        words[words_per_row:] -= words[:-words_per_row].copy()
    return words.view(np.uint8).reshape(-1, bytes_per_word * words_per_row).T.tobytes()


def _possible_layouts(byte_count: int) -> Iterable[tuple[int, int, int]]:
    yield 1, 1, 0
    for word, row in (
        (word, row)
        for word in _UNSIGNED_TYPE_BY_WORD_BYTES
        for row in _WORDS_PER_ROW_CHOICES
        if byte_count % (word * row) == 0
    ):
        yield from ((word, row, order) for order in _DIFFERENCE_ORDERS)


def _best_layout(raw_bytes: Bytes, candidate_layouts: list[tuple[int, int, int]]) -> tuple[int, int, int]:
    """Return the layout that compresses a sample of the bytes best.

    candidate_layouts : layouts to try: bytes per word, words per row, and how many times each row is replaced
        by its difference from the previous row
    """
    sample = raw_bytes
    if len(raw_bytes) > _TRIAL_SAMPLE_COUNT * _TRIAL_SAMPLE_BYTES:
        starts = [
            k * (len(raw_bytes) - _TRIAL_SAMPLE_BYTES) // (_TRIAL_SAMPLE_COUNT - 1)
            for k in range(_TRIAL_SAMPLE_COUNT)
        ]
        aligned = [start // _TRIAL_SAMPLE_ALIGNMENT_BYTES * _TRIAL_SAMPLE_ALIGNMENT_BYTES for start in starts]
        sample = np.concatenate([raw_bytes[start : start + _TRIAL_SAMPLE_BYTES] for start in aligned])
    return min(
        candidate_layouts,
        key=lambda layout: len(zlib.compress(byte_planes(sample, *layout), _TRIAL_ZLIB_LEVEL)),
    )
