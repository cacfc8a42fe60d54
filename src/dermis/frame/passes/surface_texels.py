"""The surface at each texel of an atlas, so that no frame reads the mesh and its maps for that again."""

from __future__ import annotations

import weakref
from typing import Any

from dermis.frame.atlas_layout import Layout
from dermis.frame.passes import STAGES
from dermis.frame.passes.variants import Variants
from dermis.gpu import Device, Frame, make_texture

SURFACE_BYTES = 32
"""Of a texel."""
_SKIN = ("roughness", "rho_s", "relief_band")
"""Of the skin's numbers those that the texels hold."""


class SurfaceTexels:
    """Positions, normals, colours and gloss, for as long as the atlas is there."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._program = Variants(device, STAGES / "surface_texels.wgsl").program()
        self._read = [b.name for b in self._program.bindings if b.name not in ("skin", "surfaces")]
        self._made: weakref.WeakKeyDictionary[Any, tuple[Any, Any]] = weakref.WeakKeyDictionary()

    def of(self, layout: Layout) -> Any:
        """Texture of two layers, as packed_surface.wgsl reads them; drawn anew when it has changed."""
        bound = {**layout.lit, **layout.atlas.resources}
        atlas = bound["atlas"]
        key = (
            *(bound["skin"][name].tobytes() for name in _SKIN),
            *(weakref.ref(bound[name]) for name in self._read),
        )
        drawn, texture = self._made.pop(atlas, (None, None))
        texture = texture or make_texture(self._device, atlas.size[:2], "rgba32uint", layers=2)
        if drawn != key:
            self._draw(bound | {"surfaces": texture}, texture.size)
        self._made[atlas] = key, texture  # and not when drawing failed
        return texture

    def _draw(self, bound: dict[str, Any], size: tuple[int, ...]) -> None:
        """In a frame of its own, which is submitted before the one that reads."""
        frame = Frame(self._device, timed=False)
        frame.compute("surface", self._program, bound, (size[0], size[1]))
        frame.submit()
