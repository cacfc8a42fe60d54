"""Which resources have to hold something before a frame, as none of its passes has written it by then."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from dermis.gpu.tape import Take, Taken, Tape


def needed(tape: Tape, takes: list[Take]) -> list[int]:
    """Numbers of textures and buffers that some pass reads before any writes it, in order."""
    found: set[int] = set()
    for take in takes:
        written: set[int] = set()
        for one in take.passes:
            found |= {whole(tape, k) for k in read_by(tape, one) if not _there(tape, k, written)}
            written |= set(written_by(tape, one))
    return sorted(found)


def bound(tape: Tape, takes: list[Take], names: tuple[str, ...]) -> dict[int, str]:
    """What is bound by some names."""
    found: dict[int, str] = {}
    for take in takes:
        for one in (each for each in take.passes if each.program is not None):
            known = [name for _, name, _ in tape.programs[one.program or 0]["bindings"]]
            found |= {k: name for k, name in zip(one.bound, known, strict=True) if name in names and k >= 0}
    return found


def whole(tape: Tape, number: int) -> int:
    """The texture of a view; others themselves."""
    return int(tape.resources[number].get("of", number))


def read_by(tape: Tape, one: Taken) -> Iterator[int]:
    """What a pass may read."""
    yield from (k for k, entry in _entries(tape, one) if _reads(entry))
    if one.raster and one.raster["indices"] >= 0:
        yield int(one.raster["indices"])


def written_by(tape: Tape, one: Taken) -> Iterator[int]:
    """What a pass writes; of a buffer that the host fills from the start, the buffer."""
    if one.written:
        yield one.written[0]
    yield from (k for k, entry in _entries(tape, one) if _writes(entry))
    if one.raster:
        yield from (int(one.raster[name]) for name in ("depth", "target") if one.raster[name] >= 0)


def _entries(tape: Tape, one: Taken) -> Iterator[tuple[int, dict[str, Any]]]:
    if one.program is not None:
        bindings = tape.programs[one.program]["bindings"]
        yield from ((k, entry) for k, (_, _, entry) in zip(one.bound, bindings, strict=True) if k >= 0)


def _reads(entry: dict[str, Any]) -> bool:
    return "sampler" not in entry and entry.get("storage_texture", {}).get("access") != "write-only"


def _writes(entry: dict[str, Any]) -> bool:
    return "storage_texture" in entry or entry.get("buffer") == {"type": "storage"}


def _there(tape: Tape, number: int, written: set[int]) -> bool:
    """Whether a pass has written what is there, or any part of it."""
    return any(whole(tape, k) == whole(tape, number) for k in written)
