"""Reading of PLY files: the columns of their elements, and the mesh that the elements describe."""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dermis.base.arrays import Bytes, Doubles, Index, Numbers
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
from dermis.base.reading import read_file
from dermis.formats import size_limits as limits
from dermis.formats.materials import FileMaterial, Texture
from dermis.formats.parts import MaterialGroup, MeshFile, to_floats
from dermis.formats.polygons import (
    Polygons,
    check_polygon_sizes,
    missing_uv_notes,
    refuse_without_faces,
    without_small_polygons,
)
from dermis.formats.referenced_files import find_referenced_file
from dermis.formats.text_files import decode_text, join_names, parse_numbers, run_starts
from dermis.formats.vertex_colours import linear_colours
from dermis.mesh.geometry import expand_runs, weld

_MAX_HEADER_BYTES = 1 << 16  # bytes
_MAX_COUNT_OF_ELEMENT = {"vertex": limits.MAX_VERTICES, "face": limits.MAX_TRIANGLES}
_MAX_PROPERTIES_PER_ELEMENT, _MAX_LISTS_PER_ELEMENT = 256, 8
_BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_SPACE_BYTE = 32
_NUMPY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    "int64": "i8",
    "uint64": "u8",
    "float16": "f2",
}
UV_NAMES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"), ("s_coord", "t_coord"), ("tu", "tv"))
COLOUR_NAMES = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_FACE_LIST_NAMES = ("vertex_indices", "vertex_index")
_CLOUDCOMPARE_PREFIX = "scalar_"  # prefix that CloudCompare writes before names of scanner values
_ALPHA_NAMES = (("alpha",), ("diffuse_alpha",), ("a",))
_SCANNER_PROPERTIES = (
    *("confidence", "quality", "intensity", "density", "curvature", "radius", "flags", "value"),
    *("time", "timestamp", "id", "index", "original_index", "scan_index"),
    *("label", "class", "classification", "segment"),
)
PLY_PROPERTIES = (
    drawn_property("vertex: `x`, `y`, `z`", "positions"),
    drawn_property("vertex: `nx`, `ny`, `nz`", "normals; missing ones are computed"),
    drawn_property(f"vertex: {'; '.join(map(markdown_code, UV_NAMES))}", "uv"),
    drawn_property(
        f"vertex: {'; '.join(map(markdown_code, COLOUR_NAMES))}",
        "sRGB colours; integers of any size, or floats from 0 to 1",
    ),
    drawn_property_with_note("the same as floats above 1", "sRGB colours from 0 to 255"),
    noted_property(
        f"vertex: {markdown_code(name for (name,) in _ALPHA_NAMES)}", "no note if all are the same"
    ),
    drawn_property(f"face: {' or '.join(f'`{name}`' for name in _FACE_LIST_NAMES)}", "polygons"),
    noted_property("faces of one or two corners"),
    drawn_property("face: `texcoord`", "uv of the corners of a face"),
    drawn_property_with_note("face: an empty `texcoord`", "as skin without uv"),
    drawn_property_with_note("face: `texnumber`", "the picture of most faces is used for all"),
    drawn_property("tristrips: `vertex_indices`", "strips of triangles, with -1 between them"),
    drawn_property("`comment TextureFile NAME`", "colour picture in the folder of the file"),
    noted_property("`comment TextureFile NAME` of a missing file"),
    property_without_effect(
        f"values of scanners: {markdown_code(_SCANNER_PROPERTIES)}, `{_CLOUDCOMPARE_PREFIX}...`",
        "they do not describe the look of a surface",
        *_SCANNER_PROPERTIES,
    ),
    property_without_effect("other comments"),
    noted_property("other elements and properties"),
    refused_property("a file without faces", "a cloud of points"),
)
"""Elements and properties of PLY files."""
_PROPERTIES_WITHOUT_EFFECT = keys_of(PLY_PROPERTIES, "no effect")
_HEADER_END = re.compile(rb"[\r\n]end_header[ \t]*(\r\n|\r|\n)")
_STRUCT_CODES = dict(zip(dict.fromkeys(_NUMPY_TYPES.values()), "bBhHiIfdqQe", strict=True))


