"""Clips of glTF files on heads, against written-out formulas, and damaged clips."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_file import SQUARE, GltfFile, add_mesh
from scipy.spatial.transform import Rotation, Slerp

import dermis
from dermis.base.errors import DermisError
from dermis.formats.gltf.animations import clip_names
from dermis.formats.load import load_rigged
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

TIMES = [[0.0], [0.5], [2.0]]
TURNS = Rotation.random(3, random_state=1).as_quat()
MOVES = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.2, 0]])
WEIGHTS = np.array([[0, 0], [1, 0.5], [0, 1]], float)


def _file(clip: bool = True) -> GltfFile:
    """Return a square on two joints with two targets, and a clip that animates all of them."""
    file = GltfFile()
    given = {
        "JOINTS_0": file.numbers(np.tile([1, 0, 0, 0], (4, 1)), "<u1"),
        "WEIGHTS_0": file.numbers(np.tile([1, 0, 0, 0], (4, 1))),
    }
    targets = {"up": file.numbers(SQUARE[:, [2, 1, 0]]), "wide": file.numbers(0.1 * SQUARE)}
    mesh = add_mesh(file, targets=targets, attributes=given)
    file.add("nodes", name="root", children=[1, 2], translation=[0, 1, 0])
    file.add("nodes", name="head", scale=[2, 2, 2], translation=[0, 0, 3])
    file.add("nodes", name="face", mesh=mesh, skin=0)
    file.add("skins", joints=[0, 1])
    if clip:
        _add_clip(file, "nod")
    return file


def _add_clip(file: GltfFile, name: str, **channels: dict[str, Any]) -> None:
    rows = {
        "rotation": {"node": 1, "output": file.numbers(TURNS)},
        "translation": {"node": 0, "output": file.numbers(MOVES), "interpolation": "STEP"},
        "weights": {"node": 2, "output": file.numbers(WEIGHTS.reshape(-1, 1))},
    }
    samplers, listed = [], []
    for path, row in (channels or rows).items():
        samplers.append({"input": file.numbers(TIMES), "interpolation": "LINEAR"} | row)
        node = samplers[-1].pop("node")
        listed.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
    file.add("animations", name=name, samplers=samplers, channels=listed)


def _head(path: Path) -> Head:
    rigged = load_rigged(path, unit_mm=100.0)
    return Head("square", rigged.mesh, Maps(), rig=rigged.rig)


def test_clip_of_the_head_file_is_read(tmp_path: Path) -> None:
    path = _file().write(tmp_path / "a.glb", 0)
    head = _head(path)
    clip = dermis.load_motion(path, head)
    assert (clip.name, clip.duration_s, clip.targets, clip.bones) == (
        "nod",
        2.0,
        ("up", "wide"),
        ("head", "root"),
    )
    assert clip.left_out == () and clip.note == "" and clip.rate is None
    for seconds in (0.0, 0.25, 0.5, 1.7, 2.0):
        pose = clip.pose_at(seconds)
        arc = Slerp([0, 0.5, 2.0], Rotation.from_quat(TURNS))(seconds).as_matrix()
        head_local = np.eye(4)
        head_local[:3, :3], head_local[:3, 3] = 2 * arc, (0, 0, 3)
        root_local = np.eye(4)
        root_local[:3, 3] = MOVES[[0.0, 0.5, 2.0].index(max(t for t in (0, 0.5, 2.0) if t <= seconds))]
        np.testing.assert_allclose(pose.bones["head"], head_local, atol=1e-6)
        np.testing.assert_allclose(pose.bones["root"], root_local, atol=1e-6)
        weights = [np.interp(seconds, [0, 0.5, 2], column) for column in WEIGHTS.T]
        assert list(pose.weights.values()) == pytest.approx(weights)
        pose_arrays = pose.to_arrays(head.control_rig)
        local = head.control_rig.skeleton.local.copy()
        local[:] = [pose.bones[name] for name in head.bones]
        np.testing.assert_allclose(pose_arrays.matrices, head.control_rig.skeleton.matrices(local), atol=2e-3)
    for outside, inside in ((-3.0, 0.0), (7.0, 2.0)):
        assert clip.pose_at(outside).weights == clip.pose_at(inside).weights


def test_targets_absent_from_a_clip_stay_at_rest(tmp_path: Path) -> None:
    file = _file(clip=False)
    _add_clip(file, "turn", rotation={"node": 1, "output": file.numbers(TURNS)})
    path = file.write(tmp_path / "a.glb", 0)
    pose = dermis.load_motion(path, _head(path)).pose_at(0.0)
    matrix = np.asarray(pose.bones["head"])
    np.testing.assert_allclose(matrix[:3, 3], [0, 0, 3])
    np.testing.assert_allclose(np.linalg.norm(matrix[:3, :3], axis=0), 2)
    assert set(pose.bones) == {"head"} and pose.weights == {}


def test_clip_of_another_file_is_matched_by_names(tmp_path: Path) -> None:
    head = _head(_file(clip=False).write(tmp_path / "head.glb", 0))
    other = GltfFile()
    other.add("nodes", name="tail")
    other.add("nodes", name="head")
    mesh = add_mesh(other, targets={"wide": other.numbers(SQUARE), "wink": other.numbers(SQUARE)})
    other.add("nodes", name="body", mesh=mesh)
    _add_clip(other, "x")
    clip = dermis.load_motion(other.write(tmp_path / "clip.gltf", 0, 1, 2), head)
    assert (clip.targets, clip.bones, clip.left_out) == (("wide",), ("head",), ("wink", "tail"))
    assert clip.note == "x: the head has no wink, tail; left out."
    assert clip.pose_at(0.5).weights == {"wide": pytest.approx(1.0)}  # the first of that file's two


def test_one_of_several_clips_is_selected(tmp_path: Path) -> None:
    file = _file()
    _add_clip(file, "shake", weights={"node": 2, "output": file.numbers(WEIGHTS.reshape(-1, 1))})
    path = file.write(tmp_path / "a.glb", 0)
    head = _head(path)
    assert clip_names(path) == ("nod", "shake")
    assert dermis.load_motion(f"{path}#shake", head).bones == ()
    assert dermis.load_motion(path, head, clip="nod").bones == ("head", "root")
    with pytest.raises(
        DermisError, match=r"a\.glb: .*the name of a clip.* nod, shake\. Name one, as in a\.glb#nod"
    ):
        dermis.load_motion(path, head)
    with pytest.raises(DermisError, match=r"one of its clips \(nod, shake\), but got 'jump'"):
        dermis.load_motion(path, head, clip="jump")


def test_baked_clip_frames_keep_their_rate(tmp_path: Path) -> None:
    file = _file(clip=False)
    times = np.arange(49)[:, None] / 24
    output = file.numbers(np.tile([0, 0, 0, 1], (49, 1)))
    sampler = {"input": file.numbers(times), "output": output}
    channel = {"sampler": 0, "target": {"node": 1, "path": "rotation"}}
    file.add("animations", samplers=[sampler], channels=[channel])
    path = file.write(tmp_path / "a.glb", 0)
    clip = dermis.load_motion(path, _head(path))
    assert clip.rate == 24.0 and clip.name == "clip 0"
    assert clip.frame_count(24) == 49 and clip.frame_count(25) == 51 and clip.frame_count(0.3) == 1


DAMAGES = {
    "missing": (lambda a: a["channels"][0]["target"].update(node=99), r"nod', channel 0: .*got node 99"),
    "backwards": (lambda a: a["samplers"][0].update(input="back"), r"channel 0: .*temporal order"),
    "nan": (lambda a: a["samplers"][2].update(output="nan"), r"channel 2: expected finite keys"),
    "short": (lambda a: a["samplers"][1].update(output="short"), r"channel 1: expected a time and 3 numbers"),
    "kind": (lambda a: a["samplers"][1].update(interpolation="WILD"), r"channel 1: .*got 'WILD'"),
    "zero": (lambda a: a["samplers"][0].update(output="zero"), r"channel 0: .*unit quaternions"),
    "no targets": (lambda a: a["channels"][2]["target"].update(node=0), r"node 0 has no morph targets"),
    "no sampler": (lambda a: a["channels"][1].update(sampler=9), r"clip 'nod': expected a valid animation"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_clips_are_named_in_the_refusal(tmp_path: Path, damage: str) -> None:
    head = _head(_file(clip=False).write(tmp_path / "head.glb", 0))
    file = _file()
    extra = {
        "back": file.numbers([[0.0], [1.0], [0.5]]),
        "nan": file.numbers(np.full((6, 1), np.nan)),
        "short": file.numbers(MOVES[:2]),
        "zero": file.numbers(0 * TURNS),
    }
    change, words = DAMAGES[damage]
    clip = file.tree["animations"][0]
    change(clip)
    for sampler in clip["samplers"]:
        sampler.update({key: extra.get(value, value) for key, value in sampler.items()})
    path = file.write(tmp_path / "clip.glb", 0)
    with pytest.raises(DermisError, match=words) as caught:
        dermis.load_motion(path, head)
    assert str(caught.value).startswith(str(path))


def test_invalid_pose_weights_name_the_file(tmp_path: Path) -> None:
    file = _file(clip=False)
    _add_clip(file, "far", weights={"node": 2, "output": file.numbers(1e20 * WEIGHTS.reshape(-1, 1))})
    path = file.write(tmp_path / "a.glb", 0)
    clip = dermis.load_motion(path, _head(path))
    with pytest.raises(DermisError, match=r"a\.glb: expected weights from -100 to 100, but got 1e\+20"):
        clip.pose_at(float(np.ravel(TIMES)[1]))


def test_clip_without_matching_targets_is_refused(tmp_path: Path) -> None:
    head = _head(_file(clip=False).write(tmp_path / "head.glb", 0))
    other = GltfFile()
    other.add("nodes", name="leg")
    _add_clip(other, "walk", rotation={"node": 0, "output": other.numbers(TURNS)})
    with pytest.raises(DermisError, match=r"b\.glb: clip 'walk': .* it has leg and the head up, wide"):
        dermis.load_motion(other.write(tmp_path / "b.glb", 0), head)
    still = _file(clip=False).write(tmp_path / "still.glb", 0)
    with pytest.raises(DermisError, match=r"still\.glb: expected a file with animation clips"):
        dermis.load_motion(still, head)
    (tmp_path / "text.glb").write_text("no")
    with pytest.raises(DermisError, match=r"text\.glb: expected a glTF file"):
        dermis.load_motion(tmp_path / "text.glb", head)
    with pytest.raises(DermisError, match=r"none\.glb: expected a glTF file"):
        dermis.load_motion(tmp_path / "none.glb", head)
