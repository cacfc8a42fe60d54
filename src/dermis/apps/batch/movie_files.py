"""Export of the clips of data sets as movies."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, groupby
from pathlib import Path

import numpy as np

from dermis.apps.batch.clips.frames import FRAME_NAMES, VIEW_NAME
from dermis.apps.batch.reader import ImageFields, read_dataset
from dermis.base.arrays import Bytes
from dermis.base.atomic_write import refuse_output, temporary_folder
from dermis.base.errors import refuse
from dermis.base.reading import checked_path
from dermis.images.colour import decode_srgb_levels, encode_srgb8
from dermis.images.movie import DEFAULT_CRF, MovieWriter

_CLIP, _FRAME, _TIME = FRAME_NAMES
_MAX_RATE_ERROR = 1e-5  # relative, of a frame rate from times that are rounded to six digits


def export_movies(dataset: str | Path, output: str | Path, crf: int = DEFAULT_CRF) -> Path:
    """Export the clips of a data set as movies, one for each clip and camera.

    Parameters
    ----------
    dataset : str or Path
        Folder of a data set with clips that `dermis batch` has written.
    output : str or Path
        Folder to write, which must not exist. Movies are named by the number of the first image. Pictures
        without a background are over black.
    crf : int
        Constant rate factor of the compression, from 0 (best) to 51.

    Returns
    -------
    Path
        The folder `output`.

    Raises
    ------
    DermisError
        For a data set without clips, a missing encoder, an output folder that exists, and damaged shards.

    Examples
    --------
    >>> from dermis.dataset import export_movies
    >>> export_movies("talking", "talking-movies")  # doctest: +SKIP
    """
    source = checked_path(dataset, "the folder of a data set")
    target = checked_path(output, "a folder for movies")
    if target.exists():
        refuse(target, "a folder that does not exist", "it exists", "Choose another folder")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        refuse_output(target, fault)
    with temporary_folder(target) as unfinished:
        for _, frames in groupby(read_dataset(source), key=_clip_and_view):
            _write_movie(unfinished, frames, crf)
        unfinished.replace(target)
    return target


def _clip_and_view(image: ImageFields) -> tuple[int, int]:
    parameters = image["parameters"]
    if _CLIP not in parameters:
        refuse("dataset", "a data set with clips", "it has none", "Write a table [clip] in its spec")
    return parameters[_CLIP], parameters.get(VIEW_NAME) or 0


def _write_movie(folder: Path, frames: Iterator[ImageFields], crf: int) -> None:
    """Write the frames of a clip as a movie; a clip of which only one frame exists has none."""
    first, second = next(frames), next(frames, None)
    if second is None:
        return
    start, later = first["parameters"], second["parameters"]
    rate = (later[_FRAME] - start[_FRAME]) / (later[_TIME] - start[_TIME])
    if abs(rate - round(rate)) < _MAX_RATE_ERROR * rate:
        rate = float(round(rate))
    height, width = first["picture"].shape[:2]
    with MovieWriter(folder / f"{first['number']:09d}.mp4", (width, height), rate, crf) as movie:
        for frame in chain((first, second), frames):
            movie.write(_on_black(frame["picture"]))


def _on_black(picture: Bytes) -> Bytes:
    """Return a picture (h, w, 3 or 4) without alpha, in linear light over black."""
    if picture.shape[2] == 3:
        return picture
    linear = decode_srgb_levels(np.ascontiguousarray(picture[..., :3]))
    return encode_srgb8(linear * (picture[..., 3:] / np.float32(255.0)))
