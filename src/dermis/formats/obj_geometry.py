"""Geometry of OBJ files: polygons with positions, uv, normals and colours, and the group of each polygon.

Numeric statements are parsed as arrays, all other statements individually.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from dermis.base.arrays import Bytes, Doubles, Index, Mask
from dermis.base.errors import refuse
from dermis.base.file_properties import (
    drawn_property,
    drawn_property_with_note,
    keys_of,
    markdown_code,
    noted_property,
    property_without_effect,
    refused_property,
)
from dermis.formats import size_limits as limits
from dermis.formats.polygons import (
    Polygons,
    check_polygon_sizes,
    missing_uv_notes,
    refuse_without_faces,
    without_small_polygons,
)
from dermis.formats.text_files import join_names, parse_numbers, run_starts
from dermis.formats.vertex_colours import linear_colours

_MAX_LINES = 12_000_000
_MAX_LINE_LENGTH, _MAX_VERTEX_LINE_LENGTH = 1 << 17, 256  # characters
_CONTINUED_LINE = re.compile(r"^(?![ \t]*#)(?:[^\n]*\\\n)+[^\n]*", re.MULTILINE)
_LEADING_BLANKS = re.compile(r"^[ \t]+", re.MULTILINE)
_TRAILING_COMMENT = re.compile(r"^((?:v[tn]?|f)[ \t][^#\n]*)#[^\n]*", re.MULTILINE)
_LINE_FEED, _SPACE, _SLASH = b"\n /"
_VERTEX_STATEMENTS = ("v", "vt", "vn")
_MIN_NUMBERS_PER_STATEMENT = {"v": 3, "vt": 1, "vn": 3}
# numbers in a statement that are used (position, colour), and that are allowed
_USED_NUMBERS_PER_STATEMENT, _MAX_NUMBERS_PER_STATEMENT = 6, 16
_POLYPAINT_MARK = "#MRGB"
_CURVE_STATEMENTS = "cstype deg bmat step curv curv2 surf con vp parm trim hole scrv sp end"
_LEFT_OUT_STATEMENTS = {"lines": ("l",), "points": ("p",), "curves": tuple(_CURVE_STATEMENTS.split())}
OBJ_PROPERTIES = (
    drawn_property("`v x y z`", "position", "v"),
    drawn_property_with_note("`v x y z w`", "position divided by w (no note if w is 1)"),
    drawn_property("`v x y z r g b`", "sRGB colour from 0 to 1; vertices without one are white"),
    drawn_property_with_note("`v x y z r g b` above 1", "sRGB colour from 0 to 255"),
    noted_property("further numbers in `v`"),
    drawn_property(
        f"`{_POLYPAINT_MARK}` (polypaint of ZBrush)", "sRGB colours of the vertices", _POLYPAINT_MARK
    ),
    noted_property(f"`{_POLYPAINT_MARK}` beside colours in `v`, or for another number of vertices"),
    drawn_property("`vt u v`", "uv", "vt"),
    noted_property("`vt u v w`", "u and v are drawn, w is left out (no note if it is 0)"),
    drawn_property("`vn`", "normals; missing ones are computed", "vn"),
    drawn_property(
        "`f` with `v`, `v/vt`, `v//vn`, `v/vt/vn`",
        "polygons, divided into fans; indices count from 1, or backwards from the last vertex",
        "f",
    ),
    drawn_property_with_note("`f` without `vt` beside others with it", "as skin without uv"),
    noted_property("`f` of one or two corners"),
    refused_property("`f` with an index of 0 or beyond the file", "the error names the line"),
    drawn_property_with_note("`usemtl`, `g`", "groups; the note lists those of skin", "usemtl", "g"),
    drawn_property("`o`", "groups where neither `usemtl` nor `g` has a name", "o"),
    drawn_property("`mtllib`", "[materials](#materials-and-parts)", "mtllib"),
    noted_property("`mtllib` of a missing file"),
    noted_property(
        "`s` in a file without normals", "the surface is smooth everywhere (no note for one group)"
    ),
    property_without_effect("`s` in a file with normals", "the normals decide"),
    property_without_effect("`mg`", "for curves only", "mg"),
    *(
        noted_property(f"{kind}: {markdown_code(keys)}", "", *keys)
        for kind, keys in _LEFT_OUT_STATEMENTS.items()
    ),
    noted_property("other statements"),
)
"""Statements of OBJ files. `parse_geometry` reads the statements that are listed as drawn, and `s`."""
_USED_STATEMENTS = {*keys_of(OBJ_PROPERTIES, "drawn", "drawn with a note"), "s"}
_STATEMENTS_WITHOUT_EFFECT = keys_of(OBJ_PROPERTIES, "no effect")
_KIND_OF_LEFT_OUT_STATEMENT = {key: kind for kind, keys in _LEFT_OUT_STATEMENTS.items() for key in keys}


@dataclass(frozen=True)
class ObjGeometry:
    """Geometry of an OBJ file.

    pairs : combinations of a `usemtl` name and a `g` name
    pair : (n,) index in `pairs` for each polygon
    statements : non-numeric statements, as text
    notes : sentences on content that was repaired or left out
    """

    polygons: Polygons
    pairs: list[tuple[str, str]]
    pair: Index
    statements: str
    notes: list[str]


_Statement = tuple[int, str, str]
"""Line, first word and arguments of a statement."""


@dataclass(frozen=True)
class _StatementRows:
    """Statements of one kind, without the first word of each.

    line : (n,) line number of each statement, counted from 0
    text : ASCII codes of the statements, each of which ends with a line feed
    start : (n,) position of each statement in `text`
    """

    line: Index
    text: Bytes
    start: Index


def parse_geometry(path: Path, obj_text: str) -> ObjGeometry:
    """Return the geometry in the text of an OBJ file.

    Raises DermisError for invalid numbers and indices; the message names the line.
    """
    limits.check_limit(path, obj_text.count("\n"), _MAX_LINES, "lines", limits.DECIMATE_ADVICE)
    rows, others, unread = _split_statements(path, _join_and_strip_lines(obj_text))
    positions, colours, notes = _parse_vertices(path, rows["v"])
    uv, normals = (
        _parse_number_table(path, rows["vt"], "vt")[0],
        _parse_number_table(path, rows["vn"], "vn")[0],
    )
    if np.nan_to_num(uv[:, 2]).any():
        notes.append("the third coordinate of uv (vt) is left out")
    paint = "".join(value for _, key, value in others if key == _POLYPAINT_MARK)
    if paint and colours is not None:
        notes.append(f"the polypaint ({_POLYPAINT_MARK}) is left out: vertices have colours of their own")
    elif paint:
        colours, faults = _parse_polypaint(paint, len(positions))
        notes += faults
    counts, corners = _parse_faces(path, rows)
    pairs, pair = _face_groups(path, others, rows["f"].line)
    counts, corners, kept, faults = without_small_polygons(counts, corners)
    if not len(counts):
        refuse_without_faces(path, len(positions))
    uv = np.column_stack((uv[:, 0], np.where(np.isnan(uv[:, 1]), 0.0, uv[:, 1])))
    polygons = Polygons(counts, corners, positions, uv, normals[:, :3], colours)
    notes += [
        *faults,
        *missing_uv_notes(polygons),
        *_notes_on_unread_statements(unread, others, has_normals=len(normals) > 0),
    ]
    statements = "\n".join(f"{key} {value}" for _, key, value in others)
    return ObjGeometry(polygons, pairs, pair[kept], statements, notes)


def _join_and_strip_lines(obj_text: str) -> str:
    """Join continued lines; remove leading blanks, and comments at the ends of lines.

    The number of lines is unchanged, as empty lines take the place of joined lines.
    """
    if "\\\n" in obj_text:
        obj_text = _CONTINUED_LINE.sub(
            lambda m: m[0].replace("\\\n", " ") + "\n" * m[0].count("\n"), obj_text
        )
    if obj_text[:1] in (" ", "\t") or "\n " in obj_text or "\n\t" in obj_text:
        obj_text = _LEADING_BLANKS.sub("", obj_text)
    commented = obj_text.count("#") != obj_text.count("\n#") + obj_text.startswith("#")
    return _TRAILING_COMMENT.sub(r"\1", obj_text) if commented else obj_text


def _split_statements(
    path: Path, plain_text: str
) -> tuple[dict[str, _StatementRows], list[_Statement], dict[str, None]]:
    """Split the text of an OBJ file into its statements.

    Returns the `v`, `vt`, `vn` and `f` statements by first word; all other statements that are read, such as
    `usemtl`, in the order of the file; and, as keys of a dictionary, the first words of the statements that
    are not read.

    path : path of the file, for errors
    plain_text : text of the file, as `_join_and_strip_lines` returns it
    """
    data = np.frombuffer(f"{plain_text}\n".encode("utf-8", "replace"), np.uint8)
    end = np.flatnonzero(data == _LINE_FEED)
    start = np.concatenate([[0], end[:-1] + 1])
    length = end - start + 1
    first, second, third = (data[np.minimum(start + k, end)] for k in range(3))
    _check_line_limits(path, length, first == ord("v"))
    masks = {key: (first == ord(key)) & (second <= _SPACE) for key in ("v", "f")}
    for key in ("vt", "vn"):
        masks[key] = (first == ord("v")) & (second == ord(key[1])) & (third <= _SPACE)
    rows = {}
    for key, mask in masks.items():
        own = data[np.repeat(mask, length)]
        own_start = np.cumsum(length[mask]) - length[mask]
        own[own_start[:, None] + np.arange(len(key))] = _SPACE
        rows[key] = _StatementRows(np.flatnonzero(mask), own, own_start)
    is_comment = (first == ord("#")) & ~((second == ord("M")) & (third == ord("R")))
    other = ~np.logical_or.reduce([is_comment, first == _LINE_FEED, *masks.values()])
    count, items = int(other.sum()), "statements besides vertices and faces"
    limits.check_limit(path, count, 3 * limits.MAX_TRIANGLES, items, limits.DECIMATE_ADVICE)
    texts = data[np.repeat(other, length)].tobytes().decode().split("\n")[:-1]
    used, unread = list[_Statement](), dict[str, None]()
    for line, words in zip(
        np.flatnonzero(other).tolist(), (one.split(None, 1) for one in texts), strict=True
    ):
        if words and words[0] in _USED_STATEMENTS:
            used.append((line, words[0], words[1].strip() if len(words) > 1 else ""))
        elif words:
            unread[words[0]] = None
    return rows, used, unread


def _check_line_limits(path: Path, line_lengths: Index, is_vertex_line: Mask) -> None:
    if (
        line_lengths.max() > _MAX_LINE_LENGTH
        or line_lengths[is_vertex_line].max(initial=0) > _MAX_VERTEX_LINE_LENGTH
    ):
        expected = f"lines of at most {_MAX_LINE_LENGTH:,} characters, {_MAX_VERTEX_LINE_LENGTH} for vertices"
        refuse(path, expected, f"one has {line_lengths.max():,}", limits.DAMAGED_ADVICE)
    items = "lines of vertices, uv and normals"
    limits.check_limit(
        path, int(is_vertex_line.sum()), 3 * limits.MAX_VERTICES, items, limits.DECIMATE_ADVICE
    )


def _refuse_line(
    path: Path, statement_rows: _StatementRows, row_index: int, expected: str, actual: str = ""
) -> NoReturn:
    """Raise an error for one of the statements in `statement_rows`; the message names the line.

    row_index : index of the statement in `statement_rows`
    expected : what the statement should contain
    actual : description of the fault; by default a quotation of the statement
    """
    ends = np.append(statement_rows.start[1:], len(statement_rows.text))
    words = " ".join(
        statement_rows.text[statement_rows.start[row_index] : ends[row_index]]
        .tobytes()
        .decode(errors="replace")
        .split()
    )
    said = actual or (f"it has {words!r}" if words else "it has nothing")
    refuse(path, expected, f"in line {statement_rows.line[row_index] + 1} {said}", limits.DAMAGED_ADVICE)


def _parse_vertices(path: Path, statement_rows: _StatementRows) -> tuple[Doubles, Doubles | None, list[str]]:
    """Return positions (n, 3), linear colours (n, 3) or None, and notes.

    A single number after the position is a weight, by which the position is divided; three numbers after it
    are a colour.
    """
    table, counts = _parse_number_table(path, statement_rows, "v")
    positions, notes = table[:, :3], list[str]()
    if (counts == 5).any() or (counts > _USED_NUMBERS_PER_STATEMENT).any():
        notes.append("further numbers after the position or colour of vertices (v) are left out")
    weight = np.where(counts == 4, table[:, 3], 1.0)
    if (weight != 1).any():
        notes.append("vertices have a fourth coordinate: their positions are divided by it")
        positions = positions / weight[:, None]
    coloured = counts >= _USED_NUMBERS_PER_STATEMENT
    if not coloured.any():
        return positions, None, notes
    colours, faults = linear_colours(np.where(coloured[:, None], table[:, 3:], np.nan))
    return positions, colours, notes + faults


def _parse_polypaint(hex_digits: str, vertex_count: int) -> tuple[Doubles | None, list[str]]:
    """Return linear vertex colours (n, 3) from ZBrush's polypaint, or None if it is invalid; and notes.

    hex_digits : two hexadecimal digits each for mask, red, green and blue of each vertex
    vertex_count : number of vertices
    """
    try:
        levels = np.frombuffer(bytes.fromhex(hex_digits), np.uint8).reshape(vertex_count, 4)
    except ValueError:
        return None, [f"the polypaint ({_POLYPAINT_MARK}) does not fit the vertices and is left out"]
    return linear_colours(levels[:, 1:])


def _parse_number_table(
    path: Path, statement_rows: _StatementRows, statement_key: str
) -> tuple[Doubles, Index]:
    """Return the numbers of n statements, (n, 6), and the count of numbers in each statement, (n,).

    Only the first six numbers of a statement are returned; shorter statements are padded with NaN.

    statement_key : first word of the statements, such as "v", which determines how many numbers are expected
    """
    words = run_starts(statement_rows.text > _SPACE)
    first = np.searchsorted(words, statement_rows.start)
    counts = np.diff(first, append=len(words))
    fewest = _MIN_NUMBERS_PER_STATEMENT[statement_key]
    expected = f"{fewest} to {_MAX_NUMBERS_PER_STATEMENT} numbers after {statement_key}"
    if (faulty := (counts < fewest) | (counts > _MAX_NUMBERS_PER_STATEMENT)).any():
        _refuse_line(path, statement_rows, int(faulty.argmax()), expected)
    try:
        values = parse_numbers(statement_rows.text, len(words), np.float64)
    except ValueError:
        _refuse_line(path, statement_rows, _first_non_numeric(statement_rows, np.float64), expected)
    column = np.arange(_USED_NUMBERS_PER_STATEMENT)
    table = np.full((len(counts), _USED_NUMBERS_PER_STATEMENT), np.nan)
    given = column < counts[:, None]
    table[given] = values[(first[:, None] + column)[given]]
    return table, counts


def _first_non_numeric(statement_rows: _StatementRows, dtype: type[np.float64] | type[np.int64]) -> int:
    """Return the index of the first statement with a word that is not a number of the type `dtype`."""
    for index, statement in enumerate(statement_rows.text.tobytes().split(b"\n")):
        try:
            parse_numbers(np.frombuffer(statement, np.uint8), len(statement.split()), dtype)  # type: ignore[type-var]
        except ValueError:
            return index
    return 0


def _parse_faces(path: Path, rows_of_statement: Mapping[str, _StatementRows]) -> tuple[Index, Index]:
    """Return the number of corners of each face, and three indices for each of the c corners, (c, 3).

    The three indices select the position, the uv and the normal. A missing uv or normal has the index -1.
    """
    faces = rows_of_statement["f"]
    slash = faces.text == _SLASH
    spaced = replace(faces, text=np.where(slash, np.uint8(_SPACE), faces.text))
    corner_start, index_start = run_starts(faces.text > _SPACE), run_starts(spaced.text > _SPACE)
    counts = np.diff(np.searchsorted(corner_start, faces.start), append=len(corner_start))
    check_polygon_sizes(path, counts)

    def refuse_first_fault(is_faulty: Mask, text_positions: Index, expected: str, actual: str = "") -> None:
        if is_faulty.any():
            position = text_positions[is_faulty.argmax()]
            face = np.searchsorted(faces.start, position, side="right") - 1
            _refuse_line(path, faces, int(face), expected, actual)

    try:
        values = parse_numbers(spaced.text, len(index_start), np.int64)
    except ValueError:
        _refuse_line(path, faces, _first_non_numeric(spaced, np.int64), "faces by whole numbers")
    refuse_first_fault(values == 0, index_start, "faces by indices from 1", "there is a 0")
    corner = np.searchsorted(corner_start, index_start, side="right") - 1
    slashes = np.cumsum(slash, dtype=np.int32)
    column = slashes[index_start] - (slashes - slash)[corner_start[corner]]
    refuse_first_fault(column > 2, index_start, "corners of faces as position/uv/normal")
    corners = np.zeros((len(corner_start), 3), np.int64)
    corners[corner, column] = values
    given, sizes = corners != 0, [len(rows_of_statement[kind].line) for kind in _VERTEX_STATEMENTS]
    if (values < 0).any():
        before = np.column_stack(
            [np.searchsorted(rows_of_statement[kind].line, faces.line) for kind in _VERTEX_STATEMENTS]
        )
        corners = np.where(corners < 0, corners + np.repeat(before, counts, axis=0) + 1, corners)
    faulty = (given & ((corners < 1) | (corners > sizes))).any(axis=1) | ~given[:, 0]
    expected = "faces by indices of its {:,} vertices, {:,} uv and {:,} normals"
    refuse_first_fault(faulty, corner_start, expected.format(*sizes))
    return counts, corners - 1


def _face_groups(
    path: Path, statements: Sequence[_Statement], face_line: Index
) -> tuple[list[tuple[str, str]], Index]:
    """Return the combinations of `usemtl` and `g` names, and for each face the index of its combination.

    face_line : (n,) line number of each face

    If no group and no material has a name, the names of objects (`o`) replace group names.
    """
    named = any(key in ("usemtl", "g") and value for _, key, value in statements)
    material_key, group_key = "usemtl", "g" if named else "o"
    current = {material_key: "", group_key: ""}
    numbers, lines, states = {("", ""): 0}, [-1], [0]
    for line, key, value in statements:
        if key in current:
            current[key] = value
            lines.append(line)
            states.append(numbers.setdefault((current[material_key], current[group_key]), len(numbers)))
    advice = "Export it with fewer, or without groups"
    limits.check_limit(path, len(numbers), limits.MAX_GROUPS, "groups", advice)
    return list(numbers), np.array(states)[np.searchsorted(lines, face_line) - 1]


def _notes_on_unread_statements(
    statement_keys: Collection[str], statements: Sequence[_Statement], has_normals: bool
) -> list[str]:
    """Return notes on statements that have no effect.

    statement_keys : first words of unknown statements
    statements : known statements except positions, uv, normals and faces; may contain smoothing groups
    has_normals : whether the file has normals; smoothing groups are then not needed, and get no note
    """
    kinds = {
        key: _KIND_OF_LEFT_OUT_STATEMENT.get(key)
        for key in statement_keys
        if key not in _STATEMENTS_WITHOUT_EFFECT
    }
    names = [f"{key} ({kind})" if kind else key for key, kind in kinds.items()]
    notes = [f"statements are left out: {join_names(names)}"] if names else []
    smoothing = {value for _, key, value in statements if key == "s"}
    if not has_normals and (len(smoothing) > 1 or smoothing & {"0", "off"}):
        notes.append("smoothing groups (s) are left out: the surface is smooth everywhere")
    return notes
