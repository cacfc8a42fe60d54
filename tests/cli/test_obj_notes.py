"""Notes of `dermis render` about an OBJ file with missing pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., Any]


@pytest.mark.usefixtures("opened")
def test_a_missing_picture_is_one_note(run: Run, folder: Path) -> None:
    text = (folder / "head.obj").read_text()
    (folder / "head.obj").write_text(f"mtllib head.mtl\n{text}")
    (folder / "head.mtl").write_text("newmtl skin\nmap_Kd gone.png\n")
    ended = run("render", "head.obj", "--size", "32x32", "--atlas", "64", "-o", "out.png")
    assert ended.code == 0 and (folder / "out.png").is_file()
    lines = ended.stderr.splitlines()
    assert lines[0].startswith("note: head.obj: ")
    assert "'skin': map_Kd: gone.png is not in its folder" in lines[1]
    assert ended.stderr.count("gone.png") == 1
