"""How a head is moved from where it rests."""

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
from dermis.base.summary import ShortRepr
from dermis.mesh.rig import Motion, Rig
from dermis.mesh.skeleton import Skeleton

MOST_WEIGHT = 100.0
MOST_DEGREES = 1e5
FARTHEST_MM = 1e6
_FORMS = "three angles [degrees] or a (4, 4) matrix"
_NEAR = 3  # names that are proposed
_LONGEST_NAME = 80  # letters that are compared
_FLAT = 1e-9  # determinant over size cubed


@dataclass(frozen=True, eq=False, repr=False)
class Pose(ShortRepr):
    """Weights of morph targets, turns of bones, or places of all points.

    weights : of targets by name, mostly 0 to 1; those that are left out keep the weight that they rest with
    bones : by name; three angles [degrees] about the head's own axes (x: nod, y: turn, z: tilt) from where
        the bone rests, done about z first, then x, then y; or a (4, 4) matrix from its space to its parent's
        instead of the one at rest, in the file's units, as animations have
    positions_mm : (n, 3) all points of the control mesh, as `Head.positions_mm` lists them, instead of those
        at rest: another person of the same topology, or a motion from elsewhere
    """

    weights: Mapping[str, float] = field(default_factory=dict)
    bones: Mapping[str, ArrayLike] = field(default_factory=dict)
    positions_mm: Floats | None = None

    def __post_init__(self) -> None:
        for part in ("weights", "bones"):
            if not isinstance(given := getattr(self, part), Mapping):
                refuse(f"pose: {part}", "a mapping by name", f"got {format_value(given)}", "Correct it")

    @classmethod
    def of(cls, given: object) -> Pose | None:
        """A pose, the pose of a plain mapping of weights, or None."""
        if given is None or isinstance(given, Pose):
            return given
        if not isinstance(given, Mapping):
            refuse(
                "pose", "a Pose or a mapping of weights by name", f"got {format_value(given)}", "Correct it"
            )
        return cls(weights=given)

    def motion(self, rig: Rig, culprit: object = "pose") -> Motion:
        """The pose as numbers for a rig.

        culprit : named in messages

        Raises DermisError for names that the rig lacks, and for numbers and shapes that cannot be.
        """
        return Motion(
            self._weights(rig, culprit), self._matrices(rig, culprit), self._positions(rig, culprit)
        )

    def _weights(self, rig: Rig, culprit: object) -> Floats:
        weights = np.zeros(len(rig.targets.names), np.float32)
        if not self.weights:
            return weights
        try:
            index = rig.target_index
            places = [index[name] for name in self.weights]
            given = checked_array(culprit, list(self.weights.values()), (0,), -MOST_WEIGHT, MOST_WEIGHT)
        except (KeyError, TypeError, DermisError):
            _refuse_weights(self.weights, rig.targets.names, culprit)
        weights[places] = given if rig.targets.rest is None else given - rig.targets.rest[places]
        return weights

    def _matrices(self, rig: Rig, culprit: object) -> Floats:
        given = self._turned(rig)
        if not given:
            return rig.rest.matrices
        if rig.skeleton is None:
            _refuse_name(f"{culprit}: bones", next(iter(given)), (), "bone")
        index = rig.skeleton.index
        for name in given:
            if name not in index:
                _refuse_name(f"{culprit}: bones", name, index, "bone")
        ordered = sorted((index[name], name) for name in given)
        bones = [bone for bone, _ in ordered]
        return rig.skeleton.moved(bones, _changes(rig.skeleton, ordered, given, culprit))

    def _turned(self, rig: Rig) -> Mapping[str, ArrayLike]:
        """The bones with the turns that targets make; a bone that a matrix is given for keeps to it."""
        turning = [turn for turn in rig.turns if self.weights.get(turn.target)]
        if not turning:
            return self.bones
        found: dict[str, Any] = dict(self.bones)
        for target, bone, degrees in turning:
            before = found.get(bone, (0.0, 0.0, 0.0))
            if np.shape(before) == (3,):
                found[bone] = [a + self.weights[target] * b for a, b in zip(before, degrees, strict=True)]
        return found

    def _positions(self, rig: Rig, culprit: object) -> Floats:
        if self.positions_mm is None:
            return rig.positions_mm
        try:
            with np.errstate(over="ignore"):  # what is too large becomes infinite, and is refused below
                places = np.ascontiguousarray(self.positions_mm, np.float32)
        except (TypeError, ValueError, OverflowError):
            places = np.zeros(0, np.float32)
        expected = (rig.of_file, 3)
        if places.shape != expected:
            actual = f"got {places.shape if places.size else format_value(self.positions_mm)}"
            advice = "Give as many points as Head.positions_mm lists, in its order"
            refuse(f"{culprit}: positions_mm", f"an array of {expected}", actual, advice)
        with np.errstate(invalid="ignore"):
            if not np.abs(places).max(initial=0) <= FARTHEST_MM:
                lost = np.flatnonzero(~(np.abs(places) <= FARTHEST_MM).all(axis=1))
                actual = f"{len(lost)} are NaN, infinite or farther, first {lost[0]}"
                expected_mm = f"points within {FARTHEST_MM:g} mm"
                refuse(f"{culprit}: positions_mm", expected_mm, actual, "Correct them")
        return rig.completed(places) if rig.carried else places


