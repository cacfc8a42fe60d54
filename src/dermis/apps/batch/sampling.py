"""Random numbers that depend on nothing but their name: the same on every machine, in any order."""

from __future__ import annotations

import hashlib

_BITS = 52  # which a double holds with a half more
_DIGITS = 6


def uniform(seed: int, number: int, name: str) -> float:
    """A number between 0 and 1, both left out, by a seed, the number of an image or a person, and a name.

    A hash of the three as text (BLAKE2b), so that no draw moves another.
    """
    digest = hashlib.blake2b(f"{seed} {number} {name}".encode(), digest_size=8).digest()
    whole = int.from_bytes(digest, "little") >> (64 - _BITS)
    return (whole + 0.5) / float(1 << _BITS)


def rounded(value: float) -> float:
    """To six significant digits: the last ones of logarithms and roots differ from machine to machine."""
    return float(f"{value:.{_DIGITS}g}") + 0.0  # no -0.0
