"""Textures and buffers for which a device has no room: what they are, and how large."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from dermis.base.errors import DermisError

_REMEDY = "Lower --size, --samples or --atlas, close other programs that use the GPU, or try --adapter cpu"
_SAID = "out of memory", "not enough memory"  # by the library, whose class of error differs


class NoRoomError(DermisError):
    """Something that does not fit onto a device.

    expected, came : sentences without a full stop, for who knows of a better remedy
    size : of what did not fit [byte]
    """

    def __init__(self, expected: str, came: str, size: float, remedy: str = _REMEDY) -> None:
        super().__init__(f"{expected}, but {came}. {remedy}.")
        self.expected, self.came, self.size = expected, came, size


@contextlib.contextmanager
def room_for(device: str, name: str, size: float, most: float) -> Iterator[None]:
    """Tell what it was where something is not made.

    device, name : of the adapter, and of what is made
    size, most : how large it is, and how large it may be [byte]

    Raises NoRoomError.
    """
    import wgpu

    expected = f"{device}: expected room for the {name}, {in_words(size)}"
    if size > most:
        raise NoRoomError(expected, f"it takes at most {in_words(most)} at once", size)
    try:
        yield
    except (wgpu.GPUError, MemoryError) as error:
        if isinstance(error, wgpu.GPUError) and not any(words in str(error).lower() for words in _SAID):
            raise
        raise NoRoomError(expected, "it has none left", size) from error


def in_words(size: float) -> str:
    """Bytes as people write them."""
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.1f} MB"
