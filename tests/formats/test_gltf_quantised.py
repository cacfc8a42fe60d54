"""Quantised attributes of glTF files (KHR_mesh_quantization) against the same file with floats."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from egg import Egg
from gltf_file import GltfFile

from dermis.formats.load import load_rigged
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere
from dermis.scene.heads import load_head

BALL = uv_sphere(1.0, 24, 12)
RADIUS_M = 0.12


def ball(path: Path, kind: str, normalized: bool, *, scaled_uv: bool = True) -> Mesh:
    """Load a ball whose attributes have an integer type; the node's scale makes it 240 mm large."""
    file, largest = GltfFile(), 1.0 if kind == "<f4" else float(np.iinfo(kind).max)
    stored: Callable[[np.ndarray], np.ndarray] = lambda values: np.round(values * largest)  # noqa: E731
    if kind == "<f4":
        stored = lambda values: values  # noqa: E731
    uv_kind = kind.replace("i", "u")
    uv_largest = 1.0 if kind == "<f4" else float(np.iinfo(uv_kind).max)
    uv = BALL.uv if kind == "<f4" else np.round(BALL.uv * uv_largest)
    attributes = {
        "POSITION": file.numbers(stored(BALL.positions), kind, normalized=normalized),
        "NORMAL": file.numbers(stored(BALL.normals), kind, normalized=kind != "<f4"),
        "TEXCOORD_0": file.numbers(uv, uv_kind, normalized=kind != "<f4"),
    }
    primitive = {"attributes": attributes, "indices": file.numbers(BALL.triangles.reshape(-1, 1), "<u2")}
    file.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    scale = RADIUS_M if normalized or kind == "<f4" else RADIUS_M / largest
    node = file.add("nodes", mesh=file.add("meshes", primitives=[primitive]), scale=[scale] * 3)
    return load_rigged(file.write(path, node)).mesh


@pytest.mark.parametrize("normalized", [False, True])
@pytest.mark.parametrize("kind", ["<i1", "<i2"])
def test_quantised_attributes_match_float_attributes(kind: str, normalized: bool, tmp_path: Path) -> None:
    exact, read = ball(tmp_path / "a.glb", "<f4", False), ball(tmp_path / "b.glb", kind, normalized)
    step = 1.0 / np.iinfo(kind).max
    assert len(read.positions) == len(exact.positions)
    np.testing.assert_allclose(read.positions, exact.positions, atol=1000 * RADIUS_M * step)
    np.testing.assert_allclose(read.uv, exact.uv, atol=step)
    np.testing.assert_allclose(read.normals, exact.normals, atol=2 * step)


def test_integer_uv_with_texture_transform_match_plain_uv(tmp_path: Path) -> None:
    plain, quantised = Egg(), Egg()
    uv = uv_sphere(0.12, 12, 8).uv
    for mesh, material in enumerate((quantised.skin, quantised.cloth)):
        attributes = quantised.primitive(mesh)["attributes"]
        attributes["TEXCOORD_0"] = quantised.file.numbers(np.round(uv * 4095), "<u2")
        texture = material["pbrMetallicRoughness"]["baseColorTexture"]
        texture["extensions"] = {"KHR_texture_transform": {"scale": [1 / 4095, 1 / 4095]}}
    quantised.tree["extensionsRequired"] = ["KHR_mesh_quantization", "KHR_texture_transform"]
    exact, read = (
        load_head(egg.write(tmp_path / f"{name}.glb"), subdivide=0, skin_groups="face")
        for name, egg in (("a", plain), ("b", quantised))
    )
    assert exact.maps.colour is not None and read.maps.colour is not None
    np.testing.assert_allclose(
        read.maps.colour.mean(axis=(0, 1)), exact.maps.colour.mean(axis=(0, 1)), atol=0.03
    )
