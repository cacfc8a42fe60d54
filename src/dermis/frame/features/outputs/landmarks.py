"""Landmark outputs: positions of facial landmarks in the scene, and whether they are visible."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Buffer, Device, Recorder
from dermis.human.landmarks.points import LandmarkPoints, check_landmarks, landmark_points
from dermis.mesh.head import Head

LandmarkPositions = dict[str, tuple[tuple[str, ...], NDArray[np.float32]]]
"""For each set, the names of its n landmarks, and (n, 4) rows x, y, z [mm] and a visibility code.

The visibility code is the fraction of the pixel that hair and beard cover, plus 2 if the mesh does not hide
the landmark.
"""
LANDMARK_TOLERANCE_MM = 2.0
"""Largest depth by which the mesh may be in front of a landmark that counts as visible [mm]."""
# Struct Landmark of landmarks.wgsl.
_LANDMARK_DTYPE = np.dtype([("corner", "u4", 4), ("weight", "f4", 4), ("material", "u4", 4)])
_FLOATS_PER_LANDMARK = 4  # x, y, z, and the visibility code


@dataclass(frozen=True, eq=False)
class LandmarkBuffers:
    """Buffers of the landmarks of all requested sets.

    sets : dictionary from the name of a set to the surface points of its landmarks
    table : buffer of the surface points, read by landmarks.wgsl
    results : buffer of positions and visibility, written by landmarks.wgsl
    count : number of landmarks in all sets together
    """

    sets: dict[str, LandmarkPoints]
    table: Buffer
    results: Buffer
    count: int

    def decode_positions(self, result_bytes: NDArray[np.uint8]) -> LandmarkPositions:
        """Return the positions and the visibility of the landmarks of each set.

        result_bytes : content of the buffer `results`, read back from the device
        """
        rows, first, positions = result_bytes.view(np.float32).reshape(-1, _FLOATS_PER_LANDMARK), 0, {}
        for name, points in self.sets.items():
            positions[name] = points.names, rows[first : first + len(points.names)]
            first += len(points.names)
        return positions


def checked_landmark_sets(set_names: Iterable[str]) -> tuple[str, ...]:
    """Check names of landmark sets and paths of landmark files, and return them without duplicates.

    Raises DermisError for a name that is neither a set nor a file.
    """
    if isinstance(set_names, str) or not isinstance(set_names, Iterable):
        actual = f"got {format_value(set_names)}"
        refuse("landmarks", "several names", actual, 'Write landmarks=("ibug-68",)')
    return tuple(dict.fromkeys(check_landmarks(name) for name in set_names))


def make_landmark_buffers(device: Device, head: Head, set_names: tuple[str, ...]) -> LandmarkBuffers:
    """Upload the surface points of the landmarks of a head.

    set_names : names of landmark sets, or paths of landmark files

    Raises DermisError for landmarks that the head does not have.
    """
    sets = {name: landmark_points(head, name) for name in set_names}
    rows = np.zeros(sum(len(points.names) for points in sets.values()), _LANDMARK_DTYPE)
    rows["corner"] = np.concatenate([points.point for points in sets.values()])
    rows["weight"] = np.concatenate([points.weight for points in sets.values()])
    rows["material"][:, 0] = np.concatenate([points.material for points in sets.values()]) + 1
    table = device.buffer(rows.view(np.uint32), "STORAGE")
    results = device.storage_buffer(4 * _FLOATS_PER_LANDMARK * len(rows), "landmarks")
    return LandmarkBuffers(sets, table, results, len(rows))


def draw_landmarks(
    graph: Recorder, buffers: LandmarkBuffers, inputs: StageInputs, hair_labels: Buffer, has_hair: bool
) -> None:
    """Declare the pass that computes the positions and the visibility of the landmarks.

    hair_labels : buffer with the cover of each pixel by hair, see `LabelBuffers`
    has_hair : whether the hair pass writes `hair_labels`
    """
    constants = ("TOLERANCE_MM", LANDMARK_TOLERANCE_MM), ("HAIRS", has_hair)
    shader = program(graph.device, "outputs/landmarks.wgsl", constants)
    bindings = inputs.bindings(shader) | {"landmarks": buffers.table, "hair_labels": hair_labels}
    bindings |= {"points": inputs.shape.surface["points"], "results": buffers.results}
    graph.dispatch("outputs", shader, bindings, workgroup_grid(buffers.count))
