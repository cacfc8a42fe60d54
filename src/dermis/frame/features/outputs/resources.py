"""Resources of the requested outputs of a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dermis.frame.features.outputs.labels import LabelBuffers, make_label_buffers
from dermis.frame.features.outputs.landmarks import LandmarkBuffers, make_landmark_buffers
from dermis.frame.features.outputs.light import LightOutputs, make_light_outputs
from dermis.frame.features.outputs.output_images import OutputImages, make_output_images
from dermis.frame.features.shape.shape import Shape, ShapeTables, make_shape
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.features.visibility.layers import ViewLayers, make_layers
from dermis.frame.request import FrameRequest
from dermis.gpu import Buffer, Device, Memo
from dermis.scene.outputs import OUTPUTS


@dataclass(frozen=True, eq=False)
class Resources:
    """Resources of the outputs of a frame.

    names : names of the outputs in the order of the request
    images : buffers of the outputs, one for each shader that computes outputs
    centres : texture with the index of the triangle that covers each pixel centre; None without multisampling
    previous : shape of the head in the previous scene, None if no motion vectors are requested
    light : resources for outputs of light and skin
    labels : buffers of the labels, None if neither labels nor landmarks are requested
    landmarks : buffers of the landmarks, None if no landmarks are requested
    """

    names: tuple[str, ...]
    images: tuple[OutputImages, ...]
    centres: ViewLayers | None
    previous: Shape | None
    light: LightOutputs
    labels: LabelBuffers | None
    landmarks: LandmarkBuffers | None

    @property
    def buffers(self) -> list[Buffer]:
        """Return the buffers to read back after the picture, in the order that `Readback` expects."""
        landmarks = [self.landmarks.results] if self.landmarks else []
        return [*(images.buffer for images in self.images), *landmarks]

    def images_with_output(self, output_name: str) -> OutputImages:
        """Return the buffer that holds an output and the other outputs of the same shader."""
        return next(images for images in self.images if output_name in images.channels)


def make_resources(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    shape_tables: ShapeTables,
    translucency: Sequence[Translucency | None],
) -> Resources | None:
    """Return the resources of the requested outputs, None if none are requested.

    translucency : for each atlas layout, the resources of light through thin parts of the head; None if the
        scene has no such light

    Raises DermisError if the outputs do not fit in one buffer of the device, or if the scene cannot provide
    them.
    """
    if not request.outputs and not request.landmarks:
        return None
    settings, cached = request.settings, memo.get
    stages: dict[str, list[tuple[str, int]]] = {}
    for name, channels in request.output_channels.items():
        stages.setdefault(OUTPUTS[name].stage, []).append((name, channels))
    sets, bare = request.landmarks, request.head.without_maps
    return Resources(
        names=request.outputs,
        images=tuple(
            cached(make_output_images, device, stage, tuple(outputs), settings.size, caller_name=stage)
            for stage, outputs in stages.items()
        ),
        centres=None if settings.samples == 1 else cached(_make_centre_layers, device, settings.size),
        previous=cached(make_shape, device, shape_tables, caller_name="before")
        if "motion" in stages
        else None,
        light=make_light_outputs(memo, device, request, translucency),
        labels=make_label_buffers(memo, device, request),
        landmarks=cached(make_landmark_buffers, device, bare, sets) if sets else None,
    )


def _make_centre_layers(device: Device, picture_size: tuple[int, int]) -> ViewLayers:
    return make_layers(device, picture_size, 1, store_triangles=True)
