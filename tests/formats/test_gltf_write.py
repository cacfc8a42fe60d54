"""Heads written as glTF with their rigs: valid files that are read back unchanged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_rules import check_rules, khronos_issues
from rigged_head import write_rigged_head

from dermis.formats.deformable_mesh import DeformableMesh, point_bone_influences
from dermis.formats.gltf.write import encode_head
from dermis.human.person import Human
from dermis.images.colour import decode_srgb_levels
from dermis.images.io import EmbeddedPicture, read_image
from dermis.mesh.geometry import vertex_normals
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.pose import Pose
from dermis.mesh.primitives import uv_sphere
from dermis.mesh.subdivide import subdivide_head
from dermis.scene.heads import load_head

SIDE = 32
POSES = (
    Pose(),
    Pose({"jawOpen": 1.0, "browInnerUp": 0.5}),
    Pose(bones={"head": (10, 25, 0)}),
    Pose({"mouthSmileLeft": 1.0}, {"neck": (0, 0, 15)}),
)
SAME_MM = 1e-3  # metres in single precision, and displacements that are left out


@pytest.fixture(scope="module")
def rigged(tmp_path_factory: pytest.TempPathFactory) -> Head:
    return load_head(write_rigged_head(tmp_path_factory.mktemp("rigged") / "face.glb"), subdivide=0)


def written(head: Head, path: Path, **more: Any) -> Path:
    path.write_bytes(encode_head(head, roughness=0.3, **more))
    check_rules(path)
    return path


def posed_mm(head: Head, pose: Pose) -> np.ndarray:
    """Return the posed vertices, (v, 3)."""
    rig = head.control_rig
    return np.asarray(rig.posed_points_mm(pose.to_arrays(rig))[head.mesh.point])


@pytest.mark.parametrize("pose", POSES)
def test_head_reads_back_with_its_deformation(rigged: Head, tmp_path: Path, pose: Pose) -> None:
    back = load_head(written(rigged, tmp_path / "back.glb"), subdivide=0)
    assert (back.targets, back.bones) == (rigged.targets, rigged.bones)
    assert np.abs(posed_mm(back, pose) - posed_mm(rigged, pose)).max() < SAME_MM
    assert np.abs(back.mesh.normals - rigged.mesh.normals).max() < 1e-6
    assert np.array_equal(back.mesh.triangles, rigged.mesh.triangles)


def test_equal_heads_give_identical_files(rigged: Head) -> None:
    assert encode_head(rigged, roughness=0.3) == encode_head(rigged, roughness=0.3)


def test_targets_keep_their_rest_weights(rigged: Head, tmp_path: Path) -> None:
    """A head with default weights is written from its neutral shape."""
    resting = load_head(written(rigged, tmp_path / "resting.glb", weights={"jawOpen": 0.5}), subdivide=0)
    half = Pose({"jawOpen": 0.5})
    assert np.abs(resting.mesh.positions - posed_mm(rigged, half)).max() < SAME_MM
    again = load_head(written(resting, tmp_path / "again.glb"), subdivide=0)
    for head in (resting, again):
        assert np.abs(posed_mm(head, Pose({"jawOpen": 0.0})) - rigged.mesh.positions).max() < SAME_MM
        assert np.abs(posed_mm(head, Pose()) - posed_mm(rigged, half)).max() < SAME_MM


def test_bones_without_a_common_parent_get_one(rigged: Head, tmp_path: Path) -> None:
    rig = rigged.control_rig
    assert rig.skeleton is not None
    local = np.linalg.inv(rig.skeleton.inverse_bind)
    skeleton = replace(rig.skeleton, parent=np.array([-1, -1], np.int32), local=local)
    apart = replace(rigged, rig=replace(rig, skeleton=skeleton))
    back = load_head(written(apart, tmp_path / "apart.glb"), subdivide=0)
    assert set(back.bones) == {"neck", "head", "face bones"}
    for pose in POSES:
        assert np.abs(posed_mm(back, pose) - posed_mm(apart, pose)).max() < SAME_MM


def test_turned_bones_keep_their_axes(rigged: Head, tmp_path: Path) -> None:
    rig = rigged.control_rig
    assert rig.skeleton is not None
    turn = np.eye(4)
    turn[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    local, inverse = rig.skeleton.local.copy(), rig.skeleton.inverse_bind.copy()
    local[0] = local[0] @ turn
    local[1] = np.linalg.inv(turn) @ local[1] @ turn
    inverse = np.linalg.inv(turn) @ inverse
    turned = replace(
        rigged, rig=replace(rig, skeleton=replace(rig.skeleton, local=local, inverse_bind=inverse))
    )
    back = load_head(written(turned, tmp_path / "turned.glb"), subdivide=0)
    for pose in POSES:
        assert np.abs(posed_mm(back, pose) - posed_mm(rigged, pose)).max() < SAME_MM


def test_a_head_without_rig_is_written(tmp_path: Path) -> None:
    ball = Head("ball", uv_sphere(120.0), Maps())
    tree = check_rules(written(ball, tmp_path / "ball.glb")).tree
    assert "skins" not in tree and "textures" not in tree and len(tree["nodes"]) == 1
    back = load_head(tmp_path / "ball.glb", subdivide=0)
    assert back.rig is None and np.abs(back.mesh.positions - ball.mesh.positions).max() < SAME_MM
    assert back.mesh.materials[0].kind == "skin"


def test_subdivided_mesh_moves_with_its_targets(rigged: Head, tmp_path: Path) -> None:
    fine = subdivide_head(rigged, 1)
    back = load_head(written(fine, tmp_path / "fine.glb"), subdivide=0)
    for pose in POSES[:2]:
        assert np.abs(posed_mm(back, pose) - posed_mm(fine, pose)).max() < 0.01
    assert np.abs(posed_mm(back, POSES[2]) - posed_mm(fine, POSES[2])).max() < 1.0


def test_normals_change_with_targets(rigged: Head, tmp_path: Path) -> None:
    document = check_rules(written(rigged, tmp_path / "face.glb"))
    (primitive,) = document.tree["meshes"][0]["primitives"]
    target = primitive["targets"][rigged.targets.index("jawOpen")]
    normals = document.read_floats(primitive["attributes"]["NORMAL"]) + document.read_floats(target["NORMAL"])
    moved = posed_mm(rigged, Pose({"jawOpen": 1.0})).astype(np.float32)
    meant = vertex_normals(moved, rigged.mesh.point, rigged.mesh.triangles)
    assert np.abs(normals - meant).max() < 0.003
    assert np.abs(document.read_floats(target["NORMAL"])).max() > 0.2


def test_four_bones_minimise_the_error() -> None:
    """Chosen bones are compared with the four largest weights, by squared distance over a few rotations."""
    points = DeformableMesh(Human().head())
    rig, finer = points.rig, points.subdivision_matrix
    assert finer is not None and rig.skeleton is not None
    bone, bone_weight = point_bone_influences(rig, finer)
    assert bone_weight.min() >= 0 and np.abs(bone_weight.sum(axis=1) - 1).max() < 1e-12
    control = np.zeros((len(rig.positions_mm), len(rig.skeleton.names)))
    np.add.at(control, (np.arange(len(control))[:, None], rig.skeleton.bone), rig.skeleton.weight)
    mean = np.asarray(finer @ control)
    strongest = np.argsort(-mean, axis=1)[:, :4]
    plain = np.take_along_axis(mean, strongest, axis=1)
    plain /= plain.sum(axis=1, keepdims=True)
    for name, degrees in (("head", (20, 0, 0)), ("neck02", (0, 15, 0)), ("jaw", (15, 0, 0))):
        pose_arrays = Pose(bones={name: degrees}).to_arrays(rig)
        meant = rig.posed_points_mm(pose_arrays)
        whole = np.asarray(finer @ rig.positions_mm.astype(np.float64))
        fitted, usual = (
            ((_blended(whole, pose_arrays.matrices, *one) - meant) ** 2).sum()
            for one in ((bone, bone_weight), (strongest, plain))
        )
        assert fitted < 0.7 * usual


def test_maps_read_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    levels = rng.integers(0, 256, (SIDE, SIDE, 3)).astype(np.uint8)
    tilt = rng.uniform(-0.4, 0.4, (SIDE, SIDE, 2)).astype(np.float32)
    maps = Maps(
        colour=decode_srgb_levels(levels),
        normal=tilt,
        height=rng.uniform(-0.2, 0.7, (SIDE, SIDE)).astype(np.float32),
        specular=(levels[..., 0] / 255).astype(np.float32),
        roughness=(levels[..., 1] / 255).astype(np.float32),
        region=(levels[..., 2] // 26).astype(np.uint8),
    )
    found = load_head(written(Head("ball", uv_sphere(120.0), maps), tmp_path / "ball.glb"), subdivide=0).maps
    for name in ("colour", "region"):
        assert np.array_equal(getattr(found, name), getattr(maps, name)), name
    for name in ("specular", "roughness"):
        np.testing.assert_allclose(getattr(found, name), getattr(maps, name), atol=1e-6)
    np.testing.assert_allclose(found.normal, maps.normal, atol=0.012)
    assert found.height is not None and maps.height is not None
    np.testing.assert_allclose(found.height, maps.height - maps.height.min(), atol=2e-5)


def test_other_programs_get_plain_materials(tmp_path: Path) -> None:
    """Roughness is perceptual in the green channel; slopes become a normal map with green up."""
    slopes = np.zeros((SIDE, SIDE, 2), np.float32)
    slopes[..., 1] = 0.5
    maps = Maps(height=np.ones((SIDE, SIDE), np.float32), roughness=np.full((SIDE, SIDE), 0.25, np.float32))
    path = written(Head("ball", uv_sphere(120.0), maps), tmp_path / "ball.glb", slopes=slopes)
    document = check_rules(path)
    (material,) = document.tree["materials"]

    def texel(texture: dict[str, int]) -> list[int]:
        image = document.tree["images"][document.tree["textures"][texture["index"]]["source"]]
        picture = EmbeddedPicture(image["name"], bytes(document.read_view(image["bufferView"])))
        return list(map(int, read_image(picture)[3, 3]))

    assert texel(material["pbrMetallicRoughness"]["metallicRoughnessTexture"]) == [0, 128, 0]
    flat = 1 / np.sqrt(1.25)
    expected = [128, round(255 * (0.5 - 0.25 * flat)), round(255 * (0.5 + 0.5 * flat))]
    assert texel(material["normalTexture"]) == expected
    assert load_head(path).maps.normal is None  # of which the height map is the better one


def test_the_khronos_validator_finds_nothing(rigged: Head, tmp_path: Path) -> None:
    path = written(rigged, tmp_path / "back.glb", weights={"jawOpen": 0.5})
    found = khronos_issues(path)
    assert (found["numErrors"], found["numWarnings"]) == (0, 0), found["messages"]


def _blended(
    points: np.ndarray, matrices: np.ndarray, bone: np.ndarray, bone_weight: np.ndarray
) -> np.ndarray:
    whole = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    return np.einsum("qk,qkij,qj->qi", bone_weight, matrices.astype(np.float64)[bone], whole)
