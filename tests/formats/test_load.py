"""Tiny OBJ and PLY files that are written and read back, and files that are not meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from loaded_mesh import load_mesh

from dermis.base.errors import DermisError
from dermis.scene.heads import load_head

# a quad in the XY plane, 2 units wide and 3 high, and a triangle behind it; uv is not symmetric
OBJ = """mtllib {mtl}
v 0 0 0
v 2 0 0
v 2 3 0
v 0 3 0
v 0 0 -1
v 0 3 -1
v 2 3 -1
vt 0.1 0.2
vt 0.4 0.2
vt 0.4 0.9
vt 0.1 0.9
g face
usemtl My Skin
f 1/1 2/2 3/3 4/4
g ball
usemtl eye
f 5/1 6/2 7/3
"""
MTL = "newmtl My Skin\nKd 0.5 0.25 0.125\nmap_Kd missing.png\nnewmtl eye\nKd 1 0.75 0.5\n"
PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float nx
property float ny
property float nz
property float {u}
property float {v}
element face 1
property list uchar int vertex_indices
end_header
5 0 0 0 0.6 0.8 0.1 0.2
1 2 0 0 0 1 0.4 0.3
1 0 3 0 0 0 0.5 0.9
3 0 1 2
"""


@pytest.fixture
def obj(tmp_path: Path) -> Path:
    (tmp_path / "head.mtl").write_text(MTL)
    path = tmp_path / "head.obj"
    path.write_text(OBJ.format(mtl="head.mtl"))
    return path


def test_obj_groups_become_materials_in_the_order_of_the_file(obj: Path) -> None:
    mesh = load_mesh(obj)
    assert [m.name for m in mesh.materials] == ["My Skin", "eye"]
    assert [m.kind for m in mesh.materials] == ["skin", "opaque"]
    assert mesh.materials[0].colour == (0.5, 0.25, 0.125)
    assert mesh.materials[1].colour == (1.0, 0.75, 0.5)
    np.testing.assert_array_equal(mesh.material, [0, 0, 1])
    np.testing.assert_allclose(mesh.positions[mesh.triangles[2]], [[0, 0, -1], [0, 3, -1], [2, 3, -1]])


def test_obj_without_its_mtl_keeps_its_groups(obj: Path) -> None:
    obj.with_suffix(".mtl").unlink()
    mesh = load_mesh(obj)
    assert [(m.name, m.kind) for m in mesh.materials] == [("My Skin", "skin"), ("eye", "opaque")]
    assert mesh.materials[0].colour == (0.8, 0.8, 0.8)


def test_obj_groups_by_g_only_are_read(obj: Path) -> None:
    text = "\n".join(line for line in obj.read_text().splitlines() if "mtl" not in line)
    obj.write_text(text)
    assert [(m.name, m.kind) for m in load_mesh(obj).materials] == [("face", "skin"), ("ball", "opaque")]
    named = load_mesh(obj, skin_groups=("BALL",))
    assert [(m.name, m.kind) for m in named.materials] == [("face", "opaque"), ("ball", "skin")]


def test_obj_comments_and_line_ends_are_accepted(obj: Path) -> None:
    whole = load_mesh(obj)
    text = obj.read_text().replace("v 2 0 0\n", "v 2 0 0 # tip\n").replace("7/3\n", "7/3 # usemtl skin\n")
    obj.write_bytes(text.replace("\n", "\r\n").encode())
    again = load_mesh(obj)
    np.testing.assert_array_equal(again.positions, whole.positions)
    np.testing.assert_array_equal(again.triangles, whole.triangles)
    assert again.materials == whole.materials


def test_opaque_must_name_a_group(obj: Path) -> None:
    with pytest.raises(DermisError, match=r"head\.obj.*My Skin.*'teeth'"):
        load_mesh(obj, opaque=("teeth",))


def test_relative_indices_count_from_the_last_vertex(obj: Path) -> None:
    absolute = load_mesh(obj)
    obj.write_text(obj.read_text().replace("f 5/1 6/2 7/3", "f -3/1 -2/2 -1/3"))
    np.testing.assert_array_equal(load_mesh(obj).positions, absolute.positions)


def test_obj_v_starts_at_the_bottom(obj: Path) -> None:
    # the file's lowest vertices have v = 0.2, counted from the bottom by the format
    for origin, low, high in (("auto", 0.8, 0.1), ("bottom", 0.8, 0.1), ("top", 0.2, 0.9)):
        mesh = load_mesh(obj, v_origin=origin)
        skin = np.unique(mesh.triangles[:2])
        y = mesh.positions[skin, 1]
        np.testing.assert_allclose(mesh.uv[skin][y == 0, 1], low, atol=1e-6)
        np.testing.assert_allclose(mesh.uv[skin][y == 3, 1], high, atol=1e-6)


