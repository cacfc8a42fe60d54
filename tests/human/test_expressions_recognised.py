"""A network recognises the expressions that are clear without context (tools/expression_check.py)."""

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
CLEAR = "neutral", "joy", "surprise"
"""Expressions that the network recognises on nearly all people; it confuses the others with one another."""


def test_network_recognises_clear_expressions() -> None:
    specification = importlib.util.spec_from_file_location("expression_check", TOOL)
    assert specification is not None and specification.loader is not None and NODE_MODULES is not None
    tool = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(tool)
    renderer = Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))
    for seed in PEOPLE:
        pictures = tool.render_portraits(renderer, seed, tool.EMOTIONS, SIDE)
        words = tool.recognised_expressions(Path(NODE_MODULES), pictures)
        found = dict(zip(tool.EMOTIONS, words, strict=True))
        assert {name: found[name] for name in CLEAR} == {name: tool.EMOTIONS[name] for name in CLEAR}
