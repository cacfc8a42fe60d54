"""Fit of the camera and of a person's shape to landmarks in a photograph, by least squares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.inputs import FitSubject, fit_subject
from dermis.apps.inverse.fitting.landmark_files import read_landmarks
from dermis.human.landmarks.points import LandmarkPoints, landmark_points
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE, human_targets
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.optics.media import Floats
from dermis.scene.camera import Camera

_LANDMARK_SD_FRACTION = 0.004
"""Standard deviation of a landmark's position, relative to the height of the photograph [-]."""
_LOG_FOCAL_SD = 0.3
"""Prior standard deviation of the logarithm of the focal length; the prior mean is that of a portrait."""
_PERSON_PARAMETERS = ("african", "asian", "caucasian", "sex", "age", "weight", "muscle")
_PERSON_PARAMETER_SD = 0.3
_SHAPE_TARGET_SD = 0.15
_SHAPE_TARGET_FOLDERS = ("head/", "forehead/", "eyes/", "nose/", "mouth/", "cheek/", "chin/")
_SHAPE_TARGET_SUFFIXES = ("-incr", "-up", "-out", "-forward", "-convex")
_LINEARISATION_COUNT = 2
_IDENTITY_STEP = 0.2  # step of finite differences, in standard deviations of the prior
_PORTRAIT_DISTANCE_MM = 1100.0
_PORTRAIT_HEIGHT_MM = 300.0


def align_to_landmarks(
    subject: FitSubject, landmark_file: str | Path, photo_size: tuple[int, int]
) -> FitSubject:
    """Fit the camera to landmarks in a photograph, and for a `Human` also the shape; return the new subject.

    For a `Human`, ancestry, sex, age, weight, muscle and details of the face are unknowns, with priors
    centred on the given person. Other heads keep their shape; the positions of their landmarks must be known.

    landmark_file : file with landmarks in the photograph
    photo_size : width and height of the photograph [pixel]

    Raises DermisError when the file or the head has no landmarks.
    """
    name, pixels_by_name = read_landmarks(landmark_file, photo_size)
    person, head = subject.person, subject.scene.head
    model = _LandmarkModel.for_head(person, head, name, pixels_by_name)
    pixels = np.array([pixels_by_name[one] for one in model.names])
    solution = np.concatenate([np.zeros(6), [_prior_log_focal(photo_size)], np.zeros(model.unknown_count)])
    solution[:3], solution[5] = (np.pi, 0.0, 0.0), _PORTRAIT_DISTANCE_MM
    for _ in range(_LINEARISATION_COUNT if person else 1):
        solution = _fit_camera_and_identity(model, pixels, photo_size, solution)
        if person is not None:
            person = model.person_with_identity(solution[7:])
            model = _LandmarkModel.for_head(person, head, name, pixels_by_name)
            solution[7:] = 0.0
    if person is not None:
        subject = fit_subject(person)
        solution = _fit_camera_and_identity(
            replace(model, derivatives=model.derivatives[:0]), pixels, photo_size, solution[:7]
        )
    return replace(subject, scene=replace(subject.scene, camera=_fitted_camera(solution, photo_size)))


@dataclass(frozen=True, eq=False)
class _LandmarkModel:
    """Linear model of landmark positions on a head, as a function of a person's shape parameters.

    names : names of the n landmarks
    positions : (n, 3) positions for the mean of the priors, relative to the head's centre [mm]
    derivatives : (u, n, 3) derivatives of the positions with respect to the u shape parameters, each of which
        is measured in standard deviations of its prior [mm]
    prior : person at the mean of the priors; None for heads of fixed shape
    details : names of the MakeHuman targets of the face; their weights are the last shape parameters, after
        ancestry, sex, age, weight and muscle
    """

    names: tuple[str, ...]
    positions: Floats
    derivatives: Floats
    prior: Human | None
    details: tuple[str, ...]

    @classmethod
    def for_head(
        cls, person: Human | None, head: Head, set_name: str, pixels_by_name: dict[str, Floats]
    ) -> _LandmarkModel:
        """Return the model of a person, or of a head of fixed shape, for the landmarks found in a photograph.

        set_name : name of the landmark set
        pixels_by_name : dictionary from landmark name to pixel coordinates (2,)
        """
        plain = head if person is None else replace(person, targets={}).head(subdivide=0)
        points = landmark_points(plain, set_name)
        indices = np.array([k for k, one in enumerate(points.names) if one in pixels_by_name])
        names = tuple(points.names[k] for k in indices)
        if person is None:
            positions = (
                _landmark_positions(points, indices, plain.positions_mm.astype(np.float64)) - plain.centre_mm
            )
            return cls(names, positions, np.zeros((0, *positions.shape)), None, ())
        centre = np.array(person.head(subdivide=0).centre_mm)
        targets = (one for one in human_targets() if one.startswith(_SHAPE_TARGET_FOLDERS))
        details = tuple(one for one in targets if one.endswith(_SHAPE_TARGET_SUFFIXES))

        def person_landmarks(changed_person: Human) -> Floats:
            return np.asarray(
                _landmark_positions(points, indices, changed_person.positions_mm.astype(np.float64)) - centre
            )

        model = cls(names, person_landmarks(person), np.zeros((0, 0, 3)), person, details)
        unknowns = range(len(_PERSON_PARAMETERS) + len(details))
        return replace(
            model, derivatives=np.stack([_landmark_derivative(model, person_landmarks, k) for k in unknowns])
        )

    @property
    def unknown_count(self) -> int:
        """Return the number of shape parameters that the fit determines; 0 for heads of fixed shape."""
        return len(self.derivatives)

    def person_with_identity(self, identity: Floats) -> Human:
        """Return the person of `prior` with changed shape parameters, which are clipped to their limits.

        identity : (u,) differences of the shape parameters from their values in `prior`, in standard
            deviations of their priors
        """
        assert self.prior is not None
        person_parameters: dict[str, Any] = {
            name: float(
                np.clip(
                    getattr(self.prior, name) + _person_parameter_sd(name) * step,
                    *_person_parameter_limits(name),
                )
            )
            for name, step in zip(_PERSON_PARAMETERS, identity, strict=False)
        }
        targets = dict(self.prior.targets)
        for name, step in zip(self.details, identity[len(_PERSON_PARAMETERS) :], strict=True):
            targets[name] = float(np.clip(targets.get(name, 0.0) + _SHAPE_TARGET_SD * step, -1.0, 1.0))
        return replace(self.prior, **person_parameters, targets=targets, skin=self.prior.look)


