"""Strands that the device grows, the same strands grown by NumPy, and their height above the skin."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from dermis import Human, Renderer, Scene
from dermis.base.arrays import Floats
from dermis.frame.features.hair import passes
from dermis.frame.features.hair.resources import StrandCounts, StrandTables
from dermis.human.hair.styles import styles
from dermis.mesh.grown_strands import grow_strands
from dermis.mesh.head import Head

_BY_STYLE = {"long": 0.3, "cornrows": 0.9, "bun": 0.1, "afro": 0.95, "twists": 0.9, "short": 0.0}


def styled(style: str, curl: float, seed: int = 5, **look: Any) -> Head:
    person = Human.sampled(seed)
    hair = replace(person.hair_look, style=style, length_mm=styles()[style].length_mm, curl=curl, **look)
    return replace(person, hair=hair).head()


def rows_on_device(head: Head, monkeypatch: pytest.MonkeyPatch) -> tuple[StrandCounts, Floats]:
    """Return the counts and the rows (n, k + 2, 4) of the coarse strands that a frame draws."""
    found = list[tuple[StrandTables, Any, StrandCounts]]()
    pose_strands = passes.pose_strands

    def record(graph: Any, tables: StrandTables, shape: Any, posed: Any, coarse: StrandCounts) -> None:
        found.append((tables, posed, coarse))
        pose_strands(graph, tables, shape, posed, coarse)

    monkeypatch.setattr(passes, "pose_strands", record)
    renderer = Renderer()
    renderer.render(Scene(head), size=(64, 64), atlas=256)
    tables, posed, coarse = found[-1]
    rows = np.frombuffer(renderer.device.handle.queue.read_buffer(posed), np.float32).reshape(-1, 4)
    first = tables.fine.hairs * (tables.fine.knots + 2)
    return coarse, rows[first : first + coarse.hairs * (coarse.knots + 2)].reshape(coarse.hairs, -1, 4)


@pytest.mark.parametrize(("style", "curl"), _BY_STYLE.items())
def test_device_and_numpy_grow_the_same_strands(
    style: str, curl: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    head = styled(style, curl, beard_mm=6.0, grey=0.3)
    assert head.hair is not None
    coarse, rows = rows_on_device(head, monkeypatch)
    grown = rows[rows[:, 2, 3] > 0.0]
    points_mm = head.mesh.points_mm
    strands = grow_strands(replace(head.hair, knots=coarse.knots), head.mesh, points_mm, coarse.hairs)
    assert len(strands) == len(grown)
    distance = np.linalg.norm(grown[:, 2:, :3] - strands.knot_positions_mm(head.mesh, points_mm), axis=2)
    assert np.median(distance) < 1e-3
    assert np.quantile(distance, 0.999) < 0.05
    assert np.allclose(grown[:, 2:, 3], strands.radius_mm, rtol=1e-3)
    assert np.allclose(grown[:, 1, :3], strands.absorption, rtol=1e-3)
