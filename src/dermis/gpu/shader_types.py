"""Parser of WGSL declarations: structs as NumPy dtypes, and resource bindings by name.

Structs and bindings are declared only in shaders. Python reads the declarations from the shaders, so that the
data layouts of Python and the shaders cannot differ. Alignment rules: WGSL specification, section "Memory
Layout".
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterator, Set
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from operator import itemgetter

import numpy as np
from numpy.typing import DTypeLike

from dermis.base.errors import DermisError
from dermis.gpu.types import UniformRecord

LayoutEntry = dict[str, str]
"""Part of wgpu's bind group layout entry: type, format or dimensions of a resource."""
_COMMENT_PATTERN = re.compile(r"//[^\n]*")
_STRUCT_PATTERN = re.compile(r"struct\s+(\w+)\s*\{([^}]*)\}")
_MEMBER_PATTERN = re.compile(r"(\w+)\s*:\s*(array<\s*\w+\s*,\s*\d+\s*>|\w+(?:<\w+>)?)")
_BINDING_PATTERN = re.compile(
    r"@group\(0\)\s*@binding\((\d+)\)\s*var(?:<([\w, ]+)>)?\s+(\w+)\s*:\s*([\w<>, ]+?)\s*;([^\n]*)"
)

# name -> (numpy base, shape, alignment, size) in bytes
_WGSL_TYPES: dict[str, tuple[str, tuple[int, ...], int, int]] = {
    "f32": ("<f4", (), 4, 4),
    "i32": ("<i4", (), 4, 4),
    "u32": ("<u4", (), 4, 4),
    "vec2f": ("<f4", (2,), 8, 8),
    "vec3f": ("<f4", (3,), 16, 12),
    "vec4f": ("<f4", (4,), 16, 16),
    "vec2u": ("<u4", (2,), 8, 8),
    "vec2i": ("<i4", (2,), 8, 8),
    "vec4u": ("<u4", (4,), 16, 16),
    "mat4x4f": ("<f4", (4, 4), 16, 64),
}


@dataclass(frozen=True)
class Binding:
    """Resource binding that a shader declares.

    index : binding index in group 0
    name : name of the variable in the shader
    entry : part of wgpu's bind group layout entry that describes the resource, such as
        {"buffer": {"type": "uniform"}}
    """

    index: int
    name: str
    entry: dict[str, LayoutEntry]

    @property
    def has_content(self) -> bool:
        """Return whether the resource holds data; samplers do not."""
        return "sampler" not in self.entry

    @property
    def is_writable(self) -> bool:
        """Return whether the binding allows the shader to write the resource."""
        return "storage_texture" in self.entry or self.entry.get("buffer") == {"type": "storage"}

    @property
    def is_readable(self) -> bool:
        """Return whether the shader may read the resource; write-only textures cannot be read."""
        return bool(self.entry.get("storage_texture", {}).get("access") != "write-only")


@cache
def struct_dtype(wgsl_text: str, struct_name: str) -> np.dtype[np.void]:
    """Return the NumPy dtype of a WGSL struct, with the member offsets of the shader.

    A mat4x4f is stored as its transpose, because WGSL stores columns. A member may be an array of another
    struct.

    wgsl_text : text of the shader
    struct_name : name of the struct
    """
    dtype, _ = _parse_struct(dict(_STRUCT_PATTERN.findall(_COMMENT_PATTERN.sub("", wgsl_text))), struct_name)
    return dtype


def make_record(wgsl_text: str, struct_name: str, **values: object) -> UniformRecord:
    """Return a uniform record for a struct in a shader's text; members without a value are 0."""
    record = np.zeros((), dtype=struct_dtype(wgsl_text, struct_name))
    for member, value in values.items():
        record[member] = value
    return record


def uniform_type(wgsl_text: str, variable_name: str) -> str:
    """Return the name of the struct type of a uniform variable.

    wgsl_text : text of the shader
    variable_name : name of the variable
    """
    (struct,) = re.findall(
        rf"var<uniform>\s*{variable_name}\s*:\s*(\w+)", _COMMENT_PATTERN.sub("", wgsl_text)
    )
    return str(struct)


def used_member_selector(wgsl_text: str, variable_name: str) -> Callable[[bytes], Hashable]:
    """Return a function that selects, from the bytes of a uniform record, the bytes that the shader reads.

    The function selects all bytes if the shader passes the record to a function, or if the type of the
    variable is not a struct.

    wgsl_text : text of the shader
    variable_name : name of the uniform variable
    """
    code = _COMMENT_PATTERN.sub("", wgsl_text)
    declared = re.compile(rf"var<uniform>\s*{variable_name}\s*:\s*(\w+)")
    used = re.findall(rf"(?<![.\w]){variable_name}\b(?:\.(\w+))?", declared.sub("", code))
    (struct,) = declared.findall(code)
    if not used or "" in used or struct not in dict(_STRUCT_PATTERN.findall(code)):
        return lambda raw: raw
    return itemgetter(*_member_slices(struct_dtype(wgsl_text, struct), set(used)))


