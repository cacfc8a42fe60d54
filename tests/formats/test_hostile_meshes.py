"""Mesh files that are too large or reference other files are refused quickly, by name."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_file import GltfFile, add_mesh
from loaded_mesh import load_mesh
from small_head import obj_text

from dermis.base.errors import DermisError
from dermis.formats.gltf.animations import read_clip
from dermis.formats.gltf.embedded import embedded_materials
from dermis.formats.load import load_rigged
from dermis.formats.motion.sequence import FrameReader
from dermis.formats.obj import obj_maps, read_obj
from dermis.formats.obj_materials import read_library
from dermis.images.codecs import encode_png

pytestmark = pytest.mark.timeout(60)  # what takes more than linear time takes minutes


def refused(read: Callable[[Path], object], path: Path) -> str:
    """Return the error message for a file after checking that it names the file."""
    with pytest.raises(DermisError) as caught:
        read(path)
    assert path.name in str(caught.value)
    return str(caught.value)


def square(**nodes: Any) -> tuple[GltfFile, int]:
    file = GltfFile()
    return file, file.add("nodes", mesh=add_mesh(file), **nodes)


OBJ = {
    "0 as an index": (
        lambda text: text.replace("f 1/1 ", "f 0/0 ", 1),
        "indices from 1, but .* there is a 0",
    ),
    "0 after a slash": (lambda text: text.replace("f 1/1 ", "f 1/00 ", 1), "indices from 1"),
    "a large polygon": (lambda text: text + "f" + " 1/1" * 5000, "at most 4,096 corners"),
    "a long line": (lambda text: text + "f" + " 1/1" * 100_000, "lines of at most 131,072 characters"),
    "a long vertex": (lambda text: text + "v" + " 1" * 1000, "256 for vertices"),
    "many triangles": (lambda text: text + ("f" + " 1/1" * 4002 + "\n") * 313, "1,250,000 triangles"),
    "many groups": (lambda text: text + "".join(f"g {k}\n" for k in range(5000)), "at most 4,096 groups"),
    "far vertices": (lambda text: text.replace("v 0 ", "v 1e300 ", 1), "within 1e\\+06 mm|finite"),
}


@pytest.mark.parametrize("name", OBJ)
def test_oversized_obj_files_are_refused(tmp_path: Path, name: str) -> None:
    change, words = OBJ[name]
    (tmp_path / "a.obj").write_text(change(obj_text()))
    message = refused(load_mesh, tmp_path / "a.obj")
    assert re.search(words, message)


@pytest.mark.parametrize("line", ["g{0}x{0}y", "mtllib{0}x{0}y", "usemtl{0}x{0}"])
def test_lines_of_spaces_are_read_quickly(tmp_path: Path, line: str) -> None:
    (tmp_path / "a.obj").write_text(line.format(" " * 65_000) + "\n" + obj_text())
    load_mesh(tmp_path / "a.obj")


def test_material_lines_of_spaces_and_digits_are_read_quickly(tmp_path: Path) -> None:
    lines = ("bump -bm " + "1" * 4000 + "x", "bump a" + " " * 4000 + "-bm", "bump" + " -cc a" * 600 + " b")
    (tmp_path / "a.mtl").write_text("newmtl skin\n" + "\n".join(lines * 100))
    assert "bump" in read_library(tmp_path / "a.obj", "mtllib a.mtl\n").materials["skin"].textures


def test_total_size_of_material_libraries_is_limited(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl skin\n" + "#\n" * 1_000_000)
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nmtllib ./a.mtl\nmtllib ././a.mtl\n{obj_text()}")
    with pytest.raises(DermisError, match=r"a\.mtl: expected material libraries of at most"):
        load_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("colour", ["nan 0 0", "0 nan 0", "0 0 nan"])
def test_invalid_colours_are_refused(tmp_path: Path, colour: str) -> None:
    (tmp_path / "a.mtl").write_text(f"newmtl skin\nKd {colour}\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{obj_text()}")
    assert load_rigged(tmp_path / "a.obj").materials[0].unused == ("Kd",)
    file = GltfFile()
    mesh = add_mesh(file)
    file.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [*colour.split(), 1]}}]
    file.tree["meshes"][mesh]["primitives"][0]["material"] = 0
    path = file.write(tmp_path / "a.glb", file.add("nodes", mesh=mesh))
    assert "colours of materials from 0 to 1" in refused(load_mesh, path)


def test_infinite_relief_is_left_out(tmp_path: Path) -> None:
    slopes = np.full((4, 4, 3), (160, 128, 250), np.uint8)
    (tmp_path / "n.png").write_bytes(encode_png(slopes))
    (tmp_path / "a.mtl").write_text("newmtl skin\nnorm -bm 1e300 n.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{obj_text()}")
    maps, faults = obj_maps(tmp_path / "a.obj", "skin")
    assert maps.normal is None and "n.png: expected a map of finite numbers" in faults[0]


def test_a_frame_of_a_sequence_stays_finite(tmp_path: Path) -> None:
    reader = FrameReader(unit_mm=1.0)
    for name, text in (("a.obj", obj_text()), ("b.obj", obj_text().replace("v 0 ", "v 1e300 ", 1))):
        (tmp_path / name).write_text(text)
    reader.read(tmp_path / "a.obj")
    assert "positions" in refused(reader.read, tmp_path / "b.obj")


PLY = "ply\nformat ascii 1.0\nelement vertex {}\n{}element face {}\nproperty list uchar int vertex_indices\n"
PLY += "end_header\n"


@pytest.mark.parametrize(
    ("header", "words"),
    [
        (PLY.format(3, "property float x\n" * 100_000, 1), "its header is invalid"),
        (PLY.format(3, "property float x\n" * 1000, 1), "at most 256 properties"),
        (PLY.format(4_000_000_000, "property float x\n", 1), "elements named 'vertex'"),
        (PLY.format(3, "property float x\n", 10**9), "elements named 'face'"),
        (PLY.format("many", "property float x\n", 1), "a name and a number"),
    ],
)
def test_oversized_ply_headers_are_refused(tmp_path: Path, header: str, words: str) -> None:
    (tmp_path / "a.ply").write_text(header + "0 0 0\n" * 9)
    assert words in refused(load_mesh, tmp_path / "a.ply")


def _instances(file: GltfFile, node: int) -> list[int]:
    return [file.add("nodes", mesh=0, translation=[k, 0, 0]) for k in range(5000)]


def _deep(file: GltfFile, node: int) -> list[int]:
    first = len(file.tree["nodes"])
    file.tree["nodes"] += [{"children": [first + k + 1]} for k in range(20_000)] + [{"mesh": 0}]
    return [first]


def _targets(file: GltfFile, node: int) -> list[int]:
    file.tree["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}] * 50_000
    return [node]


def _joints(file: GltfFile, node: int) -> list[int]:
    file.tree["nodes"][node]["skin"] = file.add("skins", joints=list(range(1, 50_001)))
    file.tree["nodes"] += [{} for _ in range(50_000)]
    return [node]


def _values(file: GltfFile, node: int) -> list[int]:
    file.tree["nodes"] += [{"matrix": [0] * 1000}] * 2200
    return [node]


def _zeros(file: GltfFile, node: int) -> list[int]:
    file.tree["accessors"][0] = {"componentType": 5126, "count": 20_000_000, "type": "VEC3"}
    return [node]


def _sparse(file: GltfFile, node: int) -> list[int]:
    view = {"bufferView": 0, "componentType": 5121}
    file.tree["accessors"][0]["sparse"] = {"count": 10**15, "indices": view, "values": {"bufferView": 0}}
    return [node]


def _again_and_again(file: GltfFile, node: int) -> list[int]:
    """Return four hundred uses of one target of a hundred thousand vertices without data."""
    zeros = {"componentType": 5126, "count": 100_000, "type": "VEC3"}
    file.tree["accessors"] += [zeros]
    one = len(file.tree["accessors"]) - 1
    primitive = file.tree["meshes"][0]["primitives"][0]
    primitive["attributes"] = {"POSITION": one, "TEXCOORD_0": one}
    primitive["targets"] = [{"POSITION": one}] * 500
    return [node]


def _far(file: GltfFile, node: int) -> list[int]:
    return [file.add("nodes", scale=[1e300] * 3, children=[file.add("nodes", scale=[1e300] * 3, mesh=0)])]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_instances, "at most 4,096 primitives"),
        (_deep, "at most 1,024 nodes below each other"),
        (_targets, "more than 4,096"),
        (_joints, "at most 2,048 joints"),
        (_values, "at most 2,097,152 values"),
        (_zeros, "at most 1,250,000 vertices"),
        (_sparse, "numbers? of bytes or values"),
        (_again_and_again, "134 million numbers"),
        (_far, "positions"),
    ],
)
def test_oversized_scenes_are_refused(
    tmp_path: Path, change: Callable[[GltfFile, int], list[int]], words: str
) -> None:
    file, node = square()
    path = file.write(tmp_path / "a.glb", *change(file, node))
    assert re.search(words, refused(load_rigged, path))


def test_many_equal_node_names_are_read_quickly(tmp_path: Path) -> None:
    file, node = square()
    file.tree["nodes"] += [{"name": "a"} for _ in range(60_000)]
    load_mesh(file.write(tmp_path / "a.glb", node))


@pytest.mark.parametrize("index", [-1, 1.0, "0", True, 2**60, None])
def test_invalid_mesh_indices_are_refused(tmp_path: Path, index: object) -> None:
    file, node = square()
    file.tree["nodes"][node]["mesh"] = index
    assert "there are 1 meshes" in refused(load_mesh, file.write(tmp_path / "a.glb", node))


@pytest.mark.parametrize("relief", ["1", [1], {"mm": 1}, -1, 0, True, 2**60])
def test_relief_that_is_not_a_length_is_refused(tmp_path: Path, relief: object) -> None:
    file, node = square()
    file.tree["materials"] = [{"extras": {"dermis": {"height_mm": relief}}}]
    assert "valid textures" in refused(embedded_materials, file.write(tmp_path / "a.gltf", node))


@pytest.mark.parametrize(
    "uri",
    [
        "../b.bin",
        "..%2Fb.bin",
        "/dev/zero",
        "file:///dev/zero",
        "link.bin",
        "..\\b.bin",
        "%00",
        "http://b/b.bin",
    ],
)
def test_gltf_references_outside_the_folder_are_refused(tmp_path: Path, uri: str) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "b.bin").write_bytes(bytes(100))
    (folder / "link.bin").symlink_to(tmp_path / "b.bin")
    file, node = square()
    path = file.write(folder / "a.gltf", node)
    tree = json.loads(path.read_text())
    tree["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(tree))
    assert "files in its own folder or below" in refused(load_mesh, path)
    tree = {"asset": {}, "images": [{"uri": uri}], "textures": [{"source": 0}]}
    tree["materials"] = [{"normalTexture": {"index": 0}}]
    path.write_text(json.dumps(tree))
    assert "files in its own folder or below" in refused(embedded_materials, path)


def test_pipes_and_overlong_names_are_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for uri, words in (("pipe", "not a regular file"), ("a" * 5000, "own folder|cannot be read")):
        file, node = square()
        path = file.write(tmp_path / "a.gltf", node)
        path.write_text(json.dumps(json.loads(path.read_text()) | {"buffers": [{"uri": uri}]}))
        assert re.search(words, refused(load_mesh, path))
    (tmp_path / "a.mtl").write_text("newmtl skin\nmap_Kd pipe\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl pipe\n{obj_text()}")
    file = read_obj(tmp_path / "a.obj")
    assert "is not in its folder" in file.materials[0].missing["colour"] and "pipe" in file.notes[0]


def test_total_size_of_pictures_is_limited(tmp_path: Path) -> None:
    import struct
    import zlib

    head = b"IHDR" + struct.pack(">IIBBBBB", 8192, 8192, 8, 2, 0, 0, 0)
    picture = encode_png(np.zeros((1, 1, 3), np.uint8))
    picture = picture[:12] + head + struct.pack(">I", zlib.crc32(head)) + picture[33:]
    (tmp_path / "a.png").write_bytes(picture)
    own = {role: {"index": 0} for role in ("normal", "specular", "roughness")}
    tree = {"asset": {}, "images": [{"uri": "a.png"}], "textures": [{"source": 0}]}
    tree["materials"] = [{"extras": {"dermis": own}}]
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    assert "134 million texels together" in refused(embedded_materials, tmp_path / "a.gltf")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"asset": ' + "1" * 5000 + "}", '{"nodes": 5}', "null"])
def test_invalid_json_documents_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.gltf").write_text(text)
    for read in (load_mesh, embedded_materials, lambda path: read_clip(path, None)):
        assert "a glTF file" in refused(read, tmp_path / "a.gltf") or read is load_mesh