@pytest.mark.parametrize(("u", "v"), [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_ply_uv_names_are_recognised_and_v_starts_at_the_bottom(tmp_path: Path, u: str, v: str) -> None:
    path = tmp_path / "head.ply"
    path.write_text(PLY.format(u=u, v=v))
    mesh = load_mesh(path)
    np.testing.assert_allclose(mesh.uv, [[0.1, 0.8], [0.4, 0.7], [0.5, 0.1]], atol=1e-6)
    np.testing.assert_allclose(load_mesh(path, v_origin="top").uv[:, 1], [0.2, 0.3, 0.9], atol=1e-6)
    assert [(m.name, m.kind) for m in mesh.materials] == [("head", "skin")]


def test_valid_normals_are_kept_and_others_computed(tmp_path: Path) -> None:
    path = tmp_path / "head.ply"
    path.write_text(PLY.format(u="s", v="t"))
    mesh = load_mesh(path)
    flat = np.cross([-4, 2, 0], [-4, 0, 3]) / np.linalg.norm(np.cross([-4, 2, 0], [-4, 0, 3]))
    np.testing.assert_allclose(mesh.normals, [[0, 0.6, 0.8], [0, 0, 1], flat], atol=1e-6)


def test_ply_normals_survive_an_unused_vertex(tmp_path: Path) -> None:
    path = tmp_path / "head.ply"
    text = PLY.format(u="s", v="t").replace("vertex 3", "vertex 4")
    path.write_text(text.replace("5 0 0 0 0.6", "9 9 9 1 0 0 0 0\n5 0 0 0 0.6").replace("3 0 1 2", "3 1 2 3"))
    mesh = load_mesh(path)
    assert len(mesh.positions) == 3
    np.testing.assert_allclose(mesh.normals[0], [0, 0.6, 0.8], atol=1e-6)


def test_unit_is_mm_unless_said_otherwise(obj: Path) -> None:
    np.testing.assert_allclose(load_mesh(obj).size_mm, [2, 3, 1])
    np.testing.assert_allclose(load_mesh(obj, unit_mm=25.4).size_mm, [50.8, 76.2, 25.4], rtol=1e-6)


def test_z_up_turns_the_face_to_plus_z(tmp_path: Path) -> None:
    path = tmp_path / "z.obj"
    # in the file: 3 high along z, looking along -y
    path.write_text("v 0 0 0\nv 2 0 0\nv 0 0 3\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    mesh = load_mesh(path, up="z")
    np.testing.assert_allclose(mesh.size_mm, [2, 3, 0])
    np.testing.assert_allclose(mesh.normals, np.broadcast_to([0, 0, 1], (3, 3)), atol=1e-6)
    np.testing.assert_allclose(load_mesh(path).normals[:, 1], -1, atol=1e-6)


def test_uv_outside_by_rounding_is_clamped(obj: Path) -> None:
    obj.write_text(obj.read_text().replace("vt 0.1 0.2", "vt -0.00005 0.2"))
    assert load_mesh(obj).uv.min() == 0


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.obj", b"", "none|cannot be understood"),
        ("a.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n", "NaN"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 9/1\n", "cannot be understood|indices"),
        ("a.glb", b"glTF\x02\x00\x00\x00", "cannot be understood|a glTF file"),
        ("a.glb", b"\x89PNG\r\n\x1a\n" + bytes(64), "cannot be understood|a glTF file"),
        ("a.gltf", b"[]", "cannot be understood|a glTF file"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", "cannot be read"),
        ("a.fbx", b"Kaydara", r"\.fbx.*|suffix"),
    ],
)
def test_file_that_is_not_a_mesh_is_named_in_the_refusal(
    tmp_path: Path, name: str, content: bytes, words: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(DermisError, match=words) as caught:
        load_mesh(path)
    assert str(caught.value).startswith(str(path))


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="no such file"):
        load_mesh(tmp_path / "none.obj")


@pytest.mark.parametrize(
    "options", [{"unit_mm": 0}, {"unit_mm": float("nan")}, {"v_origin": "left"}, {"up": "w"}]
)
def test_options_out_of_range_are_refused(obj: Path, options: dict) -> None:
    with pytest.raises(DermisError, match=next(iter(options))):
        load_head(obj, **options)


HEADS = [
    ("lee_perry_smith/LeePerrySmith.glb", 50.35, "bottom", (9279, 8844, 17684), (430, 400, 260)),
    ("makehuman/head_young_male_light.obj", 100, "auto", (4775, 4564, 9013), (177, 283, 221)),
    ("makehuman/head_old_male_dark.obj", 100, "auto", (4814, 4600, 9070), (168, 290, 216)),
]


@pytest.mark.parametrize(("name", "unit_mm", "v_origin", "counts", "size"), HEADS)
def test_real_heads_pass_every_check(sample_folder: Path, name, unit_mm, v_origin, counts, size) -> None:
    mesh = load_mesh(sample_folder / "heads" / name, unit_mm=unit_mm, v_origin=v_origin)
    assert mesh.skull_centre_mm is not None
    assert (len(mesh.positions), mesh.point.max() + 1, len(mesh.triangles)) == counts
    np.testing.assert_allclose(mesh.size_mm, size, atol=1)
    kinds = {m.name: m.kind for m in mesh.materials}
    assert kinds in ({"Material.002": "skin"}, {"skin": "skin", "eyes": "opaque"})
    # the crown of the scan lies higher up in its map than the neck: v grows downwards
    if "lee" in name:
        front = (mesh.positions[:, 2] > 100) & (mesh.normals[:, 2] > 0.5)
        assert np.corrcoef(mesh.positions[front, 1], mesh.uv[front, 1])[0, 1] < -0.9
