"""Reading of data sets: shards, and the files of each image. Nothing in them is trusted."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.output_encoding import Array, decode_output, decode_png
from dermis.apps.batch.records import PICTURE, RECORD, LandmarksRecord, Numbers, Record
from dermis.apps.batch.shard_formats import MANIFEST_NAME, TarMember, tar_members
from dermis.apps.batch.shards import EXPECTED, shard_index
from dermis.base.atomic_write import reason
from dermis.base.errors import DermisError, refuse
from dermis.base.quantities import whole_number
from dermis.base.reading import MOST_TEXT, named_path, opened, parse_json, read_file, understood
from dermis.images.sizes import MOST_BYTES
from dermis.scene.opencv import OpenCvCamera

Image = dict[str, Any]
"""Ground truth of an image by name, see `read_dataset`."""
Files = dict[str, Callable[[], bytes]]
"""Functions that read the files of an image, by suffix."""
_MOST_SHARDS = 10**9
_FILE_NAME = re.compile(r"(\d{9})\.([a-z0-9_]{1,40}(?:\.[a-z0-9]{1,10})?)")
_OUTPUT_NAME = re.compile(r"([a-z0-9_]+)\.(png|exr|npy)")
_NO_OUTPUTS = frozenset(("number", "picture", "parameters", "camera", "head_pose", "gaze", "landmarks"))


class LandmarkPoints(NamedTuple):
    """Landmarks of an image; NaN where one has no place.

    pixels : (n, 2), x to the right and y down, from the middle of the first pixel
    positions_mm : (n, 3), from the head's centre
    visible : (n,) whether nothing lies before it
    """

    pixels: NDArray[np.float64]
    positions_mm: NDArray[np.float64]
    visible: NDArray[np.bool_]


def read_dataset(
    path: str | Path, *, shards: Iterable[int] | None = None, shuffle: int | None = None
) -> Iterator[Image]:
    """Return the images of a data set that `dermis batch` has made, with their ground truth.

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


def decoded(files: Mapping[str, object], culprit: object = "") -> Image:
    """Return an image by its files, which are bytes by suffix as the library webdataset gives them.

    culprit : named in messages; the image's key where empty

    number, parameters : number of the image in the data set, and its sampled parameters by name
    picture : (h, w, 3 or 4) sRGB bytes
    camera : K, R and t as OpenCV has them
    head_pose, gaze : (3, 4) and (2, 3), as of `Observation`; gaze may be None
    landmarks : `LandmarkPoints` by the name of their set
    depth, normal, ... : the outputs of the data set, float32 or integers

    Raises DermisError where they are damaged.
    """
    named = culprit or files.get("__key__", "an image")
    data = {suffix: one for suffix, one in files.items() if not suffix.startswith("__")}
    shown, record = (_taken(data, suffix, named) for suffix in (PICTURE, RECORD))
    found = _decoded_record(record, f"{named}.{RECORD}")
    picture = found["picture"] = _decoded_picture(f"{named}.{PICTURE}", "", PICTURE, shown)
    if picture.dtype != np.uint8:
        refuse(named, "a picture of 8 bits", f"it has {picture.dtype}", "Fetch it again")
    for suffix, content in sorted(data.items()):
        match = _OUTPUT_NAME.fullmatch(suffix)
        if match is None or match[1] in _NO_OUTPUTS:
            refuse(named, "files of outputs", f".{suffix} is none", "Take it out")
        values = _decoded_picture(f"{named}.{suffix}", match[1], match[2], content)
        if values.shape[:2] != picture.shape[:2]:
            came = f".{suffix} has {values.shape[1]} x {values.shape[0]} pixels"
            refuse(named, "outputs of the picture's size", came, "Fetch it again")
        found[match[1]] = values
    return found


def read_record(data: bytes, culprit: object) -> Record:
    """Return the record of an image; its landmarks are not checked.

    Raises DermisError where it is damaged.
    """
    if len(data) > MOST_TEXT:
        refuse(culprit, "a record of an image", f"it has {len(data):,} bytes", "Fetch it again")
    record: Record = parse_json(data, culprit, "a record of an image")
    with _understood(culprit):
        if type(record["number"]) is not int:
            raise ValueError("its number is none")
        for name, value in record["parameters"].items():
            values = value if isinstance(value, list) else [value]
            if not all(isinstance(one, int | float | str | None) for one in values):
                raise ValueError(f"{name[:60]!r} is neither a number nor a text")
        _decoded_pose(record)
        return record


@contextmanager
def shard_files(path: Path) -> Iterator[dict[str, Files]]:
    """Yield the files of each image of a shard by its key, in order, to be read inside the context.

    Raises DermisError for what is no shard, or was cut off.
    """
    if path.is_dir():
        names = sorted(one.name for one in path.iterdir())
        yield _by_key(path, {name: partial(_from_folder, path / name) for name in names})
        return
    with opened(path, EXPECTED) as file:
        with understood(path, EXPECTED):
            members = list(tar_members(file))
            if len({one.name for one in members}) != len(members):
                raise ValueError("two files in it have one name")
        yield _by_key(path, {one.name: partial(_from_tar, path, file, one) for one in members})


