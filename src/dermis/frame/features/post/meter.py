"""The exposure meter, an incident one: it goes by the light on the skin, so that dark skin stays dark."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.frame.features.shading.view import ray_record
from dermis.frame.programs import program
from dermis.gpu import Bindings, Buffer, Constants, Device, Recorder, Texture, UniformRecord
from dermis.scene.settings import Settings

SIDE = 64
"""Points along each side of the grid over the picture at which the meter looks."""
KEY = 0.85
"""What white skin shows in the light that is metered: studio light then keeps an exposure of about 1."""
CLIPPING = 0.01
"""Share of the skin in view that may be brighter than the picture can show."""
STOPPED_DOWN = 0.5
"""Least factor by which highlights lower the exposure: one stop."""


def meter_numbers() -> dict[str, float]:
    """By the shaders' names."""
    shares = {"meter_clipping": CLIPPING, "meter_stopped_down": STOPPED_DOWN}
    return {"meter_side": SIDE, "meter_key": KEY, **shares}


@dataclass(frozen=True, eq=False)
class Meter:
    """Buffers of what is metered at each point, and of the exposure that follows."""

    points: Buffer
    exposure: Buffer


def make_meter(device: Device) -> Meter:
    """Space for the meter."""
    return Meter(device.storage_buffer(8 * SIDE * SIDE), device.buffer(np.ones(1, np.float32), "STORAGE"))


def draw(
    graph: Recorder,
    meter: Meter,
    look: tuple[Bindings, UniformRecord, Constants],
    visibility: Texture,
    image: Texture,
) -> None:
    """Meter the skin that a picture shows.

    look : resources and record of the shading, and pipeline constants of the lights
    visibility : texture of the triangles that samples see
    image : texture of the picture's radiance
    """
    lit, view, constants = look
    shader, key = (
        program(graph.device, "post/meter.wgsl", constants),
        program(graph.device, "post/meter_key.wgsl"),
    )
    record = shader.record("Look", rays=ray_record(shader, view), place=view["jitter"][0, :2])
    bound = {**lit, "look": record, "visibility_buffer": visibility, "image": image, "points": meter.points}
    graph.compute("meter", shader, bound, (SIDE, SIDE))
    graph.dispatch("meter", key, {"points": meter.points, "exposure": meter.exposure}, (1, 1, 1))


def exposure_input(device: Device, settings: Settings, meter: Meter | None) -> tuple[float, Buffer]:
    """The exposure for exposure.wgsl, 0 where it is metered, and the buffer that it reads."""
    if settings.exposure == "auto":
        assert meter is not None
        return 0.0, meter.exposure
    none = device.cached("no meter", lambda: device.buffer(np.ones(1, np.float32), "STORAGE"))
    return settings.exposure, none


def read_meter(device: Device, meter: Meter) -> float:
    """The exposure that the last frame was metered for; waits for it."""
    return float(np.frombuffer(device.handle.queue.read_buffer(meter.exposure), np.float32)[0])
