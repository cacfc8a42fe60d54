"""Precomputed tables for the package's own head, written by `tools/human_tables.py`."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.mesh.mesh import Mesh

_FINGERPRINT_ARRAY_NAME = "fingerprint"
_COMPARED_VERTEX_COUNT = 64  # vertices whose positions are compared
_POSITION_TOLERANCE_MM = 1e-4  # processors differ in the last bits of a position


def shipped_arrays(mesh: Mesh, table_name: str, array_names: Sequence[str]) -> dict[str, NDArray[Any]] | None:
    """Return the arrays of a table that the package contains for a mesh; None if there is no such table.

    table_name : name of the table, which includes all parameters, except the mesh, that affect the arrays
    array_names : names of the arrays
    """
    file = resources.files(__package__).joinpath("data", table_file_name(mesh))
    if not file.is_file():
        return None
    with resources.as_file(file) as path, np.load(path) as stored:
        is_same = np.allclose(
            stored[_FINGERPRINT_ARRAY_NAME], position_fingerprint(mesh), rtol=0.0, atol=_POSITION_TOLERANCE_MM
        )
        members = [f"{table_name} {name}" for name in array_names]
        if not is_same or not all(member in stored for member in members):
            return None
        return {name: stored[member] for name, member in zip(array_names, members, strict=True)}


def table_file_name(mesh: Mesh) -> str:
    """Return the name of the package's file of precomputed tables for a mesh."""
    return f"{mesh.topology_key.hex()[:16]}.npz"


def table_file_arrays(mesh: Mesh, tables: dict[str, dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Return the arrays to store in the file of precomputed tables for a mesh, by their names in the file.

    These are the arrays of all tables, and the position fingerprint by which `shipped_arrays` recognises the
    mesh.

    tables : dictionary from table names to the arrays of each table, as `shipped_arrays` returns them
    """
    members = {f"{table} {name}": array for table, one in tables.items() for name, array in one.items()}
    return {_FINGERPRINT_ARRAY_NAME: position_fingerprint(mesh), **members}


def position_fingerprint(mesh: Mesh) -> Doubles:
    """Return numbers that identify the vertex positions of a mesh [mm].

    These are the mean and the root mean square of all positions, followed by some of the positions. Heads of
    the same topology have different numbers if some of their vertices differ by a millimetre.
    """
    positions = mesh.positions.astype(np.float64)
    sample = positions[:: max(len(positions) // _COMPARED_VERTEX_COUNT, 1)]
    return np.concatenate([positions.mean(axis=0), np.sqrt((positions**2).mean(axis=0)), sample.ravel()])
