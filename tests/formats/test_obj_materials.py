"""Materials of OBJ files: each statement has an effect or a note, and parts have their own pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from egg import CLOTH, SKIN
from test_every_property import digest_of, load_quietly, loaded

from dermis.images.io import write_png
from dermis.mesh.primitives import uv_sphere

WITHOUT_MEANING = ("Ka", "map_Ka", "illum", "sharpness")
"""Statements about ambient light and the models of old renderers."""


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
    (folder / "a.mtl").write_text(f"newmtl face\n{face}\nnewmtl shirt\n{shirt}\n")
    count = len(uv_sphere(120.0, 12, 8).positions)
    lines = ["mtllib a.mtl", *lines_of("face", 0.0, 0, shift_u), *lines_of("shirt", -200.0, count)]
    path = folder / "a.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("which", ["face", "shirt"])
@pytest.mark.parametrize(
    "statement",
    [
        *("Kd 0.2 0.3 0.4", "Ke 0.1 0 0", "d 0.3", "Tr 0.7", "Pr 0.3", "Pm 1", "Ns 40", "Ks 1 0 0", "Ni 1.5"),
        *("Tf 0 1 0", "map_Kd cloth.png", "map_Kd -s 2 2 1 skin.png", "map_Kd -o 0.2 0 0 skin.png"),
        *("map_Kd gone.png", "map_Pr grey.png", "map_Pm grey.png", "map_Ke cloth.png", "map_d grey.png"),
        *(
            "map_Ks grey.png",
            "map_Ns grey.png",
            "norm gone.png",
            "bump grey.png",
            "disp grey.png",
            "refl grey.png",
        ),
        *("Ka 1 1 1", "map_Ka cloth.png", "illum 3", "sharpness 9"),
    ],
)
def test_a_statement_is_drawn_noted_or_without_meaning(which: str, statement: str, tmp_path: Path) -> None:
    results = []
    for more in ("", statement):
        kept = "" if statement.startswith("map_Kd") and more else "map_Kd skin.png"
        texts = {"face": "map_Kd skin.png", "shirt": "map_Kd cloth.png"}
        texts[which] = f"{kept}\n{more}"
        results.append(loaded(write_heads(tmp_path, texts["face"], texts["shirt"])))
    before, after = results
    assert not before.error and not after.error
    assert (before != after) != (statement.split()[0] in WITHOUT_MEANING)


def test_face_and_shirt_have_their_own_pictures(tmp_path: Path) -> None:
    head = load_quietly(write_heads(tmp_path, "map_Kd skin.png", "map_Kd cloth.png"), unit_mm=1.0)
    assert {one.name: one.kind for one in head.mesh.materials} == {"face": "skin", "shirt": "opaque"}
    assert head.maps.colour is not None and head.maps.parts is not None
    assert head.maps.colour[..., 0].mean() > 0.3 > head.maps.parts.colour[..., 2].mean()


def test_udim_tiles_are_pictures_of_their_own(tmp_path: Path) -> None:
    for shift, udim in ((0.0, 1001), (1.0, 1002)):
        (tmp_path / "face.1002.png").unlink(missing_ok=True)
        write_png(tmp_path / f"face.{udim}.png", SKIN)
        path = write_heads(tmp_path, "map_Kd face.<UDIM>.png", "Kd 0.1 0.1 0.1", shift)
        head = load_quietly(path, unit_mm=1.0)
        used = np.unique(head.mesh.triangles[head.mesh.material == _index(head, "face")])
        assert head.maps.colour is not None and head.maps.colour.std() > 0.02
        assert head.mesh.uv[used].min() >= 0.0 and head.mesh.uv[used].max() <= 1.0


def _index(head: object, name: str) -> int:
    return [one.name for one in head.mesh.materials].index(name)  # type: ignore[attr-defined]


def test_a_clamped_picture_differs_from_a_repeated_one(tmp_path: Path) -> None:
    digests = set()
    for clamp in ("on", "off"):
        statement = f"map_Kd -clamp {clamp} -s 1.5 1.5 1 skin.png"
        digests.add(digest_of(load_quietly(write_heads(tmp_path, statement, "Kd 0.1 0.1 0.1"), unit_mm=1.0)))
    assert len(digests) == 2
