"""Pipelines of a shader: those used last are kept, and no more."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from dermis.frame.passes import variants
from dermis.frame.passes.variants import Constants, Variants
from dermis.gpu import Device


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The first switch of each pipeline that was compiled."""
    log: list[int] = []

    def compiled(device: Any, path: Any, folders: Any, constants: dict[str, int]) -> object:
        log.append(constants["MODEL"])
        return object()

    monkeypatch.setattr(variants, "ComputeProgram", compiled)
    monkeypatch.setattr(variants, "_MOST", 3)
    return log


def of(model: int) -> Constants:
    return (("MODEL", model),)


def test_going_back_and_forth_compiles_nothing(device: Device, made: list[int]) -> None:
    shader = Variants(device, Path("shade.wgsl"))
    first = [shader.program(of(k)) for k in (1, 2, 3)]
    assert [shader.program(of(k)) for k in (1, 2, 3, 1)] == [*first, first[0]]
    assert made == [1, 2, 3]


def test_the_one_used_longest_ago_goes(device: Device, made: list[int]) -> None:
    shader = Variants(device, Path("shade.wgsl"))
    for k in (1, 2, 3, 1, 4, 1, 3, 2):
        shader.program(of(k))
    assert made == [1, 2, 3, 4, 2]
