"""Preparation of the inputs of a frame from a scene; what has not changed is reused."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.allocation import make_resources
from dermis.frame.features.diffusion.pyramid import Blur, scale_of
from dermis.frame.features.diffusion.profiles import Mixed, SkinProfiles
from dermis.frame.features.hair.resources import strand_constants
from dermis.frame.features.occlusion.moving import Anchors, Look, anchors_of, look_around, sky_record, turn_of
from dermis.frame.features.outputs.stage_inputs import PreviousScene
from dermis.frame.features.shading.shade import shade_program
from dermis.frame.features.shading.view import EyesSeen, camera_views, pinhole, seen_by
from dermis.frame.features.shape.shape import MotionBytes, motion_at_rest
from dermis.frame.inputs import Inputs
from dermis.frame.lights import light_constants, light_parts, light_records, light_views
from dermis.frame.lights.environment import brightest, load_surroundings, with_suns
from dermis.frame.limits import no_room
from dermis.frame.projection import Views, shadow_layers
from dermis.frame.request import FrameRequest
from dermis.frame.resources import AtlasLayout, Resources
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Constants, Device, Memo, Record
from dermis.gpu.memo import same
from dermis.gpu.memory import OutOfMemoryError
from dermis.human.skin.face import movements
from dermis.mesh.head import Head
from dermis.mesh.outline import Outline
from dermis.mesh.rig import Motion
from dermis.scene.environment import Environment
from dermis.scene.lights import Light
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES

_SLACK_MM = 10.0  # that a rig's outermost points may miss of a pose
Lights = tuple[Light, ...]
Names = tuple[str, ...]


class Moved(NamedTuple):
    """A head's motion, how far out its shape reaches, and how its eyes stand."""

    motion: MotionBytes
    outline: Outline
    eyes: EyesSeen | None


class Preparation:
    """Makes the inputs of frames on a device.

    depth, rounds : how many of each thing are kept, and for how long, see `Memo`
    """

    def __init__(self, device: Device, depth: int = 1, rounds: int = 1) -> None:
        self.device, self.memo = device, Memo(depth, rounds)
        self.profiles = SkinProfiles()

    def inputs(
        self,
        scene: Scene,
        settings: Settings,
        view: str = "",
        outputs: tuple[str, ...] = (),
        previous: Scene | None = None,
        landmarks: tuple[str, ...] = (),
    ) -> Inputs:
        """Everything that a frame reads; what it does not is let go of.

        view : name of a scene among several that are drawn in turn: each has light and shadows of its own
        outputs : names of what is asked besides the picture
        previous : scene of the same head that motion is counted from, this one itself when left out
        landmarks : names of sets that are asked

        Raises DermisError for sizes over the device's limits.
        """
        inputs = self._inputs(scene, settings, TECHNIQUES[settings.technique], view, (outputs, landmarks))
        if "motion" in outputs:
            inputs = replace(inputs, previous=self._before(scene, previous or scene, inputs))
        self.memo.end()
        return inputs

    def _inputs(
        self,
        scene: Scene,
        settings: Settings,
        technique: Technique,
        view: str,
        more: tuple[Names, Names],
    ) -> Inputs:
        keep, device, head, around = self.memo.keep, self.device, scene.head.bare, scene.environment
        (profile, *others), shares = self._profiles(scene.skin, technique)
        surroundings = keep(load_surroundings, device, around.name if around else None, of=_kind_of(around))
        scene = with_suns(self.memo, scene, surroundings)
        moved = self._moved(head, scene.motion)
        lit_by = head, tuple(scene.lights), moved.outline, settings.shadow_size
        record, layers, parts = keep(_lights, *lit_by, using=(device, scene))
        who = scene.head, scene.skin, profile, _person(scene)
        counts = parts, len(layers.clips), scene.motion is not None
        mixed = tuple(others), shares
        request = FrameRequest(*who, settings, around, surroundings, technique, *counts, view, *mixed, *more)
        try:
            resources = keep(make_resources, self.memo, device, request, technique)
        except OutOfMemoryError as error:
            self.memo.forget()
            raise no_room(error, device, request) from error
        seen_from = pinhole(scene.camera, head, settings)
        shone_on = light_constants(scene) + strand_constants(head, settings) + linked(resources)
        scale = scale_of(resources.diffusion.levels.texel, brightest(scene, surroundings))
        return Inputs(
            resources=resources,
            settings=settings,
            motion=moved.motion,
            movements=keep(_movements, head, scene.motion) if resources.face else None,
            layouts=tuple(under(layout, record) for layout in resources.layouts),
            blurs=keep(_scaled, resources.diffusion.blurs, scale),
            shadow_views=layers,
            light_constants=shone_on,
            camera=camera_views(seen_from, moved.outline, settings.samples),
            window=seen_from.window,
            around=self._around(head, scene.motion, moved.outline) if resources.sky else None,
            view=seen_by(resources.view, seen_from, moved.eyes),
            constants=resources.constants + shone_on,
            centre_mm=head.centre_mm,
        )

    def _profiles(self, skin: Skin, technique: Technique) -> Mixed:
        """The skin's profiles, its first one alone for techniques that mix none."""
        return self.profiles.mixed(skin) if technique.mixes else ((self.profiles.of(skin),), None)

    def _around(self, head: Head, motion: Motion | None, outline: Outline) -> tuple[Look, Record]:
        """How the sky sees the head as it is posed, and the shader's record of it."""
        anchors, motion = self.memo.keep(anchors_of, head.topology), motion or head.control.rest
        return self.memo.keep(_looked, outline, using=(motion, self.device, head, anchors))

    def _before(self, scene: Scene, previous: Scene, inputs: Inputs) -> PreviousScene:
        """What motion is counted from.

        Raises DermisError for a scene of another head.
        """
        head = scene.head.bare
        if not same(previous.head.bare, head):
            came, remedy = f"{previous.head.name!r} came", "Leave it out where a head follows another"
            refuse("previous", "a scene of the same head", came, remedy)
        moved = self.memo.keep(_resting, head)
        if previous.motion is not None:
            moved = self.memo.keep(_bytes_of, head, previous.motion, moved, of="before")
        seen_from = pinhole(previous.camera, head, inputs.settings)
        view = seen_by(inputs.resources.view, seen_from, None)
        return PreviousScene(None if moved == inputs.motion else moved, view)

    def _moved(self, head: Head, motion: Motion | None) -> Moved:
        """The head as it is posed, or at rest where no motion came."""
        at_rest = self.memo.keep(_resting, head)
        return self.memo.keep(_posed, head, motion or head.control.rest, at_rest)


