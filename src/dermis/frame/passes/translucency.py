"""Light that enters on the far side of thin parts and leaves here: ears, nostrils, lips, lids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.levels import Levels
from dermis.frame.passes import SHARED_SHADERS, STAGES
from dermis.frame.passes.translucency_weights import Pairs
from dermis.frame.passes.variants import Constants
from dermis.gpu import ComputeProgram, Device, Frame

_TEAMS: Constants = (("SIZE", 128), ("TEAM", 16), ("ROUND", 4))
_ALONE: Constants = (("SIZE", 128), ("TEAM", 1), ("ROUND", 1))  # software adapters pay for barriers
_GATHERING = 64  # invocations of a workgroup, as in translucency_gather.wgsl
_ROW = 1024  # workgroups, of which no more than 65535 fit in a row


@dataclass(frozen=True)
class Thin:
    """Thin parts of an atlas.

    pairs : translucent pairs
    weights : what `TranslucencyWeights.weigh` made of them
    layer : blurred level, counted from 0, whose light passes
    gathered : buffer for the light of the sources
    """

    pairs: Pairs
    weights: Any
    layer: int
    gathered: Any

    @property
    def light(self) -> Any:
        """Texture of the coarse atlas for what comes through."""
        return self.pairs.light


class Transmission:
    """Sums the light from the sources of each receiver [JensenBuhler2002; dEonLuebke2007].

    constants : of translucency.wgsl, what suits the device if left out
    """

    def __init__(self, device: Device, constants: Constants = ()) -> None:
        chosen = dict((_ALONE if device.adapter.kind == "CPU" else _TEAMS) + constants)
        self._receivers = int(chosen["SIZE"]) // int(chosen["TEAM"])  # of a workgroup
        self._gather = ComputeProgram(device, STAGES / "translucency_gather.wgsl", (SHARED_SHADERS,))
        self._sum = ComputeProgram(device, STAGES / "translucency.wgsl", (SHARED_SHADERS,), chosen)

    def draw(self, frame: Frame, levels: Levels, thin: Thin) -> Any:
        """The light that comes through, from the blurred layers, which start after the unblurred one."""
        pairs = thin.pairs
        layer = 1 + thin.layer
        record = self._gather.record(
            "Entering",
            layer=layer,
            sources=pairs.source_count,
            mip=levels.halvings[layer],
            scale=1.0 / levels.scale,
        )
        entering = {
            "entering": record,
            "levels": levels.stack,
            "sources": pairs.sources,
            "gathered": thin.gathered,
        }
        leaving = {
            "receivers": pairs.receivers,
            "weights": thin.weights,
            "gathered": thin.gathered,
            "transmitted": pairs.light,
        }
        frame.dispatch("transmission", self._gather, entering, _rows(pairs.source_count, _GATHERING))
        frame.dispatch("transmission", self._sum, leaving, _rows(pairs.receiver_count, self._receivers))
        return pairs.light


def _rows(count: int, each: int) -> tuple[int, int, int]:
    """Rows of workgroups that take `each` of `count`."""
    groups = -(-count // each)
    return min(groups, _ROW), -(-groups // _ROW), 1
