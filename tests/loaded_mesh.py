"""Meshes of files without their rigs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dermis.formats.load import load_rigged
from dermis.mesh.mesh import Mesh


def load_mesh(path: str | Path, **options: Any) -> Mesh:
    return load_rigged(path, **options).mesh
