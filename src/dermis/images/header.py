"""Header of a picture file: size, colour space, orientation and notes."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.images.colour_spaces import SRGB, ColourSpace


class UnsupportedError(ValueError):
    """Error for a valid picture whose pixel format is not supported."""


@dataclass(frozen=True)
class PictureHeader:
    """Size and colour space of a picture file, with notes on other properties of the file.

    size : width and height of the stored picture [pixel]
    colour_space : colour space of the decoded pixels
    orientation : EXIF orientation from 1 (upright) to 8: the rotation or reflection that makes the picture
        upright
    notes : sentences for the user about properties that are converted or not used
    colour_note : sentence for the user about the conversion of colours, for a picture that is read as colours
    is_grey : whether the pixels have one colour channel
    """

    size: tuple[int, int]
    colour_space: ColourSpace = SRGB
    orientation: int = 1
    notes: tuple[str, ...] = ()
    colour_note: str | None = None
    is_grey: bool = False
