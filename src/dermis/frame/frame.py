"""One frame, read from top to bottom."""

from __future__ import annotations

import weakref
from functools import cached_property, partial
from typing import Any

import numpy as np

from dermis.frame.atlas_layout import Layout
from dermis.frame.inputs import Inputs
from dermis.frame.passes.blend import Blend
from dermis.frame.passes.bloom import Bloom
from dermis.frame.passes.combine import Combine
from dermis.frame.passes.diffuse import Diffuse
from dermis.frame.passes.gpu_gems_3 import Published
from dermis.frame.passes.irradiance import Irradiance
from dermis.frame.passes.pack import Pack
from dermis.frame.passes.post import Post
from dermis.frame.passes.screen_space import ScreenSpace
from dermis.frame.passes.shade import Shade
from dermis.frame.passes.shadows import Shadows
from dermis.frame.passes.translucency import Transmission
from dermis.frame.passes.translucency_weights import TranslucencyWeights
from dermis.frame.passes.visibility import Visibility
from dermis.frame.shown import Shown, entered_key, radiance_key, scattered_key, seen_key
from dermis.gpu import Device, Frame
from dermis.gpu.repeated import Repeated


class Stages:
    """The compiled stages of a device; those that not every frame has are compiled when first asked for."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self.shown = Shown()
        self.repeated = Repeated()
        self.shadows = Shadows(device)
        self.diffuse = Diffuse(device)
        self.irradiance = Irradiance(device, self.diffuse.texel)
        self.combine = Combine(device)
        self.visibility = Visibility(device)
        self.shade = Shade(device)
        self.post = Post(device)
        self.pack = Pack(device)

    @cached_property
    def published(self) -> Published:
        """For the technique of that name."""
        return Published(self._device)

    @cached_property
    def translucency_weights(self) -> TranslucencyWeights:
        """For heads with thin parts."""
        return TranslucencyWeights(self._device)

    @cached_property
    def transmission(self) -> Transmission:
        """For heads with thin parts."""
        return Transmission(self._device)

    @cached_property
    def blend(self) -> Blend:
        """For two layouts."""
        return Blend(self._device)

    @cached_property
    def screen_space(self) -> ScreenSpace:
        """For the technique of that name."""
        return ScreenSpace(self._device)

    @cached_property
    def bloom(self) -> Bloom:
        """For pictures with bloom."""
        return Bloom(self._device)

    def spreading(self, technique: str) -> Diffuse | Published:
        """The stage that blurs light over the atlas."""
        return self.published if technique == "gpu-gems-3" else self.diffuse


def draw_frame(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """Record a frame: light the skin, let it spread below, look at it.

    What `stages.shown` knows to be there already is left as it is.
    """
    shaped = ("SHAPES", 1) in inputs.light_constants
    stages.shadows.draw(
        frame, inputs.shadow_maps, inputs.shadow_views, inputs.head, inputs.shadow_key, bounded=shaped
    )
    keep, picture, drawn = stages.shown.keep, inputs.picture, (frame, stages, inputs)
    if inputs.scatters:
        keep(inputs.scattered, partial(scattered_key, inputs), partial(scatter, *drawn))
    keep(inputs.seen.texture, partial(seen_key, inputs), partial(_look, *drawn))
    if inputs.spread:  # the light kept apart is spread in its place
        stages.shown.forget(picture.radiance)
    keep(picture.radiance, partial(radiance_key, inputs), partial(_shade, *drawn))
    radiance = picture.radiance
    if inputs.spread:
        radiance = stages.screen_space.draw(frame, inputs.spread, radiance)
    if inputs.glow:
        radiance = stages.bloom.draw(frame, inputs.glow, radiance, inputs.settings.bloom)
    stages.post.draw(frame, radiance, picture, inputs.settings)


def scatter(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """Light the atlas and let the light spread over it."""
    shown, levels = stages.shown, inputs.levels
    for index, layout in enumerate(inputs.layouts):
        lit = partial(entered_key, inputs, layout)
        shown.keep(levels.stack, lit, partial(_enter, frame, stages, inputs, layout))
        shown.forget(layout.scattered)
        if inputs.settings.technique == Published.name:
            _spread(frame, stages, inputs, layout)
        else:  # the same, whatever lights and camera do
            key = _spreading_key(inputs, layout)
            record = partial(_spread, stages=stages, inputs=inputs, layout=layout)
            levels.halvings, levels.scale = stages.repeated.draw(frame, f"spread {index}", key, record)
    if len(inputs.layouts) > 1:
        first, second = inputs.layouts
        stages.blend.draw(frame, first, second, inputs.scattered)


def _enter(frame: Frame, stages: Stages, inputs: Inputs, layout: Layout) -> None:
    """Light that enters the skin of a layout."""
    levels = inputs.levels
    into = levels.layer(0), levels.size, levels.texel
    stages.irradiance.draw(frame, layout, inputs.light_constants, *into, inputs.scale)


def _spread(frame: Frame, stages: Stages, inputs: Inputs, layout: Layout) -> tuple[tuple[int, ...], float]:
    """Let the light that has entered spread, through thin parts too, and add up what leaves.

    Returns the levels' halvings and their scale.
    """
    levels, spread = inputs.levels, stages.spreading(inputs.settings.technique)
    beyond = inputs.edge, inputs.clear
    spread.draw(frame, levels, layout.atlas, inputs.blurred_mm2, *beyond, scale=inputs.scale)
    through = stages.transmission.draw(frame, levels, layout.thin) if layout.thin else None
    stages.combine.draw(frame, levels, inputs.level_weight, layout.scattered, through)
    return levels.halvings, levels.scale


def _look(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """Find what each sample of the picture sees."""
    stages.visibility.draw(frame, inputs.seen, inputs.camera, inputs.head)


def _shade(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """The picture, before exposure."""
    stages.shade.draw(
        frame,
        inputs.lit,
        inputs.view,
        inputs.constants,
        inputs.seen,
        inputs.scattered,
        inputs.picture.radiance,
        inputs.picture.size,
        inputs.spread.apart.layers if inputs.spread else None,
    )


def _spreading_key(inputs: Inputs, layout: Layout) -> tuple[Any, ...]:
    """Everything that `_spread` reads: numbers, and textures by identity, which are not kept alive."""
    arrays = inputs.blurred_mm2, inputs.level_weight, inputs.clear
    textures = [inputs.levels.stack, layout.scattered, *layout.atlas.resources.values()]
    textures += [layout.thin.weights, layout.thin.light] if layout.thin else []
    numbers = inputs.settings.technique, inputs.edge, inputs.scale
    return (*numbers, *(np.asarray(a).tobytes() for a in arrays), *map(weakref.ref, textures))
