"""`dermis render --landmarks`: the file beside the image, and refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Run = Callable[..., Any]


def test_a_table_by_vertex_is_written_beside_the_image(render: Run, folder: Path) -> None:
    (folder / "mine.csv").write_text("name,vertex\nfirst,0\nthird,2\n")
    ended = render("head.obj", "--landmarks", "mine.csv", "-o", "f.png", "--json")
    assert ended.code == 0 and json.loads(ended.stdout)["landmarks"] == "f.landmarks.json"
    told = json.loads((folder / "f.landmarks.json").read_text())
    assert told["gaze"] is None and np.shape(told["head_pose"]) == (3, 4)
    camera, rows = told["camera"], told["landmarks"]["mine.csv"]
    assert [row["name"] for row in rows] == ["first", "third"]
    for row in rows:
        x = np.array(camera["R"]) @ row["position_mm"] + camera["t_mm"]
        assert (np.array(camera["K"]) @ x)[:2] / x[2] == pytest.approx(row["pixel"], abs=1e-3)


def test_a_set_for_another_topology_is_refused_before_the_picture(render: Run, folder: Path) -> None:
    for given, told in (("ibug-68", "topology of its own"), ("ibug", "ibug-68"), ("none.csv", "none.csv")):
        ended = render("head.obj", "--landmarks", given, "-o", "f.png")
        assert ended.code == 2 and told in ended.stderr
    assert {path.name for path in folder.iterdir()} == {"head.obj"}
