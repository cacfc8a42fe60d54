"""The renderer: a device with all that it keeps from frame to frame."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import Atlas
from dermis.assets.cache import cached_atlas
from dermis.assets.head import Head
from dermis.errors import refuse
from dermis.gpu import Frame, make_texture, open_device
from dermis.gpu.device import gpu_failures
from dermis.optics.profiles import load_profile
from dermis.rendering import inputs as made
from dermis.rendering.frame import Stages, draw_frame
from dermis.rendering.inputs import Inputs
from dermis.rendering.maps import HeadTextures, upload_atlas, upload_head
from dermis.rendering.projection import ShadowView
from dermis.rendering.rendered import Rendered
from dermis.rendering.stages.shadows import ShadowMaps
from dermis.scene.model import Scene
from dermis.scene.plain import Plain
from dermis.scene.settings import Settings

T = TypeVar("T")
_WARMING_FRAMES = 100
_ATLAS_BYTES = 9 * 16  # a texel of six levels, their sum, the space between passes, and its geometry


class Renderer:
    """Renders scenes on one device; what does not change between two frames is not made again.

    adapter : "auto", "cpu" or part of an adapter's name
    """

    def __init__(self, adapter: str = "auto") -> None:
        started = time.perf_counter()
        self.device = open_device(adapter)
        with gpu_failures(self.device):
            self._stages = Stages(self.device)
        self._kept: dict[str, tuple[Any, Any]] = {}
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
        self._check(settings)
        profile = load_profile(scene.skin.profile)
        split = made.split_profile(profile, settings, white=scene.skin.albedo == "map")
        atlas, atlas_textures = self._atlas(scene.head, settings.atlas)
        head = self._head(scene.head, atlas, scene.skin.albedo == "map")
        views = self._keep(
            "views",
            (scene.head, tuple(scene.lights), settings.shadow_size),
            lambda: made.light_views(scene, settings.shadow_size),
        )
        clips = [view.clip for view in views if view]
        shadow_maps = self._shadow_maps(len(clips), settings.shadow_size if clips else 1)
        stages, count, size = self._stages, len(split.blurred_mm2), settings.size
        side = settings.atlas if count else 1
        inputs = Inputs(
            head=head,
            atlas=atlas_textures,
            lit=self._lit(scene, head, views, shadow_maps),
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
            picture=self._keep("picture", size, lambda: stages.post.make_picture(size)),
            exposure=settings.exposure,
        )
        return inputs, len(profile.variance_mm2)

    def _lit(
        self, scene: Scene, head: HeadTextures, views: list[ShadowView | None], shadow_maps: ShadowMaps
    ) -> dict[str, Any]:
        """What both lighting passes read: the head, its skin, the lights and their shadows."""
        program = self._stages.shade.program
        return {
            **head.resources,
            "skin": made.skin_record(program, scene, head),
            "lights": made.light_records(program, scene, views),
            "shadow_maps": shadow_maps.texture,
            "shadow_sampler": self.device.sampler(),
        }

    def _shadow_maps(self, layers: int, size: int) -> ShadowMaps:
        return self._keep("shadows", (layers, size), lambda: self._stages.shadows.make_maps(layers, size))

    def _plain(self, size: tuple[int, int]) -> Any:
        return make_texture(self.device, size, "rgba32float")

    def _check(self, settings: Settings) -> None:
        limit, name = self.device.max_texture_size, self.device.adapter.name
        sides = {"size": max(settings.size), "atlas": settings.atlas, "shadow_size": settings.shadow_size}
        for option, side in sides.items():
            if side > limit:
                name_limit = f"at most {limit} (the limit of {name})"
                refuse(option, name_limit, f"it is {side}", "Choose a smaller one")
        self._check_memory(settings)

    def _check_memory(self, settings: Settings) -> None:
        """A software adapter takes textures from main memory, and the system ends who takes too much."""
        if self.device.adapter.kind != "CPU" or not hasattr(os, "sysconf"):
            return
        width, height = settings.size
        needed = _ATLAS_BYTES * settings.atlas**2 + (36 + 8 * settings.samples) * width * height
        here = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        if needed > here:
            sizes = f"{settings.atlas} texels and {width}x{height} pixels need {needed / 1e9:.0f} GB"
            refuse("atlas and size", f"a frame within {here / 1e9:.0f} GB", sizes, "Choose smaller ones")

    def _atlas(self, head: Head, size: int) -> tuple[Atlas, dict[str, Any]]:
        def make() -> tuple[Atlas, dict[str, Any]]:
            atlas = cached_atlas(head.mesh, size)
            return atlas, upload_atlas(self.device, atlas)

        return self._keep("atlas", (head, size), make)

    def _head(self, head: Head, atlas: Atlas, use_colour: bool) -> HeadTextures:
        def make() -> HeadTextures:
            self._kept.pop("shadows", None)  # they show another head
            return upload_head(self.device, head, atlas, use_colour)

        return self._keep("head", (head, atlas, use_colour), make)

    def _keep(self, role: str, key: Any, make: Callable[[], T]) -> T:
        """The last thing made for this role while its key stays the same."""
        old, value = self._kept.get(role, (None, None))
        if value is None or not _same(old, key):
            self._kept.pop(role, None)
            value = make()
            self._kept[role] = (key, value)
        return value  # type: ignore[no-any-return]


def _same(a: Any, b: Any) -> bool:
    """Equality that compares heads and atlases by identity, without touching their arrays."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return a is b or (isinstance(a, int | str | bytes | bool | Plain) and a == b)


def render(scene: Scene, adapter: str = "auto", **settings: Any) -> NDArray[np.float32]:
    """(h, w, 3) float32 linear Rec. 709 image of a scene; for many images keep a `Renderer`.

    settings : those of `Settings`: size, atlas, samples, technique, exposure, ...
    """
    return Renderer(adapter).render(scene, **settings)
