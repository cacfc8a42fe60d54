"""Device time of evaluating each lobe of surface reflection."""

from __future__ import annotations

import statistics
import time
from pathlib import Path

from dermis.apps.validation.pages import JsonObject
from dermis.frame.features.surface.record import surface_constants
from dermis.frame.programs import shader_folders
from dermis.gpu import CommandList, ComputeProgram, Device, make_texture
from dermis.gpu.textures import texture_from_array
from dermis.scene.skin import Skin
from dermis.specular.albedo import albedo_table
from dermis.specular.beckmann import beckmann_table
from dermis.specular.fresnel import FRESNEL, SKIN_ETA, SKIN_F0
from dermis.specular.models import MODELS

_TIMED_REPEATS = 5
_WARM_UP_S = 0.5  # because an idle GPU has a reduced clock rate
_SHADER = Path(__file__).with_suffix(".wgsl")
_POINTS_PER_SIDE, _LIGHTS_PER_POINT = 1024, 64  # points along each side, and lights per point
_POINTS_PER_SIDE_ON_CPU, _LIGHTS_PER_POINT_ON_CPU = 256, 16


def lobe_cost_ns(device: Device) -> dict[tuple[str, str], float]:
    """Return the device time per evaluation of each lobe model with each Fresnel term [ns].

    The time is the inverse throughput of the whole device, minus the time of a loop that evaluates no lobe.
    A key of the result is a pair: a key of MODELS and a key of FRESNEL.
    """
    on_cpu = device.adapter.kind == "CPU"
    side, lights = (
        (_POINTS_PER_SIDE_ON_CPU, _LIGHTS_PER_POINT_ON_CPU)
        if on_cpu
        else (_POINTS_PER_SIDE, _LIGHTS_PER_POINT)
    )
    skins = [Skin.model_validate({"specular": m, "fresnel": f}) for m in MODELS for f in FRESNEL]
    overrides = [{"IDLE": 1}, *(dict(surface_constants(skin)) for skin in skins)]
    constants = ({"LIGHTS": lights, **one} for one in overrides)
    programs = [ComputeProgram(device, _SHADER, shader_folders(), one) for one in constants]
    bindings = {
        "skin": programs[-1].make_record("Skin", f0=SKIN_F0, eta=SKIN_ETA),
        "beckmann_table": texture_from_array(device, beckmann_table(), "r32float"),
        "nearest_sampler": device.sampler(),
        "albedo_table": texture_from_array(device, albedo_table(), "rg32float"),
        "sums": make_texture(device, (side, side), "r32float"),
    }
    started = time.perf_counter()
    while time.perf_counter() - started < _WARM_UP_S:
        _pass_ms(device, programs[0], bindings, side)
    repeats = [[_pass_ms(device, one, bindings, side) for one in programs] for _ in range(_TIMED_REPEATS)]
    loop, *lobe_times = (statistics.median(times) for times in zip(*repeats, strict=True))
    return {
        (skin.specular, skin.fresnel): 1e6 * max(0.0, ms - loop) / (side**2 * lights)
        for skin, ms in zip(skins, lobe_times, strict=True)
    }


def _pass_ms(
    device: Device, program: ComputeProgram, bindings: JsonObject, invocations_per_axis: int
) -> float:
    """Return the time of one compute pass [ms].

    The time is measured by timestamps, or by `perf_counter` on devices without timestamps.

    bindings : dictionary from the name of a binding to its resource
    invocations_per_axis : number of invocations along each of two axes
    """
    frame = CommandList(device)
    started = time.perf_counter()
    frame.compute("lobe", program, bindings, (invocations_per_axis, invocations_per_axis))
    frame.submit()
    frame.wait()
    wall_ms = 1e3 * (time.perf_counter() - started)
    times = frame.stage_ms()
    return times["lobe"] if times else wall_ms
