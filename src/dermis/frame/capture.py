"""Capture of the GPU passes of a frame, so that players in other programs can replay them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.surface import mips as map_mips
from dermis.frame.frame import draw_frame
from dermis.frame.inputs import FrameInputs
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, Texture, upload
from dermis.gpu.capture import CapturedFrame, FrameCapture
from dermis.scene.techniques import TECHNIQUES

_RENDERER_CACHE_SIZE = 32  # variants per resource, for all combinations of the player's controls
ADAPTER_KINDS = {"gpu": "DiscreteGPU", "software": "CPU"}
"""Kinds of adapters that frames can be captured for; the keys are the values of `device_kind`."""


def capture_renderer(device_kind: str, adapter: str) -> Renderer:
    """Return a renderer that records passes for GPUs or for software adapters.

    device_kind : kind of adapter on which the passes will be replayed, "gpu" or "software"
    adapter : adapter on which the passes are recorded, as in `Renderer`; its kind may differ from
        `device_kind`
    """
    renderer = Renderer(adapter, cache_size=_RENDERER_CACHE_SIZE, cache_ttl=1000)
    if renderer.device.adapter.kind != ADAPTER_KINDS[device_kind]:
        device = renderer.device
        device.programs.clear()
        device.adapter = replace(device.adapter, kind=ADAPTER_KINDS[device_kind])
    return renderer


def capture_frame(frame_capture: FrameCapture, inputs: FrameInputs) -> CapturedFrame:
    """Record the passes of a frame, with their resources, without running them.

    frame_capture : recorder of the passes
    """
    technique = TECHNIQUES[inputs.settings.technique]
    return frame_capture.capture(lambda graph: draw_frame(graph, inputs, technique))


def reduce_hair(captured_frame: CapturedFrame, hair_divisor: int) -> CapturedFrame:
    """Return a captured frame whose picture has fewer but wider strands of scalp hair and beard.

    The total area of the strands stays the same, and so do the strands that cast shadows. Frames in which
    equally many strands are drawn and cast shadows have few strands, and are unchanged.

    hair_divisor : number by which the number of strands is divided; 0 keeps all strands
    """
    hairs = [record for name, record in captured_frame.records if name == "Hairs"]
    if hair_divisor <= 1 or len({int(record["coarse"]) for record in hairs}) < 2:
        return captured_frame
    for view in (record for name, record in captured_frame.records if name == "StrandView"):
        count = max(1, int(view["coarse"]) // hair_divisor)
        widening = view["coarse"] / count
        for record in (one for one in hairs if one["coarse"] == view["coarse"]):
            record["width_scale"] *= widening
            record["dye"] /= widening  # absorption per length
        view["coarse"] = count
    return captured_frame


def capture_mips(frame_capture: FrameCapture, texture: Texture) -> CapturedFrame:
    """Record the passes that compute the coarser mip levels of a map from its finest level.

    frame_capture : recorder of the passes
    texture : texture of the map
    """
    return frame_capture.capture(lambda graph: map_mips.fill_mips(graph, map_mips.with_mip_views(texture)))


def update_map(renderer: Renderer, texture: Texture, mip_levels: list[NDArray[np.float16]]) -> None:
    """Replace the texels of a map; if only the finest mip level is given, the other levels are computed.

    mip_levels : (l, h, w, c) texels of each mip level, starting with the finest level; l is the number of
        array layers of the texture
    """
    for mip, layers in enumerate(mip_levels):
        for layer, texels in enumerate(layers):
            upload(renderer.device, texture, texels, mip=mip, layer=layer)
    if len(mip_levels) < texture.mip_level_count:
        frame = CommandList(renderer.device, timed=False)
        map_mips.fill_mips(frame, map_mips.with_mip_views(texture))
        frame.submit()
