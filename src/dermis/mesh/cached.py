"""Meshes kept on disk by the content of their files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, fields

import numpy as np

from dermis.disk import Arrays, stored
from dermis.mesh.mesh import Material, Mesh

_FORM = 1  # raise when `load_mesh` gives other results for the same file


def cached_mesh(data: bytes, options: str, load: Callable[[], Mesh]) -> Mesh:
    """The mesh that `load` makes of a file, kept on disk in the same way.

    data : the file, with all that the mesh is made of
    options : how it is read
    """
    arrays = [field.name for field in fields(Mesh) if field.name != "materials"]

    def make() -> Arrays:
        mesh = load()
        told = json.dumps([asdict(material) for material in mesh.materials]).encode()
        return {name: getattr(mesh, name) for name in arrays} | {"materials": np.frombuffer(told, np.uint8)}

    digest = hashlib.sha256(f"{_FORM} {options}".encode())
    digest.update(data)
    found = stored("meshes", digest.hexdigest()[:40], [*arrays, "materials"], make)
    materials = json.loads(found.pop("materials").tobytes())
    return Mesh(
        **found,
        materials=tuple(Material(one["name"], one["kind"], tuple(one["colour"])) for one in materials),
    )
