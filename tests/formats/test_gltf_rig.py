"""Morph targets, skins and rigid parts of glTF files, against independent formulas in double precision."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gltf_file import SQUARE, SQUARE_TRIANGLES, GltfFile, add_mesh

from dermis.base.errors import DermisError
from dermis.formats.load import RiggedMesh, load_rigged
from dermis.mesh.rig import Rig

UP = np.tile([0.0, 0.5, 0.0], (4, 1))
OUT = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0.25], [0, 0, 0.5]])


def loaded(path: Path, **options: object) -> tuple[RiggedMesh, Rig]:
    rigged = load_rigged(path, **{"unit_mm": 100.0, **options})
    assert rigged.rig is not None
    np.testing.assert_array_equal(rigged.rig.positions_mm[rigged.mesh.point], rigged.mesh.positions)
    return rigged, rigged.rig


def moved(rig: Rig, weights: dict[str, float], local: np.ndarray | None = None) -> np.ndarray:
    given = np.zeros(len(rig.targets.names))
    for name, weight in weights.items():
        given[rig.target_index[name]] = weight
    return rig.pose(given, rig.skeleton.matrices(local) if rig.skeleton else None)


def turn(axis: int, degrees: float, at: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    a, b = [k for k in range(3) if k != axis]
    matrix, angle = np.eye(4), np.radians(degrees) * (-1 if axis == 1 else 1)
    matrix[a, a] = matrix[b, b] = np.cos(angle)
    matrix[a, b], matrix[b, a] = -np.sin(angle), np.sin(angle)
    matrix[:3, 3] = np.array(at) - matrix[:3, :3] @ at
    return matrix


@pytest.mark.parametrize("form", ["dense", "sparse", "bytes"])
def test_targets_are_named(tmp_path: Path, form: str) -> None:
    file = GltfFile()
    deltas = {
        "dense": lambda rows: file.numbers(rows),
        "sparse": file.sparse,
        "bytes": lambda rows: file.numbers(np.round(rows * 127), "<i1", normalized=True),
    }
    mesh = add_mesh(file, targets={name: deltas[form](d) for name, d in (("up", UP), ("out", OUT))})
    if form == "bytes":
        file.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    path = file.write(tmp_path / "a.glb", file.add("nodes", mesh=mesh, scale=[2, 2, 2]))
    _, rig = loaded(path)
    assert rig.targets.names == ("up", "out") and rig.skeleton is None and rig.targets.rest is None
    np.testing.assert_array_equal(np.diff(rig.targets.first), [4, 2])
    expected = 200 * (SQUARE + 0.5 * UP - 2 * OUT)
    posed = moved(rig, {"up": 0.5, "out": -2.0})
    order = np.lexsort(np.round(expected[:, :2], 3).T), np.lexsort(np.round(posed[:, :2], 3).T)
    np.testing.assert_allclose(posed[order[1]], expected[order[0]], atol=2.0 if form == "bytes" else 1e-4)


def test_cached_rig_equals_the_one_read(tmp_path: Path) -> None:
    file = _arm(GltfFile(), weights=[0.25])
    path = file.write(tmp_path / "a.glb", 0)
    first, second = loaded(path)[1], loaded(path)[1]
    for one, other in ((first.targets, second.targets), (first.skeleton, second.skeleton)):
        assert one.names == other.names
        for name in set(vars(one)) & {
            "first",
            "point",
            "delta_mm",
            "rest",
            "local",
            "bone",
            "weight",
            "to_head",
        }:
            kept, given = getattr(one, name), getattr(other, name)
            assert kept.dtype == given.dtype and np.array_equal(kept, given), name
    assert first.targets.rest is not None


def test_targets_without_names_are_numbered(tmp_path: Path) -> None:
    file = GltfFile()
    mesh = add_mesh(file, targets={"a": file.numbers(UP), "b": file.numbers(OUT)})
    file.tree["meshes"][mesh]["extras"] = {"targetNames": ["only one"]}
    _, rig = loaded(file.write(tmp_path / "a.gltf", file.add("nodes", mesh=mesh)))
    assert rig.targets.names == ("only one", "target 1")


def test_equal_names_in_two_meshes_form_one_target(tmp_path: Path) -> None:
    file = GltfFile()
    face = add_mesh(file, targets={"open": file.numbers(UP), "smile": file.numbers(OUT)})
    teeth = add_mesh(file, SQUARE - [0, 0, 1], targets={"open": file.numbers(2 * UP)})
    nodes = [file.add("nodes", mesh=mesh) for mesh in (teeth, face)]
    _, rig = loaded(file.write(tmp_path / "a.gltf", *nodes))
    assert set(rig.targets.names) == {"open", "smile"}
    change = moved(rig, {"open": 1.0})[:, 1] - rig.positions_mm[:, 1]
    np.testing.assert_allclose(change, np.where(rig.positions_mm[:, 2] < -50, 100, 50), atol=1e-4)


def test_units_and_axes_apply_to_displacements(tmp_path: Path) -> None:
    file = GltfFile()
    # in the file the square stands along z and looks along -y
    standing = SQUARE[:, [0, 2, 1]]
    mesh = add_mesh(file, standing, targets={"up": file.numbers(UP[:, [0, 2, 1]])})
    file.tree["meshes"][mesh]["primitives"][0]["attributes"]["TEXCOORD_0"] = file.numbers(SQUARE[:, :2])
    path = file.write(tmp_path / "a.gltf", file.add("nodes", mesh=mesh))
    rigged, rig = loaded(path, up="z", unit_mm=10.0)
    np.testing.assert_allclose(rigged.mesh.normals, np.tile([0, 0, 1], (4, 1)), atol=1e-6)
    np.testing.assert_allclose(moved(rig, {"up": 1.0}) - rig.positions_mm, 10 * UP, atol=1e-5)


def test_rest_pose_uses_default_weights(tmp_path: Path) -> None:
    file = GltfFile()
    mesh = add_mesh(file, targets={"up": file.numbers(UP), "out": file.numbers(OUT)}, weights=[1.0, 0.0])
    node = file.add("nodes", mesh=mesh, weights=[0.0, 0.5])
    rigged, rig = loaded(file.write(tmp_path / "a.gltf", node))
    assert rig.targets.rest is not None and rig.targets.rest.tolist() == [0.0, 0.5]
    np.testing.assert_allclose(rigged.mesh.positions, 100 * (SQUARE + 0.5 * OUT), atol=1e-4)


def _lips(apart: float, seam: float = 0.0) -> tuple[GltfFile, int]:
    """Return two squares that touch along a line and are separated by a target; a uv seam splits each."""
    file = GltfFile()
    upper, lower = SQUARE, SQUARE - [0, 1, 0]
    positions = np.vstack([upper, lower, upper - [-1, 0, 0], lower - [-1, 0, 0]])
    triangles = np.vstack([SQUARE_TRIANGLES + 4 * k for k in range(4)])
    delta = np.zeros((16, 3))
    delta[[4 + 2, 4 + 3, 12 + 3], 1] = -apart  # the lower lip from its corner on, not the far end
    delta[12 + 3, 1] += seam
    mesh = add_mesh(file, positions, triangles, {"open": file.numbers(delta)})
    return file, file.add("nodes", mesh=mesh)


def test_touching_lips_stay_separate_and_share_the_corner(tmp_path: Path) -> None:
    file, node = _lips(apart=0.2, seam=5e-5)  # at the seam 0.005 mm apart: one point all the same
    rigged, rig = loaded(file.write(tmp_path / "a.gltf", node))
    at = [np.flatnonzero((rigged.mesh.positions == [x, 0, 0]).all(axis=1)) for x in (0, 100, 200)]
    assert [len(set(rigged.mesh.point[one])) for one in at] == [2, 2, 1]
    assert len(rig.positions_mm) == 9 + 2
    posed = moved(rig, {"open": 1.0})[rigged.mesh.point]
    np.testing.assert_allclose(np.unique(np.round(posed[at[0], 1])), [-20, 0])
    again, _ = loaded(file.write(tmp_path / "b.gltf", node))
    np.testing.assert_array_equal(rigged.mesh.point, again.mesh.point)


def test_vertices_that_no_target_separates_stay_merged(tmp_path: Path) -> None:
    file, node = _lips(apart=5e-5)
    rigged, rig = loaded(file.write(tmp_path / "a.gltf", node))
    assert len(rig.positions_mm) == 9
    assert rigged.mesh.point.max() == 8


HEIGHTS = np.arange(5.0)
POLE = np.array([[x, y, 0] for y in HEIGHTS for x in (0.0, 1.0)])
POLE_TRIANGLES = np.array(
    [[k, k + 1, k + 3] for k in range(0, 8, 2)] + [[k, k + 3, k + 2] for k in range(0, 8, 2)]
)


def _arm(file: GltfFile, bind: np.ndarray | None = None, **more: object) -> GltfFile:
    """Return a pole on two joints below a node; the node of its mesh has no effect."""
    fraction = np.clip((POLE[:, 1] - 1) / 2, 0, 1)
    joints = np.zeros((10, 4))
    joints[:, :2] = 1, 0
    given = {
        "JOINTS_0": file.numbers(joints, "<u1"),
        "WEIGHTS_0": file.numbers(np.column_stack([fraction, 1 - fraction, 0 * fraction, 0 * fraction])),
    }
    delta = np.zeros((10, 3))
    delta[:, 2] = POLE[:, 1] / 10
    mesh = add_mesh(file, POLE, POLE_TRIANGLES, {"lean": file.numbers(delta)}, given, **more)
    file.add("nodes", name="armature", children=[1, 3], translation=[1, 0, 0])
    file.add("nodes", name="neck", children=[2], rotation=[0, 0, 0.6, 0.8])
    file.add("nodes", name="head", translation=[0, 2, 0])
    file.add("nodes", name="pole", mesh=mesh, skin=0, translation=[77, 0, 0])
    bones = bind if bind is not None else np.stack([np.eye(4), turn(0, 0)])
    matrices = file.numbers(bones.transpose(0, 2, 1).reshape(-1, 16))
    file.add("skins", joints=[1, 2], inverseBindMatrices=matrices)
    return file


def _world() -> np.ndarray:
    neck, head = turn(2, 2 * np.degrees(np.arctan2(0.6, 0.8))), np.eye(4)
    neck[0, 3], head[1, 3] = 1, 2
    return np.stack([neck, neck @ head])


def _formula(rest: np.ndarray, bind: np.ndarray, lean: float) -> np.ndarray:
    """Evaluate the specification: morph, then inverse bind matrices, then joint matrices."""
    points = np.column_stack([POLE, np.ones(10)])
    points[:, 2] += lean * POLE[:, 1] / 10
    fraction = np.clip((POLE[:, 1] - 1) / 2, 0, 1)[:, None, None]
    matrices = (1 - fraction) * (rest[0] @ bind[0]) + fraction * (rest[1] @ bind[1])
    return np.einsum("vij,vj->vi", matrices, points)[:, :3]


def _by_vertex(rigged: RiggedMesh, points: np.ndarray) -> np.ndarray:
    return points[rigged.mesh.point]


def test_skinning_matches_the_specification(tmp_path: Path) -> None:
    world = _world()
    bind = np.linalg.inv(world)
    rigged, rig = loaded(_arm(GltfFile(), bind).write(tmp_path / "a.glb", 0))
    assert rig.skeleton is not None and rig.skeleton.names == ("armature", "neck", "head")
    np.testing.assert_array_equal(rig.skeleton.parent, [-1, 0, 1])
    np.testing.assert_allclose(rigged.mesh.positions, 100 * _formula(world, bind, 0.0), atol=1e-4)
    local = rig.skeleton.local.copy()
    local[1] = local[1] @ turn(0, 40)
    local[2] = local[2] @ turn(1, -70) @ np.diag([1.2, 1.2, 1.2, 1])
    neck = np.array([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]) @ local[1]
    expected = 100 * _formula(np.stack([neck, neck @ local[2]]), bind, 0.5)
    np.testing.assert_allclose(_by_vertex(rigged, moved(rig, {"lean": 0.5}, local)), expected, atol=1e-3)


def test_rest_pose_uses_joint_nodes_instead_of_bind_matrices(tmp_path: Path) -> None:
    bind = np.stack([np.eye(4), turn(0, 30)])
    rigged, rig = loaded(_arm(GltfFile(), bind).write(tmp_path / "a.glb", 0))
    np.testing.assert_allclose(rigged.mesh.positions, 100 * _formula(_world(), bind, 0.0), atol=1e-4)
    leaning = _by_vertex(rigged, moved(rig, {"lean": 1.0}))
    np.testing.assert_allclose(leaning, 100 * _formula(_world(), bind, 1.0), atol=1e-3)


def test_eight_influences_are_reduced_to_the_four_largest(tmp_path: Path) -> None:
    file = _arm(GltfFile(), np.stack([np.eye(4)] * 2))
    given = file.tree["meshes"][0]["primitives"][0]["attributes"]
    rng = np.random.default_rng(1)
    joints, weights = rng.permuted(np.tile(np.arange(8), (10, 1)), axis=1), rng.dirichlet(np.ones(8), 10)
    for k in (0, 1):
        given[f"JOINTS_{k}"] = file.numbers(joints[:, 4 * k : 4 * k + 4], "<u2")
        quarter = np.round(weights[:, 4 * k : 4 * k + 4] * 65535)
        given[f"WEIGHTS_{k}"] = file.numbers(quarter, "<u2", normalized=True)
    file.tree["skins"] = [{"joints": [1, 2, *(file.add("nodes", name=f"j{k}") for k in range(6))]}]
    file.tree["nodes"][0]["children"] += list(range(4, 10))
    rigged, rig = loaded(file.write(tmp_path / "a.glb", 0))
    assert rig.skeleton is not None
    np.testing.assert_allclose(rig.skeleton.weight.sum(axis=1), 1, atol=1e-6)
    names = ["neck", "head", *(f"j{k}" for k in range(6))]
    for vertex, point in enumerate(rigged.mesh.point):
        best = np.argsort(-weights[vertex])[:4]
        expected = dict(zip([names[joints[vertex, k]] for k in best], weights[vertex, best], strict=True))
        bones = [rig.skeleton.names[k] for k in rig.skeleton.bone[point]]
        actual = dict(zip(bones, rig.skeleton.weight[point].tolist(), strict=True))
        assert actual == pytest.approx({k: v / sum(expected.values()) for k, v in expected.items()}, abs=1e-4)


def _clip(file: GltfFile, node: int, path: str = "rotation") -> None:
    rows = {"rotation": [[0, 0, 0, 1]] * 2, "weights": [[0], [1]]}[path]
    sampler = {"input": file.numbers([[0], [1]]), "output": file.numbers(rows)}
    channel = {"sampler": 0, "target": {"node": node, "path": path}}
    file.add("animations", samplers=[sampler], channels=[channel])


def test_rigid_meshes_follow_their_parent_bone(tmp_path: Path) -> None:
    """The meshes are an eye below a joint, a hat below an animated node, and a static wall."""
    file = _arm(GltfFile(), np.linalg.inv(_world()))
    small = [add_mesh(file, 0.1 * SQUARE + [0, 0, k]) for k in (1, 2, 3)]
    eye, hat, wall = (file.add("nodes", mesh=mesh, name=f"mesh {mesh}") for mesh in small)
    lift = file.add("nodes", name="lift", children=[hat], translation=[0, 5, 0])
    file.tree["nodes"][2]["children"] = [eye]
    _clip(file, lift)
    _, rig = loaded(file.write(tmp_path / "a.glb", 0, lift, wall))
    skeleton = rig.skeleton
    assert skeleton is not None
    assert skeleton.names == ("scene", "armature", "lift", "neck", "head")
    assert skeleton.parent.tolist() == [-1, 0, 0, 1, 3]
    z = rig.positions_mm[:, 2]
    for depth, name in ((100, "head"), (200, "lift"), (300, "scene")):
        strongest = skeleton.bone[np.isclose(z, depth)][:, 0]
        assert len(strongest) == 4 and {skeleton.names[k] for k in strongest} == {name}
    local = skeleton.local.copy()
    local[2] = local[2] @ turn(2, 90)
    posed = moved(rig, {}, local)
    hat_at = np.isclose(z, 200)
    np.testing.assert_allclose(posed[~hat_at], rig.positions_mm[~hat_at], atol=1e-4)
    around = rig.positions_mm[hat_at] - [0, 500, 0]
    np.testing.assert_allclose(posed[hat_at] - [0, 500, 0], around[:, [1, 0, 2]] * [-1, 1, 1], atol=1e-3)


def test_animated_weights_create_no_bones(tmp_path: Path) -> None:
    file = GltfFile()
    node = file.add("nodes", mesh=add_mesh(file, targets={"up": file.numbers(UP)}))
    _clip(file, node, "weights")
    _, rig = loaded(file.write(tmp_path / "a.glb", node))
    assert rig.skeleton is None


def test_static_file_has_no_rig(tmp_path: Path) -> None:
    file = GltfFile()
    path = file.write(tmp_path / "a.glb", file.add("nodes", mesh=add_mesh(file)))
    assert load_rigged(path, unit_mm=100).rig is None


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ("count", r"targets of 4 vertices, but 'up' of mesh 'face' moves 3"),
        ("nan", r"finite displacements, but 'up' of mesh 'face'"),
        ("rest", r"finite weights of targets"),
    ],
)
def test_damaged_targets_are_named_in_the_refusal(tmp_path: Path, damage: str, words: str) -> None:
    file = GltfFile()
    rows = UP[:3] if damage == "count" else np.where(damage == "nan", np.nan, UP)
    more = {"weights": ["nan"]} if damage == "rest" else {}
    mesh = add_mesh(file, targets={"up": file.numbers(rows)}, name="face", **more)
    path = file.write(tmp_path / "a.gltf", file.add("nodes", mesh=mesh))
    with pytest.raises(DermisError, match=words) as caught:
        load_rigged(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"WEIGHTS_0": np.full((10, 4), np.nan)}, "weights of 0 and more, but those of 'pole'"),
        ({"WEIGHTS_0": np.full((10, 4), -1.0)}, "weights of 0 and more"),
        ({"JOINTS_0": np.full((10, 4), 7)}, "joints of a skin from 0 to 1, but 'pole' names joint 7"),
        ({"JOINTS_0": None}, "joints and weights of a mesh with a skin"),
    ],
)
def test_damaged_skins_are_named_in_the_refusal(tmp_path: Path, change: dict, words: str) -> None:
    file = _arm(GltfFile())
    given = file.tree["meshes"][0]["primitives"][0]["attributes"]
    for name, rows in change.items():
        del given[name]
        if rows is not None:
            given[name] = file.numbers(rows, "<f4" if "WEIGHTS" in name else "<u1")
    with pytest.raises(DermisError, match=words):
        load_rigged(file.write(tmp_path / "a.gltf", 0))


@pytest.mark.parametrize("fraction", [0.0, 0.5])
def test_zero_scale_bone_with_points_is_refused(tmp_path: Path, fraction: float) -> None:
    file = _arm(GltfFile())
    file.tree["nodes"][2]["scale"] = [0, 0, 0]  # the head, which is each vertex's first joint
    given = file.tree["meshes"][0]["primitives"][0]["attributes"]
    given["WEIGHTS_0"] = file.numbers(np.tile([fraction, 1 - fraction, 0, 0], (10, 1)))
    path = file.write(tmp_path / "a.gltf", 0)
    if fraction:
        with pytest.raises(DermisError, match=r"a\.gltf: .*bones with a scale above 0, but 'head' has"):
            load_rigged(path, unit_mm=100)
    else:
        _, rig = loaded(path)
        np.testing.assert_allclose(moved(rig, {}), rig.positions_mm, atol=1e-4)
