"""Numbered pictures in a folder, of which those that are there already need not be drawn again."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from dermis.base import atomic_write as outputs
from dermis.base.errors import DermisError, refuse
from dermis.base.reading import read_file
from dermis.images.codecs import png_size
from dermis.images.exr import decode_exr
from dermis.images.io import OUTPUT_SUFFIXES, check_output, read_bytes

_NUMBER = re.compile(r"%(?:0(\d+))?d")


@dataclass(frozen=True)
class FrameFiles:
    """Files named by a pattern such as frames/%05d.png.

    Beside them a hidden file says what they are made of.
    """

    pattern: Path

    def path(self, number: int) -> Path:
        """The file of a frame."""
        name = _NUMBER.sub(lambda found: f"{number:0{found[1] or 1}d}", self.pattern.name)
        return self.pattern.with_name(name)

    def prepare(self) -> None:
        """Make the folder and try it.

        Raises DermisError for another pattern, and for a folder that cannot be written to.
        """
        name = self.pattern.name
        if len(_NUMBER.findall(name)) != 1 or name.count("%") != 1:
            refuse(self.pattern, "one place for numbers", f"the name is {name!r}", "Write frames/%05d.png")
        if self.pattern.suffix.lower() not in OUTPUT_SUFFIXES:
            came = f"the suffix is {self.pattern.suffix!r}"
            refuse(self.pattern, f"frames as {' or '.join(OUTPUT_SUFFIXES)}", came, "Choose one of them")
        try:
            self.pattern.parent.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            outputs.refuse_output(self.pattern.parent, fault)
        check_output(self.path(0))

    def claim(self, made_of: str, *, anew: bool = False) -> None:
        """Frames from before count no more if they are made of something else, or if all are wanted anew.

        made_of : a text that two frames of one number share if they look the same
        """
        if anew or not self._says(made_of):
            with outputs.replacing(self._record) as trial:
                trial.write_text(made_of, encoding="utf-8")

    def missing(self, numbers: Iterable[int], size: tuple[int, int]) -> list[int]:
        """Those of the frames that are to be drawn: all but files that count, are whole and of this size."""
        begun_ns = self._record.stat().st_mtime_ns
        return [number for number in numbers if not _stands(self.path(number), size, begun_ns)]

    def _says(self, made_of: str) -> bool:
        """Whether frames are there of which the record says this; a damaged one says nothing."""
        text = made_of.encode()
        try:
            return read_file(self._record, "a record of frames", len(text)) == text
        except DermisError:
            return False

    @property
    def _record(self) -> Path:
        return self.pattern.with_name(f".{self.pattern.name}.made-of")


def _stands(path: Path, size: tuple[int, int], begun_ns: int) -> bool:
    """Whether a picture of this size lies there whole, written since a time."""
    try:
        if not path.is_file() or path.stat().st_mtime_ns < begun_ns:
            return False
        if path.suffix.lower() == ".png":
            return png_size(read_bytes(path)) == size
        height, width = decode_exr(read_bytes(path)).shape[:2]
    except (OSError, ValueError, RuntimeError, DermisError):
        return False
    return (width, height) == size