def linked(resources: Resources) -> Constants:
    """Whether skin sends light to skin."""
    return (("INTERREFLECTION", 1),) if resources.layouts[0].interreflection else ()


def _kind_of(around: Environment | None) -> str:
    """Of surroundings: none do not take the place of some."""
    return "" if around else "none"


def _bytes_of(head: Head, motion: Motion, at_rest: MotionBytes) -> MotionBytes:
    """A motion as the shaders read it; the bytes of a head's own points are always the same object."""
    weights, matrices = motion.weights.tobytes(), motion.matrices.tobytes()
    same = motion.positions_mm is head.control.positions_mm
    positions = at_rest.positions if same else motion.positions_mm.tobytes()
    return at_rest._replace(positions=positions, weights=weights, matrices=matrices)


def _person(scene: Scene) -> NDArray[np.float32] | None:
    """Where the control points rest, if not where those of the head's topology do."""
    motion = scene.motion or scene.head.control.rest
    places = motion.positions_mm
    return None if places is scene.head.topology.control.positions_mm else places


def _movements(head: Head, motion: Motion | None) -> NDArray[np.float32]:
    assert motion is not None
    return movements(head.targets, motion.weights)


def _resting(head: Head) -> MotionBytes:
    return motion_at_rest(head.control)


def _eyes(head: Head, motion: Motion) -> EyesSeen | None:
    if head.eyes is None:
        return None
    rig = head.control
    edges = None if rig.contact is None else rig.edges_mm(motion)
    return EyesSeen(head.eyes.frames(rig, motion), edges)


def _posed(head: Head, motion: Motion, at_rest: MotionBytes) -> Moved:
    rig, moved = head.control, _bytes_of(head, motion, at_rest)
    if moved == at_rest:  # where the mesh's own outline is exact
        return Moved(moved, head.mesh.outline, _eyes(head, motion))
    return Moved(moved, Outline(rig.outline_mm(motion), _SLACK_MM), _eyes(head, motion))


def _looked(
    outline: Outline, motion: Motion, device: Device, head: Head, anchors: Anchors
) -> tuple[Look, Record]:
    look = look_around(outline, turn_of(anchors, motion))
    return look, sky_record(device, look, len(head.mesh.positions))


def under(layout: AtlasLayout, lights: Record) -> AtlasLayout:
    """The layout under lights.

    lights : the shader's array
    """
    return replace(layout, lit=layout.lit | {"lights": lights})


def _scaled(blurs: tuple[Blur, ...], scale: float) -> tuple[Blur, ...]:
    return tuple(replace(blur, scale=scale) for blur in blurs)


def _lights(
    _: Head, __: Lights, outline: Outline, size: int, device: Device, scene: Scene
) -> tuple[Record, Views, tuple[int, ...]]:
    """The shader's array of lights, how shadow maps see the head, and how many parts each light has."""
    views, parts = light_views(scene, outline, size), light_parts(scene)
    return light_records(shade_program(device), scene, views), shadow_layers(views), parts
