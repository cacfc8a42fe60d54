"""Data sets read back, image by image."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from random import Random
from typing import Any

from dermis.apps.batch.samples import decoded
from dermis.apps.batch.shard_files import Files, shard_files
from dermis.apps.batch.shards import shard_index
from dermis.base.errors import refuse
from dermis.base.quantities import whole_number
from dermis.base.reading import named_path

_MOST = 10**9


def read_dataset(
    path: str | Path, *, shards: Iterable[int] | None = None, shuffle: int | None = None
) -> Iterator[dict[str, Any]]:
    """What is known of each image of a data set that `dermis batch` has made.

    path : its folder, or one of its shards
    shards : numbers of those to read, such as `range(rank, 100, workers)`; all where None
    shuffle : a seed, for the shards in random order and the images of each as well; in order where None

    Each image is a dictionary: "number", "picture" (h, w, 3 or 4, sRGB bytes), "camera" (K, R, t),
    "head_pose", "gaze", "landmarks" (pixels, positions_mm and visible by the name of their set), "parameters"
    by name, and the outputs by theirs: "depth", "normal", "label", ...

    Raises DermisError for a folder without shards, and for shards that are cut off or damaged.
    """
    chosen = _chosen(named_path(path, "a data set"), shards)
    return _images(chosen, None if shuffle is None else Random(whole_number("shuffle", shuffle, 0, 2**64)))


def _chosen(path: Path, shards: Iterable[int] | None) -> list[Path]:
    """The shards to read, by number."""
    if shard_index(path) is not None or path.suffix == ".tar":
        return [path]
    try:
        named = [(shard_index(one), one) for one in sorted(path.iterdir())]
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        came = f"it cannot be read ({getattr(fault, 'strerror', None) or fault})"
        refuse(path, "the folder of a data set", came, "Check its name")
    found = {index: one for index, one in named if index is not None}
    if not found:
        refuse(path, "the folder of a data set", "no shard is in it", "Check its name")
    if shards is None:
        return [one for _, one in sorted(found.items())]
    wanted = [whole_number("shards", number, 0, _MOST) for number in shards]
    for number in wanted:
        if number not in found:
            refuse("shards", f"numbers of the {len(found)} shards in {path}", f"{number} came", "Correct it")
    return [found[number] for number in wanted]


def _images(shards: list[Path], rng: Random | None) -> Iterator[dict[str, Any]]:
    if rng:
        rng.shuffle(shards)
    for path in shards:
        with shard_files(path) as images:
            keys = list(images)
            if rng:
                rng.shuffle(keys)
            for key in keys:
                yield _image(path, key, images[key])


def _image(path: Path, key: str, files: Files) -> dict[str, Any]:
    found = decoded({suffix: read() for suffix, read in files.items()}, path / key)
    if found["number"] != int(key):
        refuse(path / key, f"the record of image {int(key)}", f"that of {found['number']} came", "Mend it")
    return found
