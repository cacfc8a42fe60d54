"""Scene of an image by its sampled parameters."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dermis.apps.batch.cameras import sampled_camera, face_points
from dermis.apps.batch.lighting import sampled_lights, direction_from_angles
from dermis.apps.batch.sampling import Parameters, table_numbers
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import ANGLES, NONE, table_of
from dermis.base.reading import is_file
from dermis.formats.motion.captures import turning_bones
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import angles_matrix, matrix_angles
from dermis.scene.environment import Environment
from dermis.scene.files import load_scene
from dermis.scene.gaze import looking_at
from dermis.scene.heads import LEAST_OF_PEOPLE, load_head
from dermis.scene.model import Scene
from dermis.scene.people import skin_of
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.smoothness import SmoothIn

_ALL_HAIRS_PIXELS = 1000  # side of pictures that resolve all hairs, at 230 mm
_LEAST_HAIRS = 0.2
_FAR_MM = 1e4  # distance of a gaze by angles
_SEED, _HEAD = "person.seed", "person.head"
_KEPT_SAMPLED, _KEPT_NAMED = 1, 8  # sampled people do not return, heads by name do
_NO_FIELDS = "number", "seed", "head"  # of a `Human`


@dataclass(frozen=True)
class _Person:
    """Head with what does not depend on the image.

    points : of its face, see `face_points`
    bones : by name, the share of a rotation of the head that each takes
    skin : of the person, before the spec's dials
    """

    head: Head
    points: NDArray[np.int32]
    bones: Mapping[str, float]
    skin: Skin


class SceneBuilder:
    """Maker of the scenes of a data set; keeps people that may return, which changes no result."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self._people: OrderedDict[frozenset[tuple[str, float | str]], _Person] = OrderedDict()

    def scene(self, parameters: Parameters) -> tuple[Scene, Settings]:
        """Return the scene of an image and its settings, which depend on the parameters alone.

        parameters : see `Spec.parameters`

        Raises DermisError for heads and environments that cannot be read.
        """
        person = self._person(parameters)
        head, (width, height) = person.head, self.spec.size
        pose = Pose(self._weights(parameters, head), _bone_angles(_head_rotation(parameters), person.bones))
        motion = pose.motion(head.control)
        camera = sampled_camera(parameters, head, person.points, motion, width / height)
        dials = table_of(parameters, "skin")
        if "profile" in dials:
            dials["profile"] = self._path(dials["profile"])
        scene = Scene(
            head,
            lights=sampled_lights(parameters),
            camera=camera,
            skin=person.skin.replace(**dials) if dials else person.skin,
            environment=self._environment(parameters),
            pose=_with_gaze(parameters, head, pose, camera.position),
        )
        return scene, self.spec.render.replace(**_background(parameters))

    def _person(self, parameters: Parameters) -> _Person:
        own = table_of(parameters, "person")
        key = frozenset((name, one) for name, one in own.items() if name != "number")
        if key not in self._people:
            self._people[key] = self._new_person(parameters)
        self._people.move_to_end(key)
        while len(self._people) > (_KEPT_NAMED if _HEAD in parameters else _KEPT_SAMPLED):
            self._people.popitem(last=False)
        return self._people[key]

    def _new_person(self, parameters: Parameters) -> _Person:
        size = self.spec.size
        if _HEAD not in parameters:
            human = sampled_person(parameters)
            head, skin = human.head(subdivide=_levels(size), hairs=_hairs(size)), skin_of(human)
        elif Path(name := self._path(parameters[_HEAD])).suffix.lower() == ".toml":
            scene, _ = load_scene(name, size=size)
            head, skin = scene.head, scene.skin
        else:
            head, skin = load_head(name, subdivide=SmoothIn(size=size)), Skin()
        return _Person(head, face_points(head), turning_bones(head.control.skeleton).head, skin)

    def _path(self, name: float | str) -> str:
        """Return the path of a file in the spec's folder, else the name, of something in the package."""
        file = self.spec.folder / str(name)
        return str(file) if is_file(file) else str(name)

    def _weights(self, parameters: Parameters, head: Head) -> dict[str, float]:
        """Return weights of the targets that the head has, and of those that the spec's [pose] names."""
        own = self.spec.own_targets
        return {
            name: weight
            for name, weight in table_numbers(parameters, "pose").items()
            if weight and (name in own or name in head.control.target_index)
        }

    def _environment(self, parameters: Parameters) -> Environment | None:
        if parameters["environment.name"] == NONE:
            return None
        numbers = table_numbers(parameters, "environment")
        name = self._path(parameters["environment.name"])
        return Environment(name=name, rotation_degrees=numbers["turn_deg"], exposure=numbers["strength"])


def sampled_person(parameters: Parameters) -> Human:
    """Return the person of a seed, with the fields that the parameters give in place of sampled ones."""
    fields: dict[str, object] = {}
    looks: dict[str, dict[str, object]] = {}
    for name, value in table_of(parameters, "person").items():
        part, _, field = name.partition(".")
        if field:
            looks.setdefault(part, {})[field] = value
        elif name not in _NO_FIELDS:
            fields[name] = value
    return Human.drawn(int(parameters[_SEED]), **fields, **looks)


@cache
def _levels(size: tuple[int, int]) -> int:
    """Return the levels of subdivision, equal for all sampled people so that they share their topology."""
    return max(LEAST_OF_PEOPLE, SmoothIn(size=size)(Human().head(subdivide=0)))


def _hairs(size: tuple[int, int]) -> float:
    """Return the share of hairs that grows: no more than a picture of this size resolves."""
    return min(1.0, max(_LEAST_HAIRS, max(size) / _ALL_HAIRS_PIXELS))


def _head_rotation(parameters: Parameters) -> NDArray[np.float64]:
    """Return the rotation matrix of the head (3, 3)."""
    turn = table_numbers(parameters, "head")
    return np.array(angles_matrix((turn["pitch_deg"], turn["yaw_deg"], turn["roll_deg"])))


def _bone_angles(
    rotation: NDArray[np.float64], bones: Mapping[str, float]
) -> dict[str, tuple[float, float, float]]:
    """Return the angles of the bones that turn the head together.

    rotation : (3, 3) of the head
    bones : by name, the share of it that each takes
    """
    vector = Rotation.from_matrix(rotation).as_rotvec()
    shares = {
        share: matrix_angles(Rotation.from_rotvec(share * vector).as_matrix()) for share in {*bones.values()}
    }
    return {name: shares[share] for name, share in bones.items()}


def _with_gaze(parameters: Parameters, head: Head, pose: Pose, camera_mm: tuple[float, float, float]) -> Pose:
    """Return the pose with the eyes turned, where the head has eyes that turn."""
    if head.eyes is None or head.control.skeleton is None:
        return pose
    target = np.array(camera_mm)
    if parameters["gaze.at"] == ANGLES:
        gaze = table_numbers(parameters, "gaze")
        direction = np.array(direction_from_angles(gaze["yaw_deg"], -gaze["pitch_deg"]))
        target = _head_rotation(parameters) @ direction * _FAR_MM
    return looking_at(head, target, pose)


def _background(parameters: Parameters) -> dict[str, object]:
    """Return the settings of the background."""
    kind = parameters["background.kind"]
    if kind == "colour":
        return {"background": tuple(parameters[f"background.{one}"] for one in ("red", "green", "blue"))}
    return {"background": kind, "background_blur": parameters.get("background.blur", 0.0)}
