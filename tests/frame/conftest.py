"""One renderer for all tests of the frame, as compiling its shaders takes seconds."""

from __future__ import annotations

import os

import pytest
from observed import observed
from tolerances import HALVES, TWIN

from dermis.frame.observation import Observation
from dermis.frame.programs import FLOAT_TEXEL_FORMAT, level_format
from dermis.frame.renderer import Renderer
from dermis.gpu import Device


@pytest.fixture(scope="session")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


@pytest.fixture(scope="session")
def close(device: Device) -> float:
    """Return the tolerance of light after blurs against its reference, relative."""
    return TWIN if level_format(device) == FLOAT_TEXEL_FORMAT else HALVES


@pytest.fixture(scope="session")
def device(renderer: Renderer) -> Device:
    return renderer.device


@pytest.fixture(scope="session")
def seen(renderer: Renderer) -> dict[str, Observation]:
    """Return observations of people with labels and landmarks."""
    return observed(renderer)
