""".glb files as their JSON tree and buffer."""

from __future__ import annotations

import json
import struct
from typing import Any


def split_glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return tree and buffer of a .glb file."""
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def joined_glb(text: bytes, binary: bytes) -> bytes:
    """Return a .glb file with the given tree text and buffer."""
    text += b" " * (-len(text) % 4)
    chunks = ((b"JSON", text), (b"BIN\0", binary))
    body = b"".join(struct.pack("<I4s", len(one), kind) + one for kind, one in chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body
