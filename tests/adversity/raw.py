"""Changes to bytes of unknown meaning."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from adversity.hostile import whole

_HEADER = 512  # bytes, in which most of what a format counts is written
_MOST = 64  # bytes that one change touches


def _flip(data: bytearray, rng: Random) -> None:
    for _ in range(rng.choice((1, 1, 4, 32))):
        data[_place(data, rng)] ^= 1 << rng.randrange(8)


def _cut(data: bytearray, rng: Random) -> None:
    del data[_place(data, rng) :]


def _remove(data: bytearray, rng: Random) -> None:
    start = _place(data, rng)
    del data[start : start + rng.randint(1, _MOST)]


def _double(data: bytearray, rng: Random) -> None:
    start = _place(data, rng)
    part = data[start : start + rng.choice((1, 16, 1000))]
    data[start:start] = part * rng.choice((1, 2, 1000))


def _fill(data: bytearray, rng: Random) -> None:
    start = _place(data, rng)
    length = min(rng.randint(1, _MOST), len(data) - start)
    data[start : start + length] = rng.choice((b"\0", b"\xff", b"\x80", b" ", b"9")) * length


def _field(data: bytearray, rng: Random) -> None:
    size = rng.choice((1, 2, 4, 8))
    start = _place(data, rng)
    data[start : start + size] = whole(rng, size).to_bytes(size, rng.choice(("little", "big")))


def _swap(data: bytearray, rng: Random) -> None:
    a, b, length = _place(data, rng), _place(data, rng), rng.randint(1, _MOST)
    a, b = min(a, b), max(a, b)
    length = min(length, b - a, len(data) - b)
    data[a : a + length], data[b : b + length] = data[b : b + length], data[a : a + length]


def _add(data: bytearray, rng: Random) -> None:
    data += rng.randbytes(rng.choice((1, 100, 100_000)))


_CHANGES: tuple[Callable[[bytearray, Random], None], ...] = (
    *(_flip, _cut, _remove, _double, _fill, _field, _field, _swap, _add),
)


def changed_bytes(data: bytes, rng: Random) -> bytes:
    """Return the bytes with one to three changes."""
    made = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 3))):
        if made:
            rng.choice(_CHANGES)(made, rng)
    return bytes(made)


def _place(data: bytearray, rng: Random) -> int:
    """Return a position, half of the time near the beginning."""
    return rng.randrange(min(len(data), _HEADER) if rng.random() < 0.5 else len(data))
