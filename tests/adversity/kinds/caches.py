"""Damaged cache files: they are rebuilt bit for bit."""

from __future__ import annotations

from contextlib import chdir
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from adversity.campaign import caches
from adversity.case import Input, Plan
from adversity.checks import check_equal
from adversity.damage import scarred
from adversity.kind import Kind
from adversity.kinds.meshes import moving_files

_FOLDER = "cache"
_SOURCE = np.arange(12.0)


def _made() -> dict[str, Any]:
    return {"points": np.linspace(0.0, 1.0, 300).reshape(100, 3), "faces": np.arange(60, dtype=np.int32)}


def _fill() -> None:
    """Fill all caches, as a first run does."""
    from dermis.base.disk import cached_arrays
    from dermis.scene.heads import load_head

    cached_arrays(_SOURCE, "campaign", list(_made()), _made)
    Path("head.glb").write_bytes(moving_files()[1])
    load_head("head.glb")


@cache
def _stored() -> dict[str, bytes]:
    """Return the files of the filled caches, and the head."""
    with TemporaryDirectory() as folder, caches(Path(folder) / _FOLDER), chdir(folder):
        _fill()
        found = [one for one in Path(folder).rglob("*") if one.is_file()]
        return {str(one.relative_to(folder)): one.read_bytes() for one in found}


@cache
def _head() -> Any:
    from dermis.scene.heads import load_head

    with TemporaryDirectory() as folder, caches(Path(folder) / _FOLDER):
        path = Path(folder) / "head.glb"
        path.write_bytes(moving_files()[1])
        return load_head(path)


def _sound(rng: Random) -> Input:
    changed = tuple(name for name in _stored() if name.startswith(_FOLDER))
    return Input(_stored(), {"error_subjects": []}, changed)


def _take(plan: Plan) -> None:
    """Check twice that results are unchanged with a damaged cache, and that it is repaired."""
    with caches(Path.cwd() / _FOLDER):
        for _ in range(2):
            _check_arrays()
            _check_head()


def _check_arrays() -> None:
    from dermis.base.disk import cached_arrays

    arrays = cached_arrays(_SOURCE, "campaign", list(_made()), _made)
    for name, truth in _made().items():
        check_equal(arrays[name], truth, f"cached {name}")


def _check_head() -> None:
    from dermis.scene.heads import load_head

    head, truth = load_head("head.glb"), _head()
    check_equal(head.mesh.positions, truth.mesh.positions, "cached positions")
    check_equal(head.mesh.triangles, truth.mesh.triangles, "cached triangles")
    check_equal(head.rig.skeleton.weight, truth.rig.skeleton.weight, "cached weights of bones")


KINDS = (Kind("cache", _sound, _take, scarred, share=10),)
