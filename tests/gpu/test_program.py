"""Pipelines that are compiled on other threads."""

from __future__ import annotations

from pathlib import Path

import pytest
import wgpu

from dermis.gpu import ComputeProgram, Device

SHADER = Path(__file__).parent / "scale.wgsl"


def test_a_pipeline_is_the_same_each_time(device: Device) -> None:
    program = ComputeProgram(device, SHADER)
    assert program.pipeline is program.pipeline


def test_what_does_not_compile_is_told_to_who_needs_it(device: Device) -> None:
    """And again to who comes back."""
    program = ComputeProgram(device, SHADER, constants={"NO_SUCH_SWITCH": 1})
    for _ in range(2):
        with pytest.raises(wgpu.GPUError, match="NO_SUCH_SWITCH"):
            _ = program.pipeline
