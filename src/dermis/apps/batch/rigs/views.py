"""Cameras of a rig, placed in a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dermis.apps.batch.distributions import Constant, Distribution
from dermis.apps.batch.rigs.calibration import Calibration, load_calibrations, scaled_intrinsics
from dermis.apps.batch.rigs.table import RigTable
from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.mesh.rotations import angles_matrix
from dermis.scene.camera import Camera

_KEYS_OF_KIND: Mapping[str, tuple[str, ...]] = {
    "stereo": ("baseline_mm", "parallel"),
    "orbit": ("count", "arc_deg"),
    "file": ("file", "unit_mm", "anchor"),
}
_DEFAULTS: Mapping[str, object] = {
    "baseline_mm": Constant(120.0),
    "parallel": False,
    "count": 8,
    "arc_deg": Constant(180.0),
    "unit_mm": 1.0,
    "anchor": "head",
}
_MIN_DISTANCE_MM = 100.0  # inside a head, there is nothing to see
_STEREO_NAMES = "left", "right"


def with_defaults(rig: RigTable | None) -> RigTable | None:
    """Return a rig with the defaults of its kind, so that they are in the canonical text of the spec.

    Raises DermisError for keys of other kinds, and for a missing file.
    """
    if rig is None:
        return None
    for kind, keys in _KEYS_OF_KIND.items():
        for key in keys:
            if kind != rig.kind and getattr(rig, key) is not None:
                refuse(f"rig: {key}", f'kind = "{kind}"', f"got {rig.kind!r}", "Remove it, or change kind")
    if rig.kind == "file" and not rig.file:
        refuse("rig: file", "the name of a file with calibrations", "there is none", "Add it")
    missing = [key for key in _KEYS_OF_KIND[rig.kind] if getattr(rig, key) is None]
    return rig.replace(**{key: _DEFAULTS[key] for key in missing})


@dataclass(frozen=True)
class Rig:
    """Cameras of a rig.

    table : table of the spec
    calibrations : cameras of the file; empty for other kinds
    """

    table: RigTable
    calibrations: tuple[Calibration, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the cameras, in order."""
        if self.table.kind == "stereo":
            return _STEREO_NAMES
        if self.table.kind == "file":
            return tuple(one.name for one in self.calibrations)
        return tuple(f"{k:02d}" for k in range(self.table.count or 0))

    def camera(
        self, view: int, base: Camera, numbers: Mapping[str, float], picture_size: tuple[int, int]
    ) -> Camera:
        """Return a camera of the rig without lens distortion.

        view : number of the camera
        base : camera that the table [camera] places
        numbers : sampled numbers of the table [rig], by key
        picture_size : width and height [pixel]
        """
        if self.table.kind == "stereo":
            offset_mm = (view - 0.5) * numbers["baseline_mm"]
            return _beside(base, offset_mm, picture_size, is_parallel=bool(self.table.parallel))
        if self.table.kind == "orbit":
            return _around(base, _orbit_yaw_deg(view, len(self.names), numbers["arc_deg"]))
        return self._calibrated(view, base, picture_size)

    def _calibrated(self, view: int, base: Camera, picture_size: tuple[int, int]) -> Camera:
        one, unit_mm = self.calibrations[view], self.table.unit_mm or 1.0
        R, t = one.R, unit_mm * one.t
        if self.table.anchor == "first":
            first, placed = self.calibrations[0], base.to_opencv(picture_size)
            relative = R @ first.R.T
            t = relative @ (placed.t - unit_mm * first.t) + t
            R = relative @ placed.R
        return Camera.from_opencv(scaled_intrinsics(one, picture_size), R, t, picture_size)


def load_rig(table: RigTable | None, folder: Path) -> Rig | None:
    """Return the rig of a spec; None without a table.

    folder : folder of the spec, to which the file is relative
    """
    if table is None:
        return None
    calibrations = load_calibrations(folder / table.file) if table.file else ()
    return Rig(table, calibrations)


def lens_values(rig: Rig, view: int) -> dict[str, float]:
    """Return the distortion of a calibrated camera as parameters of [lens]; empty without a file."""
    if not rig.calibrations:
        return {}
    return {f"lens.{name}": value for name, value in rig.calibrations[view].lens.model_dump().items()}


def check_rig(
    rig: Rig, distributions: Mapping[str, Distribution], picture_size: tuple[int, int], *, has_lens: bool
) -> None:
    """Raise DermisError if other tables of the spec contradict the cameras of a rig.

    distributions : distribution of each parameter by its dotted name
    has_lens : whether the spec has a table [lens]
    """
    for one in rig.calibrations:
        scaled_intrinsics(one, picture_size)
        if any(one.lens.model_dump().values()) and not has_lens:
            advice = "Add the tables [sensor] and [lens], without keys, or undistort the calibration"
            refuse("rig: file", "a table [lens] for lenses with distortion", "there is none", advice)
    if rig.calibrations and rig.table.anchor == "head":
        _check_outside_the_head(rig)
    if rig.calibrations and has_lens:
        for name in (f"lens.{key}" for key in ("k1", "k2", "p1", "p2", "k3")):
            if distributions[name].support != (0.0,):
                actual = "the file of [rig] states it for each camera"
                refuse(name.replace(".", ": "), "no value", actual, "Remove it")


def _check_outside_the_head(rig: Rig) -> None:
    for one in rig.calibrations:
        distance_mm = (rig.table.unit_mm or 1.0) * float(np.linalg.norm(one.t))
        if distance_mm < _MIN_DISTANCE_MM:
            expected = f"cameras {_MIN_DISTANCE_MM:g} mm or more from the head's centre"
            actual = f"{one.name} is {distance_mm:.3g} mm from it"
            advice = (
                'Write anchor = "first" for calibrations relative to the first camera, or correct unit_mm'
            )
            refuse("rig: file", expected, actual, advice)


def _beside(base: Camera, offset_mm: float, picture_size: tuple[int, int], *, is_parallel: bool) -> Camera:
    """Return a camera that is offset to the right of another one.

    Converging cameras look at the target of the base; the views of parallel ones are wider by the baseline.
    """
    right = base.to_opencv(picture_size).R[0]
    position = np.array(base.position) + offset_mm * right
    if is_parallel:
        wider = 2.0 * abs(offset_mm) * picture_size[1] / picture_size[0]
        target = np.array(base.target) + offset_mm * right
        return base.replace(position=_point(position), target=_point(target), frame_mm=base.frame_mm + wider)
    scale = math.dist(position, base.target) / math.dist(base.position, base.target)
    return base.replace(position=_point(position), frame_mm=base.frame_mm * scale)


def _orbit_yaw_deg(view: int, count: int, arc_deg: float) -> float:
    """Return the angle from the camera of [camera] to a camera of an orbit, to the head's left [degrees]."""
    if arc_deg >= 360.0:
        return 360.0 * view / count
    return arc_deg * (view / (count - 1) - 0.5)


def _around(base: Camera, yaw_deg: float) -> Camera:
    """Return a camera rotated about the vertical axis through the head's centre."""
    rotation = np.array(angles_matrix((0.0, yaw_deg, 0.0)))
    position, target, up = (_point(rotation @ np.array(one)) for one in (base.position, base.target, base.up))
    return base.replace(position=position, target=target, up=up)


def _point(vector: Doubles) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z
