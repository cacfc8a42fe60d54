"""Atlases and occlusion on disk, by the content of the mesh they were made for."""

from __future__ import annotations

import contextlib
import hashlib
import os
import zipfile
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import GUTTER, REACH_MM, Atlas, build_atlas
from dermis.assets.folders import cache_folder
from dermis.assets.mesh import Mesh

Array = NDArray[Any]
Arrays = dict[str, Array]
_FORM = 3  # raise when `build_atlas` gives other results for the same mesh
_MOST_BYTES = 2 << 30


def cached_atlas(mesh: Mesh, size: int, layout: str = "mesh", reach_mm: float = REACH_MM) -> Atlas:
    """`build_atlas`, read back from disk when it was made before; the disk may fail without harm."""
    names = [field.name for field in fields(Atlas)]

    def make() -> Arrays:
        atlas = build_atlas(mesh, size, layout, reach_mm)
        return {name: getattr(atlas, name) for name in names}

    return Atlas(**_kept("atlas", _key(mesh, size, layout, reach_mm), names, make))


def cached_occlusion(mesh: Mesh, atlas: Atlas, form: str, bake: Callable[[], Array]) -> Array:
    """What `bake` returns for a mesh and its atlas, kept on disk in the same way.

    form : everything else that the result depends on
    """
    return _baked("occlusion", mesh, atlas, form, bake)


def cached_opposite(mesh: Mesh, atlas: Atlas, form: str, find: Callable[[], Array]) -> Array:
    """What `find` returns of thin parts, kept on disk in the same way."""
    return _baked("opposite", mesh, atlas, form, find)


def _baked(folder: str, mesh: Mesh, atlas: Atlas, form: str, bake: Callable[[], Array]) -> Array:
    digest = hashlib.sha256(f"{_key(mesh, atlas.size)} {form}".encode())
    for array in (mesh.positions, mesh.normals, atlas.place, np.packbits(atlas.own)):
        digest.update(np.ascontiguousarray(array).tobytes())
    return _kept(folder, digest.hexdigest()[:40], ["open"], lambda: {"open": bake()})["open"]


def _kept(folder: str, key: str, names: list[str], make: Callable[[], Arrays]) -> Arrays:
    """The arrays `names` from the file of that key, or made and stored."""
    path = cache_folder() / folder / f"{key}.npz"
    with contextlib.suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        with path.open("rb") as file, np.load(file) as stored:
            arrays = {name: stored[name] for name in names}
        path.touch()
        return arrays
    arrays = make()
    with contextlib.suppress(OSError):
        _store(path, arrays)
        _prune(path.parent)
    return arrays


def _key(mesh: Mesh, size: int, layout: str = "mesh", reach_mm: float = REACH_MM) -> str:
    digest = hashlib.sha256(f"{_FORM} {GUTTER} {size} {layout} {reach_mm}".encode())
    digest.update(repr([material.kind for material in mesh.materials]).encode())
    for array in (mesh.material, mesh.positions, mesh.uv, mesh.triangles, mesh.dpdu, mesh.dpdv, mesh.point):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:40]


def _store(path: Path, arrays: Arrays) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.part")
    try:
        with unfinished.open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]  # its last parameter is no array
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _prune(folder: Path) -> None:
    """Forget the files used longest ago while the folder holds more than its share."""
    stored = sorted(folder.glob("*.npz"), key=lambda p: p.stat().st_mtime, reverse=True)
    total = 0
    for path in stored:
        total += path.stat().st_size
        if total > _MOST_BYTES:
            path.unlink(missing_ok=True)
