"""STL files, and formats that are refused by name with advice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from stl_file import BALL, write_stl

from dermis.base.errors import DermisError
from dermis.formats.load import load_rigged
from dermis.formats.read import read_mesh_file
from dermis.formats.size_limits import MAX_TRIANGLES
from dermis.scene.heads import load_head


@pytest.mark.parametrize("form", ["binary", "text", "binary that begins with solid"])
def test_stl_vertices_are_merged(form: str, tmp_path: Path) -> None:
    path = write_stl(tmp_path / "a.stl", text=form == "text", header=b"solid" if "solid" in form else b"")
    (part,) = read_mesh_file(path).parts
    np.testing.assert_allclose(part.positions[part.triangles], BALL.positions[BALL.triangles], atol=1e-4)
    assert len(part.positions) == len(np.unique(BALL.positions.round(3), axis=0)) and part.uv is None


def test_a_head_from_a_stl_file_gets_uv_and_a_tone(tmp_path: Path) -> None:
    with pytest.warns(match="has no uv"):
        head = load_head(write_stl(tmp_path / "a.stl"), subdivide=0)
    assert head.mesh.size_mm.max() == pytest.approx(240, abs=0.01) and len(head.mesh.triangles) == len(
        BALL.triangles
    )


def test_colours_of_stl_triangles_are_noted(tmp_path: Path) -> None:
    assert (
        "colours of triangles are left out" in load_rigged(write_stl(tmp_path / "a.stl", attribute=5)).notes
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"solid a\nvertex 0 0 0\nvertex 1 0 0\n", "three corners for each triangle, but it has 2 corners"),
        (b"solid a\nvertex 0 0 x\nvertex 1 0 0\nvertex 1 1 0", "a word is not a number"),
        (bytes(80) + (9).to_bytes(4, "little") + bytes(100), "184 bytes are too few for its 9 triangles"),
        (bytes(80) + (MAX_TRIANGLES + 1).to_bytes(4, "little"), "at most .* triangles"),
        (b"", "triangles"),
    ],
)
def test_damaged_stl_files_are_refused(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(content)
    with pytest.raises(DermisError, match=rf"a\.stl: expected .*{message}"):
        load_rigged(tmp_path / "a.stl")


@pytest.mark.parametrize(
    ("suffix", "advice"),
    [
        (".fbx", r"Blender: File > Import > FBX, then File > Export > glTF 2\.0"),
        (".ABC", r"Blender: File > Import > Alembic, then File > Export > glTF 2\.0"),
        (".blend", r"Blender: File > Export > glTF 2\.0"),
        *((one, r"glTF \(\.glb\) or OBJ from the program") for one in (".dae", ".3ds", ".max", ".ma")),
        (".xyz", "Export it as one of these"),
    ],
)
def test_other_formats_are_refused_with_advice(suffix: str, advice: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"anything")
    with pytest.raises(DermisError, match=rf"the suffix is '{suffix}'\. .*{advice}"):
        load_rigged(path)