def _by_key(path: Path, files: Files) -> dict[str, Files]:
    if MANIFEST_NAME not in files:
        refuse(path, EXPECTED, "its end is missing", "Fetch it again, or have it drawn again")
    found: dict[str, Files] = {}
    for name, read in files.items():
        match = _FILE_NAME.fullmatch(name)
        if match:
            found.setdefault(match[1], {})[match[2]] = read
        elif name != MANIFEST_NAME:
            came = f"it holds {name[:60]!r}"
            refuse(path, f"{EXPECTED} with files such as 000000012.png", came, "Take it out")
    return dict(sorted(found.items()))


def _from_folder(path: Path) -> bytes:
    return read_file(path, "a file of a shard", MOST_BYTES)


def _from_tar(path: Path, file: BinaryIO, member: TarMember) -> bytes:
    if member.size > MOST_BYTES:
        came = f"{member.name} has {member.size:,} bytes"
        refuse(path, f"files of at most {MOST_BYTES:,} bytes", came, "Have it drawn again")
    file.seek(member.place)
    data = file.read(member.size)
    if len(data) != member.size:
        refuse(path, EXPECTED, "it is cut off", "Fetch it again, or have it drawn again")
    return data


def _chosen(path: Path, shards: Iterable[int] | None) -> list[Path]:
    """Return the shards to read, by number."""
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
    wanted = [whole_number("shards", number, 0, _MOST_SHARDS) for number in shards]
    for number in wanted:
        if number not in found:
            refuse("shards", f"numbers of the {len(found)} shards in {path}", f"{number} came", "Correct it")
    return [found[number] for number in wanted]


def _images(shards: list[Path], rng: Random | None) -> Iterator[Image]:
    if rng:
        rng.shuffle(shards)
    for path in shards:
        with shard_files(path) as images:
            keys = list(images)
            if rng:
                rng.shuffle(keys)
            for key in keys:
                found = decoded({suffix: read() for suffix, read in images[key].items()}, path / key)
                if found["number"] != int(key):
                    came = f"that of {found['number']} came"
                    refuse(path / key, f"the record of image {int(key)}", came, "Mend it")
                yield found


def _taken(files: dict[str, object], suffix: str, culprit: object) -> bytes:
    content = files.pop(suffix, None)
    if not isinstance(content, bytes):
        refuse(culprit, "an image of a data set", f"its .{suffix} is missing", "Fetch it again")
    return content


def _decoded_record(data: bytes, culprit: object) -> Image:
    record = read_record(data, culprit)
    with _understood(culprit):
        landmarks = {name: _landmarks(one) for name, one in record["landmarks"].items()}
    about = {"number": record["number"], "parameters": record["parameters"]}
    return about | _decoded_pose(record) | {"landmarks": landmarks}


def _decoded_pose(record: Record) -> Image:
    """Return the arrays of camera, head pose and gaze."""
    camera, gaze = record["camera"], record["gaze"]
    K, R, t = _array(camera["K"], (3, 3)), _array(camera["R"], (3, 3)), _array(camera["t"], (3,))
    return {
        "camera": OpenCvCamera(K, R, t),
        "head_pose": _array(record["head_pose"], (3, 4)),
        "gaze": None if gaze is None else _array(gaze, (2, 3)),
    }


def _landmarks(record: LandmarksRecord) -> LandmarkPoints:
    if not all(isinstance(one, bool) for one in record["visible"]):
        raise ValueError("whether landmarks are visible is told otherwise than by true and false")
    visible = np.array(record["visible"], bool)
    pixels = _array(record["pixels"], (len(visible), 2))
    return LandmarkPoints(pixels, _array(record["positions_mm"], (len(visible), 3)), visible)


def _array(values: Numbers, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return numbers as an array, NaN where there is null."""
    flat: Sequence[object] = values if isinstance(values, list) else [values]
    while flat and isinstance(flat[0], list):
        flat = [one for row in flat if isinstance(row, list) for one in row]
    if any(isinstance(one, str | bool) for one in flat):
        raise ValueError("it has texts for numbers")
    found = np.array(values, np.float64)
    if found.shape != shape and (found.size or 0 not in shape):
        raise ValueError(f"an array has shape {found.shape}, not {shape}")
    return found.reshape(shape)


def _understood(culprit: object) -> AbstractContextManager[None]:
    """Return a context that refuses a record of another form."""
    return understood(culprit, "a record of an image", KeyError, TypeError, AttributeError)


def _decoded_picture(culprit: object, name: str, kind: str, data: object) -> Array:
    try:
        if not isinstance(data, bytes):
            raise TypeError("it is not given as bytes")
        return decode_output(name, kind, data) if name else decode_png(data)
    except DermisError as fault:  # a package is missing
        raise DermisError(f"{culprit}: {fault}") from fault
    except Exception as fault:  # decoders raise anything for damaged data
        came = f"it cannot be decoded ({reason(fault)})"
        refuse(culprit, f"a picture as {kind}", came, "Fetch it again, or have it drawn again")
