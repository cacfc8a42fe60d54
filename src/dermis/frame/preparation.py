"""From a scene to what a frame reads, keeping on the device what stays the same."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dermis.frame import inputs as made
from dermis.frame.atlas_layout import Layout
from dermis.frame.frame import Stages
from dermis.frame.inputs import Inputs, Split, Standing
from dermis.frame.kept import Kept, same
from dermis.frame.levels import scale_of
from dermis.frame.lights import light_constants, light_records, light_views
from dermis.frame.limits import check_limits
from dermis.frame.projection import ShadowView, shadow_layers
from dermis.frame.resources import StandingMaker
from dermis.frame.seams import laid_out
from dermis.frame.skin_profiles import SkinProfiles
from dermis.frame.surroundings import (
    Surroundings,
    brightest,
    is_occluded,
    load_surroundings,
    with_suns,
)
from dermis.gpu import Device
from dermis.optics.gaussians import GaussianSum
from dermis.scene.model import Scene
from dermis.scene.settings import Settings


class Preparation:
    """Makes the inputs of frames on a device; what does not change between two frames is not made again."""

    def __init__(self, device: Device, stages: Stages, depth: int = 1) -> None:
        self.device, self._stages = device, stages
        self.profile_of = SkinProfiles().of
        self._kept = Kept(depth)
        self._keep = self._kept.keep
        self._maker = StandingMaker(device, stages, self._kept, self.profile_of)
        self.thin_parts = self._maker.thin_parts
        self._last: tuple[Any, Standing] | None = None

    def forget_all(self) -> None:
        """Make everything again."""
        self._last = None
        self._kept.forget_all()

    def inputs(self, scene: Scene, settings: Settings, place: str = "") -> Inputs:
        """Everything that `draw_frame` touches; what it does not is let go of.

        place : scenes that are drawn in turn have light and shadows of their own, by its name

        Raises DermisError for sizes over the device's limits.
        """
        made_now = self._inputs(scene, settings, place)
        self._kept.forget_idle()
        return made_now

    def _inputs(self, scene: Scene, settings: Settings, place: str) -> Inputs:
        profile = self.profile_of(scene.skin)
        split = self._split(scene, settings, profile)
        surroundings = self._surroundings(scene)
        scene = with_suns(self._keep, scene, surroundings)
        views = self._views(scene, settings.shadow_size)
        lights = self._keep("light records", views, lambda: self._light_records(scene, views))
        layers = shadow_layers(views)
        drawn_by = self._stages.spreading(settings.technique), self._stages.combine
        given = scene.head, scene.skin, profile, settings, scene.environment, place
        key = *given, len(views), len(layers.clips), *drawn_by

        def stand() -> Standing:
            return self._maker.make(scene, settings, place, profile, split, surroundings, views, lights)

        standing = self._standing(key, stand)
        seen_from, shone_on = made.pinhole(scene.camera, scene.head, settings), light_constants(scene)
        moved = {
            "layouts": [under(layout, lights) for layout in standing.layouts],
            "view": made.seen_by(standing.view, seen_from),
            "constants": standing.constants + shone_on,
            "spread": standing.spread and replace(standing.spread, half=seen_from.half),
        }
        return Inputs(
            **(vars(standing) | moved),
            shadow_views=layers,
            shadow_key=layers.clips.tobytes(),
            scale=scale_of(standing.levels.texel, brightest(scene, surroundings)),
            camera=made.camera_views(seen_from, scene.head.mesh, settings.samples),
            light_constants=shone_on,
        )

    def _standing(self, key: Any, make: Any) -> Standing:
        """What the last frame had, if it was of the same things, else made of what is kept of older ones."""
        if self._last and same(self._last[0], key) and not self.thin_parts.provisional:
            self._kept.ask_again()
            return self._last[1]
        self._last = None  # before making, which may need the space
        self._last = key, make()
        return self._last[1]

    def _split(self, scene: Scene, settings: Settings, profile: GaussianSum) -> Split:
        """The profile as the frame uses it, which must be one that the device can hold."""
        white, occluded = scene.skin.albedo == "map", is_occluded(scene, settings)

        def split() -> Split:
            found = made.split_profile(profile, settings, white)
            count = len(found.blurred_mm2)
            check_limits(self.device, settings, laid_out(settings, count, occluded), count)
            return found

        return self._keep("split", (profile, settings, white, occluded), split)

    def _surroundings(self, scene: Scene) -> Surroundings:
        name = scene.environment.name if scene.environment else None
        return self._keep("surroundings", (name,), lambda: load_surroundings(self.device, name))

    def _views(self, scene: Scene, size: int) -> list[ShadowView | None]:
        return self._keep("views", (scene.head, tuple(scene.lights), size), lambda: light_views(scene, size))

    def _light_records(self, scene: Scene, views: list[ShadowView | None]) -> Any:
        return light_records(self._stages.shade.program, scene, views)


def under(layout: Layout, lights: Any) -> Layout:
    """The layout under other lights.

    lights : the shader's array
    """
    return Layout(layout.head, layout.atlas, layout.lit | {"lights": lights}, layout.scattered, layout.thin)
