"""Changes to texts of lines with words: OBJ, CSV, headers of PLY and HDR, JSON lines."""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

from adversity.hostile import DEPTHS, LENGTHS, name, number, word

_WORD = re.compile(r"[^\s,/:=]+")
_MOST = 4_000_000  # letters


def _replace(lines: list[str], k: int, rng: Random) -> None:
    """Replace a word by a number, a name or a text."""
    found = list(_WORD.finditer(lines[k]))
    if found:
        one = rng.choice(found)
        actual = rng.choice((number, number, name, word))(rng)
        lines[k] = lines[k][: one.start()] + actual + lines[k][one.end() :]


def _remove(lines: list[str], k: int, rng: Random) -> None:
    del lines[k : k + rng.choice((1, 1, 10))]


def _repeat(lines: list[str], k: int, rng: Random) -> None:
    lines[k:k] = [lines[k]] * rng.choice((1, 100, 3000))


def _exchange(lines: list[str], k: int, rng: Random) -> None:
    other = rng.randrange(len(lines))
    lines[k], lines[other] = lines[other], lines[k]


def _stretch(lines: list[str], k: int, rng: Random) -> None:
    """Insert long runs of one character before, in or after a line."""
    run = rng.choice('  \t/#,\\\0-e9"[{') * rng.choice((*LENGTHS[:2], DEPTHS[-1]))
    place = rng.choice((0, len(lines[k]), lines[k].find(" ") + 1))
    lines[k] = lines[k][:place] + run + lines[k][place:]


def _shorten(lines: list[str], k: int, rng: Random) -> None:
    """Remove the last words of a line, or the last lines of the file."""
    if rng.random() < 0.3:
        del lines[k:]
    else:
        lines[k] = lines[k][: rng.randrange(len(lines[k]) + 1)]


_CHANGES: tuple[Callable[[list[str], int, Random], None], ...] = (
    *(_replace, _replace, _replace, _replace, _remove, _repeat, _exchange, _stretch, _shorten),
)


def changed_lines(text: str, rng: Random, *, rare: bool = False) -> str:
    """Return the text with one to four changes.

    rare : change rare kinds of lines as often as frequent ones, by their first word
    """
    lines = text.split("\n")
    for _ in range(rng.choice((1, 1, 2, 4))):
        if lines:
            rng.choice(_CHANGES)(lines, _line(lines, rng, rare), rng)
    ends = rng.choice(("\n",) * 8 + ("\r\n", "\r"))
    return ends.join(lines)[:_MOST]


def _line(lines: list[str], rng: Random, rare: bool) -> int:
    if not rare:
        return rng.randrange(len(lines))
    first = [line.partition(" ")[0] for line in lines]
    wanted = rng.choice(sorted(set(first)))
    return rng.choice([k for k, one in enumerate(first) if one == wanted])


def encoded(text: str) -> bytes:
    """Encode as UTF-8, preserving lone surrogates."""
    return text.encode("utf-8", "surrogatepass")
