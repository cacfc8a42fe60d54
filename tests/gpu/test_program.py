"""Programs: pipelines compiled on other threads, and the cache of recent variants."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import wgpu

from dermis.gpu import ComputeProgram, Device, cached_program, program

SHADER = Path(__file__).parent / "scale.wgsl"


def test_pipelines_are_cached(device: Device) -> None:
    program = ComputeProgram(device, SHADER)
    assert program.pipeline is program.pipeline


def test_compile_error_reaches_the_caller(device: Device) -> None:
    """Check that a compilation error is raised whenever the pipeline is used."""
    program = ComputeProgram(device, SHADER, constants={"NO_SUCH_SWITCH": 1})
    for _ in range(2):
        with pytest.raises(wgpu.GPUError, match="NO_SUCH_SWITCH"):
            _ = program.pipeline


class Made:
    """A replacement for a program class that logs what is compiled."""

    def __init__(self) -> None:
        self.constants: list[dict[str, float]] = []

    def compile(self, constants: dict[str, float]) -> object:
        self.constants.append(constants)
        return object()

    def found(self, device: Device, models: Sequence[int]) -> list[Any]:
        """Return the programs of these models."""
        return [
            cached_program(device, "shader", (("MODEL", model),), partial(self.compile, {"MODEL": model}))
            for model in models
        ]


@pytest.fixture
def made(device: Device, monkeypatch: pytest.MonkeyPatch) -> Made:
    monkeypatch.setattr(device, "programs", {})
    monkeypatch.setattr(program, "_MAX_CACHED_VARIANTS", 3)
    return Made()


def test_switching_back_compiles_nothing(device: Device, made: Made) -> None:
    first = made.found(device, (1, 2, 3))
    assert made.found(device, (1, 2, 3, 1)) == [*first, first[0]]
    assert made.constants == [{"MODEL": 1}, {"MODEL": 2}, {"MODEL": 3}]


def test_least_recently_used_pipeline_is_dropped(device: Device, made: Made) -> None:
    made.found(device, (1, 2, 3, 1, 4, 1, 3, 2))
    assert [one["MODEL"] for one in made.constants] == [1, 2, 3, 4, 2]


def test_shaders_get_the_constants_that_they_have(tmp_path: Path) -> None:
    path = tmp_path / "own.wgsl"
    path.write_text("override STRIP: u32 = 1;\noverride WIDE: u32 = 0;\n", encoding="utf-8")
    given = (("STRIP", 16), ("WIDE", 2), ("OTHER", 3))
    assert program.used_constants(path, (), given) == {"STRIP": 16, "WIDE": 2}
