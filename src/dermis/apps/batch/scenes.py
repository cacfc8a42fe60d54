"""Scenes of a data set's images, built from the sampled parameters of each image."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dermis.apps.batch.blur.samples import (
    FOCUS_FACT_NAMES,
    Aperture,
    aperture_points,
    camera_at,
    shutter_times_ms,
    thin_lens,
)
from dermis.apps.batch.cameras import camera_behind_lens, face_hull_indices, sampled_camera, sampled_lens
from dermis.apps.batch.clips.capture import capture_pose, moves_eyes, with_capture
from dermis.apps.batch.clips.frames import PULSE_NAMES, VIEW_NAME
from dermis.apps.batch.clips.motion import clip_pulse, pulse_time_s
from dermis.apps.batch.clips.table import GENERATED_MOTION
from dermis.apps.batch.face_boxes import BoxPoints, box_points, face_boxes
from dermis.apps.batch.image_facts import ImageFacts, person_facts
from dermis.apps.batch.lighting import direction_from_angles, light_colour, sampled_lights
from dermis.apps.batch.sampling import Parameters, round_significant, table_numbers
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import GAZE_ANGLES, NO_ENVIRONMENT, PICTURE_BACKGROUND, table_values
from dermis.base.reading import is_file
from dermis.formats.motion.captures import find_rotation_bones
from dermis.human.person import Human
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import angles_matrix, matrix_angles
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.files import load_scene
from dermis.scene.gaze import looking_at
from dermis.scene.head_pose import gaze_errors_deg
from dermis.scene.heads import MIN_HUMAN_SUBDIVISION_LEVELS, is_person_name, load_head, load_person
from dermis.scene.model import Scene
from dermis.scene.motion import load_motion
from dermis.scene.opencv import OpenCvCamera
from dermis.scene.people import skin_of
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.smoothness import SmoothOutlineLevels

_FULL_HAIR_PICTURE_SIDE = 1000  # side from which pictures have all hairs [pixel]; a close-up shows 230 mm
_MIN_FRACTION_OF_STRANDS = 0.2
_GAZE_DISTANCE_MM = 1e4  # distance of the gaze target if the gaze is given by angles
_SEED_PARAMETER, _HEAD_PARAMETER = "person.seed", "person.head"
_MAX_CACHED_SAMPLED_PEOPLE = 1  # a sampled person is not used again
_MAX_CACHED_FILE_HEADS = 8
_IDENTITY_PARAMETERS = "number", "seed", "head"  # parameters of people that are not fields of `Human`


@dataclass(frozen=True)
class _Person:
    """Head and skin of a person, with all data that does not change between the person's images.

    points : indices of points that must stay in the picture, see `face_hull_indices`
    boxes : indices of the points that bound the face and the head, see `box_points`
    bones : fraction of the head's rotation that each bone performs, by bone name
    skin : skin of the person, before the [skin] table of the spec is applied
    facts : properties of the person, see `person_facts`; empty for meshes from files
    """

    head: Head
    points: NDArray[np.int32]
    bones: Mapping[str, float]
    skin: Skin
    boxes: BoxPoints
    facts: Mapping[str, float | str | None]


class SceneBuilder:
    """Builder of the scenes of a data set, which caches people between images."""

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self._latest_capture: tuple[Head, str, Clip] | None = None
        self._people: OrderedDict[frozenset[tuple[str, float | str]], _Person] = OrderedDict()

    def build(self, parameters: Parameters) -> tuple[Scene, Settings]:
        """Return the scene and render settings of an image, which depend only on the image's parameters.

        parameters : sampled parameters of the image, from `Spec.parameters`

        Raises DermisError for heads and environments that cannot be read.
        """
        person = self._cached_person(parameters)
        head, pose = person.head, self._sampled_pose(parameters, person)
        base, lens = self._sampled_camera(parameters, person, pose), sampled_lens(parameters)
        camera = self._rig_camera(parameters, base)
        if lens is not None:
            camera = camera_behind_lens(camera, lens, self.spec.size)
        skin_values = table_values(parameters, "skin")
        if "profile" in skin_values:
            skin_values["profile"] = self._resolve_file(skin_values["profile"])
        scene = Scene(
            head,
            lights=sampled_lights(parameters),
            camera=camera,
            skin=person.skin.replace(**skin_values) if skin_values else person.skin,
            environment=self._sampled_environment(parameters),
            pose=self._pose_with_gaze(parameters, head, pose, base.position),
            state={name: one for name, one in table_numbers(parameters, "state").items() if one} or None,
        )
        if PULSE_NAMES[0] in parameters:
            seed, clip = int(parameters[PULSE_NAMES[0]]), table_numbers(parameters, "clip")
            scene = clip_pulse(seed, clip).scene_at(scene, pulse_time_s(seed, clip, clip["time_s"]))
        return scene, self.spec.render.replace(**_background_settings(parameters))

    def blur_scenes(self, image_number: int, parameters: Parameters, scene: Scene) -> tuple[Scene, ...]:
        """Return the scenes whose average is the picture of an image; empty for sharp pictures.

        scene : scene of the image at the middle of the exposure and of the aperture
        """
        table = self.spec.blur
        if table is None:
            return ()
        aperture, count = self._aperture(parameters, scene), table.samples
        times_ms = shutter_times_ms(count, float(parameters["blur.shutter_ms"]))
        found = []
        for point, time_ms in zip(aperture_points(count), times_ms.tolist(), strict=True):
            moved = scene
            if time_ms and self.spec.clip is not None:
                offset = 1e-3 * time_ms * self.spec.clip.rate_hz
                moved, _ = self.build(self.spec.neighbour_parameters(image_number, offset))
            found.append(moved.replace(camera=camera_at(scene.camera, aperture, point, self.spec.size)))
        return tuple(found)

    def _aperture(self, parameters: Parameters, scene: Scene) -> Aperture:
        """Return the aperture of an image's lens, which focuses on the nearer eye or the nearest point."""
        person, rig = self._cached_person(parameters), scene.head.control_rig
        pose = rig.rest if scene.pose_arrays is None else scene.pose_arrays
        indices = person.points if scene.head.eyes is None else scene.head.eyes.apex
        points = rig.pose_points(indices, pose) - np.array(scene.head.centre_mm)
        values = table_numbers(parameters, "blur")
        camera = self._rig_camera(parameters, self._base_camera(parameters, person))  # with the focal length
        return thin_lens(points, camera, values["f_number"], values.get("focus_mm", 0.0))

    def _blur_facts(self, parameters: Parameters, scene: Scene) -> dict[str, float]:
        if self.spec.blur is None or not parameters["blur.f_number"]:
            return {}
        aperture = self._aperture(parameters, scene)
        values = aperture.focus_depth_mm, aperture.diameter_mm
        return {name: round_significant(one) for name, one in zip(FOCUS_FACT_NAMES, values, strict=True)}

    def facts(self, parameters: Parameters, scene: Scene) -> ImageFacts:
        """Return the facts about an image that its record contains in addition to the parameters.

        scene : scene of the image, from `build`
        """
        person, size = self._cached_person(parameters), self.spec.size
        pose = scene.head.control_rig.rest if scene.pose_arrays is None else scene.pose_arrays
        base, lens = self._base_camera(parameters, person), sampled_lens(parameters)
        # with a lens, the camera of the scene shows what the lens shows, with another focal length
        picture_camera = self._rig_camera(parameters, base).to_opencv(size)
        errors = gaze_errors_deg(scene, _gaze_target(parameters, base.position))
        has_gaze_error = _has_turning_eyes(scene.head) and not self._captures_gaze(parameters, scene.head)
        captured = self._captured_pose(parameters, person.head)
        return ImageFacts(
            person.facts,
            errors if has_gaze_error else None,
            face_boxes(scene.head, person.boxes, pose, picture_camera, lens),
            None if self.spec.sensor is None else light_colour(scene),
            picture_camera.K,
            captured={} if captured is None else _recorded_weights(captured, parameters),
            rig=self._rig_cameras(parameters, base),
            blur=self._blur_facts(parameters, scene),
        )

    def _rig_camera(self, parameters: Parameters, base: Camera) -> Camera:
        """Return the camera of an image's view, without the distortion of its lens.

        base : camera that the table [camera] places
        """
        rig = self.spec.cameras
        if rig is None:
            return base
        return rig.camera(int(parameters[VIEW_NAME]), base, table_numbers(parameters, "rig"), self.spec.size)

    def _rig_cameras(self, parameters: Parameters, base: Camera) -> dict[str, OpenCvCamera]:
        """Return the cameras of the rig by name; empty for a spec with one camera."""
        rig = self.spec.cameras
        names = () if rig is None else rig.names
        return {
            name: self._rig_camera({**parameters, VIEW_NAME: view}, base).to_opencv(self.spec.size)
            for view, name in enumerate(names)
        }

    def _sampled_pose(self, parameters: Parameters, person: _Person) -> Pose:
        weights = self._pose_weights(parameters, person.head)
        pose = Pose(weights, _bone_angles(_head_rotation(parameters), person.bones))
        captured = self._captured_pose(parameters, person.head)
        return pose if captured is None else with_capture(pose, captured)

    def _capture(self, parameters: Parameters, head: Head) -> Clip | None:
        name = parameters.get("clip.motion", GENERATED_MOTION)
        if name == GENERATED_MOTION:
            return None
        path = self._resolve_file(name)
        latest = self._latest_capture
        if latest is None or latest[0] is not head or latest[1] != path:
            latest = self._latest_capture = head, path, load_motion(path, head)
        return latest[2]

    def _captured_pose(self, parameters: Parameters, head: Head) -> Pose | None:
        capture, clip = self._capture(parameters, head), self.spec.clip
        if capture is None or clip is None:
            return None
        start, time_s = float(parameters["clip.motion_start"]), float(parameters["clip.time_s"])
        return capture_pose(capture, start, time_s, clip.frames / clip.rate_hz, 1.0 / clip.rate_hz)

    def _captures_gaze(self, parameters: Parameters, head: Head) -> bool:
        capture = self._capture(parameters, head)
        return capture is not None and moves_eyes(capture)

    def _pose_with_gaze(
        self, parameters: Parameters, head: Head, pose: Pose, camera_position_mm: tuple[float, float, float]
    ) -> Pose:
        """Return the pose with eyes rotated towards the gaze, if they can rotate and no capture does so.

        camera_position_mm : position of the camera, the default gaze target [mm]
        """
        if not _has_turning_eyes(head) or self._captures_gaze(parameters, head):
            return pose
        return looking_at(head, _gaze_target(parameters, camera_position_mm), pose)

    def _base_camera(self, parameters: Parameters, person: _Person) -> Camera:
        """Return the camera that the table [camera] places, without the distortion of its lens."""
        return self._sampled_camera(parameters, person, self._sampled_pose(parameters, person))

    def _sampled_camera(self, parameters: Parameters, person: _Person, pose: Pose) -> Camera:
        """Return the camera of an image without the distortion of its lens."""
        width, height = self.spec.size
        if self.spec.clip is not None:  # the camera does not follow the motion
            pose = Pose({}, _bone_angles(_resting_head_rotation(parameters), person.bones))
        pose_arrays = pose.to_arrays(person.head.control_rig)
        return sampled_camera(parameters, person.head, person.points, pose_arrays, width / height)

    def _cached_person(self, parameters: Parameters) -> _Person:
        values = table_values(parameters, "person")
        key = frozenset((name, value) for name, value in values.items() if name != "number")
        if key not in self._people:
            self._people[key] = self._build_person(parameters)
        self._people.move_to_end(key)
        while len(self._people) > (
            _MAX_CACHED_FILE_HEADS if _HEAD_PARAMETER in parameters else _MAX_CACHED_SAMPLED_PEOPLE
        ):
            self._people.popitem(last=False)
            self._latest_capture = None
        return self._people[key]

    def _build_person(self, parameters: Parameters) -> _Person:
        size, facts = self.spec.size, dict[str, float | str | None]()
        if _HEAD_PARAMETER not in parameters:
            human = sampled_person(parameters)
            facts = person_facts(human)
            head = human.head(subdivide=_subdivision_levels(size), hairs=_hair_count_fraction(size))
            skin = skin_of(human)
        elif Path(name := self._resolve_file(parameters[_HEAD_PARAMETER])).suffix.lower() == ".toml":
            scene, _ = load_scene(name, size=size)
            head, skin = scene.head, scene.skin
        else:
            head, skin = load_head(name, subdivide=SmoothOutlineLevels(size=size)), Skin()
            if is_person_name(name):
                human = load_person(name)
                facts, skin = person_facts(human), skin_of(human)
        bones = find_rotation_bones(head.control_rig.skeleton).head
        return _Person(head, face_hull_indices(head), bones, skin, box_points(head), facts)

    def _resolve_file(self, head_or_panorama: float | str) -> str:
        """Return the path of a head or panorama file, or the argument if it names no file.

        File names are relative to the spec's folder.
        """
        file = self.spec.folder / str(head_or_panorama)
        return str(file) if is_file(file) else str(head_or_panorama)

    def _pose_weights(self, parameters: Parameters, head: Head) -> dict[str, float]:
        """Return the non-zero weights of an image's morph targets, by name.

        Targets that the head lacks are omitted, except those that the [pose] table of the spec sets.
        """
        posed = self.spec.pose_targets
        return {
            name: weight
            for name, weight in table_numbers(parameters, "pose").items()
            if weight and (name in posed or name in head.control_rig.target_index)
        }

    def _sampled_environment(self, parameters: Parameters) -> Environment | None:
        if parameters["environment.name"] == NO_ENVIRONMENT:
            return None
        numbers = table_numbers(parameters, "environment")
        name = self._resolve_file(parameters["environment.name"])
        return Environment(name=name, rotation_degrees=numbers["turn_deg"], exposure=numbers["strength"])


