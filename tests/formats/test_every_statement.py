"""Each statement of an OBJ file and each property of a PLY file has an effect or a note."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from ply_file import Row, ply_bytes
from test_every_property import Loaded, loaded

from dermis.formats.obj_geometry import LEFT_OUT, READ_STATEMENTS, STATEMENTS_WITHOUT_MEANING
from dermis.formats.ply import COLOUR_NAMES, PROPERTIES_WITHOUT_MEANING, UV_NAMES
from dermis.images.io import write_png
from dermis.mesh.primitives import uv_sphere

BALL = uv_sphere(120.0, 12, 8)
COUNT = len(BALL.positions)
RAMP = np.arange(COUNT) / COUNT


def has_effect(path: Path, plain: bytes, changed: bytes, name: str) -> bool:
    """Return whether a change of a file changes the head, or is named in a further note."""
    results = [_load(path, content) for content in (plain, changed)]
    notes = set(results[1].notes.splitlines()) - set(results[0].notes.splitlines())
    assert not results[1].error
    return results[0].digest != results[1].digest or any(name in note for note in notes)


def _load(path: Path, content: bytes) -> Loaded:
    path.write_bytes(content)
    return loaded(path)


def obj_text() -> str:
    places = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in BALL.positions]
    uv = [f"vt {u:.6f} {1 - v:.6f}" for u, v in BALL.uv]
    faces = [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in BALL.triangles + 1]
    return "\n".join([*places, *uv, *faces, ""])


def before_faces(statement: str) -> Callable[[str], str]:
    return lambda text: text.replace("\nf ", f"\n{statement}\nf ", 1)


def coloured(text: str) -> str:
    lines = text.splitlines()
    rows = [f"{line} {red:.3f} 0.5 0.2" for line, red in zip(lines, RAMP, strict=False)]
    return "\n".join(rows + lines[COUNT:])


STATEMENTS: dict[str, Callable[[str], str]] = {
    "v": lambda text: text.replace("120.000000", "121.000000", 1),
    "v, its colour": coloured,
    "v, its weight": lambda text: text.replace("\nvt", " 2\nvt", 1),
    "vt": lambda text: text.replace("vt 0.000000 ", "vt 0.010000 ", 1),
    "vn": lambda text: before_faces("vn 0.6 0 0.8")(text).replace("f 1/1 ", "f 1/1/1 "),
    "f": lambda text: text[: text.rindex("f ")],
    "usemtl": before_faces("usemtl other"),
    "g": before_faces("g other"),
    "o": before_faces("o other"),
    "mtllib": before_faces("mtllib gone.mtl"),
    "#MRGB": before_faces("#MRGB " + "".join(f"ff{int(255 * red):02x}4080" for red in RAMP)),
    "s": before_faces("s off"),
    "csh": before_faces("csh rm -rf /"),
    **{key: before_faces(f"{key} 1 2") for key in LEFT_OUT},
}


@pytest.mark.parametrize("name", STATEMENTS)
def test_each_statement_of_an_obj_has_an_effect_or_a_note(tmp_path: Path, name: str) -> None:
    changed = STATEMENTS[name](obj_text())
    assert has_effect(tmp_path / "a.obj", obj_text().encode(), changed.encode(), name)


def test_all_statements_that_are_read_are_changed() -> None:
    assert set(READ_STATEMENTS) <= set(STATEMENTS)


@pytest.mark.parametrize("key", STATEMENTS_WITHOUT_MEANING)
def test_statements_without_meaning_change_nothing(tmp_path: Path, key: str) -> None:
    path = tmp_path / "a.obj"
    assert _load(path, before_faces(f"{key} 1")(obj_text()).encode()) == _load(path, obj_text().encode())


def ply(
    vertex: str = "", columns: Sequence[np.ndarray] = (), face: str = "", values: Row = (), **comments: str
) -> bytes:
    """Return a ball as a PLY file with further properties.

    vertex, columns : further properties of vertices, and their values
    face, values : further properties of faces, and the values of each face
    comments : of the header, by their first words
    """
    rows = np.column_stack([BALL.positions, *columns]).tolist()
    faces = [(triangle, *values) for triangle in BALL.triangles.tolist()]
    elements = {
        "vertex": (f"double x, double y, double z{vertex}", rows),
        "face": (f"list uchar int vertex_indices{face}", faces),
    }
    return ply_bytes(elements, "binary_big_endian", [f"{key} {value}" for key, value in comments.items()])


TINT = [np.full(COUNT, 0.25)] * 3
PROPERTIES: dict[str, tuple[bytes, bytes]] = {
    "nx": (ply(), ply(", float nx, float ny, float nz", [0 * RAMP, 0.6 + 0 * RAMP, 0.8 + 0 * RAMP])),
    "ambient_red": (ply(), ply(", float ambient_red", [RAMP])),
    "face red": (ply(), ply(face=", uchar red", values=(255,))),
    "texcoord": (ply(), ply(face=", list uchar float texcoord", values=([0.1, 0.2, 0.3, 0.2, 0.1, 0.4],))),
    "gone.png": (ply(), ply(TextureFile="gone.png")),
    "skin.png": (ply(), ply(", float s, float t", [*BALL.uv.T], TextureFile="skin.png")),
    "texnumber": (
        ply(
            ", float s, float t",
            [*BALL.uv.T],
            ", int texnumber",
            (0,),
            TextureFile="skin.png",
            texturefile="b.png",
        ),
        ply(
            ", float s, float t",
            [*BALL.uv.T],
            ", int texnumber",
            (1,),
            TextureFile="skin.png",
            texturefile="b.png",
        ),
    ),
    "alpha": (ply(), ply(", float alpha", [RAMP])),
    **{f"{u} {v}": (ply(), ply(f", float {u}, float {v}", [*BALL.uv.T])) for u, v in UV_NAMES},
    **{
        red: (ply(), ply(f", float {red}, float {green}, float {blue}", TINT))
        for red, green, blue in COLOUR_NAMES
    },
}


@pytest.mark.parametrize("name", PROPERTIES)
def test_each_property_of_a_ply_has_an_effect_or_a_note(tmp_path: Path, name: str) -> None:
    write_png(tmp_path / "skin.png", np.full((2, 2, 3), (150, 90, 80), np.uint8))
    assert has_effect(tmp_path / "a.ply", *PROPERTIES[name], name)


def test_properties_without_meaning_change_nothing(tmp_path: Path) -> None:
    names = [*sorted(PROPERTIES_WITHOUT_MEANING), "scalar_Deviation"]
    declared = "".join(f", float {name}" for name in names)
    changed = ply(declared, [RAMP] * len(names), made="by a scanner")
    assert _load(tmp_path / "a.ply", changed) == _load(tmp_path / "a.ply", ply())
