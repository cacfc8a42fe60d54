"""Proportions of sampled faces vary as those of adults do."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Human
from dermis.human.landmarks.points import landmark_points

COUNT = 160
DISTANCES = {  # landmarks of iBUG's set, and the range of the standard deviation within a sex [mm]
    "inner eye corners": (39, 42, 1.5, 3.2),  # [Bouhadana2022]
    "outer eye corners": (36, 45, 1.9, 4.9),  # the next four: up to table 9 of doi 10.1186/s40902-019-0191-7
    "mouth": (48, 54, 2.4, 4.0),
    "nose": (31, 35, 2.0, 4.1),
    "face from nasion to chin": (27, 8, 3.6, 7.0),
}


@cache
def landmarks_mm() -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the landmarks (n, 68, 3) of sampled people, and whether each is a man."""
    points = landmark_points(Human().head(subdivide=0), "ibug-68")
    people = [Human.sampled(seed) for seed in range(COUNT)]
    marks = [(person.positions_mm[points.point] * points.weight[..., None]).sum(axis=1) for person in people]
    return np.array(marks, np.float64), np.array([person.sex > 0.5 for person in people])


@pytest.mark.parametrize("name", DISTANCES)
def test_distances_vary_as_published(name: str) -> None:
    one, other, least, most = DISTANCES[name]
    marks, men = landmarks_mm()
    distance = np.linalg.norm(marks[:, one] - marks[:, other], axis=1)
    for group in (men, ~men):
        assert least < distance[group].std() < most


def test_no_face_is_a_caricature() -> None:
    """Compare distances with the mean of the sex: none deviates by more than 4 standard deviations."""
    marks, men = landmarks_mm()
    for one, other, _, _ in DISTANCES.values():
        distance = np.linalg.norm(marks[:, one] - marks[:, other], axis=1)
        for group in (men, ~men):
            deviation = (distance[group] - distance[group].mean()) / distance[group].std()
            assert np.abs(deviation).max() < 4
