"""Clothes of MakeHuman: .mhclo files, whose vertices are bound to vertices of the base mesh hm08.

The format is described at https://www.makehumancommunity.org/wiki/Documentation:File_formats_and_extensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index, Ints, Mask
from dermis.base.errors import notify, refuse
from dermis.base.reading import file_stamp, is_file, read_text
from dermis.formats.obj import read_obj_text
from dermis.formats.obj_geometry import parse_geometry
from dermis.human.wear.base_mesh import base_mesh
from dermis.images.io import read_colours

Colour = tuple[float, float, float]

_MAX_BYTES = 64 << 20
_SCALES = "x_scale", "y_scale", "z_scale"
_MM_PER_UNIT = 100.0
_DEFAULT_COLOUR: Colour = (0.5, 0.5, 0.5)
_EXPECTED = "a garment of MakeHuman (.mhclo) for the base mesh hm08"
_MIN_TRIANGLES = 4


class FileGarment(NamedTuple):
    """Garment of a file, cut off at the border of the bust.

    base, weight : (m, 3) vertices of hm08 to which each point is bound, and their weights
    offset : (m, 3) offset of each point from the mean of these vertices, before scaling
    scales : for x, y and z: two vertices of hm08, and the length that their distance along the axis is
        divided by [mm]; None for offsets in the unit of the file
    point, uv, triangles : index of the point (v,) and texture coordinates (v, 2) of the vertices, and
        triangles (t, 3)
    colour : albedo, linear Rec. 709 [-]
    """

    base: Index
    weight: Doubles
    offset: Doubles
    scales: tuple[tuple[int, int, float] | None, ...]
    point: Ints
    uv: Doubles
    triangles: Ints
    colour: Colour

    def points_mm(self, control_mm: Doubles) -> Doubles:
        """Return the points (m, 3) on a person [mm].

        control_mm : (p, 3) control points of the person at rest
        """
        mesh = base_mesh()
        vertices = np.asarray(mesh.weights @ control_mm[: mesh.weights.shape[1]]) + mesh.offset_mm
        factors = np.full(3, _MM_PER_UNIT)
        for axis, scale in enumerate(self.scales):
            if scale is not None:
                first, second, length_mm = scale
                factors[axis] *= abs(vertices[first, axis] - vertices[second, axis]) / length_mm
        mean = np.einsum("mk,mkc->mc", self.weight, vertices[self.base])
        return np.asarray(mean + factors * self.offset)


def read_garment(path: str) -> FileGarment:
    """Return the garment of a .mhclo file, cached until the file changes.

    Raises DermisError for files that cannot be read, and for garments that are not bound to hm08 or far from
    the bust.
    """
    return _read_garment(path, file_stamp(path))


@lru_cache(16)
def _read_garment(path: str, stamp: tuple[int, int] | None) -> FileGarment:
    file = Path(path)
    values, rows = _parse(file, read_text(file, _EXPECTED, _MAX_BYTES))
    if values.get("basemesh", ["hm08"])[0] != "hm08":
        refuse(file, _EXPECTED, f"it is for {values['basemesh'][0]}", "Choose another garment")
    if "obj_file" not in values:
        refuse(file, _EXPECTED, "it has no line obj_file", "Correct it")
    if "delete_verts" in values:
        notify(f"{path}: delete_verts is not supported, so the skin below the garment is kept")
    numbers = [[float(word) for word in row] for row in rows]
    count = len(base_mesh().offset_mm)
    base, weight, offset = _bindings(file, numbers, count)
    object_file = file.parent / values["obj_file"][0]
    polygons = parse_geometry(object_file, read_obj_text(object_file)).polygons
    if len(polygons.positions) != len(base):
        actual = f"it binds {len(base)} of the {len(polygons.positions)} vertices of {object_file.name}"
        refuse(file, _EXPECTED, actual, "Use the files of one garment")
    corner = _fan_triangles(polygons.counts)
    is_near: Mask = np.asarray(base_mesh().is_near[base].all(axis=1))
    kept = np.asarray(is_near[polygons.corners[corner, 0]].all(axis=1))
    if kept.sum() < _MIN_TRIANGLES:
        expected = "a garment over shoulders, chest, neck or head"
        refuse(file, expected, "it covers other parts of the body", "Choose another")
    corners = polygons.corners[corner[kept]].reshape(-1, 3)[:, :2]
    pairs, triangles = np.unique(corners, axis=0, return_inverse=True)
    has_uv = len(polygons.uv) > 0 and bool((pairs[:, 1] >= 0).all())
    uv = polygons.uv[pairs[:, 1]] if has_uv else np.zeros((len(pairs), 2))
    used, point = np.unique(pairs[:, 0], return_inverse=True)
    return FileGarment(
        base[used],
        weight[used],
        offset[used],
        tuple(_scale(file, values.get(name), count) for name in _SCALES),
        point.ravel().astype(np.int32),
        np.asarray(uv, np.float64),
        triangles.reshape(-1, 3).astype(np.int32),
        _colour(file, values.get("material")),
    )


def _parse(path: Path, text: str) -> tuple[dict[str, list[str]], list[list[str]]]:
    """Return the words after each key, and the words of each line of the list of vertices."""
    values, rows, in_vertices = dict[str, list[str]](), list[list[str]](), False
    for line in text.splitlines():
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0].startswith(("shear_", "l_shear_", "r_shear_")):
            refuse(path, _EXPECTED, f"it has {words[0]}", "Save it with scales instead")
        if _is_number(words[0]):
            if in_vertices:
                rows.append(words)
        else:
            in_vertices = words[0] == "verts"
            values[words[0]] = words[1:] or [""]
    if not rows:
        refuse(path, _EXPECTED, "it binds no vertices", "Check the file")
    if not all(_is_number(word) for row in rows for word in row):
        refuse(path, _EXPECTED, "its list of vertices contains words", "Correct it")
    return values, rows


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def _bindings(path: Path, rows: Sequence[Sequence[float]], count: int) -> tuple[Index, Doubles, Doubles]:
    """Return the base vertices, weights and offsets (m, 3) of the lines of the list of vertices.

    A line has one base vertex; or three, three weights and an offset; or three and three weights.
    """
    base, weight, offset = (np.zeros((len(rows), 3)) for _ in range(3))
    for k, row in enumerate(rows):
        if len(row) not in (1, 6, 9):
            actual = f"line {k + 1} of verts has {len(row)}"
            refuse(path, "1, 6 or 9 numbers for each vertex", actual, "Correct it")
        if len(row) == 1:
            base[k], weight[k] = row[0], (1.0, 0.0, 0.0)
        else:
            base[k], weight[k] = row[:3], row[3:6]
            offset[k] = row[6:] or 0.0
    if base.min() < 0 or base.max() >= count or (base % 1.0).any():
        refuse(path, f"vertices of hm08, 0 to {count - 1}", f"got {base.max():g}", "Correct it")
    return base.astype(np.int64), weight, offset


def _scale(path: Path, words: list[str] | None, count: int) -> tuple[int, int, float] | None:
    if words is None:
        return None
    if len(words) != 3 or not all(map(_is_number, words)):
        refuse(path, "two vertices and a length after a scale", f"got {' '.join(words)}", "Correct it")
    first, second, length = float(words[0]), float(words[1]), float(words[2])
    if not (0 <= first < count and 0 <= second < count and length > 0.0):
        refuse(path, "vertices of hm08 and a length above 0", f"got {' '.join(words)}", "Correct it")
    return int(first), int(second), _MM_PER_UNIT * length


def _fan_triangles(counts: Index) -> Index:
    """Return the corners (t, 3) of triangles that fill polygons with numbers of corners (n,)."""
    first = np.repeat(np.cumsum(counts) - counts, counts - 2)
    step = np.arange(len(first)) - np.repeat(np.cumsum(counts - 2) - (counts - 2), counts - 2)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def _colour(path: Path, material: list[str] | None) -> Colour:
    """Return the colour of a material file; a texture is replaced by its mean colour, with a note."""
    if not material or not is_file(file := path.parent / material[0]):
        return _DEFAULT_COLOUR
    colour, texture = np.array(_DEFAULT_COLOUR), None
    for line in read_text(file, "a material of MakeHuman (.mhmat)").splitlines():
        words = line.split()
        if len(words) == 4 and words[0] == "diffuseColor" and all(map(_is_number, words[1:])):
            colour = np.clip([float(word) for word in words[1:]], 0.0, 1.0)
        elif len(words) == 2 and words[0] == "diffuseTexture":
            texture = file.parent / words[1]
    if texture is not None and is_file(texture):
        notify(f"{path}: the texture {texture.name} is replaced by its mean colour")
        pixels, space = read_colours(texture)
        colour = space.to_linear(pixels).reshape(-1, 3).mean(axis=0)
    red, green, blue = (float(one) for one in colour)
    return red, green, blue
