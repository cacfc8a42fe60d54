"""Damaged files either result in a valid mesh or are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gltf_file import GltfFile, add_mesh
from hypothesis import given, settings
from hypothesis import strategies as st
from loaded_mesh import load_mesh

from dermis.base.errors import DermisError
from dermis.formats.gltf.animations import read_clip
from dermis.formats.load import load_rigged
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
    """Return whether a file was loaded; fail unless it is a valid mesh or refused."""
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
def test_files_with_flipped_bytes_are_read_or_refused(
    files, tmp_path_factory, kind: str, data: st.DataObject
) -> None:
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


@pytest.fixture(scope="module")
def rigged(tmp_path_factory) -> bytes:
    """Return a file with targets, a skin and a clip."""
    file, sphere = GltfFile(), uv_sphere(1.0, 6, 4)
    count = len(sphere.positions)
    given = {
        "JOINTS_0": file.numbers(np.tile([0, 1, 0, 0], (count, 1)), "<u1"),
        "WEIGHTS_0": file.numbers(np.tile([0.5, 0.5, 0, 0], (count, 1))),
    }
    targets = {"grow": file.sparse(sphere.positions), "rise": file.numbers(0.1 * sphere.normals)}
    mesh = add_mesh(file, sphere.positions, sphere.triangles, targets, given)
    file.add("nodes", name="root", children=[1])
    file.add("nodes", name="tip", translation=[0, 1, 0])
    file.add("nodes", mesh=mesh, skin=file.add("skins", joints=[0, 1]))
    sampler = {"input": file.numbers([[0], [1]]), "output": file.numbers(np.tile([0, 0, 0, 1], (2, 1)))}
    channel = {"sampler": 0, "target": {"node": 1, "path": "rotation"}}
    file.add("animations", samplers=[sampler], channels=[channel])
    return file.write(tmp_path_factory.mktemp("rigged") / "rigged.glb", 0, 2).read_bytes()


@given(data=st.data())
@settings(PATIENT, max_examples=200)
def test_damaged_rigs_and_clips(rigged, tmp_path_factory, data: st.DataObject) -> None:
    content = bytearray(rigged)
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(12, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.glb"
    path.write_bytes(bytes(content))
    try:
        rig = load_rigged(path).rig
        if rig is not None:
            assert np.isfinite(rig.positions_mm).all() and np.isfinite(rig.targets.delta_mm).all()
            assert rig.targets.point.max(initial=0) < len(rig.positions_mm)
            if rig.skeleton is not None:
                np.testing.assert_allclose(rig.skeleton.weight.sum(axis=1), 1, atol=1e-5)
                assert np.isfinite(rig.skeleton.matrices()).all()
    except DermisError as error:
        assert str(path) in str(error)
    try:
        for track in read_clip(path, None).tracks:
            assert np.isfinite(track.curve.sample(0.5)).all()
    except DermisError as error:
        assert str(path) in str(error)
