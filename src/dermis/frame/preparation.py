"""Turns a scene into a frame's inputs, and reuses what has not changed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dermis.frame.atlas_layout import AtlasLayout
from dermis.frame.inputs import Inputs, camera_views, pinhole, seen_by
from dermis.frame.levels import Blur, scale_of
from dermis.frame.lights import light_constants, light_records, light_views
from dermis.frame.passes.shade import shade_program
from dermis.frame.projection import Views, shadow_layers
from dermis.frame.resources import Asked, make_resources
from dermis.frame.skin_profiles import SkinProfiles
from dermis.frame.surroundings import brightest, load_surroundings, with_suns
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Device, Memo
from dermis.mesh.head import Head
from dermis.scene.lights import Light
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

Lights = tuple[Light, ...]


class Preparation:
    """Makes the inputs of frames on a device.

    depth : how many of each thing are kept, see `Memo`
    """

    def __init__(self, device: Device, depth: int = 1) -> None:
        self.device, self.memo = device, Memo(depth)
        self.profile_of = SkinProfiles().of

    def inputs(self, scene: Scene, settings: Settings, view: str = "") -> Inputs:
        """Everything that a frame reads; what it does not is let go of.

        view : name of a scene among several that are drawn in turn: each has light and shadows of its own

        Raises DermisError for sizes over the device's limits.
        """
        self.memo.begin()
        inputs = self._inputs(scene, settings, TECHNIQUES[settings.technique], view)
        self.memo.end()
        return inputs

    def _inputs(self, scene: Scene, settings: Settings, technique: Technique, view: str) -> Inputs:
        keep, device, head, around = self.memo.keep, self.device, scene.head, scene.environment
        profile = self.profile_of(scene.skin)
        surroundings = keep(load_surroundings, device, around.name if around else None)
        scene = with_suns(self.memo, scene, surroundings)
        lit_by = head, tuple(scene.lights), settings.shadow_size
        record, layers, parts = keep(_lights, *lit_by, using=(device, scene))
        counts = parts, len(layers.clips)
        asked = Asked(head, scene.skin, profile, settings, around, surroundings, technique, *counts, view)
        resources = keep(make_resources, self.memo, device, asked)
        seen_from, shone_on = pinhole(scene.camera, head, settings), light_constants(scene)
        scale = scale_of(resources.levels.texel, brightest(scene, surroundings))
        return Inputs(
            resources=resources,
            settings=settings,
            layouts=tuple(under(layout, record) for layout in resources.layouts),
            blurs=keep(_scaled, resources.blurs, scale),
            shadow_views=layers,
            light_constants=shone_on,
            camera=camera_views(seen_from, head.mesh, settings.samples),
            half=seen_from.half,
            view=seen_by(resources.view, seen_from),
            constants=resources.constants + shone_on,
        )


def under(layout: AtlasLayout, lights: Any) -> AtlasLayout:
    """The layout under lights.

    lights : the shader's array
    """
    lit = layout.lit | {"lights": lights}
    return AtlasLayout(layout.atlas, lit, layout.surfaces, layout.scattered, layout.translucency)


def _scaled(blurs: tuple[Blur, ...], scale: float) -> tuple[Blur, ...]:
    return tuple(replace(blur, scale=scale) for blur in blurs)


def _lights(_: Head, __: Lights, size: int, device: Device, scene: Scene) -> tuple[Any, Views, int]:
    """The shader's array of lights, how shadow maps see the head, and how many parts the lights have."""
    views = light_views(scene, size)
    return light_records(shade_program(device), scene, views), shadow_layers(views), len(views)
