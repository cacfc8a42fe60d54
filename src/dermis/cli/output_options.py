"""Files that `dermis render` and `animate` write: outputs and landmarks beside an image, and movies."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

from cyclopts import Parameter

from dermis.base.atomic_write import check_output, replacing
from dermis.base.console import note
from dermis.base.errors import refuse
from dermis.human.landmarks.sets import SETS
from dermis.scene.outputs import OUTPUTS, checked_outputs

if TYPE_CHECKING:
    from dermis.base.arrays import Bytes, Floats
    from dermis.frame.features.outputs.planes import PlaneArray
    from dermis.frame.observation import Landmarks as ProjectedLandmarks
    from dermis.frame.observation import Observation
    from dermis.frame.renderer import Renderer
    from dermis.mesh.head import Head
    from dermis.scene.model import Scene
    from dermis.scene.settings import Settings

_OUTPUTS_HELP = (
    "What else is known of each pixel, with commas between: "
    f"{', '.join(OUTPUTS)}. Written beside the image, as face.depth.exr beside face.png, or into it as the "
    "parts of one .exr."
)
_FORMAT_HELP = "Of the files beside the image: exr (the default), png (16 bit, in steps) or npy."
Outputs = Annotated[str | None, Parameter(name="--outputs", help=_OUTPUTS_HELP, metavar="NAME,...")]
Format = Annotated[Literal["exr", "png", "npy"] | None, Parameter(name="--outputs-format", help=_FORMAT_HELP)]


class FrameOutputs:
    """Outputs that were requested on the command line.

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
        from dermis.frame.output_files import beside, check_formats

        check_formats(self.names, kind or "exr")
        self.paths = {
            name: image if self.together else beside(image, name, kind or "exr") for name in self.names
        }
        for path in self.paths.values():
            check_output(path, (path.suffix,))
        if "motion" in self.names:
            note("note: motion is 0 in a single picture; Renderer.observe counts it from one to the next")

    def write(self, picture: Floats | None, values: Mapping[str, PlaneArray]) -> None:
        """Write the outputs.

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
        """Paths of the files by name of the output."""
        return {name: str(path) for name, path in self.paths.items()}


def _names(typed: str) -> list[str]:
    return [name.strip() for name in typed.split(",")]


_LANDMARKS_HELP = (
    "Landmarks to write beside the image, as face.landmarks.json, with camera, head pose and gaze: "
    f"{', '.join(SETS)}, or a .csv of name,vertex; several with commas between."
)
Landmarks = Annotated[str | None, Parameter(name="--landmarks", help=_LANDMARKS_HELP, metavar="SET,...")]


class FrameLandmarks:
    """Landmarks that were requested on the command line.

    Raises DermisError for unknown sets and for a file that cannot be written.
    """

    def __init__(self, typed: str | None, image: Path) -> None:
        self.names: tuple[str, ...] = ()
        self.path = image.with_name(f"{image.stem}.landmarks.json")
        if typed is not None:
            from dermis.frame.features.outputs.landmarks import checked_landmarks

            self.names = checked_landmarks(_names(typed))
            check_output(self.path, (self.path.suffix,))

    def check(self, head: Head) -> None:
        """Raises DermisError for a head that has no landmarks of these names."""
        if self.names:
            from dermis.human.landmarks.points import landmark_points

            for name in self.names:
                landmark_points(head, name)

    def write(self, renderer: Renderer, scene: Scene, settings: Settings) -> None:
        """Write the landmarks, if any were requested."""
        if not self.names:
            return
        seen = next(renderer.observe([scene], settings, landmarks=self.names))
        text = json.dumps(_observation_json(seen), indent=1) + "\n"
        with replacing(self.path) as part:
            part.write_text(text, "utf-8")


def _observation_json(seen: Observation) -> dict[str, object]:
    camera = seen.camera
    return {
        "camera": {"K": camera.K.tolist(), "R": camera.R.tolist(), "t_mm": camera.t.tolist()},
        "head_pose": seen.head_pose.tolist(),
        "gaze": None if seen.gaze is None else seen.gaze.tolist(),
        "landmarks": {name: _landmark_rows(one) for name, one in seen.landmarks.items()},
    }


def _landmark_rows(one: ProjectedLandmarks) -> list[dict[str, object]]:
    each = zip(one.names, one.pixels.tolist(), one.positions_mm.tolist(), one.visible.tolist(), strict=True)
    return [
        {"name": name, "pixel": pixel, "position_mm": place, "visible": visible}
        for name, pixel, place, visible in each
    ]


Write = Callable[[int, "PlaneArray"], None]
"""Takes the number of a frame and its picture."""


@dataclass(frozen=True)
class AnimationOutput:
    """Output of a moving head, as it was typed.

    crf : quality of a movie; None for the usual one
    anew : whether to draw numbered pictures again that exist
    """

    path: Path
    crf: int | None
    anew: bool

    @property
    def numbered(self) -> bool:
        """Whether the output is numbered pictures."""
        return "%" in self.path.name

    @property
    def linear(self) -> bool:
        """Whether the pictures are linear floats."""
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
        """Return the numbers of the frames to be drawn."""
        from dermis.images.writer import FrameFiles

        if not self.numbered:
            return numbers
        files = FrameFiles(self.path)
        files.claim(made_of, anew=self.anew)
        return files.missing(numbers, size)

    @contextmanager
    def writing(self, size: tuple[int, int], rate: Fraction) -> Iterator[Write]:
        """Yield a function that writes frames while others are drawn; at the end all are written."""
        from dermis.images.movie import DEFAULT_CRF, MovieWriter
        from dermis.images.writer import FrameFiles, ImageWriter

        if self.numbered:
            files = FrameFiles(self.path)
            with ImageWriter() as writer:
                yield lambda number, picture: writer.write(files.path(number), picture)
            return
        with MovieWriter(self.path, size, rate, DEFAULT_CRF if self.crf is None else self.crf) as movie:
            yield lambda _, picture: movie.write(cast("Bytes", picture))
