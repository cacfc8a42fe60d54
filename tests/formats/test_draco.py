"""Geometry compressed by Draco: decoded in a separate process with limits."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from draco_file import BALL, EXTENSION, DracoFile

from dermis.base.errors import DermisError
from dermis.formats.gltf.triangles import read_gltf
from dermis.formats.load import load_rigged
from dermis.formats.size_limits import MAX_VERTICES

pytest.importorskip("DracoPy")


def test_a_compressed_ball_is_read_with_its_attributes(tmp_path: Path) -> None:
    compressed = DracoFile(skinned=True, coloured=True)
    mesh_file = read_gltf(compressed.write(tmp_path / "a.glb"))
    (part,), decoded = mesh_file.parts, compressed.decoded
    np.testing.assert_array_equal(part.triangles, decoded.faces)
    np.testing.assert_allclose(part.positions, decoded.points, atol=1e-6)
    np.testing.assert_allclose(part.uv, decoded.tex_coord)
    np.testing.assert_allclose(part.colours, np.tile([200, 100, 50], (len(part.positions), 1)) / 255)
    assert part.normals is not None and part.weight is not None and mesh_file.bones is not None
    np.testing.assert_allclose(part.normals, decoded.normals, atol=1e-6)
    np.testing.assert_allclose(part.weight.sum(axis=1), 1.0)
    assert mesh_file.notes == ()


def test_loaded_ball_equals_the_uncompressed_one(tmp_path: Path) -> None:
    mesh = load_rigged(DracoFile().write(tmp_path / "a.glb")).mesh
    assert len(mesh.triangles) == len(BALL.triangles)
    np.testing.assert_allclose(
        np.sort(mesh.positions, axis=0), np.sort(1000 * BALL.positions, axis=0), atol=0.01
    )


def test_geometry_that_is_stored_without_compression_as_well_needs_no_decoder(tmp_path: Path) -> None:
    compressed = DracoFile()
    file, primitive = compressed.file, compressed.primitive
    primitive["attributes"] = {"POSITION": file.numbers(BALL.positions), "TEXCOORD_0": file.numbers(BALL.uv)}
    primitive["indices"] = file.numbers(BALL.triangles.reshape(-1, 1), "<u2")
    primitive["extensions"][EXTENSION]["bufferView"] = 10_000
    assert len(load_rigged(compressed.write(tmp_path / "a.glb")).mesh.triangles) == len(BALL.triangles)


def test_missing_decoder_error_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = DracoFile().write(tmp_path / "a.glb")
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(
        DermisError, match=r"a\.glb: geometry compressed by Draco: expected .*dermis\[formats\]"
    ):
        read_gltf(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda one: one.file.data.__setitem__(slice(0, 8), b"DRACULA!"), "cannot be decoded|stopped"),
        (lambda one: one.file.tree["bufferViews"][0].update(byteLength=90), "cannot be decoded|stopped"),
        (lambda one: one.file.tree["accessors"][0].update(count=MAX_VERTICES + 1), "at most .* vertices"),
        (lambda one: one.file.tree["accessors"][0].update(count=7), "7 x 3 as its accessor states"),
        (lambda one: one.primitive["extensions"][EXTENSION]["attributes"].update(POSITION=77), "0/77"),
    ],
)
def test_damaged_geometry_is_refused(change: object, message: str, tmp_path: Path) -> None:
    compressed = DracoFile()
    assert callable(change)
    change(compressed)
    with pytest.raises(DermisError, match=rf"a\.glb.*expected (?s:.*)(?:{message})"):
        load_rigged(compressed.write(tmp_path / "a.glb"))
