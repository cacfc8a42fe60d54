"""Damage suited to the kind of a file: lines of text, trees, pictures with valid checksums, bytes."""

from __future__ import annotations

import json
import struct
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random

from adversity.case import Input
from adversity.glb import joined_glb, split_glb
from adversity.headers import changed_header
from adversity.lines import changed_lines, encoded
from adversity.raw import changed_bytes
from adversity.trees import changed_tree, json_text, toml_text

_PLY_END = b"end_header\n"


def damaged(sound: Input, rng: Random) -> Input:
    """Return the input with one or sometimes two of its files damaged."""
    files = dict(sound.files)
    for _ in range(rng.choice((1, 1, 1, 2))):
        name = rng.choice(sound.changed or tuple(files))
        how = _BY_SUFFIX.get(Path(name).suffix, changed_bytes) if rng.random() < 0.85 else changed_bytes
        files[name] = _or_bytes(how, files[name], rng)
    return replace(sound, files=files)


def scarred(sound: Input, rng: Random) -> Input:
    """Return the input with changed bytes in one file, as by a faulty disk, which checksums detect."""
    name = rng.choice(sound.changed or tuple(sound.files))
    return replace(sound, files={**sound.files, name: changed_bytes(sound.files[name], rng)})


def _or_bytes(how: Callable[[bytes, Random], bytes], data: bytes, rng: Random) -> bytes:
    """Apply a change, or change bytes if the file is already too damaged to be parsed."""
    try:
        return how(data, rng)
    except (ValueError, KeyError, IndexError, RecursionError, struct.error):
        return changed_bytes(data, rng)


def _text(data: bytes, rng: Random) -> bytes:
    return encoded(changed_lines(data.decode(), rng, rare=rng.random() < 0.7))


def _toml(data: bytes, rng: Random) -> bytes:
    if rng.random() < 0.25:
        return _text(data, rng)
    return encoded(toml_text(changed_tree(tomllib.loads(data.decode()), rng)))


def _json(data: bytes, rng: Random) -> bytes:
    return encoded(json_text(changed_tree(json.loads(data), rng)))


def _json_lines(data: bytes, rng: Random) -> bytes:
    """Change one line as a tree, or lines as text."""
    lines = data.splitlines()
    if rng.random() < 0.3:
        return _text(data, rng)
    k = rng.randrange(len(lines))
    lines[k] = _json(lines[k], rng)
    return b"\n".join(lines)


def _glb(data: bytes, rng: Random) -> bytes:
    """Change the tree or the buffer of a .glb file."""
    tree, binary = split_glb(data)
    if rng.random() < 0.2:
        return joined_glb(encoded(json_text(tree)), changed_bytes(binary, rng))
    return joined_glb(encoded(json_text(changed_tree(tree, rng))), binary)


def _ply(data: bytes, rng: Random) -> bytes:
    """Change lines of the header, or any line of a text file."""
    head, sign, body = data.partition(_PLY_END)
    if b"ascii" in head and rng.random() < 0.5:
        return _text(data, rng)
    return _text(head, rng) + sign + body


_BY_SUFFIX: dict[str, Callable[[bytes, Random], bytes]] = {
    **dict.fromkeys((".obj", ".mtl", ".csv", ".made-of"), _text),
    **dict.fromkeys((".png", ".jpg", ".tif", ".exr", ".hdr"), changed_header),
    ".toml": _toml,
    ".json": _json,
    ".gltf": _json,
    ".jsonl": _json_lines,
    ".glb": _glb,
    ".ply": _ply,
}
