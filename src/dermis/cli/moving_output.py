"""Where `dermis animate` writes: a movie, or numbered pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from dermis.base.errors import refuse

Write = Callable[[int, Any], None]
"""Takes the number of a frame and its picture."""


@dataclass(frozen=True)
class MovingOutput:
    """What was typed of the output.

    crf : quality of a movie; None for the usual one
    anew : draw numbered pictures again that are there
    """

    path: Path
    crf: int | None
    anew: bool

    @property
    def numbered(self) -> bool:
        """Whether it is numbered pictures."""
        return "%" in self.path.name

    @property
    def linear(self) -> bool:
        """Whether its pictures are linear floats."""
        return self.path.suffix.lower() == ".exr"

    def check(self, size: tuple[int, int]) -> None:
        """Refuse what cannot be written, before anything is drawn."""
        from dermis.images.movie import DEFAULT_CRF, SUFFIX, check_movie
        from dermis.images.writer import FrameFiles

        if self.numbered:
            if self.crf is not None:
                refuse("--crf", f"a movie ({SUFFIX}) with it", f"{self.path} came", "Leave it out")
            FrameFiles(self.path).prepare()
            return
        if self.anew:
            refuse("--anew", "numbered pictures with it", f"{self.path} came", "Leave it out")
        if self.path.suffix.lower() in (".png", ".exr"):
            numbered = self.path.with_name(f"%05d{self.path.suffix}")
            refuse(self.path, "a movie or numbered pictures", "it is one picture", f"Name it {numbered}")
        check_movie(self.path, size, DEFAULT_CRF if self.crf is None else self.crf)

    def missing(self, numbers: range, size: tuple[int, int], made_of: str) -> Sequence[int]:
        """The frames to be drawn."""
        from dermis.images.writer import FrameFiles

        if not self.numbered:
            return numbers
        files = FrameFiles(self.path)
        files.claim(made_of, anew=self.anew)
        return files.missing(numbers, size)

    @contextmanager
    def writing(self, size: tuple[int, int], rate: Fraction) -> Iterator[Write]:
        """What writes frames while others are drawn; at its end all of them are there."""
        from dermis.images.movie import DEFAULT_CRF, MovieWriter
        from dermis.images.writer import FrameFiles, ImageWriter

        if self.numbered:
            files = FrameFiles(self.path)
            with ImageWriter() as writer:
                yield lambda number, picture: writer.write(files.path(number), picture)
            return
        with MovieWriter(self.path, size, rate, DEFAULT_CRF if self.crf is None else self.crf) as movie:
            yield lambda number, picture: movie.write(picture)
