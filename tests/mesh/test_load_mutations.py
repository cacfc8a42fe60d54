"""Damaged files either still make a sound mesh or are refused; nothing else ever comes out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dermis.errors import DermisError
from dermis.mesh.load import load_mesh
from dermis.mesh.primitives import uv_sphere

FORMATS = ("obj", "glb", "ply", "ascii.ply")
PATIENT = settings(derandomize=True, max_examples=40, deadline=None, database=None)


def _sphere_bytes(kind: str) -> bytes:
    import trimesh

    sphere = uv_sphere(100, 6, 4)
    material = trimesh.visual.material.PBRMaterial(name="skin")
    visual = trimesh.visual.TextureVisuals(uv=sphere.uv, material=material)
    mesh = trimesh.Trimesh(sphere.positions, sphere.triangles, visual=visual, process=False)
    if kind == "obj":
        return mesh.export(file_type="obj").encode()
    if kind == "ascii.ply":
        return mesh.export(file_type="ply", encoding="ascii")
    return mesh.export(file_type=kind)


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    return {kind: _sphere_bytes(kind) for kind in FORMATS}


def _sound_or_refused(path: Path) -> bool:
    """Whether it was loaded; fails on anything but a sound mesh or a refusal."""
    try:
        mesh = load_mesh(path)
    except DermisError as error:
        assert str(path) in str(error)
        return False
    for values in (mesh.positions, mesh.normals, mesh.uv, mesh.dpdu, mesh.dpdv):
        assert np.isfinite(values).all()
    assert mesh.triangles.min() >= 0 and mesh.triangles.max() < len(mesh.positions)
    return True


@pytest.mark.parametrize("kind", FORMATS)
def test_undamaged_file_loads(files: dict[str, bytes], tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"sphere.{kind}"
    path.write_bytes(files[kind])
    assert _sound_or_refused(path)


@pytest.mark.parametrize("kind", FORMATS)
@given(data=st.data())
@PATIENT
def test_flipped_bytes(files, tmp_path_factory, kind: str, data: st.DataObject) -> None:
    content = bytearray(files[kind])
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / f"flipped.{kind}"
    path.write_bytes(bytes(content))
    _sound_or_refused(path)


@pytest.mark.parametrize("kind", FORMATS)
@given(data=st.data())
@PATIENT
def test_truncated(files, tmp_path_factory, kind: str, data: st.DataObject) -> None:
    content = files[kind]
    path = tmp_path_factory.getbasetemp() / f"truncated.{kind}"
    path.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    _sound_or_refused(path)


@pytest.mark.parametrize("kind", ["glb", "ply"])
def test_truncated_binary_is_always_refused(files, tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"short.{kind}"
    for cut in (1, 2, 7, 40):
        path.write_bytes(files[kind][:-cut])
        assert not _sound_or_refused(path)


@given(data=st.data())
@settings(PATIENT, max_examples=20)
def test_damaged_scan(sample_folder: Path, tmp_path_factory, data: st.DataObject) -> None:
    content = bytearray((sample_folder / "heads" / "lee_perry_smith" / "LeePerrySmith.glb").read_bytes())
    # mostly the header, where damage is worst, sometimes the numbers
    reach = data.draw(st.sampled_from([2500, 2500, len(content)]))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, reach - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "scan.glb"
    path.write_bytes(bytes(content[: data.draw(st.sampled_from([len(content), len(content) // 2]))]))
    _sound_or_refused(path)
