"""Length unit of mesh files: stated by the user or the format, else guessed from the size."""

from __future__ import annotations

from dataclasses import replace
from math import log
from pathlib import Path

import numpy as np

from dermis.base.arrays import Floats, Ints
from dermis.base.errors import refuse
from dermis.formats.load import RiggedMesh
from dermis.formats.parts import default_unit_mm
from dermis.mesh.mesh import Mesh
from dermis.mesh.skull import MAX_ELONGATION, is_standing_figure, principal_sizes

SUFFIXES_WITHOUT_UNIT = (".obj", ".ply", ".stl")
"""Suffixes of formats that do not state a unit."""
COMMON_UNITS_MM = (1.0, 10.0, 25.4, 100.0, 1000.0)
_ACCEPTED_SIZE_RANGE_MM = (1.0, 3000.0)  # smallest and largest accepted size
# sizes in units of the file for which the unit is assumed to be the millimetre
_SIZE_RANGE_OF_MM_FILES = (100.0, 1000.0)
_TYPICAL_FIGURE_MM, _TYPICAL_HEAD_MM, _TYPICAL_HAND_MM = 1700.0, 270.0, 150.0  # typical sizes
_MAX_FLATNESS = 0.25  # thickness relative to length below which a mesh is a patch of skin or a hand
_INCH_MM = 25.4
_INCH_LOG_SIZE_PENALTY = {
    _TYPICAL_FIGURE_MM: 0.4,
    _TYPICAL_HEAD_MM: 0.4,
    _TYPICAL_HAND_MM: 9.0,
}  # added to the error of log(size)
_COMMON_WRONG_UNITS_MM = (1.0, 10.0)  # units that programs write although the format requires metres
# usual sizes of standing figures (True) and of other meshes (False)
_USUAL_SIZE_RANGE_MM = {True: (1200.0, 2200.0), False: (150.0, 500.0)}


def with_positions_in_mm(
    rigged: RiggedMesh, path: Path, unit_mm: float | None, error_subject: object
) -> RiggedMesh:
    """Return the mesh of a file in millimetres, with a note if its unit was guessed or its size is unusual.

    The unit is guessed for OBJ, PLY and STL if the user states none. A guessed unit scales only the mesh,
    because files of these formats have no rigs.

    rigged : mesh and rig of the file, already converted to millimetres: from `unit_mm` if the user states it,
        otherwise from the unit that the file states, or else from the default unit of its format
    path : path of the file, whose suffix tells the format
    unit_mm : unit of the file as the user states it [mm]; None if the user states none
    error_subject : source of the mesh, for errors

    Raises DermisError for a mesh that is smaller than a millimetre or larger than three metres.
    """
    mesh, note = rigged.mesh, ""
    guessed = unit_mm is None and path.suffix.lower() in SUFFIXES_WITHOUT_UNIT
    read_unit = unit_mm or rigged.unit_mm or default_unit_mm(path)
    unit = guess_unit_mm(mesh.positions, mesh.triangles) if guessed else read_unit
    if unit != read_unit:
        mesh = replace(mesh, positions=(mesh.positions * (unit / read_unit)).astype(np.float32))
    size = float(mesh.size_mm.max())
    if not _ACCEPTED_SIZE_RANGE_MM[0] <= size <= _ACCEPTED_SIZE_RANGE_MM[1]:
        _refuse_size(mesh, unit, error_subject)
    if guessed and not (unit == 1.0 and _is_in_mm(mesh.positions)):
        made = f"1 unit = {unit:g} mm makes it {_size_text(mesh.size_mm)}"
        note = f"its unit is not stated; {made}; --unit-mm sets another"
    elif (
        size > _SIZE_RANGE_OF_MM_FILES[1]
        and mesh.skull_centre_mm is None
        and not (rigged.rig and rigged.rig.skeleton)
    ):
        note = f"it is {_size_text(mesh.size_mm)} at {unit:g} mm per unit; --unit-mm sets another"
    return rigged._replace(mesh=mesh, notes=(note, *rigged.notes) if note else rigged.notes)


def guess_unit_mm(positions: Floats, triangles: Ints) -> float:
    """Return the likely length unit of a mesh whose file states no unit [mm].

    If the mesh is not a standing figure and is 100 to 1000 units large, the guess is the millimetre.
    Otherwise the guess is the unit of `COMMON_UNITS_MM` that makes the mesh most similar in size to an adult
    (standing figures), to a hand (flat or slender meshes), or to a head (all other meshes).

    positions : (v, 3) vertices in the unit of the file, Y up
    triangles : (f, 3) vertex indices
    """
    size, typical = float(np.ptp(positions, axis=0).max()), _TYPICAL_FIGURE_MM
    if not is_standing_figure(positions, triangles):
        thickness, width, length = principal_sizes(positions)
        if size == 0 or _is_in_mm(positions):
            return 1.0
        is_piece = length > MAX_ELONGATION * width or thickness < _MAX_FLATNESS * length
        typical = _TYPICAL_HAND_MM if is_piece else _TYPICAL_HEAD_MM
    penalty = _INCH_LOG_SIZE_PENALTY[typical]
    return min(
        COMMON_UNITS_MM, key=lambda unit: abs(log(size * unit / typical)) + penalty * (unit == _INCH_MM)
    )


def _is_in_mm(positions: Floats) -> bool:
    """Return whether the height or longest side of a mesh suggests that its unit is the millimetre.

    positions : (v, 3) vertices in the unit of the file
    """
    sizes, (low, high) = np.ptp(positions, axis=0), _SIZE_RANGE_OF_MM_FILES
    return any(low <= size <= high for size in (sizes[1], sizes.max()))


def _size_text(sizes_mm: Floats) -> str:
    """Return the height of an upright mesh, or the length of a lying mesh, as text with a unit.

    sizes_mm : (3,) sides of the bounding box [mm]
    """
    longest = float(sizes_mm.max())
    length = f"{longest / 1000:.3g} m" if longest >= 1000 else f"{longest:.3g} mm"
    return f"{length} {'high' if sizes_mm[1] == longest else 'long'}"


def _refuse_size(mesh: Mesh, unit_mm: float, error_subject: object) -> None:
    """Refuse a mesh of impossible size; the error suggests units with which the size would be usual.

    unit_mm : unit with which the file was read [mm]
    """
    low, high = _USUAL_SIZE_RANGE_MM[is_standing_figure(mesh.positions, mesh.triangles)]
    advice = "Set the millimetres per unit of the file with --unit-mm"
    for other in _COMMON_WRONG_UNITS_MM:
        sizes = mesh.size_mm * (other / unit_mm)
        if low <= sizes.max() <= high:
            program = "millimetres" if other == 1.0 else "centimetres"
            advice += f": {other:g}, for a program that writes {program}, makes it {_size_text(sizes)}"
    actual = f"it is {_size_text(mesh.size_mm)} at {unit_mm:g} mm per unit (a forgotten unit?)"
    refuse(
        error_subject,
        f"skin {_ACCEPTED_SIZE_RANGE_MM[0]:g} to {_ACCEPTED_SIZE_RANGE_MM[1]:g} mm large",
        actual,
        advice,
    )
