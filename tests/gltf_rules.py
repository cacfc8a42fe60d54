"""Rules of glTF 2.0 for .glb files that the Khronos validator checks, and that validator itself."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.formats.gltf.document import Document, read_document

VALIDATOR_VARIABLE = "DERMIS_GLTF_VALIDATOR"
"""Names the folder of the npm package gltf-validator."""
SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
KINDS = {
    "POSITION": ("VEC3", {5126}),
    "NORMAL": ("VEC3", {5126}),
    "TEXCOORD_0": ("VEC2", {5123, 5126}),
    "JOINTS_0": ("VEC4", {5121, 5123}),
    "WEIGHTS_0": ("VEC4", {5123, 5126}),
}
VERTICES, INDICES = 34962, 34963
VALIDATE = """
const validator = require(process.argv[1]);
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[2]));
validator.validateBytes(bytes).then(found => console.log(JSON.stringify(found.issues)));
"""


def check_rules(path: Path) -> Document:
    """Check all rules and return the parsed file."""
    data = path.read_bytes()
    _check_chunks(data)
    document = read_document(path)
    tree = document.tree
    assert tree["asset"]["version"] == "2.0"
    assert [] not in tree.values() and {} not in tree.values()
    for number in range(len(tree["accessors"])):
        _check_accessor(document, number)
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            _check_primitive(document, mesh, primitive)
    _check_nodes(document)
    _check_views(document)
    _check_use(document)
    return document


def _check_chunks(data: bytes) -> None:
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON" and size % 4 == 0
    rest, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert kind == b"BIN\0" and rest % 4 == 0 and 28 + size + rest == len(data)
    json.loads(data[20 : 20 + size], parse_constant=pytest.fail)  # NaN and infinity are no JSON
    (buffer,) = json.loads(data[20 : 20 + size])["buffers"]
    assert rest - 3 <= buffer["byteLength"] <= rest


def _check_accessor(document: Document, number: int) -> None:
    accessor = document.tree["accessors"][number]
    values = document.read_values(number)
    assert accessor["count"] >= 1 and np.isfinite(values).all()
    if "min" in accessor:
        assert accessor["min"] == values.min(axis=0).tolist(), number
        assert accessor["max"] == values.max(axis=0).tolist(), number
    if "sparse" in accessor:
        sparse = accessor["sparse"]
        assert 1 <= sparse["count"] <= accessor["count"]
        view = document.tree["bufferViews"][sparse["indices"]["bufferView"]]
        kind = {5123: "<u2", 5125: "<u4"}[sparse["indices"]["componentType"]]
        assert view["byteLength"] == sparse["count"] * np.dtype(kind).itemsize
        index = np.frombuffer(document.read_view(sparse["indices"]["bufferView"]), kind).astype(np.int64)
        assert (np.diff(index) > 0).all() and index[-1] < accessor["count"]


def _check_primitive(document: Document, mesh: dict[str, Any], primitive: dict[str, Any]) -> None:
    accessors, given = document.tree["accessors"], primitive["attributes"]
    count = accessors[given["POSITION"]]["count"]
    for name, number in given.items():
        kind, components = KINDS[name]
        accessor = accessors[number]
        assert accessor["type"] == kind and accessor["componentType"] in components
        assert accessor["count"] == count
        is_fraction = name in ("TEXCOORD_0", "WEIGHTS_0") and accessor["componentType"] != 5126
        assert accessor.get("normalized", False) == is_fraction
        assert document.tree["bufferViews"][accessor["bufferView"]]["target"] == VERTICES
    assert "min" in accessors[given["POSITION"]]
    lengths = np.linalg.norm(document.read_floats(given["NORMAL"]), axis=1)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-4)
    index = document.read_values(primitive["indices"]).ravel()
    assert document.tree["bufferViews"][accessors[primitive["indices"]]["bufferView"]]["target"] == INDICES
    assert len(index) % 3 == 0 and index.max() < min(count, np.iinfo(index.dtype).max)
    assert len(np.unique(index)) == count  # no vertex is left over
    assert 0 <= primitive["material"] < len(document.tree["materials"])
    targets = primitive.get("targets", [])
    assert len(targets) == len(mesh.get("weights", [])) == len(mesh.get("extras", {}).get("targetNames", []))
    for target in targets:
        for name, number in target.items():
            assert name in ("POSITION", "NORMAL") and accessors[number]["count"] == count
            assert accessors[number]["type"] == "VEC3" and accessors[number]["componentType"] == 5126
            assert "min" in accessors[number]
    if "JOINTS_0" in given:
        _check_influences(document, given)


def _check_influences(document: Document, given: dict[str, int]) -> None:
    (skin,) = document.tree["skins"]
    joint, weight = document.read_values(given["JOINTS_0"]), document.read_floats(given["WEIGHTS_0"])
    assert joint.max() < len(skin["joints"]) and (weight >= 0).all()
    assert (joint[weight == 0] == 0).all()
    missed = np.abs(weight.astype(np.float64).sum(axis=1) - 1)
    assert (missed <= 2e-7 * np.maximum((weight > 0).sum(axis=1), 1)).all()
    twice = (joint[:, :, None] == joint[:, None, :]) & (weight[:, :, None] > 0) & (weight[:, None, :] > 0)
    assert (twice.sum(axis=(1, 2)) == (weight > 0).sum(axis=1)).all()


def _check_nodes(document: Document) -> None:
    tree = document.tree
    names = [node["name"] for node in tree["nodes"]]
    assert len(set(names)) == len(names)
    children = [child for node in tree["nodes"] for child in node.get("children", [])]
    assert len(set(children)) == len(children)
    roots = tree["scenes"][tree["scene"]]["nodes"]
    assert sorted([*children, *roots]) == list(range(len(names)))
    for node in tree["nodes"]:
        assert not ("matrix" in node and "translation" in node)
        assert "skin" not in node or tree["nodes"].index(node) in roots
    for skin in tree.get("skins", []):
        bound = document.read_values(skin["inverseBindMatrices"])
        assert bound.shape == (len(skin["joints"]), 16) and (bound[:, 3:15:4] == 0).all()
        assert (bound[:, 15] == 1).all() and len(set(skin["joints"])) == len(skin["joints"])
        above = {child: k for k, node in enumerate(tree["nodes"]) for child in node.get("children", [])}
        for joint in skin["joints"]:
            while joint != skin["skeleton"]:
                joint = above[joint]


def _check_views(document: Document) -> None:
    """Check that buffer views are contiguous and aligned, and contain nothing unused."""
    views, end = document.tree["bufferViews"], 0
    for view in views:
        start = view.get("byteOffset", 0)
        assert start % 4 == 0 and 0 <= start - end < 4 and view["byteLength"] > 0
        end = start + view["byteLength"]
    assert end == document.tree["buffers"][0]["byteLength"]
    for accessor in document.tree["accessors"]:
        if "bufferView" in accessor:
            size = accessor["count"] * WIDTHS[accessor["type"]] * SIZES[accessor["componentType"]]
            assert views[accessor["bufferView"]]["byteLength"] == size


def _check_use(document: Document) -> None:
    """Check that every part is used."""
    tree = {key: value for key, value in document.tree.items() if key != "asset"}
    used = {number for kind, number in _references(tree) if kind == "accessor"}
    assert used == set(range(len(tree["accessors"])))
    views = {number for kind, number in _references(tree) if kind == "bufferView"}
    assert views == set(range(len(tree["bufferViews"])))
    textures = {number for kind, number in _references(tree) if kind == "index"}
    assert textures == set(range(len(tree.get("textures", []))))
    assert [one["source"] for one in tree.get("textures", [])] == list(range(len(tree.get("images", []))))
    names = [image["name"] for image in tree.get("images", [])]
    assert len(set(names)) == len(names)
    parts = [primitive["material"] for mesh in tree["meshes"] for primitive in mesh["primitives"]]
    assert sorted(parts) == list(range(len(tree["materials"])))
    extensions = {name for one in tree["materials"] for name in one.get("extensions", {})}
    assert extensions == set(tree.get("extensionsUsed", []))


def _references(value: Any) -> Iterator[tuple[str, int]]:
    """Return the indices of accessors, buffer views and textures that parts of the tree refer to."""
    if isinstance(value, list):
        for one in value:
            yield from _references(one)
    if isinstance(value, dict):
        for key, one in value.items():
            if key in ("bufferView", "index"):
                yield key, one
            elif key in ("attributes", "targets"):
                rows = [one] if key == "attributes" else one
                yield from (("accessor", number) for row in rows for number in row.values())
            elif key in ("indices", "inverseBindMatrices") and isinstance(one, int):
                yield "accessor", one
            else:
                yield from _references(one)


def khronos_issues(path: Path) -> dict[str, Any]:
    """Return the issues that the Khronos validator finds; skip the test if it is not available."""
    node, folder = shutil.which("node"), os.environ.get(VALIDATOR_VARIABLE)
    if node is None or not folder:
        pytest.skip(f"{VALIDATOR_VARIABLE} is not set, or there is no node")
    command = [node, "-e", VALIDATE, str(Path(folder).resolve()), str(path)]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(run.stdout)
    return found
