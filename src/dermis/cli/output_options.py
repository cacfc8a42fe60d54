"""Output files of `dermis render` and `animate`: depth and other outputs, landmarks, movies, images."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

from cyclopts import Parameter

from dermis.base.atomic_write import atomic_file, check_output
from dermis.base.console import print_note
from dermis.base.errors import refuse
from dermis.human.landmarks.sets import LANDMARK_SETS
from dermis.scene.outputs import OUTPUTS, check_outputs

if TYPE_CHECKING:
    from dermis.base.arrays import Bytes, Floats
    from dermis.frame.features.outputs.output_images import OutputArray
    from dermis.frame.observation import Landmarks as ProjectedLandmarks
    from dermis.frame.observation import Observation
    from dermis.frame.renderer import Renderer
    from dermis.mesh.head import Head
    from dermis.scene.model import Scene
    from dermis.scene.settings import Settings

_OUTPUTS_HELP = (
    "Additional outputs per pixel, separated by commas: "
    f"{', '.join(OUTPUTS)}. They are written beside the image, such as face.depth.exr beside face.png, or as "
    "parts of the same .exr file."
)
_FORMAT_HELP = "Format of the outputs beside the image: exr, png (16 bit, quantised) or npy. [default: exr]"
OutputsOption = Annotated[str | None, Parameter(name="--outputs", help=_OUTPUTS_HELP, metavar="NAME,...")]
OutputsFormatOption = Annotated[
    Literal["exr", "png", "npy"] | None, Parameter(name="--outputs-format", help=_FORMAT_HELP)
]


class FrameOutputs:
    """Outputs of a frame, such as depth, that --outputs requests, and the files to which they are written.

    Raises DermisError for unknown outputs and for files that cannot be written.
    """

    def __init__(
        self, option_value: str | None, file_format: Literal["exr", "png", "npy"] | None, image_path: Path
    ) -> None:
        if file_format and option_value is None:
            refuse("--outputs-format", "the option --outputs", "it is missing", "Add --outputs")
        self.image = image_path
        self.names = check_outputs(_split_names(option_value)) if option_value is not None else ()
        self.in_image_file = image_path.suffix.lower() == ".exr" and file_format in (None, "exr")
        if not self.names:
            self.paths: dict[str, Path] = {}
            return
        from dermis.frame.output_files import check_formats, output_path

        check_formats(self.names, file_format or "exr")
        self.paths = {
            name: image_path if self.in_image_file else output_path(image_path, name, file_format or "exr")
            for name in self.names
        }
        for path in self.paths.values():
            check_output(path, (path.suffix,))
        if "motion" in self.names:
            print_note("note: motion is 0 in a single picture; Renderer.observe measures it between pictures")

    def write(self, picture: Floats | None, output_values: Mapping[str, OutputArray]) -> None:
        """Write the outputs to their files.

        picture : linear image to write into the same EXR file as the outputs; None if outputs have separate
            files
        output_values : dictionary from output names to pixel arrays
        """
        from dermis.frame.output_files import write_multipart, write_output

        if self.in_image_file:
            assert picture is not None
            write_multipart(self.image, picture, output_values)
            return
        for name, path in self.paths.items():
            write_output(path, name, output_values[name])

    @property
    def written_paths(self) -> dict[str, str]:
        """Return a dictionary from output names to paths of the written files, for JSON reports."""
        return {name: str(path) for name, path in self.paths.items()}


def _split_names(option_value: str) -> list[str]:
    return [name.strip() for name in option_value.split(",")]


_LANDMARKS_HELP = (
    "Landmark sets to write beside the image, such as face.landmarks.json, with camera, head pose and gaze: "
    f"{', '.join(LANDMARK_SETS)}, or a .csv file of name,vertex; separated by commas."
)
LandmarksOption = Annotated[
    str | None, Parameter(name="--landmarks", help=_LANDMARKS_HELP, metavar="SET,...")
]


class FrameLandmarks:
    """Landmark sets requested with --landmarks, and the JSON file to which they are written.

    Raises DermisError for unknown sets and for a file that cannot be written.
    """

    def __init__(self, option_value: str | None, image_path: Path) -> None:
        self.names: tuple[str, ...] = ()
        self.path = image_path.with_name(f"{image_path.stem}.landmarks.json")
        if option_value is not None:
            from dermis.frame.features.outputs.landmarks import checked_landmark_sets

            self.names = checked_landmark_sets(_split_names(option_value))
            check_output(self.path, (self.path.suffix,))

    def check_landmark_sets(self, head: Head) -> None:
        """Raise DermisError if the head lacks a requested landmark set; to be called before rendering."""
        if self.names:
            from dermis.human.landmarks.points import landmark_points

            for name in self.names:
                landmark_points(head, name)

    def write(self, renderer: Renderer, scene: Scene, settings: Settings) -> None:
        """Write the landmarks of a scene, with its camera, head pose and gaze, to the JSON file."""
        if not self.names:
            return
        observation = next(renderer.observe([scene], settings, landmarks=self.names))
        text = json.dumps(_observation_json(observation), indent=1) + "\n"
        with atomic_file(self.path) as temporary:
            temporary.write_text(text, "utf-8")


def _observation_json(observation: Observation) -> dict[str, object]:
    camera = observation.camera
    return {
        "camera": {"K": camera.K.tolist(), "R": camera.R.tolist(), "t_mm": camera.t.tolist()},
        "head_pose": observation.head_pose.tolist(),
        "gaze": None if observation.gaze is None else observation.gaze.tolist(),
        "landmarks": {name: _landmark_rows(landmarks) for name, landmarks in observation.landmarks.items()},
    }


def _landmark_rows(landmarks: ProjectedLandmarks) -> list[dict[str, object]]:
    from dermis.frame.observation import OCCLUSION_LEVELS

    positions, visible = landmarks.positions_mm.tolist(), landmarks.visible.tolist()
    occlusion = [OCCLUSION_LEVELS[level] for level in landmarks.occlusion.tolist()]
    rows = zip(landmarks.names, landmarks.pixels.tolist(), positions, visible, occlusion, strict=True)
    keys = "name", "pixel", "position_mm", "visible", "occlusion"
    return [dict(zip(keys, row, strict=True)) for row in rows]


WriteFrame = Callable[[int, "OutputArray"], None]
"""Function that writes a frame, given its number and its image."""


@dataclass(frozen=True)
class AnimationOutput:
    """Output of `dermis animate`: a movie file or numbered images.

    path : movie file, or image files with a number format such as %05d
    crf : constant rate factor, the quality of the movie; None for the default quality
    overwrite : whether existing numbered images are rendered again
    """

    path: Path
    crf: int | None
    overwrite: bool

    @property
    def is_numbered(self) -> bool:
        """Return whether the output is a sequence of numbered images instead of a movie."""
        return "%" in self.path.name

    @property
    def is_linear(self) -> bool:
        """Return whether the images store linear light as floats (EXR)."""
        return self.path.suffix.lower() == ".exr"

    def check_writable(self, frame_size: tuple[int, int]) -> None:
        """Raise DermisError if frames of this size cannot be written; to be called before rendering."""
        from dermis.images.movie import DEFAULT_CRF, MOVIE_SUFFIX, check_movie
        from dermis.images.writer import FrameFiles

        if self.is_numbered:
            if self.crf is not None:
                refuse("--crf", f"a movie ({MOVIE_SUFFIX}) as output", f"got {self.path}", "Leave it out")
            FrameFiles(self.path).prepare_folder()
            return
        if self.overwrite:
            refuse("--overwrite", "numbered pictures with it", f"got {self.path}", "Leave it out")
        if self.path.suffix.lower() in (".png", ".exr"):
            numbered = self.path.with_name(f"%05d{self.path.suffix}")
            refuse(self.path, "a movie or numbered pictures", "it is one picture", f"Name it {numbered}")
        check_movie(self.path, frame_size, DEFAULT_CRF if self.crf is None else self.crf)

    def frames_to_render(
        self, frame_numbers: range, frame_size: tuple[int, int], frame_digest: str
    ) -> Sequence[int]:
        """Return the numbers of the frames to render: those without a complete image from an earlier run.

        frame_digest : hash of everything that determines the frames; images with another hash are rendered
            again
        """
        from dermis.images.writer import FrameFiles

        if not self.is_numbered:
            return frame_numbers
        files = FrameFiles(self.path)
        files.start_sequence(frame_digest, force=self.overwrite)
        return files.missing_frames(frame_numbers, frame_size)

    @contextmanager
    def open_writer(self, frame_size: tuple[int, int], frame_rate: Fraction) -> Iterator[WriteFrame]:
        """Yield a function that queues a frame for writing; the with block ends after all frames are written.

        frame_rate : frame rate of a movie [1/s]
        """
        from dermis.images.movie import DEFAULT_CRF, MovieWriter
        from dermis.images.writer import FrameFiles, ImageWriter

        if self.is_numbered:
            files = FrameFiles(self.path)
            with ImageWriter() as writer:
                yield lambda number, picture: writer.write(files.path(number), picture)
            return
        with MovieWriter(
            self.path, frame_size, frame_rate, DEFAULT_CRF if self.crf is None else self.crf
        ) as movie:
            yield lambda _, picture: movie.write(cast("Bytes", picture))
