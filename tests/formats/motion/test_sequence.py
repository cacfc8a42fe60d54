"""Sequences of mesh files on a head with the same topology."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from small_head import obj_text

import dermis
from dermis.base.errors import DermisError, DermisWarning
from dermis.formats.axes import Axes, to_y_up
from dermis.formats.motion.sequence import FrameReader, frame_files
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere


def _scaled(text: str, factor: float) -> str:
    """Return an OBJ file with scaled positions."""
    lines = []
    for line in text.splitlines():
        kind, *numbers = line.split()
        positions = [f"{factor * float(one):.6g}" for one in numbers] if kind == "v" else []
        lines.append(" ".join([kind, *positions]) if kind == "v" else line)
    return "\n".join([*lines, ""])


FACTORS = (1.0, 1.1, 0.9, 1.2)


def _frames(folder: Path, factors: tuple[float, ...] = FACTORS) -> Path:
    folder.mkdir()
    for number, factor in enumerate(factors, start=8):  # 8, 9, 10, 11: not the order of letters
        (folder / f"face_{number}.obj").write_text(_scaled(obj_text(), factor))
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return _frames(tmp_path / "take")


def _head(folder: Path, name: str = "face_8.obj") -> Head:
    return dermis.load_head(folder / name, subdivide=0)


def test_frames_are_sorted_by_number(folder: Path) -> None:
    names = [f"face_{k}.obj" for k in (8, 9, 10, 11)]
    (folder / "notes.txt").write_text("")
    (folder / "other_5.obj").write_text("")
    for pattern in ("face_%d.obj", "face_%05d.obj", "face_*.obj"):
        assert [one.name for one in frame_files(folder / pattern)] == names
    (folder / "other_5.obj").unlink()
    assert [one.name for one in frame_files(folder)] == names


def test_a_sequence_moves_the_points(folder: Path) -> None:
    head = _head(folder)
    clip = dermis.load_motion(folder, head, fps=10)
    assert (clip.name, clip.duration_s, clip.rate) == ("take", pytest.approx(0.3), 10)
    for index, factor in enumerate(FACTORS):
        positions = clip.pose_at(index / 10).to_arrays(head.control_rig).positions_mm
        np.testing.assert_allclose(positions, factor * head.positions_mm, rtol=1e-5, atol=1e-3)
    between = clip.pose_at(0.125).to_arrays(head.control_rig).positions_mm
    np.testing.assert_allclose(between, 1.05 * head.positions_mm, rtol=1e-5, atol=1e-3)
    assert clip.frame_count(10) == 4
    assert dermis.load_motion(folder, head).duration_s == pytest.approx(3 / 30)


def test_posed_frame_equals_the_head_loaded_from_that_file(folder: Path) -> None:
    head, other = _head(folder), _head(folder, "face_11.obj")
    pose_arrays = dermis.Scene(head, pose=dermis.load_motion(folder, head).pose_at(1.0)).pose_arrays
    assert pose_arrays is not None
    np.testing.assert_array_equal(pose_arrays.positions_mm[head.mesh.point], other.mesh.positions)


def test_sequence_uses_the_units_and_axes_of_the_head(tmp_path: Path) -> None:
    small = _frames(tmp_path / "small", (0.01, 0.011))
    head = dermis.load_head(small / "face_8.obj", unit_mm=100, up="z", subdivide=0)
    positions = dermis.load_motion(small, head, unit_mm=100, up="z").pose_at(1.0).positions_mm
    np.testing.assert_allclose(positions, 1.1 * head.positions_mm, rtol=1e-4, atol=1e-2)
    with pytest.warns(DermisWarning, match=r"face_8\.obj: .*1 unit = 100 mm makes it as large as the head"):
        found = dermis.load_motion(small, head, up="z").pose_at(1.0).positions_mm
    np.testing.assert_allclose(found, positions)
    with pytest.raises(
        DermisError, match=r"face_8\.obj: .*of about the size of the head, but it is 0\.01 times"
    ):
        dermis.load_motion(small, head, unit_mm=1.0, up="z")


def test_ply_frames_are_read(tmp_path: Path) -> None:
    import trimesh

    folder = _frames(tmp_path / "obj")
    (tmp_path / "ply").mkdir()
    for file in folder.iterdir():
        mesh = trimesh.load(file, process=False)
        (tmp_path / "ply" / f"{file.stem}.ply").write_bytes(mesh.export(file_type="ply", vertex_normal=False))
    head = dermis.load_head(tmp_path / "ply" / "face_8.ply")
    positions = dermis.load_motion(tmp_path / "ply", head).pose_at(1.0).positions_mm
    np.testing.assert_allclose(positions, 1.2 * head.positions_mm, rtol=1e-5, atol=1e-3)


def test_positions_alone_match_complete_files(folder: Path) -> None:
    reader = FrameReader(2.0, to_y_up(np.eye(3), Axes("z")).T)
    files = frame_files(folder)
    first = reader.read(files[0])
    for file in files:
        whole, quick = FrameReader(2.0, to_y_up(np.eye(3), Axes("z")).T).read(file), reader.read(file)
        assert quick.triangles is first.triangles  # which were not parsed again
        for mine, other in zip(quick, whole, strict=True):
            assert mine.dtype == other.dtype
            np.testing.assert_array_equal(mine, other)


@pytest.mark.parametrize("change", ["carriage returns", "UTF-16", "weights"])
def test_frames_with_other_statement_order_have_the_same_positions(folder: Path, change: str) -> None:
    plain = [FrameReader(unit_mm=1.0).read(file) for file in frame_files(folder)]
    for file in frame_files(folder):
        text = file.read_text()
        if change == "carriage returns":
            file.write_text(text.replace("\n", "\r"))
        elif change == "UTF-16":
            file.write_text(text, encoding="utf-16")
        else:
            file.write_text(re.sub(r"^(v .*)$", r"\1 10", _scaled(text, 10.0), flags=re.MULTILINE))
    reader = FrameReader(unit_mm=1.0)
    for file, expected in zip(frame_files(folder), plain, strict=True):
        np.testing.assert_allclose(reader.read(file).positions_mm, expected.positions_mm, rtol=1e-5)


def _without_last_face(text: str) -> str:
    return "\n".join(text.splitlines()[:-1]) + "\n"


def _other_face(text: str) -> str:
    *lines, last = text.splitlines()
    kind, a, b, c = last.split()
    return "\n".join([*lines, f"{kind} {b} {c} {a}", ""])


def _other_uv(text: str) -> str:
    return text.replace("vt 0.5 ", "vt 0.51 ", 1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            _without_last_face,
            r"face_10\.obj: expected the topology of the head, \d+ vertices .* it has \d+ and \d+ tri",
        ),
        (_other_face, r"face_10\.obj: expected frames of one topology, but its faces or uv differ"),
        (
            _other_uv,
            r"face_10\.obj: expected frames of one topology, but its faces or uv differ from .*face_8\.obj",
        ),
        (lambda text: text.replace("vt ", "# ").replace("f ", "# f "), r"face_10\.obj: "),
    ],
)
def test_mixed_topologies_are_refused_with_the_file_name(folder: Path, change, words: str) -> None:
    head = _head(folder)
    file = folder / "face_10.obj"
    file.write_text(change(file.read_text()))
    with pytest.raises(DermisError, match=words):
        dermis.load_motion(folder, head)


def test_a_frame_that_breaks_later_names_its_file(folder: Path) -> None:
    clip = dermis.load_motion(folder, _head(folder), fps=1)
    (folder / "face_9.obj").write_text("v 0 0")
    with pytest.raises(DermisError, match=r"face_9\.obj"):
        clip.pose_at(1.0)


def test_a_sequence_of_another_head_is_refused(folder: Path) -> None:
    other = Head("ball", uv_sphere(100.0, 8, 6), Maps())
    with pytest.raises(DermisError, match=r"face_8\.obj: expected the topology of the head"):
        dermis.load_motion(folder, other)


def test_a_subdivided_head_moves_by_its_control_points(folder: Path) -> None:
    head = dermis.load_head(folder / "face_8.obj", subdivide=1)
    pose = dermis.load_motion(folder, head, fps=1).pose_at(1.0)
    assert pose.positions_mm is not None and pose.positions_mm.shape == head.positions_mm.shape
    assert len(head.positions_mm) < len(np.unique(head.mesh.point))


def test_frames_that_split_shared_vertices_are_refused(tmp_path: Path) -> None:
    """Lips that touch in the head's frame are one point and cannot open in another frame."""
    folder = _frames(tmp_path / "take", (1.0, 1.0))
    twin = "v 0 300 0\nv 20 300 0\nv 0 320 0\nv 0 300 0\nv 20 300 0\nv 0 280 0\n"
    count = obj_text().count("\nv ") + 1
    faces = f"f {count + 1}/1 {count + 2}/2 {count + 3}/3\nf {count + 5}/1 {count + 4}/2 {count + 6}/3\n"
    for name, lower in (("face_8.obj", "280"), ("face_9.obj", "280")):
        text = (folder / name).read_text() + "usemtl skin\n" + twin.replace("280", lower) + faces
        (folder / name).write_text(text)
    head = _head(folder)
    file = folder / "face_9.obj"
    file.write_text(file.read_text()[::-1].replace("v 0 300 0"[::-1], "v 0 295 0"[::-1], 1)[::-1])
    with pytest.raises(DermisError, match=r"face_9\.obj: .*stay together, but \d+ separate by up to 5 mm"):
        dermis.load_motion(folder, head)


