"""Painted maps on disk: the same to the bit, for the same person alone, and of one person to a device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.frame.features.surface.painting import paint as stage
from dermis.frame.features.surface.painting.paint import Given, Resting, given_for, resting
from dermis.gpu import Device, download, open_device
from dermis.human.person import Human
from dermis.human.skin.look import SkinLook
from dermis.human.skin.surface import Painting, painting

SIDE = 256
LOOK = SkinLook(freckles=0.5)


@pytest.fixture(scope="module")
def surface() -> Painting:
    head = Human().head()
    return painting(head.mesh, head.control.stencils)


@pytest.fixture
def new(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Device:
    """A device that has painted nothing yet, and an empty cache."""
    if device.adapter.kind != "CPU":
        pytest.skip("GPUs paint faster than they read back")
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    return another(device)


def another(device: Device) -> Device:
    return open_device(device.adapter.name)


def counted(monkeypatch: pytest.MonkeyPatch) -> list[Given]:
    """What is painted from now on."""
    log: list[Given] = []
    paint = stage.painted

    def noted(device: Device, given: Given, side: int) -> Resting:
        log.append(given)
        return paint(device, given, side)

    monkeypatch.setattr(stage, "painted", noted)
    return log


def bits(device: Device, made: Resting, moving: bool) -> list[Any]:
    maps = [download(device, one.texture) for one in (made.colour, made.specular, made.roughness)]
    moved = [download(device, made.moved, layer=layer) for layer in range(2)] if moving else []
    return [*maps, np.frombuffer(device.handle.queue.read_buffer(made.heights), np.float32), *moved]


@pytest.mark.parametrize("moving", [False, True])
def test_what_is_found_is_what_was_painted(
    new: Device, surface: Painting, monkeypatch: pytest.MonkeyPatch, moving: bool
) -> None:
    log, given = counted(monkeypatch), given_for(surface, LOOK, SIDE)
    painted = bits(new, resting(new, given, SIDE, moving), moving)
    second = another(new)
    found = bits(second, resting(second, given, SIDE, moving), moving)
    assert len(log) == 1
    assert [one.any() for one in painted].count(True) == len(painted)
    assert all(a.dtype == b.dtype and np.array_equal(a, b) for a, b in zip(painted, found, strict=True))


def test_all_that_changes_the_paint_is_in_the_key(
    new: Device, surface: Painting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another look, size or surface, what movements add, and a file that is damaged, are painted anew."""
    log, given = counted(monkeypatch), given_for(surface, LOOK, SIDE)
    resting(new, given, SIDE)
    elsewhere = replace(surface, vertices=surface.vertices * np.float32(1.001))
    for other in (
        given_for(surface, replace(LOOK, seed=5), SIDE),
        given_for(surface, replace(LOOK, eumelanin=0.9), SIDE),
        given_for(elsewhere, LOOK, SIDE),
    ):
        resting(another(new), other, SIDE)
    resting(another(new), given_for(surface, LOOK, 512), 512)
    resting(another(new), given, SIDE, moving=True)
    assert len(log) == 6
    resting(another(new), given, SIDE)  # which what movements add lies beside
    assert len(log) == 6


def test_a_damaged_file_is_painted_over(
    new: Device, surface: Painting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, given = counted(monkeypatch), given_for(surface, LOOK, SIDE)
    resting(new, given, SIDE)
    (file,) = (tmp_path / "painted").iterdir()
    file.write_bytes(file.read_bytes()[:-4] + b"what")
    resting(another(new), given, SIDE)
    resting(another(new), given, SIDE)
    assert len(log) == 2


def test_one_person_is_kept_by_a_device(new: Device, surface: Painting, tmp_path: Path) -> None:
    for seed in range(3):
        resting(new, given_for(surface, replace(LOOK, seed=seed), SIDE), SIDE)
    assert len(list((tmp_path / "painted").iterdir())) == 1