class _Property(NamedTuple):
    """Property of an element, which is a number or a list of numbers.

    length_dtype : type of the length of the list; "" for a number
    """

    name: str
    dtype: str
    length_dtype: str = ""


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property]


class _ListColumn(NamedTuple):
    """List property of an element: lengths of the lists (n,), and the concatenated items."""

    lengths: Index
    items: Numbers


class _Header(NamedTuple):
    """Header of a PLY file.

    order : byte order of the numbers, "<" or ">" as in NumPy types; "=" for a text file
    size : size of the header [bytes]
    pictures : file names of pictures, which the comments of the header state
    """

    order: str
    size: int
    elements: list[_Element]
    pictures: list[str]


class _Columns(dict[str, "Numbers | _ListColumn"]):
    """Columns of an element by property name; the methods that return columns mark them as used."""

    def __init__(self) -> None:
        super().__init__()
        self.used: set[str] = set()

    def take_properties(self, property_names: Sequence[str]) -> Numbers | None:
        """Return k scalar properties as columns of an array (n, k); None unless all of them exist."""
        columns = [column for name in property_names if isinstance(column := self.get(name), np.ndarray)]
        if not columns or len(columns) < len(property_names):
            return None
        self.used.update(property_names)
        return np.column_stack(columns)

    def take_first_complete_set(self, property_choices: Sequence[Sequence[str]]) -> Numbers | None:
        """Return the first set of properties that exists, as an array (n, k); None if no set exists."""
        return next(
            (one for names in property_choices if (one := self.take_properties(names)) is not None), None
        )

    def take_list(self, list_names: Sequence[str]) -> _ListColumn | None:
        """Return the first list property in `list_names` that exists; None if no such property exists."""
        for name in list_names:
            if isinstance(column := self.get(name), _ListColumn):
                self.used.add(name)
                return column
        return None


def read_ply(path: Path) -> MeshFile:
    """Read a .ply file.

    The uv are properties of vertices (`UV_NAMES`) or the list `texcoord` of faces. Vertex colours are sRGB.
    """
    data = read_file(path, "a PLY file", limits.MAX_FILE_BYTES)
    header = _read_header(path, data)
    tables = _read_elements(path, header, np.frombuffer(data, np.uint8, offset=header.size))
    vertices, faces, strips = (tables.get(name, _Columns()) for name in ("vertex", "face", "tristrips"))
    positions = vertices.take_properties("xyz")
    if positions is None:
        refuse(path, "vertices with x, y and z", f"they have {join_names(vertices)}", limits.DAMAGED_ADVICE)
    counts, index = _polygon_corners(path, faces, strips, len(positions))
    uv, uv_index = _corner_uv(path, vertices, faces, counts, index)
    normals = vertices.take_properties(("nx", "ny", "nz"))
    colours, notes = _vertex_colours(vertices)
    corners = np.column_stack((index, uv_index, np.full_like(index, -1) if normals is None else index))
    counts, corners, _, faults = without_small_polygons(counts, corners)
    if not len(counts):
        refuse_without_faces(path, len(positions))
    directions = np.empty((0, 3)) if normals is None else to_floats(normals)
    polygons = Polygons(counts, corners, np.asarray(positions, np.float64), uv, directions, colours)
    picture, unused = _main_picture(header.pictures, faces.take_properties(("texnumber",)))
    notes += [*faults, *missing_uv_notes(polygons), *unused, *_notes_on_unread_properties(tables)]
    materials: tuple[FileMaterial, ...] = ()
    if picture is not None and (file := find_referenced_file(path, picture)) is not None:
        materials = (FileMaterial(textures={"colour": Texture(file)}),)
    elif picture is not None:
        notes.append(f"its picture {picture} is not in its folder. Put it there, or set it with --colour")
    group = MaterialGroup((path.stem,), material=0 if materials else -1)
    parts = polygons.mesh_parts([group], np.zeros_like(counts), "by kind")
    return MeshFile(parts, materials=materials, notes=tuple(notes))


