"""Pictures referenced by OBJ materials, and placeholders of a few texels."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from encoded_glb import encode_glb
from small_head import obj_text

import dermis
from dermis.base.errors import DermisError, DermisWarning
from dermis.gpu.device import Device
from dermis.images.codecs import encode_png
from dermis.images.io import write_png
from dermis.mesh.primitives import uv_sphere

SIDE = 8
RAMP = np.tile(np.arange(0, 8 * SIDE, 8, dtype=np.uint8), (SIDE, 1))
NORMALS = np.dstack([np.full((SIDE, SIDE), level, np.uint8) for level in (160, 128, 250)])
LEANING = -(2 * 160 / 255 - 1) / (2 * 250 / 255 - 1)  # the slope of NORMALS along u


def head(folder: Path, mtl: str, **pictures: np.ndarray) -> Path:
    for name, levels in pictures.items():
        write_png(folder / f"{name.replace('_', ' ')}.png", levels)
    kd = "1 1 1" if "map_Kd" in mtl else "0.7 0.5 0.4"
    (folder / "head.mtl").write_text(f"newmtl skin\nKd {kd}\n{mtl}\n")
    path = folder / "head.obj"
    path.write_text(f"mtllib head.mtl\n{obj_text()}")
    return path


def plain(red: int, green: int, blue: int, side: int = 1) -> np.ndarray:
    return np.full((side, side, 3), (red, green, blue), np.uint8)


def loaded_quietly(path: Path, **options: object) -> dermis.Head:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return dermis.load_head(path, **options)  # type: ignore[arg-type]


def test_all_maps_of_a_material_are_read(tmp_path: Path) -> None:
    mtl = "map_Kd -clamp on -s 1 1 1 my skin.png\nmap_Ks gloss.png\nmap_Pr rough.png\n"
    mtl += "map_Bump -bm 0.5 bumps.png"
    pictures = {"my_skin": plain(188, 0, 0), "gloss": RAMP, "rough": np.full((2, 2), 128, np.uint8)}
    path = head(tmp_path, mtl, bumps=NORMALS, **pictures)
    maps = loaded_quietly(path).maps
    assert maps.colour is not None and maps.specular is not None and maps.normal is not None
    np.testing.assert_allclose(maps.colour, [[[0.502887, 0, 0]]], atol=1e-6)
    np.testing.assert_allclose(maps.specular, RAMP / 255, atol=1e-6)
    np.testing.assert_allclose(maps.roughness, np.full((2, 2), (128 / 255) ** 2), atol=1e-6)
    np.testing.assert_allclose(maps.normal[..., 0], 0.5 * LEANING, atol=1e-5)
    assert maps.height is None


@pytest.mark.parametrize(
    "statement", ["bump -bm 0.5 b.png", "map_bump b.png -bm 0.5", "map_Bump -bm .5 B\\b.png"]
)
def test_a_grey_bump_map_is_a_height_map(statement: str, tmp_path: Path) -> None:
    path = head(tmp_path, statement, b=RAMP)
    maps = loaded_quietly(path, height_mm=0.02).maps
    whole = loaded_quietly(head(tmp_path, ""), height=tmp_path / "b.png", height_mm=0.02).maps
    assert maps.height is not None and whole.height is not None and maps.normal is None
    np.testing.assert_allclose(maps.height, 0.5 * whole.height, atol=1e-6)


def test_heights_without_scale_are_left_out_with_a_note(tmp_path: Path) -> None:
    path = head(tmp_path, "bump b.png\nmap_Kd c.png", b=RAMP, c=plain(9, 9, 9))
    with pytest.warns(DermisWarning, match=r"bump: .*b\.png.*height_mm"):
        maps = dermis.load_head(path).maps
    assert maps.height is None and maps.colour is not None


def test_normal_map_overrides_bump_map(tmp_path: Path) -> None:
    maps = loaded_quietly(head(tmp_path, "bump b.png\nnorm n.png", b=RAMP, n=NORMALS)).maps
    assert maps.normal is not None and maps.height is None
    np.testing.assert_allclose(maps.normal[..., 0], LEANING, atol=1e-5)


def test_option_maps_override_those_of_the_material(tmp_path: Path) -> None:
    path = head(tmp_path, "map_Kd gone.png\nnorm gone too.png\nmap_Ks s.png", s=RAMP)
    write_png(tmp_path / "mine.png", plain(0, 255, 0))
    maps = loaded_quietly(path, colour=tmp_path / "mine.png", height=tmp_path / "s.png", height_mm=0.02).maps
    np.testing.assert_allclose(maps.colour, [[[0, 1, 0]]])
    assert maps.height is not None and maps.normal is None and maps.specular is not None


def test_notes_name_all_missing_files(tmp_path: Path) -> None:
    path = head(tmp_path, "map_Kd gone.png\nmap_Ks C:\\Users\\me\\away.png\nmap_Pr r.tga")
    (tmp_path / "r.tga").write_bytes(b"\0\0\2" + bytes(30))
    with pytest.warns(DermisWarning) as caught:
        maps = dermis.load_head(path).maps
    assert maps.specular is None and maps.roughness is None
    text = "\n".join(str(one.message) for one in caught)
    assert all(str(one.message).startswith(str(path)) for one in caught)
    assert "map_Kd: gone.png is not in its folder" in text
    assert "away.png is not in its folder" in text and "r.tga: expected a picture" in text
    (tmp_path / "head.mtl").unlink()
    with pytest.warns(DermisWarning, match=r"mtllib: head\.mtl is not in its folder"):
        dermis.load_head(path)


def test_files_outside_the_folder_are_not_read(tmp_path: Path) -> None:
    write_png(tmp_path / "secret.png", plain(255, 0, 0))
    (tmp_path / "inside").mkdir()
    for name in ("../secret.png", str(tmp_path / "secret.png"), "link.png"):
        path = head(tmp_path / "inside", f"map_Kd {name}")
        (tmp_path / "inside" / "link.png").unlink(missing_ok=True)
        (tmp_path / "inside" / "link.png").symlink_to(tmp_path / "secret.png")
        with pytest.warns(DermisWarning, match="is not in its folder"):
            colour = dermis.load_head(path).maps.colour
        assert colour is None or colour[..., 1].min() > 0.1
    # of a path of another machine the picture beside the file is taken
    path = head(tmp_path / "inside", "map_Kd D:\\art\\face.png", face=plain(0, 0, 255))
    np.testing.assert_allclose(loaded_quietly(path).maps.colour, [[[0, 0, 1]]])


def test_map_applies_to_the_skin_and_not_the_eyes(tmp_path: Path) -> None:
    lines = obj_text().splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith("f"))
    eye = ["usemtl eye", *lines[first : first + 9]]
    for name in ("skin", "face"):
        path = head(tmp_path, "", e=plain(0, 0, 255), s=plain(255, 0, 0))
        library = f"newmtl eye\nmap_Kd e.png\nnewmtl {name}\nmap_Kd s.png\n"
        (tmp_path / "head.mtl").write_text(library)
        faces = [*eye, f"usemtl {name}", *lines[first + 9 :]]
        path.write_text("\n".join(["mtllib head.mtl", *lines[: first - 1], *faces, ""]))
        np.testing.assert_allclose(loaded_quietly(path).maps.colour, [[[1, 0, 0]]])
    np.testing.assert_allclose(loaded_quietly(path, opaque=[name]).maps.colour, [[[0, 0, 1]]])


@pytest.mark.parametrize("shape", [(1, 1), (2, 2), (4, 4), (8, 8), (1, 3), (5, 2)])
def test_tiny_maps_are_drawn(
    shape: tuple[int, int], tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Uniform maps of any size result in the picture of a map with one texel."""
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    mtl = "map_Kd c.png\nmap_Ks s.png\nmap_Pr s.png\nbump s.png"
    grey = np.full(shape, 100, np.uint8)
    images = []
    for one in (grey, grey[:1, :1]):
        colour = np.dstack([one, one // 2, one // 3])
        found = loaded_quietly(head(tmp_path, mtl, c=colour, s=one), height_mm=0.02)
        images.append(dermis.render(dermis.Scene(found), size=(48, 48), atlas=64))
    assert images[0].max() > 0.01
    np.testing.assert_allclose(images[0], images[1], atol=1e-3)


def test_a_gltf_file_may_have_placeholders(tmp_path: Path) -> None:
    pictures = {"c": encode_png(plain(188, 188, 0)), "n": encode_png(plain(128, 128, 255, 2))}
    material = {
        "name": "skin",
        "pbrMetallicRoughness": {"baseColorTexture": {"index": "c"}},
        "normalTexture": {"index": "n"},
    }
    (tmp_path / "head.glb").write_bytes(encode_glb(uv_sphere(120.0), pictures, material, {}))
    maps = dermis.load_head(tmp_path / "head.glb").maps
    assert maps.colour is not None and maps.colour.shape == (1, 1, 3)


def test_height_scale_needs_a_height_map(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="height_mm: expected a height map with it"):
        dermis.load_head(head(tmp_path, "map_Kd c.png", c=plain(1, 1, 1)), height_mm=0.02)