def laid_over(pose: Pose, base: Pose | Mapping[str, float] | None) -> Pose:
    """Return a pose that takes what it does not state from another one."""
    under = Pose.of(base) or Pose()
    places = under.positions_mm if pose.positions_mm is None else pose.positions_mm
    return Pose({**under.weights, **pose.weights}, {**under.bones, **pose.bones}, places)


def _changes(
    skeleton: Skeleton, ordered: list[tuple[int, str]], given: Mapping[str, Any], culprit: object
) -> Doubles:
    """(n, 4, 4) what angles or matrices of bones do in the head's space at rest [mm]."""
    changes = np.empty((len(ordered), 4, 4))
    rows: list[list[float]] = []
    turned: list[int] = []
    own: list[int] = []
    for place, (bone, name) in enumerate(ordered):
        try:
            if len(given[name]) == 3:
                angles = checked_array(culprit, given[name], (3,), -MOST_DEGREES, MOST_DEGREES)
                rows.append(skeleton.turned(bone, angles.tolist()))
                turned.append(place)
            else:
                changes[place] = checked_array(culprit, given[name], (4, 4), -FARTHEST_MM, FARTHEST_MM)
                own.append(place)
        except (TypeError, DermisError):
            _refuse_form(f"{culprit}: bones.{name}", given[name])
    if turned:
        changes[turned] = np.array(rows).reshape(-1, 4, 4)
    if own:
        _check_matrices(changes[own], [ordered[place][1] for place in own], culprit)
        changes[own] = skeleton.changes([ordered[place][0] for place in own], changes[own])
    return changes


def _check_matrices(matrices: Doubles, names: list[str], culprit: object) -> None:
    """Refuse matrices that flatten what they move."""
    linear = matrices[:, :3, :3]
    size = np.sqrt(np.einsum("nij,nij->n", linear, linear))
    flat = np.abs(np.linalg.det(linear)) <= _FLAT * size**3
    if flat.any():
        where = f"{culprit}: bones.{names[int(flat.argmax())]}"
        refuse(where, "a matrix that can be inverted", "this one flattens what it moves", "Correct it")


def _refuse_form(culprit: str, given: object) -> NoReturn:
    expected = f"{_FORMS}, no angle beyond {MOST_DEGREES:g}, nothing beyond {FARTHEST_MM:g}"
    refuse(culprit, expected, f"got {format_value(given, 80)}", "Correct it")


def _refuse_weights(weights: Mapping[str, object], names: tuple[str, ...], culprit: object) -> NoReturn:
    """Raise the error of the first weight that cannot be."""
    for name, weight in weights.items():
        if name not in names:
            _refuse_name(f"{culprit}: weights", name, names, "morph target")
        checked_number(f"{culprit}: weights.{name}", weight, -MOST_WEIGHT, MOST_WEIGHT)
    refuse(f"{culprit}: weights", "a number for each target", "got something else", "Correct it")


def _refuse_name(culprit: str, name: object, known: Iterable[str], kind: str) -> NoReturn:
    """Raise the error of a name that the head lacks, with those that are nearest to it."""
    names = list(known)
    if not names:
        actual = f"got {format_value(name)} and it has none"
        refuse(culprit, f"a {kind} of the head", actual, f"Load a glTF file with {kind}s, or leave it out")
    plain = {one.casefold(): one for one in names}
    near = difflib.get_close_matches(str(name)[:_LONGEST_NAME].casefold(), plain, _NEAR, 0.5)
    meant = f"Nearest: {', '.join(plain[one] for one in near)}" if near else f"It has {_some(names)}"
    refuse(culprit, f"a {kind} of the head", f"there is no {format_value(name)}", meant)


def _some(names: list[str]) -> str:
    shown = ", ".join(names[:8])
    return f"{shown} and {len(names) - 8} more" if len(names) > 8 else shown
