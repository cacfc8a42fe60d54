"""Frames of scenes captured for players elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.surface import mips as map_mips
from dermis.frame.frame import draw_frame
from dermis.frame.inputs import Inputs
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, Texture, upload
from dermis.gpu.capture import CapturedFrame, FrameCapture
from dermis.scene.techniques import TECHNIQUES

_KEPT = 32  # of each resource: for all nodes of dials
FORMS = {"gpu": "DiscreteGPU", "software": "CPU"}
"""Kinds of adapters that frames are laid out for."""


def renderer_for(form: str, adapter: str) -> Renderer:
    """A renderer whose frames are laid out for GPUs or for software, whatever its adapter is."""
    made = Renderer(adapter, depth=_KEPT, rounds=1000)
    if made.device.adapter.kind != FORMS[form]:
        device = made.device
        device.programs.clear()
        device.adapter = replace(device.adapter, kind=FORMS[form])
    return made


def taken(tape: FrameCapture, inputs: Inputs) -> CapturedFrame:
    """The passes of a frame; none of them runs."""
    technique = TECHNIQUES[inputs.settings.technique]
    return tape.take(lambda graph: draw_frame(graph, inputs, technique))


def sparser(take: CapturedFrame, times: int) -> CapturedFrame:
    """The same frame with one coarse hair for so many, as much wider; with all for 0."""
    for _, record in (one for one in take.records if one[0] == "StrandView" and times > 1):
        kept = int(record["coarse"]) // times
        record["wider"] *= record["coarse"] / max(1, kept)
        record["coarse"] = kept
    return take


def halving(tape: FrameCapture, texture: Texture) -> CapturedFrame:
    """The passes that fill a map's mips from its first."""
    return tape.take(lambda graph: map_mips.halve(graph, map_mips.mipped(texture)))


def refill(renderer: Renderer, texture: Texture, levels: list[NDArray[np.float16]]) -> None:
    """Put other texels into a map; its mips follow where only the first is given.

    levels : (l, h, w, c) of each mip
    """
    for mip, layers in enumerate(levels):
        for layer, texels in enumerate(layers):
            upload(renderer.device, texture, texels, mip=mip, layer=layer)
    if len(levels) < texture.mip_level_count:
        frame = CommandList(renderer.device, timed=False)
        map_mips.halve(frame, map_mips.mipped(texture))
        frame.submit()
