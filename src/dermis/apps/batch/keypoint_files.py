"""Export of the pictures and landmarks of data sets to the formats of COCO keypoints and 300-W."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from dermis.apps.batch.datasheet import DESCRIPTION_FILE
from dermis.apps.batch.reader import ImageFields, read_record, record_fields, select_shards, shard_files
from dermis.apps.batch.records import PICTURE_SUFFIX, RECORD_SUFFIX
from dermis.base.atomic_write import refuse_output, temporary_folder
from dermis.base.errors import refuse
from dermis.base.reading import checked_path, parse_json, read_text

KeypointFormat = Literal["coco", "pts"]
_COCO_HIDDEN, _COCO_VISIBLE = 1, 2  # keypoint flags of COCO; 0 is "not labelled"
_OCCLUDED = 2
_UNKNOWN_SPLIT = "all"  # folder of images without a split, from earlier versions


class _Picture(NamedTuple):
    """Picture file of an image, with its ground truth."""

    key: str
    png: bytes
    fields: ImageFields


def export_keypoints(
    dataset: str | Path, output: str | Path, format: KeypointFormat = "coco", landmarks: str = "ibug-68"
) -> Path:
    """Export the pictures and landmarks of a data set for tools that read COCO keypoints or 300-W.

    Parameters
    ----------
    dataset : str or Path
        Folder of a data set that `dermis batch` has written.
    output : str or Path
        Folder to write, which must not exist.
    format : {"coco", "pts"}
        "coco" writes the pictures to the folders train, val and test, and a file
        annotations/face_keypoints_SPLIT.json for each of them. The box is "face". The flag of a keypoint is 2
        where it is visible, 1 where hair or the mesh hides it, and 0 outside the picture. "pts" writes a file
        .pts beside each picture; its coordinates start at 1, as in 300-W.
    landmarks : str
        Name of the landmark set.

    Returns
    -------
    Path
        The folder `output`.

    Raises
    ------
    DermisError
        For a landmark set that the data set does not have, an output folder that exists, and damaged shards.

    Examples
    --------
    >>> import dermis.dataset
    >>> dermis.dataset.export_keypoints("faces", "faces-coco", "coco")  # doctest: +SKIP
    """
    source, target = checked_path(dataset, "a data set"), checked_path(output, "a folder to write")
    if format not in ("coco", "pts"):
        refuse("format", "coco or pts", f"got {format!r}", "Choose one")
    if target.exists():
        refuse(target, "a folder that does not exist", "it exists", "Choose another folder")
    names, by_split = _landmark_names(source, landmarks), dict[str, list[dict[str, Any]]]()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        refuse_output(target, fault)
    with temporary_folder(target) as unfinished:
        for picture in _pictures(source, landmarks):
            split = picture.fields["split"] or _UNKNOWN_SPLIT
            folder = unfinished / split
            folder.mkdir(exist_ok=True)
            (folder / f"{picture.key}.png").write_bytes(picture.png)
            if format == "pts":
                text = _pts_text(picture, landmarks)
                (folder / f"{picture.key}.pts").write_text(text, encoding="ascii")
            else:
                by_split.setdefault(split, []).append(_coco_entry(picture, landmarks))
        for split, entries in by_split.items():
            _write_coco(unfinished / "annotations" / f"face_keypoints_{split}.json", entries, names)
        unfinished.replace(target)
    return target


def _pictures(dataset_folder: Path, landmark_set: str) -> Iterator[_Picture]:
    for path in select_shards(dataset_folder, None):
        with shard_files(path) as images:
            for key, files in images.items():
                record = read_record(files[RECORD_SUFFIX](), path / key)
                fields = record_fields(record, path / key)
                if landmark_set not in fields["landmarks"]:
                    known = ", ".join(fields["landmarks"]) or "none"
                    refuse("landmarks", f"one of {known}", f"got {landmark_set!r}", "Choose one")
                yield _Picture(key, files[PICTURE_SUFFIX](), fields)


def _landmark_names(dataset_folder: Path, landmark_set: str) -> list[str]:
    path = dataset_folder / DESCRIPTION_FILE
    description = parse_json(read_text(path, "the description of a data set").encode(), path, "a description")
    return [str(name) for name in description.get("landmarks", {}).get(landmark_set, [])]


def _pts_text(picture: _Picture, landmark_set: str) -> str:
    """Return the .pts file of a picture; refuse landmarks that the lens does not image."""
    pixels = picture.fields["landmarks"][landmark_set].pixels
    if not np.isfinite(pixels).all():
        actual = f"the lens images only some of image {picture.key}"
        refuse("landmarks", "pixels of all landmarks", actual, 'Choose format "coco", which can omit some')
    rows = "".join(f"{x + 1.0:.3f} {y + 1.0:.3f}\n" for x, y in pixels.tolist())
    return f"version: 1\nn_points: {len(pixels)}\n{{\n{rows}}}\n"


def _coco_entry(picture: _Picture, landmark_set: str) -> dict[str, Any]:
    """Return the COCO entries "image" and "annotation" of a picture, and the licence of the picture."""
    number, points = int(picture.key), picture.fields["landmarks"][landmark_set]
    width, height = _png_size(picture.png)
    x, y = points.pixels.T
    inside = (x > -0.5) & (x < width - 0.5) & (y > -0.5) & (y < height - 0.5)
    flags = np.where(points.visible & (points.occlusion != _OCCLUDED), _COCO_VISIBLE, _COCO_HIDDEN)
    flags = np.where(inside, flags, 0)
    keypoints = np.column_stack([np.where(flags > 0, points.pixels.T, 0.0).T, flags])
    boxes = picture.fields["boxes"]
    if boxes is None:
        boxes = {"face": (np.nanmin(x), np.nanmin(y), np.nanmax(x), np.nanmax(y))}
    left, top, right, bottom = boxes["face"]
    # COCO measures from the corner of the picture, and has no word for a box that the lens does not image
    box = np.nan_to_num([left + 0.5, top + 0.5, right - left, bottom - top])
    annotation = {
        "id": number + 1,
        "image_id": number + 1,
        "category_id": 1,
        "iscrowd": 0,
        "bbox": np.round(box, 3).tolist(),
        "area": round(float(box[2] * box[3]), 3),
        "num_keypoints": int((flags > 0).sum()),
        "keypoints": np.round(keypoints, 3).ravel().tolist(),
    }
    image = {"id": number + 1, "file_name": f"{picture.key}.png", "width": width, "height": height}
    return {"image": image, "annotation": annotation, "licence": picture.fields["licence"]}


def _png_size(png_bytes: bytes) -> tuple[int, int]:
    """Return width and height of a PNG file [pixel]."""
    return int.from_bytes(png_bytes[16:20]), int.from_bytes(png_bytes[20:24])


def _write_coco(path: Path, entries: list[dict[str, Any]], names: list[str]) -> None:
    licences = list(dict.fromkeys(entry["licence"] for entry in entries))
    for entry in entries:
        entry["image"]["license"] = licences.index(entry["licence"]) + 1
    content = {
        "info": {"description": "rendered by dermis"},
        "licenses": [{"id": k, "name": name, "url": ""} for k, name in enumerate(licences, 1)],
        "categories": [
            {"id": 1, "name": "face", "supercategory": "person", "keypoints": names, "skeleton": []}
        ],
        "images": [entry["image"] for entry in entries],
        "annotations": [entry["annotation"] for entry in entries],
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content), encoding="utf-8")
