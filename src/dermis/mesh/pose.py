"""Poses of heads: weights of morph targets, rotations of bones, or positions of points."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.arrays import Doubles, Floats
from dermis.base.errors import DermisError, format_value, refuse
from dermis.base.quantities import checked_array, checked_number
from dermis.base.renamed import renamed_keywords
from dermis.base.summary import ShortRepr
from dermis.mesh.rig import PoseArrays, Rig
from dermis.mesh.skeleton import Skeleton

MAX_WEIGHT = 100.0
MAX_ROTATION_DEGREES = 1e5
MAX_DISTANCE_MM = 1e6
_EXPECTED_BONE_VALUE = "three angles [degrees] or a (4, 4) matrix"
_MAX_SUGGESTED_NAMES = 3  # names that an error message proposes
_MAX_COMPARED_LETTERS = 80  # compared letters of a name
_MIN_RELATIVE_DETERMINANT = 1e-9  # least determinant of a matrix, relative to the cube of its norm


@dataclass(frozen=True, eq=False, repr=False)
class Pose(ShortRepr):
    """Pose of a head: weights of morph targets, rotations of bones, or positions of all points.

    Parameters
    ----------
    weights : mapping of str to float, optional
        Weights of morph targets by name, mostly 0 to 1; targets that are left out keep their weight at rest.
    bones : mapping of str to array_like, optional
        Rotations of bones by name. A rotation is either three angles [degrees] about the head's own axes (x:
        nod, y: turn, z: tilt) relative to the rest pose, applied about z first, then x, then y; or a (4, 4)
        matrix from the bone's space to its parent's space, in the units of the file, as in animations.
    positions_mm : (n, 3) array, optional
        Rest positions of all points of the control mesh, in the order of `Head.positions_mm` [mm]. They may
        come from another person with the same topology, or from a frame of another program's motion.

    Raises
    ------
    DermisError
        If weights or bones are not mappings.

    Examples
    --------
    >>> import dermis
    >>> pose = dermis.Pose(weights={"jawOpen": 0.3}, bones={"head": (0, 20, 0)})
    >>> pose.weights["jawOpen"]
    0.3
    """

    weights: Mapping[str, float] = field(default_factory=dict)
    bones: Mapping[str, ArrayLike] = field(default_factory=dict)
    positions_mm: Floats | None = None

    def __post_init__(self) -> None:
        """Check that weights and bones are mappings."""
        for part in ("weights", "bones"):
            if not isinstance(value := getattr(self, part), Mapping):
                refuse(f"pose: {part}", "a mapping by name", f"got {format_value(value)}", "Correct it")

    @classmethod
    def coerce(cls, value: object) -> Pose | None:
        """Convert a mapping of morph target weights to a pose; poses and None are returned unchanged."""
        if value is None or isinstance(value, Pose):
            return value
        if not isinstance(value, Mapping):
            expected = "a Pose or a mapping of weights by name"
            refuse("pose", expected, f"got {format_value(value)}", "Correct it")
        return cls(weights=value)

    @renamed_keywords(culprit="error_subject")
    def to_arrays(self, rig: Rig, error_subject: object = "pose") -> PoseArrays:
        """Return the pose as arrays for a rig: target weights, bone matrices and rest positions of points.

        Parameters
        ----------
        rig : Rig
            Rig of the head.
        error_subject : object, optional
            Name of the pose in error messages.

        Returns
        -------
        PoseArrays
            Weights of the morph targets, matrices of the bones, and rest positions of the control points.

        Raises
        ------
        DermisError
            For names that the rig does not have, and for invalid numbers and shapes.
        """
        return PoseArrays(
            self._target_weights(rig, error_subject),
            self._bone_matrices(rig, error_subject),
            self._rest_positions(rig, error_subject),
        )

    def _target_weights(self, rig: Rig, error_subject: object) -> Floats:
        weights = np.zeros(len(rig.targets.names), np.float32)
        if not self.weights:
            return weights
        try:
            index = rig.target_index
            targets = [index[name] for name in self.weights]
            values = checked_array(error_subject, list(self.weights.values()), (0,), -MAX_WEIGHT, MAX_WEIGHT)
        except (KeyError, TypeError, DermisError):
            _refuse_weights(self.weights, rig.targets.names, error_subject)
        weights[targets] = values if rig.targets.rest is None else values - rig.targets.rest[targets]
        return weights

    def _bone_matrices(self, rig: Rig, error_subject: object) -> Floats:
        bone_values = self._bones_with_target_rotations(rig)
        if not bone_values:
            return rig.rest.matrices
        if rig.skeleton is None:
            _refuse_name(f"{error_subject}: bones", next(iter(bone_values)), (), "bone")
        index = rig.skeleton.index_by_name
        for name in bone_values:
            if name not in index:
                _refuse_name(f"{error_subject}: bones", name, index, "bone")
        ordered = sorted((index[name], name) for name in bone_values)
        bones = [bone for bone, _ in ordered]
        return rig.skeleton.pose_matrices(
            bones, _bone_transforms(rig.skeleton, ordered, bone_values, error_subject)
        )

    def _bones_with_target_rotations(self, rig: Rig) -> Mapping[str, ArrayLike]:
        """Return the bone rotations of the pose, with the rotations that active morph targets add to them.

        Rotations that are given as matrices are returned unchanged.
        """
        rotations = [one for one in rig.bone_rotations if self.weights.get(one.target)]
        if not rotations:
            return self.bones
        bones: dict[str, Any] = dict(self.bones)
        for target, bone, degrees in rotations:
            before = bones.get(bone, (0.0, 0.0, 0.0))
            if np.shape(before) == (3,):
                bones[bone] = [a + self.weights[target] * b for a, b in zip(before, degrees, strict=True)]
        return bones

    def _rest_positions(self, rig: Rig, error_subject: object) -> Floats:
        if self.positions_mm is None:
            return rig.positions_mm
        try:
            with np.errstate(over="ignore"):  # too large numbers become infinite and are refused below
                positions = np.ascontiguousarray(self.positions_mm, np.float32)
        except (TypeError, ValueError, OverflowError):
            positions = np.zeros(0, np.float32)
        expected = (rig.file_point_count, 3)
        if positions.shape != expected:
            actual = f"got {positions.shape if positions.size else format_value(self.positions_mm)}"
            advice = "Give as many points as Head.positions_mm lists, in its order"
            refuse(f"{error_subject}: positions_mm", f"an array of {expected}", actual, advice)
        with np.errstate(invalid="ignore"):
            if not np.abs(positions).max(initial=0) <= MAX_DISTANCE_MM:
                invalid = np.flatnonzero(~(np.abs(positions) <= MAX_DISTANCE_MM).all(axis=1))
                actual = f"{len(invalid)} are NaN, infinite or farther, first {invalid[0]}"
                expected_mm = f"points within {MAX_DISTANCE_MM:g} mm"
                refuse(f"{error_subject}: positions_mm", expected_mm, actual, "Correct them")
        return rig.complete_positions(positions) if rig.rigid_followers else positions


def merge_poses(pose: Pose, base: Pose | Mapping[str, float] | None) -> Pose:
    """Return a pose with the weights and bones of both poses, in which `pose` overrides `base`.

    The rest positions are those of `pose`, or of `base` if `pose` has no rest positions."""
    base = Pose.coerce(base) or Pose()
    positions = base.positions_mm if pose.positions_mm is None else pose.positions_mm
    return Pose({**base.weights, **pose.weights}, {**base.bones, **pose.bones}, positions)


def _bone_transforms(
    skeleton: Skeleton,
    ordered_bones: list[tuple[int, str]],
    bone_values: Mapping[str, Any],
    error_subject: object,
) -> Doubles:
    """Return the transforms (n, 4, 4) in head space that move bones from the rest pose to the pose [mm].

    ordered_bones : (n,) index and name of each bone, parents before children
    bone_values : mapping from bone name to angles or matrix, see `Pose`
    error_subject : name of the pose in error messages
    """
    changes = np.empty((len(ordered_bones), 4, 4))
    rows: list[list[float]] = []
    by_angles: list[int] = []
    by_matrix: list[int] = []
    for k, (bone, name) in enumerate(ordered_bones):
        try:
            if len(bone_values[name]) == 3:
                angles = checked_array(
                    error_subject, bone_values[name], (3,), -MAX_ROTATION_DEGREES, MAX_ROTATION_DEGREES
                )
                rows.append(skeleton.joint_rotation_matrix(bone, angles.tolist()))
                by_angles.append(k)
            else:
                changes[k] = checked_array(
                    error_subject, bone_values[name], (4, 4), -MAX_DISTANCE_MM, MAX_DISTANCE_MM
                )
                by_matrix.append(k)
        except (TypeError, DermisError):
            _refuse_bone_value(f"{error_subject}: bones.{name}", bone_values[name])
    if by_angles:
        changes[by_angles] = np.array(rows).reshape(-1, 4, 4)
    if by_matrix:
        _check_matrices(changes[by_matrix], [ordered_bones[k][1] for k in by_matrix], error_subject)
        bones = [ordered_bones[k][0] for k in by_matrix]
        changes[by_matrix] = skeleton.head_space_transforms(bones, changes[by_matrix])
    return changes


def _check_matrices(bone_matrices: Doubles, bone_names: list[str], error_subject: object) -> None:
    """Raise DermisError if one of the matrices (n, 4, 4) is singular.

    bone_names : (n,) names of the bones
    error_subject : name of the pose in error messages
    """
    linear = bone_matrices[:, :3, :3]
    size = np.sqrt(np.einsum("nij,nij->n", linear, linear))
    singular = np.abs(np.linalg.det(linear)) <= _MIN_RELATIVE_DETERMINANT * size**3
    if singular.any():
        name = f"{error_subject}: bones.{bone_names[int(singular.argmax())]}"
        refuse(name, "a matrix that can be inverted", "this one flattens what it moves", "Correct it")


def _refuse_bone_value(error_subject: str, bone_value: object) -> NoReturn:
    limits = f"no angle beyond {MAX_ROTATION_DEGREES:g}, nothing beyond {MAX_DISTANCE_MM:g}"
    expected = f"{_EXPECTED_BONE_VALUE}, {limits}"
    refuse(error_subject, expected, f"got {format_value(bone_value, 80)}", "Correct it")


def _refuse_weights(
    target_weights: Mapping[str, object], target_names: tuple[str, ...], error_subject: object
) -> NoReturn:
    """Raise DermisError for the first invalid weight or unknown morph target.

    target_weights : mapping from names of morph targets to weights
    target_names : names of the morph targets of the rig
    error_subject : name of the pose in error messages
    """
    for name, weight in target_weights.items():
        if name not in target_names:
            _refuse_name(f"{error_subject}: weights", name, target_names, "morph target")
        checked_number(f"{error_subject}: weights.{name}", weight, -MAX_WEIGHT, MAX_WEIGHT)
    refuse(f"{error_subject}: weights", "a number for each target", "got something else", "Correct it")


def _refuse_name(
    error_subject: str, unknown_name: object, known_names: Iterable[str], name_noun: str
) -> NoReturn:
    """Raise DermisError for an unknown name; the message suggests similar known names.

    error_subject : name of the pose's field in the message
    known_names : names of all bones or morph targets of the head
    name_noun : "bone" or "morph target"
    """
    names = list(known_names)
    if not names:
        actual = f"got {format_value(unknown_name)} and it has none"
        refuse(
            error_subject,
            f"a {name_noun} of the head",
            actual,
            f"Load a glTF file with {name_noun}s, or leave it out",
        )
    plain = {one.casefold(): one for one in names}
    similar = difflib.get_close_matches(
        str(unknown_name)[:_MAX_COMPARED_LETTERS].casefold(), plain, _MAX_SUGGESTED_NAMES, 0.5
    )
    advice = (
        f"Nearest: {', '.join(plain[one] for one in similar)}"
        if similar
        else f"It has {_short_name_list(names)}"
    )
    refuse(error_subject, f"a {name_noun} of the head", f"there is no {format_value(unknown_name)}", advice)


def _short_name_list(known_names: list[str]) -> str:
    shown = ", ".join(known_names[:8])
    return f"{shown} and {len(known_names) - 8} more" if len(known_names) > 8 else shown
