"""The documentation builds without a warning."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"


def test_pages_build(tmp_path: Path) -> None:
    quickly = ["-q", "-W", "--keep-going", "-D", "turning_head="]
    command = [sys.executable, "-m", "sphinx", *quickly, str(DOCS), str(tmp_path)]
    built = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert built.returncode == 0, built.stderr
    reference = (tmp_path / "generated" / "reference.html").read_text("utf-8")
    text = re.sub(r"<[^>]+>", "", reference)
    for dump in ("_Buffer", "FieldInfo", "pydantic", "factory", "**data"):
        assert dump not in text
    assert (
        "dermis.Camera(position: tuple[float, float, float], *, target: tuple[float, float, float] = (0.0"
        in " ".join(text.split())
    )
    assert "-----" not in text  # numpydoc sections are fields
    for section in ("Parameters", "Returns", "Raises"):
        assert f"{section}:" in text
    assert "from_opencv" in text and "irradiance" in text.partition("dermis.SpotLight")[2][:3000]  # inherited
    assert {"african", "asian", "caucasian", "weights", "bones"} <= set(re.findall(r"\w+", text))
    assert "math notranslate" in (tmp_path / "profiles.html").read_text("utf-8")
    assert "The whole technique in studio light" in (tmp_path / "generated" / "gallery.html").read_text(
        "utf-8"
    )


def test_the_front_page_turns_a_head(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    from turning_head import FILE, turning

    text = (DOCS / "index.md").read_text("utf-8")
    shown = turning(text, "human")
    assert f'<iframe src="{FILE}"' in shown and "![" not in shown and turning(text, "") == text
    assert shown.partition("{toctree}")[2] == text.partition("{toctree}")[2]


def test_equations_of_the_gallery_are_ones_that_tex_can_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    from generated_pages import gallery
    from matplotlib.mathtext import MathTextParser

    drawn = re.findall(r"^\$\$(.*)\$\$$", gallery(), re.MULTILINE)
    assert len(drawn) > 10
    for equation in drawn:
        assert equation.isascii() and MathTextParser("path").parse(f"${equation}$").width > 0
