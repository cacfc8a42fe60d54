"""From a scene to what a frame reads, keeping on the device what stays the same."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

import numpy as np

from dermis.assets.atlas import Atlas
from dermis.assets.cache import cached_atlas
from dermis.assets.head import Head
from dermis.gpu import Device
from dermis.gpu.textures import texture_from
from dermis.rendering import inputs as made
from dermis.rendering import surface
from dermis.rendering.atlas_textures import AtlasTextures, upload_atlas
from dermis.rendering.engine_techniques import pre_integrated, screen_spread
from dermis.rendering.frame import Stages
from dermis.rendering.geometry import HeadTextures, upload_geometry
from dermis.rendering.inputs import Inputs
from dermis.rendering.kept import Kept
from dermis.rendering.layout import Layout
from dermis.rendering.levels import Levels, scale_of
from dermis.rendering.lights import light_records, light_switches, light_views
from dermis.rendering.limits import check_limits
from dermis.rendering.maps import relief_band, upload_maps
from dermis.rendering.projection import ShadowView
from dermis.rendering.seams import LaidOut, laid_out, remedy_of, stretch_of
from dermis.rendering.skin_profiles import SkinProfiles
from dermis.rendering.stages.nearest import Layers
from dermis.rendering.stages.opposite import Pairs
from dermis.rendering.stages.shade import technique_switches
from dermis.rendering.stages.shadows import ShadowMaps
from dermis.rendering.stages.transmission import Thin
from dermis.rendering.surroundings import (
    Surroundings,
    brightest,
    environment_record,
    is_occluded,
    load_surroundings,
    no_occlusion,
    occlusion_map,
    with_suns,
)
from dermis.rendering.thin_parts import lets_through, pairs_of, shared_width, thin_of
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.specular.albedo import albedo_table


class Preparation:
    """Makes the inputs of frames on a device; what does not change between two frames is not made again."""

    def __init__(self, device: Device, stages: Stages, depth: int = 1) -> None:
        self.device, self._stages = device, stages
        self.profile_of = SkinProfiles().of
        kept = Kept(depth)
        self._keep, self.forget_all, self._forget_idle = kept.keep, kept.forget_all, kept.forget_idle

    def inputs(self, scene: Scene, settings: Settings, place: str = "") -> Inputs:
        """Everything that `draw_frame` touches; what it does not is let go of.

        place : scenes that are drawn in turn have light and shadows of their own, by its name

        Raises DermisError for sizes over the device's limits.
        """
        self._place, self._shadow = place, settings.shadow_size  # light that has spread is kept for each size
        made_now = self._inputs(scene, settings)
        self._forget_idle()
        return made_now

    def _inputs(self, scene: Scene, settings: Settings) -> Inputs:
        profile = self.profile_of(scene.skin)
        split = made.split_profile(profile, settings, white=scene.skin.albedo == "map")
        count, size, stages = len(split.blurred_mm2), settings.size, self._stages
        atlases = laid_out(settings, count, is_occluded(scene, settings))
        check_limits(self.device, settings, atlases, count)
        surroundings = self._surroundings(scene)
        scene = with_suns(scene, surroundings)
        views = self._views(scene, settings.shadow_size)
        clips = [view.clip for view in views if view]
        shadow_maps = self._shadow_maps(scene.head, len(clips), settings.shadow_size if clips else 1)
        layouts = self._layouts(scene, settings, split, atlases, views, shadow_maps, surroundings)
        pre = pre_integrated(self._keep, self.device, settings, profile)
        view = made.view_record(stages.shade.program, scene, settings, split, pre)
        levels = self._levels(settings.technique, settings.atlas if count else 1, count)
        return Inputs(
            head=layouts[0].head,
            layouts=layouts,
            shadow_maps=shadow_maps,
            light_clips=clips,
            shadow_key=np.array(clips).tobytes(),
            scatters=count > 0,
            levels=levels,
            scale=scale_of(levels.texel, brightest(scene, surroundings)),
            blurred_mm2=split.blurred_mm2,
            level_weight=split.weight,
            edge=remedy_of(settings).edge,
            clear=np.pi * np.array(settings.seam_colour) * remedy_of(settings).coloured,
            scattered=pre.table if pre else self._scattered(layouts, settings.atlas),
            seen=self._seen(size, settings.samples),
            camera_clips=made.camera_clips(scene.camera, scene.head, settings),
            view=view,
            switches=surface.switches(scene.skin) + light_switches(scene) + technique_switches(settings),
            light_switches=light_switches(scene),
            suns=len(surroundings.suns),
            gaussians=len(profile.variance_mm2),
            picture=self._keep("picture", size, lambda: stages.post.make_picture(size)),
            spread=screen_spread(self._keep, lambda: stages.screen_space, settings, profile, view),
            glow=self._keep("glow", size, lambda: stages.bloom.make_glow(size)) if settings.bloom else None,
            settings=settings,
        )

    def _layouts(
        self,
        scene: Scene,
        settings: Settings,
        split: made.Split,
        atlases: LaidOut,
        views: list[ShadowView | None],
        shadow_maps: ShadowMaps,
        surroundings: Surroundings,
    ) -> list[Layout]:
        """The atlases that light is spread on: one, or two that hide each other's seams."""
        layouts, maps = [], self._begin_maps(scene, settings)
        shared = {"panorama": surroundings.panorama, "albedo_table": self._albedo(scene.skin)}
        for index, name in enumerate(atlases.layouts):
            atlas, textures = self._atlas(scene.head, name, atlases.side, settings, index)
            thin = self._thin(scene, settings, split, atlas, index)
            head = self._head(scene, atlas, maps, index)
            lit = self._lit(scene, head, views, shadow_maps) | shared
            around = self._environment(scene, settings, split.total, head, lit, atlas, textures, index)
            space = self._space(f"scattered {index}", settings.atlas if len(split.blurred_mm2) else 1)
            layouts.append(Layout(head, textures, lit | around, space, thin))
        return layouts

    def _thin(
        self, scene: Scene, settings: Settings, split: made.Split, atlas: Atlas, index: int
    ) -> Thin | None:
        """What lies opposite a layout's thin parts, and space for the light from there."""
        if not (len(split.blurred_mm2) and lets_through(settings)):
            return None
        head, widest = scene.head, float(np.sqrt(split.blurred_mm2[-1]))
        widest = shared_width(widest) if scene.skin.has_own_tissue else widest

        def find() -> Pairs:
            return pairs_of(self.device, head.mesh, atlas, widest, changing=scene.skin.has_own_tissue)

        pairs = self._keep(f"pairs {index}", (head, atlas, repr(widest)), find)
        profile, stage = (split.blurred_mm2, split.weight), self._stages.opposite
        key = (pairs, *(numbers.tobytes() for numbers in profile))
        return self._keep(f"thin {index}", key, lambda: thin_of(self.device, stage, pairs, *profile))

    def _levels(self, technique: str, side: int, count: int) -> Levels:
        stage = self._stages.spreading(technique)
        key = stage.name, side, count, self._shadow
        return self._keep("levels" + self._place, key, lambda: stage.make_levels(side, count))

    def _scattered(self, layouts: list[Layout], side: int) -> Any:
        return self._space("scattered", side) if len(layouts) > 1 else layouts[0].scattered

    def _surroundings(self, scene: Scene) -> Surroundings:
        name = scene.environment.name if scene.environment else None
        return self._keep("surroundings", (name,), lambda: load_surroundings(self.device, name))

    def _seen(self, size: tuple[int, int], samples: int) -> Layers:
        return self._keep("seen", (size, samples), lambda: self._stages.visibility.make_seen(size, samples))

    def _views(self, scene: Scene, size: int) -> list[ShadowView | None]:
        return self._keep("views", (scene.head, tuple(scene.lights), size), lambda: light_views(scene, size))

    def _lit(
        self, scene: Scene, head: HeadTextures, views: list[ShadowView | None], shadow_maps: ShadowMaps
    ) -> dict[str, Any]:
        """What both lighting passes read: the head, its skin, the lights and their shadows."""
        program = self._stages.shade.program
        skin = surface.skin_record(program, scene, head, self.profile_of)
        skin["light_count"] = len(views)
        return {
            **head.resources,
            "skin": skin,
            "lights": self._keep("light records", views, lambda: light_records(program, scene, views)),
            "shadow_maps": shadow_maps.texture,
            "shadow_bounds": shadow_maps.bounds,
            "nearest_sampler": self.device.sampler(),
        }

    def _environment(
        self,
        scene: Scene,
        settings: Settings,
        total: Any,
        head: HeadTextures,
        lit: Any,
        atlas: Atlas,
        textures: AtlasTextures,
        index: int,
    ) -> dict[str, Any]:
        """The environment's record, and how much of it each place sees."""
        occluded = is_occluded(scene, settings)

        def make() -> Any:
            if not occluded:
                return no_occlusion(self.device)
            return occlusion_map(self.device, scene.head, head, lit, atlas, textures)

        key = (atlas,) if occluded else ()
        record = environment_record(self._stages.shade.program, scene, total, occluded)
        return {"environment": record, "occlusion_map": self._keep(f"occlusion {index}", key, make)}

    def _albedo(self, skin: Skin) -> Any:
        key = surface.model_of(skin), skin.fresnel
        return self._keep("albedo", key, lambda: texture_from(self.device, albedo_table(*key), "rg32float"))

    def _shadow_maps(self, head: Head, layers: int, size: int) -> ShadowMaps:
        key = (head, layers, size)  # heads of one size have the same matrices
        return self._keep("shadows" + self._place, key, lambda: self._stages.shadows.make_maps(layers, size))

    def _space(self, role: str, side: int) -> Any:
        stage = self._stages.combine
        return self._keep(role + self._place, (side, self._shadow, stage), lambda: stage.make_sum(side))

    def _atlas(
        self, head: Head, layout: str, size: int, settings: Settings, index: int
    ) -> tuple[Atlas, AtlasTextures]:
        remedy, stretch = remedy_of(settings), stretch_of(settings)
        atlas = self._keep(
            f"atlas {index}", (head, layout, size), lambda: cached_atlas(head.mesh, size, layout)
        )
        key = atlas, stretch, remedy
        return atlas, self._keep(f"atlas textures {index}", key, lambda: upload_atlas(self.device, *key))

    def _begin_maps(self, scene: Scene, settings: Settings) -> Future[dict[str, Any]]:
        """The head's maps, which take long to read: on another thread, while the rest is made."""
        key = scene.head, scene.skin.albedo == "map", settings.gamma == "right"
        return self._keep("maps", key, lambda: self.device.beside.submit(upload_maps, self.device, *key))

    def _head(self, scene: Scene, atlas: Atlas, maps: Future[dict[str, Any]], index: int) -> HeadTextures:
        head, mesh = scene.head, scene.head.mesh
        key = head, atlas
        geometry = self._keep(f"geometry {index}", key, lambda: upload_geometry(self.device, mesh, atlas))
        unscattered = self._keep(f"unscattered {index}", key, lambda: atlas.unscattered(mesh))
        try:
            resources = geometry | maps.result()
        except Exception:
            self.forget_all()  # maps that failed must not be found again
            raise
        return HeadTextures(resources, relief_band(head.maps), len(mesh.triangles), unscattered)
