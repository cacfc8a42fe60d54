"""Texture-space diffusion by a hierarchy of Gaussians, stitched across the map's seams."""

from __future__ import annotations

from typing import Any

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.levels import Blur, Levels
from dermis.frame.passes import diffuse
from dermis.frame.techniques.technique import AtlasTechnique


class TextureSpace(AtlasTechnique):
    """The package's own technique [dEonLuebke2007]."""

    sources = ("dEonLuebke2007", "Geusebroek2003")
    transmits = True
    mixes = True

    def fill(self, graph: Any, levels: Levels, atlas: AtlasTextures, blur: Blur) -> None:
        """Fill layer k with the light of layer 0 spread by the k-th Gaussian."""
        diffuse.draw(graph, levels, atlas, blur)


TECHNIQUE = TextureSpace()
