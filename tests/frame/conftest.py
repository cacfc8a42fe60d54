"""One renderer for all tests of the frame: compiling its shaders takes seconds."""

from __future__ import annotations

import os

import pytest
from observed import observed
from tolerances import HALVES, TWIN

from dermis.frame.observation import Observation
from dermis.frame.programs import FLOATS, level_format
from dermis.frame.renderer import Renderer
from dermis.gpu import Device


@pytest.fixture(scope="session")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


@pytest.fixture(scope="session")
def close(device: Device) -> float:
    """How close light is to its twin after the blurs, of its scale."""
    return TWIN if level_format(device) == FLOATS else HALVES


@pytest.fixture(scope="session")
def device(renderer: Renderer) -> Device:
    return renderer.device


@pytest.fixture(scope="session")
def seen(renderer: Renderer) -> dict[str, Observation]:
    """People with labels and landmarks."""
    return observed(renderer)
