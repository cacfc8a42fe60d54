"""Files with the waveform of a beat or a recording of the pulse, and poses of a head that the pulse moves."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.base.number_table import read_number_table
from dermis.human.living import TYPICAL_BEAT
from dermis.human.living.heartbeat import (
    SPREAD_PERCENTILES,
    ModelledPulse,
    RecordedPulse,
    normalised_beat,
    typical_beat,
)
from dermis.mesh.pose import Pose, merge_poses
from dermis.mesh.rotations import angles_matrix

_HEAD_BONE = "head"
_MIN_BEAT_SAMPLES = 8
_MIN_RECORDING_S, _MAX_RECORDING_S = 2.0, 1e6


@lru_cache(maxsize=32)
def load_signal(
    waveform: str, rate_per_min: float, variability_ms: float, respiration_per_min: float, seed: int
) -> ModelledPulse | RecordedPulse:
    """Return a pulse as a function of time, for values of the fields of `Pulse`.

    Raises DermisError for a file that cannot be read, or whose contents are no beat and no recording.
    """
    table = typical_beat()[:, None] if waveform == TYPICAL_BEAT else _read_columns(waveform)
    if table.shape[1] == 2:
        return RecordedPulse(*_checked_recording(waveform, table))
    beat = table[:, 0]
    if len(beat) < _MIN_BEAT_SAMPLES or np.ptp(beat) == 0.0:
        expected = f"at least {_MIN_BEAT_SAMPLES} values over one beat, which are not all equal"
        refuse(waveform, expected, f"got {len(beat)} with a range of {np.ptp(beat):g}", "Correct it")
    beat = normalised_beat(beat)
    return ModelledPulse(rate_per_min, beat, 1e-3 * variability_ms, respiration_per_min / 60.0, seed)


def _read_columns(file_name: str) -> Doubles:
    """Return the numbers (n, 1 or 2) of a CSV file; comments and a header line are skipped."""
    expected = f"{TYPICAL_BEAT}, or a CSV file with one column (a beat) or two (time, value)"
    return read_number_table(file_name, expected, (1, 2), "one or two numbers in each line, as in the first")


def _checked_recording(file_name: str | Path, table: Doubles) -> tuple[Doubles, Doubles]:
    """Return times from 0 [s] and values of a recording; raise DermisError if it cannot be used."""
    times = table[:, 0] - table[0, 0]
    if len(times) < 2 or (np.diff(times) <= 0).any():
        refuse(file_name, "increasing times [s] in the first column", "they are not", "Correct it")
    if times[-1] < _MIN_RECORDING_S or times[-1] > _MAX_RECORDING_S:
        expected = f"a recording of {_MIN_RECORDING_S:g} to {_MAX_RECORDING_S:g} s"
        refuse(file_name, expected, f"it lasts {times[-1]:g} s", "Give times in seconds")
    if np.ptp(np.percentile(table[:, 1], SPREAD_PERCENTILES)) == 0.0:
        refuse(file_name, "values that change", "they are constant", "Correct it")
    return times, table[:, 1]


def with_nod(pose: Pose | None, nod_degrees: float) -> Pose:
    """Return a copy of a pose in which the head is also rotated about x by an angle [degrees]."""
    base = pose or Pose()
    before: Any = base.bones.get(_HEAD_BONE, (0.0, 0.0, 0.0))
    if np.shape(before) == (3,):
        rotation: Any = (before[0] + nod_degrees, before[1], before[2])
    else:
        rotation = np.array(before, np.float64)
        rotation[:3, :3] = rotation[:3, :3] @ np.array(angles_matrix((nod_degrees, 0.0, 0.0)))[:3, :3]
    return merge_poses(Pose(bones={_HEAD_BONE: rotation}), base)