def _member_slices(dtype: np.dtype[np.void], member_names: Set[str]) -> Iterator[slice]:
    """Yield the byte range of each run of consecutive struct members that are in `member_names`."""
    fields = dict(dtype.fields or {})
    for used, names in groupby(fields, member_names.__contains__):
        if used:
            extents = [(fields[name][1], fields[name][0].itemsize) for name in names]
            yield slice(extents[0][0], sum(extents[-1]))


def _parse_struct(struct_bodies: dict[str, str], struct_name: str) -> tuple[np.dtype[np.void], int]:
    if struct_name not in struct_bodies:
        raise DermisError(f"struct {struct_name}: expected the shader to declare it, but it does not.")
    names: list[str] = []
    formats: list[DTypeLike] = []
    offsets: list[int] = []
    end, align = 0, 4
    for member, kind in _MEMBER_PATTERN.findall(struct_bodies[struct_name]):
        base, member_align, size = _parse_member(struct_bodies, kind)
        end = _round_up_to_alignment(end, member_align)
        names.append(member)
        formats.append(base)
        offsets.append(end)
        end += size
        align = max(align, member_align)
    size = _round_up_to_alignment(end, align)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size}), align


def _parse_member(struct_bodies: dict[str, str], wgsl_type: str) -> tuple[DTypeLike, int, int]:
    if array := re.match(r"array<\s*(\w+)\s*,\s*(\d+)\s*>", wgsl_type):
        base, align, size = _parse_member(struct_bodies, array[1])
        count = int(array[2])
        if _round_up_to_alignment(size, align) != np.dtype(base).itemsize:
            raise DermisError(f"{wgsl_type}: expected array elements without padding between them.")
        return (base, (count,)), align, count * size
    if wgsl_type in _WGSL_TYPES:
        scalar, shape, align, size = _WGSL_TYPES[wgsl_type]
        return (scalar, shape), align, size
    dtype, align = _parse_struct(struct_bodies, wgsl_type)
    return dtype, align, dtype.itemsize


def _round_up_to_alignment(byte_count: int, alignment: int) -> int:
    return -(-byte_count // alignment) * alignment


def shader_bindings(wgsl_text: str) -> tuple[Binding, ...]:
    """Return the resource bindings that a shader declares, ordered by index; all are in group 0.

    A float texture cannot be filtered unless the comment "filtered" follows its declaration. A sampler
    filters unless the comment "non-filtering" follows its declaration.

    wgsl_text : text of the shader
    """
    found = [
        Binding(int(index), name, _layout_entry((space or "").replace(" ", ""), kind.replace(" ", ""), note))
        for index, space, name, kind, note in _BINDING_PATTERN.findall(wgsl_text)
    ]
    return tuple(sorted(found, key=lambda one: one.index))


def _layout_entry(address_space: str, wgsl_type: str, comment: str) -> dict[str, LayoutEntry]:
    if address_space.startswith("uniform"):
        return {"buffer": {"type": "uniform"}}
    if address_space.startswith("storage"):
        return {"buffer": {"type": "storage" if "read_write" in address_space else "read-only-storage"}}
    if wgsl_type == "sampler_comparison":
        return {"sampler": {"type": "comparison"}}
    if wgsl_type == "sampler":
        return {"sampler": {"type": "non-filtering" if "non-filtering" in comment else "filtering"}}
    if storage := re.match(r"texture_storage_2d(_array)?<(\w+),(\w+)>", wgsl_type):
        dimension = "2d-array" if storage[1] else "2d"
        access = {"write": "write-only", "read": "read-only", "read_write": "read-write"}[storage[3]]
        return {"storage_texture": {"format": storage[2], "access": access, "view_dimension": dimension}}
    return {"texture": _texture_layout(wgsl_type, comment)}


def _texture_layout(wgsl_type: str, comment: str) -> LayoutEntry:
    dimension = "2d-array" if "_array" in wgsl_type else "2d"
    if wgsl_type.startswith("texture_depth"):
        return {"sample_type": "depth", "view_dimension": dimension}
    element = wgsl_type[wgsl_type.index("<") + 1 : -1]
    loaded = {"f32": "unfilterable-float", "u32": "uint", "i32": "sint"}[element]
    return {"sample_type": "float" if "// filtered" in comment else loaded, "view_dimension": dimension}