def sampled_person(parameters: Parameters) -> Human:
    """Return the person of an image: a random person, in whom sampled parameters replace random values.

    parameters : sampled parameters of the image, including the seed of the random person
    """
    fields: dict[str, object] = {}
    appearance: dict[str, dict[str, object]] = {}
    for name, value in table_values(parameters, "person").items():
        part, _, field = name.partition(".")
        if field:
            appearance.setdefault(part, {})[field] = value
        elif name not in _IDENTITY_PARAMETERS:
            fields[name] = value
    return Human.sampled(int(parameters[_SEED_PARAMETER]), **fields, **appearance)


@cache
def _subdivision_levels(picture_size: tuple[int, int]) -> int:
    """Return the number of times that heads are subdivided for a picture size [pixel].

    The number is the same for all sampled people, so that all their heads have the same topology.
    """
    return max(
        MIN_HUMAN_SUBDIVISION_LEVELS, SmoothOutlineLevels(size=picture_size)(Human().head(subdivide=0))
    )


def _hair_count_fraction(picture_size: tuple[int, int]) -> float:
    """Return which fraction of a person's hairs is generated; it is smaller for small pictures.

    picture_size : width and height of the picture [pixel]
    """
    return min(1.0, max(_MIN_FRACTION_OF_STRANDS, max(picture_size) / _FULL_HAIR_PICTURE_SIDE))


