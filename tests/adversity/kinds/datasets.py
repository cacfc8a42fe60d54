"""Shards of data sets, as tar files and as folders, and shards that a run would reuse."""

from __future__ import annotations

import io
import tarfile
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from adversity.case import WRONG, FoundError, Input, Plan
from adversity.checks import check_finite
from adversity.damage import damaged, scarred
from adversity.kind import Kind
from small_observation import small_spec, write_all

_ENCODINGS = "png", "exr", "npy"
_SHARD = "shard-00000"


@cache
def _shard(form: str, encoding: str) -> Mapping[str, bytes]:
    """Return the files of a data set of two images."""
    with TemporaryDirectory() as folder:
        write_all(Path(folder), small_spec(count=2, format=form, encoding=encoding))
        files = (path for path in sorted(Path(folder).rglob("*")) if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def _sound_tar(rng: Random) -> Input:
    return Input(_shard("webdataset", rng.choice(_ENCODINGS)), {"file": f"{_SHARD}.tar"})


def _sound_folder(rng: Random) -> Input:
    return Input(_shard("folder", rng.choice(_ENCODINGS)), {"file": _SHARD, "error_subjects": [_SHARD]})


def _damaged_inside(sound: Input, rng: Random) -> Input:
    """Return a valid tar file with one damaged member, or sometimes with damaged bytes."""
    if rng.random() < 0.2:
        return damaged(sound, rng)
    ((name, data),) = sound.files.items()
    with tarfile.open(fileobj=io.BytesIO(data)) as old:
        held = {one.name: old.extractfile(one).read() for one in old.getmembers()}  # type: ignore[union-attr]
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w", format=tarfile.USTAR_FORMAT) as new:
        for inner, content in damaged(Input(held, {}), rng).files.items():
            head = tarfile.TarInfo(inner)
            head.size = len(content)
            new.addfile(head, io.BytesIO(content))
    return replace(sound, files={name: made.getvalue()})


def _take(plan: Plan) -> None:
    """Read the whole data set."""
    import dermis

    for found in dermis.read_dataset(plan["file"]):
        landmarks = found.pop("landmarks")
        check_finite(found, "image")
        for points in landmarks.values():  # NaN is a landmark without a place
            if not len(points.pixels) == len(points.positions_mm) == len(points.visible):
                raise FoundError(WRONG, "landmarks have several lengths")


def _take_whole(plan: Plan) -> None:
    """Resume a run: a shard that counts as complete is unchanged."""
    from dermis.apps.batch.shards import is_intact, list_shards

    spec = small_spec(count=2, format=plan["form"], encoding="png")
    if is_intact(Path(), list_shards(spec)[0], spec):
        for name, data in _shard(plan["form"], "png").items():
            if Path(name).read_bytes() != data:
                raise FoundError(WRONG, f"{name} counts as whole and is not")


def _sound_whole(rng: Random) -> Input:
    form = rng.choice(("webdataset", "folder"))
    return Input(_shard(form, "png"), {"form": form, "error_subjects": []})


KINDS = (
    Kind("shards", _sound_tar, _take, _damaged_inside),
    Kind("shard-folders", _sound_folder, _take, damaged, share=5),
    Kind("whole-shards", _sound_whole, _take_whole, scarred, share=5),
)