FAULTS = {
    "flat triangles": "f 1/1 1/1 2/2\nf 30/30 31/31 30/30\n",
    "repeated triangles": "f 30/30 31/31 56/56\nf 30/30 31/31 56/56\n",
    "a fin": "v 0 20 120\nf 30/30 31/31 -1/1\n",
}


@pytest.mark.filterwarnings("ignore::dermis.base.errors.DermisWarning")
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("has_uv", [True, False])
@pytest.mark.parametrize("levels", [0, 1])
def test_sequence_animates_a_repaired_head(tmp_path: Path, fault: str, has_uv: bool, levels: int) -> None:
    folder = _frames(tmp_path / "take")
    for file in folder.iterdir():
        text = file.read_text() + FAULTS[fault]
        file.write_text(text if has_uv else re.sub(r"(?m)^vt .*\n|/\d+", "", text))
    head = dermis.load_head(folder / "face_8.obj", unit_mm=1.0, subdivide=levels)
    assert head.file_vertices is not None
    found = dermis.load_motion(folder, head, fps=1, unit_mm=1.0).pose_at(2.0).positions_mm
    moved = 0.9 if fault != "a fin" else np.where(head.positions_mm[:, 2:] == 120, 1.0, 0.9)
    np.testing.assert_allclose(found, moved * head.positions_mm, rtol=1e-4, atol=1e-3)