def _landmark_derivative(
    model: _LandmarkModel, person_landmarks: Callable[[Human], Floats], unknown_index: int
) -> Floats:
    """Return the derivative (n, 3) of landmark positions with respect to one shape parameter of the person.

    It is a one-sided finite difference: the parameter is increased, or decreased if it is at its upper limit.

    unknown_index : index of the shape parameter
    person_landmarks : function that returns the landmark positions (n, 3) of a person [mm]
    """
    for step in _IDENTITY_STEP, -_IDENTITY_STEP:
        identity = np.zeros(len(_PERSON_PARAMETERS) + len(model.details))
        identity[unknown_index] = step
        change = person_landmarks(model.person_with_identity(identity)) - model.positions
        if change.any():
            break
    return np.asarray(change / step)


def _prior_log_focal(photo_size: tuple[int, int]) -> float:
    """Return the logarithm of a usual portrait's focal length in pixels, which is the mean of the prior.

    photo_size : width and height of the photograph [pixel]
    """
    return float(np.log(photo_size[1] * _PORTRAIT_DISTANCE_MM / _PORTRAIT_HEIGHT_MM))


def _person_parameter_sd(parameter_name: str) -> float:
    return _PERSON_PARAMETER_SD * (OLD_AGE - YOUNG_AGE if parameter_name == "age" else 1.0)


def _person_parameter_limits(parameter_name: str) -> tuple[float, float]:
    return {"age": (YOUNG_AGE, OLD_AGE), "weight": (-1.0, 1.0), "muscle": (-1.0, 1.0)}.get(
        parameter_name, (0.01, 1.0)
    )


def _landmark_positions(
    landmark_points: LandmarkPoints, landmark_indices: NDArray[np.int64], positions: Floats
) -> Floats:
    return np.asarray(
        np.einsum(
            "nk,nkc->nc",
            landmark_points.weight[landmark_indices],
            positions[landmark_points.point[landmark_indices]],
        )
    )


def _fit_camera_and_identity(
    model: _LandmarkModel, landmark_pixels: Floats, photo_size: tuple[int, int], start_unknowns: Floats
) -> Floats:
    """Fit the camera and the person's shape to landmarks; return the unknowns (7 + u,).

    They are a rotation vector (3), a translation (3) [mm], the logarithm of the focal length in pixels, and
    the u shape parameters, as differences from the means of their priors in standard deviations.

    landmark_pixels : (n, 2) landmarks in the photograph
    photo_size : width and height of the photograph [pixel]
    start_unknowns : (7 + u,) unknowns to start from, in the order of the result
    """
    from scipy.optimize import least_squares

    prior_median = _prior_log_focal(photo_size)

    def residuals(unknowns: Floats) -> Floats:
        positions = model.positions + np.einsum("u,unc->nc", unknowns[7:], model.derivatives)
        error = (_project_landmarks(unknowns, positions, photo_size) - landmark_pixels) / (
            _LANDMARK_SD_FRACTION * photo_size[1]
        )
        return np.concatenate([error.ravel(), [(unknowns[6] - prior_median) / _LOG_FOCAL_SD], unknowns[7:]])

    scale = np.concatenate([np.full(3, 0.1), (10.0, 10.0, 100.0), [0.1], np.ones(model.unknown_count)])
    return np.asarray(least_squares(residuals, start_unknowns, x_scale=scale, loss="soft_l1").x, np.float64)


def _project_landmarks(camera_unknowns: Floats, positions: Floats, photo_size: tuple[int, int]) -> Floats:
    """Project positions (n, 3) into the photograph; return pixels (n, 2).

    camera_unknowns : (7 + u,) unknowns in the order of `_fit_camera_and_identity`; only the first seven,
        which describe the camera, are used
    """
    from scipy.spatial.transform import Rotation

    camera_space = positions @ Rotation.from_rotvec(camera_unknowns[:3]).as_matrix().T + camera_unknowns[3:6]
    return np.asarray(
        np.exp(camera_unknowns[6]) * camera_space[:, :2] / camera_space[:, 2:]
        + (np.array(photo_size) - 1.0) / 2.0
    )


def _fitted_camera(camera_unknowns: Floats, photo_size: tuple[int, int]) -> Camera:
    from scipy.spatial.transform import Rotation

    focal, (cx, cy) = float(np.exp(camera_unknowns[6])), (np.array(photo_size) - 1.0) / 2.0
    K = [[focal, 0.0, cx], [0.0, focal, cy], [0.0, 0.0, 1.0]]
    return Camera.from_opencv(
        K, Rotation.from_rotvec(camera_unknowns[:3]).as_matrix(), camera_unknowns[3:6], photo_size
    )
