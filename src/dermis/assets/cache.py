"""Atlases on disk, by the content of the mesh they were made for."""

from __future__ import annotations

import contextlib
import hashlib
import os
import zipfile
from dataclasses import fields
from pathlib import Path

import numpy as np

from dermis.assets.atlas import GUTTER, Atlas, build_atlas
from dermis.assets.folders import cache_folder
from dermis.assets.mesh import Mesh

_FORM = 2  # raise when `build_atlas` gives other results for the same mesh
_MOST_BYTES = 2 << 30


def cached_atlas(mesh: Mesh, size: int) -> Atlas:
    """`build_atlas`, read back from disk when it was made before; the disk may fail without harm."""
    path = cache_folder() / "atlas" / f"{_key(mesh, size)}.npz"
    with contextlib.suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        with path.open("rb") as file, np.load(file) as stored:
            atlas = Atlas(**{field.name: stored[field.name] for field in fields(Atlas)})
        path.touch()
        return atlas
    atlas = build_atlas(mesh, size)
    with contextlib.suppress(OSError):
        _store(path, atlas)
        _prune(path.parent)
    return atlas


def _key(mesh: Mesh, size: int) -> str:
    digest = hashlib.sha256(f"{_FORM} {GUTTER} {size}".encode())
    digest.update(repr([material.kind for material in mesh.materials]).encode())
    for array in (mesh.material, mesh.uv, mesh.triangles, mesh.dpdu, mesh.dpdv):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:40]


def _store(path: Path, atlas: Atlas) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.part")
    try:
        with unfinished.open("wb") as file:
            np.savez(file, **{field.name: getattr(atlas, field.name) for field in fields(Atlas)})
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _prune(folder: Path) -> None:
    """Forget the atlases used longest ago while the folder holds more than its share."""
    stored = sorted(folder.glob("*.npz"), key=lambda p: p.stat().st_mtime, reverse=True)
    total = 0
    for path in stored:
        total += path.stat().st_size
        if total > _MOST_BYTES:
            path.unlink(missing_ok=True)
