"""VRM avatars: their direction, expressions, names of materials, and what is noted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from vrm_file import VrmFile

from dermis.formats.gltf.triangles import read_gltf
from dermis.formats.load import load_rigged
from dermis.formats.parts import MaterialGroup, MeshPart
from dermis.formats.skin_groups import choose_skin
from dermis.mesh.rig import MorphTargets
from dermis.scene.heads import load_head

VERSIONS = pytest.mark.parametrize("version", [0, 1])
VROID = {
    "N00_000_00_FaceMouth_00_FACE (Instance)": False,
    "N00_000_00_EyeIris_00_EYE (Instance)": False,
    "N00_000_00_EyeWhite_00_EYE (Instance)": False,
    "N00_000_00_Face_00_SKIN (Instance)": True,
    "N00_000_00_FaceBrow_00_FACE (Instance)": False,
    "N00_000_00_FaceEyelash_00_FACE (Instance)": False,
    "N00_000_00_FaceEyeline_00_FACE (Instance)": False,
    "N00_000_00_Body_00_SKIN (Instance)": True,
    "N00_002_03_Tops_01_CLOTH (Instance)": False,
    "N00_000_00_HairBack_00_HAIR (Instance)": False,
    "N00_000_Hair_00_HAIR_01 (Instance)": False,
}


def targets_of(path: Path) -> MorphTargets:
    rig = load_rigged(path).rig
    assert rig is not None
    return rig.targets


def displacements(targets: MorphTargets, name: str) -> np.ndarray:
    dense, rows = np.zeros((1000, 3)), targets.displacement_rows(targets.names.index(name))
    dense[targets.point[rows]] = targets.delta_mm[rows]
    return dense


@VERSIONS
def test_avatar_faces_the_viewer(version: int, tmp_path: Path) -> None:
    mesh = load_rigged(VrmFile(version).write(tmp_path / "a.vrm")).mesh
    assert mesh.positions[:, 2].max() > 140 > 125 > -mesh.positions[:, 2].min()


def test_a_front_that_the_user_states_is_used(tmp_path: Path) -> None:
    mesh = load_rigged(VrmFile(0).write(tmp_path / "a.vrm"), front="z").mesh
    assert mesh.positions[:, 2].min() < -140


@VERSIONS
def test_expressions_are_added_to_the_targets_of_the_file(version: int, tmp_path: Path) -> None:
    avatar = VrmFile(version)
    avatar.add_expression("happy", {0: 1.0, 1: 0.5})
    avatar.add_expression("mine", {1: 0.25}, custom=True)
    avatar.add_expression("nothing", {})
    targets = targets_of(avatar.write(tmp_path / "a.vrm"))
    assert targets.names == ("smile", "open", "happy", "mine")
    smile, opened, happy, mine = (displacements(targets, name) for name in targets.names)
    np.testing.assert_allclose(happy, smile + 0.5 * opened, atol=1e-5)
    np.testing.assert_allclose(mine, 0.25 * opened, atol=1e-5)


@VERSIONS
def test_a_target_of_the_file_keeps_its_name(version: int, tmp_path: Path) -> None:
    avatar = VrmFile(version)
    expected = displacements(targets_of(avatar.write(tmp_path / "a.vrm")), "smile")
    avatar.add_expression("smile", {0: 0.5})
    targets = targets_of(avatar.write(tmp_path / "b.vrm"))
    assert targets.names == ("smile", "open")
    np.testing.assert_array_equal(displacements(targets, "smile"), expected)


def test_materials_named_skin_are_the_skin_of_an_avatar() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], float)
    groups = [MaterialGroup((name,)) for name in VROID]
    parts = [MeshPart(group, square, None, None, np.array([[0, 1, 2]])) for group in groups]
    assert choose_skin(parts, groups, [False] * len(groups)) == list(VROID.values())


@VERSIONS
def test_ignored_avatar_data_is_noted(version: int, tmp_path: Path) -> None:
    avatar = VrmFile(version)
    expression = avatar.add_expression("happy", {0: 1.0})
    if version == 0:
        expression["materialValues"] = [{"materialName": "a"}]
        avatar.avatar |= {"secondaryAnimation": {}, "firstPerson": {}}
        avatar.avatar["materialProperties"] = [{"name": "Face", "shader": "VRM/MToon"}]
    else:
        expression["materialColorBinds"] = [{"material": 0}]
        avatar.file.tree["extensions"]["VRMC_springBone"] = {}
        avatar.avatar["firstPerson"] = {}
    notes = "\n".join(read_gltf(avatar.write(tmp_path / "a.vrm")).notes)
    assert "changes of materials by expressions are left out" in notes
    assert "springs of hair and cloth, visibility in first person" in notes
    assert ("cartoon shading (shade colour, outline, rim light) is not drawn: Face" in notes) == (
        version == 0
    )


def test_cartoon_shading_of_a_material_is_noted(tmp_path: Path) -> None:
    avatar = VrmFile(1)
    avatar.file.tree["materials"][0]["extensions"] = {"VRMC_materials_mtoon": {}}
    with pytest.warns(match="not drawn.*\n.*cartoon shading"):
        load_head(avatar.write(tmp_path / "a.vrm"), subdivide=0)
