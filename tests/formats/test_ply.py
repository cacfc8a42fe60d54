"""PLY files as programs write them: layouts, names of properties, colours, and what is noted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from ply_file import ORDERS, Row, ply_bytes

from dermis.base.errors import DermisError
from dermis.formats.parts import MeshFile, MeshPart
from dermis.formats.ply import read_ply
from dermis.images.colour import decode_srgb
from dermis.images.io import write_png

Elements = Mapping[str, tuple[str, Sequence[Row]]]
XYZ, XYZ_UV = "float x, float y, float z", "float x, float y, float z, float s, float t"
PLACES = [(0, 0, 0), (2, 0, 0), (2, 3, 0), (0, 3, 0), (0, 5, 0)]
UV = [(0.125, 0.25), (0.5, 0.25), (0.5, 0.875), (0.125, 0.875), (0.25, 1)]
VERTICES = [(*place, *uv) for place, uv in zip(PLACES, UV, strict=True)]
INDICES = "list uchar int vertex_indices"
QUAD_AND_TRIANGLE = [([0, 1, 2, 3],), ([3, 2, 4],)]


def house(
    vertex: str = XYZ_UV, rows: Sequence[Row] = VERTICES, faces: str = INDICES
) -> dict[str, tuple[str, Sequence[Row]]]:
    return {"vertex": (vertex, rows), "face": (faces, QUAD_AND_TRIANGLE)}


def read(folder: Path, elements: Elements, order: str = "ascii", comments: Sequence[str] = ()) -> MeshFile:
    return read_bytes(folder, ply_bytes(elements, order, comments))


def read_bytes(folder: Path, content: bytes) -> MeshFile:
    path = folder / "a.ply"
    path.write_bytes(content)
    return read_ply(path)


def only(file: MeshFile) -> MeshPart:
    (part,) = file.parts
    return part


def is_house(part: MeshPart) -> bool:
    """Return whether a part is the quad and the triangle, with their uv."""
    assert part.uv is not None
    place, uv = part.positions[part.triangles], part.uv[part.triangles]
    corners = np.array([[3, 2, 4], [0, 1, 2], [2, 3, 0]])
    return bool(
        np.array_equal(place, np.array(PLACES)[corners])
        and np.array_equal(uv, np.array(UV)[corners])
        and np.array_equal(part.quads, [[1, 2]])
    )


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("number", ["float", "double"])
@pytest.mark.parametrize("faces", ["list uchar int vertex_indices", "list int uint vertex_index"])
def test_triangles_and_quads_are_read_in_every_encoding(
    tmp_path: Path, order: str, number: str, faces: str
) -> None:
    file = read(tmp_path, house(XYZ_UV.replace("float", number), faces=faces), order)
    assert is_house(only(file)) and file.notes == ()


@pytest.mark.parametrize("order", ORDERS)
def test_properties_around_lists_of_varying_lengths_are_read(tmp_path: Path, order: str) -> None:
    faces = [(7, [0, 1, 2, 3], 0.5, [], 1), (7, [3, 2, 4], 0.25, [1.5, 2.5], 1)]
    properties = (
        "uchar flags, list uchar int vertex_indices, float quality, list ushort double quality, short id"
    )
    elements = {"vertex": (XYZ_UV, VERTICES), "face": (properties, faces)}
    assert is_house(only(read(tmp_path, elements, order)))


@pytest.mark.parametrize("names", ["s t", "u v", "texture_u texture_v", "s_coord t_coord", "tu tv"])
def test_uv_property_names_are_recognised(tmp_path: Path, names: str) -> None:
    u, v = names.split()
    file = read(tmp_path, house(f"{XYZ}, float {u}, float {v}"))
    assert is_house(only(file)) and file.notes == ()


@pytest.mark.parametrize("ends", [b"\r\n", b"\r"])
def test_headers_with_other_line_ends_are_read(tmp_path: Path, ends: bytes) -> None:
    for order in ORDERS:
        content = ply_bytes(house(), order)
        size = content.index(b"end_header\n") + len(b"end_header\n")
        assert is_house(only(read_bytes(tmp_path, content[:size].replace(b"\n", ends) + content[size:])))


WEDGES = [[*UV[0], *UV[1], *UV[2], *UV[3]], [*UV[3], *UV[2], *UV[4]]]
WEDGE_FACES = f"{INDICES}, list uchar float texcoord"


@pytest.mark.parametrize("order", ORDERS)
def test_uv_per_corner_is_read(tmp_path: Path, order: str) -> None:
    faces = [(index, uv) for (index,), uv in zip(QUAD_AND_TRIANGLE, WEDGES, strict=True)]
    elements = {"vertex": (f"{XYZ}, float nx, float ny, float nz", [(*p, 0, 0, 1) for p in PLACES])}
    part = only(read(tmp_path, elements | {"face": (WEDGE_FACES, faces)}, order))
    assert is_house(part) and len(part.positions) == 5
    np.testing.assert_array_equal(part.normals, [[0, 0, 1]] * 5)
    faces[1] = faces[1][0], [0.0] * 6
    part = only(read(tmp_path, elements | {"face": (WEDGE_FACES, faces)}, order))
    assert len(part.positions) == 7  # two vertices have another uv in each face


def test_faces_without_uv_become_a_separate_part(tmp_path: Path) -> None:
    faces = [(QUAD_AND_TRIANGLE[0][0], WEDGES[0]), (QUAD_AND_TRIANGLE[1][0], [])]
    file = read(tmp_path, {"vertex": (XYZ, PLACES), "face": (WEDGE_FACES, faces)})
    assert file.notes == ("1 of 2 faces have no uv",)
    assert [part.uv is None for part in file.parts] == [False, True]


def test_a_file_without_uv_has_none(tmp_path: Path) -> None:
    file = read(tmp_path, house(XYZ, PLACES))
    assert only(file).uv is None and file.notes == ()


LEVELS = [(255, 0, 0), (0, 128, 0), (0, 0, 255), (64, 128, 191), (0, 0, 0)]
COLOURS = decode_srgb(np.array(LEVELS) / 255)


def coloured(properties: str, colours: Sequence[Sequence[float]]) -> dict[str, tuple[str, Sequence[Row]]]:
    rows = [(*vertex, *colour) for vertex, colour in zip(VERTICES, colours, strict=True)]
    return house(f"{XYZ_UV}, {properties}", rows)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("names", ["red green blue", "diffuse_red diffuse_green diffuse_blue", "r g b"])
def test_colours_of_vertices_are_srgb(tmp_path: Path, order: str, names: str) -> None:
    file = read(tmp_path, coloured(", ".join(f"uchar {name}" for name in names.split()), LEVELS), order)
    np.testing.assert_allclose(only(file).colours, COLOURS)
    assert is_house(only(file)) and file.notes == ()


def test_colours_are_read_as_fractions_and_wide_integers(tmp_path: Path) -> None:
    for kind, scale in (("float", 1 / 255), ("ushort", 257)):
        values = [tuple(type(scale)(level * scale) for level in levels) for levels in LEVELS]
        file = read(tmp_path, coloured(f"{kind} red, {kind} green, {kind} blue", values), "binary_big_endian")
        np.testing.assert_allclose(only(file).colours, COLOURS, atol=1e-6)
        assert file.notes == ()


def test_float_colours_from_0_to_255_are_recognised_with_a_note(tmp_path: Path) -> None:
    file = read(tmp_path, coloured("float red, float green, float blue", LEVELS))
    np.testing.assert_allclose(only(file).colours, COLOURS)
    assert file.notes == ("colours of vertices run to 255: they are read as levels from 0 to 255",)


def test_transparency_of_vertices_is_noted_where_it_varies(tmp_path: Path) -> None:
    properties = "uchar red, uchar green, uchar blue, uchar alpha"
    for last, notes in ((255, ()), (0, ("the transparency of vertices (alpha) is left out",))):
        colours = [(*levels, last if number == 4 else 255) for number, levels in enumerate(LEVELS)]
        file = read(tmp_path, coloured(properties, colours))
        np.testing.assert_allclose(only(file).colours, COLOURS)
        assert file.notes == notes


def test_picture_name_is_read_from_a_comment(tmp_path: Path) -> None:
    assert read(tmp_path, house()).materials == ()
    comments = ["made by a scanner", "TextureFile my face.png"]
    (note,) = read(tmp_path, house(), "binary_little_endian", comments).notes
    assert note.startswith("its picture my face.png is not in its folder")
    write_png(tmp_path / "my face.png", np.zeros((1, 1, 3), np.uint8))
    (material,) = read(tmp_path, house(), comments=comments).materials
    assert material.textures["colour"].picture == tmp_path / "my face.png"


def test_most_used_of_several_pictures_is_used_with_a_note(tmp_path: Path) -> None:
    faces = [([0, 1, 2], 1), ([0, 2, 3], 1), ([3, 2, 4], 0)]
    elements = {"vertex": (XYZ_UV, VERTICES), "face": (f"{INDICES}, int texnumber", faces)}
    file = read(tmp_path, elements, comments=["TextureFile a.png", "TextureFile b.png", "TextureFile c.png"])
    assert "of several pictures b.png is used; left out: a.png, c.png" in file.notes
    assert read(tmp_path, elements).notes == ()


def test_strips_become_triangles(tmp_path: Path) -> None:
    strips = [([0, 1, 3, 2, 4, -1, 3, 2, 4],), ([0, 1, 1, 3],)]
    elements = {"vertex": (XYZ_UV, VERTICES), "tristrips": ("list int int vertex_indices", strips)}
    for order in ORDERS:
        part = only(read(tmp_path, elements, order))
        place = part.positions[part.triangles]
        corners = [[0, 1, 3], [3, 1, 2], [3, 2, 4], [3, 2, 4]]
        np.testing.assert_array_equal(place, np.array(PLACES)[corners])


NOTES: dict[str, Elements] = {
    "vertex ambient_red": house(f"{XYZ_UV}, float ambient_red", [(*vertex, 1) for vertex in VERTICES]),
    "face red, face green": {
        "vertex": (XYZ_UV, VERTICES),
        "face": (f"{INDICES}, uchar red, uchar green", [([0, 1, 2], 1, 2)]),
    },
    "edge": house() | {"edge": ("int vertex1, int vertex2", [(0, 1)])},
    "vertex u, vertex v": house(
        f"{XYZ}, float u, float v, float texture_u, float texture_v",
        [(*p, 1, 1, *uv) for p, uv in zip(PLACES, UV, strict=True)],
    ),
}


@pytest.mark.parametrize("names", NOTES)
def test_undrawn_elements_are_noted_once(tmp_path: Path, names: str) -> None:
    for order in ORDERS:
        assert read(tmp_path, NOTES[names], order).notes == (f"these are left out: {names}",)


def test_faces_of_two_corners_are_noted(tmp_path: Path) -> None:
    elements = {"vertex": (XYZ_UV, VERTICES), "face": (INDICES, [([0, 1, 2],), ([0, 1],), ([],)])}
    file = read(tmp_path, elements)
    assert len(only(file).triangles) == 1
    assert file.notes == ("2 faces of fewer than three corners are left out",)


def test_properties_without_visual_meaning_are_not_noted(tmp_path: Path) -> None:
    vertices = [(*vertex, 1, 2, 3) for vertex in VERTICES]
    file = read(
        tmp_path, house(f"{XYZ_UV}, float confidence, float quality, float scalar_Curvature", vertices)
    )
    assert is_house(only(file)) and file.notes == ()


FAULTS: dict[str, tuple[Elements, str]] = {
    "points": ({"vertex": (XYZ_UV, VERTICES)}, "a cloud of points without faces"),
    "no faces": ({"vertex": (XYZ, PLACES), "face": (INDICES, [])}, "a cloud of points without faces"),
    "no z": (house("float x, float y", [place[:2] for place in PLACES]), "vertices with x, y and z"),
    "an index beyond": ({"vertex": (XYZ, PLACES), "face": (INDICES, [([0, 1, 5],)])}, "from 0 to 5"),
    "a negative index": ({"vertex": (XYZ, PLACES), "face": (INDICES, [([0, 1, -2],)])}, "from -2 to 1"),
    "other names of faces": (
        house(faces="list uchar int corners"),
        "faces with vertex_indices, but they have corners",
    ),
    "half a uv": (
        {"vertex": (XYZ, PLACES), "face": (WEDGE_FACES, [([0, 1, 2], [0.5] * 5)])},
        "texcoord with u and v for each corner",
    ),
    "a large polygon": (
        {"vertex": (XYZ, PLACES), "face": ("list int int vertex_indices", [([0] * 5000,)])},
        "at most 4,096 corners of a face",
    ),
    "many lists": (
        house() | {"other": (", ".join(f"list uchar int a{k}" for k in range(9)), [[[]] * 9])},
        "at most 8 lists of an element",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_files_are_refused(tmp_path: Path, fault: str) -> None:
    elements, words = FAULTS[fault]
    for order in ORDERS:
        with pytest.raises(DermisError) as caught:
            read(tmp_path, elements, order)
        assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"ascii", b"ebcdic", "a PLY file of format"),
        (b"float x", b"complex x", "properties with a name and known types, but got 'complex x'"),
        (b"list uchar int", b"list uchar", "properties with a name and known types"),
        (b"2 3 0 0.5", b"2 3 0 half", "a word is not a number"),
        (b"3 3 2 4\n", b"3 3 2\n", "it ends within its elements named 'face'"),
        (b"4 0 1 2 3\n", b"-4 0 1 2 3\n", "it ends within its elements named 'face'"),
        (b"3 3 2 4\n", b"3 3 2 4 0\n", "1 numbers follow its last element"),
    ],
)
def test_damaged_text_is_refused(tmp_path: Path, old: bytes, new: bytes, words: str) -> None:
    content = ply_bytes(house())
    assert old in content
    with pytest.raises((DermisError, ValueError), match=words):
        read_bytes(tmp_path, content.replace(old, new))


def test_trailing_blank_bytes_are_accepted(tmp_path: Path) -> None:
    content = ply_bytes(house(), "binary_little_endian")
    assert is_house(only(read_bytes(tmp_path, content + b"\r\n")))
    with pytest.raises(DermisError, match="2 bytes follow its last element"):
        read_bytes(tmp_path, content + b"\x7f\x7f")
    with pytest.raises(DermisError, match="ends within its elements named 'face'"):
        read_bytes(tmp_path, content[:-1])
