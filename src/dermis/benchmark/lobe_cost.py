"""How long a device takes to evaluate each surface lobe."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dermis.frame.passes import shader_folders
from dermis.frame.surface import constants
from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.gpu.textures import texture_from
from dermis.scene.skin import Skin
from dermis.specular.albedo import albedo_table
from dermis.specular.beckmann import beckmann_table
from dermis.specular.fresnel import FRESNEL, SKIN_ETA, SKIN_F0
from dermis.specular.models import MODELS

_REPEATS = 5
_WARMING_S = 0.5  # a GPU that was idle runs at a fraction of its clock rate
_SHADER = Path(__file__).with_suffix(".wgsl")


@dataclass(frozen=True)
class _Load:
    """Points and lights for each: as many evaluations as one pass makes."""

    side: int
    lights: int

    @property
    def evaluations(self) -> int:
        return self.side**2 * self.lights


_ON_CPU, _ON_GPU = _Load(256, 16), _Load(1024, 64)


def lobe_cost_ns(device: Device) -> dict[tuple[str, str], float]:
    """Device time of one evaluation by model and Fresnel curve, as named in MODELS and FRESNEL [ns].

    The inverse throughput of the whole device, less the cost of the loop without the lobe.
    """
    load = _ON_CPU if device.adapter.kind == "CPU" else _ON_GPU
    bench = _Bench(device, load)
    skins = [Skin.model_validate({"specular": m, "fresnel": f}) for m in MODELS for f in FRESNEL]
    programs = [bench.program({"IDLE": 1}), *(bench.program(dict(constants(skin))) for skin in skins)]
    bench.warm(programs[0])
    rounds = [[bench.pass_ms(program) for program in programs] for _ in range(_REPEATS)]
    loop, *taken = (statistics.median(times) for times in zip(*rounds, strict=True))
    per_evaluation = 1e6 / load.evaluations
    return {
        (skin.specular, skin.fresnel): max(0.0, ms - loop) * per_evaluation
        for skin, ms in zip(skins, taken, strict=True)
    }


class _Bench:
    """A pass of many evaluations."""

    def __init__(self, device: Device, load: _Load) -> None:
        self._device, self._load = device, load
        self._bound: dict[str, Any] = {
            "beckmann_table": texture_from(device, beckmann_table(), "r32float"),
            "nearest_sampler": device.sampler(),
            "albedo_table": texture_from(device, albedo_table(), "rg32float"),
            "sums": make_texture(device, (load.side, load.side), "r32float"),
        }

    def program(self, overrides: dict[str, float]) -> ComputeProgram:
        """The shader with values of its `override`s."""
        constants = {"LIGHTS": self._load.lights, **overrides}
        program = ComputeProgram(self._device, _SHADER, shader_folders(), constants)
        self._bound["skin"] = program.record("Skin", f0=SKIN_F0, eta=SKIN_ETA)
        return program

    def warm(self, program: ComputeProgram) -> None:
        """Keep the device busy until its clock rate is up."""
        started = time.perf_counter()
        while time.perf_counter() - started < _WARMING_S:
            self.pass_ms(program)

    def pass_ms(self, program: ComputeProgram) -> float:
        """Time of one pass by the device's clock, or by the wall's without timestamps [ms]."""
        frame = Frame(self._device)
        started = time.perf_counter()
        frame.compute("lobe", program, self._bound, (self._load.side, self._load.side))
        frame.submit()
        frame.wait()
        wall_ms = 1e3 * (time.perf_counter() - started)
        times = frame.stage_ms()
        return times["lobe"] if times else wall_ms
