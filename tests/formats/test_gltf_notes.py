"""Content of glTF files that is left out with a note, or makes them refused by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from egg import Egg, Tree

from dermis.base.errors import DermisError
from dermis.formats.gltf.triangles import read_gltf
from dermis.formats.load import load_rigged

LIGHT = {"extensions": {"KHR_lights_punctual": {"light": 0}}}


def notes_of(egg: Egg, path: Path) -> str:
    return "\n".join(read_gltf(egg.write(path / "a.glb")).notes)


def thin_primitive(egg: Egg, mode: int) -> Tree:
    return {"mode": mode, "attributes": {"POSITION": egg.primitive()["attributes"]["POSITION"]}}


def test_complete_file_has_no_notes(tmp_path: Path) -> None:
    assert notes_of(Egg(), tmp_path) == ""


def test_lights_and_cameras_are_noted(tmp_path: Path) -> None:
    egg = Egg()
    egg.file.add("nodes", **LIGHT)
    egg.file.add("nodes", **LIGHT)
    egg.file.add("nodes", camera=0)
    egg.tree["extensionsRequired"] = ["KHR_lights_punctual"]
    notes = notes_of(egg, tmp_path)
    assert (
        "its lights (2) are left out; --lights" in notes and "its cameras (1) are left out; --camera" in notes
    )


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_points_and_lines_are_noted(mode: int, tmp_path: Path) -> None:
    egg = Egg()
    egg.tree["meshes"][0]["primitives"].append(thin_primitive(egg, mode))
    assert "points and lines (1 primitives) are left out" in notes_of(egg, tmp_path)


@pytest.mark.parametrize(("alpha", "noted"), [(1.0, False), (0.5, True)])
def test_transparency_of_vertices_is_noted(alpha: float, noted: bool, tmp_path: Path) -> None:
    egg = Egg()
    count = egg.tree["accessors"][egg.primitive()["attributes"]["POSITION"]]["count"]
    egg.primitive()["attributes"]["COLOR_0"] = egg.file.numbers(np.tile([1, 1, 1, alpha], (count, 1)))
    assert ("alpha of COLOR_0" in notes_of(egg, tmp_path)) == noted


def test_further_scenes_are_noted(tmp_path: Path) -> None:
    egg = Egg()
    path = egg.write(tmp_path / "a.gltf")
    path.write_text(path.read_text().replace('"scenes": [', '"scenes": [{"nodes": [1]}, '))
    assert "one of its 2 scenes is read" in read_gltf(path).notes


def test_extensions_that_are_not_read_are_noted(tmp_path: Path) -> None:
    egg = Egg()
    egg.tree["extensionsUsed"] = ["EXT_mesh_gpu_instancing", "KHR_texture_transform"]
    assert notes_of(egg, tmp_path) == "these extensions are left out: EXT_mesh_gpu_instancing"


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression", "ACME_shape"])
def test_required_extensions_that_are_not_read_are_refused_by_name(name: str, tmp_path: Path) -> None:
    egg = Egg()
    egg.tree["extensionsRequired"] = [name]
    advice = "gltfpack without -c" if "meshopt" in name else "Export without it"
    with pytest.raises(DermisError, match=f"expected plain glTF, but the file requires {name}.*{advice}"):
        load_rigged(egg.write(tmp_path / "a.glb"))


def test_a_buffer_without_data_is_refused(tmp_path: Path) -> None:
    path = Egg().write(tmp_path / "a.gltf")
    path.write_text(
        path.read_text()
        .replace('"buffer": 0', '"buffer": 1')
        .replace('}], "scene"', '}, {"byteLength": 1}], "scene"')
    )
    with pytest.raises(DermisError, match="buffer 1 has no data in the file"):
        load_rigged(path)
