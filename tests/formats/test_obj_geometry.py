"""OBJ files as programs write them: encodings, indices, colours, and what is left out with a note."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.formats.obj import read_obj, read_obj_text
from dermis.formats.parts import MeshFile, MeshPart
from dermis.formats.read import join_parts, select_vertices
from dermis.images.colour import decode_srgb

CORNERS = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\n"
UV = "vt 0.1 0.2\nvt 0.4 0.2\nvt 0.4 0.9\nvt 0.1 0.9\n"
SQUARE = f"{CORNERS}{UV}f 1/1 2/2 3/3 4/4\n"


def read(folder: Path, content: str | bytes) -> MeshFile:
    path = folder / "a.obj"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_obj(path)


def only(file: MeshFile) -> MeshPart:
    (part,) = file.parts
    return part


def same(file: MeshFile, plain: MeshFile) -> None:
    assert len(file.parts) == len(plain.parts) and file.notes == plain.notes
    for part, other in zip(file.parts, plain.parts, strict=True):
        assert part.group == other.group
        np.testing.assert_array_equal(part.positions, other.positions)
        np.testing.assert_array_equal(part.uv, other.uv)
        np.testing.assert_array_equal(part.triangles, other.triangles)
        np.testing.assert_array_equal(part.quads, other.quads)


FORMS: dict[str, str | bytes] = {
    "relative indices": f"{CORNERS}{UV}f -4/-4 -3/-3 -2/-2 -1/-1\n",
    "relative indices before further vertices": f"{CORNERS}{UV}f -4/-4 -3/-3 -2/-2 -1/-1\nv 9 9 9\nvt 1 1\n",
    "UTF-8 byte order mark": b"\xef\xbb\xbf" + SQUARE.encode(),
    "UTF-16 byte order mark": SQUARE.encode("utf-16"),
    "carriage returns": SQUARE.replace("\n", "\r"),
    "carriage returns and line feeds": SQUARE.replace("\n", "\r\n"),
    "no line end at the end": SQUARE.strip(),
    "tabs": SQUARE.replace(" ", "\t"),
    "trailing blanks": SQUARE.replace("\n", " \t \n"),
    "leading blanks": "  " + SQUARE.replace("\n", "\n\t "),
    "comments at the ends of lines": SQUARE.replace("\n", " # one\n"),
    "continued lines": SQUARE.replace("2/2 3/3", "2/2 \\\n\\\n 3/3"),
    "slashes at the ends of corners": SQUARE.replace("f 1/1 2/2 3/3 4/4", "f 1/1/ 2/2/ 3/3/ 4/4/"),
    "uv of three numbers": SQUARE.replace("0.2\n", "0.2 0\n"),
    "weights of 1": SQUARE.replace(" 0\n", " 0 1.0\n"),
    "a comment that ends with a backslash": f"# C:\\heads\\\n{SQUARE}",
    "exponents": SQUARE.replace("v 2 3 0", "v 2e0 +3.0E+00 0"),
}


@pytest.mark.parametrize("form", FORMS)
def test_equivalent_statements_give_the_same_square(tmp_path: Path, form: str) -> None:
    same(read(tmp_path, FORMS[form]), read(tmp_path, SQUARE))


def test_corner_attributes_may_differ_per_face(tmp_path: Path) -> None:
    faces = "f 1/1/1 2/2/1 3/3/1\nf 1/1 3/3 4/4\n"
    part = only(read(tmp_path, f"{CORNERS}{UV}vn 0 0 1\n{faces}"))
    assert part.normals is not None and part.uv is not None and len(part.triangles) == 2
    corner = part.normals[part.triangles]
    np.testing.assert_array_equal(corner[0], np.tile([0.0, 0.0, 1.0], (3, 1)))
    assert np.isnan(corner[1]).all()
    np.testing.assert_array_equal(part.positions[part.triangles[1]], [[0, 0, 0], [2, 3, 0], [0, 3, 0]])


def test_normals_without_uv_are_read(tmp_path: Path) -> None:
    part = only(read(tmp_path, f"{CORNERS}vn 0 0 1\nf 1//1 2//1 3//1 4//1\n"))
    assert part.uv is None and part.normals is not None
    np.testing.assert_array_equal(part.normals, np.tile([0, 0, 1], (4, 1)))


def test_faces_without_uv_become_a_separate_part(tmp_path: Path) -> None:
    file = read(tmp_path, f"{CORNERS}{UV}usemtl skin\nf 1/1 2/2 3/3\nf 1 3 4/4\n")
    assert file.notes == ("1 of 2 faces have no uv",)
    first, second = file.parts
    assert first.group == second.group and first.uv is not None and second.uv is None
    np.testing.assert_array_equal(second.positions[second.triangles[0]], [[0, 0, 0], [2, 3, 0], [0, 3, 0]])


def test_groups_are_ordered_by_their_first_face(tmp_path: Path) -> None:
    faces = "g empty\ng b\nf 1/1 2/2 3/3\ng a\nf 1/1 3/3 4/4\ng b\nf 2/2 3/3 4/4\n"
    file = read(tmp_path, f"{CORNERS}{UV}{faces}")
    assert [(part.group.names, len(part.triangles)) for part in file.parts] == [
        (("b",), 2),
        (("a",), 1),
        (("empty",), 0),
    ]


def test_objects_become_groups_only_without_other_names(tmp_path: Path) -> None:
    text = f"{CORNERS}{UV}o Face\nf 1/1 2/2 3/3\no Eye_L\nf 1/1 3/3 4/4\n"
    assert [part.group.names for part in read(tmp_path, text).parts] == [("Face",), ("Eye_L",)]
    assert [part.group.names for part in read(tmp_path, f"g\n{text}").parts] == [("Face",), ("Eye_L",)]
    assert only(read(tmp_path, f"usemtl skin\n{text}")).group.names == ("skin",)


def test_latin_names_agree_with_their_material(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_bytes("newmtl Häut\nKd 0.5 0.25 0.125\n".encode("latin-1"))
    text = f"mtllib a.mtl\n{CORNERS}{UV}usemtl Häut\nf 1/1 2/2 3/3\n"
    for encoding in ("latin-1", "utf-8"):
        group = only(read(tmp_path, text.encode(encoding))).group
        assert group.names == ("Häut",) and group.colour == (0.5, 0.25, 0.125)


def test_an_mtl_may_start_with_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_bytes(b"\xef\xbb\xbfnewmtl skin\r\nKd 0.5 0.25 0.125\r\n")
    file = read(tmp_path, f"mtllib a.mtl\nusemtl skin\n{SQUARE}")
    assert only(file).group.colour == (0.5, 0.25, 0.125)


def test_truncated_utf16_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(b"\xff\xfe" + b"v\0 \x001")
    with pytest.raises(DermisError, match=r"a\.obj: expected an OBJ file"):
        read_obj_text(path)


def coloured(colours: list[str]) -> str:
    lines = SQUARE.splitlines()
    return "\n".join([f"{line} {own}" for line, own in zip(lines, colours, strict=False)] + lines[4:])


def test_colours_of_vertices_are_srgb(tmp_path: Path) -> None:
    file = read(tmp_path, coloured(["1 0 0", "0 0.5 0", "0 0 1", "0.25 0.5 0.75"]))
    part = only(file)
    expected = decode_srgb([[1, 0, 0], [0, 0.5, 0], [0, 0, 1], [0.25, 0.5, 0.75]])
    np.testing.assert_allclose(part.colours, expected)
    assert file.notes == ()


def test_colours_from_0_to_255_are_recognised_with_a_note(tmp_path: Path) -> None:
    file = read(tmp_path, coloured(["255 0 0", "0 128 0", "0 0 255", "64 128 191"]))
    np.testing.assert_allclose(only(file).colours[3], decode_srgb(np.array([64, 128, 191]) / 255))
    assert file.notes == ("colours of vertices run to 255: they are read as levels from 0 to 255",)


def test_colours_out_of_range_are_clamped_with_a_note(tmp_path: Path) -> None:
    file = read(tmp_path, coloured(["300 0 -1", "0 128 0", "0 0 255", "64 128 191"]))
    np.testing.assert_array_equal(only(file).colours[0], [1, 0, 0])
    assert file.notes[1] == "colours of 1 vertices are out of range and are clamped"


def test_vertices_without_a_colour_among_others_are_white(tmp_path: Path) -> None:
    colours = only(read(tmp_path, coloured(["1 0 0", "", "0 1 0", ""]))).colours
    np.testing.assert_array_equal(colours, [[1, 0, 0], [1, 1, 1], [0, 1, 0], [1, 1, 1]])


def test_polypaint_of_zbrush_colours_the_vertices(tmp_path: Path) -> None:
    paint = "#MRGB ffff000000008000\n#MRGB ff0000ffff4080bf\n"
    file = read(tmp_path, SQUARE.replace("vt", paint + "vt", 1))
    expected = decode_srgb(np.array([[255, 0, 0], [0, 128, 0], [0, 0, 255], [64, 128, 191]]) / 255)
    np.testing.assert_allclose(only(file).colours, expected)
    assert file.notes == ()


def test_vertex_colours_override_polypaint_with_a_note(tmp_path: Path) -> None:
    file = read(tmp_path, coloured(["1 0 0"] * 4) + "\n#MRGB ffff0000ff008000ff0000ffff4080bf\n")
    np.testing.assert_array_equal(only(file).colours, [[1, 0, 0]] * 4)
    assert file.notes == ("the polypaint (#MRGB) is left out: vertices have colours of their own",)


@pytest.mark.parametrize("paint", ["ffff0000", "ffff00", "ffff0000ff008000ff0000ffff4080bg"])
def test_damaged_polypaint_is_left_out_with_a_note(tmp_path: Path, paint: str) -> None:
    file = read(tmp_path, f"{SQUARE}#MRGB {paint}\n")
    assert only(file).colours is None and "polypaint" in file.notes[0]


def test_joined_parts_without_colours_are_white(tmp_path: Path) -> None:
    red = only(read(tmp_path, coloured(["1 0 0"] * 4)))
    plain = only(read(tmp_path, SQUARE))
    joined = join_parts([red, plain], tmp_path / "a.obj")
    np.testing.assert_array_equal(joined.colours, [[1, 0, 0]] * 4 + [[1, 1, 1]] * 4)
    chosen = select_vertices(joined, np.array([3, 4])).colours
    np.testing.assert_array_equal(chosen, [[1, 0, 0], [1, 1, 1]])
    assert join_parts([plain, plain], tmp_path / "a.obj").colours is None


def test_homogeneous_positions_are_divided_by_their_weight(tmp_path: Path) -> None:
    file = read(tmp_path, SQUARE.replace("v 2 3 0\n", "v 4 6 0 2\n"))
    np.testing.assert_array_equal(only(file).positions, only(read(tmp_path, SQUARE)).positions)
    assert file.notes == ("vertices have a fourth coordinate: their positions are divided by it",)


NOTES = {
    "l 1 2\nl 2 3\np 1\n": "statements are left out: l (lines), p (points)",
    "vp 0.1\ncstype bspline\ncurv 0 1 1 2\nend\n": "statements are left out: vp (curves), cstype (curves), "
    "curv (curves), end (curves)",
    "usemap a.mtl\nbevel on\n": "statements are left out: usemap, bevel",
    "f 1/1 2/2\n": "1 faces of fewer than three corners are left out",
    "s 1\nf 1/1 2/2 3/3\ns 2\nf 2/2 3/3 4/4\n": "smoothing groups (s) are left out",
    "s off\n": "smoothing groups (s) are left out",
    "vt 0 0 1\n": "the third coordinate of uv (vt) is left out",
    "v 0 0 0 1 1\n": "further numbers after the position or colour of vertices (v) are left out",
    "v 0 0 0 1 1 1 0.5\n": "further numbers after the position or colour of vertices (v) are left out",
    "\x00\x01 junk\n": r"statements are left out: '\x00\x01'",
    "".join(f"word{k} 1\n" for k in range(20)): "word7 and 12 more",
}


@pytest.mark.parametrize("statement", NOTES)
def test_undrawn_elements_are_noted_once(tmp_path: Path, statement: str) -> None:
    (note,) = read(tmp_path, SQUARE + statement).notes
    assert NOTES[statement] in note


@pytest.mark.parametrize("statement", ["s 1\n", "mg 1 0.1\n", "# a comment\n", "\n \n", "g\n", "mtllib\n"])
def test_statements_without_visual_meaning_are_not_noted(tmp_path: Path, statement: str) -> None:
    same(read(tmp_path, SQUARE + statement), read(tmp_path, SQUARE))


def test_flat_shading_is_not_noted_when_normals_exist(tmp_path: Path) -> None:
    assert read(tmp_path, f"s off\n{CORNERS}vn 0 0 1\nf 1//1 2//1 3//1\n").notes == ()


FAULTS = {
    "f 1/1 2/2 5/3": "indices of its 4 vertices, 4 uv and 0 normals, but in line 12 it has '1/1 2/2 5/3'",
    "f 1/1 2/2 3/5": "indices of its 4 vertices, 4 uv and 0 normals, but in line 12",
    "f 1/1/1 2/2/1 3/3/1": "indices of its 4 vertices, 4 uv and 0 normals, but in line 12",
    "f 1/1 2/2 -5/3": "indices of its 4 vertices, 4 uv and 0 normals, but in line 12",
    "f 1/1 2/2 /3": "indices of its 4 vertices",
    "f 1/1 0/2 3/3": "indices from 1, but in line 12 there is a 0",
    "f 1/1 2/00 3/3": "indices from 1, but in line 12 there is a 0",
    "f 1/1 2/2 99999999999999999999/3": "indices of its 4 vertices",
    "f 1/1 2/2 3.5/3": "faces by whole numbers, but in line 12 it has '1/1 2/2 3.5/3'",
    "f 1/1 2/2 1-2": "faces by whole numbers, but in line 12",
    "f 1/1 2/2 3/3/3/3": "corners of faces as position/uv/normal, but in line 12",
    "v 1 2": "3 to 16 numbers after v, but in line 12 it has '1 2'",
    "v": "3 to 16 numbers after v, but in line 12 it has nothing",
    "v 1,5 2 3": "3 to 16 numbers after v, but in line 12 it has '1,5 2 3'",
    "v 1 2 3" + " 4" * 14: "3 to 16 numbers after v, but in line 12",
    "vt": "1 to 16 numbers after vt, but in line 12",
    "vn 0 1": "3 to 16 numbers after vn, but in line 12",
}


@pytest.mark.parametrize("statement", FAULTS)
def test_a_faulty_line_is_refused_with_its_number(tmp_path: Path, statement: str) -> None:
    before = f"{CORNERS}vp \\\n0\n{UV}f 1/1 2/2 3/3\n"  # a continued line is counted as two
    with pytest.raises(DermisError) as caught:
        read(tmp_path, f"{before}{statement}\n")
    assert FAULTS[statement] in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CORNERS, "a cloud of points without faces"),
        ("", "it has none"),
        (CORNERS + "f 1 2\nl 1 2\n", "cloud"),
    ],
)
def test_a_file_without_faces_is_refused_by_name(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(DermisError, match=words):
        read(tmp_path, text)