def _read_header(path: Path, ply_bytes: bytes) -> _Header:
    """Return the header of a PLY file after checking its counts of elements and properties.

    ply_bytes : bytes of the whole file

    Raises DermisError for an invalid header.
    """
    end = _HEADER_END.search(ply_bytes, 0, _MAX_HEADER_BYTES)
    if not ply_bytes.startswith(b"ply") or end is None:
        refuse(path, "a PLY file", "it cannot be read (its header is invalid)", limits.DAMAGED_ADVICE)
    size = end.end() - (end[1] == b"\r\n" and b"\n" not in ply_bytes[: end.start()])
    lines = decode_text(ply_bytes[: end.start()]).split("\n")
    words = [line.split() for line in lines]
    properties = sum(line[:1] == ["property"] for line in words)
    limits.check_limit(path, properties, _MAX_PROPERTIES_PER_ELEMENT, "properties", limits.DAMAGED_ADVICE)
    header = _Header("", size, [], [])
    for line, text in zip(words, lines, strict=True):
        match line:
            case ["format", name, *_] if name in _BYTE_ORDERS:
                header = header._replace(order=_BYTE_ORDERS[name])
            case ["element", *declared]:
                header.elements.append(_parse_element(path, declared, len(ply_bytes) - size))
            case ["property", *declared] if header.elements:
                header.elements[-1].properties.append(_parse_property(path, declared))
            case ["comment", key, _, *_] if key.lower() == "texturefile":
                header.pictures.append(text.split(None, 2)[2].strip())
    if not header.order:
        refuse(
            path, f"a PLY file of format {', '.join(_BYTE_ORDERS)}", "it has another", limits.DAMAGED_ADVICE
        )
    return header


def _parse_element(path: Path, header_words: Sequence[str], remaining_bytes: int) -> _Element:
    """Return an element that has no properties yet; refuse a count too large for a mesh or for the file.

    header_words : words after "element"
    """
    name, count = header_words if len(header_words) == 2 else ("", "")
    if not (count.isdecimal() and len(count) < 12):
        actual = f"got {' '.join(header_words)[:80]!r}"
        refuse(path, "elements with a name and a number", actual, limits.DAMAGED_ADVICE)
    limit = min(_MAX_COUNT_OF_ELEMENT.get(name, limits.MAX_TRIANGLES), remaining_bytes)
    limits.check_limit(path, int(count), limit, f"elements named {name!r}", limits.DECIMATE_ADVICE)
    return _Element(name, int(count), [])


def _parse_property(path: Path, header_words: Sequence[str]) -> _Property:
    """Return the property that a line of the header declares.

    header_words : words after "property"
    """
    is_list = header_words[:1] == ["list"]
    kinds = header_words[is_list:-1]
    if len(kinds) != 1 + is_list or not all(kind in _NUMPY_TYPES for kind in kinds):
        actual = f"got {' '.join(header_words)[:80]!r}"
        refuse(path, "properties with a name and known types", actual, limits.DAMAGED_ADVICE)
    return _Property(header_words[-1], *(_NUMPY_TYPES[kind] for kind in reversed(kinds)))


