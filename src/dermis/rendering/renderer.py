"""The renderer: a device with all that it keeps from frame to frame."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import Atlas
from dermis.assets.cache import cached_atlas
from dermis.assets.head import Head
from dermis.gpu import Frame, make_texture, open_device
from dermis.gpu.device import gpu_failures
from dermis.gpu.textures import texture_from
from dermis.optics.profiles import load_profile
from dermis.rendering import inputs as made
from dermis.rendering import surface
from dermis.rendering.frame import Stages, draw_frame
from dermis.rendering.inputs import Inputs
from dermis.rendering.kept import Kept
from dermis.rendering.lights import light_records, light_switches, light_views
from dermis.rendering.limits import check_limits
from dermis.rendering.maps import AtlasTextures, HeadTextures, upload_atlas, upload_head
from dermis.rendering.projection import ShadowView
from dermis.rendering.rendered import Rendered
from dermis.rendering.stages.shadows import ShadowMaps
from dermis.rendering.surroundings import (
    Surroundings,
    environment_record,
    load_surroundings,
    no_occlusion,
    occlusion_map,
    with_suns,
)
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.specular.albedo import albedo_table

_WARMING_FRAMES = 100


class Renderer:
    """Renders scenes on one device; what does not change between two frames is not made again.

    adapter : "auto", "cpu" or part of an adapter's name
    """

    def __init__(self, adapter: str = "auto") -> None:
        started = time.perf_counter()
        self.device = open_device(adapter)
        with gpu_failures(self.device):
            self._stages = Stages(self.device)
        kept = Kept()
        self._keep, self._forget = kept.keep, kept.forget
        self.forget = kept.forget_all
        self._frames = 0
        self._opening_ms = 1e3 * (time.perf_counter() - started)

    def draw(
        self,
        scene: Scene,
        settings: Settings | None = None,
        *,
        keep_shadows: bool = True,
        timed: bool = True,
    ) -> Rendered:
        """Render one frame and leave the image on the device.

        keep_shadows : False draws the shadow maps again even when no light moved
        timed : False returns as soon as the frame is submitted, so that the device never waits for Python

        Raises DermisError for sizes over the device's limits and when the device fails.
        """
        settings = settings or Settings()
        with gpu_failures(self.device):
            started = time.perf_counter()
            inputs, gaussians = self._inputs(scene, settings)
            ready = time.perf_counter()
            frame = Frame(self.device)
            self._submit(frame, inputs, keep_shadows)
            if timed:
                frame.wait()
            done = time.perf_counter()
            times = frame.stage_ms() if timed else None
        setup_ms = 1e3 * (ready - started) + self._opening_ms
        self._opening_ms = 0.0
        self._frames += 1
        number, frame_ms = self._frames, 1e3 * (done - ready)
        return Rendered(
            self.device,
            inputs.picture,
            times,
            frame_ms,
            setup_ms,
            gaussians,
            inputs.head.unscattered,
            inputs.suns,
            is_current=lambda: number == self._frames,
        )

    def draw_warm(
        self, scene: Scene, settings: Settings | None = None, *, keep_shadows: bool = False
    ) -> Rendered:
        """A frame timed on a device at work: a GPU that was idle runs at a fraction of its clock rate."""
        rendered = self.draw(scene, settings, keep_shadows=keep_shadows)
        if self.device.adapter.kind == "CPU":
            return rendered
        for _ in range(_WARMING_FRAMES):
            self.draw(scene, settings, keep_shadows=keep_shadows, timed=False)
        self.device.wait()
        return self.draw(scene, settings, keep_shadows=keep_shadows)

    def _submit(self, frame: Frame, inputs: Inputs, keep_shadows: bool) -> None:
        """Record and submit; after a failure nobody knows what the shadow maps hold."""
        if not keep_shadows:
            inputs.shadow_maps.drawn = b""
        try:
            draw_frame(frame, self._stages, inputs)
            frame.submit()
        except Exception:
            inputs.shadow_maps.drawn = b""
            raise

    def render(self, scene: Scene, **settings: Any) -> NDArray[np.float32]:
        """(h, w, 3) float32 linear Rec. 709 image; `settings` are those of `Settings`."""
        return self.draw(scene, Settings(**settings)).linear()

    def _inputs(self, scene: Scene, settings: Settings) -> tuple[Inputs, int]:
        check_limits(self.device, settings)
        profile = load_profile(scene.skin.profile)
        split = made.split_profile(profile, settings, white=scene.skin.albedo == "map")
        atlas, atlas_textures = self._atlas(scene.head, settings.atlas)
        head = self._head(scene, atlas, settings)
        surroundings = self._surroundings(scene)
        scene = with_suns(scene, surroundings)
        views = self._views(scene, settings.shadow_size)
        clips = [view.clip for view in views if view]
        shadow_maps = self._shadow_maps(len(clips), settings.shadow_size if clips else 1)
        stages, count, size = self._stages, len(split.blurred_mm2), settings.size
        side = settings.atlas if count else 1
        lit = self._lit(scene, head, views, shadow_maps) | {"panorama": surroundings.panorama}
        inputs = Inputs(
            head=head,
            atlas=atlas_textures,
            lit=lit
            | self._environment(scene, settings, split.total, head, lit, atlas_textures.resources["atlas"]),
            shadow_maps=shadow_maps,
            light_clips=clips,
            shadow_key=np.array(clips).tobytes(),
            scatters=count > 0,
            levels=self._keep("levels", (side, count), lambda: stages.diffuse.make_levels(side, count)),
            blurred_mm2=split.blurred_mm2,
            level_weight=split.weight,
            scattered=self._keep("scattered", side, lambda: self._plain((side, side))),
            seen=self._keep(
                "seen", (size, settings.samples), lambda: stages.visibility.make_seen(size, settings.samples)
            ),
            camera_clips=made.camera_clips(scene.camera, scene.head, settings),
            view=made.view_record(stages.shade.program, scene, settings, split),
            switches=surface.switches(scene.skin) + light_switches(scene),
            light_switches=light_switches(scene),
            suns=len(surroundings.suns),
            picture=self._keep("picture", size, lambda: stages.post.make_picture(size)),
            glow=self._keep("glow", size, lambda: stages.bloom.make_glow(size)) if settings.bloom else None,
            settings=settings,
        )
        return inputs, len(profile.variance_mm2)

    def _surroundings(self, scene: Scene) -> Surroundings:
        name = scene.environment.name if scene.environment else None
        return self._keep("surroundings", (name,), lambda: load_surroundings(self.device, name))

    def _views(self, scene: Scene, size: int) -> list[ShadowView | None]:
        return self._keep("views", (scene.head, tuple(scene.lights), size), lambda: light_views(scene, size))

    def _lit(
        self, scene: Scene, head: HeadTextures, views: list[ShadowView | None], shadow_maps: ShadowMaps
    ) -> dict[str, Any]:
        """What both lighting passes read: the head, its skin, the lights and their shadows."""
        program = self._stages.shade.program
        skin = surface.skin_record(program, scene, head)
        skin["light_count"] = len(views)
        return {
            **head.resources,
            "skin": skin,
            "albedo_table": self._albedo_table(surface.model_of(scene.skin), scene.skin.fresnel),
            "lights": light_records(program, scene, views),
            "shadow_maps": shadow_maps.texture,
            "shadow_sampler": self.device.sampler(),
        }

    def _environment(
        self, scene: Scene, settings: Settings, total: Any, head: HeadTextures, lit: Any, atlas: Any
    ) -> dict[str, Any]:
        """The environment's record, and how much of it each place sees."""
        occluded = scene.environment is not None and settings.occlusion == "baked"

        def make() -> Any:
            if not occluded:
                return no_occlusion(self.device)
            return occlusion_map(self.device, scene.head, head, lit, atlas, settings.atlas)

        key = (scene.head, settings.atlas) if occluded else ()
        record = environment_record(self._stages.shade.program, scene, total, occluded)
        return {"environment": record, "occlusion_map": self._keep("occlusion", key, make)}

    def _albedo_table(self, model: str, fresnel: str) -> Any:
        def make() -> Any:
            return texture_from(self.device, albedo_table(model, fresnel), "rg32float")

        return self._keep("albedo table", (model, fresnel), make)

    def _shadow_maps(self, layers: int, size: int) -> ShadowMaps:
        return self._keep("shadows", (layers, size), lambda: self._stages.shadows.make_maps(layers, size))

    def _plain(self, size: tuple[int, int]) -> Any:
        return make_texture(self.device, size, "rgba32float")

    def _atlas(self, head: Head, size: int) -> tuple[Atlas, AtlasTextures]:
        def make() -> tuple[Atlas, AtlasTextures]:
            atlas = cached_atlas(head.mesh, size)
            return atlas, upload_atlas(self.device, atlas)

        return self._keep("atlas", (head, size), make)

    def _head(self, scene: Scene, atlas: Atlas, settings: Settings) -> HeadTextures:
        use_colour = scene.skin.albedo == "map"

        def make() -> HeadTextures:
            self._forget("shadows")  # they show another head
            return upload_head(self.device, scene.head, atlas, use_colour, decoded=settings.gamma == "right")

        return self._keep("head", (scene.head, atlas, use_colour, settings.gamma), make)


def render(scene: Scene, adapter: str = "auto", **settings: Any) -> NDArray[np.float32]:
    """(h, w, 3) float32 linear Rec. 709 image of a scene; for many images keep a `Renderer`.

    settings : those of `Settings`: size, atlas, samples, technique, exposure, ...
    """
    return Renderer(adapter).render(scene, **settings)
