"""What a frame reads that cameras and lights leave as it is, and all that it is made of."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

import numpy as np

from dermis.atlas.atlas import Atlas
from dermis.atlas.cached import cached_atlas
from dermis.frame import inputs as made
from dermis.frame import surface
from dermis.frame.atlas_layout import Layout
from dermis.frame.atlas_textures import AtlasTextures, upload_atlas
from dermis.frame.engine_techniques import pre_integrated, screen_spread
from dermis.frame.frame import Stages
from dermis.frame.geometry import HeadTextures, upload_geometry
from dermis.frame.inputs import Split, Standing
from dermis.frame.kept import Kept
from dermis.frame.levels import Levels
from dermis.frame.maps import relief_band, upload_maps
from dermis.frame.passes.shade import technique_constants
from dermis.frame.passes.shadows import ShadowMaps
from dermis.frame.passes.translucency import Thin
from dermis.frame.passes.visibility_buffer import Layers
from dermis.frame.projection import ShadowView
from dermis.frame.seams import laid_out, remedy_of, stretch_of
from dermis.frame.surroundings import (
    Surroundings,
    environment_record,
    is_occluded,
    no_occlusion,
    occlusion_map,
)
from dermis.frame.translucency import ThinParts, lets_through, shared_width, thin_of
from dermis.gpu import Device
from dermis.gpu.textures import texture_from
from dermis.mesh.head import Head
from dermis.optics.gaussians import GaussianSum
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.specular.albedo import albedo_table


class StandingMaker:
    """Makes it of things that are kept by the role that they play."""

    def __init__(self, device: Device, stages: Stages, kept: Kept, profile_of: surface.ProfileOf) -> None:
        self.device, self._stages, self._profile_of = device, stages, profile_of
        self._keep, self._forget_all = kept.keep, kept.forget_all
        self.thin_parts = ThinParts(device, kept)

    def make(
        self,
        scene: Scene,
        settings: Settings,
        place: str,
        profile: GaussianSum,
        split: Split,
        surroundings: Surroundings,
        views: list[ShadowView | None],
        lights: Any,
    ) -> Standing:
        """What stands, under the lights of its first frame.

        scene : with its environment's peaks among its lights
        place : scenes that are drawn in turn have light and shadows of their own, by its name
        """
        self.thin_parts.begin()
        self._place, self._shadow = place, settings.shadow_size  # light that has spread is kept for each size
        count, size, stages = len(split.blurred_mm2), settings.size, self._stages
        layers = sum(view is not None for view in views)
        shadow_maps = self._shadow_maps(scene.head, layers, settings.shadow_size if layers else 1)
        shared = {
            "lights": lights,
            "shadow_maps": shadow_maps.texture,
            "shadow_bounds": shadow_maps.bounds,
            "nearest_sampler": self.device.sampler(),
            "panorama": surroundings.panorama,
            "albedo_table": self._albedo(scene.skin),
        }
        layouts = self._layouts(scene, settings, split, len(views), shared)
        pre = pre_integrated(self._keep, self.device, settings, profile)
        remedy = remedy_of(settings)
        return Standing(
            head=layouts[0].head,
            layouts=layouts,
            shadow_maps=shadow_maps,
            scatters=count > 0,
            levels=self._levels(settings.technique, settings.atlas if count else 1, count),
            blurred_mm2=split.blurred_mm2,
            level_weight=split.weight,
            edge=remedy.edge,
            clear=np.pi * np.array(settings.seam_colour) * remedy.coloured,
            scattered=pre.table if pre else self._scattered(layouts, settings.atlas),
            seen=self._seen(size, settings.samples),
            view=made.view_record(stages.shade.program, scene.head, settings, split, pre),
            constants=surface.constants(scene.skin) + technique_constants(settings),
            suns=len(surroundings.suns),
            gaussians=len(profile.variance_mm2),
            picture=self._keep("picture", size, lambda: stages.post.make_picture(size)),
            spread=screen_spread(self._keep, lambda: stages.screen_space, settings, profile),
            glow=self._keep("glow", size, lambda: stages.bloom.make_glow(size)) if settings.bloom else None,
            settings=settings,
        )

    def _layouts(
        self, scene: Scene, settings: Settings, split: Split, lights: int, shared: dict[str, Any]
    ) -> list[Layout]:
        """The atlases that light is spread on: one, or two that hide each other's seams."""
        layouts, maps = [], self._begin_maps(scene, settings)
        count = len(split.blurred_mm2)
        names, side = laid_out(settings, count, is_occluded(scene, settings))
        for index, name in enumerate(names):
            atlas, textures = self._atlas(scene.head, name, side, settings, index)
            thin = self._thin(scene, settings, split, atlas, index)
            head = self._head(scene, atlas, maps, index)
            skin = surface.skin_record(self._stages.shade.program, scene, head, self._profile_of)
            skin["light_count"] = lights
            lit = {**head.resources, "skin": skin, **shared}
            around = self._environment(scene, settings, split.total, head, lit, atlas, textures, index)
            space = self._space(f"scattered {index}", settings.atlas if count else 1)
            layouts.append(Layout(head, textures, lit | around, space, thin))
        return layouts

    def _thin(self, scene: Scene, settings: Settings, split: Split, atlas: Atlas, index: int) -> Thin | None:
        """The translucent pairs of a layout, weighted for the skin, and space for their light."""
        if not (len(split.blurred_mm2) and lets_through(settings)):
            return None
        head, widest = scene.head, float(np.sqrt(split.blurred_mm2[-1]))
        widest = shared_width(widest) if scene.skin.has_own_tissue else widest
        pairs = self.thin_parts.pairs(index, head, atlas, widest, changing=scene.skin.has_own_tissue)
        profile, stage = (split.blurred_mm2, split.weight), self._stages.translucency_weights
        key = (pairs, *(numbers.tobytes() for numbers in profile))
        return self._keep(f"thin {index}", key, lambda: thin_of(self.device, stage, pairs, *profile))

    def _levels(self, technique: str, side: int, count: int) -> Levels:
        stage = self._stages.spreading(technique)
        key = stage.name, side, count, self._shadow
        return self._keep("levels" + self._place, key, lambda: stage.make_levels(side, count))

    def _scattered(self, layouts: list[Layout], side: int) -> Any:
        return self._space("scattered", side) if len(layouts) > 1 else layouts[0].scattered

    def _seen(self, size: tuple[int, int], samples: int) -> Layers:
        return self._keep("seen", (size, samples), lambda: self._stages.visibility.make_seen(size, samples))

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
        return self._keep("maps", key, lambda: self.device.executor.submit(upload_maps, self.device, *key))

    def _head(self, scene: Scene, atlas: Atlas, maps: Future[dict[str, Any]], index: int) -> HeadTextures:
        head, mesh = scene.head, scene.head.mesh
        key = head, atlas
        geometry = self._keep(f"geometry {index}", key, lambda: upload_geometry(self.device, mesh, atlas))
        unscattered = self._keep(f"unscattered {index}", key, lambda: atlas.unscattered(mesh))
        try:
            resources = geometry | maps.result()
        except Exception:
            self._forget_all()  # maps that failed must not be found again
            raise
        return HeadTextures(resources, relief_band(head.maps), len(mesh.triangles), unscattered)
