"""Space for the outputs that are asked of a frame."""

from __future__ import annotations

from typing import Any

from dermis.frame.asked import Asked
from dermis.frame.atlas_layout import AtlasLayout
from dermis.frame.label_space import label_space
from dermis.frame.landmark_space import landmark_space
from dermis.frame.light_space import light_space
from dermis.frame.outputs import OUTPUTS
from dermis.frame.passes.outputs.planes import OutputResources, make_planes
from dermis.frame.passes.visibility_buffer import make_layers
from dermis.frame.shape import ShapeTables, make_shape
from dermis.gpu import Device, Memo


def output_resources(
    memo: Memo, device: Device, asked: Asked, layouts: tuple[AtlasLayout, ...], tables: ShapeTables
) -> OutputResources | None:
    """Space for the outputs that are asked, None for none.

    Raises DermisError for more than the device has in one buffer, and for outputs that the scene has not.
    """
    if not asked.outputs and not asked.landmarks:
        return None
    settings, keep = asked.settings, memo.keep
    stages: dict[str, list[tuple[str, int]]] = {}
    for name, channels in asked.output_channels.items():
        stages.setdefault(OUTPUTS[name].stage, []).append((name, channels))
    planes = [
        keep(make_planes, device, stage, tuple(of), settings.size, of=stage) for stage, of in stages.items()
    ]
    moves = any(OUTPUTS[name].stage == "motion" for name in asked.outputs)
    return OutputResources(
        names=asked.outputs,
        planes=tuple(planes),
        centres=None if settings.samples == 1 else keep(_centres, device, settings.size),
        before=keep(make_shape, device, tables, of="before") if moves else None,
        light=light_space(memo, device, asked, layouts),
        labels=label_space(memo, device, asked),
        landmarks=keep(landmark_space, device, asked.head.bare, asked.landmarks) if asked.landmarks else None,
    )


def _centres(device: Device, size: tuple[int, int]) -> Any:
    return make_layers(device, size, 1, triangles=True)
