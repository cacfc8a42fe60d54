"""Reader of data sets, whose files are treated as untrusted input."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, BinaryIO, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.image_facts import SPLIT_NAMES
from dermis.apps.batch.output_encoding import Array, decode_output, decode_png
from dermis.apps.batch.records import (
    PICTURE_SUFFIX,
    RECORD_SUFFIX,
    CameraRecord,
    LandmarksRecord,
    NestedNumbers,
    Record,
)
from dermis.apps.batch.shard_formats import MANIFEST_NAME, TarMember, tar_members
from dermis.apps.batch.shards import SHARD_DESCRIPTION, shard_index
from dermis.base.errors import DermisError, error_text, refuse
from dermis.base.quantities import checked_integer
from dermis.base.reading import (
    MAX_TEXT_BYTES,
    checked_path,
    open_regular_file,
    parse_json,
    read_file,
    refuse_parse_errors,
)
from dermis.base.renamed import renamed_keywords
from dermis.images.sizes import MAX_FILE_BYTES
from dermis.scene.opencv import OpenCvCamera

ImageFields = dict[str, Any]
"""Ground truth of an image by name, see `read_dataset`."""
FileReaders = dict[str, Callable[[], bytes]]
"""Functions that read the files of an image, by name or suffix."""
_RESTORE_ADVICE = "Copy or download it again, or render the shard again"
_MAX_SHARD_NUMBER = 10**9
_IMAGE_FILE_PATTERN = re.compile(r"(\d{9})\.([a-z0-9_]{1,40}(?:\.[a-z0-9]{1,10})?)")
_OUTPUT_FILE_PATTERN = re.compile(r"([a-z0-9_]+)\.(png|exr|npy)")
FIELDS_WITHOUT_OUTPUTS = frozenset(
    (
        *("number", "picture", "parameters", "camera", "head_pose", "gaze", "landmarks", "skin_tone"),
        *("gaze_error_deg", "boxes", "split", "licence", "rig"),
    )
)
"""Keys of an image that are not names of outputs."""
_CAMERA_SHAPES: tuple[tuple[Literal["K", "R", "t"], tuple[int, ...]], ...] = (
    ("K", (3, 3)),
    ("R", (3, 3)),
    ("t", (3,)),
)
UNKNOWN_OCCLUSION = 255
"""Occlusion of landmarks in data sets of earlier versions, which do not state it."""


class LandmarkPoints(NamedTuple):
    """Landmarks of an image; NaN for a landmark without a position.

    pixels : (n, 2) positions in the picture, x to the right and y down, from the centre of the first pixel
    positions_mm : (n, 3) positions relative to the head's centre [mm]
    visible : (n,) whether the mesh does not occlude the landmark
    occlusion : (n,) 0 where the landmark is visible, 1 where hair or beard partially occludes it, 2 where
        hair, beard or the mesh occludes it, and outside the picture; 255 in data sets of earlier versions
    """

    pixels: NDArray[np.float64]
    positions_mm: NDArray[np.float64]
    visible: NDArray[np.bool_]
    occlusion: NDArray[np.uint8]


def read_dataset(
    path: str | Path, *, shards: Iterable[int] | None = None, shuffle: int | None = None
) -> Iterator[ImageFields]:
    """Return the images of a data set rendered by `dermis batch`, with their ground truth.

    Parameters
    ----------
    path : str or Path
        Folder of the data set, or one of its shards.
    shards : iterable of int, optional
        Numbers of the shards to read, such as `range(rank, 100, workers)`; all by default.
    shuffle : int, optional
        Seed for a random order of the shards, and of the images within each; in order by default.

    Returns
    -------
    iterator of dict
        Each image has one key for each output of the data set, such as "depth" or "normal", and these keys:
        "number"; "picture", sRGB bytes (h, w, 3 or 4); "parameters", by name, with None for parameters that
        the image does not use; "camera", with K, R and t in OpenCV's convention; "head_pose" (3, 4), rotation
        and translation [mm] from the head at rest to the camera; "gaze" (2, 3), unit vectors of the left and
        the right eye in camera axes, or None; "gaze_error_deg" (2,), angles between these vectors and the
        directions to the target of the spec, or None; "boxes", left, upper, right and lower edge of each box
        by name, or None; "landmarks", `LandmarkPoints` by the name of the set; "skin_tone", a dictionary that
        describes the colour of the skin, or None; "split", "train", "val" or "test" by person; and "licence".
        With [rig] in the spec there is also "rig", the cameras of all images of the same moment by name.
        "split" and "licence" are "" in data sets of earlier versions. `dermis.dataset.arrays` converts an
        image into arrays for batches.

    Raises
    ------
    DermisError
        For a folder without shards, and for truncated or damaged shards.

    Examples
    --------
    Write a shard of one image, and read it:

    >>> import json, tempfile
    >>> from pathlib import Path
    >>> import numpy as np, dermis
    >>> shard = Path(tempfile.mkdtemp(), "shard-00000")
    >>> shard.mkdir()
    >>> identity, pose = np.eye(3).tolist(), np.eye(3, 4).tolist()
    >>> record = {"number": 0, "parameters": {"camera.yaw_deg": 12.5}, "head_pose": pose, "gaze": None}
    >>> record |= {"camera": {"K": identity, "R": identity, "t": [0, 0, 600]}, "landmarks": {}}
    >>> _ = (shard / "000000000.json").write_text(json.dumps(record))
    >>> dermis.write_image(shard / "000000000.png", np.zeros((2, 4, 3), np.float32))
    >>> _ = (shard / "__whole__").write_text("{}")
    >>> for image in dermis.read_dataset(shard):
    ...     print(image["picture"].shape, image["parameters"]["camera.yaw_deg"])
    (2, 4, 3) 12.5
    """
    random = None if shuffle is None else Random(checked_integer("shuffle", shuffle, 0, 2**64))
    return _iterate_images(select_shards(checked_path(path, "a data set"), shards), random)


@renamed_keywords(culprit="error_subject")
def decode_image(files: Mapping[str, object], error_subject: object = "") -> ImageFields:
    """Return an image of a data set from the files of the image, with the keys that `read_dataset` lists.

    files : content of each file as bytes, by suffix, as the library webdataset provides them
    error_subject : name of the image in error messages; by default the image's key

    Raises DermisError for damaged files.
    """
    source = error_subject or files.get("__key__", "an image")
    data = {suffix: content for suffix, content in files.items() if not suffix.startswith("__")}
    encoded, record = (_pop_file(data, suffix, source) for suffix in (PICTURE_SUFFIX, RECORD_SUFFIX))
    name = f"{source}.{RECORD_SUFFIX}"
    image = record_fields(read_record(record, name), name)
    picture = image["picture"] = _decode_picture(f"{source}.{PICTURE_SUFFIX}", "", PICTURE_SUFFIX, encoded)
    if picture.dtype != np.uint8:
        refuse(source, "an 8-bit picture", f"it has {picture.dtype}", "Copy or download it again")
    for suffix, content in sorted(data.items()):
        match = _OUTPUT_FILE_PATTERN.fullmatch(suffix)
        if match is None or match[1] in FIELDS_WITHOUT_OUTPUTS:
            refuse(source, "files of outputs", f"found .{suffix}", "Remove it")
        values = _decode_picture(f"{source}.{suffix}", match[1], match[2], content)
        if values.shape[:2] != picture.shape[:2]:
            actual = f".{suffix} has {values.shape[1]} x {values.shape[0]} pixels"
            refuse(source, "outputs of the picture's size", actual, "Copy or download it again")
        image[match[1]] = values
    return image


def read_record(json_bytes: bytes, error_subject: object) -> Record:
    """Return the record of an image from the bytes of its JSON file, without checking the landmarks.

    error_subject : name of the file in error messages

    Raises DermisError if the record is damaged.
    """
    if len(json_bytes) > MAX_TEXT_BYTES:
        refuse(
            error_subject,
            "a record of an image",
            f"it has {len(json_bytes):,} bytes",
            "Copy or download it again",
        )
    record: Record = parse_json(json_bytes, error_subject, "a record of an image")
    with _refuse_malformed_record(error_subject):
        if type(record["number"]) is not int:
            raise ValueError("its number is not an integer")
        for name, value in record["parameters"].items():
            values = value if isinstance(value, list) else [value]
            if not all(isinstance(one, int | float | str | None) for one in values):
                raise ValueError(f"{name[:60]!r} is neither a number nor a text")
        _decode_pose(record)
        return record


@contextmanager
def shard_files(path: Path) -> Iterator[dict[str, FileReaders]]:
    """Open a shard, and yield a dictionary from image key (the image number with 9 digits) to image.

    Each image is a dictionary from file suffix to a function that reads the file. The functions can only be
    called inside the with block.

    Raises DermisError if the shard is truncated, or if the path is not a shard.
    """
    if path.is_dir():
        names = sorted(one.name for one in path.iterdir())
        yield _group_by_image(path, {name: partial(_read_folder_file, path / name) for name in names})
        return
    with open_regular_file(path, SHARD_DESCRIPTION) as file:
        with refuse_parse_errors(path, SHARD_DESCRIPTION):
            members = list(tar_members(file))
            if len({one.name for one in members}) != len(members):
                raise ValueError("two of its files have the same name")
        yield _group_by_image(path, {one.name: partial(_read_tar_member, path, file, one) for one in members})


def _group_by_image(path: Path, files: FileReaders) -> dict[str, FileReaders]:
    if MANIFEST_NAME not in files:
        refuse(path, SHARD_DESCRIPTION, "its end is missing", _RESTORE_ADVICE)
    images: dict[str, FileReaders] = {}
    for name, read in files.items():
        match = _IMAGE_FILE_PATTERN.fullmatch(name)
        if match:
            images.setdefault(match[1], {})[match[2]] = read
        elif name != MANIFEST_NAME:
            actual = f"it contains {name[:60]!r}"
            refuse(path, f"{SHARD_DESCRIPTION} with files such as 000000012.png", actual, "Remove that file")
    return dict(sorted(images.items()))


def _read_folder_file(path: Path) -> bytes:
    return read_file(path, "a file of a shard", MAX_FILE_BYTES)


def _read_tar_member(path: Path, tar_file: BinaryIO, member: TarMember) -> bytes:
    if member.size > MAX_FILE_BYTES:
        actual = f"{member.name} has {member.size:,} bytes"
        refuse(path, f"files of at most {MAX_FILE_BYTES:,} bytes", actual, "Render the shard again")
    tar_file.seek(member.offset)
    data = tar_file.read(member.size)
    if len(data) != member.size:
        refuse(path, SHARD_DESCRIPTION, "it is truncated", _RESTORE_ADVICE)
    return data


def select_shards(path: Path, shards: Iterable[int] | None) -> list[Path]:
    """Return the paths of the shards to read: those in the folder `path`, or `path` if it is itself a shard.

    shards : numbers of the shards; None for all shards of the data set
    """
    if shard_index(path) is not None or path.suffix == ".tar":
        return [path]
    try:
        entries = [(shard_index(entry), entry) for entry in sorted(path.iterdir())]
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        actual = f"it cannot be read ({getattr(fault, 'strerror', None) or fault})"
        refuse(path, "the folder of a data set", actual, "Check its name")
    by_number = {index: entry for index, entry in entries if index is not None}
    if not by_number:
        refuse(path, "the folder of a data set", "it contains no shard", "Check its name")
    if shards is None:
        return [shard for _, shard in sorted(by_number.items())]
    numbers = [checked_integer("shards", number, 0, _MAX_SHARD_NUMBER) for number in shards]
    for number in numbers:
        if number not in by_number:
            expected = f"numbers of the {len(by_number)} shards in {path}"
            refuse("shards", expected, f"got {number}", "Correct it")
    return [by_number[number] for number in numbers]


def _iterate_images(shards: list[Path], shuffle_rng: Random | None) -> Iterator[ImageFields]:
    if shuffle_rng:
        shuffle_rng.shuffle(shards)
    for path in shards:
        with shard_files(path) as images:
            keys = list(images)
            if shuffle_rng:
                shuffle_rng.shuffle(keys)
            for key in keys:
                image = decode_image({suffix: read() for suffix, read in images[key].items()}, path / key)
                if image["number"] != int(key):
                    actual = f"got that of {image['number']}"
                    refuse(path / key, f"the record of image {int(key)}", actual, _RESTORE_ADVICE)
                yield image


def _pop_file(files: dict[str, object], suffix: str, error_subject: object) -> bytes:
    content = files.pop(suffix, None)
    if not isinstance(content, bytes):
        refuse(
            error_subject, "an image of a data set", f"its .{suffix} is missing", "Copy or download it again"
        )
    return content


def record_fields(record: Record, error_subject: object) -> ImageFields:
    """Return the ground truth of an image from its record, with the keys that `read_dataset` lists.

    Raises DermisError if the record is malformed.
    """
    with _refuse_malformed_record(error_subject):
        landmarks = {name: _decode_landmarks(one) for name, one in record["landmarks"].items()}
        if record.get("split", "") not in ("", *SPLIT_NAMES):  # exports use it as the name of a folder
            raise ValueError(f"its split is none of {', '.join(SPLIT_NAMES)}")
    image = {"number": record["number"], "parameters": record["parameters"]}
    image["skin_tone"] = record.get("skin_tone")
    image |= {name: str(record.get(name, "")) for name in ("split", "licence")}
    return image | _decode_pose(record) | {"landmarks": landmarks}


def _decode_pose(record: Record) -> ImageFields:
    """Return the arrays of camera, head pose, gaze and boxes in a record."""
    gaze = record["gaze"]
    errors, boxes = record.get("gaze_error_deg"), record.get("boxes")  # missing in old data sets
    rig = {name: _decode_camera(one) for name, one in record.get("rig", {}).items()}
    return {
        "camera": _decode_camera(record["camera"]),
        **({"rig": rig} if rig else {}),
        "head_pose": _to_array(record["head_pose"], (3, 4)),
        "gaze": None if gaze is None else _to_array(gaze, (2, 3)),
        "gaze_error_deg": None if errors is None else _to_array(errors, (2,)),
        "boxes": None if boxes is None else {name: _to_array(box, (4,)) for name, box in boxes.items()},
    }


def _decode_camera(record: CameraRecord) -> OpenCvCamera:
    K, R, t = (_to_array(record[name], shape) for name, shape in _CAMERA_SHAPES)
    return OpenCvCamera(K, R, t)


def _decode_landmarks(record: LandmarksRecord) -> LandmarkPoints:
    if not all(isinstance(one, bool) for one in record["visible"]):
        raise ValueError("the visibility of a landmark is neither true nor false")
    visible = np.array(record["visible"], bool)
    pixels = _to_array(record["pixels"], (len(visible), 2))
    unknown: NestedNumbers = [UNKNOWN_OCCLUSION] * len(visible)
    levels = _to_array(record.get("occlusion", unknown), (len(visible),))
    if not np.isin(levels, (*range(3), UNKNOWN_OCCLUSION)).all():
        raise ValueError("the occlusion of a landmark is not 0, 1 or 2")
    positions = _to_array(record["positions_mm"], (len(visible), 3))
    return LandmarkPoints(pixels, positions, visible, levels.astype(np.uint8))


def _to_array(nested_numbers: NestedNumbers, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return nested lists of numbers as an array, with NaN for null."""
    flat: Sequence[object] = nested_numbers if isinstance(nested_numbers, list) else [nested_numbers]
    while flat and isinstance(flat[0], list):
        flat = [one for row in flat if isinstance(row, list) for one in row]
    if any(isinstance(one, str | bool) for one in flat):
        raise ValueError("it has texts in place of numbers")
    array = np.array(nested_numbers, np.float64)
    if array.shape != shape and (array.size or 0 not in shape):
        raise ValueError(f"an array has shape {array.shape}, not {shape}")
    return array.reshape(shape)


def _refuse_malformed_record(error_subject: object) -> AbstractContextManager[None]:
    """Return a context manager that turns errors of a malformed record into a DermisError.

    error_subject : name of the file in error messages
    """
    return refuse_parse_errors(error_subject, "a record of an image", KeyError, TypeError, AttributeError)


def _decode_picture(
    error_subject: object, output_name: str, picture_format: str, file_content: object
) -> Array:
    try:
        if not isinstance(file_content, bytes):
            raise TypeError("its content is not of type bytes")
        return (
            decode_output(output_name, picture_format, file_content)
            if output_name
            else decode_png(file_content)
        )
    except DermisError as fault:  # a package is missing
        raise DermisError(f"{error_subject}: {fault}") from fault
    except Exception as fault:  # decoders raise anything for damaged data
        actual = f"it cannot be decoded ({error_text(fault)})"
        refuse(error_subject, f"a picture as {picture_format}", actual, _RESTORE_ADVICE)
