"""Accessors in all forms of glTF, and the order of the parts of a scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gltf_file import SQUARE, GltfFile, add_mesh
from loaded_mesh import load_mesh

from dermis.base.errors import DermisError
from dermis.formats.gltf.document import read_document
from dermis.formats.gltf.nodes import read_nodes
from dermis.formats.gltf.triangles import read_gltf

ROWS = np.array([[0, 1, -2], [0, 0, 0], [7, 0, 0], [0, 0, 3]], float)


@pytest.mark.parametrize("gap", [0, 8])
@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
@pytest.mark.parametrize("kind", ["<f4", "<i1", "<i2"])
def test_packed_and_strided_accessors_are_read(tmp_path: Path, gap: int, suffix: str, kind: str) -> None:
    file = GltfFile()
    file.numbers([1, 2, 3], "<u1")
    index = file.numbers(ROWS, kind, gap=gap)
    document = read_document(file.write(tmp_path / f"a{suffix}"))
    np.testing.assert_array_equal(document.read_values(index), ROWS)
    assert document.read_values(index).dtype == np.dtype(kind)


def test_sparse_accessors_with_and_without_base_are_read(tmp_path: Path) -> None:
    file = GltfFile()
    alone, below = file.sparse(ROWS), file.numbers(np.ones((4, 3)))
    over = file.sparse(ROWS)
    file.tree["accessors"][over]["bufferView"] = file.tree["accessors"][below]["bufferView"]
    document = read_document(file.write(tmp_path / "a.glb"))
    np.testing.assert_array_equal(document.read_values(alone), ROWS)
    np.testing.assert_array_equal(document.read_values(over), [[0, 1, -2], [1, 1, 1], [7, 0, 0], [0, 0, 3]])


def test_normalised_integers_are_converted_to_fractions(tmp_path: Path) -> None:
    file = GltfFile()
    plain = file.numbers([[255, 0, 51]], "<u1")
    share = file.numbers([[255, 0, 51]], "<u1", normalized=True)
    signed = file.numbers([[32767, -32767, 0]], "<i2", normalized=True)
    document = read_document(file.write(tmp_path / "a.glb"))
    np.testing.assert_array_equal(document.read_floats(plain), [[255, 0, 51]])
    np.testing.assert_allclose(document.read_floats(share), [[1, 0, 0.2]])
    np.testing.assert_allclose(document.read_floats(signed), [[1, -1, 0]])


def test_accessors_outside_or_without_buffer_are_refused(tmp_path: Path) -> None:
    file = GltfFile()
    index = file.numbers(ROWS)
    file.tree["accessors"][index]["count"] = 5
    huge = file.sparse(ROWS)
    file.tree["accessors"][huge]["count"] = 1 << 40
    document = read_document(file.write(tmp_path / "a.glb"))
    for one in (index, huge):
        with pytest.raises((ValueError, TypeError)):
            document.read_values(one)


def test_strips_and_fans_become_triangles(tmp_path: Path) -> None:
    for mode, order in ((5, [0, 1, 3, 2]), (6, [0, 1, 2, 3])):
        file = GltfFile()
        mesh = add_mesh(file, SQUARE, [order])
        file.tree["meshes"][mesh]["primitives"][0]["mode"] = mode
        path = file.write(tmp_path / f"{mode}.gltf", file.add("nodes", mesh=mesh))
        loaded = load_mesh(path, unit_mm=100)
        assert len(loaded.triangles) == 2
        np.testing.assert_allclose(loaded.normals, np.tile([0, 0, 1], (4, 1)), atol=1e-6)


def test_node_cycles_are_refused_by_name(tmp_path: Path) -> None:
    file = GltfFile()
    mesh = add_mesh(file)
    file.add("nodes", mesh=mesh, name="face")
    file.add("nodes", name="one", children=[2])
    file.add("nodes", name="two", children=[1])
    with pytest.raises(DermisError, match=r"a\.gltf: .*tree.*'one', 'two'"):
        load_mesh(file.write(tmp_path / "a.gltf", 0))


def test_node_names_are_made_unique(tmp_path: Path) -> None:
    file = GltfFile()
    for name in ("bone", "bone", "", "bone 2"):
        file.add("nodes", name=name)
    nodes = read_nodes(read_document(file.write(tmp_path / "a.gltf", 0, 1, 2, 3)))
    assert nodes.names == ("bone", "bone 2", "node 2", "bone 2 2")


def test_parts_match_trimesh(tmp_path: Path) -> None:
    """Order and position of each primitive of a node tree are compared with another reader."""
    import trimesh

    rng = np.random.default_rng(5)
    file = GltfFile()
    meshes = []
    for _ in range(5):
        meshes.append(add_mesh(file, SQUARE + rng.normal(size=(4, 3))))
    more = [file.tree["meshes"].pop()["primitives"][0] for _ in range(2)]
    file.tree["meshes"][1]["primitives"] += more
    parents = [None, 0, 0, 1, 2, 2, None]
    for index in range(len(parents)):
        place = {"translation": rng.normal(size=3).tolist(), "rotation": rng.normal(size=4).tolist()}
        if index == 4:
            place = {"matrix": (np.diag([1, 2, -3, 1.0]) + np.eye(4, k=2)).T.ravel().tolist()}
        if index == 5:
            place |= {"scale": [2, 0.5, 1]}
        file.add("nodes", children=[k for k, one in enumerate(parents) if one == index and k], **place)
    for node, mesh in ((1, 0), (3, 1), (4, 2), (5, 0), (6, 2)):
        file.tree["nodes"][node]["mesh"] = meshes[mesh]
    path = file.write(tmp_path / "a.glb", 0, 6)
    scene = trimesh.load_scene(path, process=False)
    expected = []
    for name in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph[name]
        expected.append(scene.geometry[geometry].vertices @ matrix[:3, :3].T + matrix[:3, 3])
    parts = read_gltf(path).parts
    assert len(parts) == len(expected) == 7
    for part, places in zip(parts, expected, strict=True):
        np.testing.assert_allclose(part.positions, places, rtol=1e-12, atol=1e-12)
