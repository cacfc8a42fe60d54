"""Outputs of a frame on the command line: which are asked, where they go, and that they can."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from dermis.base.console import note
from dermis.base.errors import refuse
from dermis.scene.outputs import OUTPUTS, checked_outputs

if TYPE_CHECKING:
    from numpy.typing import NDArray

_HELP = (
    "What else is known of each pixel, with commas between: "
    f"{', '.join(OUTPUTS)}. Written beside the image, as face.depth.exr beside face.png, or into it as the "
    "parts of one .exr."
)
_FORMAT_HELP = "Of the files beside the image: exr (the default), png (16 bit, in steps) or npy."
Outputs = Annotated[str | None, Parameter(name="--outputs", help=_HELP, metavar="NAME,...")]
Format = Annotated[Literal["exr", "png", "npy"] | None, Parameter(name="--outputs-format", help=_FORMAT_HELP)]


class FrameOutputs:
    """Outputs that were asked for on the command line.

    Raises DermisError for unknown names and for files that cannot be written.
    """

    def __init__(self, typed: str | None, kind: Literal["exr", "png", "npy"] | None, image: Path) -> None:
        if kind and typed is None:
            refuse("--outputs-format", "--outputs with it", "there is none", "Name what is to be written")
        self.image = image
        self.names = checked_outputs(_names(typed)) if typed is not None else ()
        self.together = image.suffix.lower() == ".exr" and kind in (None, "exr")
        if not self.names:
            self.paths: dict[str, Path] = {}
            return
        from dermis.base import atomic_write as outputs
        from dermis.frame.output_files import beside, check_formats

        check_formats(self.names, kind or "exr")
        self.paths = {
            name: image if self.together else beside(image, name, kind or "exr") for name in self.names
        }
        for path in self.paths.values():
            outputs.check_output(path, (path.suffix,))
        if "motion" in self.names:
            note("note: motion is 0 in a single picture; Renderer.observe counts it from one to the next")

    def write(self, picture: NDArray[Any] | None, values: Mapping[str, NDArray[Any]]) -> None:
        """Write them.

        picture : linear, where they are parts of its file
        values : by name
        """
        from dermis.frame.output_files import write_output, write_together

        if self.together:
            assert picture is not None
            write_together(self.image, picture, values)
            return
        for name, path in self.paths.items():
            write_output(path, name, values[name])

    @property
    def report(self) -> dict[str, str]:
        """Files by name."""
        return {name: str(path) for name, path in self.paths.items()}


def _names(typed: str) -> list[str]:
    return [name.strip() for name in typed.split(",")]