def _read_elements(path: Path, header: _Header, ply_data: Bytes) -> dict[str, _Columns]:
    """Return the columns of all elements by name.

    ply_data : bytes after the header
    """
    is_text = header.order == _BYTE_ORDERS["ascii"]
    if is_text:
        ply_data = parse_numbers(ply_data, len(run_starts(ply_data > _SPACE_BYTE)), np.float64).view(np.uint8)
    tables, position = dict[str, _Columns](), 0
    for element in header.elements:
        if element.count:
            reader = _ElementReader(path, element, header.order, is_text, ply_data)
            tables[element.name], position = reader.read(position)
    if position < len(ply_data) and (is_text or (ply_data[position:] > _SPACE_BYTE).any()):
        left, unit = (
            (len(ply_data) - position, "bytes")
            if not is_text
            else ((len(ply_data) - position) // 8, "numbers")
        )
        actual = f"{left:,} {unit} follow its last element"
        refuse(path, "as much data as the header states", actual, limits.DAMAGED_ADVICE)
    return tables


@dataclass(frozen=True)
class _ElementReader:
    """Reader of the rows of an element.

    order : byte order of the numbers, "<" or ">" as in NumPy types; "=" for a text file
    is_text : whether `data` holds the numbers of a text file, converted to float64
    """

    path: Path
    element: _Element
    order: str
    is_text: bool
    data: Bytes

    def read(self, byte_position: int) -> tuple[_Columns, int]:
        """Return the columns of the element, and the position after its last row.

        byte_position : position of the first row [bytes]
        """
        columns, properties = _Columns(), self.element.properties
        lists = [one for one in properties if one.length_dtype]
        limits.check_limit(
            self.path, len(lists), _MAX_LISTS_PER_ELEMENT, "lists of an element", limits.DAMAGED_ADVICE
        )
        lengths = dict(zip(lists, self._list_lengths(byte_position), strict=True))
        size = np.full(self.element.count, self._row_bytes_without_items(properties), np.int64)
        for one, length in lengths.items():
            size += length * self._dtype(one.dtype).itemsize
        start = byte_position + np.cumsum(size) - size
        end = int(start[-1] + size[-1])
        self._check_end(end)
        for one in properties:
            count = lengths.get(one, np.ones_like(start))
            start = start + (self._dtype(one.length_dtype).itemsize if one.length_dtype else 0)
            values = self._gather_values(start, count, one.dtype, size)
            columns[one.name] = _ListColumn(count, values) if one.length_dtype else values
            start = start + count * self._dtype(one.dtype).itemsize
        return columns, end

    def _dtype(self, type_name: str) -> np.dtype[Any]:
        return np.dtype(np.float64 if self.is_text else self.order + type_name)

    def _row_bytes_without_items(self, properties: Sequence[_Property]) -> int:
        """Return the size of a row without the items of its lists [bytes]."""
        return sum(self._dtype(one.length_dtype or one.dtype).itemsize for one in properties)

    def _check_end(self, end_byte: int) -> None:
        if end_byte > len(self.data):
            actual = f"it ends within its elements named {self.element.name!r}"
            refuse(self.path, "as much data as the header states", actual, limits.DAMAGED_ADVICE)

    def _gather_values(
        self, first_byte: Index, value_count: Index, type_name: str, row_bytes: Index
    ) -> Numbers:
        """Return the values of a property in all rows, concatenated.

        first_byte : (n,) position of the property's first value in each row [bytes]
        value_count : (n,) number of the property's values in each row, 1 unless it is a list
        type_name : NumPy type of the values, without byte order
        row_bytes : (n,) size of each row [bytes]
        """
        stored = self._dtype(type_name)
        if (row_bytes == row_bytes[0]).all() and (value_count == value_count[0]).all():
            shape, strides = (len(value_count), int(value_count[0])), (int(row_bytes[0]), stored.itemsize)
            values = np.ndarray(shape, stored, self.data, int(first_byte[0]), strides).reshape(-1)
        else:
            row, item = expand_runs(np.zeros_like(value_count), value_count)
            first = first_byte[row] + stored.itemsize * item
            values = self.data[first[:, None] + np.arange(stored.itemsize)].view(stored).reshape(-1)
        return np.asarray(values.astype(type_name))

    def _list_lengths(self, byte_position: int) -> list[Index]:
        """Return for each list property the lengths (n,) of its lists in the n rows.

        byte_position : position of the first row [bytes]
        """
        steps, skipped = list[_ListStep](), list[_Property]()
        for one in self.element.properties:
            skipped.append(one)
            if one.length_dtype:
                size = self._row_bytes_without_items(skipped[:-1])
                steps.append(_ListStep(size, self._dtype(one.length_dtype), self._dtype(one.dtype).itemsize))
                skipped = []
        if not steps:
            return []
        trailing_bytes, count = self._row_bytes_without_items(skipped), self.element.count
        lengths, end = self._read_rows(byte_position, steps, trailing_bytes, 1)
        if not self._lists_have_equal_lengths(byte_position, end - byte_position, steps, lengths[0]):
            lengths, _ = self._read_rows(byte_position, steps, trailing_bytes, count)
        return list(np.broadcast_to(lengths, (count, len(steps))).T)

    def _lists_have_equal_lengths(
        self, byte_position: int, row_bytes: int, list_steps: Sequence[_ListStep], list_lengths: Index
    ) -> bool:
        """Return whether the lists in every row have the same lengths as the lists in the first row.

        byte_position : position of the first row [bytes]
        row_bytes : size of the first row [bytes]
        list_steps : positions of the list properties in a row
        list_lengths : lengths of the lists in the first row
        """
        start = byte_position + row_bytes * np.arange(self.element.count)
        if start[-1] + row_bytes > len(self.data):
            return False
        for step, length in zip(list_steps, list_lengths.tolist(), strict=True):
            start = start + step.skip
            stored = self.data[start[:, None] + np.arange(step.length.itemsize)].view(step.length)
            if (stored != length).any():
                return False
            start = start + step.length.itemsize + length * step.item_size
        return True

    def _read_rows(
        self, byte_position: int, list_steps: Sequence[_ListStep], trailing_bytes: int, row_count: int
    ) -> tuple[Index, int]:
        """Read rows one after another; return the lengths of their lists, and the position of the end.

        The lengths have the shape (row_count, number of list properties).

        byte_position : position of the first row [bytes]
        list_steps : positions of the list properties in a row
        trailing_bytes : size of the properties after the last list [bytes]
        row_count : number of rows to read
        """
        lengths, data, end = [], memoryview(self.data.tobytes()), len(self.data)
        readers = [struct.Struct(self.order + _STRUCT_CODES[step.length.str[1:]]) for step in list_steps]
        walked = [
            (step.skip, reader.unpack_from, reader.size, step.item_size)
            for step, reader in zip(list_steps, readers, strict=True)
        ]
        try:
            for _ in range(row_count):
                for skip, unpack, length_size, item_size in walked:
                    byte_position += skip
                    (length,) = unpack(data, byte_position)
                    lengths.append(length)
                    byte_position += length_size + int(length) * item_size
                byte_position += trailing_bytes
        except struct.error:
            byte_position = end + 1
        self._check_end(end + 1 if lengths and min(lengths) < 0 else byte_position)
        return np.array(lengths, np.int64).reshape(row_count, len(list_steps)), byte_position


class _ListStep(NamedTuple):
    """Position of a list property in a row, relative to the previous list.

    skip : number of bytes between the previous list and this list
    length : type of the length of the list
    item_size : size of an item [byte]
    """

    skip: int
    length: np.dtype[Any]
    item_size: int


def _polygon_corners(
    path: Path, face_columns: _Columns, strip_columns: _Columns, vertex_count: int
) -> tuple[Index, Index]:
    """Return the number of corners of each face and strip triangle, and the vertex index of each corner.

    vertex_count : number of vertices in the file
    """
    own, counts, index = (
        face_columns.take_list(_FACE_LIST_NAMES),
        np.empty(0, np.int64),
        np.empty(0, np.int64),
    )
    if face_columns and own is None:
        refuse(
            path,
            f"faces with {_FACE_LIST_NAMES[0]}",
            f"they have {join_names(face_columns)}",
            limits.DAMAGED_ADVICE,
        )
    if own is not None:
        counts, index = own.lengths, own.items.astype(np.int64)
    if (strip := strip_columns.take_list(_FACE_LIST_NAMES)) is not None:
        triangles = _strip_triangles(strip)
        counts = np.concatenate([counts, np.full(len(triangles), 3)])
        index = np.concatenate([index, triangles.ravel()])
    check_polygon_sizes(path, counts)
    if len(index) and (index.min() < 0 or index.max() >= vertex_count):
        actual = f"they run from {index.min()} to {index.max()}"
        refuse(path, f"triangle indices from 0 to {vertex_count - 1}", actual, limits.DAMAGED_ADVICE)
    return counts, index


def _strip_triangles(strip_lists: _ListColumn) -> Index:
    """Return the triangles (t, 3) of strips that are separated by -1; every second triangle is reversed."""
    index = np.insert(strip_lists.items.astype(np.int64), np.cumsum(strip_lists.lengths), -1)
    place = np.arange(len(index))
    step = place - np.maximum.accumulate(np.where(index < 0, place, -1)) - 1
    triangles = np.column_stack((index[:-2], index[1:-1], index[2:]))
    odd = step[:-2] % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    a, b, c = triangles.T
    return np.asarray(triangles[(triangles.min(axis=1) >= 0) & (a != b) & (b != c) & (c != a)])


def _corner_uv(
    path: Path, vertex_columns: _Columns, face_columns: _Columns, corner_counts: Index, corner_vertex: Index
) -> tuple[Doubles, Index]:
    """Return uv coordinates (t, 2), and for each corner the index of its uv, -1 for a corner without uv.

    corner_counts : number of corners of each polygon
    corner_vertex : index of the vertex at each corner
    """
    wedges = face_columns.take_list(("texcoord",))
    if wedges is None:
        uv = vertex_columns.take_first_complete_set(UV_NAMES)
        none = np.empty((0, 2)), np.full_like(corner_vertex, -1)
        return none if uv is None else (to_floats(uv), corner_vertex)
    given, expected = wedges.lengths > 0, corner_counts[: len(wedges.lengths)]
    if (wedges.lengths[given] != 2 * expected[given]).any():
        actual = "some have other numbers of them"
        refuse(path, "texcoord with u and v for each corner of a face", actual, limits.DAMAGED_ADVICE)
    uv, uv_index = to_floats(wedges.items.reshape(-1, 2)), np.full_like(corner_vertex, -1)
    same = weld(uv)
    uv_index[: expected.sum()][np.repeat(given, expected)] = same
    unique = np.empty((same.max(initial=-1) + 1, 2))
    unique[same] = uv
    return unique, uv_index


def _vertex_colours(vertex_columns: _Columns) -> tuple[Doubles | None, list[str]]:
    """Return the linear colours (n, 3) of vertices, or None, and notes for the user on them."""
    values, alpha = (
        vertex_columns.take_first_complete_set(COLOUR_NAMES),
        vertex_columns.take_first_complete_set(_ALPHA_NAMES),
    )
    notes = []
    if alpha is not None and len(np.unique(alpha)) > 1:
        notes.append("the transparency of vertices (alpha) is left out")
    if values is None:
        return None, notes
    colours, faults = linear_colours(values)
    return colours, notes + faults


def _main_picture(
    picture_names: Sequence[str], picture_index: Numbers | None
) -> tuple[str | None, list[str]]:
    """Return the name of the picture that most faces use, and notes on the other pictures.

    picture_names : names of the pictures
    picture_index : (n, 1) index of each face's picture in `picture_names`; None if the file states none
    """
    if not picture_names:
        return None, []
    used, counts = np.unique(
        0 if picture_index is None else np.clip(picture_index, 0, len(picture_names) - 1), return_counts=True
    )
    chosen = picture_names[int(used[counts.argmax()])]
    others = [name for name in dict.fromkeys(picture_names) if name != chosen]
    return chosen, [f"of several pictures {chosen} is used; left out: {join_names(others)}"] if others else []


def _notes_on_unread_properties(element_columns: Mapping[str, _Columns]) -> list[str]:
    """Return a list with a note on the elements and properties without effect; empty if there are none."""
    ignored = [name for name, columns in element_columns.items() if not columns.used]
    ignored += [
        f"{element} {name}"
        for element, columns in element_columns.items()
        for name in columns
        if columns.used
        and name not in (*columns.used, *_PROPERTIES_WITHOUT_EFFECT)
        and not name.startswith(_CLOUDCOMPARE_PREFIX)
    ]
    return [f"these are left out: {join_names(ignored)}"] if ignored else []
