"""A network that recognises expressions agrees with the intended emotions (tools/expression_check.py)."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

from dermis.frame.renderer import Renderer

TOOL = Path(__file__).parents[2] / "tools" / "expression_check.py"
NODE_MODULES = os.environ.get("DERMIS_FACE_API")
pytestmark = pytest.mark.skipif(not NODE_MODULES, reason="DERMIS_FACE_API is not set")
PEOPLE, SIDE = (1, 4), 192


def test_network_recognises_five_of_six_emotions() -> None:
    specification = importlib.util.spec_from_file_location("expression_check", TOOL)
    assert specification is not None and specification.loader is not None and NODE_MODULES is not None
    tool = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(tool)
    renderer = Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))
    for seed in PEOPLE:
        pictures = tool.portraits(renderer, seed, tool.EMOTIONS, SIDE)
        words = tool.recognised(Path(NODE_MODULES), pictures)
        emotions = list(zip(tool.EMOTIONS.values(), words, strict=True))[1:]
        assert sum(intended == word for intended, word in emotions) >= 5, emotions
