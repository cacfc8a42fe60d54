"""Materials of OBJ files: each statement is treated as declared, and parts have their own pictures."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from egg import BUMPY, CLOTH, SKIN
from property_rows import load_quietly, loaded, names_of, row_named, treatment

from dermis.base.file_properties import keys_of
from dermis.formats.obj_materials import MTL_PROPERTIES, NUMERIC_STATEMENTS, TEXTURE_ROLES
from dermis.images.io import write_png
from dermis.mesh.primitives import uv_sphere


def lines_of(name: str, y_mm: float, first: int, shift_u: float = 0.0) -> list[str]:
    """Return a ball with a material as the text of an OBJ file.

    first : number of vertices before it
    shift_u : offset of its uv
    """
    ball = uv_sphere(120.0, 12, 8)
    lines = [f"v {x:.6f} {y + y_mm:.6f} {z:.6f}" for x, y, z in ball.positions]
    lines += [f"vt {u + shift_u:.6f} {1 - v:.6f}" for u, v in ball.uv]
    lines.append(f"usemtl {name}")
    numbers = ball.triangles + 1 + first
    return lines + [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in numbers]


def write_heads(folder: Path, face: str, shirt: str, shift_u: float = 0.0) -> Path:
    """Write a face and a shirt with these statements of their materials."""
    write_png(folder / "skin.png", SKIN)
    write_png(folder / "cloth.png", CLOTH)
    write_png(folder / "grey.png", CLOTH[..., :1])
    write_png(folder / "bumps.png", BUMPY)
    write_png(folder / "tile.1001.png", BUMPY)
    (folder / "a.mtl").write_text(f"newmtl face\n{face}\nnewmtl shirt\n{shirt}\n")
    count = len(uv_sphere(120.0, 12, 8).positions)
    lines = ["mtllib a.mtl", *lines_of("face", 0.0, 0, shift_u), *lines_of("shirt", -200.0, count)]
    path = folder / "a.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


class Change(NamedTuple):
    """Statements of a material before and after a change, with {} for the name of its own picture.

    row : beginning of the name of the property that they exercise
    """

    row: str
    before: str
    after: str


PICTURE = "map_Kd {}.png"
VALUES = {"Ke": "0.1 0 0", "d": "0.3", "Tr": "0.7", "Pr": "0.3", "Ns": "40", "Pm": "1", "map_Ke": "cloth.png"}
ADDED = {row.name: row.keys for row in MTL_PROPERTIES if row.treatment in ("noted", "no effect")}
ADDED |= {"`map_Pr`": ("map_Pr",), "`map_Ks`": ("map_Ks",)}
ADDED |= {"other statements": ("Ks", "Ni", "disp", "Tf", "map_Ns", "refl")}
CHANGES = [
    Change("`newmtl`", "Kd 0.5 0.4 0.3\nKd 0.2 0.3 0.4", "Kd 0.5 0.4 0.3\nnewmtl other\nKd 0.2 0.3 0.4"),
    Change("`Kd`", "Kd 0.5 0.4 0.3", "Kd 0.2 0.3 0.4"),
    Change("`Kd` beside", PICTURE, f"{PICTURE}\nKd 0.2 0.3 0.4"),
    Change("`map_Kd`", "Kd 0.5 0.4 0.3", PICTURE),
    Change("UDIM tiles", PICTURE, "map_Kd tile.<UDIM>.png"),
    Change("`norm`", PICTURE, f"{PICTURE}\nnorm bumps.png"),
    Change("`bump`, `map_Bump` with normals", PICTURE, f"{PICTURE}\nbump bumps.png"),
    Change("`bump`, `map_Bump` with normals", PICTURE, f"{PICTURE}\nmap_Bump bumps.png"),
    Change("`bump`, `map_Bump` with heights", PICTURE, f"{PICTURE}\nbump grey.png"),
    Change("options `-s`", PICTURE, "map_Kd -s 2 2 1 {}.png"),
    Change("options `-s`", PICTURE, "map_Kd -o 0.2 0 0 {}.png"),
    Change("options `-s`", "map_Kd -s 1.5 1.5 1 {}.png", "map_Kd -s 1.5 1.5 1 -clamp on {}.png"),
    Change("option `-bm`", "norm bumps.png", "norm -bm 0.5 bumps.png"),
    *(
        Change("options `-mm`", PICTURE, f"map_Kd -{option} {{}}.png")
        for option in ("mm 0.2 0.5", "cc on", "boost 2", "imfchan r", "blendu off", "blendv off", "t 1 1 1")
    ),
    Change("options `-texres`", PICTURE, "map_Kd -texres 512 -type sphere -mm 0 1 -blendu on {}.png"),
    Change("a picture that is missing", PICTURE, f"{PICTURE}\nnorm gone.png"),
    *(
        Change(row, PICTURE, f"{PICTURE}\n{key} {VALUES.get(key, 'grey.png')}")
        for row, keys in ADDED.items()
        for key in keys
    ),
]


@pytest.mark.parametrize("which", ["face", "shirt"])
@pytest.mark.parametrize("change", CHANGES, ids=[one.after for one in CHANGES])
def test_each_statement_is_treated_as_declared(which: str, change: Change, tmp_path: Path) -> None:
    row = row_named(MTL_PROPERTIES, change.row)
    results = []
    for text in (change.before, change.after):
        texts = {"face": PICTURE.format("skin"), "shirt": PICTURE.format("cloth")}
        texts[which] = text.format({"face": "skin", "shirt": "cloth"}[which])
        results.append(loaded(write_heads(tmp_path, **texts)))
    expected = row.treatment if which == "face" else row.other_parts or row.treatment
    assert treatment(*results) == expected, results[1].notes + results[1].error


def test_all_table_rows_are_exercised_and_all_read_statements_have_a_row() -> None:
    assert {row_named(MTL_PROPERTIES, one.row).name for one in CHANGES} == names_of(MTL_PROPERTIES)
    assert {key.lower() for key in keys_of(MTL_PROPERTIES)} >= {*NUMERIC_STATEMENTS, *TEXTURE_ROLES}


def test_face_and_shirt_have_separate_pictures(tmp_path: Path) -> None:
    head = load_quietly(write_heads(tmp_path, "map_Kd skin.png", "map_Kd cloth.png"), unit_mm=1.0)
    assert {one.name: one.kind for one in head.mesh.materials} == {"face": "skin", "shirt": "opaque"}
    assert head.maps.colour is not None and head.maps.parts is not None
    assert head.maps.colour[..., 0].mean() > 0.3 > head.maps.parts.colour[..., 2].mean()


def test_udim_tiles_are_separate_pictures(tmp_path: Path) -> None:
    for shift, udim in ((0.0, 1001), (1.0, 1002)):
        (tmp_path / "face.1002.png").unlink(missing_ok=True)
        write_png(tmp_path / f"face.{udim}.png", SKIN)
        path = write_heads(tmp_path, "map_Kd face.<UDIM>.png", "Kd 0.1 0.1 0.1", shift)
        head = load_quietly(path, unit_mm=1.0)
        used = np.unique(head.mesh.triangles[head.mesh.material == _index(head, "face")])
        assert head.maps.colour is not None and np.ptp(head.maps.colour, axis=(0, 1)).min() > 0.05
        assert head.mesh.uv[used].min() >= 0.0 and head.mesh.uv[used].max() <= 1.0


def _index(head: object, name: str) -> int:
    return [one.name for one in head.mesh.materials].index(name)  # type: ignore[attr-defined]
