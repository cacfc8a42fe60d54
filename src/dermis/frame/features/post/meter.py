"""Exposure meter, which measures the irradiance (not the radiance) of skin, so that dark skin stays dark."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.frame.features.shading.view import ray_record
from dermis.frame.programs import program
from dermis.gpu import Bindings, Buffer, Constants, Device, Recorder, Texture, UniformRecord
from dermis.scene.settings import Settings

METER_GRID_SIDE = 64
"""Number of metered points along each side of a grid over the picture."""
METERED_IRRADIANCE = 0.85
"""Linear value of white skin after exposure, chosen so that the exposure of studio light is about 1."""
MAX_CLIPPED_FRACTION = 0.01
"""Largest fraction of the visible skin that may be overexposed."""
MIN_HIGHLIGHT_FACTOR = 0.5
"""Least factor by which the exposure is scaled to preserve highlights; 0.5 is one stop."""
FULL_SKIN_REFLECTANCE = 0.53
"""Reflectance of skin, in its largest channel, up to which the exposure for skin is longer than usual."""
SKIN_COMPENSATION = 0.43
"""Exponent with which the exposure for skin grows with the inverse of its reflectance."""
MAX_SKIN_FACTOR = 2.0
"""Largest factor by which dark skin is exposed longer; 2 is one stop."""


def shader_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in shaders of the meter."""
    highlights = {"meter_clipping": MAX_CLIPPED_FRACTION, "meter_stopped_down": MIN_HIGHLIGHT_FACTOR}
    skin = {
        "full_skin_reflectance": FULL_SKIN_REFLECTANCE,
        "skin_compensation": SKIN_COMPENSATION,
        "max_skin_factor": MAX_SKIN_FACTOR,
    }
    return {"meter_side": METER_GRID_SIDE, "meter_key": METERED_IRRADIANCE, **highlights, **skin}


@dataclass(frozen=True, eq=False)
class Meter:
    """Buffers of the exposure meter: measurements on a grid of points in the picture, and the exposure."""

    points: Buffer
    exposure: Buffer


def make_meter(device: Device) -> Meter:
    """Allocate the buffers of the exposure meter."""
    return Meter(
        device.storage_buffer(8 * METER_GRID_SIDE * METER_GRID_SIDE),
        device.buffer(np.ones(1, np.float32), "STORAGE"),
    )


def draw(
    graph: Recorder,
    meter: Meter,
    shading_inputs: tuple[Bindings, UniformRecord, Constants],
    visibility_buffer: Texture,
    radiance_image: Texture,
    for_skin: bool,
) -> None:
    """Declare the passes that measure the irradiance of the visible skin, and derive the exposure from it.

    shading_inputs : resources of the lighting, uniform record of the shading pass, and pipeline constants of
        the lights
    visibility_buffer : texture with the index of the triangle that covers each sample
    radiance_image : texture of the radiance of the picture
    for_skin : whether the exposure depends on the reflectance of the skin too
    """
    lighting, view, constants = shading_inputs
    shader = program(graph.device, "post/meter.wgsl", constants)
    camera = shader.make_record("MeterCamera", rays=ray_record(shader, view), sample=view["jitter"][0, :2])
    images = {"visibility_buffer": visibility_buffer, "image": radiance_image}
    bindings = {**lighting, **images, "camera": camera, "points": meter.points}
    graph.compute("meter", shader, bindings, (METER_GRID_SIDE, METER_GRID_SIDE))
    key = program(graph.device, "post/meter_key.wgsl", (("FOR_SKIN", for_skin),))
    graph.dispatch("meter", key, {"points": meter.points, "exposure": meter.exposure}, (1, 1, 1))


def exposure_inputs(device: Device, settings: Settings, meter: Meter | None) -> tuple[float, Buffer]:
    """Return the fixed exposure and the buffer of the metered exposure, the inputs of exposure.wgsl.

    The fixed exposure is 0 if the metered exposure is used.
    """
    if isinstance(settings.exposure, str):
        assert meter is not None
        return 0.0, meter.exposure
    unused = device.cached("no meter", lambda: device.buffer(np.ones(1, np.float32), "STORAGE"))
    return settings.exposure, unused


def read_meter(device: Device, meter: Meter) -> float:
    """Wait for the exposure that was metered in the last frame, and return it [-]."""
    return float(np.frombuffer(device.handle.queue.read_buffer(meter.exposure), np.float32)[0])