def _recorded_weights(captured: Pose, parameters: Parameters) -> dict[str, float]:
    """Return the weights of a captured pose for the targets that records list, by name of the parameter."""
    weights = {f"pose.{name}": round_significant(weight) for name, weight in captured.weights.items()}
    return {name: weight for name, weight in weights.items() if name in parameters}


def _head_rotation(parameters: Parameters) -> NDArray[np.float64]:
    """Return the rotation matrix (3, 3) of the head for its sampled pitch, yaw and roll, with its motion."""
    rotation, moved = _resting_head_rotation(parameters), table_numbers(parameters, "clip")
    if "head_yaw_deg" not in moved:
        return rotation
    angles = moved["head_pitch_deg"], moved["head_yaw_deg"], moved["head_roll_deg"]
    return np.asarray(rotation @ np.array(angles_matrix(angles)))


def _resting_head_rotation(parameters: Parameters) -> NDArray[np.float64]:
    head = table_numbers(parameters, "head")
    return np.array(angles_matrix((head["pitch_deg"], head["yaw_deg"], head["roll_deg"])))


def _bone_angles(
    head_rotation: NDArray[np.float64], rotation_fractions: Mapping[str, float]
) -> dict[str, tuple[float, float, float]]:
    """Return the rotation angles of the bones that together rotate the head, by bone name [degrees].

    head_rotation : (3, 3) rotation matrix of the head
    rotation_fractions : fraction of the rotation that each bone performs, by bone name
    """
    vector = Rotation.from_matrix(head_rotation).as_rotvec()
    angles = {
        fraction: matrix_angles(Rotation.from_rotvec(fraction * vector).as_matrix())
        for fraction in {*rotation_fractions.values()}
    }
    return {name: angles[fraction] for name, fraction in rotation_fractions.items()}


