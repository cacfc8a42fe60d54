"""Landmarks of a frame: where they are in the scene, and whether they are seen."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.frame.features.outputs.stage_inputs import StageInputs
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Buffer, Device, Recorder, Texture
from dermis.human.landmarks.points import LandmarkPoints, check_landmarks, landmark_points
from dermis.mesh.head import Head

LandmarkPositions = dict[str, tuple[tuple[str, ...], NDArray[np.float32]]]
"""Names of each set, and (n, 4) places [mm] with 1 for those that are seen."""
TOLERANCE_MM = 2.0
"""By which the mesh at the pixels around a landmark may lie before it where it still counts as seen."""
_ROW = np.dtype([("corner", "u4", 4), ("share", "f4", 4), ("material", "u4", 4)])  # as in landmarks.wgsl
_FOUND = 4  # floats of each: place, and whether it is seen


@dataclass(frozen=True, eq=False)
class LandmarkBuffers:
    """Landmarks of all requested sets, one after the other.

    sets : by their names
    table, buffer : as landmarks.wgsl reads and writes them
    count : of all
    """

    sets: dict[str, LandmarkPoints]
    table: Buffer
    buffer: Buffer
    count: int

    def found(self, raw: NDArray[np.uint8]) -> LandmarkPositions:
        """Return the names of each set, and (n, 4) places [mm] with 1 for those that are seen.

        raw : bytes of the buffer
        """
        rows, first, found = raw.view(np.float32).reshape(-1, _FOUND), 0, {}
        for name, points in self.sets.items():
            found[name] = points.names, rows[first : first + len(points.names)]
            first += len(points.names)
        return found


def checked_landmarks(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of sets and tables, each once.

    Raises DermisError for what is neither.
    """
    if isinstance(names, str) or not isinstance(names, Iterable):
        actual = f"got {format_value(names)}"
        refuse("landmarks", "several names", actual, 'Write landmarks=("ibug-68",)')
    return tuple(dict.fromkeys(check_landmarks(name) for name in names))


def make_landmark_buffers(device: Device, head: Head, names: tuple[str, ...]) -> LandmarkBuffers:
    """Return the landmarks of a head on the device.

    Raises DermisError as `landmark_points` does.
    """
    sets = {name: landmark_points(head, name) for name in names}
    rows = np.zeros(sum(len(points.names) for points in sets.values()), _ROW)
    for part in ("corner", "share"):
        rows[part] = np.concatenate([getattr(points, part) for points in sets.values()])
    rows["material"][:, 0] = np.concatenate([points.material for points in sets.values()]) + 1
    table = device.buffer(rows.view(np.uint32), "STORAGE")
    return LandmarkBuffers(sets, table, device.storage_buffer(4 * _FOUND * len(rows), "landmarks"), len(rows))


def draw_landmarks(graph: Recorder, space: LandmarkBuffers, seen: StageInputs, centres: Texture) -> None:
    """Declare the pass that finds the landmarks."""
    shader = program(graph.device, "outputs/landmarks.wgsl", (("TOLERANCE_MM", TOLERANCE_MM),))
    bound = seen.bound(shader, centres) | {"landmarks": space.table}
    bound |= {"points": seen.shape.surface["points"], "found": space.buffer}
    graph.dispatch("outputs", shader, bound, workgroup_grid(space.count))
