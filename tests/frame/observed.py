"""People observed with labels and landmarks, and measurements on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.frame.observation import Landmarks, Observation
from dermis.frame.renderer import Renderer
from dermis.human.labels.classes import class_number
from dermis.human.landmarks.sets import LANDMARK_SETS
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene.camera import Camera
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Mask = NDArray[np.bool_]

SIZE = 512
AROUND = 280.0
"""Height of the picture around the head [mm]."""
EDGE = 1.5
"""How near a landmark lies to the edge of what it marks [pixel]."""
IBUG = "face-synthetics-70"
SIDES = "right", "left"
SETTINGS = Settings(size=SIZE, atlas=128, shadow_size=64, samples=1)


def bare(head: Head) -> Head:
    return replace(head, hair=None)


def around(head: Head, degrees: float = 0.0) -> Camera:
    turn = np.radians(degrees)
    away = 1100 * np.array([np.sin(turn), 0.0, np.cos(turn)])
    middle = np.array([0.0, -20.0, 0.0]) - head.centre_mm
    return Camera(position=tuple(middle + away), target=tuple(middle), frame_mm=AROUND)


def marks(one: Observation, name: str = IBUG) -> Landmarks:
    return one.landmarks[name]


def labelled(one: Observation, *names: str) -> Mask:
    return np.isin(one.outputs["label"], [class_number(name) for name in names])


def from_edge(mask: Mask, place: NDArray[np.float64]) -> float:
    """Return the distance to the nearest border of a mask [pixels]."""
    beside, below = np.argwhere(mask[:, 1:] != mask[:, :-1]), np.argwhere(mask[1:] != mask[:-1])
    both = np.concatenate((np.add(beside, [0, 0.5]), np.add(below, [0.5, 0])))
    return float(np.linalg.norm(both[:, ::-1] - place, axis=1).min())


def people() -> dict[str, Scene]:
    """Return a person at rest, with one eye closed, from the side and turned; and another one."""
    mean, drawn = bare(Human(sex=0.5).head()), bare(Human.sampled(4).head())
    shut = Pose({"eyeBlinkLeft": 1.0, "jawOpen": 0.6})
    return {
        "mean": Scene(mean, camera=around(mean)),
        "shut": Scene(mean, camera=around(mean), pose=shut),
        "side": Scene(mean, camera=around(mean, 90.0)),
        "drawn": Scene(drawn, camera=around(drawn, 20.0)),
        "turned": Scene(mean, camera=around(mean), pose=Pose(bones={"head": (10.0, 20.0, 0.0)})),
    }


def observed(renderer: Renderer) -> dict[str, Observation]:
    """Return an observation of each person."""
    scenes = people()
    outputs = "label", "label_face_synthetics", "triangle", "depth"
    found = renderer.observe(scenes.values(), SETTINGS, outputs=outputs, landmarks=LANDMARK_SETS)
    return dict(zip(scenes, found, strict=True))
