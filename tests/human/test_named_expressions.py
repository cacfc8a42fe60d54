"""Named expressions are defined in one place, and other packages can register more."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import dermis
from dermis.apps.batch.spec import parse_spec
from dermis.base.errors import DermisError
from dermis.human.expressions import EXPRESSIONS, expand_targets, expression
from dermis.human.movement import expression_targets

ROOT = Path(__file__).parent.parent.parent


def test_all_expressions_move_existing_targets() -> None:
    known = set(expression_targets().names)
    for name, weights in EXPRESSIONS.items():
        assert expression(name).keys() == set(expand_targets(weights)) <= known
        assert all(0 < weight <= 1 for weight in weights.values())


def test_name_without_a_side_means_both_sides() -> None:
    assert expression("faint-smile") == {
        f"{name}{side}": 0.35 for name in ("mouthSmile", "cheekSquint") for side in ("Left", "Right")
    }
    assert expression("open-jaw") == {"jawOpen": 0.8}
    with pytest.raises(DermisError, match=r"expression: expected one of neutral, smile, .*got 'simle'"):
        expression("simle")


def test_plugin_expression_is_usable_in_data_sets() -> None:
    with EXPRESSIONS.temporary_entry("sly", {"mouthSmileLeft": 0.3}):
        assert dermis.Pose(expression("sly")).weights == {"mouthSmileLeft": 0.3}
        parse_spec({"count": 10, "expression": {"name": "sly"}})
    with pytest.raises(DermisError, match="got 'sly'"):
        parse_spec({"count": 10, "expression": {"name": "sly"}})


@pytest.mark.parametrize("folder", ["src", "gallery", "tools", "benchmarks"])
def test_expressions_are_defined_in_one_file(folder: str) -> None:
    """Find dictionaries and calls with weights of two ARKit shapes."""
    known = set(expression_targets().names)
    known |= {name.removesuffix(side) for name in known for side in ("Left", "Right")}
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            keys = node.keys if isinstance(node, ast.Dict) else []
            names = {key.value for key in keys if isinstance(key, ast.Constant)}
            if isinstance(node, ast.Call):
                names = {word.arg for word in node.keywords if word.arg}
            assert len(names & known) < 2, (path, node.lineno)