def test_other_topology_with_equal_vertex_count_is_refused(tmp_path: Path) -> None:
    folder = _frames(tmp_path / "take")
    head = dermis.load_head(folder / "face_8.obj", subdivide=1)
    for file in folder.iterdir():
        file.write_text(
            _other_face(re.sub(r"(?m)^f 1/1 .*\n", "f 1/1 80/80 200/200\n", file.read_text(), count=1))
        )
    with pytest.raises(DermisError, match=r"face_8\.obj: expected the topology of the head"):
        dermis.load_motion(folder, head)


def test_a_sequence_has_the_axes_of_the_file_of_its_head(tmp_path: Path) -> None:
    folder = _frames(tmp_path / "take")
    head = dermis.load_head(folder / "face_8.obj", up="z", front="x", subdivide=0)
    found = dermis.load_motion(folder, head, fps=1).pose_at(1.0).positions_mm
    np.testing.assert_allclose(found, 1.1 * head.positions_mm, rtol=1e-5, atol=1e-3)
    other = dermis.load_motion(folder, head, fps=1, up="z").pose_at(1.0).positions_mm
    assert other is not None and np.abs(other - found).max() > 10


def test_empty_folders_and_mixed_file_types_are_refused(folder: Path) -> None:
    head = _head(folder)
    with pytest.raises(DermisError, match=r"no_%d\.obj: expected frames .* there are none"):
        dermis.load_motion(folder / "no_%d.obj", head)
    (folder / "face_3.ply").write_text("")
    with pytest.raises(DermisError, match=r"frames of one kind .*, but there are \.obj, \.ply"):
        dermis.load_motion(folder, head)
