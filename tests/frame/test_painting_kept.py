"""Painted maps on disk: identical, for the same person only, and one person per device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.frame.features.surface.painting import paint as stage
from dermis.frame.features.surface.painting.paint import PaintInputs, RestMaps, cached_rest_maps, paint_inputs
from dermis.gpu import Device, download, open_device
from dermis.human.person import Human
from dermis.human.skin.look import SkinLook
from dermis.human.skin.surface import PaintedSurface, painted_surface

SIDE = 256
LOOK = SkinLook(freckles=0.5)


@pytest.fixture(scope="module")
def surface() -> PaintedSurface:
    head = Human().head()
    return painted_surface(head.mesh, head.control_rig.stencils)


@pytest.fixture
def new(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Device:
    """Return a device that has painted nothing yet, with an empty cache."""
    if device.adapter.kind != "CPU":
        pytest.skip("GPUs paint faster than they read back")
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    return another(device)


def another(device: Device) -> Device:
    return open_device(device.adapter.name)


def counted(monkeypatch: pytest.MonkeyPatch) -> list[PaintInputs]:
    """Return a list to which the inputs of each painting are appended."""
    log: list[PaintInputs] = []
    paint = stage.paint_rest_maps

    def noted(device: Device, given: PaintInputs, side: int) -> RestMaps:
        log.append(given)
        return paint(device, given, side)

    monkeypatch.setattr(stage, "paint_rest_maps", noted)
    return log


def bits(device: Device, made: RestMaps, animated: bool) -> list[Any]:
    maps = [download(device, one.texture) for one in (made.colour, made.specular, made.roughness)]
    moved = [download(device, made.deltas, layer=layer) for layer in range(2)] if animated else []
    return [*maps, np.frombuffer(device.handle.queue.read_buffer(made.heights), np.float32), *moved]


@pytest.mark.parametrize("animated", [False, True])
def test_cached_maps_equal_the_painted_ones(
    new: Device, surface: PaintedSurface, monkeypatch: pytest.MonkeyPatch, animated: bool
) -> None:
    log, given = counted(monkeypatch), paint_inputs(surface, LOOK, SIDE)
    painted = bits(new, cached_rest_maps(new, given, SIDE, animated), animated)
    second = another(new)
    found = bits(second, cached_rest_maps(second, given, SIDE, animated), animated)
    assert len(log) == 1
    assert [one.any() for one in painted].count(True) == len(painted)
    assert all(a.dtype == b.dtype and np.array_equal(a, b) for a, b in zip(painted, found, strict=True))


def test_cache_key_contains_everything_that_changes_the_paint(
    new: Device, surface: PaintedSurface, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another look, size or surface, expression deltas, and a damaged file lead to painting again."""
    log, given = counted(monkeypatch), paint_inputs(surface, LOOK, SIDE)
    cached_rest_maps(new, given, SIDE)
    elsewhere = replace(surface, vertices=surface.vertices * np.float32(1.001))
    for other in (
        paint_inputs(surface, replace(LOOK, seed=5), SIDE),
        paint_inputs(surface, replace(LOOK, eumelanin=0.9), SIDE),
        paint_inputs(elsewhere, LOOK, SIDE),
    ):
        cached_rest_maps(another(new), other, SIDE)
    cached_rest_maps(another(new), paint_inputs(surface, LOOK, 512), 512)
    cached_rest_maps(another(new), given, SIDE, with_expressions=True)
    assert len(log) == 6
    cached_rest_maps(another(new), given, SIDE)  # which what movements add lies beside
    assert len(log) == 6


def test_damaged_cache_file_is_repainted(
    new: Device, surface: PaintedSurface, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, given = counted(monkeypatch), paint_inputs(surface, LOOK, SIDE)
    cached_rest_maps(new, given, SIDE)
    (file,) = (tmp_path / "painted").iterdir()
    file.write_bytes(file.read_bytes()[:-4] + b"what")
    cached_rest_maps(another(new), given, SIDE)
    cached_rest_maps(another(new), given, SIDE)
    assert len(log) == 2


def test_device_keeps_maps_of_one_person(new: Device, surface: PaintedSurface, tmp_path: Path) -> None:
    for seed in range(3):
        cached_rest_maps(new, paint_inputs(surface, replace(LOOK, seed=seed), SIDE), SIDE)
    assert len(list((tmp_path / "painted").iterdir())) == 1
