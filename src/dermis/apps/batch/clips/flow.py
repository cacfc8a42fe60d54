"""Optical flow of clips: displacement of each pixel's point to the frames before and after, and masks."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Bytes, Floats
from dermis.frame.features.outputs.output_images import OutputArray
from dermis.scene.outputs import Output, Quantisation

_FLOW_QUANTISATION = Quantisation(1 / 64, 32768)
_DEPTH_TOLERANCE_MM = 1.0
_STAGE = "clips"  # computed from outputs of a frame and its neighbours, not by a shader
FLOW_INPUTS = "depth", "motion", "motion_depth"
"""Outputs of a frame from which its flow is computed."""
FLOW_OUTPUTS: Mapping[str, Output] = MappingProxyType(
    {
        f"{quantity}_{direction}": Output(f"{quantity}_{direction}", _STAGE, *fields)
        for direction, frame in (("backward", "previous"), ("forward", "next"))
        for quantity, fields in (
            (
                "flow",
                ("XY", "float32", "pixel", f"displacement to the {frame} frame", 0.0, _FLOW_QUANTISATION),
            ),
            (
                "hidden",
                ("I", "uint8", "", f"1 where the {frame} frame does not show the point", 0.0),
            ),
        )
    }
)
"""Outputs of images of clips with flow, by name."""


def flow_outputs(
    direction: str, outputs: Mapping[str, OutputArray], other_depth: OutputArray
) -> dict[str, OutputArray]:
    """Return flow and mask of a frame relative to another frame of its clip.

    direction : "backward" or "forward"
    outputs : `FLOW_INPUTS` of the frame, with the other frame as the previous scene
    other_depth : (h, w) output "depth" of the other frame
    """
    flow = np.asarray(-outputs["motion"] + 0.0, np.float32)
    hidden = hidden_points(flow, outputs["depth"], outputs["motion_depth"], other_depth)
    return {f"flow_{direction}": flow, f"hidden_{direction}": hidden}


def hidden_points(
    flow: Floats, depth: OutputArray, depth_in_other: OutputArray, other_depth: OutputArray
) -> Bytes:
    """Return a mask (h, w) with 1 for points that another frame does not show.

    A point is hidden if the surfaces in all four pixels around it are nearer to the camera, or if it is
    outside the other picture. The background is hidden where the other frame has a surface.

    flow : (h, w, 2) displacement to the other frame [pixel]
    depth : (h, w) depth of the surface, 0 for the background [mm]
    depth_in_other : (h, w) depth of the same points in the other frame [mm]
    other_depth : (h, w) depth of the surfaces in the other frame, 0 for the background [mm]
    """
    height, width = depth.shape
    far = np.where(other_depth > 0, other_depth, np.inf)
    y, x = np.mgrid[:height, :width]
    places: NDArray[np.float64] = np.stack([x, y], axis=-1) + flow
    corner = np.floor(places).astype(np.int64)
    deepest = np.full((height, width), -np.inf)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column, row = np.clip(corner[..., 0] + dx, 0, width - 1), np.clip(corner[..., 1] + dy, 0, height - 1)
        deepest = np.maximum(deepest, far[row, column])
    inside = ((places >= -0.5) & (places <= np.array([width, height]) - 0.5)).all(axis=-1)
    seen = inside & (deepest >= depth_in_other - _DEPTH_TOLERANCE_MM)
    return np.where(depth > 0, ~seen, other_depth > 0).astype(np.uint8)
