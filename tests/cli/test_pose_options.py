"""--pose and --bone of `dermis render`: their effect on the picture, and invalid poses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_head import write_moving_head

import dermis
from dermis.base.errors import DermisError
from dermis.cli.head_options import parse_bone_angles, parse_weights
from dermis.cli.scene_options import SceneOptions, assemble_scene
from dermis.human.expressions import expression
from dermis.images.io import read_image
from dermis.mesh.pose import Pose

Run = Callable[..., Any]


@pytest.fixture
def face(folder: Path) -> str:
    write_moving_head(Path("face.glb"))
    return "face.glb"


def test_option_values_become_a_pose() -> None:
    assert parse_weights(["jawOpen=0.6,mouthSmileLeft=1", "a=b=-2"]) == {
        "jawOpen": 0.6,
        "mouthSmileLeft": 1.0,
        "a=b": -2.0,
    }
    assert parse_bone_angles(["head=0,25,0", "eye.L=1,2,-3"]) == {"head": [0, 25, 0], "eye.L": [1, 2, -3]}


def test_expression_names_are_weights() -> None:
    assert parse_weights(["joy"]) == expression("joy")
    assert parse_weights(["joy,jawOpen=0.3"]) == expression("joy") | {"jawOpen": 0.3}


def test_scene_file_names_an_expression(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text('[head]\nname = "human"\n[pose]\nexpression = "joy"\nweights = {jawOpen = 0.3}\n')
    pose = Pose.coerce(assemble_scene(str(file), SceneOptions())[0].pose)
    assert pose and pose.weights == expression("joy") | {"jawOpen": 0.3}
    file.write_text('[head]\nname = "human"\n[pose]\nexpression = "jy"\n')
    with pytest.raises(DermisError, match=r"s.toml: pose: expression: expected one of neutral, .* got 'jy'"):
        assemble_scene(str(file), SceneOptions())


def test_pose_and_bone_move_the_picture(render: Run, face: str) -> None:
    for name, words in (
        ("a", ()),
        ("b", ("--pose", "jawOpen=1")),
        ("c", ("--pose", "jawOpen=1", "--bone", "head=0,30,0")),
    ):
        assert render(face, *words, "--subdivide", "0", "-o", f"{name}.exr").code == 0
    scene = dermis.Scene(
        dermis.load_head(face, subdivide=0), pose=dermis.Pose({"jawOpen": 1.0}, {"head": (0.0, 30.0, 0.0)})
    )
    a, b, c = (read_image(f"{name}.exr") for name in "abc")
    assert np.abs(b - a).max() > 0.02 and np.abs(c - b).max() > 0.02
    expected = dermis.render(scene, "cpu", size=(64, 64), atlas=64)
    np.testing.assert_allclose(c, expected, atol=1e-6)


def test_options_override_the_pose_of_a_scene(face: str) -> None:
    told = "[pose.weights]\njawOpen = 0.25\nmouthSmileLeft = 0.5\n[pose.bones]\nhead = [1, 2, 3]\n"
    Path("s.toml").write_text(f'[head]\nname = "{face}"\n{told}')
    plain = Pose.coerce(assemble_scene("s.toml", SceneOptions())[0].pose)
    assert plain and plain.weights == {"jawOpen": 0.25, "mouthSmileLeft": 0.5}
    pose = Pose.coerce(assemble_scene("s.toml", SceneOptions(pose=["jawOpen=1"], camera="profile"))[0].pose)
    assert pose and pose.weights == {"jawOpen": 1.0, "mouthSmileLeft": 0.5}
    assert pose.bones == {"head": [1, 2, 3]}


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--pose jawOpne=1", "Nearest: jawOpen. All names: dermis animate face.glb --names."),
        ("--bone hed=1,2,3", "Nearest: head. All names: dermis animate face.glb --names."),
        ("--pose jawOpen", "--pose: expected NAME=WEIGHT"),
        ("--pose jyo", "Add a weight, or choose one of neutral, smile"),
        ("--pose jawOpen=wide", "got 'jawOpen=wide'"),
        ("--pose =1", "got '=1'"),
        ("--pose jawOpen=nan", "jawOpen=nan'"),
        ("--pose jawOpen=1e9", "from -100 to 100"),
        ("--bone head=1,2", "--bone: expected NAME=X,Y,Z"),
        ("--bone head=1,2,inf", "three angles in degrees"),
    ],
)
def test_invalid_poses_are_refused(render: Run, face: str, words: str, says: str) -> None:
    ended = render(face, *words.split())
    assert ended.code == 2 and says in ended.stderr and "expected" in ended.stderr
    assert ended.stderr.count("\n") == 1


def test_a_head_without_rig_refuses_a_pose(render: Run, face: str) -> None:
    ended = render("head.obj", "--pose", "jawOpen=1")
    assert (
        ended.code == 2 and "it has none. Load a glTF file" in ended.stderr and "--names" not in ended.stderr
    )
