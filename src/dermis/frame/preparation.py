"""Preparation of the inputs of a frame from a scene; resources that have not changed come from a cache."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.allocation import make_resources
from dermis.frame.features.diffusion.profiles import ProfileMix, SkinProfiles
from dermis.frame.features.diffusion.pyramid import Blur, half_precision_scale
from dermis.frame.features.hair.resources import strand_shadow_constants
from dermis.frame.features.hair.swing import (
    Swing,
    SwingStep,
    gravity_change,
    make_colliders,
    make_swing_buffers,
)
from dermis.frame.features.occlusion.moving import (
    HeadRotationPoints,
    SkyViews,
    head_rotation,
    make_head_rotation_points,
    sky_views,
    sky_views_record,
)
from dermis.frame.features.outputs.stage_inputs import PreviousScene
from dermis.frame.features.shading.shade import shade_program
from dermis.frame.features.shading.view import (
    EyePoses,
    Pinhole,
    camera_views,
    with_camera,
    with_mouth,
    with_redness,
    world_space_pinhole,
)
from dermis.frame.features.shape.shape import PoseBytes, rest_pose_bytes
from dermis.frame.features.surface.bands import head_in_bands, light_in_bands
from dermis.frame.hair_motion import HairFrame, HairMotion
from dermis.frame.inputs import FrameInputs
from dermis.frame.lights.environment import EnvironmentMap, add_suns, load_environment_map, peak_irradiance
from dermis.frame.lights.records import light_constants, light_part_counts, light_records, light_shadow_views
from dermis.frame.limits import out_of_memory_error
from dermis.frame.projection import Views, shadow_map_views
from dermis.frame.request import FrameRequest
from dermis.frame.resources import AtlasLayout, Resources
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Constants, Device, Memo, UniformRecord
from dermis.gpu.memo import are_equal
from dermis.gpu.memory import OutOfMemoryError
from dermis.human.skin.face import movement_weights
from dermis.mesh.head import Head
from dermis.mesh.outline import Outline
from dermis.mesh.rig import PoseArrays
from dermis.optics.bands import Bands
from dermis.scene.environment import Environment
from dermis.scene.lights import Light
from dermis.scene.living import SkinState
from dermis.scene.model import Scene
from dermis.scene.outputs import OUTPUTS
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES

_KEPT_ENVIRONMENTS = 4  # environments whose maps, of about 8 MB each, are kept for the next frames
_OUTLINE_MARGIN_MM = 10.0  # margin around the outline of a posed rig, because that outline is approximate
Lights = tuple[Light, ...]
RequestedNames = tuple[str, ...]


class HeadState(NamedTuple):
    """Current state of a head: its pose, the outline of the posed shape, its eyes and its mouth."""

    pose_bytes: PoseBytes
    outline: Outline
    eyes: EyePoses | None
    mouth_edge_mm: NDArray[np.float64] | None


class Preparation:
    """Preparation of the inputs of frames on a device, with a cache of resources.

    cache_size : number of variants of each resource that are cached
    cache_ttl : number of frames after which unused resources are released
    """

    def __init__(self, device: Device, cache_size: int = 1, cache_ttl: int = 1) -> None:
        self.device, self.memo = device, Memo(cache_size, cache_ttl)
        self.profiles = SkinProfiles()

    def prepare_frame(
        self,
        scene: Scene,
        settings: Settings,
        view: str = "",
        outputs: tuple[str, ...] = (),
        previous: Scene | None = None,
        landmarks: tuple[str, ...] = (),
        hair_frame: HairFrame | None = None,
        bands: Bands | None = None,
    ) -> FrameInputs:
        """Return the inputs of a frame.

        Resources are taken from the cache where nothing has changed; cached resources that are no longer used
        are released.

        view : name under which the lights of the scene are cached, for callers that draw several scenes in
            turn
        outputs : names of outputs besides the picture
        previous : scene of the same head for motion vectors; without it, motion is 0
        landmarks : names of landmark sets
        hair_frame : frame of an animation in which hair swings; None for hair that follows the head stiffly
        bands : wavelengths in the place of red, green and blue

        Raises DermisError for sizes that exceed the limits of the device.
        """
        inputs = self._prepare_inputs(
            scene, settings, TECHNIQUES[settings.technique], view, (outputs, landmarks), bands
        )
        if any(OUTPUTS[name].stage == "motion" for name in outputs):
            inputs = replace(inputs, previous=self._previous_scene(scene, previous or scene, inputs))
        if hair_frame is not None:
            inputs = replace(inputs, swing=self._swing(scene, inputs.resources, hair_frame))
        self.memo.end_frame()
        return inputs

    def _prepare_inputs(
        self,
        scene: Scene,
        settings: Settings,
        technique: Technique,
        view: str,
        requested_names: tuple[RequestedNames, RequestedNames],
        bands: Bands | None,
    ) -> FrameInputs:
        cached, device = self.memo.get, self.device
        if bands is not None:
            scene = _scene_in_bands(self.memo, scene, bands)
        head = scene.head.without_maps
        (profile, *others), blend_weights = self._profiles(scene.skin, technique, bands)
        environment_map = self._environment_map(scene.environment, bands)
        scene = add_suns(self.memo, scene, environment_map)
        state = self._head_state(head, scene.pose_arrays)
        light_inputs = head, tuple(scene.lights), state.outline, settings.shadow_size
        lights, shadow_views, part_counts = cached(
            _light_resources, *light_inputs, untracked_arguments=(device, scene)
        )
        request = FrameRequest(
            head=scene.head,
            skin=scene.skin,
            profile=profile,
            rest_positions_mm=_rest_positions_mm(scene),
            settings=settings,
            environment=scene.environment,
            environment_map=environment_map,
            technique=technique,
            light_part_counts=part_counts,
            shadow_layers=len(shadow_views.clips),
            posed=scene.pose_arrays is not None,
            view_name=view,
            is_living=scene.state is not None,
            other_profiles=tuple(others),
            blend_weights=blend_weights,
            outputs=requested_names[0],
            landmarks=requested_names[1],
            bands=bands,
        )
        try:
            resources = cached(make_resources, self.memo, device, request, technique)
        except OutOfMemoryError as error:
            self.memo.clear()
            raise out_of_memory_error(error, device, request) from error
        camera = world_space_pinhole(scene.camera, head, settings)
        constants = light_constants(scene) + strand_shadow_constants(head, settings)
        constants += interreflection_constants(resources)
        texel_format = resources.diffusion.levels.texel_format
        scale = half_precision_scale(texel_format, peak_irradiance(scene, environment_map))
        animated = resources.expression_maps is not None
        return FrameInputs(
            resources=resources,
            settings=settings,
            pose_bytes=state.pose_bytes,
            face_movements=cached(_face_movements, head, scene.pose_arrays) if animated else None,
            skin_state=scene.state,
            layouts=tuple(with_lights(layout, lights) for layout in resources.layouts),
            blurs=cached(_scaled_blurs, resources.diffusion.blurs, scale),
            shadow_views=shadow_views,
            light_constants=constants,
            camera_views=camera_views(camera, state.outline, settings.samples),
            image_rectangle=camera.image_rectangle,
            sky_view=self._sky_view(head, scene.pose_arrays, state.outline) if resources.sky else None,
            view=_view_record(resources.view, camera, state, head, scene.state),
            constants=resources.constants + constants,
            centre_mm=head.centre_mm,
        )

    def _environment_map(self, environment: Environment | None, bands: Bands | None) -> EnvironmentMap:
        name = environment.name if environment else None
        return self.memo.get(
            load_environment_map, self.device, name, bands, min_cache_size=_KEPT_ENVIRONMENTS
        )

    def _profiles(self, skin: Skin, technique: Technique, bands: Bands | None) -> ProfileMix:
        """Return the diffusion profiles of the skin and their blend weights.

        For techniques that cannot blend profiles, the result is the first profile alone, and None for the
        weights.

        bands : wavelengths in the place of red, green and blue
        """
        if technique.mixes_profiles:
            return self.profiles.mixture(skin, bands)
        return (self.profiles.profile(skin, bands),), None

    def _sky_view(
        self, head: Head, pose_arrays: PoseArrays | None, outline: Outline
    ) -> tuple[SkyViews, UniformRecord]:
        """Return the views of the posed head that ambient occlusion needs, and their uniform record."""
        rotation_points, pose_arrays = (
            self.memo.get(make_head_rotation_points, head.topology_head),
            pose_arrays or head.control_rig.rest,
        )
        return self.memo.get(
            _sky_view, outline, untracked_arguments=(pose_arrays, self.device, head, rotation_points)
        )

    def _previous_scene(self, scene: Scene, previous: Scene, inputs: FrameInputs) -> PreviousScene:
        """Return the pose and the camera of the previous scene, for motion vectors.

        Raises DermisError if the two scenes show different heads.
        """
        head = scene.head.without_maps
        if not are_equal(previous.head.without_maps, head):
            actual, advice = f"got {previous.head.name!r}", "Leave it out when the head changes"
            refuse("previous", "a scene of the same head", actual, advice)
        pose_bytes = self.memo.get(_rest_pose_bytes, head)
        if previous.pose_arrays is not None:
            pose_bytes = self.memo.get(
                _pose_bytes, head, previous.pose_arrays, pose_bytes, caller_name="before"
            )
        camera = world_space_pinhole(previous.camera, head, inputs.settings)
        view = with_camera(inputs.resources.view, camera, None)
        return PreviousScene(None if pose_bytes == inputs.pose_bytes else pose_bytes, view)

    def _swing(self, scene: Scene, resources: Resources, hair_frame: HairFrame) -> Swing | None:
        """Return the simulation of hair up to a frame; None for heads without scalp hair or beard.

        Raises DermisError if the scene has another pose than the frame, or if frames show different heads.
        """
        motion, index = hair_frame
        if not are_equal(scene.pose_arrays, motion.scene(index).pose_arrays):
            advice = "Pass the frame that HairMotion.advance returned for this scene"
            refuse("hair_frame", "a frame with the pose of the scene", f"frame {index} has another", advice)
        if resources.hair is None or resources.hair.tables.groom is None:
            return None
        head, guides = motion.scene(index).head.without_maps, resources.hair.tables.groom.style.guides
        colliders = self.memo.get(make_colliders, self.device, head.topology_head)
        found = motion.buffers(self.device, guides)
        buffers = found or make_swing_buffers(self.device, guides, colliders.vertices.size // 4)
        frames = motion.missing_frames(buffers, index)
        steps = tuple(self._swing_step(head, motion, frame) for frame in frames)
        return Swing(buffers, colliders, steps)

    def _swing_step(self, head: Head, motion: HairMotion, frame: int) -> SwingStep:
        rotation_points = self.memo.get(make_head_rotation_points, head.topology_head)
        at_rest, arrays = self.memo.get(_rest_pose_bytes, head), []
        for scene in (motion.scene(0), motion.scene(frame)):
            if not are_equal(scene.head.without_maps, head):
                actual, advice = f"got {scene.head.name!r}", "Start another HairMotion when the head changes"
                refuse("hair_motion", "scenes of one head", actual, advice)
            arrays.append(scene.pose_arrays or head.control_rig.rest)
        first, now = (head_rotation(rotation_points, one) for one in arrays)
        pose_bytes = _pose_bytes(head, arrays[1], at_rest)
        return SwingStep(frame, pose_bytes, gravity_change(now, first), motion.seconds_per_frame)

    def _head_state(self, head: Head, pose_arrays: PoseArrays | None) -> HeadState:
        """Return the pose, outline and eyes of a head; if `pose_arrays` is None, the head is at rest."""
        at_rest = self.memo.get(_rest_pose_bytes, head)
        return self.memo.get(_posed_state, head, pose_arrays or head.control_rig.rest, at_rest)


def interreflection_constants(resources: Resources) -> Constants:
    """Return the pipeline constant that enables interreflection, () for heads without interreflection."""
    return (("INTERREFLECTION", 1),) if resources.layouts[0].interreflection else ()


def _scene_in_bands(memo: Memo, scene: Scene, bands: Bands) -> Scene:
    """Return the scene with the colours of head and lights at three wavelengths."""
    lights = tuple(light_in_bands(light, bands) for light in scene.lights)
    return replace(scene, head=memo.get(head_in_bands, scene.head, bands), lights=lights)


def _view_record(
    record: UniformRecord, camera: Pinhole, state: HeadState, head: Head, skin_state: SkinState | None
) -> UniformRecord:
    """Return a Shade record with the camera, the eyes and the mouth of a head, and states of its skin."""
    record = with_mouth(with_camera(record, camera, state.eyes), state.mouth_edge_mm)
    return with_redness(record, head, skin_state)


def _pose_bytes(head: Head, pose_arrays: PoseArrays, rest_bytes: PoseBytes) -> PoseBytes:
    """Return a pose as bytes for the shaders.

    rest_bytes : bytes of the rest pose; its positions are reused if the pose has the same control points
    """
    weights, matrices = pose_arrays.weights.tobytes(), pose_arrays.matrices.tobytes()
    is_rest = pose_arrays.positions_mm is head.control_rig.positions_mm
    positions = rest_bytes.positions if is_rest else pose_arrays.positions_mm.tobytes()
    return rest_bytes._replace(positions=positions, weights=weights, matrices=matrices)


def _rest_positions_mm(scene: Scene) -> NDArray[np.float32] | None:
    """Return the (p, 3) positions of the person's control points in the rest pose [mm].

    The result is None if they are the control points of the shared mesh itself.
    """
    pose_arrays = scene.pose_arrays or scene.head.control_rig.rest
    positions_mm = pose_arrays.positions_mm
    return None if positions_mm is scene.head.topology_head.control_rig.positions_mm else positions_mm


def _face_movements(head: Head, pose_arrays: PoseArrays | None) -> NDArray[np.float32]:
    weights = np.zeros(len(head.targets), np.float32) if pose_arrays is None else pose_arrays.weights
    return movement_weights(head.targets, weights)


def _rest_pose_bytes(head: Head) -> PoseBytes:
    return rest_pose_bytes(head.control_rig)


def _eye_poses(head: Head, pose_arrays: PoseArrays) -> EyePoses | None:
    if head.eyes is None:
        return None
    rig = head.control_rig
    edges = None if rig.contact is None else rig.lid_edges_mm(pose_arrays)
    return EyePoses(head.eyes.eye_matrices(rig, pose_arrays), edges)


def _posed_state(head: Head, pose_arrays: PoseArrays, rest_bytes: PoseBytes) -> HeadState:
    rig, posed = head.control_rig, _pose_bytes(head, pose_arrays, rest_bytes)
    if posed == rest_bytes:  # the outline of the mesh is exact
        outline = head.mesh.outline
    else:
        outline = Outline(rig.outline_mm(pose_arrays), _OUTLINE_MARGIN_MM)
    mouth_edge_mm = None if rig.mouth_edge is None else rig.mouth_edge_mm(pose_arrays)
    return HeadState(posed, outline, _eye_poses(head, pose_arrays), mouth_edge_mm)


def _sky_view(
    outline: Outline, pose_arrays: PoseArrays, device: Device, head: Head, rotation_points: HeadRotationPoints
) -> tuple[SkyViews, UniformRecord]:
    views = sky_views(outline, head_rotation(rotation_points, pose_arrays))
    return views, sky_views_record(device, views, len(head.mesh.positions))


def with_lights(layout: AtlasLayout, lights_record: UniformRecord) -> AtlasLayout:
    """Return a copy of an atlas layout whose shader bindings include the uniform record of the lights."""
    return replace(layout, bindings=layout.bindings | {"lights": lights_record})


def _scaled_blurs(blurs: tuple[Blur, ...], irradiance_scale: float) -> tuple[Blur, ...]:
    return tuple(replace(blur, scale=irradiance_scale) for blur in blurs)


def _light_resources(
    _: Head, __: Lights, outline: Outline, map_side: int, device: Device, scene: Scene
) -> tuple[UniformRecord, Views, tuple[int, ...]]:
    """Return the record of the lights, the views of shadow maps, and the `light_part_counts` of the scene.

    The first two parameters only serve as cache keys.
    """
    views, part_counts = light_shadow_views(scene, outline, map_side), light_part_counts(scene)
    return light_records(shade_program(device), scene, views), shadow_map_views(views), part_counts
