"""Each statement of an OBJ file and each property of a PLY file is treated as its reader declares."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from ply_file import Row, ply_bytes
from property_rows import loaded, names_of, row_named, treatment

from dermis.formats.obj_geometry import OBJ_PROPERTIES
from dermis.formats.ply import COLOUR_NAMES, PLY_PROPERTIES, UV_NAMES
from dermis.images.io import write_png
from dermis.mesh.primitives import uv_sphere

BALL = uv_sphere(120.0, 12, 8)
COUNT = len(BALL.positions)
RAMP = np.arange(COUNT) / COUNT
TextChange = Callable[[str], str]


def treatment_of(path: Path, plain: bytes, changed: bytes) -> tuple[str, str]:
    """Return the treatment of a change of a file, and the notes and errors for the changed file."""
    results = []
    for content in (plain, changed):
        path.write_bytes(content)
        results.append(loaded(path))
    return treatment(*results), results[1].notes + results[1].error


def obj_text() -> str:
    places = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in BALL.positions]
    uv = [f"vt {u:.6f} {1 - v:.6f}" for u, v in BALL.uv]
    faces = [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in BALL.triangles + 1]
    return "\n".join([*places, *uv, *faces, ""])


def before_faces(statement: str) -> TextChange:
    return lambda text: text.replace("\nf ", f"\n{statement}\nf ", 1)


def before_last_face(statement: str) -> TextChange:
    def change(text: str) -> str:
        end = text.rindex("f ")
        return f"{text[:end]}{statement}\n{text[end:]}"

    return change


def replaced(old: str, new: str) -> TextChange:
    """Return a change that replaces the first occurrence of a text."""
    return lambda text: text.replace(old, new, 1)


def coloured(text: str) -> str:
    lines = text.splitlines()
    rows = [f"{line} {red:.3f} 0.5 0.2" for line, red in zip(lines, RAMP, strict=False)]
    return "\n".join(rows + lines[COUNT:])


def with_a_normal(text: str) -> str:
    return before_faces("vn 0 0 1")(text).replace("f 1/1 ", "f 1/1/1 ")


def with_normals(text: str) -> str:
    normals = "\n".join(f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in BALL.positions / 120.0)
    return before_faces(normals)(re.sub(r" (\d+)/\d+", r" \1/\1/\1", text))


class Statement(NamedTuple):
    """Change of an OBJ file that exercises a row of its properties.

    before : what the file needs so that the change has a meaning
    """

    row: str
    change: TextChange
    before: TextChange = str


PAINT = "#MRGB " + "".join(f"ff{int(255 * red):02x}4080" for red in RAMP)
OTHER_PAINT = "`#MRGB` beside colours in `v`, or for another number of vertices"
STATEMENTS = [
    Statement("`v x y z`", replaced("120.000000", "121.000000")),
    Statement("`v x y z w`", replaced("\nvt", " 2\nvt")),
    Statement("`v x y z r g b`", coloured),
    Statement("`v x y z r g b` above 1", lambda text: coloured(text).replace(" 0.5 0.2", " 128 50")),
    Statement("further numbers in `v`", replaced("\nvt", " 1 0.5\nvt")),
    Statement("`#MRGB` (polypaint of ZBrush)", before_faces(PAINT)),
    Statement(OTHER_PAINT, before_faces(PAINT), coloured),
    Statement(OTHER_PAINT, before_faces("#MRGB ff408080")),
    Statement("`vt u v`", replaced("vt 0.000000 ", "vt 0.010000 ")),
    Statement("`vt u v w`", replaced("\nf ", " 0.5\nf ")),
    Statement("`vn`", replaced("vn 0 0 1", "vn 0.6 0 0.8"), with_a_normal),
    Statement("`f` with `v`, `v/vt`, `v//vn`, `v/vt/vn`", lambda text: text[: text.rindex("f ")]),
    Statement("`f` without `vt` beside others with it", replaced("f 1/1 ", "f 1 ")),
    Statement("`f` of one or two corners", before_faces("f 1/1 2/2")),
    Statement("`f` with an index of 0 or beyond the file", before_faces("f 0 1 2")),
    Statement("`f` with an index of 0 or beyond the file", before_faces("f 1 2 9999")),
    Statement("`usemtl`, `g`", before_last_face("usemtl hair"), before_faces("usemtl skin")),
    Statement("`usemtl`, `g`", before_last_face("g hair"), before_faces("g skin")),
    Statement("`o`", before_faces("o other")),
    Statement("`mtllib`", before_faces("mtllib a.mtl"), before_faces("usemtl blue")),
    Statement("`mtllib` of a missing file", before_faces("mtllib gone.mtl")),
    Statement("`s` in a file without normals", before_faces("s off")),
    Statement("`s` in a file with normals", before_faces("s off"), with_normals),
    Statement("other statements", before_faces("csh rm -rf /")),
]
STATEMENTS += [
    Statement(row.name, before_faces(f"{key} 1 2"))
    for row in OBJ_PROPERTIES
    for key in row.keys
    if row.treatment in ("noted", "no effect")
]


@pytest.mark.parametrize("statement", STATEMENTS, ids=[one.row for one in STATEMENTS])
def test_each_statement_of_an_obj_is_treated_as_declared(tmp_path: Path, statement: Statement) -> None:
    (tmp_path / "a.mtl").write_text("newmtl blue\nKd 0.1 0.2 0.6\n")
    plain = statement.before(obj_text())
    found, notes = treatment_of(tmp_path / "a.obj", plain.encode(), statement.change(plain).encode())
    assert found == row_named(OBJ_PROPERTIES, statement.row).treatment, notes


def test_all_obj_table_rows_are_exercised() -> None:
    assert {one.row for one in STATEMENTS} == names_of(OBJ_PROPERTIES)


def test_ignored_statements_are_named(tmp_path: Path) -> None:
    text = before_faces("csh rm\nl 1 2")(obj_text())
    _, notes = treatment_of(tmp_path / "a.obj", obj_text().encode(), text.encode())
    assert "statements are left out: csh, l (lines)" in notes


def ply(
    vertex: str = "",
    columns: Sequence[np.ndarray] = (),
    face: str = "",
    values: Sequence[Row] = ((),),
    more: Mapping[str, tuple[str, Sequence[Row]]] | None = None,
    **comments: str,
) -> bytes:
    """Return a ball as a PLY file with further properties.

    vertex, columns : further properties of vertices, and their values
    face, values : further properties of faces, and the values of the first faces; the last repeat
    more : further elements, and replaced ones
    comments : of the header, by their first words
    """
    rows = np.column_stack([BALL.positions, *columns]).tolist()
    own = [*values, *[values[-1]] * len(BALL.triangles)]
    faces = [(triangle, *value) for triangle, value in zip(BALL.triangles.tolist(), own, strict=False)]
    elements = {
        "vertex": (f"double x, double y, double z{vertex}", rows),
        "face": (f"list uchar int vertex_indices{face}", faces),
    }
    header = [f"{key} {value}" for key, value in comments.items()]
    return ply_bytes(elements | dict(more or {}), "binary_big_endian", header)


class PlyChange(NamedTuple):
    """Changed PLY file that exercises the row of which the name begins so, and the file before."""

    row: str
    changed: bytes
    plain: bytes = ply()


UV_LIST, WEDGES = ", list uchar float texcoord", [0.1, 0.2, 0.3, 0.2, 0.1, 0.4]
UV = (", float s, float t", [*BALL.uv.T])
TINT = [0.2 + 0.5 * RAMP] * 3
FACES = [(triangle,) for triangle in BALL.triangles.tolist()]
OPEN = ("list uchar int vertex_indices", FACES[:-1])
TWO_PICTURES = {"TextureFile": "skin.png", "texturefile": "b.png"}
VALUES = [*row_named(PLY_PROPERTIES, "values of scanners").keys, "scalar_Deviation"]
COLOURED = [", ".join(f"float {name}" for name in names) for names in COLOUR_NAMES]
PLY_CHANGES = [
    PlyChange("vertex: `x`", ply().replace(np.float64(BALL.positions[0, 1]).tobytes()[::-1], b"\x40" * 8)),
    PlyChange(
        "vertex: `nx`", ply(", float nx, float ny, float nz", [0 * RAMP, 0.6 + 0 * RAMP, 0.8 + 0 * RAMP])
    ),
    *(PlyChange("vertex: `texture_u`", ply(f", float {u}, float {v}", UV[1])) for u, v in UV_NAMES),
    *(PlyChange("vertex: `red`", ply(f", {names}", TINT)) for names in COLOURED),
    PlyChange("the same as floats above 1", ply(f", {COLOURED[0]}", [200 * one for one in TINT])),
    *(
        PlyChange("vertex: `alpha`", ply(f", float {name}", [RAMP]))
        for name in ("alpha", "diffuse_alpha", "a")
    ),
    PlyChange("face: `vertex_indices`", ply(more={"face": ("list uchar int vertex_index", FACES[:-1])})),
    PlyChange(
        "faces of one or two corners",
        ply(more={"face": ("list uchar int vertex_indices", [([0, 1],), *FACES])}),
    ),
    PlyChange("face: `texcoord`", ply(face=UV_LIST, values=[(WEDGES,)])),
    PlyChange(
        "face: an empty `texcoord`",
        ply(face=UV_LIST, values=[([],), (WEDGES,)]),
        ply(face=UV_LIST, values=[(WEDGES,)]),
    ),
    PlyChange(
        "face: `texnumber`",
        ply(*UV, ", int texnumber", [(1,)], **TWO_PICTURES),
        ply(*UV, TextureFile="skin.png"),
    ),
    PlyChange(
        "tristrips: `vertex_indices`",
        ply(more={"face": OPEN, "tristrips": ("list int int vertex_indices", FACES[-1:])}),
        ply(more={"face": OPEN}),
    ),
    PlyChange("`comment TextureFile NAME`", ply(*UV, TextureFile="skin.png"), ply(*UV)),
    PlyChange("`comment TextureFile NAME` of a missing file", ply(*UV, TextureFile="gone.png"), ply(*UV)),
    PlyChange("values of scanners", ply("".join(f", float {name}" for name in VALUES), [RAMP] * len(VALUES))),
    PlyChange("other comments", ply(made="by a scanner")),
    PlyChange("other elements and properties", ply(", float ambient_red", [RAMP])),
    PlyChange("other elements and properties", ply(face=", uchar red", values=[(255,)])),
    PlyChange("other elements and properties", ply(more={"edge": ("int vertex1", [(1,)])})),
    PlyChange("a file without faces", ply(more={"face": ("list uchar int vertex_indices", [])})),
]


@pytest.mark.parametrize("change", PLY_CHANGES, ids=[one.row for one in PLY_CHANGES])
def test_each_property_of_a_ply_is_treated_as_declared(tmp_path: Path, change: PlyChange) -> None:
    write_png(tmp_path / "skin.png", np.full((2, 2, 3), (150, 90, 80), np.uint8))
    write_png(tmp_path / "b.png", np.full((2, 2, 3), (90, 50, 40), np.uint8))
    found, notes = treatment_of(tmp_path / "a.ply", change.plain, change.changed)
    assert found == row_named(PLY_PROPERTIES, change.row).treatment, notes


def test_all_ply_table_rows_are_exercised() -> None:
    rows = {row_named(PLY_PROPERTIES, one.row).name for one in PLY_CHANGES}
    assert rows == names_of(PLY_PROPERTIES)


def test_ignored_properties_are_named(tmp_path: Path) -> None:
    changed = ply(", float ambient_red", [RAMP], more={"edge": ("int vertex1", [(1,)])})
    _, notes = treatment_of(tmp_path / "a.ply", ply(), changed)
    assert "these are left out: edge, vertex ambient_red" in notes
