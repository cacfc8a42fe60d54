"""Tiny files of every format, written here and read back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from dermis.assets.check import check_head_height
from dermis.assets.load import load_mesh
from dermis.errors import DermisError

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


def _glb(path: Path, *, material: str | None = "Skin", mirror: bool = False, drop_uv: bool = False) -> Path:
    """A triangle with uv, shifted by its node, as trimesh writes it."""
    import trimesh

    skin = trimesh.visual.material.PBRMaterial(name=material or "x", baseColorFactor=[255, 51, 0, 255])
    # trimesh holds uv from the bottom and writes glTF from the top: v = 0.2 in the file
    visual = trimesh.visual.TextureVisuals(uv=[[0.1, 0.8], [0.4, 0.8], [0.1, 0.3]], material=skin)
    places, normals = [[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0]], np.tile([0.6, 0, 0.8], (3, 1))
    mesh = trimesh.Trimesh(places, [[0, 1, 2]], vertex_normals=normals, visual=visual, process=False)
    move = np.diag([-1.0 if mirror else 1.0, 1, 1, 1])
    move[:3, 3] = 1, 2, 3
    scene = trimesh.Scene()
    scene.add_geometry(mesh, geom_name="face", transform=move)

    def strip(tree: dict) -> None:
        for primitive in tree["meshes"][0]["primitives"]:
            if material is None:
                del primitive["material"]
            if drop_uv:
                del primitive["attributes"]["TEXCOORD_0"]

    path.write_bytes(scene.export(file_type="glb", tree_postprocessor=strip))
    return path


def _by_height(mesh):
    """uv of the lowest and of the highest vertices."""
    y = mesh.positions[:, 1]
    return mesh.uv[y.argmin()], mesh.uv[y.argmax()]


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


def test_obj_groups_by_g_alone(obj: Path) -> None:
    text = "\n".join(line for line in obj.read_text().splitlines() if "mtl" not in line)
    obj.write_text(text)
    assert [(m.name, m.kind) for m in load_mesh(obj).materials] == [("face", "skin"), ("ball", "skin")]
    named = load_mesh(obj, opaque=("BALL",))
    assert [(m.name, m.kind) for m in named.materials] == [("face", "skin"), ("ball", "opaque")]


def test_obj_comments_and_line_ends_are_no_damage(obj: Path) -> None:
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


def test_relative_indices_are_refused_not_misread(obj: Path) -> None:
    obj.write_text(obj.read_text().replace("f 5/1 6/2 7/3", "f -3/1 -2/2 -1/3"))
    with pytest.raises(DermisError, match="negative"):
        load_mesh(obj)


def test_v_origin_of_obj(obj: Path) -> None:
    # the file's lowest vertices have v = 0.2, counted from the bottom by the format
    for origin, low, high in (("auto", 0.8, 0.1), ("bottom", 0.8, 0.1), ("top", 0.2, 0.9)):
        mesh = load_mesh(obj, v_origin=origin)
        skin = np.unique(mesh.triangles[:2])
        y = mesh.positions[skin, 1]
        np.testing.assert_allclose(mesh.uv[skin][y == 0, 1], low, atol=1e-6)
        np.testing.assert_allclose(mesh.uv[skin][y == 3, 1], high, atol=1e-6)


def test_v_origin_of_glb(tmp_path: Path) -> None:
    path = _glb(tmp_path / "face.glb")
    for origin, low, high in (("auto", 0.2, 0.7), ("top", 0.2, 0.7), ("bottom", 0.8, 0.3)):
        bottom, top = _by_height(load_mesh(path, v_origin=origin))
        assert bottom[1] == pytest.approx(low, abs=1e-6)
        assert top[1] == pytest.approx(high, abs=1e-6)


@pytest.mark.parametrize(("u", "v"), [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_ply_uv_names_and_origin(tmp_path: Path, u: str, v: str) -> None:
    path = tmp_path / "head.ply"
    path.write_text(PLY.format(u=u, v=v))
    mesh = load_mesh(path)
    np.testing.assert_allclose(mesh.uv, [[0.1, 0.8], [0.4, 0.7], [0.5, 0.1]], atol=1e-6)
    np.testing.assert_allclose(load_mesh(path, v_origin="top").uv[:, 1], [0.2, 0.3, 0.9], atol=1e-6)
    assert [(m.name, m.kind) for m in mesh.materials] == [("head", "skin")]


def test_normals_of_the_file_are_kept_where_sound_and_computed_where_not(tmp_path: Path) -> None:
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


def test_unit_is_metres_for_gltf_and_mm_else(tmp_path: Path, obj: Path) -> None:
    path = _glb(tmp_path / "face.glb")
    np.testing.assert_allclose(load_mesh(path).size_mm, [200, 300, 0], atol=1e-3)
    np.testing.assert_allclose(load_mesh(path, unit_mm=10).size_mm, [2, 3, 0], atol=1e-5)
    np.testing.assert_allclose(load_mesh(obj).size_mm, [2, 3, 1])
    np.testing.assert_allclose(load_mesh(obj, unit_mm=25.4).size_mm, [50.8, 76.2, 25.4], rtol=1e-6)


def test_node_transform_and_colour_of_glb(tmp_path: Path) -> None:
    mesh = load_mesh(_glb(tmp_path / "face.glb"))
    np.testing.assert_allclose(mesh.positions.min(axis=0), [1000, 2000, 3000])
    assert mesh.materials[0].name == "Skin"
    assert mesh.materials[0].colour == pytest.approx((1.0, 0.2, 0.0), abs=1e-6)


def test_mirrored_node_keeps_its_outside(tmp_path: Path) -> None:
    mesh = load_mesh(_glb(tmp_path / "face.glb", mirror=True))
    corners = mesh.positions[mesh.triangles[0]]
    # mirrored in x, the face still looks to +Z
    assert np.cross(corners[1] - corners[0], corners[2] - corners[0])[2] > 0
    # and the normals of the file lean the other way in x, still outwards
    np.testing.assert_allclose(mesh.normals, np.tile([-0.6, 0, 0.8], (3, 1)), atol=1e-6)


def test_glb_without_material_keeps_its_uv(tmp_path: Path) -> None:
    mesh = load_mesh(_glb(tmp_path / "face.glb", material=None))
    assert mesh.materials[0].name == "face"
    assert _by_height(mesh)[0][1] == pytest.approx(0.2, abs=1e-6)


def _gltf(path: Path, **changes: object) -> Path:
    """A .gltf with 16-bit integer uv, its numbers in a .bin beside it."""
    numbers = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0]], dtype="<f4").tobytes()
    numbers += np.array([[0, 13107], [65535, 13107], [0, 65535]], dtype="<u2").tobytes()
    path.with_suffix(".bin").write_bytes(numbers)
    views = [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12}]
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": path.with_suffix(".bin").name, "byteLength": 48}],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "VEC2", "normalized": True},
        ],
        "meshes": [{"name": "m", "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        **changes,
    }
    path.write_text(json.dumps(tree))
    return path


def test_integer_uv_of_gltf(tmp_path: Path) -> None:
    mesh = load_mesh(_gltf(tmp_path / "face.gltf"))
    np.testing.assert_allclose(mesh.uv, [[0, 0.2], [1, 0.2], [0, 1]], atol=1e-6)


def test_compressed_gltf_is_refused(tmp_path: Path) -> None:
    path = _gltf(tmp_path / "face.gltf", extensionsRequired=["KHR_draco_mesh_compression"])
    with pytest.raises(DermisError, match="KHR_draco_mesh_compression"):
        load_mesh(path)


def test_gltf_without_its_buffer_is_refused(tmp_path: Path) -> None:
    path = _gltf(tmp_path / "face.gltf")
    path.with_suffix(".bin").unlink()
    with pytest.raises(DermisError, match=r"face\.gltf"):
        load_mesh(path)


def test_z_up_turns_the_face_to_plus_z(tmp_path: Path) -> None:
    path = tmp_path / "z.obj"
    # in the file: 3 high along z, looking along -y
    path.write_text("v 0 0 0\nv 2 0 0\nv 0 0 3\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    mesh = load_mesh(path, up="z")
    np.testing.assert_allclose(mesh.size_mm, [2, 3, 0])
    np.testing.assert_allclose(mesh.normals, np.broadcast_to([0, 0, 1], (3, 3)), atol=1e-6)
    np.testing.assert_allclose(load_mesh(path).normals[:, 1], -1, atol=1e-6)


def test_uv_missing_by_rounding_only_is_put_back(obj: Path) -> None:
    obj.write_text(obj.read_text().replace("vt 0.1 0.2", "vt -0.00005 0.2"))
    assert load_mesh(obj).uv.min() == 0


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.obj", b"", "none|cannot be read"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "uv"),
        ("a.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n", "NaN"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 9/1\n", "cannot be read|indices"),
        ("a.glb", b"glTF\x02\x00\x00\x00", "cannot be read"),
        ("a.glb", b"\x89PNG\r\n\x1a\n" + bytes(64), "cannot be read"),
        ("a.gltf", b"[]", "cannot be read"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", "cannot be read"),
        ("a.fbx", b"Kaydara", r"\.fbx.*|suffix"),
    ],
)
def test_what_is_not_a_mesh_is_refused_by_name(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(DermisError, match=words) as caught:
        load_mesh(path)
    assert str(caught.value).startswith(str(path))


def test_missing_file_and_missing_uv_of_glb(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="no such file"):
        load_mesh(tmp_path / "none.obj")
    with pytest.raises(DermisError, match=r"'Skin'.*uv|uv.*'Skin'"):
        load_mesh(_glb(tmp_path / "face.glb", drop_uv=True))


@pytest.mark.parametrize(
    "options", [{"unit_mm": 0}, {"unit_mm": float("nan")}, {"v_origin": "left"}, {"up": "x"}]
)
def test_options_out_of_range_are_refused(obj: Path, options: dict) -> None:
    with pytest.raises(DermisError, match=r"head\.obj"):
        load_mesh(obj, **options)


HEADS = [
    ("lee_perry_smith/LeePerrySmith.glb", 50.35, "bottom", (9279, 8844, 17684), (430, 400, 260)),
    ("makehuman/head_young_male_light.obj", 100, "auto", (4775, 4564, 9013), (177, 283, 221)),
    ("makehuman/head_old_male_dark.obj", 100, "auto", (4814, 4600, 9070), (168, 290, 216)),
]


@pytest.mark.parametrize(("name", "unit_mm", "v_origin", "counts", "size"), HEADS)
def test_real_heads_pass_every_check(sample_folder: Path, name, unit_mm, v_origin, counts, size) -> None:
    mesh = load_mesh(sample_folder / "heads" / name, unit_mm=unit_mm, v_origin=v_origin)
    check_head_height(mesh, name, unit_mm)
    assert (len(mesh.positions), mesh.point.max() + 1, len(mesh.triangles)) == counts
    np.testing.assert_allclose(mesh.size_mm, size, atol=1)
    kinds = {m.name: m.kind for m in mesh.materials}
    assert kinds in ({"Material.002": "skin"}, {"skin": "skin", "eyes": "opaque"})
    # the crown of the scan lies higher up in its map than the neck: v grows downwards
    if "lee" in name:
        front = (mesh.positions[:, 2] > 100) & (mesh.normals[:, 2] > 0.5)
        assert np.corrcoef(mesh.positions[front, 1], mesh.uv[front, 1])[0, 1] < -0.9
