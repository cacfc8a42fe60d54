"""The page about outputs agrees with the registry, and its Python code runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dermis.scene.outputs import OUTPUTS

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "outputs.md").read_text("utf-8")


def test_table_lists_the_registered_outputs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Updated by python tools/outputs_page.py."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    from outputs_page import page

    assert page(PAGE) == PAGE
    assert all(f"| `{name}` |" in PAGE for name in OUTPUTS)


def test_examples_of_the_outputs_page_run(monkeypatch: pytest.MonkeyPatch, device: object) -> None:
    """At a small size."""
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    text = "".join(re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
    names: dict[str, object] = {}
    exec(text.replace("size=512", "size=48, atlas=128, samples=1, shadow_size=128"), names)
    assert getattr(names["depth"], "shape", None) == (48, 48)
    assert abs(names["moved"]).max() > 0.1  # type: ignore[arg-type]
