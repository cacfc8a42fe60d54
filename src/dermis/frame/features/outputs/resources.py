"""Resources of the requested outputs of a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dermis.frame.features.outputs.labels import LabelBuffers, make_label_buffers
from dermis.frame.features.outputs.landmarks import LandmarkBuffers, make_landmark_buffers
from dermis.frame.features.outputs.light import LightOutputs, make_light_outputs
from dermis.frame.features.outputs.planes import Planes, make_planes
from dermis.frame.features.shape.shape import Shape, ShapeTables, make_shape
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.features.visibility.layers import ViewLayers, make_layers
from dermis.frame.request import FrameRequest
from dermis.gpu import Buffer, Device, Memo
from dermis.scene.outputs import OUTPUTS


@dataclass(frozen=True, eq=False)
class Resources:
    """Space for a frame's outputs.

    names : as requested
    planes : a buffer for each stage that makes some
    centres : triangles at the pixels' centres; None where the picture's only sample lies there
    previous : the shape in the scene before, None where nothing reads it
    light : for outputs of light and of what is below the skin
    labels, landmarks : None where none are requested
    """

    names: tuple[str, ...]
    planes: tuple[Planes, ...]
    centres: ViewLayers | None
    previous: Shape | None
    light: LightOutputs
    labels: LabelBuffers | None
    landmarks: LandmarkBuffers | None

    @property
    def buffers(self) -> list[Buffer]:
        """Those that are read back, in order."""
        last = [self.landmarks.buffer] if self.landmarks else []
        return [*(planes.buffer for planes in self.planes), *last]

    def planes_of(self, name: str) -> Planes:
        """Return those that hold an output."""
        return next(planes for planes in self.planes if name in planes.channels)


def make(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    tables: ShapeTables,
    thin: Sequence[Translucency | None],
) -> Resources | None:
    """Return space for the requested outputs, None for none.

    thin : thin parts of each layout

    Raises DermisError for more than the device has in one buffer, and for outputs that the scene has not.
    """
    if not request.outputs and not request.landmarks:
        return None
    settings, cached = request.settings, memo.get
    stages: dict[str, list[tuple[str, int]]] = {}
    for name, channels in request.output_channels.items():
        stages.setdefault(OUTPUTS[name].stage, []).append((name, channels))
    names, bare = request.landmarks, request.head.bare
    return Resources(
        names=request.outputs,
        planes=tuple(
            cached(make_planes, device, stage, tuple(of), settings.size, owner=stage)
            for stage, of in stages.items()
        ),
        centres=None if settings.samples == 1 else cached(_centres, device, settings.size),
        previous=cached(make_shape, device, tables, owner="before") if "motion" in stages else None,
        light=make_light_outputs(memo, device, request, thin),
        labels=make_label_buffers(memo, device, request),
        landmarks=cached(make_landmark_buffers, device, bare, names) if names else None,
    )


def _centres(device: Device, size: tuple[int, int]) -> ViewLayers:
    return make_layers(device, size, 1, triangles=True)
