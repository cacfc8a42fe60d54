"""The bust as a whole: one recipe, one file, read back as it was made."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.errors import DermisError
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.regions import REGIONS
from dermis.human.bust_file import BustRecipe, bust_of, cached_bust, encode_bust
from dermis.human.skin_maps.look import SkinLook
from dermis.mesh.geometry import edges, triangle_areas
from dermis.mesh.head import Head
from dermis.mesh.uv import charts
from dermis.scene.heads import load_head

RECIPE = BustRecipe(size=256)


@pytest.fixture(scope="module")
def data() -> bytes:
    return encode_bust(RECIPE)


@pytest.fixture(scope="module")
def head(data: bytes, tmp_path_factory: pytest.TempPathFactory) -> Head:
    path = tmp_path_factory.mktemp("bust") / "bust.glb"
    path.write_bytes(data)
    return load_head(path)


def test_the_same_recipe_gives_the_same_bytes(data: bytes) -> None:
    assert encode_bust(BustRecipe(size=256)) == data


def test_mesh_reads_back_to_the_bit(head: Head) -> None:
    made, read = bust_of(RECIPE), head.mesh
    for name in ("positions", "uv", "triangles"):
        assert np.array_equal(getattr(made, name), getattr(read, name)), name
    assert np.abs(made.normals - read.normals).max() < 1e-6


def test_it_is_closed_and_of_human_size(head: Head) -> None:
    _, _, sides = edges(head.mesh.point[head.mesh.triangles])
    assert (sides == 2).all()
    width, height, depth = head.mesh.size_mm
    assert 300 < width < 520 and 300 < height < 450 and 150 < depth < 300
    assert head.frontmost(0.0, -38.0)[2] > 100.0  # the tip of the nose looks along +Z
    assert 20_000 <= len(head.mesh.triangles) <= 60_000
    assert triangle_areas(head.mesh.positions[head.mesh.triangles]).min() > 0.0


def test_a_shape_whose_border_once_bridged_itself_is_closed() -> None:
    mesh = bust_of(BustRecipe(BustParameters(nose=1.2, fullness=-0.8, seed=6), size=256))
    _, _, sides = edges(mesh.point[mesh.triangles])
    assert (sides == 2).all()


def test_maps_are_there_and_look_like_skin(head: Head) -> None:
    maps = head.maps
    assert maps.colour is not None and maps.height is not None
    assert maps.specular is not None and maps.roughness is not None and maps.region is not None
    assert maps.normal is None
    red, green, blue = maps.colour.reshape(-1, 3).mean(axis=0)
    assert 0.15 < blue < green < red < 0.7
    assert 0.02 < np.ptp(maps.height) < 1.0  # [mm]
    assert 0.1 < np.median(maps.roughness) < 0.6
    assert set(np.unique(maps.region)) == set(range(len(REGIONS)))


def test_other_programs_find_a_standard_material(data: bytes) -> None:
    length = struct.unpack_from("<I", data, 12)[0]
    tree: dict[str, Any] = json.loads(data[20 : 20 + length])
    (material,) = tree["materials"]
    named = {image["name"]: index for index, image in enumerate(tree["images"])}
    core = material["pbrMetallicRoughness"]
    assert core["baseColorTexture"]["index"] == named["colour"]
    assert core["metallicRoughnessTexture"]["index"] == named["metallic roughness"]
    assert material["normalTexture"]["index"] == named["normal"]
    extras = material["extras"]["dermis"]
    assert extras["regions"] == list(REGIONS)
    assert extras["shape"]["seed"] == 0 and extras["look"]["melanin"] == SkinLook().melanin
    assert "extensionsRequired" not in tree


def test_many_charts_are_many() -> None:
    few, many = (bust_of(BustRecipe(size=256, layout=layout)) for layout in ("few", "many"))  # type: ignore[arg-type]
    assert charts(few).max() < 12
    assert charts(many).max() > 100
    assert many.positions[many.triangles].min() == few.positions[few.triangles].min()


def test_built_in_heads_are_kept_on_disk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path))
    calls = []

    def small(recipe: BustRecipe, report: Any = None) -> bytes:
        calls.append(recipe)
        return b"glTF"

    monkeypatch.setattr("dermis.human.bust_file.encode_bust", small)
    assert cached_bust("bust") == cached_bust("bust") and len(calls) == 1
    assert cached_bust("bust_many_charts") != cached_bust("bust")
    assert [recipe.layout for recipe in calls] == ["few", "many"]
    cached_bust("bust").write_bytes(b"glT")  # cut off
    assert cached_bust("bust").read_bytes() == b"glTF" and len(calls) == 3


@pytest.mark.parametrize("size", [0, 255, 128, 3000, 8192])
def test_odd_sizes_are_refused(size: int) -> None:
    with pytest.raises(DermisError, match=r"--size: expected a power of two"):
        BustRecipe(size=size)


def test_impossible_shapes_and_looks_are_refused() -> None:
    with pytest.raises(DermisError, match="nose"):
        BustParameters(nose=3.0)
    with pytest.raises(DermisError, match="seed: expected a whole number"):
        BustParameters(seed=0.5)  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="melanin"):
        SkinLook(melanin=2.0)
