"""From the parameters of an image to what is to be seen."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dermis.apps.batch.cameras import camera_of, face_points
from dermis.apps.batch.lighting import lights_of, towards
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import ANGLES, NONE
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

_ALL_HAIRS_PIXELS = 1000  # a side of the pictures from which on all hairs can be told apart, at 230 mm
_LEAST_HAIRS = 0.2
_FAR_MM = 1e4  # where eyes look that look nowhere
_PARTS = "skin", "eyes", "hair", "targets"
_SEED, _HEAD = "person.seed", "person.head"
_KEPT_DRAWN, _KEPT_NAMED = 1, 8  # people of seeds, of whom none comes again; heads by name, which do
_UNKNOWING = {"person.number", _SEED, _HEAD}


@dataclass(frozen=True)
class _Seen:
    """A head with what it is seen by.

    points : of its face, see `face_points`
    bones : by name, which share of a turn of the head each takes
    skin : of the person, before the spec's dials
    """

    head: Head
    points: NDArray[np.int32]
    bones: Mapping[str, float]
    skin: Skin


class SceneMaker:
    """Makes the scenes of a data set; people that may come again are kept, and change no result."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self._people: OrderedDict[tuple[Any, ...], _Seen] = OrderedDict()

    def scene(self, parameters: Mapping[str, Any]) -> tuple[Scene, Settings]:
        """The scene of an image and how it is computed, by the parameters alone.

        parameters : as `Spec.parameters` has them

        Raises DermisError for heads and environments that cannot be read.
        """
        seen = self._person(parameters)
        head, width_height = seen.head, self.spec.size
        pose = Pose(self._weights(parameters, head), _turns(_turned(parameters), seen.bones))
        motion = pose.motion(head.control)
        camera = camera_of(parameters, head, seen.points, motion, width_height[0] / width_height[1])
        looking = _looking(parameters, head, pose, camera.position)
        dials = _below(parameters, "skin")
        if "profile" in dials:
            dials["profile"] = self._named(dials["profile"])
        scene = Scene(
            head,
            lights=lights_of(parameters),
            camera=camera,
            skin=seen.skin.replace(**dials) if dials else seen.skin,
            environment=self._environment(parameters),
            pose=looking,
        )
        return scene, self.spec.render.replace(**_background(parameters))

    def _person(self, parameters: Mapping[str, Any]) -> _Seen:
        key = tuple((name, one) for name, one in parameters.items() if _makes(name))
        if key not in self._people:
            self._people[key] = self._made(parameters)
        self._people.move_to_end(key)
        while len(self._people) > (_KEPT_NAMED if _HEAD in parameters else _KEPT_DRAWN):
            self._people.popitem(last=False)
        return self._people[key]

    def _made(self, parameters: Mapping[str, Any]) -> _Seen:
        if _HEAD in parameters:
            head, skin = self._loaded(self._named(parameters[_HEAD]))
        else:
            person = drawn_person(parameters)
            size = self.spec.size
            head = person.head(subdivide=_levels(size), hairs=_hairs(size))
            skin = skin_of(person)
        return _Seen(head, face_points(head), turning_bones(head.control.skeleton).head, skin)

    def _loaded(self, name: str) -> tuple[Head, Skin]:
        """A head by its name, with the skin of the scene that it is of."""
        if Path(name).suffix.lower() == ".toml":
            scene, _ = load_scene(name, size=self.spec.size)
            return scene.head, scene.skin
        return load_head(name, subdivide=SmoothIn(size=self.spec.size)), Skin()

    def _named(self, name: str) -> str:
        """The file of a name in the spec's folder, else the name, of something in the package."""
        file = self.spec.folder / name
        return str(file) if is_file(file) else name

    def _weights(self, parameters: Mapping[str, Any], head: Head) -> dict[str, float]:
        """Weights of the targets that the head has, and of those that the spec's [pose] names."""
        own = self.spec.own_targets
        return {
            name: weight
            for name, weight in _below(parameters, "pose").items()
            if weight and (name in own or name in head.control.target_index)
        }

    def _environment(self, parameters: Mapping[str, Any]) -> Environment | None:
        name = parameters["environment.name"]
        if name == NONE:
            return None
        turn, strength = parameters["environment.turn_deg"], parameters["environment.strength"]
        return Environment(name=self._named(name), rotation_degrees=turn, exposure=strength)


def drawn_person(parameters: Mapping[str, Any]) -> Human:
    """The person of a seed, with what the parameters say instead of what that draws."""
    given: dict[str, Any] = {}
    for name, value in _below(parameters, "person").items():
        part, _, field = name.partition(".")
        if field:
            given.setdefault(part, {})[field] = value
        elif f"person.{name}" not in _UNKNOWING:
            given[name] = value
    return Human.drawn(int(parameters[_SEED]), **given)


@cache
def _levels(size: tuple[int, int]) -> int:
    """Levels of subdivision, alike for all drawn people, who share their topology then."""
    return max(LEAST_OF_PEOPLE, SmoothIn(size=size)(Human().head(subdivide=0)))


def _hairs(size: tuple[int, int]) -> float:
    """Share of the hairs that grows: no more than a picture of this size can tell apart."""
    return min(1.0, max(_LEAST_HAIRS, max(size) / _ALL_HAIRS_PIXELS))


def _makes(name: str) -> bool:
    """Whether a parameter makes a person what it is."""
    return name.startswith("person.") and name != "person.number"


def _below(parameters: Mapping[str, Any], table: str) -> dict[str, Any]:
    start = f"{table}."
    return {name.removeprefix(start): one for name, one in parameters.items() if name.startswith(start)}


def _turned(parameters: Mapping[str, Any]) -> NDArray[np.float64]:
    """(3, 3) the turn of the head."""
    nod, turn, tilt = (parameters[f"head.{name}_deg"] for name in ("pitch", "yaw", "roll"))
    return np.array(angles_matrix((nod, turn, tilt)))


def _turns(turned: NDArray[np.float64], bones: Mapping[str, float]) -> dict[str, tuple[float, float, float]]:
    """Angles of the bones that turn the head together.

    turned : (3, 3) the turn of the head
    bones : by name, which share of it each takes
    """
    about = Rotation.from_matrix(turned).as_rotvec()
    shares = {
        share: matrix_angles(Rotation.from_rotvec(share * about).as_matrix()) for share in {*bones.values()}
    }
    return {name: shares[share] for name, share in bones.items()}


def _looking(
    parameters: Mapping[str, Any], head: Head, pose: Pose, camera_mm: tuple[float, float, float]
) -> Pose:
    """The pose with the eyes turned, where the head has eyes that turn."""
    if head.eyes is None or head.control.skeleton is None:
        return pose
    place = np.array(camera_mm)
    if parameters["gaze.at"] == ANGLES:
        ahead = towards(parameters["gaze.yaw_deg"], -parameters["gaze.pitch_deg"])
        place = _turned(parameters) @ np.array(ahead) * _FAR_MM
    return looking_at(head, place, pose)


def _background(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of what is behind the head."""
    kind = parameters["background.kind"]
    if kind == "colour":
        return {"background": tuple(parameters[f"background.{one}"] for one in ("red", "green", "blue"))}
    return {"background": kind, "background_blur": parameters.get("background.blur", 0.0)}
