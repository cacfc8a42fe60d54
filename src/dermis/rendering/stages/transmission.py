"""Light that enters on the far side of thin parts and leaves here: ears, nostrils, lips, lids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.gpu import ComputeProgram, Device, Frame
from dermis.rendering.levels import Levels
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.opposite import ROW, Pairs


@dataclass(frozen=True)
class Thin:
    """Thin parts of an atlas.

    pairs : places opposite each other
    links : what `Opposite.weigh` made of them
    layer : blurred level, counted from 0, whose light passes
    gathered : buffer for the light of the sources
    light : texture of the coarse atlas for what comes through
    """

    pairs: Pairs
    links: Any
    layer: int
    gathered: Any
    light: Any


class Transmission:
    """Sums what passes from all places opposite [JensenBuhler2002; dEonLuebke2007]."""

    def __init__(self, device: Device) -> None:
        path = STAGES / "transmission.wgsl"
        self._gather, self._sum = (ComputeProgram(device, path, constants={"SUM": s}) for s in (0, 1))

    def draw(self, frame: Frame, levels: Levels, thin: Thin) -> Any:
        """The light that comes through, from the blurred layers, which start after the unblurred one."""
        pairs = thin.pairs
        layer = 1 + thin.layer
        record = self._sum.record(
            "Through",
            layer=layer,
            side=pairs.side,
            sources=pairs.source_count,
            mip=levels.halvings[layer],
            scale=1.0 / levels.scale,
        )
        bound = {
            "through": record,
            "levels": levels.stack,
            "sources": pairs.sources,
            "receiver": pairs.receiver,
            "first": pairs.first,
            "links": thin.links,
            "gathered": thin.gathered,
            "transmitted": thin.light,
        }
        frame.compute("transmission", self._gather, bound, (ROW, -(-pairs.source_count // ROW)))
        frame.compute("transmission", self._sum, bound, (pairs.side, pairs.side))
        return thin.light
