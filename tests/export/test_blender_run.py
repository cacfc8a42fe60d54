"""Exports to Blender, run by the Blender that DERMIS_BLENDER_PYTHON names."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_head import write_head

from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import load_subject
from dermis.apps.export.targets.blender.target import TARGET
from dermis.apps.truths.blender_process import PYTHON_VARIABLE
from dermis.apps.validation.engines import blender
from dermis.base.errors import DermisError

PYTHON = os.environ.get(PYTHON_VARIABLE, "")
MEASURING_SCRIPT = blender.BLENDER_SCRIPT
QUERY = """
import json, sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[-2])
scene = bpy.context.scene
nodes = [node for one in bpy.data.materials for node in one.node_tree.nodes]
shaders = [node for node in nodes if node.type == "BSDF_PRINCIPLED"]
skin = [node for node in shaders if node.inputs["Subsurface Weight"].default_value == 1.0]
meshes = [one for one in scene.objects if one.type == "MESH"]
answer = {
    "name": scene.name,
    "methods": [node.subsurface_method for node in skin],
    "radius_m": [x * skin[0].inputs["Subsurface Scale"].default_value
                 for x in skin[0].inputs["Subsurface Radius"].default_value],
    "size_m": list(max(meshes, key=lambda one: len(one.data.vertices)).dimensions),
    "lights": len([one for one in scene.objects if one.type == "LIGHT"]),
    "camera": list(scene.camera.matrix_world.translation),
}
open(sys.argv[-1], "w").write(json.dumps(answer))
"""

OBJECTS = """
import json, sys
import bpy
import numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[-2])
objects = bpy.context.scene.objects
hair = objects["hair"]
points = np.empty(3 * len(hair.data.points))
hair.data.points.foreach_get("position", points)
keyed = [one for one in objects if one.type == "MESH" and one.data.shape_keys]
skin = max(keyed, key=lambda one: len(one.data.vertices))
corners = np.array([skin.matrix_world @ vertex.co for vertex in skin.data.vertices])
world = points.reshape(-1, 3) @ np.array(hair.matrix_world)[:3, :3].T + np.array(hair.matrix_world)[:3, 3]
answer = {
    "kinds": {one.name: one.type for one in objects},
    "curves": len(hair.data.curves), "parent": hair.parent_bone,
    "keys": [key.name for key in skin.data.shape_keys.key_blocks],
    "hair": [world.min(0).tolist(), world.max(0).tolist()],
    "head": [corners.min(0).tolist(), corners.max(0).tolist()],
}
open(sys.argv[-1], "w").write(json.dumps(answer))
"""

pytestmark = pytest.mark.skipif(not PYTHON, reason=f"{PYTHON_VARIABLE} is not set")


@pytest.fixture(scope="module")
def version() -> str:
    """Return Blender's version."""
    command = [PYTHON, "-I", "-c", "import bpy; print('version', *bpy.app.version[:2])"]
    output = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
    (line,) = (line for line in output.splitlines() if line.startswith("version"))
    return ".".join(line.split()[1:])


def test_head_is_saved_upright_with_its_skin(tmp_path: Path, version: str) -> None:
    head = write_head(tmp_path / "a'\"; head.obj")
    file = tmp_path / "head.blend"
    report = export_skin(head, "blender", file, version=version, variant="burley", profile="skin1")
    (tmp_path / "query.py").write_text(QUERY)
    answer_file = tmp_path / "answer.json"
    command = [PYTHON, "-I", str(tmp_path / "query.py"), str(file), str(answer_file)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    answer: dict[str, Any] = json.loads(answer_file.read_text())
    assert answer["methods"] == ["BURLEY"]
    assert np.array(answer["radius_m"]) == pytest.approx(4e-3 * np.pi * report.d_mm, rel=0.03)
    assert answer["size_m"] == pytest.approx([0.16, 0.19, 0.24], rel=0.03)  # 240 mm high, its face to -Y
    assert answer["lights"] >= 1 and answer["camera"][1] < -1.0
    assert "head.obj" in answer["name"]


def test_person_has_named_objects_and_hair_curves(tmp_path: Path, version: str) -> None:
    file, answer_file = tmp_path / "person.blend", tmp_path / "answer.json"
    export_skin("human:7", "blender", file, version=version, side=256, subdivide=0, glasses="round")
    (tmp_path / "query.py").write_text(OBJECTS)
    command = [PYTHON, "-I", str(tmp_path / "query.py"), str(file), str(answer_file)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    answer: dict[str, Any] = json.loads(answer_file.read_text())
    kinds = answer["kinds"]
    for name in ("head", "eye_left", "eye_right", "teeth_upper", "brows", "lashes", "glasses_frame"):
        assert name in kinds or f"{name}_mesh" in kinds, name
    assert kinds["hair"] == "CURVES" and answer["curves"] > 10_000 and answer["parent"] == "head"
    assert len(answer["keys"]) == 53 and {"Basis", "jawOpen"} <= set(answer["keys"])
    low, high = np.array(answer["hair"]), np.array(answer["head"])
    assert np.abs(low.mean(0) - high.mean(0)).max() < 0.15  # the hair is around the head
    assert file.stat().st_size < 60e6


def test_parameters_of_another_blender_version_are_refused(tmp_path: Path, version: str) -> None:
    other = "4.5" if version == "5.2" else "5.2"
    with pytest.raises(
        DermisError, match=r"to create the scene, but it failed \(this file: expected Blender from"
    ):
        export_skin("skin1", "blender", tmp_path / "a.blend", version=other, variant="random-walk")
    assert not (tmp_path / "a.blend").exists()


@pytest.mark.parametrize("variant", ["random-walk-skin", "random-walk", "burley"])
def test_cycles_renders_the_predicted_edge_response(tmp_path: Path, version: str, variant: str) -> None:
    """Red channel within 4 mm of an edge of light; the benchmark has all channels with less noise."""
    subject, target = load_subject("skin1"), TARGET.with_variant(variant)
    rows = target.parameters(subject, version)
    target.write(subject, rows, tmp_path, version)
    one = {"channel": 0, "width_m": 8e-3, "size": [8, 32], "samples": 128, "seed": 1}
    (tmp_path / "passes.json").write_text(json.dumps([one]))
    command = [PYTHON, "-I", str(MEASURING_SCRIPT), str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    (columns,) = json.loads((tmp_path / "done.json").read_text())["columns"]
    predicted = target.predicted_profile(rows, subject, version)
    fine = predicted.edge_response(np.linspace(-4.0, 4.0, 8 * 32, endpoint=False) + 1 / 64)[:, 0]
    expected = fine.reshape(8, 32).mean(axis=1)
    assert np.pi * np.array(columns)[:, 0] == pytest.approx(expected * predicted.energy[0], abs=0.025)
