"""Pictures in glTF files of this package and of others, and damaged ones."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from egg import Egg
from encoded_glb import encode_glb
from icc_profiles import DISPLAY_P3, SRGB_CURVE, encoded, rgb_profile
from loaded_mesh import load_mesh

from dermis.base.errors import DermisError, DermisWarning
from dermis.formats.gltf.embedded import embedded_materials
from dermis.images.codecs import encode_png
from dermis.images.io import EmbeddedPicture, read_image
from dermis.mesh.primitives import uv_sphere
from dermis.scene.heads import load_head

SIDE = 32


def ramp(levels: int, channels: int = 1) -> np.ndarray:
    kind = np.uint8 if levels == 255 else np.uint16
    row = np.linspace(0, levels, SIDE).astype(kind)
    return np.repeat(np.tile(row, (SIDE, 1))[..., None], channels, axis=2)


def written(roles: dict[str, Any] | None = None) -> bytes:
    pictures = {
        "colour": encode_png(ramp(255, 3)),
        "height": encode_png(ramp(65535)),
        "specular": encode_png(ramp(255)),
        "roughness": encode_png(ramp(255)),
        "region": encode_png(ramp(255) // 26),
    }
    own = {role: {"index": role} for role in ("height", "specular", "roughness", "region")}
    material = {"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": "colour"}}}
    return encode_glb(uv_sphere(120.0), pictures, material, own | {"height_mm": 0.004} | (roles or {}))


@pytest.fixture
def glb(tmp_path: Path) -> Path:
    path = tmp_path / "own.glb"
    path.write_bytes(written())
    return path


def tree_of(data: bytes) -> dict[str, Any]:
    length = struct.unpack_from("<I", data, 12)[0]
    tree: dict[str, Any] = json.loads(data[20 : 20 + length])
    return tree


def with_tree(data: bytes, tree: dict[str, Any]) -> bytes:
    length = struct.unpack_from("<I", data, 12)[0]
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    return data[:8] + struct.pack("<II", 20 + len(text) + len(rest), len(text)) + b"JSON" + text + rest


def test_mesh_reads_back_bit_for_bit(glb: Path) -> None:
    sphere, mesh = uv_sphere(120.0), load_mesh(glb)
    for name in ("positions", "uv", "triangles"):
        assert np.array_equal(getattr(mesh, name), getattr(sphere, name)), name
    assert np.allclose(mesh.normals, sphere.normals, atol=2e-7)


def test_written_file_is_valid_gltf(glb: Path) -> None:
    data = glb.read_bytes()
    tree = tree_of(data)
    assert data[:4] == b"glTF" and struct.unpack_from("<II", data, 4) == (2, len(data))
    (buffer,) = tree["buffers"]
    for view in tree["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= buffer["byteLength"]
    accessor = tree["accessors"][0]
    assert accessor["max"] == pytest.approx([120.0, 120.0, 120.0], abs=0.1)
    assert tree["nodes"][0]["scale"] == [0.001] * 3  # glTF is in metres


def test_maps_read_back(glb: Path) -> None:
    maps = load_head(glb).maps
    assert maps.colour is not None and maps.height is not None and maps.region is not None
    assert maps.colour.shape == (SIDE, SIDE, 3) and maps.colour[0, -1, 0] == pytest.approx(1.0)
    assert np.ptp(maps.height) == pytest.approx(255 * 0.004, rel=1e-4)
    assert maps.specular is not None and maps.specular[0] == pytest.approx(ramp(255)[0, :, 0] / 255, abs=1e-6)
    assert maps.region.dtype == np.uint8 and maps.region.max() == 9
    assert maps.normal is None  # the height map says more


def test_options_override_maps_of_the_file(glb: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.png"
    other.write_bytes(encode_png(np.full((SIDE, SIDE, 3), 128, np.uint8)))
    maps = load_head(glb, colour=other, height_mm=0.002).maps
    assert maps.colour is not None and np.ptp(maps.colour) == 0.0
    assert maps.height is not None and np.ptp(maps.height) == pytest.approx(255 * 0.002, rel=1e-4)


def test_colour_and_normals_of_other_programs_are_read(tmp_path: Path) -> None:
    data = written()
    tree = tree_of(data)
    (material,) = tree["materials"]
    del material["extras"]
    material["normalTexture"] = {"index": 0}
    path = tmp_path / "other.glb"
    path.write_bytes(with_tree(data, tree))
    assert set(embedded_materials(path)[0].skin_pictures()) == {"colour", "normal"}


def test_pictures_by_uri_are_read(tmp_path: Path) -> None:
    png = encode_png(ramp(255, 3))
    (tmp_path / "a b.png").write_bytes(png)
    for uri in ("a%20b.png", f"data:image/png;base64,{base64.b64encode(png).decode()}"):
        tree = {
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}],
            "images": [{"uri": uri}],
        }
        (tmp_path / "a.gltf").write_text(json.dumps(tree))
        (material,) = embedded_materials(tmp_path / "a.gltf")
        assert read_image(material.textures["colour"].picture).shape == (32, 32, 3)


def test_colour_profiles_are_ignored_in_all_picture_locations(tmp_path: Path) -> None:
    picture = encoded(ramp(255, 3), "PNG", icc_profile=rgb_profile("P3", DISPLAY_P3, SRGB_CURVE))
    maps = []
    for name, uri in (("a.glb", None), ("a.gltf", "face.png")):
        egg = Egg()
        for mesh in range(2):
            egg.primitive(mesh)["material"] = egg.tree["materials"].index(egg.skin)
        egg.skin["pbrMetallicRoughness"]["baseColorTexture"] = egg.texture(picture)
        if uri is not None:
            egg.tree["images"][-1] = {"uri": uri}
        path = egg.write(tmp_path / name)
        (tmp_path / "face.png").write_bytes(picture)
        with pytest.warns(DermisWarning, match="its colour profile is not used, as glTF demands"):
            maps.append(load_head(path, subdivide=0).maps.colour)
    assert maps[0] is not None and maps[1] is not None
    np.testing.assert_array_equal(maps[0], maps[1])


def test_a_missing_external_picture_is_refused_unless_an_option_replaces_it(tmp_path: Path) -> None:
    egg = Egg()
    egg.tree["images"][0] = {"uri": "gone.png"}
    for mesh in range(2):
        egg.primitive(mesh)["material"] = egg.tree["materials"].index(egg.skin)
    path = egg.write(tmp_path / "a.gltf")
    with pytest.raises(DermisError, match=r"gone\.png: expected a picture"):
        load_head(path, subdivide=0)
    (tmp_path / "other.png").write_bytes(encode_png(ramp(255, 3)))
    options = {"colour": tmp_path / "other.png", "skin_groups": ("Head", "Collar"), "subdivide": 0}
    assert load_head(path, **options).maps.colour is not None


@pytest.mark.parametrize(
    "damage",
    [
        {"textures": []},
        {"images": [{}] * 5},
        {"bufferViews": []},
        {"materials": [{"pbrMetallicRoughness": 3}]},
        {"materials": [{"extras": {"dermis": {"height": {"index": 77}}}}]},
    ],
)
def test_damaged_pictures_are_refused(glb: Path, damage: dict[str, Any]) -> None:
    data = glb.read_bytes()
    glb.write_bytes(with_tree(data, tree_of(data) | damage))
    with pytest.raises(DermisError, match="valid textures"):
        embedded_materials(glb)


def test_invalid_picture_is_named_in_the_refusal() -> None:
    with pytest.raises(DermisError, match=r"^skin\.glb, image 3: expected a picture"):
        read_image(EmbeddedPicture("skin.glb, image 3", b"nothing"))


def test_files_without_pictures_are_read(tmp_path: Path) -> None:
    (tmp_path / "a.gltf").write_text("{}")
    assert embedded_materials(tmp_path / "a.gltf") == ()
