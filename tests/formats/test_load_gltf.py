"""Loading of glTF: transforms, units, uv in all encodings, and refused files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from loaded_mesh import load_mesh

from dermis.base.errors import DermisError
from dermis.formats.load import load_rigged


def _glb(path: Path, *, material: str | None = "Skin", mirror: bool = False, drop_uv: bool = False) -> Path:
    """Write a triangle with uv, translated by its node, with trimesh."""
    import trimesh

    skin = trimesh.visual.material.PBRMaterial(name=material or "x", baseColorFactor=[255, 51, 0, 255])
    # trimesh holds uv from the bottom and writes glTF from the top: v = 0.2 in the file
    visual = trimesh.visual.TextureVisuals(uv=[[0.1, 0.8], [0.4, 0.8], [0.1, 0.3]], material=skin)
    positions, normals = [[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0]], np.tile([0.6, 0, 0.8], (3, 1))
    mesh = trimesh.Trimesh(positions, [[0, 1, 2]], vertex_normals=normals, visual=visual, process=False)
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
    """Return uv of the lowest and of the highest vertices."""
    y = mesh.positions[:, 1]
    return mesh.uv[y.argmin()], mesh.uv[y.argmax()]


def test_glb_v_starts_at_the_top(tmp_path: Path) -> None:
    path = _glb(tmp_path / "face.glb")
    for origin, low, high in (("auto", 0.2, 0.7), ("top", 0.2, 0.7), ("bottom", 0.8, 0.3)):
        bottom, top = _by_height(load_mesh(path, v_origin=origin))
        assert bottom[1] == pytest.approx(low, abs=1e-6)
        assert top[1] == pytest.approx(high, abs=1e-6)


def test_glb_node_transform_and_colour_are_applied(tmp_path: Path) -> None:
    mesh = load_mesh(_glb(tmp_path / "face.glb"))
    np.testing.assert_allclose(mesh.positions.min(axis=0), [1000, 2000, 3000])
    assert mesh.materials[0].name == "Skin"
    assert mesh.materials[0].colour == pytest.approx((1.0, 0.2, 0.0), abs=1e-6)


def test_mirrored_node_keeps_outward_normals(tmp_path: Path) -> None:
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


def test_unnamed_group_takes_the_file_name(tmp_path: Path) -> None:
    """The name is correct also if a copy of the file was read before under another name."""
    nameless = _glb(tmp_path / "first.glb", material=None).read_bytes().replace(b'"face"', b'""    ')
    for name in ("first", "second"):
        path = tmp_path / f"{name}.glb"
        path.write_bytes(nameless)
        assert load_mesh(path).materials[0].name == name


def _gltf(path: Path, **changes: object) -> Path:
    """Write a .gltf with 16-bit integer uv, and its buffer in a .bin file."""
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


def test_integer_gltf_uv_is_read(tmp_path: Path) -> None:
    mesh = load_mesh(_gltf(tmp_path / "face.gltf"))
    np.testing.assert_allclose(mesh.uv, [[0, 0.2], [1, 0.2], [0, 1]], atol=1e-6)


def test_gltf_without_its_buffer_is_refused(tmp_path: Path) -> None:
    path = _gltf(tmp_path / "face.gltf")
    path.with_suffix(".bin").unlink()
    with pytest.raises(DermisError, match=r"face\.gltf"):
        load_mesh(path)


def test_gltf_unit_is_metres(tmp_path: Path) -> None:
    path = _glb(tmp_path / "face.glb")
    np.testing.assert_allclose(load_mesh(path).size_mm, [200, 300, 0], atol=1e-3)
    np.testing.assert_allclose(load_mesh(path, unit_mm=10).size_mm, [2, 3, 0], atol=1e-5)


def test_group_without_uv_is_recorded(tmp_path: Path) -> None:
    assert load_rigged(_glb(tmp_path / "face.glb", drop_uv=True)).surface.has_uv == (False,)
