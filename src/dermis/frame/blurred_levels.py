"""Space for the light that enters the skin, its blurred levels, and what a map of profiles makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dermis.frame.asked import Asked
from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.levels import Blur, Halvings, Levels
from dermis.frame.profile_mixture import Mixture, make_mixture, upload_shares
from dermis.frame.techniques.technique import AtlasTechnique, Technique
from dermis.gpu import Device, Memo


def blurred_levels(
    memo: Memo, device: Device, asked: Asked, atlases: Sequence[AtlasTextures]
) -> dict[str, Any]:
    """By their names among the frame's resources."""
    blurs = tuple(_blur(asked, one) for one in atlases) if asked.count else ()
    side, halvings = asked.settings.atlas if blurs else 1, tuple(blur.halvings for blur in blurs) or ((0,),)
    make = device, asked.technique, side, halvings, asked.light_of
    levels = memo.keep(_make_levels, *make, of=asked.view)
    mixture = None
    if asked.mixed and blurs:
        ours = (f"{asked.view} other {k}" for k in range(len(asked.others)))
        given = tuple(memo.keep(_make_levels, *make, of=of) for of in ours)
        mixture = memo.keep(_mixture, device, asked.share_map, given, len(atlases), of=asked.view)
    return {"blurs": blurs, "levels": levels, "mixture": mixture}


def _blur(asked: Asked, atlas: AtlasTextures) -> Blur:
    assert isinstance(asked.technique, AtlasTechnique)
    red, green, blue = (np.pi * c * asked.remedy.coloured for c in asked.settings.seam_colour)
    edge, clear = asked.remedy.edge, (red, green, blue)
    split, steps = asked.technique.chain(asked.split, atlas, edge)
    spread = split.blurred_mm2, split.weight, asked.technique.halvings(split, atlas, edge)
    return Blur(*spread, edge=edge, clear=clear, steps=steps, changes=split.changes)


def _make_levels(device: Device, technique: Technique, side: int, halvings: Halvings, _: str) -> Levels:
    return technique.make_levels(device, side, halvings)


def _mixture(device: Device, shares: Any, given: tuple[Levels, ...], layouts: int) -> Mixture:
    return make_mixture(device, upload_shares(device, shares), given, layouts)