def _has_turning_eyes(head: Head) -> bool:
    return head.eyes is not None and head.control_rig.skeleton is not None


def _gaze_target(
    parameters: Parameters, camera_position_mm: tuple[float, float, float]
) -> NDArray[np.float64]:
    """Return the target (3,) of the gaze in an image, relative to the head's centre [mm]."""
    axes = _resting_head_rotation(parameters)
    if parameters["gaze.at"] != GAZE_ANGLES:
        target = np.array(camera_position_mm)
    else:
        gaze = table_numbers(parameters, "gaze")
        direction = np.array(direction_from_angles(gaze["yaw_deg"], -gaze["pitch_deg"]))
        target = np.asarray(axes @ direction * _GAZE_DISTANCE_MM)
    if "clip.gaze_yaw_deg" not in parameters:
        return target
    shift = float(parameters["clip.gaze_pitch_deg"]), float(parameters["clip.gaze_yaw_deg"]), 0.0
    return np.asarray(axes @ np.array(angles_matrix(shift)) @ axes.T @ target)


def _background_settings(parameters: Parameters) -> dict[str, object]:
    """Return the render settings of the sampled background."""
    kind = parameters["background.kind"]
    if kind == "colour":
        return {"background": tuple(parameters[f"background.{one}"] for one in ("red", "green", "blue"))}
    if kind == PICTURE_BACKGROUND:  # composed later
        return {"background": "none"}
    return {"background": kind, "background_blur": parameters.get("background.blur", 0.0)}
