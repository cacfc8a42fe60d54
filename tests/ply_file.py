"""PLY files for tests, in text and in both byte orders."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence

CODES = {
    "char": "b",
    "uchar": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "uint": "I",
    "float": "f",
    "double": "d",
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
Row = Sequence[float | Sequence[float]]


def ply_bytes(
    elements: Mapping[str, tuple[str, Sequence[Row]]], order: str = "ascii", comments: Sequence[str] = ()
) -> bytes:
    """Return a PLY file.

    elements : properties separated by commas, such as "float x, list uchar int vertex_indices", and the rows
    order : format, see `ORDERS`
    """
    header = ["ply", f"format {order} 1.0", *(f"comment {comment}" for comment in comments)]
    body = b""
    for element, (properties, rows) in elements.items():
        words = [declared.split() for declared in properties.split(",")]
        header.append(f"element {element} {len(rows)}")
        header += [f"property {' '.join(declared)}" for declared in words]
        for row in rows:
            pairs = [
                pair for declared, value in zip(words, row, strict=True) for pair in _values(declared, value)
            ]
            if order == "ascii":
                body += " ".join(f"{value:.9g}" for _, value in pairs).encode() + b"\n"
            else:
                codes = ORDERS[order] + "".join(CODES[kind] for kind, _ in pairs)
                body += struct.pack(codes, *(value for _, value in pairs))
    return "\n".join([*header, "end_header\n"]).encode() + body


def _values(declared: Sequence[str], value: float | Sequence[float]) -> Iterator[tuple[str, float]]:
    """Yield type and value of each number of a property."""
    if declared[0] != "list":
        assert isinstance(value, float | int)
        yield declared[0], value
    else:
        assert isinstance(value, Sequence)
        yield declared[1], len(value)
        yield from ((declared[2], one) for one in value)
